"""How strong lights are, from any matte scene under lights whose directions are known (semi-calibrated).

D. Cho, Y. Matsushita, Y.-W. Tai and I. S. Kweon, "Semi-calibrated photometric stereo", IEEE Transactions on Pattern
Analysis and Machine Intelligence 42(1), 2020 (first "Photometric stereo under non-uniform light intensities and
exposures", ECCV 2016): a pixel that no shadow falls on has measurements m with ``m_l / E_l = d_l . b``. What lies
across the directions' three dimensions must vanish, ``P diag(m) (1 / E) = 0`` with P = I - D pinv(D), for every pixel:
1 / E is the direction in which the sum of these equations' squares is least. Every measurement has a weight of its own
(Cauchy's), so that highlights and the edges of shadows count little, and a pixel need not be reached by all lights.
Four lights are needed, and the scene must face several ways. The scale is free: the mean over lights is 1.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles

LIT, LEAST_REACHED = 0.08, 5
"""A light reaches a pixel that it gives at least this much of its brightest one; this many (all of four) must."""
LEAST_PIXELS, LEAST_OF_A_LIGHT, MOST_PIXELS = 300, 100, 4_000
"""Fewer pixels measure nothing, nor a light that reaches fewer than the second; more than the third are not needed."""
BLOCKS, FEWEST_OF_A_BLOCK = 4, 20
"""The jackknife leaves out one of this many times this many blocks of the picture, if this many pixels counted."""
TURNS, WIDTH = 6, 2.0
"""How often weights are found again, and how wide they are in standard deviations of what is left over."""
DIRECTIONS_DEG, TRIALS = 1.0, 8
"""No rig's directions are known better; so often strengths are fitted to directions that are off by that, each its own
way. Lights that stand close together show their strengths badly, and no part of the picture says so."""
MOST_DOUBT = 0.2
"""A scene whose parts differ by more (relative standard error) does not show the lights' strengths."""


@dataclass(frozen=True, kw_only=True)
class Strengths:
    """``intensity`` (light, channel), mean over lights 1 in every channel; ``error`` (light,) relative standard errors;
    ``left`` is the share of a pixel's light that stays unexplained (median)."""

    intensity: Doubles
    error: Doubles
    left: float


@dataclass(frozen=True, kw_only=True)
class LitPixels:
    """Pixels that lights reach: ``values`` (light, pixel, channel), which of them count, ``used`` (pixel, light), and
    in which ``block`` (pixel,) of the picture they lie."""

    values: Doubles
    used: NDArray[np.bool_]
    block: NDArray[np.intp]

    def fit(
        self, directions: Doubles, channel: int | None = None, some: NDArray[np.bool_] | slice = slice(None)
    ) -> "tuple[Doubles, float] | None":
        """Return intensities (light,), their mean 1, of a channel or of the mean of all, and the share of light left;
        None where no strengths fit ``some`` of the pixels."""
        light = (self.values.mean(axis=2) if channel is None else self.values[..., channel]).T[some]
        unit = light / np.maximum(np.linalg.norm(light, axis=1, keepdims=True), 1e-12)
        found = fitted(unit, np.broadcast_to(directions, (len(unit), *directions.shape)), self.used[some], free=True)
        if found is None:
            return None
        intensity = 1 / found.inverse
        return intensity / intensity.mean(), found.left


