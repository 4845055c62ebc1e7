"""Photographs that cannot be paired with lights: too few, not as many, named twice, called or sorted otherwise."""

import hashlib
import re
from collections.abc import Sequence
from pathlib import Path

from psvideo.calibrate.listed_names import stem_of
from psvideo.calibrate.picture_sets import LightFiles
from psvideo.clip.decode.decoders import read_header
from psvideo.clip.folder import KINDS, USUAL_KINDS
from psvideo.errors import PsvideoError
from psvideo.formats.paths import check_file
from psvideo.model.units import listed

FEWEST = 3
LISTED = 6
"""This many names are listed in a message."""


def refuse_other_than_pictures(*given: Path | None) -> None:
    """Raise PsvideoError where a picture that somebody names is none."""
    for file in given:
        if file is None:
            continue
        if not file.is_file():
            found = "is a folder" if file.is_dir() else "there is no such file"
            raise PsvideoError(f"{file}: {found}, and one picture is expected. Name the picture.")
        if file.suffix.lower() not in KINDS:
            raise PsvideoError(f"{file}: is no picture that psvideo reads; expected one of {', '.join(USUAL_KINDS)}.")


def refuse_few_or_the_same(folder: Path, files: Sequence[Path]) -> None:
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


def refuse_named_twice(known: Sequence[str], chosen: Sequence[Path], whose: str) -> None:
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


def refuse_other_order(folder: Path, names: Sequence[str], files: Sequence[Path], whose: str) -> None:
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


def refuse_other_count(
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


def misnamed(
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
