"""How a subject reflects light beyond n . l, found from all of its pixels at once: a curve, roughness, highlights.

A single pixel cannot tell a broad sheen from a turned normal. A subject can: its pixels face every way, and share
what they are made of. The model is albedo * (c + curve c^2 + rough r) + broad h^8 + middle h^32 + narrow h^128, with
c = n . l and h = n . half way between light and camera (J. F. Blinn, "Models of light reflection for computer
synthesized pictures", 1977: varnish shines on every paint alike); low powers of c, as B. Shi et al. fit them per pixel
("Bi-polynomial modeling of low-frequency reflectances", PAMI 2014). What clay, plaster, stone and cloth throw back
towards the light is r = c max(l . v - c n . v, 0) / max(c, n . v), with v to the camera: M. Oren and S. K. Nayar,
"Generalization of Lambert's reflectance model", 1994, without their angles.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.model.surface import Reflectance
from psvideo.solve.normals.task import BROAD, FEW, MIDDLE, NARROW, Mask

Values = NDArray[np.float64]

LEAST_POINTS = 50
FOR_SHINE = 6
"""Five measurements leave two residuals: too few to tell a highlight from a normal (a photographed ball got worse)."""
WELL_SPREAD = 3.0
"""Roughness shows in how lights from many sides differ: their directions' condition number is at most this."""
LEAST_EXPLAINED = 0.1
"""The model is used where it explains this much of the squares of what is left over. Of a matte subject it explains
0.01, of one under lights whose directions are wrong up to 0.07."""
ALTERNATIONS, SOLVED_AGAIN, REWEIGHTED = 4, 3, 4
"""How often model and normals follow each other, steps of the normals each time, and of the model's weights."""
HOPELESS = 0.02
"""What explains no more at the second time is not looked at again."""
NUMBERS, ROUGH, SHINE, LESS_LEFT = 5, 1, 2, 0.8
"""The model's numbers, which of them is roughness, where highlights begin, and what roughness leaves at most of what is
left without it, to count: under lights whose directions are wrong it explains a tenth, of clay half."""
LEAST_ROUGH = 0.1
"""What is less rough (facets that lean by 9 degrees) turns normals by less than a degree. Other faults look like it."""
PRIOR, COUNTED = (0.07, 0.3, 0.3, 0.3, 0.3), 300.0
"""The model's numbers are near 0 to this much, beside the typical albedo, which counts as one of this many independent
points."""
POWERS, MOST_BRIGHT = np.array([BROAD, MIDDLE, NARROW], np.float64)[:, None, None], 5.0
"""Of the darkest points highlights are taken for this many times the albedo at most, while the model is fitted."""
MOST_CURVE, MOST_ROUGH, MOST_LOBE = 0.6, 1.5, 5.0
LEAST_FACING = 0.05
"""Of the cosines that roughness is divided by."""
MODEL_WIDTH, WIDTH = 2.0, 0.6
"""Cauchy's width in standard deviations: of all residuals for the model, of a pixel's own for its normal."""
OUTLYING = 3.0
"""Shadows' edges and narrow highlights are few, and far off."""
LEAST_SHARE = 0.01
"""A pixel's residuals are at least this share of its light."""


@dataclass(frozen=True, kw_only=True)
class SubjectPoints:
    """Points of the subject: measurements (light, point) in units of every light's strength, which of them count
    (0 or 1), directions to the lights (light, point, 3), and half way from there to the camera; and ``normals``
    (point, 3) as the points were solved without a model."""

    measured: Values
    counts: Values
    towards: Values
    half: Values
    normals: Values

    def only(self, known: Mask) -> "SubjectPoints":
        """Return some of the points."""
        return SubjectPoints(
            measured=self.measured[:, known],
            counts=self.counts[:, known],
            towards=self.towards[:, known],
            half=self.half[:, known],
            normals=self.normals[known],
        )


def joined(looks: Sequence[SubjectPoints]) -> SubjectPoints:
    """Return the points of one or several looks at a subject under the same lights."""
    if len(looks) == 1:
        return looks[0]
    return SubjectPoints(
        measured=np.concatenate([one.measured for one in looks], axis=1),
        counts=np.concatenate([one.counts for one in looks], axis=1),
        towards=np.concatenate([one.towards for one in looks], axis=1),
        half=np.concatenate([one.half for one in looks], axis=1),
        normals=np.concatenate([one.normals for one in looks]),
    )


