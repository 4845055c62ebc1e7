"""Output folders appear whole: written as a hidden folder beside their name, and renamed at the end.

A run that was stopped leaves its hidden folder behind; ``resume`` goes on in it, and every file in it is whole.
"""

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.whole_files import refuse_existing

SETTINGS = ".settings"
"""In a folder that is being written: the run's inputs, so that only the same run resumes it."""


@contextlib.contextmanager
def whole_folder(
    path: Path, *, mark: str, force: bool = False, resume: bool = False, settings: str = ""
) -> Iterator[Path]:
    """Give a folder to write into; when the block ends well it gets the name ``path``, replacing what ``force`` allows.

    ``mark`` is the file by which a folder of this kind is known. A block that fails leaves nothing under ``path``; what
    it had finished stays in the hidden folder for ``resume``, which goes on only with the same ``settings``, and is
    removed by the next run that does not resume. Raises UsageError where the output exists, or where there is nothing
    to resume; PsvideoError where the folder cannot be written.
    """
    refuse_folder(path, mark=mark, force=force)
    path = path.resolve()
    beside = path.with_name(f".{path.name}.partial")
    if resume:
        _refuse_other_settings(path, beside, settings)
    try:
        if not resume:
            shutil.rmtree(beside, ignore_errors=True)
        beside.mkdir(parents=True, exist_ok=True)
        (beside / SETTINGS).write_text(settings, encoding="utf-8")
        yield beside
        (beside / SETTINGS).unlink()
        _replace(beside, path)
    except OSError as fault:
        raise PsvideoError(
            f"{path}: cannot be written ({fault.strerror or fault}). Nothing was left under that name: make room or "
            "check the folder's permissions, then run the command again."
        ) from fault


def refuse_folder(path: Path, *, mark: str, force: bool) -> None:
    """Raise UsageError where an output folder exists and may not be replaced.

    ``force`` replaces only what a run like this wrote: a folder that holds ``mark`` and no footage, or nothing at all.
    """
    refuse_existing(path, force=force)
    if not path.exists():
        return
    empty = path.is_dir() and not any(path.iterdir())
    footage = (path / "plan.toml").exists() and not mark.startswith("truth/")
    if not empty and (footage or not (path / mark).is_file()):
        found = "holds a plan.toml" if footage else f"holds no {mark}"
        raise UsageError(
            f"{path}: {found}, so it is nothing that this command wrote, and is not replaced, not even with `force`. "
            "Name another output."
        )


def _refuse_other_settings(path: Path, beside: Path, settings: str) -> None:
    if not beside.is_dir():
        raise UsageError(f"{path}: there is no stopped run to resume here. Leave `resume` out to start again.")
    noted = beside / SETTINGS
    if not noted.is_file() or noted.read_text(encoding="utf-8") != settings:
        raise UsageError(
            f"{path}: the run that was stopped here had other settings, footage, plan, rig or timing, and mixing both "
            "would spoil the sequence. Give the same ones again, or leave `resume` out to start again."
        )


def _replace(beside: Path, path: Path) -> None:
    """Rename the finished folder; what stood there is moved out of the way first and removed last."""
    if not path.exists():
        beside.rename(path)
        return
    old = path.with_name(f".{path.name}.old-{os.getpid()}")
    path.rename(old)
    beside.rename(path)
    shutil.rmtree(old, ignore_errors=True)
