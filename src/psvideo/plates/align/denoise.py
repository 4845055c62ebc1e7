"""Noise taken out over time: results are averaged for as long as a pixel shows the same.

Averaged is albedo * normal, in which the plates are linear, so that the mean is what the mean of the plates would give.
A pixel whose neighbourhood changes by more than noise starts again: what moves is never mixed with what was there.
Noise is known by the finest detail of changes, which what moves has least of. A demosaic or a filter takes the finest
detail out of noise itself: how much of it is left, only the plates' dark shows.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from psvideo.compute.ranks import median, quantile, rising_parts
from psvideo.model.arrays import Flags, Floats
from psvideo.model.channels import mean_of_channels
from psvideo.model.surface import Surface
from psvideo.plates.align.velocity.followed import mean_over
from psvideo.plates.light_plate import LightPlate

WINDOW_PX = 5
MOST_CHANGE = 2.0
"""A neighbourhood changed where its mean squared difference is this many times what noise makes of it."""
MOST_DRIFT = 0.4
"""A neighbourhood changed, too, where its mean difference, squared, is this share of that; white noise leaves a
25th."""
MOST_SPREAD = 20.0
"""Noise is no more than this many times what its finest detail shows, as a variance (a blur of 0.75 px): more would
leave so little to go by that fine detail which moves would pass for noise."""
DRIFT_OF_SPREAD = 0.2
"""Means of noise that is alike in neighbours are larger, by this power of the spread: measured for a demosaic's (3,
where they hold a 16th of the square) and blurs of 0.5 to 0.75 px (2 to 20: a 12th to a 6th)."""
FINEST = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]], np.float32) / 6
LEVELS = 8
THIN_PX = 3
"""Of so many rows and columns one is looked at for noise."""
LOW_SHARE, LOW_OF_MEAN = 0.25, 1.213 / 3
"""Noise comes from the lowest quarter of squared differences, for up to three quarters of a picture may move: the
quarter's border as a share of the mean, for three normal components (chi squared)."""


@dataclass(frozen=True, kw_only=True)
class Average:
    """``vectors`` (3, row, col) are albedo * normal, ``albedo`` (channel, row, col), ``count`` (row, col) results."""

    vectors: Floats
    albedo: Floats
    count: Floats


