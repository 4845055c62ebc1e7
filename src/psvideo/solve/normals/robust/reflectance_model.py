"""How a subject reflects light beyond n . l: the model, and its numbers and normals fitted in turn.

The model is albedo * (c + curve c^2 + rough r + soft (1 - c)) + broad h^8 + middle h^32 + narrow h^128, with c = n . l
and h = n . half way between light and camera (J. F. Blinn, "Models of light reflection for computer synthesized
pictures", 1977: varnish shines on every paint alike); low powers of c, as B. Shi et al. fit them per pixel
("Bi-polynomial modeling of low-frequency reflectances", PAMI 2014). What clay, plaster, stone and cloth throw back
towards the light is r = c max(l . v - c n . v, 0) / max(c, n . v), with v to the camera: M. Oren and S. K. Nayar,
"Generalization of Lambert's reflectance model", 1994, without their angles. Of skin, wax and marble light comes out
again around where it went in: it shows beyond the edge of shadows and flattens normals, about as (c + w) / (1 + w),
with soft = w / (1 + w) (S. Green, "Real-time approximations to subsurface scattering", GPU Gems, 2004).
"""

from typing import Literal, NamedTuple

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles
from psvideo.solve.normals.robust.subject_points import SubjectPoints

Kind = Literal["shining", "rough", "soft"]
ALTERNATIONS, SOLVED_AGAIN, REWEIGHTED = 4, 3, 4
"""How often model and normals follow each other, steps of the normals each time, and of the model's weights."""
HOPELESS = 0.02
"""What explains no more at the second time is not looked at again."""
NUMBERS, CURVE, ROUGH, SOFT, SHINE = 6, 0, 1, 2, 3
"""The model's numbers, which of them are curve, roughness and softness, and where highlights begin."""
OF_KIND: dict[Kind, int] = {"rough": ROUGH, "soft": SOFT}
"""The number without which a model is none of its kind."""
PRIOR, COUNTED = (0.07, 0.3, 0.3, 0.3, 0.3, 0.3), 300.0
"""The model's numbers are near 0 to this much, beside the typical albedo, which counts as one of this many independent
points."""
MOST_CURVE, MOST_ROUGH, MOST_SOFT, MOST_LOBE = 0.6, 1.5, 0.35, 5.0
MODEL_WIDTH = 2.0
"""Cauchy's width in standard deviations of all residuals."""
OUTLYING = 3.0
"""Shadows' edges and narrow highlights are few, and far off."""


class InPlace(NamedTuple):
    """What is fitted in softness' place, to see whether it explains as much: a lobe h^``power``, as a share of the
    albedo (``on_paint``) or the same on every paint. Power 0 is softness itself."""

    power: float = 0.0
    on_paint: bool = False


class Sought(NamedTuple):
    """What kind of model is sought, and what stands in softness' place in it; of ``least_left`` albedos nothing is
    expected to be explained."""

    kind: Kind = "shining"
    in_place: InPlace = InPlace()
    least_left: float = 1e-4


class ModelFollowed(NamedTuple):
    """A model, what it explains, and the normals that follow it, times albedo."""

    model: Doubles
    explained: float
    g: Doubles


def alternated(
    points: SubjectPoints, g: Doubles, typical: float, sought: Sought = Sought(), *,
    turns: int = ALTERNATIONS, least: float = -np.inf,
) -> ModelFollowed:  # fmt: skip
    """Return the model that is fitted in turn with the points' normals, beginning with ``g`` (point, 3), these times
    albedo; ``typical`` is the subject's albedo.

    An empty model, with the normals as they came, where it is none of its kind or explains no more than ``least``.
    """
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
    left = left_over(points, points.counts, parts)
    most = OUTLYING**2 * float((points.counts * left[0] ** 2).sum() / max(points.counts.sum(), 1))
    rest = left[0] - np.tensordot(model, left[1:], axes=1)
    before, after = (float((points.counts * np.minimum(each**2, most)).sum()) for each in (left[0], rest))
    return 1 - after / max(before, 1e-30)


def parts_of(points: SubjectPoints, g: Doubles, typical: float, in_place: InPlace = InPlace()) -> Doubles:
    """Return what was measured, in albedos, and what each number of the model would add, (part, light, point)."""
    from psvideo.solve.normals.robust.reflectance_kernel import fill_parts

    parts = np.empty((1 + NUMBERS, *points.measured.shape))
    fill_parts(points.shown, g, typical, *in_place, parts)
    return parts


def left_over(points: SubjectPoints, weights: Doubles, parts: Doubles) -> Doubles:
    """Return what a vector of each pixel's own leaves of parts (part, light, point)."""
    from psvideo.solve.normals.robust.point_sums import take_off_own

    left = np.empty_like(parts)
    take_off_own(points.towards, weights, parts, left)
    return left


def _model(points: SubjectPoints, g: Doubles, typical: float, sought: Sought) -> tuple[Doubles, float]:
    """Return the numbers of the model, and the share of the squares of what is left over that it explains.

    What a pixel's own normal and albedo explain as well is taken off first: of that, other pixels say nothing.
    """
    from psvideo.solve.normals.robust.point_sums import add_squares

    parts = parts_of(points, g, typical, sought.in_place)
    weights, model, spread = points.counts, np.zeros(NUMBERS), 1.0
    left, square, right = parts, np.empty((NUMBERS, NUMBERS)), np.empty(NUMBERS)
    for turn in range(REWEIGHTED):
        left = left_over(points, weights, parts)
        own, others = left[0], left[1:]
        rest = own - np.tensordot(model, others, axes=1)
        spread = max(float(1.48 * median(np.abs(rest[points.counts > 0]))), sought.least_left)
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
    from psvideo.solve.normals.robust.point_sums import descend_within

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
    solve_again(points.shown, g, model, typical, *in_place, found)
    return found
