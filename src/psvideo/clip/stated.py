"""What a photograph's file says of itself beside its pixels: how it was exposed, how it lies, and its colour's curve.

EXIF (CIPA DC-008) is read from JPEG, TIFF, PNG, DNG and raw files; the curve by ``profile_curve``.
"""

import contextlib
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import ExifTags, Image, UnidentifiedImageError

from psvideo.clip.decode.decoders import read_header
from psvideo.clip.folder import KINDS
from psvideo.clip.profile_curve import above_0, coded_curve, curve_named_in
from psvideo.errors import PsvideoError
from psvideo.formats.paths import check_file
from psvideo.model.arrays import Doubles
from psvideo.model.turn import EXIF, UPRIGHT, Turn

WIDTH_35_MM = 36.0
OTHER_EXPOSURE = 1.05
"""Exposures that differ by this factor were not meant to be the same."""
SEVERAL_PICTURES = ("tiff", "dng", "raw")
"""Kinds whose files may hold a small picture before the one that is decoded."""


@dataclass(frozen=True, kw_only=True)
class Stated:
    """What a file says; None where it does not.

    transfer: the curve's name, or "unknown" where its curve is none that psvideo knows. by: what says so.
    exposure: light gathered, seconds times ISO over the f-number squared, on a scale of its own, of those of the three
    that it says, exposed_by: exposures by other ones cannot be compared.
    focal_widths: the focal length in widths of the picture's longer side, which is longer_px; focal_px: in pixels.
    """

    transfer: str | None = None
    by: str = ""
    exposure: float | None = None
    exposed_by: tuple[str, ...] = ()
    focal_widths: float | None = None
    longer_px: int = 0
    camera: str = ""
    turn: Turn = UPRIGHT

    @property
    def focal_px(self) -> float | None:
        """The focal length in pixels, where the file says it of a picture that was not cropped."""
        return self.focal_widths * self.longer_px if self.focal_widths and self.longer_px else None


def stated_by(path: Path) -> Stated:
    """Return what a file says of itself; nothing where it is of a kind that says nothing, or cannot be read. What one
    part of it says does not hang on another that is damaged."""
    found = Stated()
    with contextlib.suppress(Exception), warnings.catch_warnings():  # Pillow may raise anything over damaged tags
        warnings.simplefilter("ignore")  # of tags that are damaged: what they say is left out
        check_file(path)
        longer_px, info, exif = _opened(path)
        found = replace(found, longer_px=longer_px)
        with contextlib.suppress(Exception):
            transfer, by = coded_curve(path) or curve_named_in(info)
            found = replace(found, transfer=transfer, by=by)
        found = replace(found, turn=EXIF.get(int(above_0(exif.get(ExifTags.Base.Orientation)) or 1), UPRIGHT))
        found = replace(
            found,
            **_exposure(exif),
            focal_widths=above_0(exif.get(ExifTags.Base.FocalLengthIn35mmFilm), 1 / WIDTH_35_MM),
            camera=_camera(exif),
        )
    return found if found.exposure is not None else _exposed_by_libraw(path, found)


def _opened(path: Path) -> tuple[int, dict[Any, Any], dict[int, Any]]:
    """Return the picture's longer side in pixels, what Pillow says of its colour, and all tags of its EXIF."""
    try:
        with Image.open(path) as picture:
            exif = picture.getexif()
            longer_px = _longer_px(path) or max(picture.size)
            return longer_px, picture.info, {**exif, **exif.get_ifd(ExifTags.IFD.Exif)}
    except UnidentifiedImageError:  # samples that Pillow has no mode for, in a file that begins as TIFFs do
        exif = Image.Exif()
        with path.open("rb") as file:
            exif.load_from_fp(file)
            tags = {**exif, **exif.get_ifd(ExifTags.IFD.Exif)}
        return _longer_px(path), {"icc_profile": tags.get(ExifTags.Base.InterColorProfile)}, tags


def _longer_px(path: Path) -> int:
    """Return the longer side of the picture that is decoded, where a file may hold a small one before it; else 0."""
    kind = KINDS.get(path.suffix.lower())
    if kind not in SEVERAL_PICTURES:
        return 0
    head = read_header(kind, path)
    return max(head.width_px, head.height_px)


def _exposed_by_libraw(path: Path, found: Stated) -> Stated:
    """Return what was found with the exposure of a raw file whose EXIF only LibRaw finds."""
    if KINDS.get(path.suffix.lower()) != "raw":
        return found
    from psvideo.clip.decode import raw  # loads LibRaw

    with contextlib.suppress(PsvideoError, OSError):
        found = replace(found, exposure=raw.relative_exposure(path), exposed_by=("time", "aperture", "ISO"))
    return found


def relative_exposures(lights: Sequence[Stated], dark: Sequence[Stated] = ()) -> Doubles | None:
    """Return by how much more than the usual picture of a light each one was exposed, (picture,), those of the dark
    last, 1 where they do not say; None where the lights' do not all say it by the same tags, or all are alike."""
    known = np.array([one.exposure for one in lights if one.exposure is not None])
    if not len(known) or len(known) < len(lights) or not all(says_as(one, lights[0]) for one in lights):
        return None
    usual = float(np.median(known))
    of_dark = [one.exposure if one.exposure is not None and says_as(one, lights[0]) else usual for one in dark]
    relative = np.append(known, of_dark) / usual
    return relative if are_uneven(relative) else None


def says_as(one: Stated, other: Stated) -> bool:
    """Return whether two files say how they were exposed by the same tags, so that it can be compared: one without
    FNumber would count as taken at f/1 beside one at f/4."""
    return one.exposure is not None and one.exposed_by == other.exposed_by


def are_uneven(exposures: Doubles) -> bool:
    """Return whether exposures are not all alike."""
    return bool(exposures.max() >= OTHER_EXPOSURE * exposures.min())


def _camera(taken: dict[int, Any]) -> str:
    make, model = (str(taken.get(tag, "")).strip(" \0") for tag in (ExifTags.Base.Make, ExifTags.Base.Model))
    return model if make and model.startswith(make.split()[0]) else f"{make} {model}".strip()


def _exposure(taken: dict[int, Any]) -> dict[str, Any]:
    """Return ``exposure`` and ``exposed_by`` of a Stated by EXIF's tags."""
    iso = taken.get(ExifTags.Base.ISOSpeedRatings)
    stop = above_0(taken.get(ExifTags.Base.FNumber))
    factors = {
        "time": above_0(taken.get(ExifTags.Base.ExposureTime)),
        "aperture": None if stop is None else 1 / stop**2,
        "ISO": above_0(iso[0] if isinstance(iso, tuple) and iso else iso),
    }
    known = {name: factor for name, factor in factors.items() if factor is not None}
    return {"exposure": float(np.prod(list(known.values()))), "exposed_by": tuple(known)} if "time" in known else {}