@dataclass(frozen=True, kw_only=True)
class ResultNoise:
    """What plates say of their result's noise: it grows with the ``light`` at every THIN_PX-th row and column, (row,
    col), of any unit, and is ``spread`` times the variance that its finest detail shows."""

    light: Floats
    spread: float = 1.0

    @classmethod
    def of(cls, plates: Sequence[LightPlate], spread: float) -> "ResultNoise":
        """Return it of a round's plates, whose light is the mean of all."""
        light = np.zeros([-(-size // THIN_PX) for size in plates[0].shape[:2]], np.float32)
        for plate in plates:
            some = plate.picture.thinned(THIN_PX)
            some = some if some.ndim == 2 else mean_of_channels(some)
            light += some / np.float32(plate.saturation * len(plates))
        return cls(light=mean_over(light, 3), spread=spread)


def averaged(
    before: Average | None, surface: Surface, results: int, *, noise: ResultNoise | None = None
) -> tuple[Average, Surface]:
    """Return the average that a surface adds to, and the surface as it has it.

    ``before`` is the average up to the result before. It is of ``results`` at most; beyond that the oldest fade out, so
    that memory does not depend on it. Without ``noise`` it is taken as white, and to grow with the surface's albedo.
    """
    average = added(before, surface, results, noise=noise)
    return average, _with(surface, average)


def added(before: Average | None, surface: Surface, results: int, *, noise: ResultNoise | None = None) -> Average:
    """Return the average that a surface adds to; arguments are those of ``averaged``."""
    now = _average_of(surface)
    if before is None:
        return now
    if noise is None:
        noise = ResultNoise(light=np.sqrt((before.vectors[:, ::THIN_PX, ::THIN_PX] ** 2).sum(axis=0)))
    return _updated(before, now, results, noise)


def _average_of(surface: Surface) -> Average:
    albedo = surface.albedo if surface.albedo.ndim == 3 else surface.albedo[..., None]
    channels = np.ascontiguousarray(np.moveaxis(albedo, -1, 0), np.float32)
    vectors = np.moveaxis(surface.normals, -1, 0).astype(np.float32) * channels.mean(axis=0)
    return Average(vectors=vectors, albedo=channels, count=surface.valid.astype(np.float32))


def _updated(before: Average, now: Average, results: int, noise: ResultNoise) -> Average:
    both = (before.count > 0) & (now.count > 0)
    same = _alike(before, now, both, noise)
    count = np.where(same, np.minimum(before.count + 1, np.float32(results)), now.count)
    share = np.where(same, 1 / np.maximum(count, 1), 1).astype(np.float32)
    return Average(
        vectors=before.vectors + share * (now.vectors - before.vectors),
        albedo=before.albedo + share * (now.albedo - before.albedo),
        count=count,
    )


def _alike(before: Average, now: Average, both: Flags, noise: ResultNoise) -> Flags:
    """Return where a neighbourhood differs from its average by noise only, pixel by pixel and as a whole."""
    apart, spread = (now.vectors - before.vectors) * both, min(noise.spread, MOST_SPREAD)
    share = np.float32(1) + 1 / np.maximum(
        before.count, np.float32(1)
    )  # the average is noisy as well, the less the longer it is
    fine = _fine_noise(np.asarray(apart / np.sqrt(share), np.float32), noise.light, both)
    expected = mean_over(np.asarray(share * np.float32(spread) * fine * both, np.float32), WINDOW_PX)
    each = mean_over(np.sum(apart**2, axis=0, dtype=np.float32), WINDOW_PX)
    whole = np.sum([mean_over(plane, WINDOW_PX) ** 2 for plane in apart], axis=0)
    drift = np.float32(MOST_DRIFT * spread**DRIFT_OF_SPREAD)
    return np.asarray(both & (each <= MOST_CHANGE * expected) & (whole <= drift * expected))


def _fine_noise(apart: Floats, light: Floats, both: Flags) -> Floats:
    """Return the mean squared noise of one result by light, as far as its finest detail shows; ``apart`` (3, row, col)
    is what differs in time.

    Only the finest detail is looked at (Immerkaer, "Fast noise variance estimation", CVIU 1996), which smooth surfaces
    lack, moving or not. Brighter never is less noisy: a brightness that only moving parts have says nothing above that.
    """
    fine = [cv2.filter2D(plane, -1, FINEST) for plane in apart]
    inner = cv2.erode(both.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    square = np.sum([plane**2 for plane in fine], axis=0)
    thin = (slice(None, None, THIN_PX), slice(None, None, THIN_PX))
    squares, levels = square[thin][inner[thin]], light[inner[thin]]
    if len(squares) < LEVELS * 8:
        return np.zeros_like(square)
    parts = rising_parts(levels, LEVELS)
    at = [median(levels[part]) for part in parts]
    noise = np.array([quantile(squares[part], LOW_SHARE) / LOW_OF_MEAN for part in parts])
    by_light = np.interp(light, at, np.minimum.accumulate(noise[::-1])[::-1]).astype(np.float32)
    return np.asarray(cv2.resize(by_light, square.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def _with(surface: Surface, average: Average) -> Surface:
    """Return the surface as its average has it; pixels that started again stay to the bit."""
    longer = average.count > 1
    length = np.sqrt((average.vectors**2).sum(axis=0))
    normals = np.empty((3, *longer.shape), surface.normals.dtype)
    normals[:] = np.where(longer, average.vectors / np.maximum(length, 1e-12), np.moveaxis(surface.normals, -1, 0))
    brightness = length / np.maximum(average.albedo.mean(axis=0), 1e-12)
    given = surface.albedo if surface.albedo.ndim == 3 else surface.albedo[..., None]
    albedo = np.empty(average.albedo.shape, surface.albedo.dtype)
    albedo[:] = np.where(longer, average.albedo * brightness, np.moveaxis(given, -1, 0))
    shown = albedo[0] if surface.albedo.ndim == 2 else np.moveaxis(albedo, 0, -1)
    return replace(surface, normals=np.moveaxis(normals, 0, -1), albedo=shown)
