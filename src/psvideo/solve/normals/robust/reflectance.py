"""How a subject reflects light beyond n . l, found from all of its pixels at once: one curve and two highlights.

A single pixel cannot tell a broad sheen from a turned normal. A subject can: its pixels face every way, and share
what they are made of. The model is albedo * (c + curve c^2) + broad h^8 + middle h^32 + narrow h^128, with c = n . l
and h = n . half way between light and camera (J. F. Blinn, "Models of light reflection for computer synthesized
pictures", 1977: varnish shines on every paint alike); low powers of c, as B. Shi et al. fit them per pixel
("Bi-polynomial modeling of low-frequency reflectances", PAMI 2014).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.model.irradiance.near_light import near_vectors
from psvideo.model.surface import Reflectance, Surface
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.plate_noise import rows_of
from psvideo.solve.normals.task import BROAD, FEW, MIDDLE, NARROW, Mask, Samples, Usable

Values = NDArray[np.float64]

LEAST_LIGHTS = 6
"""Five measurements leave two residuals: too few to tell a highlight from a normal (a photographed ball got worse)."""
ROWS, POINTS, FEWEST, MEASUREMENTS = 24, 400, 200, 4800
"""The model is fitted to this many points of this many rows, to fewer under many lights."""
LEAST_POINTS = 50
LEAST_EXPLAINED = 0.1
"""The model is used where it explains this much of the squares of what is left over. Of a matte subject it explains
0.01, of one under lights whose directions are wrong up to 0.07."""
ALTERNATIONS, SOLVED_AGAIN, REWEIGHTED = 4, 3, 4
"""How often model and normals follow each other, steps of the normals each time, and of the model's weights."""
HOPELESS = 0.02
"""What explains no more at the second time is not looked at again."""
PRIOR, COUNTED = (0.07, 0.3, 0.3, 0.3), 300.0
"""The model's numbers are near 0 to this much, beside the typical albedo, which counts as one of this many independent
points."""
POWERS, MOST_BRIGHT = np.array([BROAD, MIDDLE, NARROW], np.float64)[:, None, None], 5.0
"""Of the darkest points highlights are taken for this many times the albedo at most, while the model is fitted."""
MOST_CURVE, MOST_LOBE = 0.6, 5.0
MODEL_WIDTH, WIDTH = 2.0, 0.6
"""Cauchy's width in standard deviations: of all residuals for the model, of a pixel's own for its normal."""
LEAST_SHARE = 0.01
"""A pixel's residuals are at least this share of its light."""


@dataclass(frozen=True, kw_only=True)
class _Points:
    """Points of the subject: measurements (light, point) in units of every light's strength, which of them count
    (0 or 1), directions to the lights (light, point, 3), and half way from there to the camera."""

    measured: Values
    counts: Values
    towards: Values
    half: Values

    def only(self, known: Mask) -> "_Points":
        """Return some of the points."""
        return _Points(
            measured=self.measured[:, known],
            counts=self.counts[:, known],
            towards=self.towards[:, known],
            half=self.half[:, known],
        )


