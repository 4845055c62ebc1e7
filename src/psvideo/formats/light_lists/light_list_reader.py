"""Reads light lists of other programs: rows of numbers, checked against their count and for common mistakes.

``.lp`` (RTI), DiLiGenT's ``light_directions.txt`` with ``light_intensities.txt`` beside it, and a plain list of unit
vectors with its count on the first line (University of Washington). A list that names the plan's lights belongs to them
by name; one that names pictures, or nothing, in the order in which the plan first lights them. ``light_list_writer``
writes the first two.
"""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.formats.contract import check_light_name, read_text
from psvideo.formats.light_lists.light_list_lines import DIRECTION, ListLine, directed, lines_in, without_comments
from psvideo.formats.light_lists.picture_names import without_ending
from psvideo.model.rig import Light, Rig
from psvideo.model.units import counted

DIRECTIONS, INTENSITIES, FILENAMES = "light_directions.txt", "light_intensities.txt", "filenames.txt"
"""The files of DiLiGenT."""
ANGLES_SPAN = 7.0
"""Columns that span more, beside a third one that is the same throughout, are degrees: more than radians do."""
AXES = "x right, y up, z towards the camera"
BRACKETED = re.compile(r"\s*[(\[][^()\[\]]*[)\]][,;]?\s*")
"""A line that is a vector in brackets, as programs write it."""
DECIMAL_COMMA = re.compile(r"-?\d+,\d+")


def read_light_list(path: Path, *, plan_lights: Sequence[str] = ()) -> Rig:
    """Read directions of lights, and their strengths where the list has them (all 1 where not).

    ``plan_lights`` are names for the lights, in order, where the list names none of them; left out, lights are called
    as the list calls them or their pictures, and are numbered where it does not. Raises PsvideoError, which names the
    file, what was found and what was expected.
    """
    rows = [line.numbers for line in _lights(path)]
    short = next((place for place, row in enumerate(rows, start=1) if len(row) < 3), None)
    if short:
        raise PsvideoError(
            f"{path}: light {short} has only {len(rows[short - 1])} of the three numbers x y z of the direction to the "
            "light (x right, y up, z towards the camera). Angles are to be made directions first."
        )
    vectors = np.array([row[:3] for row in rows], np.float64)
    lengths = np.linalg.norm(vectors, axis=1)
    if np.any(lengths < 1e-6):
        raise PsvideoError(
            f"{path}: vector {int(np.argmin(lengths)) + 1} has no length; expected directions to lights."
        )
    _refuse_angles(path, vectors)
    beside = _diligent_strengths(path, len(rows))
    strengths = [row[DIRECTION:] or strength for row, strength in zip(rows, beside, strict=True)]
    names = _names(path, len(rows), plan_lights)
    _refuse_dark(path, names, strengths)
    lights = [
        Light(name=name, direction=(x, y, z), intensity=strength)
        for name, (x, y, z), strength in zip(names, (vectors / lengths[:, None]).tolist(), strengths, strict=True)
    ]
    return Rig(lights=tuple(lights))


def pictures_named_by(path: Path) -> tuple[str, ...]:
    """Return the pictures that a list names, in order: the words beside the numbers of every line (``.lp``, tables), or
    the ``filenames.txt`` beside DiLiGenT's lists; empty where it names none, or not one in every line."""
    beside = path.with_name(FILENAMES)
    if path.name == DIRECTIONS and beside.is_file():
        return tuple(line.strip() for line in read_text(beside).splitlines() if line.strip())
    if path.suffix == ".toml":
        return ()
    return tuple(line.name for line in _lights(path) if line.name)


def _lights(path: Path) -> list[ListLine]:
    """Return the lines of a list's lights, held against its count where it has one."""
    lines = _lines(path, read_text(path))
    if path.suffix.lower() == ".lp" or len(lines[0].words) == 1:
        return _counted(path, lines)
    return directed(path, lines)


def _lines(path: Path, text: str) -> list[ListLine]:
    """Return the lines that hold numbers. Raises PsvideoError where none does, or where they have decimal commas."""
    bare = without_comments(text)
    words = re.split(r"[\s;\"']+", "\n".join(bare))
    comma = next((word for word in words if DECIMAL_COMMA.fullmatch(word)), None)
    if comma:
        raise PsvideoError(
            f"{path}: writes {comma!r}. Expected numbers with points, such as {comma.replace(',', '.')}."
        )
    json = text.lstrip()[:1] in ("{", "[")
    bracketed = next((line.strip() for line in bare if BRACKETED.fullmatch(line)), None)
    lines = [] if json or bracketed else lines_in(text)
    if not lines:
        found = f"has brackets ({bracketed[:60]})" if bracketed else "is JSON" if json else "holds no numbers"
        raise PsvideoError(
            f"{path}: {found}. Expected rig.toml, an .lp file, or one light direction x y z per line, its numbers with "
            "points and spaces or commas between them, such as 0.1 0.2 0.97."
        )
    return lines


