"""Which photograph shows which light: by the names that a list or a rig gives, else by order."""

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from psvideo.calibrate.light_files import find_stills
from psvideo.calibrate.listed_names import all_found, pictures_meant, stem_of
from psvideo.calibrate.picture_sets import LightFiles
from psvideo.calibrate.still_names import MASK_NAMES, bears
from psvideo.clip.decode.decoders import read_header
from psvideo.clip.folder import KINDS, USUAL_KINDS
from psvideo.errors import PsvideoError
from psvideo.formats.contract import check_light_name
from psvideo.formats.paths import check_file
from psvideo.model.units import listed

FEWEST = 3
LISTED = 6
"""This many names are listed in a message."""


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
    _refuse_other_than_pictures(dark, mask)
    found = find_stills(folder)
    apart = {file.resolve() for file in (dark, mask) if file}
    files = [one[0] for one in found.by_light.values() if one[0].resolve() not in apart]
    _refuse_few(folder, files)
    masks = [file for file in found.left_aside if any(bears(file, name) for name in MASK_NAMES)]
    dark, mask = dark or (found.ambient[0] if found.ambient else None), mask or (masks[0] if masks else None)
    chosen = _by_name(folder, known, files, whose) if named else None
    if chosen is None:
        if named:
            _refuse_other_order(folder, known, files, whose)
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
        raise PsvideoError(_misnamed(folder, known, matches, files, whose))
    places = tuple(place for place, one in enumerate(matches) if one)
    chosen, lights = [matches[place][0] for place in places], tuple(known[place] for place in places)
    _refuse_named_twice(lights, chosen, whose)
    how = f"Pictures belong to lights by name ({whose}): {_shown(lights, chosen)}.{_left_over(known, places, whose)}"
    return Pairs(files=tuple(chosen), names=lights, places=places, how=how)


def _by_order(folder: Path, known: Sequence[str], files: Sequence[Path], found: LightFiles, whose: str) -> Pairs:
    """Return every light with the picture in its place. Raises PsvideoError where there are not as many."""
    _refuse_other_count(folder, files, known, found, whose)
    how = (
        f"Pictures belong to lights by order, since {whose} names none of them: {_shown(known, files)}. Where "
        "that is wrong, the rig will not fit."
    )
    return Pairs(files=tuple(files), names=tuple(known), places=tuple(range(len(known))), how=how)


def _refuse_other_than_pictures(*given: Path | None) -> None:
    """Raise PsvideoError where a picture that somebody names is none."""
    for file in given:
        if file is None:
            continue
        if not file.is_file():
            found = "is a folder" if file.is_dir() else "there is no such file"
            raise PsvideoError(f"{file}: {found}, and one picture is expected. Name the picture.")
        if file.suffix.lower() not in KINDS:
            raise PsvideoError(f"{file}: is no picture that psvideo reads; expected one of {', '.join(USUAL_KINDS)}.")


def _refuse_few(folder: Path, files: Sequence[Path]) -> None:
    """Raise PsvideoError where there are too few pictures, or one twice, or several that are none."""
    if len(files) < FEWEST:
        raise PsvideoError(
            f"{folder}: holds {len(files)} picture{'' if len(files) == 1 else 's'} of lights "
            f"({', '.join(file.name for file in files)}). Normals need three at least, each under another light."
        )
    sizes = [file.stat().st_size for file in files]
    seen: dict[str, Path] = {}
    for file, size in zip(files, sizes, strict=True):
        if sizes.count(size) == 1:
            continue
        check_file(file)
        with file.open("rb") as opened:
            first = seen.setdefault(hashlib.file_digest(opened, "sha256").hexdigest(), file)
        if first is not file:
            read_header(KINDS[file.suffix.lower()], file)  # empty files, or a server's page of words, are no picture
            raise PsvideoError(
                f"{folder}: {first.name} and {file.name} are one and the same picture. Expected a photograph of its "
                "own for each light: copy the missing one from the camera, or take it again."
            )


def _refuse_named_twice(known: Sequence[str], chosen: Sequence[Path], whose: str) -> None:
    """Raise PsvideoError where two lights of a list have the same picture."""
    first: dict[Path, int] = {}
    for place, file in enumerate(chosen):
        before = first.setdefault(file, place)
        if before != place:
            raise PsvideoError(
                f"{file}: {whose} gives it to light {before + 1} ({known[before]}) and to light {place + 1} "
                f"({known[place]}). Expected a picture of its own for each light: correct the name in one of these "
                "lines, or take the line out."
            )


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


def _refuse_other_order(folder: Path, names: Sequence[str], files: Sequence[Path], whose: str) -> None:
    """Raise PsvideoError where a list that names other files counts them in another order than the files': by order
    every picture would get another one's light."""
    counted = [re.findall(r"\d+", stem_of(name)) for name in names]
    numbers = [int(one[-1]) for one in counted if one]
    if len(numbers) < len(names) or numbers == sorted(numbers) or not all(re.search(r"\d", one.stem) for one in files):
        return
    raise PsvideoError(
        f"{folder}: {whose} names {listed(names, LISTED)}, and no picture is called so ({files[0].name} to "
        f"{files[-1].name}). Its numbers do not ascend as the pictures' do, so that their order says nothing. Expected "
        "the pictures' names: correct them, or sort the lines."
    )


def _refuse_other_count(
    folder: Path, files: Sequence[Path], known: Sequence[str], found: LightFiles, whose: str
) -> None:
    """Raise PsvideoError where there are more or fewer pictures than lights."""
    if len(files) == len(known):
        return
    aside = f" ({', '.join(file.name for file in found.left_aside[:3])} left aside)" if found.left_aside else ""
    raise PsvideoError(
        f"{folder}: holds {len(files)} pictures of lights, {files[0].name} to {files[-1].name}{aside}, and {whose} "
        f"lists {len(known)} lights. Expected one picture for each light, in the same order, or names that say which "
        "belong together: move pictures or lines that have no partner elsewhere."
    )


def _misnamed(
    folder: Path, known: Sequence[str], matches: Sequence[Sequence[Path]], files: Sequence[Path], whose: str
) -> str:
    """Say which names have no picture, or several."""
    none = [name for name, one in zip(known, matches, strict=True) if not one]
    several = [(name, one) for name, one in zip(known, matches, strict=True) if len(one) > 1]
    used = {file for one in matches for file in one}
    free = [file.name for file in files if file not in used]
    if several:
        name, one = several[0]
        return (
            f"{folder}: {name!r} of {whose} may be {one[0].name} or {one[1].name}. Expected one picture for each name: "
            "move the other elsewhere, or write the whole file name into the list."
        )
    more = f" Pictures without a light: {listed(free, LISTED)}." if free else ""
    return (
        f"{folder}: {whose} names {listed(none, LISTED)}, and no picture is called so, though "
        f"{len(known) - len(none)} others are found by name.{more} Expected one picture for each light: correct the "
        "names, or take these lines out."
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
