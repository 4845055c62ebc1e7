"""New takes in a folder: found by looking again and again, which also works over network drives, and given once they
have stopped growing."""

import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from psvideo.clip.folder import BRACKETED, KINDS, MOVIES, NUMBERED

DEEPEST = 4
"""Folders in folders that are looked into: cards put takes a few levels down."""
UNCHANGED_LOOKS = 2
"""A take is whole once this many looks in turn found it the same."""


@dataclass(frozen=True)
class State:
    """What shows that a take still grows: its count of files, their bytes, and when any was last changed."""

    files: int
    size: int
    changed_ns: int


def takes_in(folder: Path) -> dict[Path, State]:
    """Return every take below a folder: folders that hold numbered images (or have them in frames/), and movies.

    What vanishes or cannot be read while it is looked at is left out; hidden files count as none.
    """
    found: dict[Path, State] = {}
    _look(folder, found, DEEPEST)
    return found


def _look(folder: Path, found: dict[Path, State], deep: int) -> None:
    files, folders = _entries(folder)
    plans = [entry for entry in files if entry.name.endswith(".toml")]
    movies = [entry for entry in files if Path(entry.name).suffix.lower() in MOVIES]
    for movie in movies:
        found[Path(movie.path)] = _state([movie, *plans])
    images = [entry for entry in files if _is_frame(entry.name)]
    frames = next((entry for entry in folders if entry.name == "frames"), None)
    within = [] if frames is None else [entry for entry in _entries(Path(frames.path))[0] if _is_frame(entry.name)]
    if images or within:
        found[folder] = _state([*images, *within, *plans])
        return
    for entry in folders if deep else ():
        _look(Path(entry.path), found, deep - 1)


def _entries(folder: Path) -> tuple[list[os.DirEntry[str]], list[os.DirEntry[str]]]:
    """Return a folder's files and its folders, by name."""
    try:
        with os.scandir(folder) as scanned:
            entries = sorted((entry for entry in scanned if not entry.name.startswith(".")), key=lambda one: one.name)
        return [one for one in entries if one.is_file()], [one for one in entries if one.is_dir()]
    except OSError:
        return [], []


def _is_frame(name: str) -> bool:
    stem, dot, suffix = name.rpartition(".")
    return (dot + suffix).lower() in KINDS and any(kind.fullmatch(stem) for kind in (NUMBERED, BRACKETED))


def _state(entries: list[os.DirEntry[str]]) -> State:
    size = changed_ns = 0
    for entry in entries:
        try:
            found = entry.stat()
        except OSError:
            continue
        size, changed_ns = size + found.st_size, max(changed_ns, found.st_mtime_ns)
    return State(files=len(entries), size=size, changed_ns=changed_ns)


def whole_takes(
    folder: Path, *, interval_s: float, existing: bool = False, sleep: Callable[[float], None] = time.sleep
) -> Iterator[Path | None]:
    """Give every new take of a folder once it has stopped growing, the oldest first, and None after each look.

    A take that changes later (a copy that had stalled, a plan put beside it) is given again. With ``existing`` the
    takes that are there already are given as well. Never ends.
    """
    given = {} if existing else takes_in(folder)
    looks: dict[Path, tuple[State, int]] = {}
    while True:
        now = takes_in(folder)
        given = {path: state for path, state in given.items() if path in now or not folder.is_dir()}
        fresh = {path: state for path, state in now.items() if given.get(path) != state}
        looks = {path: _looked(looks.get(path), state) for path, state in fresh.items()}
        whole = [path for path, (_, same) in looks.items() if same >= UNCHANGED_LOOKS]
        for path in sorted(whole, key=lambda one: (fresh[one].changed_ns, one)):
            given[path] = fresh[path]
            yield path
        yield None
        sleep(interval_s)


def _looked(before: tuple[State, int] | None, state: State) -> tuple[State, int]:
    return (state, before[1] + 1) if before is not None and before[0] == state else (state, 0)
