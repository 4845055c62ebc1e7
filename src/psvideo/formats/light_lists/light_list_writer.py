"""Rigs written as the light lists of other programs: ``.lp`` (RTI) and DiLiGenT's pair of text files.

Both use psvideo's axes (x right, y up, z towards the camera) and hold distant lights only; ``.lp`` holds no strengths.
``light_list_reader`` reads them back to the last digit.
"""

from pathlib import Path
from typing import Literal

from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.light_lists.light_list_lines import directed, lines_in
from psvideo.formats.light_lists.light_list_reader import DIRECTIONS, INTENSITIES
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.whole_files import write_text
from psvideo.model.rig import Light, Rig, Vector

ListKind = Literal["toml", "lp", "diligent"]


def kind_of(path: Path) -> ListKind:
    """Return the kind of a rig file by its name. Raises UsageError where the name shows none."""
    if path.suffix == ".toml":
        return "toml"
    if path.suffix == ".lp":
        return "lp"
    if path.name == DIRECTIONS:
        return "diligent"
    raise UsageError(f"{path}: is no known kind of rig file. Name it *.toml, *.lp or {DIRECTIONS} (DiLiGenT).")


def files_of(path: Path) -> tuple[Path, ...]:
    """Return the files that writing a rig makes: two for DiLiGenT."""
    return (path, path.with_name(INTENSITIES)) if kind_of(path) == "diligent" else (path,)


def write_rig(path: Path, rig: Rig) -> tuple[str, ...]:
    """Write a rig in the kind that the file's name shows; return in whole sentences what that kind cannot hold.

    Raises PsvideoError where a light is near, as lists hold directions, or where its name cannot be read back.
    """
    kind = kind_of(path)
    if kind == "toml":
        write_text(path, format_rig(rig))
        return ()
    directions = [_direction(path, light) for light in rig.lights]
    if kind == "lp":
        lines = [f"{light.name} {_numbers(at)}" for light, at in zip(rig.lights, directions, strict=True)]
        text = "\n".join([str(len(lines)), *lines, ""])
        _refuse_misread(path, text, rig)
        write_text(path, text)
    else:
        write_text(path.with_name(INTENSITIES), "".join(f"{_numbers(_three(light))}\n" for light in rig.lights))
        write_text(path, "".join(f"{_numbers(at)}\n" for at in directions))
    return _lost(rig, kind)


def _direction(path: Path, light: Light) -> Vector:
    if light.direction is None:
        raise PsvideoError(
            f"{path}: light {light.name!r} has a position (a near light), and this kind of list holds directions only. "
            "Write a .toml, or give the light the direction from the middle of the surface."
        )
    return light.direction


def _refuse_misread(path: Path, text: str, rig: Rig) -> None:
    """Raise PsvideoError where a list does not read as what it was written from: a name is a comment, or numbers."""
    lines = lines_in(text)[1:]
    try:
        found = [line.numbers for line in directed(path, lines, by_count=True)] if len(lines) == len(rig.lights) else []
    except PsvideoError:
        found = []
    if found != [light.direction for light in rig.lights]:
        odd = [name for name in rig.names if not name[0].isalpha()] or list(rig.names)
        raise PsvideoError(
            f"{path}: the lights' names {', '.join(map(repr, odd))} would be read as comments or numbers in such a "
            "list. Expected names that begin with a letter: name the lights so, or write a .toml."
        )


def _three(light: Light) -> tuple[float, ...]:
    return light.intensity if len(light.intensity) == 3 else (light.intensity[0],) * 3


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _lost(rig: Rig, kind: ListKind) -> tuple[str, ...]:
    lost = []
    if kind == "lp" and len({_three(light) for light in rig.lights}) > 1:
        lost.append("An .lp file holds no strengths, and these lights differ in theirs: they are lost.")
    if kind == "diligent":
        lost.append(f"The lists hold no names: lights are known by their order, {', '.join(rig.names)}.")
    if any(light.colour is not None for light in rig.lights):
        lost.append("The list holds no colours of lights: coloured lights that flash together cannot be told by it.")
    if any(light.error_deg is not None for light in rig.lights):
        lost.append("The list holds no errors of directions.")
    if any(light.reference_duration_s is not None for light in rig.lights):
        lost.append(
            "The list holds no reference durations: strengths are those of the flashes they were measured with."
        )
    if rig.surface_colour is not None:
        lost.append("The list holds no colour of the surface, by which coloured lights are told apart.")
    if rig.focal_px is not None or rig.plane is not None:
        lost.append("The list holds neither lens nor surface, which depth in metres needs.")
    return tuple(lost)