def _counted(path: Path, lines: Sequence[ListLine]) -> list[ListLine]:
    """Take the count off the top of a list and hold the list against it. Raises PsvideoError where it does not fit."""
    first, after = lines[0].words, lines[1:]
    if len(first) != 1 or float(first[0]) != len(after):
        raise PsvideoError(
            f"{path}: its first line is {' '.join(first)}, and {len(after)} lines follow. Expected the first line to "
            "say how many follow."
        )
    if not after:
        raise PsvideoError(f"{path}: says that it lists 0 lights; expected a line for every light.")
    short = next((line.words for line in after if len(line.words) < DIRECTION), None)
    if short is not None:
        raise PsvideoError(
            f"{path}: a line has {counted(len(short), 'number')} ({' '.join(short)}); expected three numbers x y z of "
            f"a direction in every line after the first ({AXES}). Angles are to be made directions first."
        )
    return directed(path, after, by_count=True)


def _refuse_angles(path: Path, vectors: NDArray[np.float64]) -> None:
    """Raise PsvideoError where columns are angles and a distance: two turn far, and the third is always the same."""
    span = np.ptp(vectors, axis=0)
    if len(vectors) > 2 and span[:2].max() > ANGLES_SPAN and span[2] == 0 and abs(vectors[0, 2]) <= 1:
        shown = " ".join(f"{one:g}" for one in vectors[0])
        raise PsvideoError(
            f"{path}: its lines, such as {shown}, look like angles in degrees and a distance; expected x y z of the "
            f"direction to the light ({AXES}). With azimuth a and elevation e: x = cos(e) cos(a), y = cos(e) sin(a), "
            "z = sin(e)."
        )


def _diligent_strengths(path: Path, count: int) -> list[tuple[float, ...]]:
    """Return the intensities of the ``light_intensities.txt`` beside a DiLiGenT list, else 1 for every light."""
    beside = path.with_name(INTENSITIES)
    if path.name != DIRECTIONS or not beside.is_file():
        return [(1.0,)] * count
    rows = [line.numbers for line in _lines(beside, read_text(beside))]
    if len(rows) != count:
        raise PsvideoError(
            f"{beside}: holds {len(rows)} intensities, and {path.name} beside it {count} directions. Expected a line "
            "for every light in both."
        )
    return list(rows)


def _refuse_dark(path: Path, names: Sequence[str], strengths: Sequence[tuple[float, ...]]) -> None:
    """Raise PsvideoError where a light gives no light: the list, or the one of intensities beside it, says so."""
    dark = next((place for place, strength in enumerate(strengths) if min(strength) <= 0), None)
    if dark is not None:
        beside = path.with_name(INTENSITIES)
        shown = " ".join(f"{one:g}" for one in strengths[dark])
        raise PsvideoError(
            f"{beside if path.name == DIRECTIONS and beside.is_file() else path}: light {dark + 1} ({names[dark]!r}) "
            f"has the strength {shown}; expected strengths above 0. Take a light that does not shine off the list."
        )


def _names(path: Path, count: int, plan_lights: Sequence[str]) -> list[str]:
    written = _written_names(path, count)
    if set(written) & set(plan_lights):
        return written
    if not plan_lights:
        return written or [f"L{index}" for index in range(count)]
    if len(plan_lights) != count:
        raise PsvideoError(
            f"{path}: lists {count} lights, and the plan flashes {len(plan_lights)} ({', '.join(plan_lights)}). A list "
            "that names none of the plan's lights must hold exactly these, in the order in which the plan first lights "
            "them."
        )
    return list(plan_lights)


def _written_names(path: Path, count: int) -> list[str]:
    """Return what a list calls its lights, or their pictures without folders and endings; empty where that
    names none, or two lights alike."""
    words = [re.split(r"[\\/]", name)[-1] for name in pictures_named_by(path)]
    try:
        names = [check_light_name(without_ending(word)) for word in words]
    except ValueError:
        return []
    return names if len(set(names)) == count == len(names) else []
