"""What real surfaces leave where nothing can be checked: three lights explain any three brightnesses exactly.

What is not matte, light from around and a rig that is a little off turn normals all the same, and show nowhere. All
that is known of it beforehand is by how much they do on objects whose normals were measured. So such an error holds
over subjects, and of one of them it is a guess: too large for one that is matte, too small for one that shines.

What shows is normals that belong to no surface. There something is wrong, most likely where one light gives little: in
its shadow, light that comes by way of other surfaces passes for light that grazes.
"""

from functools import lru_cache

import numpy as np

from psvideo.model.arrays import Floats
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.robust.reflectance import sent_to
from psvideo.solve.normals.trust.thin_surface import ThinSurface

ALL_EXPLAINED = 3
"""This many lights leave no residual."""
FEW_LIGHTS = 6
"""How more lights than these stand is not looked at: with eight their number alone held as well."""
OF_MATERIALS_DEG, BESIDE_SLOPE_DEG = np.float32(2.5), np.float32(1.2)
"""Two thirds of the normals are off by no more, for lights that spread noise into them once, beside what shows in
normals that belong to no surface. Fitted on a ball, a bear and a cat (DiLiGenT), a sphere with a wrong rig
(Washington) and another renderer's bunny, 28 sets of three lights of each, well spread and nearly in a plane, all
subjects alike (2.4, and 2.05 to 2.7 with each of them left out in turn). Since darker measurements count, 2.5 holds as
many: 61 and 63 % within, 91 and 92 % within twice, of 20 sets each. Where albedo that goes with the slope counts by
itself (``by_slope.py``), the second number does: 68 % within and 97 % within twice, of 20 sets each."""


def unchecked_deg(normals: Floats, directions: np.ndarray, *, beside_slope: bool) -> Floats:
    """Return by how many degrees normals (3, row, col) may be off for what these lights, unit vectors (light, 3),
    cannot show, (row, col); ``beside_slope`` where what albedo shows is counted by itself.

    It grows with the root of how noise spreads: measured over sets of lights that spread it 2 to 8 times. What is not
    matte is alike in neighbouring lights, and partly passes for another albedo.
    """
    inverse = np.linalg.inv(directions.T @ directions).astype(np.float32)
    along = np.einsum("irc,ij,jrc->rc", normals, inverse, normals)
    spread = np.sqrt(np.maximum(np.trace(inverse) - along, np.float32(0)))
    return np.asarray((BESIDE_SLOPE_DEG if beside_slope else OF_MATERIALS_DEG) * np.sqrt(spread), np.float32)


DIM, BRIGHT = np.float32(0.25), np.float32(0.75)
"""A light that gives less than the first share of what a point's lights give in the mean may not reach it; one that
gives more than the second does. (Light from around is up to 0.2 in wide creases.)"""
TORN_IN_LIGHT = np.float32(3)
"""Where all lights reach, normals that belong to no surface count so many times less: creases and outlines make such as
well, most of them in small pictures."""
SEEN, UNSEEN = 5.0, 9.0
"""Where a matte surface's light goes with a little of the cosine's square as well, normals turn by so many times what
all residuals together show of it: lights up to the first check each other, from the second on hardly. (Of 200 sets of
4 to 8 lights on five photographed and rendered subjects, those that turn less than 2.7 times left 0.5 % of what is
trusted over 10 degrees, up to 3.7 times 1.9 %, beyond 2.8 %. Five lights on a ring, 35 degrees from the axis: 2.6; four
within one quarter: 13.)"""
NORMALS, FACING, LIT = 600, 0.35, 0.12
"""That is looked at in so many directions that face the camera so much, where all lights shine at such a cosine."""


def torn_share(points: ThinSurface, lit: Illumination) -> Floats | float:
    """Return by how much of themselves normals that belong to no surface count at every point, (row, col), whatever
    else shows: wholly where a light may not reach, less where all do, and not at all under lights that check each
    other."""
    unseen = unseen_share(lit)
    if not unseen:
        return 0.0
    return np.asarray(np.float32(unseen) / (1 + (TORN_IN_LIGHT - 1) * reached_by_all(points, lit)), np.float32)


def reached_by_all(points: ThinSurface, lit: Illumination) -> Floats:
    """Return whether all lights surely reach every point, 0 to 1, (row, col)."""
    cosines = (towards(points, lit) * points.planes).sum(axis=1)
    mean = np.maximum(cosines, 0).mean(axis=0)
    reaches = (cosines.min(axis=0) / np.maximum(mean, np.float32(1e-6)) - DIM) / (BRIGHT - DIM)
    return np.asarray(np.clip(reaches, 0, 1), np.float32)


def towards(points: ThinSurface, lit: Illumination) -> Floats:
    """Return the unit vectors to all lights, (light, 3, row, col) of the points, or (light, 3, 1, 1) where they are the
    same for all."""
    if lit.near is None:
        return np.asarray(lit.directions, np.float32)[..., None, None]
    at = np.indices(points.known.shape).reshape(2, -1) * points.step
    sent = sent_to(lit, (at[0], at[1])).astype(np.float32)
    sent /= np.linalg.norm(sent, axis=-1, keepdims=True)
    return np.asarray(np.moveaxis(sent, -1, 1).reshape(len(sent), 3, *points.known.shape))


def unseen_share(lit: Illumination) -> float:
    """Return 1 where lights can hardly be held against each other, three always, and 0 where they check each other."""
    if len(lit.directions) > FEW_LIGHTS:
        return 0.0
    return min(max((turned_unseen(lit) - SEEN) / (UNSEEN - SEEN), 0.0), 1.0)


def turned_unseen(lit: Illumination, *, shares: tuple[float, ...] | None = None) -> float:
    """Return by how many times more than all residuals together a surface that is not quite matte turns normals, root
    mean squares over normals that all lights reach; infinite where nothing is left over, 0 where no normal is so lit.
    Its light goes with a little of the cosine's square as well, or lights add such ``shares`` of what they send
    (light,) whichever way a surface faces. Near lights count as they stand in the middle of the picture."""
    if len(lit.directions) <= ALL_EXPLAINED:
        return float("inf")
    strengths = lit.intensities.mean(axis=1) / lit.intensities.mean()
    return _turned(tuple(map(tuple, lit.directions.tolist())), tuple(strengths.tolist()), shares)


@lru_cache(maxsize=64)
def _turned(
    directions: tuple[tuple[float, ...], ...], strengths: tuple[float, ...], shares: tuple[float, ...] | None
) -> float:
    """Return the same of distant lights, once for all rounds of a take."""
    place = (np.arange(NORMALS) + 0.5) / NORMALS
    z, around = 1 - place * (1 - FACING), np.pi * (1 + 5**0.5) * np.arange(NORMALS)  # evenly over a cap of the sphere
    across = np.sqrt(1 - z * z)
    normals, ways = np.stack([across * np.cos(around), across * np.sin(around), z], axis=-1), np.array(directions)
    cosines = normals @ ways.T
    lit_by_all = (cosines > LIT).all(axis=1)
    if not lit_by_all.any():
        return 0.0
    normals, cosines = normals[lit_by_all], cosines[lit_by_all]
    added = (cosines**2 if shares is None else np.broadcast_to(shares, cosines.shape)) * strengths
    matrix = ways * np.array(strengths)[:, None]
    g = added @ np.linalg.pinv(matrix).T
    left = added - g @ matrix.T
    g -= (g * normals).sum(axis=1, keepdims=True) * normals
    return float(np.sqrt((g**2).sum() / max(float((left**2).sum()), 1e-12)))
