"""Which output folder a run may write: a free one, one that holds only what such a run wrote, or its own stopped one.

Folders are written under a hidden name (``whole_folders``); what the run was given is noted there, so that a run with
other inputs neither goes on in it nor is taken for done.
"""

from pathlib import Path

from psvideo.errors import AllDoneError, PsvideoError, UsageError
from psvideo.formats.clip_layout import PLAN_FILE
from psvideo.formats.whole_files import refuse_existing
from psvideo.formats.written_files import refuse_others

SETTINGS = ".settings"
"""In a folder that is or was written: a digest of what the run was given, so that only the same run resumes it."""
UNFINISHED = ".*.partial*"
"""Files that a run was writing when it was killed (``whole_files``); libraries that know kinds of files by their
endings add one."""


def refuse_folder(path: Path, *, mark: str, force: bool, resume: bool = False, settings: str = "") -> None:
    """Raise UsageError where an output folder exists and may not be replaced, or a stopped run not be resumed.

    ``force`` replaces only what a run like this wrote: a folder that holds ``mark`` and no footage, and no file beside
    those that the run noted; or nothing at all.
    ``resume`` goes on with a stopped run of the same ``settings``; where there is none, and the folder was finished
    with these and is not to be replaced, AllDoneError is raised.
    """
    stopped = unfinished_folder_of(path).is_dir()
    if resume and stopped:
        _refuse_other_settings(path, settings)
    elif resume and settings and not force and noted_settings(path) == settings:
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


def unfinished_folder_of(path: Path) -> Path:
    """Return the hidden folder in which an output is written until it is whole; it need not be there."""
    path = path.resolve()
    return path.with_name(f".{path.name}.partial")


def noted_settings(folder: Path) -> str:
    """Return the digest of what a folder's run was given, empty where none is noted."""
    noted = folder / SETTINGS
    return noted.read_text(encoding="utf-8") if noted.is_file() else ""


def refuse_what_came(path: Path, *, resumable: bool) -> None:
    """Raise PsvideoError where somebody saved a file meanwhile into the folder that is to be replaced."""
    try:
        refuse_others(path)
    except UsageError as fault:
        waits = " What was made now waits beside it: `resume` with `force` puts it in its place." if resumable else ""
        raise PsvideoError(f"{fault}{waits}") from fault


def _refuse_other_settings(path: Path, settings: str) -> None:
    beside = unfinished_folder_of(path)
    nothing_begun = all(one.match(UNFINISHED) for one in beside.iterdir())
    if noted_settings(beside) != settings and not nothing_begun:
        raise UsageError(
            f"{path}: the run that was stopped here had other settings, footage, plan, rig or timing, and mixing both "
            "would spoil the sequence. Give the same ones again, or leave `resume` out to start again."
        )
