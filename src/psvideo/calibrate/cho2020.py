"""How strong lights are, from any matte scene under lights whose directions are known (semi-calibrated).

D. Cho, Y. Matsushita, Y.-W. Tai and I. S. Kweon, "Semi-calibrated photometric stereo", IEEE Transactions on Pattern
Analysis and Machine Intelligence 42(1), 2020 (first "Photometric stereo under non-uniform light intensities and
exposures", ECCV 2016): a pixel that no shadow falls on has measurements m with ``m_l / E_l = d_l . b``. What lies
across the directions' three dimensions must vanish, ``P diag(m) (1 / E) = 0`` with P = I - D pinv(D), for every pixel:
1 / E is the direction in which the sum of these equations' squares is least. Four lights are needed, and the scene must
face several ways. The scale is free: the mean over lights is 1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.errors import PsvideoError
from psvideo.model.camera import FloatArray

LIT, KEPT = 0.08, 0.8
"""A pixel counts that every light lights at least this much of its brightest one; of these the share that fits best."""
LEAST_PIXELS, MOST_PIXELS = 300, 20_000
"""Of so few pixels nothing is measured, and so many are enough."""
BLOCKS, FEWEST_OF_A_BLOCK = 4, 20
"""The jackknife leaves out one of this many times this many blocks of the picture, of which so many pixels counted."""
ROUNDS = 4
MOST_DOUBT = 0.2
"""A scene whose parts differ by more (relative standard error) does not show the lights' strengths."""


@dataclass(frozen=True, kw_only=True)
class Strengths:
    """``intensity`` (light, channel), mean over lights 1 in every channel; ``error`` (light,) relative standard errors;
    ``left`` is the share of a pixel's light that stays unexplained (median)."""

    intensity: FloatArray
    error: FloatArray
    left: float


def lit_pixels(pictures: LightPictures) -> tuple[FloatArray, NDArray[np.intp], NDArray[np.intp]]:
    """Return pixels that every light reaches and none saturates: values (light, pixel, channel), rows and columns."""
    images = pictures.images if pictures.images.ndim == 4 else pictures.images[..., None]
    clipped = pictures.saturated if pictures.saturated.ndim == 4 else pictures.saturated[..., None]
    grey = images.mean(axis=3)
    least, most = grey.min(axis=0), grey.max(axis=0)
    level = float(np.percentile(most, 99))
    seen: NDArray[np.bool_] = np.all(pictures.seen, axis=0)[:, None]
    shown = (least > LIT * most) & (most > 0.05 * level) & ~clipped.any(axis=(0, 3)) & seen
    row, col = np.nonzero(shown)
    picked = np.linspace(0, len(row) - 1, min(len(row), MOST_PIXELS)).astype(np.intp)
    row, col = row[picked], col[picked]
    return images[:, row, col].astype(np.float64), row, col


def measure_strengths(pictures: LightPictures, directions: FloatArray) -> Strengths:
    """Return the lights' intensities from a matte scene; ``directions`` (light, 3) are unit vectors.

    Raises PsvideoError with fewer than four lights, too few usable pixels, or a scene that does not show them.
    """
    lights = len(directions)
    if lights < 4:
        raise PsvideoError(
            f"A scene shows the strengths of four lights or more, and here are {lights}: three explain any picture. "
            "Use a matte sphere (psvideo calibrate matte-sphere) or a white target (flat-field)."
        )
    values, row, col = lit_pixels(pictures)
    if len(row) < LEAST_PIXELS:
        raise PsvideoError(
            f"Only {len(row)} pixels are lit by all {lights} lights and not saturated; expected {LEAST_PIXELS} or "
            "more. Use a scene that all lights reach, or expose less."
        )
    rows, cols = pictures.height_px, pictures.width_px
    block = (row * BLOCKS // rows) * BLOCKS + col * BLOCKS // cols
    across = np.eye(lights) - directions @ np.linalg.pinv(directions)
    grey = values.mean(axis=2)
    whole, kept, left = _fitted(grey, across)
    error = _error_by_parts(grey, block, kept, across, whole)
    if not np.isfinite(error).all() or error.max() > MOST_DOUBT:
        raise PsvideoError(
            "This scene does not show how strong the lights are (parts of it differ by more than "
            f"{MOST_DOUBT:.0%}): it faces too few ways, shines, or the rig's directions are wrong. Use a matte round "
            "thing, a matte sphere (psvideo calibrate matte-sphere) or a white target (flat-field)."
        )
    channels = [_fitted(values[:, kept, channel], across)[0] for channel in range(values.shape[2])]
    return Strengths(intensity=np.stack(channels, axis=1), error=error, left=left)


def _error_by_parts(
    grey: FloatArray, block: NDArray[np.intp], kept: NDArray[np.bool_], across: FloatArray, whole: FloatArray
) -> FloatArray:
    """Return the relative standard error (light,) of intensities ``whole``, by a jackknife over the picture's blocks;
    infinite where there are fewer than two."""
    used = [one for one in np.unique(block) if (block[kept] == one).sum() >= FEWEST_OF_A_BLOCK]
    parts = np.array(
        [_fitted(grey[:, block != one], across)[0] for one in used if (block != one).sum() >= LEAST_PIXELS]
    )
    count = len(parts)
    if count < 2:
        return np.full(len(whole), np.inf)
    error: FloatArray = np.sqrt((count - 1) / count * ((parts / whole - 1) ** 2).sum(axis=0))
    return error


def _fitted(values: FloatArray, across: FloatArray) -> tuple[FloatArray, NDArray[np.bool_], float]:
    """Return intensities (light,), which pixels (of ``values``, (light, pixel)) they rest on, and the share left."""
    unit = values / np.maximum(np.linalg.norm(values, axis=0), 1e-12)
    kept = np.ones(values.shape[1], np.bool_)
    for _ in range(ROUNDS):
        chosen = unit[:, kept]
        inverse = np.linalg.eigh(across * (chosen @ chosen.T))[1][:, 0]
        inverse = inverse * np.sign(inverse.sum())
        scaled = unit * inverse[:, None]
        rest = np.linalg.norm(across @ scaled, axis=0) / np.maximum(np.linalg.norm(scaled, axis=0), 1e-12)
        kept = rest <= np.quantile(rest, KEPT)
    if inverse.min() <= 0:
        return np.full(len(values), np.nan), kept, 1.0
    intensity = 1 / inverse
    return intensity / intensity.mean(), kept, float(np.median(rest))
