"""Still photographs, one per light, as a clip: no plan needed, in the order of the lights, whatever their names."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decode.decoders import decode, read_header
from psvideo.clip.decoded import Header, shot_of
from psvideo.clip.folder import KINDS
from psvideo.clip.reading import looks
from psvideo.clip.record import Clip
from psvideo.clip.stated import Stated, stated_by
from psvideo.clip.stated_curve import curve_of_pictures
from psvideo.clip.transfer import find_curve
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.camera import Encoding
from psvideo.model.plan import Plan
from psvideo.model.turn import UPRIGHT

HIGHLIGHTS_PERCENT, HIGHLIGHT = 0.1, 4.0
"""Of a picture's samples the brightest share, and how much brighter than all others they may be and still count: light
of a surface that shines broadly; a mirrored lamp is a thousand times as bright, and says nothing of a normal here."""
LEAST_SIDE_PX = 4
"""Smaller pictures show no surface."""
BAND_ROWS, SAMPLED_PX = 256, 1 << 20
"""Rows that are looked at together, and pixels that are enough to know a picture's brightest thousandth."""


@dataclass(frozen=True, kw_only=True)
class Photographs:
    """Pictures of one scene by one camera: their files, what kind they are, and what they say of themselves.

    transfer: the name of the curve by which they are read; because: why. white: the code at which they clip, where
    somebody says it, or where floating-point pictures that go beyond 1 are taken to: developed or merged ones do not at
    1; brightest: these ones' brightest sample.
    """

    files: tuple[Path, ...]
    kind: str
    header: Header
    stated: tuple[Stated, ...]
    transfer: str
    because: str
    white: float | None = None
    brightest: float = 0.0

    @property
    def encoding(self) -> Encoding:
        """How their codes are read."""
        return Encoding(transfer=self.transfer, white_level=self.white)

    def clip(self, folder: Path, plan: Plan, plan_path: Path, *, notes: tuple[str, ...] = ()) -> Clip:
        """Return them as a clip of a synced plan."""
        by_exif = shot_of({"cameraModel": self.stated[0].camera})
        head = replace(self.header, shot=self.header.shot or by_exif)
        numbers = tuple(range(1, len(self.files) + 1))
        return Clip(
            name=folder.resolve().name,
            path=folder,
            plan=plan,
            plan_path=plan_path,
            kind=self.kind,
            files=self.files,
            numbers=numbers,
            header=head,
            colour=head.colour or find_curve(self.transfer).colour,
            encoding=self.encoding,
            stills=True,
            warnings=head.warnings,
            notes=(*notes, *head.notes),
        )


def look_at(files: Sequence[Path], *, transfer: str | None = None, white_level: float | None = None) -> Photographs:
    """Look at photographs without decoding them, but for floating-point ones. ``transfer`` is the curve, and
    ``white_level`` the code of saturation, where somebody says them.

    Raises PsvideoError where one cannot be read, or where they are not of one kind, size, position and curve.
    """
    first = files[0]
    kinds = {file: KINDS[file.suffix.lower()] for file in files}
    other = next((file for file in files if kinds[file] != kinds[first]), None)
    if other is not None:
        raise PsvideoError(
            f"{first.parent}: {first.name} is {kinds[first].upper()} and {other.name} is {kinds[other].upper()}. "
            "Expected all pictures as one camera wrote them, of one kind: export them all again, alike."
        )
    kind = kinds[first]
    headers = [read_header(kind, file) for file in files]
    width_px, height_px = headers[0].width_px, headers[0].height_px
    if min(width_px, height_px) < LEAST_SIDE_PX:
        raise PsvideoError(
            f"{first}: is a picture of {width_px} x {height_px} pixels. Expected {LEAST_SIDE_PX} or more on every "
            "side: name the photographs themselves."
        )
    stated = tuple(stated_by(file) for file in files)
    _refuse_odd(files, [looks(header) for header in headers], "is")
    _refuse_odd(files, [str(one.turn) for one in stated], "lies")
    name, because = (transfer, "as you say") if transfer else curve_of_pictures(files, kind, headers[0], stated)
    find_curve(name)
    header = headers[0] if headers[0].turn != UPRIGHT else replace(headers[0], turn=stated[0].turn)
    white, brightest = (white_level, 0.0)
    if white is None and header.bits is None:
        white, brightest = _white_beyond(kind, files)
    _check_level(files[0], header, white_level)
    return Photographs(
        files=tuple(files),
        kind=kind,
        header=header,
        stated=stated,
        transfer=name,
        because=because,
        white=white,
        brightest=brightest,
    )


def _check_level(file: Path, header: Header, white_level: float | None) -> None:
    """Raise UsageError where a code of saturation is none that such a picture holds."""
    most = float("inf") if header.bits is None else 2.0**header.bits - 1
    if white_level is not None and not 0 < white_level <= most:
        raise UsageError(
            f"`white_level` is {white_level:g}, and {file.name} holds codes up to {most:g}. Give the code at which "
            "these pictures saturate, such as 4095 of 12 bits in files of 16, or leave it out."
        )


def _white_beyond(kind: str, files: Sequence[Path]) -> tuple[float | None, float]:
    """Return where floating-point pictures are taken to clip, None where that is 1, and their brightest sample.

    That is their brightest, to three figures, upwards; what is much brighter than nearly all of the picture, as a
    lamp's mirror image is, counts as clipped.
    """
    brightest = usual = 0.0
    for file in files:
        codes = np.asarray(decode(kind, file).codes)
        for first in range(0, len(codes), BAND_ROWS):
            brightest = max(brightest, _highest(codes[first : first + BAND_ROWS], 100.0))
        apart = max(math.isqrt(codes.shape[0] * codes.shape[1] // SAMPLED_PX), 1)
        usual = max(usual, _highest(codes[::apart, ::apart], 100 - HIGHLIGHTS_PERCENT))
    white = min(brightest, HIGHLIGHT * usual)
    if white <= 1:
        return None, brightest
    step = 10.0 ** (np.floor(np.log10(white)) - 2)
    return float(np.ceil(white / step) * step), brightest


def _highest(codes: NDArray[Any], percent: float) -> float:
    """Return a percentile of the samples that are numbers, 0 where none is."""
    numbers = codes[np.isfinite(codes)].astype(np.float32)  # between halves a percentile overflows
    return float(np.percentile(numbers, percent)) if numbers.size else 0.0


def _refuse_odd(files: Sequence[Path], facts: Sequence[str], verb: str) -> None:
    """Raise PsvideoError where a picture differs from what most are."""
    usual = Counter(facts).most_common(1)[0][0]
    odd = next((place for place, fact in enumerate(facts) if fact != usual), None)
    if odd is not None:
        like = files[facts.index(usual)]
        raise PsvideoError(
            f"{files[odd]}: {verb} {facts[odd]}, and {like.name} {verb} {usual}. Expected pictures of one camera in "
            "one place and one mode: take this one again, export it like the others, or move it elsewhere."
        )
