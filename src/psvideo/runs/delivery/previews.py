"""Movies for eyes of what a run delivered, made from the files themselves once all are there.

They are read back one instant at a time, so that a movie of any length needs the memory of one, and a run that was
stopped makes them at its end as one that was not.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from psvideo.clip.decode import exr
from psvideo.compute.memory import HALF_MAX
from psvideo.compute.progress import Watch
from psvideo.model.arrays import Image, Pixels
from psvideo.model.choices import Codec, Preview
from psvideo.model.quantities import QUANTITIES
from psvideo.pictures.on_screen import exposure_for, smaller_by_rows, srgb
from psvideo.pictures.quantity import picture_of
from psvideo.pictures.relit_kernel import shown_by
from psvideo.runs.delivery.relit import TURN_S, WIDTH_PX, read_relit

INK = (226, 226, 226)


@dataclass(frozen=True, kw_only=True)
class PreviewedInstant:
    """The files of one instant, by what they show; ``relit`` is its picture in the relit movie, where it was kept."""

    number: int
    files: Mapping[str, Path]
    relit: Path | None = None


def preview_name(clip: str, preview: Preview, suffix: str) -> str:
    """Return a movie's path below the output folder.

    >>> preview_name("take3", "relit", "mp4")
    'preview/take3_relit.mp4'
    """
    return f"preview/{clip}_{preview}.{suffix}"


def write_preview(
    paths: Mapping[Codec, Path], preview: Preview, instants: Sequence[PreviewedInstant], *, fps: Fraction, watch: Watch
) -> None:
    """Write one movie of the instants, in the order of their numbers, in one coding or several; a number that is not
    there holds the one before.

    How bright pictures are shown is set by the first instant, for the whole movie. A lone instant is relit for one
    turn of the light. Codings come one after the other: two encoders at once would hold more than memory's test allows.
    """
    from psvideo.export.preview_movie import (  # FFmpeg's libraries take memory: only where a movie is made
        even,
        write_movie,
    )

    exposure = _exposure(preview, instants[0])
    if len(instants) == 1 and preview == "relit":
        turn = range(instants[0].number, instants[0].number + max(round(TURN_S * fps), 1))
        instants = [replace(instants[0], number=number, relit=None) for number in turn]

    def pictures() -> Iterator[Pixels]:
        watched = watch(instants, total=len(instants), what=f"movie of {preview}", unit="pictures")
        last = instants[-1].number + 1
        for place, one in enumerate(watched):
            shown = even(_picture(preview, one, exposure, fps))
            after = instants[place + 1].number if place + 1 < len(instants) else last
            for _ in range(one.number, after):
                yield shown

    for codec, path in paths.items():
        write_movie(path, pictures(), fps=fps, codec=codec)


def _exposure(preview: Preview, first: PreviewedInstant) -> float:
    """Return by which factor a whole movie's light is shown: the least that the first instant's pictures ask for."""
    measured = {"relit": ("albedo",), "normals": (), "beauty": ("beauty",)}.get(
        preview, tuple(name for name in first.files if name != "ambient")
    )
    return min((exposure_for(_read(first.files[name], WIDTH_PX)) for name in measured), default=1.0)


def _picture(preview: Preview, one: PreviewedInstant, exposure: float, fps: Fraction) -> Pixels:
    if preview in QUANTITIES:
        return picture_of(preview, _read(one.files[preview], WIDTH_PX), exposure=exposure)
    return _relit(one, exposure, fps) if preview == "relit" else _sheet(one, exposure)


def _relit(one: PreviewedInstant, exposure: float, fps: Fraction) -> Pixels:
    kept = None if one.relit is None else np.load(one.relit)
    picture = read_relit(one.files["normals"], one.files["albedo"], one.number, fps) if kept is None else kept
    return shown_by(_shown_as(exposure), picture)


@lru_cache(maxsize=1)
def _shown_as(exposure: float) -> Pixels:
    """Return the sRGB code of every half float, by its bits."""
    halves = np.arange(1 << 16, dtype=np.uint16).view(np.float16).astype(np.float32)
    light = np.nan_to_num(halves, nan=0.0, posinf=HALF_MAX, neginf=0.0)
    return np.ascontiguousarray(srgb(light[:, None], exposure=exposure)[:, 0, 0])


def _sheet(one: PreviewedInstant, exposure: float) -> Pixels:
    """Return the plates side by side, each with its name, all at one exposure."""
    across = math.ceil(math.sqrt(len(one.files)))
    plates = {name: _read(path, WIDTH_PX // across) for name, path in one.files.items()}
    tiles = [_named(srgb(image, exposure=exposure), name) for name, image in plates.items()]
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % across)
    rows = [np.concatenate(tiles[a : a + across], axis=1) for a in range(0, len(tiles), across)]
    return np.concatenate(rows, axis=0)


def _named(picture: Pixels, name: str) -> Pixels:
    size = max(picture.shape[1] / 640, 0.35)
    place = (int(8 * size) + 2, int(24 * size) + 2)
    named = cv2.putText(picture.copy(), name, place, cv2.FONT_HERSHEY_SIMPLEX, 0.7 * size, INK, 1, cv2.LINE_AA)
    return np.asarray(named, np.uint8)


def _read(path: Path, width_px: int) -> Image:
    codes = exr.decode(path).codes
    return smaller_by_rows(lambda first, last: np.asarray(codes[first:last], np.float32), codes.shape, width_px)
