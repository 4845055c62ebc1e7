"""How bright a picture is across a sphere's rim, and how well that shows where the rim is.

At its very rim a smooth sphere mirrors fully (Fresnel: at grazing angles everything does) what is just behind it. So a
mirror's picture is continuous there: it only begins to change, and it does so with the cosine of incidence, which
grows as the root of the distance from the rim. Inside, the model is a cubic in that root; outside, a straight
line; all of it blurred by the lens. A matte sphere may jump at its rim, and inside it is a square in the root. The
steepest place of a mirror's edge lies inside its rim: on a dark ball before a bright wall by several pixels.

Everything but the rim's place and the blur is linear, and eliminated by least squares (variable projection). The
residuals, as a likelihood with unknown noise, say how good a place is. Pictures and radii in which nothing stands out
favour no place, so they need no weights.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d  # type: ignore[attr-defined]

from psvideo.calibrate.sphere.round_things import Grey
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.model.camera import FloatArray

Surface = Literal["mirror", "matte"]

STEP_PX = 0.5
SHIFT_PX = 0.25
"""How finely pictures are sampled across the rim, and places of the rim are tried."""
_FINE_PX = 0.05
_LONGEST_PX = 160.0
_SHAPES = {
    "mirror": ("level", "slope outside", "root", "square", "cube"),
    "matte": ("outside", "slope outside", "inside", "root", "square"),
}
LEAST_NOISE = 0.01
"""Share of a profile's own spread that counts as noise at least: a model is not better than that."""


def across_rim(
    pictures: Sequence[Grey], view: SphereView, place: FloatArray, *, reach_px: float, spokes: int
) -> tuple[FloatArray, FloatArray]:
    """Return brightness across an outline, (picture, spoke, step) from ``reach_px`` inside to outside, averaged along
    the rim between spokes, NaN outside the picture; and where the spokes cross the outline, (spoke, 2)."""
    per = max(int(np.ceil(2 * np.pi * place[2] / spokes)), 1)
    rim = view.curve(place, spokes * per)
    along = np.roll(rim, -1, axis=0) - np.roll(rim, 1, axis=0)
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    outward *= np.sign(((rim - rim.mean(axis=0)) * outward).sum())
    steps = _steps(reach_px)
    spots = (rim[:, None] + outward[:, None] * steps[None, :, None]).astype(np.float32)
    values = [
        cv2.remap(
            picture,
            spots[..., 0],
            spots[..., 1],
            cv2.INTER_CUBIC,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=(np.nan,) * 4,
        )
        .reshape(spokes, per, len(steps))
        .mean(axis=1)
        for picture in pictures
    ]
    crossed: FloatArray = rim[per // 2 :: per][:spokes].astype(np.float64)
    return np.asarray(values, np.float64), crossed


def shifts(most_px: float) -> FloatArray:
    """Return the places of the rim that are tried, in pixels outward from the expected one."""
    count = round(most_px / SHIFT_PX)
    return np.arange(-count, count + 1, dtype=np.float64) * SHIFT_PX


def likely_blur(
    values: FloatArray, *, reach_px: float, most_px: float, surface: Surface, blurs: Sequence[float]
) -> float:
    """Return which blur (standard deviation in pixels) explains profiles best, each at its own best place."""
    left = {blur: _unexplained(values, blur, reach_px, most_px, surface).min(axis=2) for blur in blurs}
    return min(left, key=lambda blur: float(np.median(np.log(left[blur]), axis=1).sum()))


def log_likelihood(
    values: FloatArray, *, blur_px: float, reach_px: float, most_px: float, surface: Surface
) -> FloatArray:
    """Return how likely every place of the rim is on every spoke, over all pictures: (spoke, shift), up to a constant.

    Neighbouring samples share their noise over the blur's width, and count as one. What misleads one picture misleads
    the others in part (a reflection is the same under all lights), so n pictures count as the root of n.
    """
    left = _unexplained(values, blur_px, reach_px, most_px, surface)
    independent = values.shape[2] * STEP_PX / (2 * blur_px + 1)
    total: FloatArray = np.log(left).sum(axis=0) * (-0.5 * independent / np.sqrt(len(left)))
    return total


def _steps(reach_px: float) -> FloatArray:
    count = round(reach_px / STEP_PX)
    return np.arange(-count, count + 1, dtype=np.float64) * STEP_PX


def _unexplained(
    values: FloatArray, blur_px: float, reach_px: float, most_px: float, surface: Surface
) -> NDArray[np.float64]:
    """Return the variance that the model leaves, (picture, spoke, shift); 1 where a profile leaves the picture."""
    inside: NDArray[np.bool_] = np.asarray(np.all(np.isfinite(values), axis=2), np.bool_)
    known = np.where(inside[..., None], values - values.mean(axis=2, keepdims=True), 0.0)
    basis = _basis(blur_px, reach_px, most_px, surface)
    explained = np.einsum("ink,pan->paik", basis, known, optimize=True)
    spread = (known**2).sum(axis=2)[..., None]
    left = np.maximum(spread - (explained**2).sum(axis=3), 0) + LEAST_NOISE**2 * spread + 1e-14
    return np.where(inside[..., None], left / (values.shape[2] - basis.shape[2]), 1.0)


@lru_cache(maxsize=64)
def _basis(blur_px: float, reach_px: float, most_px: float, surface: Surface) -> FloatArray:
    """Return orthonormal columns that span the model at every place of the rim, (shift, step, column)."""
    fine, shapes = _blurred(blur_px)
    away = _steps(reach_px)[None, :] - shifts(most_px)[:, None]
    columns = np.stack([np.interp(away, fine, shapes[name]) for name in _SHAPES[surface]], axis=2)
    columns /= np.maximum(np.linalg.norm(columns, axis=1, keepdims=True), 1e-12)
    basis: FloatArray = np.linalg.qr(columns)[0]
    return basis


@lru_cache(maxsize=16)
def _blurred(blur_px: float) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Return places across a rim at 0 (positive outside), and the model's parts there."""
    fine = np.arange(-_LONGEST_PX, _LONGEST_PX + _FINE_PX / 2, _FINE_PX)
    outside = np.clip(fine / _FINE_PX + 0.5, 0, 1)
    root = np.sqrt(np.maximum(-fine, 0))
    parts = {
        "level": np.ones_like(fine),
        "outside": outside,
        "slope outside": np.maximum(fine, 0),
        "inside": 1 - outside,
        "root": root,
        "square": root**2,
        "cube": root**3,
    }
    blurred = {
        name: gaussian_filter1d(part, blur_px / _FINE_PX, mode="nearest", truncate=5) for name, part in parts.items()
    }
    return fine, blurred
