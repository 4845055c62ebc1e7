"""How steady results are from one to the next where nothing moves: what the eye sees as flicker."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.surface import Surface

STRIDE = 4
LEAST_PIXELS = 100
MOST_TURNED_DEG = 5.0
"""Where the mean normal of a neighbourhood turns by more than this from one result to the next, something moved."""
WINDOW = 5

Values = NDArray[np.float32]


@dataclass(frozen=True, kw_only=True)
class Change:
    """From the result before to this one, over pixels at rest: the median change of a normal, of an albedo without its
    sign, and with it (which noise leaves near 0, and a light that flickers does not)."""

    normals_deg: float
    albedo_percent: float
    level_percent: float


@dataclass(frozen=True, kw_only=True)
class Sample:
    """Every fourth pixel of a surface in both directions."""

    normals: Values
    albedo: Values
    valid: NDArray[np.bool_]


def sample_of(surface: Surface) -> Sample:
    """Return what to keep of a surface to hold the next one against."""
    thin = (slice(None, None, STRIDE), slice(None, None, STRIDE))
    albedo = surface.albedo[thin].astype(np.float32)
    return Sample(
        normals=surface.normals[thin].astype(np.float32),
        albedo=albedo if albedo.ndim == 2 else albedo.mean(axis=2),
        valid=surface.valid[thin].copy(),
    )


def change(before: Sample, after: Sample) -> Change | None:
    """Return how much two results in turn differ where nothing moved; None where too little is at rest."""
    both = before.valid & after.valid & (before.albedo > 0)
    window = (WINDOW, WINDOW)
    early, late = (np.asarray(cv2.blur(one.normals * both[..., None], window), np.float32) for one in (before, after))
    rest = both & (_angle_deg(early, late) <= MOST_TURNED_DEG)
    if rest.sum() < LEAST_PIXELS:
        return None
    relative = after.albedo[rest] / before.albedo[rest] - 1
    return Change(
        normals_deg=float(np.median(_angle_deg(before.normals[rest], after.normals[rest]))),
        albedo_percent=float(100 * np.median(np.abs(relative))),
        level_percent=float(100 * np.median(relative)),
    )


def _angle_deg(one: Values, other: Values) -> NDArray[np.float64]:
    """Return the angles between vectors of any length; exact for small ones."""
    across = np.linalg.norm(np.cross(one, other), axis=-1)
    return np.asarray(np.rad2deg(np.arctan2(across, np.einsum("...i,...i", one, other))), np.float64)
