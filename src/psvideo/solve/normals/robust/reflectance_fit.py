"""How a subject reflects light beyond n . l, found from all of its pixels: curve, roughness, softness, highlights.

A single pixel cannot tell a broad sheen from a turned normal. A subject can: its pixels face every way, and share
what they are made of. The model is albedo * (c + curve c^2 + rough r + soft (1 - c)) + broad h^8 + middle h^32 +
narrow h^128, with c = n . l and h = n . half way between light and camera (J. F. Blinn, "Models of light reflection for
computer synthesized pictures", 1977: varnish shines on every paint alike); low powers of c, as B. Shi et al. fit them
per pixel ("Bi-polynomial modeling of low-frequency reflectances", PAMI 2014). What clay, plaster, stone and cloth throw
back towards the light is r = c max(l . v - c n . v, 0) / max(c, n . v), with v to the camera: M. Oren and S. K. Nayar,
"Generalization of Lambert's reflectance model", 1994, without their angles. Of skin, wax and marble light comes out
again around where it went in: it shows beyond the edge of shadows and flattens normals, about as (c + w) / (1 + w),
with soft = w / (1 + w) (S. Green, "Real-time approximations to subsurface scattering", GPU Gems, 2004).
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal, NamedTuple

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles, Mask
from psvideo.model.surface import Reflectance

Kind = Literal["shining", "rough", "soft"]
LEAST_POINTS = 50
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
ALTERNATIONS, SOLVED_AGAIN, REWEIGHTED = 4, 3, 4
"""How often model and normals follow each other, steps of the normals each time, and of the model's weights."""
HOPELESS = 0.02
"""What explains no more at the second time is not looked at again."""
NUMBERS, CURVE, ROUGH, SOFT, SHINE = 6, 0, 1, 2, 3
"""The model's numbers, which of them are curve, roughness and softness, and where highlights begin."""
LESS_LEFT, MUCH_LESS_LEFT, FEW_LEAVE = 0.8, 0.65, 0.3
"""What roughness leaves at most of what is left without it, to count, and what softness does, under five lights too:
under lights whose directions are wrong roughness explains a tenth, of clay half; softness explains a third of velvet,
and half to nine tenths of skin."""
OF_KIND: dict[Kind, int] = {"rough": ROUGH, "soft": SOFT}
"""The number without which a model is none of its kind."""
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
PRIOR, COUNTED = (0.07, 0.3, 0.3, 0.3, 0.3, 0.3), 300.0
"""The model's numbers are near 0 to this much, beside the typical albedo, which counts as one of this many independent
points."""
MOST_CURVE, MOST_ROUGH, MOST_SOFT, MOST_LOBE = 0.6, 1.5, 0.35, 5.0
MODEL_WIDTH = 2.0
"""Cauchy's width in standard deviations of all residuals."""
OUTLYING = 3.0
"""Shadows' edges and narrow highlights are few, and far off."""


class InPlace(NamedTuple):
    """What stands in softness' place: a lobe h^``power`` in shares of the albedo (``on_paint``) or whatever the albedo,
    or, of power 0, softness itself."""

    power: float = 0.0
    on_paint: bool = False


class Sought(NamedTuple):
    """What kind of model is sought, and what stands in softness' place in it."""

    kind: Kind = "shining"
    in_place: InPlace = InPlace()


VERY_BROAD = (InPlace(2, True), InPlace(2), InPlace(3, True), InPlace(3), InPlace(1.5, True))
"""Sheens so broad that they look like softness: both brighten what hardly faces the lights, but the one turns normals
by 3 to 10 degrees where the other does not. Softness has to explain more than each of these."""


