"""How strong each light truly was, from plates of any scene under lights whose directions are known.

The equations are those of D. Cho et al., "Semi-calibrated photometric stereo" (calibrate/cho2020.py): with strengths h
the plates are ``diag(h) L b``, and 1 / h is what makes the plates fit best. Here every measurement has a weight of its
own (Cauchy's), so that highlights and the edges of shadows count little, and a point need not be reached by all lights.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.camera import FloatArray

SHADOW, LEAST_REACHED = 0.1, 5
"""A light reaches a point that gets this share of the brightest one's from it; so many lights must."""
TURNS, WIDTH = 6, 2.0
"""How often weights are found again, and how wide they are in standard deviations of what is left over."""
LEAST_POINTS, MOST_POINTS = 200, 800
FEWEST_LIGHTS = 8
"""Under fewer, strengths explain too much: of 16 right sets of five lights 4 came out as wrong, of six 2, of 45 sets of
8 to 12 none; and of six lights of which one is off, another was named in every third set."""


@dataclass(frozen=True, kw_only=True)
class LampStrengths:
    """``ratios`` (light,) are strengths over what the rig says, 1 for the median light. ``left`` and ``left_free`` are
    the typical share of a point's light that no normal explains under the rig's strengths and under these, which turn
    a typical normal by ``turned_deg``."""

    ratios: tuple[float, ...]
    left: float
    left_free: float
    turned_deg: float


def lamp_strengths(light: FloatArray, vectors: FloatArray) -> LampStrengths | None:
    """Return the strengths that explain points best: ``light`` (point, light), 0 where it is not known, and
    ``vectors`` (point or 1, light, 3), what the rig sends there. None under fewer than FEWEST_LIGHTS, or where too few
    points say something."""
    used = (light > SHADOW * light.max(axis=1, keepdims=True)) & (light > 0)
    enough = np.flatnonzero(used.sum(axis=1) >= LEAST_REACHED)
    if light.shape[1] < FEWEST_LIGHTS or len(enough) < LEAST_POINTS:
        return None
    some = enough[np.linspace(0, len(enough) - 1, min(len(enough), MOST_POINTS)).astype(np.intp)]
    unit = light[some] / np.linalg.norm(light[some], axis=1, keepdims=True)
    sent = np.broadcast_to(vectors if len(vectors) == 1 else vectors[some], (len(some), *vectors.shape[1:]))
    as_told = _fitted(unit, sent, used[some], free=False)
    freely = _fitted(unit, sent, used[some], free=True)
    if as_told is None or freely is None:
        return None
    cosines = (as_told.normals * freely.normals).sum(axis=1)
    return LampStrengths(
        ratios=tuple((1 / freely.inverse).tolist()),
        left=as_told.left,
        left_free=freely.left,
        turned_deg=float(np.degrees(np.median(np.arccos(np.clip(cosines, -1, 1))))),
    )


@dataclass(frozen=True, kw_only=True)
class _Fit:
    """``inverse`` (light,) is one over the strengths, 1 for the median; ``normals`` (point, 3) are unit vectors."""

    inverse: FloatArray
    normals: FloatArray
    left: float


def _fitted(unit: FloatArray, sent: FloatArray, used: NDArray[np.bool_], *, free: bool) -> _Fit | None:
    """Fit normals, and strengths where they are ``free``, with weights that follow what is left over; None where no
    positive strengths fit."""
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
    return _Fit(inverse=inverse, normals=normals, left=spread * np.sqrt(unit.shape[1]))


def _inverse_strengths(unit: FloatArray, weighed: FloatArray, square: FloatArray, weights: FloatArray) -> FloatArray:
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
