"""How one lamp shades a matte sphere, and the lamp that pixels show best.

A matte sphere shows ``intensity * albedo * n . l`` of a lamp far away. Of one that stands near, 1 / q radii of the
sphere from its middle, it shows ``(c - q) / (1 - 2 q c + q**2) ** 1.5`` of what it would show where its middle is, with
c the cosine between a normal and the way from the middle to the lamp: less of it is reached, and what faces the lamp is
nearer to it. A lamp at 25 radii, taken for one far away, seems to stand 3.5 degrees from where it does.

A ``q`` below 0 is no lamp's, but shading that is flatter than a matte sphere's: rough paint, or light in the room.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Mask

LEAST_COSINE, STEEPER_COSINE = 0.1, 0.4
"""Pixels count that a light reaches at 84 degrees from the normal or less. What changes when only those within 66 count
goes into the error: no paint is quite matte."""
TUKEY_WIDTH = 4.685
ROUNDS = 12
LEAST_PIXELS = 200
NEAREST, FLATTEST, NEAR_ROUNDS = 0.5, -0.5, 8
"""No lamp is looked for nearer than at two radii, and no shading is believed flatter than this."""


@dataclass(frozen=True, kw_only=True)
class MattePixels:
    """Pixels of the sphere: normals (pixel, 3), which patch each belongs to, values (light, pixel, channel)."""

    normals: Doubles
    patch: NDArray[np.intp]
    values: Doubles
    usable: NDArray[np.bool_]


@dataclass(frozen=True, kw_only=True)
class MatteFit:
    """One light's strength times direction per channel (channel, 3) and its nearness, the unexplained share, and what
    counted."""

    strengths: Doubles
    nearness: float = 0.0
    left: float
    lit: Mask

    @property
    def total(self) -> Doubles:
        """Strength times direction of all channels together."""
        total: Doubles = self.strengths.sum(axis=0)
        return total


def matte_fit(
    sphere: MattePixels, n: int, chosen: Mask, *, least_cosine: float = LEAST_COSINE, flattest: float = 0.0
) -> MatteFit:
    """Fit one light: the brightest half begins; then all that the light reaches well counts, weighed by how well it
    fits, at first as if the lamp were far away. ``flattest``, 0 or less, is by how much shading may be flatter."""
    normals, values = sphere.normals, sphere.values[n]
    bright = values.sum(axis=1)
    usable = sphere.usable[n] & chosen
    nothing = MatteFit(strengths=np.zeros((values.shape[1], 3)), left=1.0, lit=np.zeros_like(usable))
    if usable.sum() < LEAST_PIXELS:
        return nothing
    lit = usable & (bright > 0.5 * np.quantile(bright[usable], 0.98))
    weight = lit.astype(np.float64)
    for _ in range(ROUNDS):
        distant = _solved(normals, bright, weight)
        length = float(np.linalg.norm(distant))
        lit, weight = _weighed(bright, normals @ distant, usable, least_cosine * length, length)
        if lit.sum() < LEAST_PIXELS or length <= 0:
            return replace(nothing, lit=lit)
    vector, nearness = _near_lamp(normals, bright, usable, distant, least_cosine=least_cosine, flattest=flattest)
    length = float(np.linalg.norm(vector))
    shown = shading(normals, vector, nearness)[0]
    if nearness != 0:
        lit, weight = _weighed(bright, shown, usable, least_cosine * length, length)
    if lit.sum() < LEAST_PIXELS:
        return replace(nothing, lit=lit)
    # one direction for all channels: coloured gloss must not turn one channel against the others
    one = shown / length
    strengths = (weight * one) @ values / float(weight @ one**2)
    left = float(np.median(np.abs(bright - shown)[lit] / shown[lit]))
    return MatteFit(strengths=np.outer(strengths, vector / length), nearness=nearness, left=left, lit=lit)


def _weighed(bright: Doubles, shown: Doubles, usable: Mask, least: float, length: float) -> tuple[Mask, Doubles]:
    """Return which pixels count, and their weights by how well they fit."""
    lit = usable & (shown > least)
    off = bright - shown
    scale = 1.4826 * float(np.median(np.abs(off[lit]))) + 1e-3 * length if lit.any() else 1.0
    return lit, np.where(lit, np.maximum(1 - (off / (TUKEY_WIDTH * scale)) ** 2, 0) ** 2, 0.0)


def _solved(normals: Doubles, values: Doubles, weight: Doubles) -> Doubles:
    weighted = normals * weight[:, None]
    vector: Doubles = np.linalg.lstsq(weighted.T @ normals, weighted.T @ values, rcond=None)[0].astype(np.float64)
    return vector


def _near_lamp(
    normals: Doubles, bright: Doubles, usable: Mask, distant: Doubles, *, least_cosine: float, flattest: float
) -> tuple[Doubles, float]:
    """Return strength times direction of a lamp, and its ``q``: by Gauss and Newton's method from where a ``distant``
    one seemed to be, weighed as that was."""
    vector, nearness = distant, 0.0
    for _ in range(NEAR_ROUNDS):
        length = float(np.linalg.norm(vector))
        shown, change = shading(normals, vector, nearness)
        lit, weight = _weighed(bright, shown, usable, least_cosine * length, length)
        if not lit.any():
            return distant, 0.0
        step = _solved(change, bright - shown, weight)
        if nearness == flattest == 0 and step[3] <= 0:
            return distant, 0.0
        vector, nearness = vector + step[:3], float(np.clip(nearness + step[3], flattest, NEAREST))
    return vector, nearness


def shading(normals: Doubles, vector: Doubles, nearness: float) -> tuple[Doubles, Doubles]:
    """Return what a sphere shows at normals (pixel, 3) under a lamp of strength times direction ``vector``, (pixel,),
    and how that changes with the vector and with ``nearness``, the ``q`` above, (pixel, 4)."""
    length = max(float(np.linalg.norm(vector)), 1e-12)
    way = vector / length
    cosine = normals @ way
    above = cosine - nearness
    apart = 1 - 2 * nearness * cosine + nearness**2
    falloff = apart**-1.5
    shade = above * falloff
    with_cosine = falloff + 3 * nearness * above / apart * falloff
    with_nearness = -falloff + 3 * above**2 / apart * falloff
    turned = shade[:, None] * way + with_cosine[:, None] * (normals - cosine[:, None] * way)
    return length * shade, np.column_stack([turned, length * with_nearness])