def reflectance_of(
    plates: Sequence[Samples] | Sequence[Mixture], lit: Illumination, found: Surface, usable: Usable,
    *, step: int, seen: Mask | None, black_level: float, scale: float,
) -> Reflectance | None:  # fmt: skip
    """Return what a subject solved in every ``step``-th row reflects beyond n . l; None where that explains little of
    what is left over, or the lights are too few. Arguments are those of ``huber1981.solve``."""
    if len(plates) < LEAST_LIGHTS:
        return None
    solved = np.arange(0, found.valid.shape[0], step)
    solved = solved[found.valid[solved].any(axis=1)]
    rows = solved[np.unique(np.linspace(0, len(solved) - 1, ROWS).astype(np.intp))] if len(solved) else solved
    where, cols = np.nonzero(found.valid[rows])
    few = max(min(POINTS, MEASUREMENTS // len(plates)), FEWEST)
    if len(where) < LEAST_POINTS:
        return None
    chosen = np.linspace(0, len(where) - 1, min(few, len(where))).astype(np.intp)
    at = (rows[where[chosen]], cols[chosen])
    samples = np.stack([rows_of(plate, rows)[where[chosen], cols[chosen]] for plate in plates]).astype(np.float64)
    here = np.ones(samples.shape[:2], bool) if seen is None else _seen(seen, at)
    points = _points((samples - black_level) * scale, lit, at, here, usable)
    normals = found.normals[at].astype(np.float64)
    return _fitted(points, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _seen(seen: Mask, at: tuple[NDArray[np.intp], NDArray[np.intp]]) -> Mask:
    return np.asarray(seen[:, at[0]] if seen.ndim == 2 else seen[:, at[0], at[1]])


def _points(
    samples: Values, lit: Illumination, at: tuple[NDArray[np.intp], NDArray[np.intp]], seen: Mask, usable: Usable
) -> _Points:
    samples = samples.reshape(*samples.shape[:2], -1)
    sent = _sent(lit, at)
    size = np.linalg.norm(sent, axis=-1)
    here = seen & (samples.max(axis=-1) < usable.saturation)
    each = samples / (size[..., None] * lit.intensities[:, None, : samples.shape[-1]])
    colour = (np.maximum(each, 0) * here[..., None]).sum(axis=0)
    measured = (each * colour).sum(axis=-1) / np.maximum(colour.sum(axis=-1), 1e-9)
    mean = (np.maximum(measured, 0) * here).sum(axis=0) / np.maximum(here.sum(axis=0), 1)
    least = np.maximum(usable.dark_level / lit.intensities.mean(), usable.shadow_ratio * mean)
    towards = sent / size[..., None]
    half = towards + np.array([0.0, 0.0, 1.0])
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    return _Points(measured=measured, counts=(here & (measured > least)).astype(float), towards=towards, half=half)


def _sent(lit: Illumination, at: tuple[NDArray[np.intp], NDArray[np.intp]]) -> Values:
    """Return what lights of the same intensities send to points: direction times share, (light, point, 3)."""
    field = lit.near
    if field is None:
        return np.repeat(lit.directions[:, None], len(at[0]), axis=1)
    ground = field.ground
    depth = ground.depth_m[at].astype(np.float64)
    x = (at[1] - ground.principal_px[0]) / ground.focal_px[0] * depth
    y = -(at[0] - ground.principal_px[1]) / ground.focal_px[1] * depth
    where = np.stack([x, y, -depth], axis=-1)
    sent = [
        near_vectors(where, place, axis=axis, anisotropy=float(mu)) / gain if near else np.tile(place, (len(where), 1))
        for place, axis, mu, gain, near in zip(
            field.positions_m, field.axes, field.anisotropy, field.middle_gain, field.is_near, strict=True
        )
    ]
    return np.stack(sent)


def _fitted(points: _Points, normals: Values) -> Reflectance | None:
    """Return the model that explains the points best, solved with their normals in turn."""
    cosines = np.maximum((points.towards * normals).sum(axis=-1), 0.05)
    sizes = _medians(points.measured / cosines, points.counts > 0)
    known = sizes > 0
    points = points.only(known)
    g = normals[known] * sizes[known, None]
    model, explained, typical = np.zeros(4), 0.0, median(sizes[known]) if known.any() else 0.0
    if len(g) < LEAST_POINTS:
        return None
    for turn in range(ALTERNATIONS):
        model, explained = _model(points, g, typical)
        if turn and explained < HOPELESS:
            return None
        for _ in range(SOLVED_AGAIN):
            g = _solved_again(points, g, model, typical)
    if explained < LEAST_EXPLAINED:
        return None
    return Reflectance(float(model[0]), *(float(each) * typical for each in model[1:]))


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


def _angles(points: _Points, g: Values) -> tuple[Values, Values, Values, Values]:
    """Return sizes (point,), normals (point, 3), and their cosines to lights and half ways (light, point)."""
    size = np.linalg.norm(g, axis=1)
    normals = g / size[:, None]
    c = (points.towards * normals).sum(axis=-1)
    return size, normals, c, np.maximum((points.half * normals).sum(axis=-1), 0)


def _model(points: _Points, g: Values, typical: float) -> tuple[Values, float]:
    """Return the numbers of the model, and the share of the squares of what is left over that it explains.

    What a pixel's own normal and albedo explain as well is taken off first: of that, other pixels say nothing.
    """
    size, _, c, h = _angles(points, g)
    lit = c > 0
    bright = lit * np.minimum(typical / size, MOST_BRIGHT)
    parts = np.concatenate([[points.measured / size, c * c * lit], bright * h**POWERS])
    weights, model, spread = points.counts, np.zeros(4), 1.0
    left = parts
    for turn in range(REWEIGHTED):
        left = parts - _explained(points.towards, weights, parts)
        own, others = left[0], left[1:]
        rest = own - np.tensordot(model, others, axes=1)
        spread = max(float(1.48 * median(np.abs(rest[points.counts > 0]))), 1e-4)
        per = COUNTED / spread**2 / points.counts.sum()
        square = per * np.einsum("lp,klp,jlp->kj", weights, others, others) + np.diag(np.array(PRIOR) ** -2)
        model = _bounded(square, per * np.einsum("lp,klp,lp->k", weights, others, own))
        rest = own - np.tensordot(model, others, axes=1)
        if turn < REWEIGHTED - 1:
            weights = points.counts / (1 + (rest / (MODEL_WIDTH * spread)) ** 2)
    before, after = (float((weights * each**2).sum()) for each in (left[0], rest))
    return model, 1 - after / max(before, 1e-30)


def _bounded(square: Values, right: Values) -> Values:
    """Return the least squares solution within what surfaces do: highlights add, and the curve is no more than one."""
    least = (-MOST_CURVE, 0.0, 0.0, 0.0)
    most = (MOST_CURVE, MOST_LOBE, MOST_LOBE, MOST_LOBE)
    rows, wanted, found = square.tolist(), right.tolist(), [0.0] * 4  # quicker than numpy's numbers one by one
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


def _solved_again(points: _Points, g: Values, model: Values, typical: float) -> Values:
    """Return g after a step of reweighted Gauss and Newton under the model."""
    size, normals, c, h = _angles(points, g)
    lit = c > 0
    bright = lit * np.minimum(typical / size, MOST_BRIGHT) * model[1:, None, None]
    shine = size * (bright * h**POWERS).sum(axis=0)
    by_c = 1 + 2 * model[0] * lit * c
    by_h = (bright * POWERS * h ** (POWERS - 1)).sum(axis=0)
    shade = c + model[0] * lit * c * c
    along = shade - by_c * c - by_h * h
    matrix = along[..., None] * normals + by_c[..., None] * points.towards + by_h[..., None] * points.half
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