def fitted(points: SubjectPoints) -> Reflectance | None:
    """Return the model that explains the points best, solved with their normals in turn; of FOR_SHINE lights or more
    any, of fewer that of rough surfaces alone."""
    sizes = sizes_of(points)
    known = sizes > 0
    points = points.only(known)
    g = points.normals * sizes[known, None]
    if len(g) < LEAST_POINTS:
        return None
    typical = median(sizes[known])
    model, explained, *_ = alternated(points, g, typical, rough=False)
    spread = np.linalg.svd(points.towards.mean(axis=1), compute_uv=False)
    rough, by_rough = np.zeros(NUMBERS), 0.0
    if spread[0] < WELL_SPREAD * spread[-1]:
        rough, by_rough, *_ = alternated(points, g, typical, rough=True)
    if rough[ROUGH] >= LEAST_ROUGH and 1 - by_rough < LESS_LEFT * (1 - explained):
        model, explained = rough, by_rough
    elif len(points.measured) < FOR_SHINE:
        return None
    if explained < LEAST_EXPLAINED:
        return None
    return Reflectance(*(float(each) for each in model[:SHINE]), *(float(each) * typical for each in model[SHINE:]))


def sizes_of(points: SubjectPoints) -> Values:
    """Return the albedo of every point with its normal, 0 where nothing was measured."""
    cosines = np.maximum((points.towards * points.normals).sum(axis=-1), 0.05)
    return _medians(points.measured / cosines, points.counts > 0)


class ModelFollowed(NamedTuple):
    """A model, what it explains, and the normals that follow it, times albedo."""

    model: Values
    explained: float
    g: Values


def alternated(
    points: SubjectPoints, g: Values, typical: float, *, rough: bool, turns: int = ALTERNATIONS, least: float = -np.inf
) -> ModelFollowed:
    """Return the model and what it explains, from normals that follow it; nothing where that is hopeless, or no more
    than the ``least``."""
    nothing = ModelFollowed(np.zeros(NUMBERS), 0.0, g)
    model, explained = np.zeros(NUMBERS), 0.0
    for turn in range(turns):
        model, explained = _model(points, g, typical, rough=rough)
        if (turn and explained < HOPELESS) or (rough and not model[ROUGH]) or explained <= least:
            return nothing
        for _ in range(SOLVED_AGAIN):
            g = _solved_again(points, g, model, typical)
    return ModelFollowed(model, explained, g)


def explained_evenly(points: SubjectPoints, g: Values, typical: float, model: Values) -> float:
    """Return which share of the squares of what is left over a model explains, where no measurement counts less than
    others but for OUTLYING times what is typical: what weights found in noise is gone."""
    parts = _parts(points, g, typical)
    left = parts - _explained(points.towards, points.counts, parts)
    most = OUTLYING**2 * float((points.counts * left[0] ** 2).sum() / max(points.counts.sum(), 1))
    rest = left[0] - np.tensordot(model, left[1:], axes=1)
    before, after = (float((points.counts * np.minimum(each**2, most)).sum()) for each in (left[0], rest))
    return 1 - after / max(before, 1e-30)


def _medians(values: Values, counts: Mask) -> Values:
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


def _angles(points: SubjectPoints, g: Values) -> tuple[Values, Values, Values, Values]:
    """Return sizes (point,), normals (point, 3), and their cosines to lights and half ways (light, point)."""
    size = np.linalg.norm(g, axis=1)
    normals = g / size[:, None]
    c = (points.towards * normals).sum(axis=-1)
    return size, normals, c, np.maximum((points.half * normals).sum(axis=-1), 0)


def _rough(points: SubjectPoints, normals: Values, c: Values) -> tuple[Values, Values, Values]:
    """Return what rough surfaces add (light, point), and what it gains with c and with the cosine to the camera."""
    facing, towards = np.maximum(normals[:, 2], LEAST_FACING), points.towards[..., 2]
    back = ((c > 0) & (towards > c * normals[:, 2])).astype(np.float64)
    over = c > facing  # of the two angles this one is less
    shares = back * np.where(over, 1.0, c / facing)
    by_c = back * np.where(over, -facing, towards / facing - 2 * c)
    by_z = -shares * np.where(over, c, towards / facing)
    return shares * (towards - c * facing), by_c, by_z


def _parts(points: SubjectPoints, g: Values, typical: float) -> Values:
    """Return what was measured, in albedos, and what each number of the model would add, (part, light, point)."""
    size, normals, c, h = _angles(points, g)
    lit = c > 0
    back, _, _ = _rough(points, normals, c)
    bright = lit * np.minimum(typical / size, MOST_BRIGHT)
    return np.concatenate([[points.measured / size, c * c * lit, back], bright * h**POWERS])


