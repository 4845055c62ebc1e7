"""Which photograph shows which light: by the names that a list or a rig gives, else by order."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from psvideo.calibrate.light_files import find_stills
from psvideo.calibrate.listed_names import all_found, pictures_meant
from psvideo.calibrate.picture_sets import LightFiles
from psvideo.calibrate.still_names import MASK_NAMES, bears
from psvideo.calibrate.unpaired_stills import (
    LISTED,
    misnamed,
    refuse_few_or_the_same,
    refuse_named_twice,
    refuse_other_count,
    refuse_other_order,
    refuse_other_than_pictures,
)
from psvideo.errors import PsvideoError
from psvideo.formats.contract import check_light_name
from psvideo.model.units import listed


@dataclass(frozen=True, kw_only=True)
class Pairs:
    """Photographs in the order of their lights.

    files: one for each light. names: the lights', from the rig, or the files' own where the list has none.
    places: of the lights in the list, which may name more. how: by what they were paired, in sentences. dark: shows
    ambient light alone. mask: white where to solve, found beside them. aside: pictures that belong to no light.
    """

    files: tuple[Path, ...]
    names: tuple[str, ...]
    places: tuple[int, ...]
    how: str
    dark: Path | None = None
    mask: Path | None = None
    aside: tuple[Path, ...] = ()


def pair_stills(
    folder: Path,
    known: Sequence[str],
    *,
    named: bool,
    whose: str,
    keep_names: bool = True,
    dark: Path | None = None,
    mask: Path | None = None,
) -> Pairs:
    """Return which picture of a folder shows which light.

    ``known`` are the lights in order; where they are ``named`` (as pictures or as lights), by name if all are there
    or every picture is one of them, so that lights alone are left over; else by order. ``whose`` is what messages call
    the list. With ``keep_names`` lights keep the names in ``known``, else they get their pictures' own. ``dark`` and
    ``mask`` show no light, wherever they lie. Raises PsvideoError where names or counts do not fit.
    """
    if not folder.is_dir():
        raise PsvideoError(f"{folder}: is no folder. Name the folder that holds the photographs, one per light.")
    refuse_other_than_pictures(dark, mask)
    found = find_stills(folder)
    apart = {file.resolve() for file in (dark, mask) if file}
    files = [one[0] for one in found.by_light.values() if one[0].resolve() not in apart]
    refuse_few_or_the_same(folder, files)
    masks = [file for file in found.left_aside if any(bears(file, name) for name in MASK_NAMES)]
    dark, mask = dark or (found.ambient[0] if found.ambient else None), mask or (masks[0] if masks else None)
    chosen = _by_name(folder, known, files, whose) if named else None
    if chosen is None:
        if named:
            refuse_other_order(folder, known, files, whose)
        chosen = _by_order(folder, known, files, found, whose)
    used = {*chosen.files, *masks, dark, mask}
    others = (*files, *found.left_aside, *found.ambient, *([found.room] if found.room else []))
    aside = tuple(file for file in others if file not in used and file.resolve() not in apart)
    names = chosen.names if keep_names else _own_names(chosen.files)
    return replace(chosen, names=names, dark=dark, mask=mask, aside=aside)


def _by_name(folder: Path, known: Sequence[str], files: Sequence[Path], whose: str) -> Pairs | None:
    """Return the pairs that names make, None where no name means any picture. Raises PsvideoError where some do, and
    others mean none or several."""
    matches = pictures_meant(known, files)
    if not any(matches):
        return None
    if not (all(len(one) == 1 for one in matches) or all_found(matches, files)):
        raise PsvideoError(misnamed(folder, known, matches, files, whose))
    places = tuple(place for place, one in enumerate(matches) if one)
    chosen, lights = [matches[place][0] for place in places], tuple(known[place] for place in places)
    refuse_named_twice(lights, chosen, whose)
    how = f"Pictures belong to lights by name ({whose}): {_shown(lights, chosen)}.{_left_over(known, places, whose)}"
    return Pairs(files=tuple(chosen), names=lights, places=places, how=how)


def _by_order(folder: Path, known: Sequence[str], files: Sequence[Path], found: LightFiles, whose: str) -> Pairs:
    """Return every light with the picture in its place. Raises PsvideoError where there are not as many."""
    refuse_other_count(folder, files, known, found, whose)
    how = (
        f"Pictures belong to lights by order, since {whose} names none of them: {_shown(known, files)}. Where "
        "that is wrong, the rig will not fit."
    )
    return Pairs(files=tuple(files), names=tuple(known), places=tuple(range(len(known))), how=how)


def _left_over(known: Sequence[str], places: Sequence[int], whose: str) -> str:
    """Return a sentence on the lights of a list of which there is no picture, nothing where there is none."""
    without = [name for place, name in enumerate(known) if place not in places]
    if not without:
        return ""
    what = "is" if len(without) == 1 else "are"
    return (
        f" {len(without)} of the {len(known)} lights {what} left out, as no picture bears the name: "
        f"{listed(without, LISTED)} of {whose}."
    )


def _shown(known: Sequence[str], files: Sequence[Path]) -> str:
    return f"{files[0].name} shows {known[0]!r}, and so on to {files[-1].name}, which shows {known[-1]!r}"


def _own_names(files: Sequence[Path]) -> tuple[str, ...]:
    """Return the files' own names as lights' names, else numbers where one cannot name files of its own."""
    stems = [file.stem for file in files]
    try:
        names = tuple(check_light_name(stem) for stem in stems)
    except ValueError:
        names = ()
    return names if len(set(names)) == len(files) else tuple(f"L{place}" for place in range(len(files)))
