"""Paths that somebody hands over: text or ``pathlib.Path``, checked before anything is opened."""

import stat
from pathlib import Path

from psvideo.errors import PsvideoError, UsageError, check_kind

OTHER_THAN_FILES = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFDIR: "a folder",
}


def path_of(name: str, given: Path | str) -> Path:
    """Return a parameter as a path; raises UsageError where it is neither text nor a path, or no file can have it.

    >>> path_of("rig", "lights/rig.toml").name
    'rig.toml'
    """
    check_kind(name, given, (str, Path), "a path, as text or pathlib.Path")
    check_text(Path(given))
    return Path(given)


def check_text(path: Path) -> None:
    """Raise UsageError where a name is no text: results, reports and programs hold it as UTF-8."""
    try:
        clear = b"\0" not in str(path).encode()
    except UnicodeEncodeError:
        clear = False
    if not clear:
        raise UsageError(f"{str(path)!a}: this name is not UTF-8 text, which files of results need. Rename it.")


def check_file(path: Path) -> None:
    """Raise PsvideoError where something else than a file stands under this name, which reading may wait for without
    end; OSError where nothing does."""
    kind = stat.S_IFMT(path.stat().st_mode)
    if kind != stat.S_IFREG:
        raise PsvideoError(f"{path}: is {OTHER_THAN_FILES.get(kind, 'no file')}, and a file is expected. Name a file.")


def not_there(path: Path) -> PsvideoError:
    """Return what to raise where a file of a folder that was read is gone, or was a link to another that is."""
    if path.is_symlink():
        return PsvideoError(
            f"{path}: is a link to {path.readlink()}, which is not there. Put the file itself in its place, or mount "
            "the disk that it lies on."
        )
    return PsvideoError(f"{path}: is not there any more. Check its name, or put it back.")


def take_name(clip: Path) -> str:
    """Return what a clip's results, and its rig, are called: its folder's name, or its movie's without the ending.

    >>> take_name(Path("takes/shot3"))
    'shot3'
    """
    return clip.stem if clip.is_file() else clip.resolve().name


def path_if_given(name: str, given: Path | str | None) -> Path | None:
    """Return a parameter that may be left out as a path; raises as ``path_of``."""
    return None if given is None else path_of(name, given)
