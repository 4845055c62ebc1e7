"""Which files show which light: still photographs in a folder, one per light, or a folder per light (plates)."""

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from psvideo.calibrate.picture_sets import LightFiles
from psvideo.calibrate.still_names import AMBIENT_NAMES, ROOM_NAMES, sorted_by_name
from psvideo.clip.folder import KINDS, USUAL_KINDS, number_of, unread_in
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.clip_layout import FRAMES, PLAN_FILE
from psvideo.formats.contract import check_light_name
from psvideo.formats.timing_json import read_timing
from psvideo.formats.whole_files import is_drawn

TIMING = "timing.json"
FEWEST_TO_ONE = 4
"""This many numbered files for one of another name make that one no light (a mask); with fewer, all are lights."""
SHOWN = 6
"""So many folders are named of those that hold pictures."""
NOT_LIGHTS = ("flashes", "beauty", "truth")
"""Folders that may lie beside the lights' own: single flashes, the lights' sum, and a virtual shoot's truth."""


def find_plates(folder: Path, *, lights: Sequence[str] = ()) -> LightFiles | None:
    """Return a folder's pictures where it holds one folder per light, None where it does not.

    Lights come in the order of ``lights``, else of the timing.json beside them, else of their names.
    """
    every = folders_with_pictures(folder)
    dark, room = _those_named(every, AMBIENT_NAMES, lights), _those_named(every, ROOM_NAMES, lights)
    odd = [*dark[1:], *room[1:]]
    held = {name: files for name, files in every.items() if name not in (*dark, *room)}
    if not held or (set(held) == {FRAMES}):
        return None
    order = lights or _timed_lights(folder)
    lacking = [name for name in order if name not in held]
    if lacking and lights:
        raise PsvideoError(
            f"{folder}: holds no pictures of {', '.join(map(repr, lacking))}, which the plan flashes; its folders are "
            f"{', '.join(held)}. Name the folders as the plan names its lights."
        )
    names = [name for name in order if name in held] or list(held)
    made_by_split = (folder / TIMING).is_file()
    by_light = _side_by_side({_checked(name, folder / name): held[name] for name in names})
    return LightFiles(
        folder=folder,
        by_light=by_light,
        ambient=_of_the_same_rounds(every[dark[0]], by_light) if dark else (),
        ambient_is_off=made_by_split,
        room=every[room[0]][0] if room else None,
        left_aside=tuple(folder / name for name in (*(name for name in held if name not in names), *odd)),
    )


def folders_with_pictures(folder: Path) -> dict[str, list[Path]]:
    """Return the pictures in each folder of a folder that holds some, by the folder's name."""
    within = sorted((entry for entry in folder.iterdir() if entry.is_dir()), key=lambda entry: _natural(entry.name))
    held = {entry.name: pictures_in(entry) for entry in within if entry.name not in NOT_LIGHTS}
    return {name: files for name, files in held.items() if files}


def _those_named(held: Iterable[str], words: Sequence[str], lights: Sequence[str]) -> list[str]:
    return [word for word in words if word in held and word not in lights]


def find_stills(path: Path | Sequence[Path], *, lights: Sequence[str] = ()) -> LightFiles:
    """Return the still photographs of a folder (or the files named), one per light.

    A file belongs to the light whose name it bears; where none bears one of ``lights``, the numbered files belong to
    the lights in order; without ``lights`` every file is a light of the file's name. A file named ambient or dark shows
    the scene with every light off, one named room, outline or ref with the room light on; a second of these, and one
    named mask, is left aside.

    Raises PsvideoError where there are no pictures, two of one light, or not as many as ``lights``.
    """
    folder = path if isinstance(path, Path) else path[0].parent
    kinds = sorted_by_name(pictures_in(path) if isinstance(path, Path) else path, lights)
    files, dark, room = list(kinds.of_lights), kinds.dark, kinds.room
    if not files:
        raise PsvideoError(f"{folder}: holds no pictures of lights. {_instead(folder)}")
    named = {light: [file for file in files if kinds.of_lights[file] == light] for light in lights}
    chosen = {light: found for light, found in named.items() if found} or _in_order(folder, _main_group(files), lights)
    _refuse_twice(folder, chosen)
    lacking = [light for light in lights if light not in chosen]
    if lacking:
        raise PsvideoError(
            f"{folder}: holds no picture of {', '.join(map(repr, lacking))}; expected one for each of the plan's "
            f"lights ({', '.join(lights)}). Take the missing ones, or name the files as the lights."
        )
    used = {found[0] for found in chosen.values()}
    return LightFiles(
        folder=folder,
        by_light={_checked(light, found[0]): tuple(found) for light, found in chosen.items()},
        ambient=tuple(dark[:1]),
        room=room[0] if room else None,
        left_aside=(*(file for file in files if file not in used), *dark[1:], *room[1:], *kinds.masks),
    )


