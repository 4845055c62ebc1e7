"""What a folder shows lights by: its own pictures, one per light, or a folder of pictures per light, where it may hold
both: what is not meant is left aside, and named."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from psvideo.calibrate.light_files import (
    TIMING,
    find_plates,
    find_stills,
    folders_with_pictures,
    pictures_in,
)
from psvideo.calibrate.picture_sets import LightFiles
from psvideo.calibrate.still_names import AMBIENT_NAMES, ROOM_NAMES, sorted_by_name
from psvideo.errors import PsvideoError
from psvideo.formats.clip_layout import FRAMES
from psvideo.model.units import listed

LISTED = 4
"""This many names are listed in a message."""
NO_LIGHTS = (*AMBIENT_NAMES, *ROOM_NAMES, FRAMES)
"""Folders of these names hold pictures of no light."""


def find_light_pictures(folder: Path, *, lights: Sequence[str] = ()) -> LightFiles:
    """Return which pictures of a folder show which light: its own (``find_stills``), or those of one folder per light
    (``find_plates``). ``lights`` are those of a plan.

    Of a folder that holds both, the folders count where a plan or timing.json names them, else its own pictures; a
    single picture beside several folders is none of a set. The others are left aside. Raises PsvideoError where both
    bear the names of lights, or where neither shows them.
    """
    folders, own = folders_with_pictures(folder), _own(folder, lights)
    if not own or (folder / TIMING).is_file():
        return find_plates(folder, lights=lights) or find_stills(folder, lights=lights)
    by_folder = [name for name in folders if (name in lights if lights else name not in NO_LIGHTS)]
    by_file = set(lights).intersection(own.values()) if lights else set(own.values())
    both = by_file.intersection(by_folder)
    if both and (not lights or both == set(lights)):
        raise _either(folder, sorted(both))
    in_folders = len(by_folder) > len(by_file) if lights else len(own) == 1 < len(by_folder)
    plates = find_plates(folder, lights=lights) if in_folders else None
    if plates is not None:
        return replace(plates, left_aside=(*plates.left_aside, *own))
    stills = find_stills(folder, lights=lights)
    return replace(stills, left_aside=(*stills.left_aside, *(folder / name for name in folders)))


def _own(folder: Path, lights: Sequence[str]) -> dict[Path, str]:
    """Return a folder's own pictures that may show lights, with the light's name that each bears, or else its own."""
    borne = sorted_by_name(pictures_in(folder), lights).of_lights
    return {file: name or file.stem for file, name in borne.items()}


def _either(folder: Path, names: Sequence[str]) -> PsvideoError:
    return PsvideoError(
        f"{folder}: holds a picture and a folder of pictures of each of {listed(names, LISTED)}, and either may be "
        "meant. Expected one picture per light, or a folder per light: move one kind elsewhere."
    )


def shows_lights(folder: Path, lights: Sequence[str]) -> bool:
    """Return whether a folder beside a plan holds stills that bear its lights' names, or a folder per light, and not
    the frames of a clip."""
    folders = folders_with_pictures(folder)
    if set(lights) & set(folders) or (folders and FRAMES not in folders and not pictures_in(folder)):
        return True
    stems = {file.stem for held in (folder, folder / FRAMES) if held.is_dir() for file in held.iterdir()}
    return set(lights) <= stems
