"""Whether the rig can have lit these plates: what its directions and strengths leave unexplained.

A matte pixel that all lights reach has ``light = L b``, with the rig's directions times strengths L (light, 3). What is
outside of L's columns cannot come from any normal. Three lights explain anything; from four on a wrong rig shows. How
strong each light truly was, relative to the rig, is the vector h that makes ``diag(h) light`` fit best: the least
eigenvector of the sum of ``(light lightT) * (1 - L L+)``.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.report.observe.rig_and_curve.any_rig import left_by_any_rig
from psvideo.report.observe.rig_and_curve.exchanged import exchanged
from psvideo.report.observe.rig_and_curve.lamp_strengths import LampStrengths, lamp_strengths, reaches
from psvideo.report.observe.rig_and_curve.nearness import Nearness, nearness
from psvideo.report.observe.rig_and_curve.other_curves import LEAST_POINTS, SHADOW, OtherCurves, other_curves

LEAST_LIGHT = 4.0
"""A pixel is lit where its brightest light gives at least this many thousandths of what saturates."""


@dataclass(frozen=True, kw_only=True)
class RigFit:
    """What a few thousand points said of the rig. ``misfit`` is the median share of a point's light that no normal
    explains, ``own_misfit`` the share that no rig at all would explain (shadows, gloss, motion), ``typical_own`` that
    of a usual point, which highlights and shadows do not reach. ``scaled_misfit`` is what is left once every light's
    strength is free, and ``strengths`` (light,) what they come out as, 1 for the median.
    ``near`` is how near lamps stand that the rig takes for distant, ``curves`` what is left over under other transfer
    curves; both None where it says where they stand. ``lamps`` are strengths that shadows and highlights change little;
    None where lights are too few for that. ``exchanged`` are two lights, by their place, that are taken for each
    other."""

    misfit: float
    own_misfit: float
    typical_own: float
    scaled_misfit: float
    strengths: tuple[float, ...]
    near: Nearness | None = None
    curves: OtherCurves | None = None
    lamps: LampStrengths | None = None
    exchanged: tuple[int, int] | None = None

    @property
    def excess(self) -> float:
        """The share of the light that another rig could explain, and this one cannot."""
        return float(np.sqrt(max(self.misfit**2 - self.own_misfit**2, 0.0)))

    @property
    def by_rig(self) -> float:
        """The share of a usual point's light that another rig could explain, and this one cannot: few highlights and
        shadows do not hide it."""
        return float(np.sqrt(max(self.misfit**2 - self.typical_own**2, 0.0)))


def rig_fit(
    light: Doubles, vectors: Doubles, places: Doubles | None = None, *, white: Doubles | None = None
) -> RigFit | None:
    """Judge a rig by points: ``light`` (point, light) is unclipped, ``vectors`` (point or 1, light, 3) what the rig
    sends there, and ``places`` (point, 2) where they lie, x right and y up in widths of the picture; ``white`` (point,
    light) is the light that saturates, left out 1.0. None for three lights, or where too few points are reached by all
    of them."""
    count = light.shape[1]
    white = np.ones_like(light) if white is None else white
    lit = (light / white).max(axis=1) > LEAST_LIGHT * 1e-3
    reached = reaches(light, vectors, SHADOW, white=white).all(axis=1) & lit
    if count < 4 or reached.sum() < LEAST_POINTS:
        return None
    unit = light[reached] / np.linalg.norm(light[reached], axis=1, keepdims=True)
    sent = vectors if len(vectors) == 1 else vectors[reached]
    beyond = _beyond(sent)
    left = np.einsum("...ij,...j->...i", beyond, unit)
    misfit = float(np.median(np.linalg.norm(left, axis=1)))
    moments = unit.T @ unit
    values = np.linalg.eigvalsh(moments)
    own = float(np.sqrt(max(values[: count - 3].sum(), 0) / values.sum()))
    gains = np.einsum("pi,pj,pij->ij", unit, unit, np.broadcast_to(beyond, (len(unit), count, count)))
    unit_free = 1 / np.sqrt(np.diag(moments))  # of gains h = share * diag(moments) h
    share, h = (found[..., 0] for found in np.linalg.eigh(unit_free[:, None] * gains * unit_free))
    h = unit_free * h
    true = 1 / np.maximum(np.abs(h), 1e-3 * np.abs(h).max())
    strengths = tuple(float(value) for value in true / np.median(true))
    near = curves = pair = None
    if places is not None and len(vectors) == 1:
        near = nearness(unit, beyond[0], vectors[0], places[reached])
        curves = other_curves(light[reached], beyond[0], white=white[reached])
        pair = exchanged(moments, beyond[0])
    scaled = float(np.sqrt(max(share, 0)))
    return RigFit(
        misfit=misfit, own_misfit=own,
        typical_own=left_by_any_rig(left, np.einsum("...ij,...j->...i", np.linalg.pinv(sent), unit)),
        scaled_misfit=scaled, strengths=strengths, near=near, curves=curves,
        exchanged=pair,
        lamps=lamp_strengths(light[lit], vectors if len(vectors) == 1 else vectors[lit], white=white[lit]),
    )  # fmt: skip


def _beyond(vectors: Doubles) -> Doubles:
    """Return the projectors to what no normal explains, shape (point, light, light)."""
    explained = vectors @ np.linalg.pinv(vectors)
    beyond: NDArray[np.float64] = np.eye(vectors.shape[1]) - explained
    return beyond