@dataclass(frozen=True, kw_only=True)
class SubjectPoints:
    """Points of the subject: measurements (light, point) in units of every light's strength, which of them count
    (0 or 1), and which are seen and not clipped, dark or not; directions to the lights (light, point, 3), and half way
    from there to the camera; ``to_camera`` (point, 3); and ``normals`` (point, 3) as the points were solved without a
    model."""

    measured: Doubles
    counts: Doubles
    seen: Doubles
    towards: Doubles
    half: Doubles
    to_camera: Doubles
    normals: Doubles

    def only(self, known: Mask) -> "SubjectPoints":
        """Return some of the points."""
        return SubjectPoints(
            measured=self.measured[:, known],
            counts=self.counts[:, known],
            seen=self.seen[:, known],
            towards=self.towards[:, known],
            half=self.half[:, known],
            to_camera=self.to_camera[known],
            normals=self.normals[known],
        ).in_order()

    def in_order(self) -> "SubjectPoints":
        """Return the same points as compiled loops take them: numbers lie in the order of their axes."""
        return SubjectPoints(**{one.name: np.ascontiguousarray(getattr(self, one.name)) for one in fields(self)})


def joined(looks: Sequence[SubjectPoints]) -> SubjectPoints:
    """Return the points of one or several looks at a subject under the same lights."""
    if len(looks) == 1:
        return looks[0]
    return SubjectPoints(
        measured=np.concatenate([one.measured for one in looks], axis=1),
        counts=np.concatenate([one.counts for one in looks], axis=1),
        seen=np.concatenate([one.seen for one in looks], axis=1),
        towards=np.concatenate([one.towards for one in looks], axis=1),
        half=np.concatenate([one.half for one in looks], axis=1),
        to_camera=np.concatenate([one.to_camera for one in looks]),
        normals=np.concatenate([one.normals for one in looks]),
    )


class ModelFollowed(NamedTuple):
    """A model, what it explains, and the normals that follow it, times albedo."""

    model: Doubles
    explained: float
    g: Doubles


def fitted(points: SubjectPoints) -> Reflectance | None:
    """Return the model that explains the points best, solved with their normals in turn; of fewer lights than FOR_SHINE
    only a rough or soft one that plainly does. What is soft is looked for among the points that fit worst, too: before
    a wall that fits most points are the wall's, and what the others leave counts as outliers."""
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
    left = _left(points, points.counts, parts_of(points, points.normals * sizes[:, None], median(sizes)))[0]
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


def sizes_of(points: SubjectPoints) -> Doubles:
    """Return the albedo of every point with its normal, 0 where nothing was measured."""
    cosines = np.maximum((points.towards * points.normals).sum(axis=-1), 0.05)
    return _medians(points.measured / cosines, points.counts > 0)


def alternated(
    points: SubjectPoints, g: Doubles, typical: float, sought: Sought = Sought(), *,
    turns: int = ALTERNATIONS, least: float = -np.inf,
) -> ModelFollowed:  # fmt: skip
    """Return the model and what it explains, from normals that follow it; nothing where that is hopeless, or no more
    than the ``least``."""
    points, nothing = points.in_order(), ModelFollowed(np.zeros(NUMBERS), 0.0, g)
    model, explained = np.zeros(NUMBERS), 0.0
    for turn in range(turns):
        model, explained = _model(points, g, typical, sought)
        absent = sought.kind in OF_KIND and not model[OF_KIND[sought.kind]]
        if (turn and explained < HOPELESS) or absent or explained <= least:
            return nothing
        for _ in range(SOLVED_AGAIN):
            g = _solved_again(points, g, model, typical, sought.in_place)
    return ModelFollowed(model, explained, g)


def explained_evenly(points: SubjectPoints, g: Doubles, typical: float, model: Doubles) -> float:
    """Return which share of the squares of what is left over a model explains, where no measurement counts less than
    others but for OUTLYING times what is typical: what weights found in noise is gone."""
    points = points.in_order()
    parts = parts_of(points, g, typical)
    left = _left(points, points.counts, parts)
    most = OUTLYING**2 * float((points.counts * left[0] ** 2).sum() / max(points.counts.sum(), 1))
    rest = left[0] - np.tensordot(model, left[1:], axes=1)
    before, after = (float((points.counts * np.minimum(each**2, most)).sum()) for each in (left[0], rest))
    return 1 - after / max(before, 1e-30)


