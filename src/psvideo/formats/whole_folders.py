"""Output folders appear whole: written as a hidden folder beside their name, and renamed at the end.

A run that was stopped leaves its hidden folder behind; ``resume`` goes on in it, and every file in it is whole. What
the run was given is noted in both, so that a run with other inputs neither goes on nor is taken for done.
"""

import contextlib
import errno
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from psvideo.errors import AllDoneError, PsvideoError, UsageError
from psvideo.formats.plan_toml import PLAN_FILE
from psvideo.formats.whole_files import not_written, refuse_existing, write_text
from psvideo.formats.written_files import note_written, refuse_others

if sys.platform != "win32":
    import fcntl

SETTINGS = ".settings"
"""In a folder that is or was written: a digest of what the run was given, so that only the same run resumes it."""
UNFINISHED = ".*.partial*"
"""Files that a run was writing when it was killed (``whole_files``); libraries that know kinds of files by their
endings add one."""
FULL = (errno.ENOSPC, errno.EDQUOT)
"""What systems say of a disk, or of somebody's share of it, that is full."""
KEPT = "What was finished is kept; the same command with `resume` goes on."
"""Noted on a stop (``BaseException.add_note``), for whoever ends the command."""


@contextlib.contextmanager
def whole_folder(
    path: Path, *, mark: str, force: bool = False, resume: bool = False, settings: str = ""
) -> Iterator[Path]:
    """Give a folder to write into; when the block ends well it gets the name ``path``, replacing what ``force`` allows.

    ``mark`` is the file by which a folder of this kind is known. A block that fails leaves nothing under ``path``; what
    it had finished stays in the hidden folder for ``resume``, which goes on only with the same ``settings``, begins
    where nothing was begun, and is removed by the next run that does not resume. Raises UsageError where the output
    exists or was begun with other settings, AllDoneError where ``resume`` finds it finished; PsvideoError where the
    folder cannot be written.
    """
    refuse_folder(path, mark=mark, force=force, resume=resume, settings=settings)
    path = path.resolve()
    beside = _beside(path)
    with _said_where(path, resumable=bool(settings)):
        beside.mkdir(parents=True, exist_ok=True)
        with _held(beside, path):
            for left in [*(beside.rglob(UNFINISHED) if resume else beside.iterdir())]:
                _remove(left)
            for old in path.parent.glob(_old_name(path, "*")) if path.exists() else ():
                shutil.rmtree(old, ignore_errors=True)
            if settings:
                write_text(beside / SETTINGS, settings)
            with _still_there(beside, path, settings), _kept_noted(beside, resumable=bool(settings)):
                yield beside
            _refuse_what_came(path, resumable=bool(settings))
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
    beside = _beside(path)
    with _said_where(path, resumable=bool(settings)):
        beside.mkdir(parents=True, exist_ok=True)
        with _held(beside, path, shared=True):
            if _noted(beside) != settings:
                write_text(beside / SETTINGS, settings)
            with _still_there(beside, path, settings):
                yield beside


def forget_begun(path: Path) -> None:
    """Remove what a run that was stopped left of an output, unless one is writing it now, which raises PsvideoError."""
    path = path.resolve()
    if (beside := _beside(path)).is_dir():
        with _said_where(path), _held(beside, path):
            shutil.rmtree(beside)


def unfinished_folder_of(path: Path) -> Path:
    """Return the hidden folder in which an output is written until it is whole; it need not be there."""
    return _beside(path.resolve())


@contextlib.contextmanager
def _still_there(beside: Path, path: Path, settings: str) -> Iterator[None]:
    """Raise PsvideoError where somebody removed the hidden folder while a block wrote into it: what came afterwards is
    not the whole, and is removed too."""
    try:
        yield
    finally:
        gone = _noted(beside) != settings
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


def refuse_folder(path: Path, *, mark: str, force: bool, resume: bool = False, settings: str = "") -> None:
    """Raise UsageError where an output folder exists and may not be replaced, or a stopped run not be resumed.

    ``force`` replaces only what a run like this wrote: a folder that holds ``mark`` and no footage, and no file beside
    those that the run noted; or nothing at all.
    ``resume`` goes on with a stopped run of the same ``settings``; where there is none, and the folder was finished
    with these and is not to be replaced, AllDoneError is raised.
    """
    stopped = _beside(path.resolve()).is_dir()
    if resume and stopped:
        _refuse_other_settings(path, settings)
    elif resume and settings and not force and _noted(path) == settings:
        raise AllDoneError(
            f"{path}: all done. The run ended well, with the same footage and settings, so nothing was written."
        )
    footage = (path / PLAN_FILE).exists() and not mark.startswith("truth/")
    refuse_existing(path, force=force or footage)
    if not path.exists():
        return
    empty = path.is_dir() and not any(path.iterdir())
    if footage:
        raise UsageError(
            f"{path}: exists already and holds a plan.toml: it is footage, and not replaced, not even with `force`. "
            "Name another output."
        )
    if not empty and not (path / mark).is_file():
        raise UsageError(
            f"{path}: holds no {mark}, so it is nothing that this command wrote, and is not replaced, not even with "
            "`force`. Name another output."
        )
    refuse_others(path)


def _beside(path: Path) -> Path:
    """Return the hidden folder in which a folder is written."""
    return path.with_name(f".{path.name}.partial")


def _noted(folder: Path) -> str:
    """Return the digest of what a folder's run was given, empty where none is noted."""
    noted = folder / SETTINGS
    return noted.read_text(encoding="utf-8") if noted.is_file() else ""


def _refuse_other_settings(path: Path, settings: str) -> None:
    beside = _beside(path.resolve())
    nothing_begun = all(one.match(UNFINISHED) for one in beside.iterdir())
    if _noted(beside) != settings and not nothing_begun:
        raise UsageError(
            f"{path}: the run that was stopped here had other settings, footage, plan, rig or timing, and mixing both "
            "would spoil the sequence. Give the same ones again, or leave `resume` out to start again."
        )


def _refuse_what_came(path: Path, *, resumable: bool) -> None:
    """Raise PsvideoError where somebody saved a file meanwhile into the folder that is to be replaced."""
    try:
        refuse_others(path)
    except UsageError as fault:
        waits = " What was made now waits beside it: `resume` with `force` puts it in its place." if resumable else ""
        raise PsvideoError(f"{fault}{waits}") from fault


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