def _instead(folder: Path) -> str:
    """Say what was expected of a folder without pictures, and what may have been meant."""
    if (folder / FRAMES).is_dir() and (folder / PLAN_FILE).is_file():
        return "It is a clip with its plan: psvideo normals takes it."
    kinds = ", ".join(USUAL_KINDS)
    expected = f"Expected still photographs, one per light ({kinds}), or a folder of plates per light."
    inner = [entry for entry in sorted(folder.iterdir()) if entry.is_dir() and pictures_in(entry)]
    if inner:
        expected += f" {_named(inner)}"
    return f"{expected} {unread_in(folder)}".rstrip()


def _named(inner: Sequence[Path]) -> str:
    """Say which folders below hold pictures, one or several."""
    if len(inner) == 1:
        return f"The folder {inner[0].name} in it holds pictures: name that one."
    more = f" and {len(inner) - SHOWN} more" if len(inner) > SHOWN else ""
    return f"Folders in it hold pictures: {', '.join(one.name for one in inner[:SHOWN])}{more}. Name one of these."


def pictures_in(folder: Path) -> list[Path]:
    """Return a folder's image files, ``L2`` before ``L10``, without those that psvideo drew (``rig.png``)."""
    try:
        entries = [entry for entry in folder.iterdir() if entry.suffix.lower() in KINDS and entry.name[0] != "."]
        files = [entry for entry in entries if entry.is_file() and not is_drawn(entry)]
    except OSError as fault:
        raise PsvideoError(f"{folder}: cannot be read ({fault.strerror or fault}). Check its name.") from fault
    return sorted(files, key=lambda file: _natural(file.name))


def _natural(name: str) -> list[tuple[int, str]]:
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", name)]


def _main_group(files: list[Path]) -> list[Path]:
    """Return the numbered files that share a stem where hardly any others lie beside them, else all files."""
    stems = Counter(_prefix(file) for file in files if number_of(file) is not None)
    if not stems:
        return files
    prefix, count = stems.most_common(1)[0]
    if count < FEWEST_TO_ONE * (len(files) - count):
        return files
    return [file for file in files if number_of(file) is not None and _prefix(file) == prefix]


def _prefix(file: Path) -> str:
    return re.sub(r"\d+$", "", file.stem).casefold()


def _in_order(folder: Path, files: list[Path], lights: Sequence[str]) -> dict[str, list[Path]]:
    """Give the files to the lights in order; without lights, each file is one of its own name."""
    if not lights:
        return {file.stem: [other for other in files if other.stem == file.stem] for file in files}
    if len(files) != len(lights):
        raise PsvideoError(
            f"{folder}: holds {len(files)} pictures ({files[0].name} to {files[-1].name}), and the plan has "
            f"{len(lights)} lights ({', '.join(lights)}). Expected one picture per light, in that order, or files that "
            "bear the lights' names."
        )
    return {light: [file] for light, file in zip(lights, files, strict=True)}


def _refuse_twice(folder: Path, chosen: dict[str, list[Path]]) -> None:
    for light, found in chosen.items():
        if len(found) > 1 and found[0].stem == found[1].stem:
            raise PsvideoError(
                f"{folder}: {found[0].name} and {found[1].name} are one photograph in two kinds. Expected one picture "
                "per light: move one kind elsewhere, rather the JPEG."
            )
        if len(found) > 1:
            raise PsvideoError(
                f"{folder}: two lights have the name {light!r}: {found[0].name} and {found[1].name}. Expected one "
                "picture per light; move one elsewhere, or put several of each light into a folder per light."
            )


def _side_by_side(held: dict[str, list[Path]]) -> dict[str, tuple[Path, ...]]:
    """Return files of one round side by side: by their numbers where all lights share some, else by their order."""
    numbers = [{number_of(file): file for file in files} for files in held.values()]
    shared = sorted(set.intersection(*[{n for n in by_number if n is not None} for by_number in numbers]))
    if shared:
        return {light: tuple(by_number[n] for n in shared) for light, by_number in zip(held, numbers, strict=True)}
    return {light: tuple(files) for light, files in held.items()}


def _of_the_same_rounds(ambient: list[Path], by_light: Mapping[str, tuple[Path, ...]]) -> tuple[Path, ...]:
    """Return pictures of the ambient light beside those of the lights: of the number nearest to theirs, where lights'
    pictures of one round share one, else as they are."""
    rounds = [{number_of(file) for file in files} for files in zip(*by_light.values(), strict=False)]
    numbers = [number for one in rounds for number in one if len(one) == 1 and number is not None]
    dark = {number: file for file in ambient if (number := number_of(file)) is not None}
    if not dark or len(numbers) < len(rounds):
        return tuple(ambient)
    return tuple(dark[min(dark, key=lambda other: abs(other - number))] for number in numbers)


def _timed_lights(folder: Path) -> tuple[str, ...]:
    """Return the lights in the order in which a timing.json beside the plates saw them first."""
    if not (folder / TIMING).is_file():
        return ()
    flashes = sorted(read_timing(folder / TIMING).flashes, key=lambda flash: flash.slot)
    return tuple(dict.fromkeys(name for flash in flashes for name in flash.lit))


def _checked(light: str, source: Path) -> str:
    try:
        return check_light_name(light)
    except ValueError as fault:
        raise UsageError(f"{source}: {fault}. Rename it, or give the plan with `plan`.") from None
