"""Which files of a finished folder a run wrote: only these are removed when another run replaces the folder."""

import json
import os
from fnmatch import fnmatch
from pathlib import Path

from psvideo.errors import UsageError
from psvideo.formats.whole_files import write_text
from psvideo.model.units import listed

WRITTEN = ".written"
"""In a finished folder: the names of all files that the run wrote, for these alone may be replaced."""
OF_THE_SYSTEM = (".DS_Store", "._*", "Thumbs.db", "desktop.ini")
"""Files that computers leave in folders by themselves."""
NAMED = 3
"""So many of a user's own files are named in a refusal."""


def note_written(folder: Path) -> None:
    """Note in a finished folder all files that are in it: they are the run's."""
    write_text(folder / WRITTEN, json.dumps(sorted(_files_in(folder) - {WRITTEN}), indent=0))


def refuse_others(path: Path) -> None:
    """Raise UsageError where a folder that is to be replaced holds files that no run noted as its own.

    A folder that is not there or empty may be replaced.
    """
    if not path.is_dir() or not any(path.iterdir()):
        return
    noted = path / WRITTEN
    if not noted.is_file():
        raise UsageError(
            f"{path}: has no {WRITTEN}, the list in which a run notes the files that it wrote, so files of your own "
            "cannot be told from those. The folder is not replaced, not even with `force`. Name another output, or "
            "remove the folder yourself."
        )
    try:
        own = {WRITTEN, *map(str, json.loads(noted.read_text(encoding="utf-8")))}
    except ValueError:
        raise UsageError(
            f"{noted}: is no list of file names, as a run writes it, so the folder is not replaced, not even with "
            "`force`. Name another output, or remove it yourself."
        ) from None
    others = sorted(name for name in _files_in(path) - own if not _of_the_system(name))
    if others:
        raise UsageError(
            f"{path}: holds files that the earlier run did not write: {listed(others, NAMED)}. They would be gone with "
            "the folder, so it is not replaced, not even with `force`. Move them elsewhere, or name another output."
        )


def _files_in(folder: Path) -> set[str]:
    """Return the names of all files in a folder and those below it, and of links to folders."""
    names: set[str] = set()
    for place, folders, files in os.walk(folder):
        here = Path(place)
        links = [name for name in folders if (here / name).is_symlink()]
        names.update((here / name).relative_to(folder).as_posix() for name in (*files, *links))
    return names


def _of_the_system(name: str) -> bool:
    return any(fnmatch(name.rpartition("/")[2], one) for one in OF_THE_SYSTEM)
