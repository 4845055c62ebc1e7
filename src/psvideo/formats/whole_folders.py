"""Output folders appear whole: written as a hidden folder beside their name, and renamed at the end.

A run that was stopped leaves its hidden folder behind; ``resume`` goes on in it, and every file in it is whole. Which
folders may be written at all, ``free_folders`` knows.
"""

import contextlib
import errno
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from psvideo.errors import PsvideoError
from psvideo.formats.clip_layout import PLAN_FILE
from psvideo.formats.free_folders import (
    SETTINGS,
    UNFINISHED,
    noted_settings,
    refuse_folder,
    refuse_what_came,
    unfinished_folder_of,
)
from psvideo.formats.whole_files import not_written, write_text
from psvideo.formats.written_files import note_written

if sys.platform != "win32":
    import fcntl

FULL = (errno.ENOSPC, errno.EDQUOT)
"""What systems say of a disk, or of somebody's share of it, that is full."""
KEPT = "What was finished is kept; the same command with `resume` goes on."
"""Noted on a stop (``BaseException.add_note``), for whoever ends the command."""


@contextlib.contextmanager
def whole_folder(
    path: Path, *, mark: str, force: bool = False, resume: bool = False, settings: str = "", kept: bool = True
) -> Iterator[Path]:
    """Give a folder to write into; when the block ends well it gets the name ``path``, replacing what ``force`` allows.

    ``mark`` is the file by which a folder of this kind is known. A block that fails leaves nothing under ``path``; what
    it had finished stays in the hidden folder for ``resume``, which goes on only with the same ``settings``, begins
    where nothing was begun, and is removed by the next run that does not resume. Without ``kept``, of runs that
    nothing resumes, it goes at once. Raises UsageError where the output exists or was begun with other settings,
    AllDoneError where ``resume`` finds it finished; PsvideoError where the folder cannot be written.
    """
    refuse_folder(path, mark=mark, force=force, resume=resume, settings=settings)
    path = path.resolve()
    beside = unfinished_folder_of(path)
    resumable = kept and bool(settings)
    with _said_where(path, resumable=resumable):
        beside.mkdir(parents=True, exist_ok=True)
        with _held(beside, path), contextlib.nullcontext() if kept else _removed_on_fault(beside):
            for left in [*(beside.rglob(UNFINISHED) if resume else beside.iterdir())]:
                _remove(left)
            for old in path.parent.glob(_old_name(path, "*")) if path.exists() else ():
                shutil.rmtree(old, ignore_errors=True)
            if settings:
                write_text(beside / SETTINGS, settings)
            with _still_there(beside, path, settings), _kept_noted(beside, resumable=resumable):
                yield beside
            refuse_what_came(path, resumable=resumable)
            if mark != PLAN_FILE:  # footage is never replaced, and a full disk costs none of it
                note_written(beside)
            _replace(beside, path)


@contextlib.contextmanager
def begun_folder(path: Path, *, mark: str, force: bool = False, settings: str = "") -> Iterator[Path]:
    """Give the hidden folder of ``whole_folder`` to write a part of its files into, beside others who do so; it stays.

    Raises as ``whole_folder`` with ``resume``.
    """
    refuse_folder(path, mark=mark, force=force, resume=True, settings=settings)
    path = path.resolve()
    beside = unfinished_folder_of(path)
    with _said_where(path, resumable=bool(settings)):
        beside.mkdir(parents=True, exist_ok=True)
        with _held(beside, path, shared=True):
            if noted_settings(beside) != settings:
                write_text(beside / SETTINGS, settings)
            with _still_there(beside, path, settings):
                yield beside


def forget_begun(path: Path) -> None:
    """Remove what a run that was stopped left of an output, unless one is writing it now, which raises PsvideoError."""
    path = path.resolve()
    if (beside := unfinished_folder_of(path)).is_dir():
        with _said_where(path), _held(beside, path):
            shutil.rmtree(beside)


@contextlib.contextmanager
def _removed_on_fault(beside: Path) -> Iterator[None]:
    try:
        yield
    except BaseException:
        shutil.rmtree(beside, ignore_errors=True)
        raise


@contextlib.contextmanager
def _still_there(beside: Path, path: Path, settings: str) -> Iterator[None]:
    """Raise PsvideoError where somebody removed the hidden folder while a block wrote into it: what came afterwards is
    not the whole, and is removed too."""
    try:
        yield
    finally:
        gone = noted_settings(beside) != settings
        if gone:
            shutil.rmtree(beside, ignore_errors=True)
    if gone:
        raise PsvideoError(
            f"{path}: the folder {beside.name} in which it was written was removed meanwhile, with what had been "
            "finished. Nothing was left under that name: run the command again."
        )


@contextlib.contextmanager
def _kept_noted(beside: Path, *, resumable: bool) -> Iterator[None]:
    """Note on a stop that what was finished is kept, where any file was and a run that is resumed goes on from it."""
    try:
        yield
    except KeyboardInterrupt as stop:
        if resumable and any(_is_finished(file) for file in beside.rglob("*")):
            stop.add_note(KEPT)
        raise


def _is_finished(file: Path) -> bool:
    return file.is_file() and file.name != SETTINGS and not file.match(UNFINISHED)


@contextlib.contextmanager
def _said_where(path: Path, *, resumable: bool = False) -> Iterator[None]:
    """Make of a folder that cannot be written a PsvideoError that names it, and says of a run that may be resumed how
    not to lose what is finished."""
    kept = (
        " Give `resume` with it: then what is finished is kept; without it the run starts from the beginning."
        if resumable
        else ""
    )
    try:
        yield
    except OSError as fault:
        raise PsvideoError(f"{not_written(path, fault)}{kept}") from fault
    except PsvideoError as fault:
        if not (kept and isinstance(fault.__cause__, OSError) and fault.__cause__.errno in FULL):
            raise
        raise PsvideoError(f"{fault}{kept}") from fault.__cause__


@contextlib.contextmanager
def _held(beside: Path, path: Path, *, shared: bool = False) -> Iterator[None]:
    """Keep other runs from writing the same output meanwhile, or let in those that share it; a process that ends in any
    way holds it no more. Some network drives know no locks, and there nobody is kept out."""
    if sys.platform == "win32":
        yield
        return
    folder = os.open(beside, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):
            try:
                fcntl.flock(folder, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
            except BlockingIOError:
                raise PsvideoError(
                    f"{path}: another run is writing this output now. Wait for it, or name another output."
                ) from None
        yield
    finally:
        os.close(folder)


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _old_name(path: Path, process: str) -> str:
    """Return the name under which a folder that is replaced stands for a moment; one that is killed then leaves it."""
    return f".{path.name}.old-{process}"


def _replace(beside: Path, path: Path) -> None:
    """Rename the finished folder; what stood there is moved out of the way first and removed last."""
    if not path.exists():
        beside.rename(path)
        return
    old = path.with_name(_old_name(path, str(os.getpid())))
    path.rename(old)
    beside.rename(path)
    shutil.rmtree(old, ignore_errors=True)
