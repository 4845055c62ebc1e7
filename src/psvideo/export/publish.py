"""Output folders appear whole: written as a hidden folder beside their name, and renamed at the end.

A run that was stopped leaves its hidden folder behind; ``resume`` goes on in it, and every file in it is whole.
"""

import contextlib
import shutil
from collections.abc import Iterator
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError
from psvideo.files import refuse_existing


@contextlib.contextmanager
def whole_folder(path: Path, *, force: bool = False, resume: bool = False) -> Iterator[Path]:
    """Give a folder to write into; when the block ends well it gets the name ``path``, replacing what ``force`` allows.

    A block that fails leaves nothing under ``path``; what it had finished stays in the hidden folder for ``resume``,
    and is removed by the next run that does not resume. Raises UsageError where the output exists, or where there is
    nothing to resume; PsvideoError where the folder cannot be written.
    """
    path = path.resolve()
    refuse_existing(path, force=force)
    beside = path.with_name(f".{path.name}.partial")
    if resume and not beside.is_dir():
        raise UsageError(f"{path}: there is no stopped run to resume here. Leave --resume out to begin anew.")
    try:
        if not resume:
            shutil.rmtree(beside, ignore_errors=True)
        beside.mkdir(parents=True, exist_ok=True)
        yield beside
        _replace(beside, path)
    except OSError as fault:
        raise PsvideoError(
            f"{path}: cannot be written ({fault.strerror or fault}). Nothing was left under that name: make room or "
            "check the folder's permissions, then run the command again with --resume."
        ) from fault


def _replace(beside: Path, path: Path) -> None:
    """Rename the finished folder; what stood there is moved out of the way first and removed last."""
    if not path.exists():
        beside.rename(path)
        return
    old = path.with_name(f".{path.name}.old")
    path.rename(old)
    beside.rename(path)
    if old.is_dir():
        shutil.rmtree(old, ignore_errors=True)
    else:
        old.unlink()
