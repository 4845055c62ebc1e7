"""Whether a subject reflects light beyond n . l, and how: matte, shining, rough or soft, from all of its pixels.

A single pixel cannot tell a broad sheen from a turned normal. A subject can: its pixels face every way, and share
what they are made of. Each kind of model (``reflectance_model``) is fitted, and the one taken that leaves clearly less.
"""

from typing import Literal

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles
from psvideo.model.surface import Reflectance
from psvideo.solve.normals.robust.reflectance_model import (
    CURVE,
    MOST_SOFT,
    OF_KIND,
    SHINE,
    InPlace,
    ModelFollowed,
    Sought,
    alternated,
    left_over,
    parts_of,
)
from psvideo.solve.normals.robust.subject_points import LEAST_POINTS, SubjectPoints, sizes_of

FOR_SHINE = 6
"""Five measurements leave two residuals: too few to tell a highlight from a normal. (A model that explains half
would bring glossy subjects nearer, but leaves claims of three times the error, which fall with noise.)"""
FEW_EXPLAIN = 0.5
"""Of what five lights leave a model explains at least this share. Clay and plaster of virtual subjects explain 0.8 to
1; of a matte sheet under wrong lights roughness explains less than half (once of 24 rigs more)."""
WELL_SPREAD = 3.0
"""Roughness shows in how lights from many sides differ: their directions' condition number is at most this."""
LEAST_EXPLAINED = 0.1
"""The model is used where it explains this much of the squares of what is left over. Of a matte subject it explains
0.01, of one under lights whose directions are wrong up to 0.07."""
LESS_LEFT, MUCH_LESS_LEFT, FEW_LEAVE = 0.8, 0.65, 0.3
"""What roughness leaves at most of what is left without it, to count, and what softness does, under five lights too:
under lights whose directions are wrong roughness explains a tenth, of clay half; softness explains a third of velvet,
and half to nine tenths of skin."""
LEAST_ROUGH = 0.1
"""What is less rough (facets that lean by 9 degrees) turns normals by less than a degree. Other faults look like it."""
LEAST_SOFT = 0.04
"""What is less soft turns normals by about a degree."""
WORST = 0.25
"""Softness is looked for in this share of the points, too: those that fit worst. Balls of wax before a matte wall, a
third of the points, were taken for matte ones (13 degrees off); half of the points holds too much of the wall (3)."""
SOFTER = 1.5
"""What fits worst is another material where it is so many times softer than all points seem; of a subject that is wax
all over it seems 1 to 1.2 times as soft."""
MOST_AWAY = 0.02
"""What a camera sees faces it. Softness that is not there tilts normals until more of them than this face away (0.06 to
0.15 of a glossy ball and a bear under six lights, whose normals it turned by 12 to 22 degrees; none of wax or skin)."""
ON_A_RING = 0.02
"""Lights that are so far off a ring, beside what they send, cannot show a curve (``off_a_ring``)."""
LEAST_LOBES = 0.33
"""Under them lobes must be this much of a curve that shows beside them, in albedos: of h^2 and h^3 they are 0 to 0.3,
of h^4 0.2 to 0.5, of varnish more than 1."""
VERY_BROAD = (InPlace(2, True), InPlace(2), InPlace(3, True), InPlace(3), InPlace(1.5, True))
"""Sheens so broad that they look like softness: both brighten what hardly faces the lights, but the one turns normals
by 3 to 10 degrees where the other does not. Softness has to explain more than each of these."""


def fitted(points: SubjectPoints) -> Reflectance | None:
    """Return the model that explains the points best, fitted with their normals in turn; None where none does.

    Under fewer lights than FOR_SHINE only rough and soft ones are looked for. What is soft is looked for among the
    points that fit worst, too: where most points are of a wall that fits, what a soft thing leaves counts as outliers.
    """
    found = _of_all(points)
    part = None if len(points.measured) < FOR_SHINE else _of_all(_worst_fitting(points))
    least_soft = 0.0 if found is None else SOFTER * found.soft
    return part if part is not None and part.soft > least_soft else found