def _medians(values: Doubles, counts: Mask) -> Doubles:
    """Return for every point the median over the lights of what counts, 0 where nothing does; (light, point) of both.

    All points at once: numpy takes longer to call than to sort so few lights.

    >>> _medians(np.array([[1.0, 5, 5], [9, 7, 5], [3, 6, 5]]), np.array([[1, 1, 0], [1, 1, 0], [1, 0, 0]], bool))
    array([3., 6., 0.])
    """
    order, number = np.sort(np.where(counts, values, np.inf), axis=0), counts.sum(axis=0)
    lower, upper = (
        np.take_along_axis(order, np.clip(place, 0, len(order) - 1)[None], axis=0)[0]
        for place in ((number - 1) // 2, number // 2)
    )
    return np.where(number > 0, (lower + upper) / 2, 0.0)


def parts_of(points: SubjectPoints, g: Doubles, typical: float, in_place: InPlace = InPlace()) -> Doubles:
    """Return what was measured, in albedos, and what each number of the model would add, (part, light, point)."""
    from psvideo.solve.normals.robust.reflectance_kernel import fill_parts

    parts = np.empty((1 + NUMBERS, *points.measured.shape))
    fill_parts(points.measured, points.towards, points.half, points.to_camera, g, typical, *in_place, parts)
    return parts


def _left(points: SubjectPoints, weights: Doubles, parts: Doubles) -> Doubles:
    """Return what a vector of each pixel's own leaves of parts (part, light, point)."""
    from psvideo.solve.normals.robust.reflectance_kernel import take_off_own

    left = np.empty_like(parts)
    take_off_own(points.towards, weights, parts, left)
    return left


def _model(points: SubjectPoints, g: Doubles, typical: float, sought: Sought) -> tuple[Doubles, float]:
    """Return the numbers of the model, and the share of the squares of what is left over that it explains.

    What a pixel's own normal and albedo explain as well is taken off first: of that, other pixels say nothing.
    """
    from psvideo.solve.normals.robust.reflectance_kernel import add_squares

    parts = parts_of(points, g, typical, sought.in_place)
    weights, model, spread = points.counts, np.zeros(NUMBERS), 1.0
    left, square, right = parts, np.empty((NUMBERS, NUMBERS)), np.empty(NUMBERS)
    for turn in range(REWEIGHTED):
        left = _left(points, weights, parts)
        own, others = left[0], left[1:]
        rest = own - np.tensordot(model, others, axes=1)
        spread = max(float(1.48 * median(np.abs(rest[points.counts > 0]))), 1e-4)
        per = COUNTED / spread**2 / points.counts.sum()
        add_squares(weights, left, square, right)
        model = _bounded(per * square + np.diag(np.array(PRIOR) ** -2), per * right, sought)
        rest = own - np.tensordot(model, others, axes=1)
        if turn < REWEIGHTED - 1:
            weights = points.counts / (1 + (rest / (MODEL_WIDTH * spread)) ** 2)
    before, after = (float((weights * each**2).sum()) for each in (left[0], rest))
    return model, 1 - after / max(before, 1e-30)


def _bounded(square: Doubles, right: Doubles, sought: Sought) -> Doubles:
    """Return the least squares solution within what surfaces do: highlights add, the curve is no more than one, what is
    rough is not dark under grazing light as well, and what is soft has no curve of its own."""
    from psvideo.solve.normals.robust.reflectance_kernel import descend_within

    least, most = np.array((-MOST_CURVE, *(0.0,) * 5)), np.array((MOST_CURVE, 0.0, 0.0, *(MOST_LOBE,) * 3))
    if sought.kind == "rough":
        most[CURVE], most[ROUGH] = 0.0, MOST_ROUGH
    elif sought.kind == "soft":
        least[CURVE], most[CURVE] = 0.0, 0.0
        most[SOFT] = MOST_LOBE if sought.in_place.power else MOST_SOFT
    found = np.empty(NUMBERS)
    descend_within(square, right, least, most, found)
    return found


def _solved_again(points: SubjectPoints, g: Doubles, model: Doubles, typical: float, in_place: InPlace) -> Doubles:
    """Return g after a step of reweighted Gauss and Newton under the model."""
    from psvideo.solve.normals.robust.reflectance_kernel import solve_again

    found = np.empty_like(g)
    ways = points.towards, points.half, points.to_camera
    solve_again(points.measured, points.counts, *ways, g, model, typical, *in_place, found)
    return found
