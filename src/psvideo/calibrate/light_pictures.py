"""Pictures of one scene, one per light, in linear light: what every calibration of lights starts from.

``picture_sets`` reads still photographs, one per light, in a folder; and plates, a folder per light (``psvideo split``
writes such a folder). Clips need their flashes found first: ``psvideo.runs.photographs.light_sets`` takes all three,
and gives the same record.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.channels import mean_of_channels
from psvideo.model.rows.clipping import LOSSY_MARGIN, SATURATED
from psvideo.plates.sequence import Round

CLIPPED_FROM = SATURATED - LOSSY_MARGIN
"""From this share of the sensor's range on a pixel of a picture, which may be a JPEG, counts as clipped."""


@dataclass(frozen=True, kw_only=True)
class LightPictures:
    """One picture per light of a scene that stood still.

    Attributes
    ----------
    names
        Of the lights, in the images' order.
    images
        Shape (light, row, col) or (light, row, col, 3), float32, linear, 1.0 = sensor saturation; ambient light is off
        where ``ambient`` (same shape without the light) could be measured.
    saturated
        Same shape as images, True where a value was clipped (in any of the frames that were averaged).
    seen
        Shape (light, row), False where no frame saw a row; the pictures are 0 there.
    frames
        How many pictures of each light were averaged.
    flashes_s
        For how long every light shone, its plan's full flash; None where that is not known, as of photographs.
    """

    names: tuple[str, ...]
    images: NDArray[np.float32]
    saturated: NDArray[np.bool_]
    seen: NDArray[np.bool_]
    ambient: NDArray[np.float32] | None = None
    frames: int = 1
    flashes_s: tuple[float, ...] | None = None

    @property
    def height_px(self) -> int:
        """Rows of a picture."""
        return int(self.images.shape[1])

    @property
    def width_px(self) -> int:
        """Columns of a picture."""
        return int(self.images.shape[2])

    @property
    def grey(self) -> NDArray[np.float32]:
        """The mean over channels, shape (light, row, col)."""
        return self.images if self.images.ndim == 3 else mean_of_channels(self.images)


def light_pictures(
    names: Sequence[str],
    images: Sequence[NDArray[np.float32]],
    *,
    ambient: NDArray[np.float32] | None = None,
    ambient_times: Sequence[float] | Doubles = (),
    ambient_is_off: bool = False,
    saturation: Sequence[float] | None = None,
    seen: NDArray[np.bool_] | None = None,
) -> LightPictures:
    """Return pictures of one size as a record; ``ambient`` is taken off, unless that was done before.

    ``ambient_times`` (light,) says how often each picture holds the ambient light, where they were exposed differently.

    ``saturation`` (light,) is the value from which on each picture is clipped, with ambient light on it; 1.0 left out.
    """
    stacked = np.stack(images).astype(np.float32, copy=False)
    level = np.ones(len(names)) if saturation is None else np.asarray(saturation)
    whole = stacked + ambient if ambient is not None and ambient_is_off else stacked
    clipped = whole >= (CLIPPED_FROM * level).reshape(-1, *[1] * (stacked.ndim - 1)).astype(np.float32)
    return LightPictures(
        names=tuple(names),
        images=stacked if ambient is None or ambient_is_off else _without(stacked, ambient, ambient_times),
        saturated=clipped,
        seen=np.ones(stacked.shape[:2], np.bool_) if seen is None else seen,
        ambient=ambient,
    )


def _without(
    images: NDArray[np.float32], ambient: NDArray[np.float32], times: Sequence[float] | Doubles
) -> NDArray[np.float32]:
    if not len(times):
        return images - ambient
    each = np.asarray(times, np.float32).reshape(-1, *[1] * ambient.ndim)
    less: NDArray[np.float32] = images - each * ambient
    return less


def pictures_of_round(one: Round, *, flashes_s: tuple[float, ...] | None = None) -> LightPictures:
    """Return what a round's plates show, from which ambient light was taken; rows count that all of a plate shows."""
    pictures = light_pictures(
        one.lights,
        [plate.image for plate in one.plates],
        ambient=None if one.ambient is None else one.ambient.image,
        ambient_is_off=True,
        saturation=[plate.saturation for plate in one.plates],
        seen=np.stack([plate.pixels_seen.all(axis=1) for plate in one.plates]),
    )
    return replace(pictures, flashes_s=flashes_s)


def mean_of_sets(sets: Iterable[LightPictures]) -> LightPictures:
    """Return the mean over sets of the same lights, row by row over the frames that saw it; at least one set."""
    total: LightPictures | None = None
    count = np.zeros(())
    for one in sets:
        weight = one.seen.astype(np.float32)
        shown = replace(one, images=one.images * _per_pixel(weight, one.images))
        total = shown if total is None else _sum(total, shown)
        count = count + weight
    if total is None:
        raise ValueError("there is nothing to average")
    images = total.images / _per_pixel(np.maximum(count, 1).astype(np.float32), total.images)
    return replace(total, images=images, seen=count > 0)


def _sum(one: LightPictures, other: LightPictures) -> LightPictures:
    """Return the sum of pictures; of ambient light, which is averaged already, the mean weighted by frames."""
    ambient = None
    if one.ambient is not None and other.ambient is not None:
        share = np.float32(other.frames / (one.frames + other.frames))
        ambient = one.ambient * (1 - share) + other.ambient * share
    return replace(
        one,
        images=one.images + other.images,
        saturated=one.saturated | other.saturated,
        ambient=ambient,
        frames=one.frames + other.frames,
    )


def _per_pixel(rows: NDArray[np.float32], images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what stands per row (light, row) in a shape that goes with pictures."""
    return rows.reshape(*rows.shape, *[1] * (images.ndim - 2))
