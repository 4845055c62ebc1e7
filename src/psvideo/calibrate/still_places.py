"""Photographs that are named one by one or by a pattern: which belong together, and what their lights are called."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

from psvideo.calibrate.light_files import pictures_in
from psvideo.clip.folder import KINDS
from psvideo.errors import PsvideoError


@dataclass(frozen=True, kw_only=True)
class Place:
    """Photographs that belong together, one per light: what messages call them, and the files; ``names`` are lights'
    names of files that bear others."""

    called: str
    files: tuple[Path, ...]
    names: Mapping[Path, str] = field(default_factory=dict)


def grouped_pictures(paths: Sequence[Path]) -> list[Path | Place]:
    """Return folders as they are, a pattern (``ball/left_*.jpg``) as the pictures that it fits, whose lights are called
    by what the ``*`` stands for, and pictures of one folder together.

    Raises PsvideoError where a pattern fits nothing or a file is not there.
    """
    found: list[Path | Place] = []
    single: dict[Path, list[Path]] = defaultdict(list)
    for path in paths:
        if path.is_file() and path.suffix.lower() in KINDS:
            single[path.parent].append(path)
        elif not path.exists() and "*" in path.name:
            found.append(_fitting(path))
        else:
            found.append(path)
    together = (Place(called=str(folder), files=tuple(files)) for folder, files in single.items())
    return [*found, *together]


def _fitting(pattern: Path) -> Place:
    files = [file for file in pictures_in(pattern.parent) if fnmatchcase(file.name, pattern.name)]
    if not files:
        raise PsvideoError(f"{pattern}: fits no picture. Name a folder with one picture per light, or the pictures.")
    before, after = pattern.name.split("*")[0], pattern.name.split("*")[-1]
    names = {file: file.name[len(before) : len(file.name) - len(after)] or file.stem for file in files}
    names = {file: name if Path(name).suffix.lower() not in KINDS else Path(name).stem for file, name in names.items()}
    return Place(called=str(pattern), files=tuple(files), names=names)