def _model(points: SubjectPoints, g: Values, typical: float, *, rough: bool) -> tuple[Values, float]:
    """Return the numbers of the model, and the share of the squares of what is left over that it explains.

    What a pixel's own normal and albedo explain as well is taken off first: of that, other pixels say nothing.
    """
    parts = _parts(points, g, typical)
    weights, model, spread = points.counts, np.zeros(NUMBERS), 1.0
    left = parts
    for turn in range(REWEIGHTED):
        left = parts - _explained(points.towards, weights, parts)
        own, others = left[0], left[1:]
        rest = own - np.tensordot(model, others, axes=1)
        spread = max(float(1.48 * median(np.abs(rest[points.counts > 0]))), 1e-4)
        per = COUNTED / spread**2 / points.counts.sum()
        square = per * np.einsum("lp,klp,jlp->kj", weights, others, others) + np.diag(np.array(PRIOR) ** -2)
        model = _bounded(square, per * np.einsum("lp,klp,lp->k", weights, others, own), rough=rough)
        rest = own - np.tensordot(model, others, axes=1)
        if turn < REWEIGHTED - 1:
            weights = points.counts / (1 + (rest / (MODEL_WIDTH * spread)) ** 2)
    before, after = (float((weights * each**2).sum()) for each in (left[0], rest))
    return model, 1 - after / max(before, 1e-30)


def _bounded(square: Values, right: Values, *, rough: bool) -> Values:
    """Return the least squares solution within what surfaces do: highlights add, the curve is no more than one, and
    what is ``rough`` is not dark under grazing light as well."""
    least = (-MOST_CURVE, 0.0, 0.0, 0.0, 0.0)
    most = (0.0 if rough else MOST_CURVE, MOST_ROUGH if rough else 0.0, MOST_LOBE, MOST_LOBE, MOST_LOBE)
    rows, wanted, found = square.tolist(), right.tolist(), [0.0] * NUMBERS  # quicker than numpy's numbers one by one
    for _ in range(50):  # coordinate descent: strictly convex
        before = list(found)
        for k, row in enumerate(rows):
            other = wanted[k] - sum(a * b for n, (a, b) in enumerate(zip(row, found, strict=True)) if n != k)
            found[k] = min(max(other / row[k], least[k]), most[k])
        if found == before:
            break
    return np.array(found)


def _explained(towards: Values, weights: Values, parts: Values) -> Values:
    """Return what a vector of each pixel's own explains of parts (part, light, point)."""
    matrix = np.einsum("lp,lpi,lpj->pij", weights, towards, towards) + 1e-9 * np.eye(3)
    right = np.einsum("lp,klp,lpi->pik", weights, parts, towards)
    return np.asarray(np.einsum("lpi,pik->klp", towards, np.linalg.solve(matrix, right)))


def _solved_again(points: SubjectPoints, g: Values, model: Values, typical: float) -> Values:
    """Return g after a step of reweighted Gauss and Newton under the model."""
    size, normals, c, h = _angles(points, g)
    lit = c > 0
    bright = lit * np.minimum(typical / size, MOST_BRIGHT) * model[SHINE:, None, None]
    rough, rough_by_c, rough_by_z = _rough(points, normals, c)
    shine = size * (bright * h**POWERS).sum(axis=0)
    by_c = 1 + 2 * model[0] * lit * c + model[ROUGH] * rough_by_c
    by_z = model[ROUGH] * rough_by_z
    by_h = (bright * POWERS * h ** (POWERS - 1)).sum(axis=0)
    shade = c + model[0] * lit * c * c + model[ROUGH] * rough
    along = shade - by_c * c - by_h * h - by_z * normals[:, 2]
    matrix = along[..., None] * normals + by_c[..., None] * points.towards + by_h[..., None] * points.half
    matrix[..., 2] += by_z
    matte = points.measured - shine
    rest = np.abs(matte - size * shade)
    count = points.counts.sum(axis=0)
    order = np.sort(np.where(points.counts > 0, rest, np.inf), axis=0)
    middle = np.clip((count + 3) // 2 - 1, 0, np.maximum(count - 1, 0)).astype(np.intp)
    typical = 1.48 * np.take_along_axis(order, middle[None], axis=0)[0]
    spread = np.maximum(np.where(np.isfinite(typical), typical, 0), LEAST_SHARE * size)
    width = WIDTH * np.minimum(1, np.sqrt(FEW / np.maximum(count, FEW)))
    weights = points.counts / (1 + (rest / (width * spread)) ** 2)
    square = np.einsum("lp,lpi,lpj->pij", weights, matrix, matrix)
    square += (1e-6 * np.trace(square, axis1=1, axis2=2) + 1e-12)[:, None, None] * np.eye(3)
    right = np.einsum("lp,lp,lpi->pi", weights, matte, matrix)
    step = np.linalg.solve(square, right[..., None])[..., 0] - g
    far = np.linalg.norm(step, axis=1)
    return np.asarray(g + step * np.minimum(1, 0.3 * size / np.maximum(far, 1e-12))[:, None])