def _worst_fitting(points: SubjectPoints) -> SubjectPoints:
    """Return the WORST share of the points, by the mean square of what no normal and albedo explain."""
    sizes = sizes_of(points)
    points = points.only(sizes > 0)
    sizes = sizes[sizes > 0]
    if not len(sizes):
        return points
    left = left_over(points, points.counts, parts_of(points, points.normals * sizes[:, None], median(sizes)))[0]
    free = points.counts.sum(axis=0) - 3
    squares = np.where(free > 0, (points.counts * left**2).sum(axis=0) / np.maximum(free, 1), 0.0)
    return points.only(squares >= np.quantile(squares, 1 - WORST))


def _of_all(points: SubjectPoints) -> Reflectance | None:
    """Return the model that explains points best, if any does."""
    sizes = sizes_of(points)
    known = sizes > 0
    points = points.only(known)
    g = points.normals * sizes[known, None]
    if len(g) < LEAST_POINTS:
        return None
    typical, few = median(sizes[known]), len(points.measured) < FOR_SHINE
    kind, best = "shining", alternated(points, g, typical)
    for other in _to_try(points):
        found = alternated(points, g, typical, Sought(other))
        if _leaves_less(found, best, other, few=few) and (other == "rough" or _is_soft(points, g, found, best)):
            kind, best = other, found
    if best.explained < (FEW_EXPLAIN if few else LEAST_EXPLAINED):
        return None
    if kind == "shining" and (few or _ring_hides(points, best)):
        return None
    of_albedo, lobes = best.model[:SHINE], best.model[SHINE:] * typical
    return Reflectance(*(float(each) for each in (*of_albedo, *lobes)))


def _ring_hides(points: SubjectPoints, found: ModelFollowed) -> bool:
    """Whether what shines is mostly a curve above 0, and the lights stand on a ring: these cannot tell it from a very
    broad sheen, which turns normals to the other side."""
    curve, lobes = found.model[CURVE], found.model[SHINE:].sum()
    return bool(lobes < LEAST_LOBES * curve and off_a_ring(points.towards.mean(axis=1)) < ON_A_RING)


def off_a_ring(directions: Doubles) -> float:
    """Return how far lights (light, 3) are from a ring, on which one vector sends as much to all of them: what the best
    such vector is off by, root mean square; 0.1 to 0.2 where they stand at two slants."""
    alike = np.ones(len(directions))
    vector = np.linalg.lstsq(directions, alike, rcond=None)[0]
    return float(np.sqrt(np.mean((directions @ vector - alike) ** 2)))


def _to_try(points: SubjectPoints) -> tuple[Literal["rough", "soft"], ...]:
    """Return the kinds of model that the lights can show."""
    spread = np.linalg.svd(points.towards.mean(axis=1), compute_uv=False)
    return ("rough", "soft") if spread[0] < WELL_SPREAD * spread[-1] else ("soft",)


def _leaves_less(found: ModelFollowed, before: ModelFollowed, kind: Literal["rough", "soft"], *, few: bool) -> bool:
    """Whether a model is of its kind, and leaves so much less than another that it is not that by chance."""
    number, left = found.model[OF_KIND[kind]], (1 - found.explained) / (1 - before.explained)
    if kind == "rough":
        return bool(number >= LEAST_ROUGH and left < LESS_LEFT)
    return bool(LEAST_SOFT <= number < MOST_SOFT and left < (FEW_LEAVE if few else MUCH_LESS_LEFT))


def _is_soft(points: SubjectPoints, g: Doubles, found: ModelFollowed, before: ModelFollowed) -> bool:
    """Whether what explains points as softness is that, and no very broad sheen; ``g`` are their normals times albedo
    without a model, ``before`` the best model without softness."""
    if not _faces_it(points, found.g, before.g):
        return False
    typical = median(np.linalg.norm(g, axis=1))
    shining = (alternated(points, g, typical, Sought("soft", one)) for one in VERY_BROAD)
    return all(found.explained > one.explained for one in shining)


def _faces_it(points: SubjectPoints, g: Doubles, before: Doubles) -> bool:
    """Return whether normals (of any length) face the camera, but for few more than ``before``."""
    away, were = (((points.to_camera * one).sum(axis=-1) < 0).mean() for one in (g, before))
    return bool(away <= were + MOST_AWAY)
