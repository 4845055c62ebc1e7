"""How steady results are from one to the next where nothing moves: what the eye sees as flicker."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.model.arrays import Floats
from psvideo.model.channels import mean_of_channels
from psvideo.model.surface import Surface
from psvideo.report.observe.thinned import thin_surface

LEAST_PIXELS = 100
MOST_TURNED_DEG = 5.0
"""Where the mean normal of a neighbourhood turns by more than this from one result to the next, something moved."""
WINDOW = 5
ENOUGH = 8192
"""Medians are taken over this many pixels, spread evenly: more would not change them."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Change:
    """From the result before to this one, over pixels at rest: the median change of a normal, of an albedo without its
    sign, and with it (which noise leaves near 0, and a light that flickers does not)."""

    normals_deg: float
    albedo_percent: float
    level_percent: float


@dataclass(frozen=True, kw_only=True)
class Sample:
    """A surface, thinned; ``normals`` are planes, (3, row, col)."""

    normals: Floats
    albedo: Floats
    valid: NDArray[np.bool_]


def sample_of(surface: Surface, some: Surface | None = None) -> Sample:
    """Return what to keep of a surface to hold the next one against; ``some`` is the surface, thinned."""
    some = some or thin_surface(surface)
    albedo = some.albedo.astype(np.float32)
    return Sample(
        normals=np.moveaxis(some.normals, -1, 0).astype(np.float32),
        albedo=albedo if albedo.ndim == 2 else mean_of_channels(albedo),
        valid=some.measured,
    )


def change(before: Sample, after: Sample) -> Change | None:
    """Return how much two results in turn differ where nothing moved; None where too little is at rest."""
    both = before.valid & after.valid & (before.albedo > 0)
    rest = both & _points_alike(*(_around(one.normals * both) for one in (before, after)))
    if rest.sum() < LEAST_PIXELS:
        return None
    some = np.flatnonzero(rest)
    some = some[:: max(len(some) // ENOUGH, 1)]
    one, other = (np.take(sample.normals.reshape(3, -1), some, axis=1) for sample in (before, after))
    relative = after.albedo.ravel()[some] / before.albedo.ravel()[some] - 1
    return Change(
        normals_deg=median(_angle_deg(one, other)),
        albedo_percent=float(100 * median(np.abs(relative))),
        level_percent=float(100 * median(relative)),
    )


def _around(planes: Floats) -> Floats:
    """Return the means of planes (plane, row, col) over WINDOW."""
    return np.stack([np.asarray(cv2.blur(plane, (WINDOW, WINDOW)), np.float32) for plane in planes])


def _points_alike(one: Floats, other: Floats) -> NDArray[np.bool_]:
    """Return where vectors of any length (3, row, col) are turned by no more than MOST_TURNED_DEG."""
    cosine, lengths = (one * other).sum(axis=0), (one * one).sum(axis=0) * (other * other).sum(axis=0)
    least = np.float32(np.cos(np.deg2rad(MOST_TURNED_DEG)))
    return np.asarray(cosine >= least * np.sqrt(lengths))


def _angle_deg(one: Floats, other: Floats) -> NDArray[np.float64]:
    """Return the angles between vectors (3, place) of any length; exact for small ones."""
    (x, y, z), (u, v, w) = one, other  # np.cross and sums over three planes take four times as long
    across = np.sqrt((y * w - z * v) ** 2 + (z * u - x * w) ** 2 + (x * v - y * u) ** 2)
    return np.asarray(np.rad2deg(np.arctan2(across, x * u + y * v + z * w)), np.float64)
