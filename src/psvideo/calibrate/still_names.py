"""What the names of pictures say that they show: a light, the scene with every light off, room light, or a mask."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

AMBIENT_NAMES = ("ambient", "dark")
"""A picture or a folder of this name shows the scene with every light off; it is taken off the others."""
ROOM_NAMES = ("room", "outline", "ref")
"""A picture of this name shows the scene with the room light on: on it outlines show best."""
MASK_NAMES = ("mask", "Mask", "MASK")
"""A picture whose name is or ends with such a word says where the subject is; it shows no light."""


def bears(file: Path, light: str) -> bool:
    """Return whether a file's name is the light's, or ends with it after a mark: ``take3_key.png``, ``key.png``; words
    in small letters also mean large ones (``DARK``)."""
    wanted = re.escape(light)
    return re.search(rf"(^|[^A-Za-z0-9])({wanted}|{wanted.upper()}|{wanted.capitalize()})$", file.stem) is not None


def meant_by(file: Path, names: Sequence[str]) -> str | None:
    """Return which of some names a file bears, None where none: its own, else the longest, so that ``take_top_left`` is
    ``top_left`` and not ``left``."""
    borne = [name for name in names if bears(file, name)]
    return max(borne, key=lambda name: (len(name), name == file.stem), default=None)


def _has_more_to_its_name(file: Path) -> bool:
    return file.stem.lower() not in AMBIENT_NAMES


@dataclass(frozen=True, kw_only=True)
class SortedByName:
    """Pictures by what their names say: which may show a light, with that of the plan's lights whose name each bears;
    and which show ambient light (the plainest name first), room light, or where the subject is."""

    of_lights: Mapping[Path, str | None]
    dark: tuple[Path, ...]
    room: tuple[Path, ...]
    masks: tuple[Path, ...]


def sorted_by_name(files: Sequence[Path], lights: Sequence[str]) -> SortedByName:
    """Return what pictures' names say that they show; a name of a light goes before all other meanings."""
    meant = {file: meant_by(file, (*lights, *AMBIENT_NAMES, *MASK_NAMES)) for file in files}
    others = [file for file in files if meant[file] not in lights]
    dark = sorted((file for file in others if meant[file] in AMBIENT_NAMES), key=_has_more_to_its_name)
    room = tuple(file for file in others if file.stem.lower() in ROOM_NAMES)
    masks = tuple(file for file in others if meant[file] in MASK_NAMES)
    of_lights = {file: name for file, name in meant.items() if file not in (*dark, *room, *masks)}
    return SortedByName(of_lights=of_lights, dark=tuple(dark), room=room, masks=masks)
