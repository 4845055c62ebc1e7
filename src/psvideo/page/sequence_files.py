"""The pictures in one folder as the page shows them: files by number, their times, and what their headers say."""

from collections.abc import Mapping
from fractions import Fraction
from functools import partial
from pathlib import Path

from psvideo.clip.decode.exr import contents, read_halves
from psvideo.clip.folder import number_of
from psvideo.errors import PsvideoError
from psvideo.model.quantities import Quantity
from psvideo.page.file_times import file_times_s
from psvideo.page.picture import Look, PagePicture, shown
from psvideo.page.show import ShownSequence

Instants = tuple[tuple[int, ...], tuple[float, ...]]
"""Numbers of pictures, and their times in seconds."""


def sequence_of(folder: Path, quantity: Quantity, *, like: Instants = ((), ())) -> ShownSequence:
    """Return a folder's pictures; where they have the numbers of ``like``, also its times, as of one instant."""
    files = files_in(folder)
    head = first_header(files)
    numbers = tuple(sorted(files))
    return ShownSequence(
        id=folder.name,
        label=quantity.label,
        kind=quantity.shown,
        group="Results",
        timeline="rounds",
        numbers=numbers,
        times_s=like[1] if numbers == like[0] else file_times_s(files, rate_of(head)),
        read=partial(_read, files, quantity),
        unit=quantity.unit,
        from_zero=quantity.from_zero,
        hatched=quantity.hatched,
        y=str(head.get("psvideo:y", "up")),
        space=str(head.get("psvideo:space", "camera")),
    )


def _read(files: Mapping[int, Path], quantity: Quantity, number: int, look: Look) -> PagePicture:
    found = read_halves(files[number])
    pixels = shown(found.planes, look, directions=quantity.shown == "normals", full=quantity.digits == "float")
    facts: dict[str, object] = {"time_s": found.attributes.get("psvideo:time_s")}
    if (matrix := found.attributes.get("psvideo:camera_to_world")) is not None:
        facts["camera_to_world"] = [float(word) for word in str(matrix).split()]
    return PagePicture(pixels=pixels, facts=facts)


def files_in(folder: Path) -> dict[int, Path]:
    """Return a folder's EXR files by number."""
    found = ((number_of(file), file) for file in sorted(folder.glob("[!.]*.exr")))
    return {number: file for number, file in found if number is not None}


def first_header(files: Mapping[int, Path]) -> Mapping[str, str | int | float | None]:
    """Return the attributes of the first file whose header can be read. Raises PsvideoError where there is none."""
    fault: PsvideoError | None = None
    for number in sorted(files):
        try:
            return contents(files[number])[1]
        except PsvideoError as error:
            fault = fault or error
    raise fault or PsvideoError("a folder without EXR files has no header")


def size_and_rate(folder: Path) -> tuple[int, int, float]:
    """Return width and height in pixels of a folder's pictures, and their rate in hertz; 0 where none is known."""
    head = first_header(files_in(folder))
    return int(head["width_px"] or 0), int(head["height_px"] or 0), rate_of(head)


def rate_of(head: Mapping[str, str | int | float | None]) -> float:
    """Return the rate that a header says, in hertz; 0 where it says none, as of photographs."""
    return float(Fraction(str(head.get("framesPerSecond", "0"))))