def lit_pixels(pictures: LightPictures) -> LitPixels:
    """Return pixels that enough lights reach and none saturates."""
    images = pictures.images if pictures.images.ndim == 4 else pictures.images[..., None]
    clipped = pictures.saturated if pictures.saturated.ndim == 4 else pictures.saturated[..., None]
    grey = images.mean(axis=3)
    most = grey.max(axis=0)
    level = float(np.percentile(most, 99))
    seen: NDArray[np.bool_] = np.all(pictures.seen, axis=0)[:, None]
    reached = grey > LIT * most
    enough = reached.sum(axis=0) >= min(LEAST_REACHED, len(images))
    shown = enough & (most > 0.05 * level) & ~clipped.any(axis=(0, 3)) & seen
    row, col = np.nonzero(shown)
    picked = np.linspace(0, len(row) - 1, min(len(row), MOST_PIXELS)).astype(np.intp)
    row, col = row[picked], col[picked]
    return LitPixels(
        values=images[:, row, col].astype(np.float64),
        used=reached[:, row, col].T,
        block=(row * BLOCKS // pictures.height_px) * BLOCKS + col * BLOCKS // pictures.width_px,
    )


def measure_strengths(pictures: LightPictures, directions: Doubles) -> Strengths:
    """Return the lights' intensities from a matte scene; ``directions`` (light, 3) are unit vectors.

    Raises PsvideoError with fewer than four lights, too few usable pixels, or a scene that does not show them.
    """
    lights = len(directions)
    if lights < 4:
        raise PsvideoError(
            f"A scene shows the strengths of four lights or more, and here are {lights}: three explain any picture. "
            "Use a matte sphere (psvideo calibrate matte-sphere) or a white target (flat-field)."
        )
    pixels = lit_pixels(pictures)
    if len(pixels.used) < LEAST_PIXELS:
        raise PsvideoError(
            f"Only {len(pixels.used)} pixels are lit by {min(LEAST_REACHED, lights)} lights or more and not saturated; "
            f"expected {LEAST_PIXELS} or more. Use a scene that the lights reach, or expose less."
        )
    fewest = int(pixels.used.sum(axis=0).argmin())
    if pixels.used[:, fewest].sum() < LEAST_OF_A_LIGHT:
        raise PsvideoError(
            f"Light {pictures.names[fewest]!r} reaches hardly any pixel that others reach (with {LIT:.0%} of the "
            "brightest light or more). Raise its power or take its picture away, and measure again."
        )
    whole = pixels.fit(directions)
    channels = [pixels.fit(directions, channel) for channel in range(pixels.values.shape[2])]
    known = [one[0] for one in channels if one is not None]
    error = np.full(lights, np.inf) if whole is None else _errors(pixels, directions, whole[0])
    if whole is None or len(known) < len(channels) or not np.isfinite(error).all() or error.max() > MOST_DOUBT:
        raise PsvideoError(
            "This scene does not show how strong the lights are (it leaves a doubt of more than "
            f"{MOST_DOUBT:.0%}): it faces too few ways, shines, or the rig's directions are wrong. Use a matte round "
            "thing, a matte sphere (psvideo calibrate matte-sphere) or a white target (flat-field)."
        )
    return Strengths(intensity=np.stack(known, axis=1), error=error, left=whole[1])


def _errors(pixels: LitPixels, directions: Doubles, whole: Doubles) -> Doubles:
    """Return the relative standard errors (light,) of intensities ``whole``: how far they differ between parts of the
    picture, and with directions that are off by DIRECTIONS_DEG."""
    by_parts, rng = _error_by_parts(pixels, directions, whole), np.random.default_rng(0)
    squares = np.zeros(len(whole))
    for _ in range(TRIALS):
        turned = directions + rng.normal(0, np.radians(DIRECTIONS_DEG), directions.shape)
        found = pixels.fit(turned / np.linalg.norm(turned, axis=1, keepdims=True))
        squares += np.inf if found is None else (found[0] / whole - 1) ** 2
    return np.asarray(np.hypot(by_parts, np.sqrt(squares / TRIALS)), np.float64)


def _error_by_parts(pixels: LitPixels, directions: Doubles, whole: Doubles) -> Doubles:
    """Return the relative standard error (light,) of intensities ``whole``, by a jackknife over the picture's blocks;
    infinite where there are fewer than two."""
    block = pixels.block
    used = [one for one in np.unique(block) if (block == one).sum() >= FEWEST_OF_A_BLOCK]
    fits = [pixels.fit(directions, some=block != one) for one in used if (block != one).sum() >= LEAST_PIXELS]
    parts = np.array([np.full(len(whole), np.inf) if one is None else one[0] for one in fits])
    count = len(parts)
    if count < 2:
        return np.full(len(whole), np.inf)
    error: Doubles = np.sqrt((count - 1) / count * ((parts / whole - 1) ** 2).sum(axis=0))
    return error


@dataclass(frozen=True, kw_only=True)
class StrengthsFit:
    """``inverse`` (light,) is one over the strengths, 1 for the median; ``normals`` (point, 3) are unit vectors;
    ``left`` is the typical share of a point's light that stays unexplained."""

    inverse: Doubles
    normals: Doubles
    left: float


def fitted(unit: Doubles, sent: Doubles, used: NDArray[np.bool_], *, free: bool) -> StrengthsFit | None:
    """Fit normals, and strengths where they are ``free``, to points of unit light (point, light) under what is ``sent``
    there (point, light, 3), as far as measurements are ``used`` (point, light), with weights that follow what is left
    over. None where no positive strengths fit."""
    weights, inverse = used.astype(np.float64), np.ones(unit.shape[1])
    for _ in range(TURNS):
        weighed = sent * weights[..., None]
        square = np.swapaxes(weighed, 1, 2) @ sent + 1e-9 * np.eye(3)
        if free:
            inverse = _inverse_strengths(unit, weighed, square, weights)
            if inverse.min() <= 0:
                return None
        found = np.linalg.solve(square, np.einsum("pli,pl->pi", weighed, unit * inverse)[..., None])[..., 0]
        rest = unit * inverse - np.einsum("pli,pi->pl", sent, found)
        spread = max(1.48 * float(np.median(np.abs(rest[used]))), 1e-6)
        weights = used / (1 + (rest / (WIDTH * spread)) ** 2)
    normals = found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-12)
    return StrengthsFit(inverse=inverse, normals=normals, left=spread * np.sqrt(unit.shape[1]))


def _inverse_strengths(unit: Doubles, weighed: Doubles, square: Doubles, weights: Doubles) -> Doubles:
    """Return one over the strengths (light,), of which the median is 1: the least eigenvector of what no normals of the
    points explain, in units of how much each light says."""
    told = weighed * unit[..., None]
    own = np.swapaxes(told, 1, 2)
    sizes = (weights * unit**2).sum(axis=0)
    explained = np.tensordot(own, np.linalg.solve(square, own), axes=([0, 1], [0, 1]))
    scale = 1 / np.sqrt(np.maximum(sizes, 1e-12))
    least = np.linalg.eigh(scale[:, None] * (np.diag(sizes) - explained) * scale)[1][:, 0] * scale
    least = least * np.sign(least.sum())
    return np.asarray(least / np.median(least), np.float64)
