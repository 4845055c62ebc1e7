"""A sphere's outline to a fraction of a pixel: edges along its radii, fitted robustly by the outline of a sphere.

Along each of many radii the steepest places near the expected outline are found to a fraction of a pixel. Random
triples of them are tried (RANSAC, Fischler & Bolles 1981) for the outline that most radii agree with; from there a fit
with Tukey's weights goes on. The uncertainty comes from leaving out one sector of the outline after the other
(jackknife), which sees what single edges do not: an arc where a bright rim was taken for the outline.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.sphere_search import Grey, RoundThing, round_things
from psvideo.calibrate.sphere_view import View
from psvideo.camera import FloatArray

USUAL_STRETCH = 0.005
"""How far from a circle an outline is expected to be where perspective is unknown (a sphere 8 degrees off the axis);
outlines seen in part only hold to this."""
EDGE_BIAS_PX = 0.2
EDGE_BIAS_SHARE = 0.1
FADING_BIAS_SHARE = 0.5
"""What an edge's place may be off along a whole outline, in x, y and radius: in pixels, as a share of half the sharpest
edges' width (a rim of light, sharpening), and of what the usual edge is wider than those (a mirror's fading rim)."""
GIVEN_ERROR_PX = 0.5
"""Standard error in x, y and radius of an outline that a person marked."""
BAND = 0.05
"""How far from the expected outline edges are looked for, as a share of the radius; 6 pixels at least."""
ALONG_RADII = 3.0
"""Over how many neighbouring radii edges are averaged: noise falls, and a mirror's outline is smooth."""
MOST_FADING = 2.0
"""How many times an outer flank may be further out than that of a sharp edge to count as a mirror's fading rim."""
SECTORS = 12
TRIALS = 120
GAUSS_NEWTON_STEPS = 10
LEAST_COVERAGE = 0.3
"""Share of the radii that must agree on an outline; by chance it is a tenth."""
AGREE_PX = 1.5
"""How near to the outline an edge is to count, plus a two-hundredth of the radius."""


@dataclass(frozen=True, kw_only=True)
class Outline:
    """A sphere's outline: ``place`` (5,) as in ``sphere_view``, with its ``covariance`` (5, 5).

    ``points`` (point, 2) are the edges it rests on, ``coverage`` the share of its radii that have one,
    ``scatter_px`` their root mean square distance from it,
    ``blur_px`` half the width of those edges. ``given``: a person marked it."""

    view: View
    place: FloatArray
    covariance: FloatArray
    points: FloatArray
    coverage: float
    scatter_px: float
    blur_px: float
    given: bool = False

    @property
    def radius_px(self) -> float:
        """The radius in the middle of the picture."""
        return float(self.place[2])

    @property
    def error_px(self) -> float:
        """Standard error of the centre and radius, root mean square of the three."""
        return float(np.sqrt(np.trace(self.covariance[:3, :3]) / 3))

    @property
    def ellipticity(self) -> float:
        """By how much the longer axis exceeds the shorter one, as a share; 0 in perspective, which explains it."""
        return 2 * float(np.hypot(*self.place[3:]))


def given_outline(view: View, circle: tuple[float, float, float]) -> Outline:
    """Return the outline that a circle (x, y, radius), marked by hand in the picture, stands for."""
    x, y, radius = circle
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    rim = np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn)], axis=1)
    place = view.through(rim)
    found = np.array([*circle, 0.0, 0.0]) if place is None else place
    return Outline(
        view=view,
        place=found,
        covariance=_in_place(GIVEN_ERROR_PX),
        points=np.zeros((0, 2)),
        coverage=1.0,
        scatter_px=0.0,
        blur_px=0.0,
        given=True,
    )


def edge_pictures(pictures: LightPictures) -> list[Grey]:
    """Return pictures (row, col) in which an outline may show: mean and maximum over the lights, and ambient light."""
    grey = pictures.grey
    shown = [grey.mean(axis=0), grey.max(axis=0)]
    if pictures.ambient is not None:
        shown.append(pictures.ambient if pictures.ambient.ndim == 2 else pictures.ambient.mean(axis=2))
    return [np.asarray(picture, np.float32) for picture in shown]


def _logarithm(picture: Grey) -> Grey:
    """Return a picture in which a faint outline before black cloth weighs as much as one before a lit wall."""
    floor = max(0.25 * float(np.percentile(picture, 50)), 2e-4)
    logarithm: Grey = np.log(np.maximum(picture, 0) + np.float32(floor)).astype(np.float32)
    return logarithm


def find_outlines(pictures: Sequence[Grey], view: View, *, count: int = 1) -> list[Outline]:
    """Return up to ``count`` spheres' outlines, those that most radii agree on first, none over another."""
    fits = [fit for picture in pictures for fit in _fits(picture, view) if fit.coverage >= LEAST_COVERAGE]
    fits.sort(key=lambda fit: fit.coverage * np.sqrt(fit.radius_px), reverse=True)
    chosen: list[Outline] = []
    for fit in fits:
        if len(chosen) < count and all(_apart(fit, other) for other in chosen):
            chosen.append(_sharpest(fit, fits))
    return chosen


def _fits(picture: Grey, view: View) -> list[Outline]:
    """Return the outlines fitted to a picture's round things; things on an outline that was fitted are passed over."""
    fits: list[Outline] = []
    for thing in round_things(_logarithm(picture)):
        circle = np.array([thing.x, thing.y, thing.radius])
        if all(np.abs(fit.place[:3] - circle).max() > 0.1 * fit.radius_px for fit in fits):
            fit = fit_outline(picture, view, thing)
            fits += [fit] if fit is not None else []
    return fits


def _sharpest(best: Outline, fits: Sequence[Outline]) -> Outline:
    """Return, of the fits of one and the same outline, the one with the sharpest edges and nearly the best coverage."""
    same = [
        fit
        for fit in fits
        if np.abs(fit.place - best.place)[:3].max() < 0.03 * best.radius_px and fit.coverage >= 0.8 * best.coverage
    ]
    return _with_doubt(min(same, key=lambda fit: fit.blur_px), same)


def _apart(one: Outline, other: Outline) -> bool:
    away = float(np.hypot(*(one.place[:2] - other.place[:2])))
    return away > 0.8 * (one.radius_px + other.radius_px)


def fit_outline(picture: Grey, view: View, start: RoundThing | Outline) -> Outline | None:
    """Return the outline near a first guess; None where too few radii agree on one.

    The picture is taken in linear light: at grazing angles a mirror shows what is behind it, so towards the rim a dark
    sphere fades into a brighter background, and in logarithms the steepest place of that ramp lies too far inside.
    """
    if isinstance(start, Outline):
        around = start.place
    else:
        first = given_outline(view, (start.x, start.y, start.radius))
        around = first.place
    blur_px = float(np.clip(around[2] / 200, 0.8, 3.0))
    smooth: Grey = cv2.GaussianBlur(picture, (0, 0), blur_px).astype(np.float32)
    fits = [fit for fading in (False, True) if (fit := _fitted(smooth, view, around, fading=fading)) is not None]
    if not fits:
        return None
    most = max(fit.coverage for fit in fits)
    fits = [fit for fit in fits if fit.coverage >= 0.95 * most]
    return _with_doubt(min(fits, key=lambda fit: fit.scatter_px), fits)


def _with_doubt(best: Outline, others: Sequence[Outline]) -> Outline:
    """Return an outline whose uncertainty holds how far other readings of the same edges lie from it."""
    away = np.array([other.place - best.place for other in others])
    return replace(best, covariance=best.covariance + np.diag((away**2).sum(axis=0) / max(len(away) - 1, 1)))


def _fitted(smooth: Grey, view: View, around: FloatArray, *, fading: bool) -> Outline | None:
    """Fit an outline to edges; with ``fading``, to the outer ends of those that are less sharp than others."""
    edges = _edges_on_radii(smooth, view, around, fading=fading)
    place = None if len(edges.points) < 12 else _agreed(view, edges, around)
    return None if place is None else _measured(view, _edges_on_radii(smooth, view, place, fading=fading), place)


@dataclass(frozen=True)
class _Edges:
    """Edge points (edge, 2), the radius on which each lies, how many radii were looked along, and half the width of
    sharp edges and of the usual one."""

    points: FloatArray
    radius_index: NDArray[np.intp]
    radii: int
    sharp_px: float
    blur_px: float


def _edges_on_radii(smooth: Grey, view: View, place: FloatArray, *, fading: bool) -> _Edges:
    """Return the two steepest places along each radius near the outline."""
    radii = int(np.clip(2 * np.pi * place[2] / 1.5, 120, 1080))
    rim = view.curve(place, radii)
    outward = rim - place[:2]
    length = np.linalg.norm(outward, axis=1, keepdims=True)
    reach = max(BAND * place[2], 6.0)
    steps = np.arange(-reach, reach + 0.25, 0.5)
    spots = rim[:, None, :] + (outward / length)[:, None, :] * steps[None, :, None]
    values = cv2.remap(
        smooth, spots[..., 0].astype(np.float32), spots[..., 1].astype(np.float32), cv2.INTER_LINEAR
    ).astype(np.float64)
    rows, cols = smooth.shape
    inside = ((spots >= 0) & (spots <= (cols - 1, rows - 1))).all(axis=2).all(axis=1)
    averaged = cv2.GaussianBlur(values, (1, 0), sigmaX=1e-3, sigmaY=ALONG_RADII, borderType=cv2.BORDER_REPLICATE)
    steep = np.abs(np.gradient(averaged.astype(np.float64), axis=1))
    steep[~inside] = 0
    index, along, (sharp, usual) = _crests(steep)
    steps_out = along[0] + (along[1] if fading else 0.0)
    points = rim[index] + (outward / length)[index] * (-reach + 0.5 * steps_out)[:, None]
    return _Edges(points, index, radii, 0.5 * sharp, 0.5 * usual)


def _crests(steep: FloatArray) -> tuple[NDArray[np.intp], FloatArray, tuple[float, float]]:
    """Return the two highest crests of steepness along each radius (radius, step): which radius, at which step, and
    how many steps half a sharp edge's width is, and half the usual one's.

    Towards its rim a mirror may fade into what is behind it; then an edge is a ramp with the outline at its outer end.
    The second row says by how many steps: what the outer flank of the edge (where it is half as steep) is further out
    than that of the sharpest edges.
    """
    left, middle, right = steep[:, :-2], steep[:, 1:-1], steep[:, 2:]
    bar = np.maximum(3 * np.median(steep, axis=1), 1e-6)[:, None]
    crest = np.where((middle >= left) & (middle > right) & (middle > bar), middle, 0.0)
    best = np.argsort(crest, axis=1)[:, ::-1][:, :2]
    index, rank = np.nonzero(np.take_along_axis(crest, best, axis=1) > 0)
    at = best[index, rank] + 1
    if not len(at):
        return index, np.zeros((2, 0)), (0.0, 0.0)
    before, top, after = (steep[index, at + step] for step in (-1, 0, 1))
    shift = np.clip(0.5 * (before - after) / np.minimum(before - 2 * top + after, -1e-12), -0.5, 0.5)
    beyond = (steep[index] < 0.5 * top[:, None]) & (np.arange(steep.shape[1]) > at[:, None])
    ends = beyond.any(axis=1)
    flank = np.where(ends, beyond.argmax(axis=1), at + 1)
    inner, outer = steep[index, flank - 1], steep[index, flank]
    width = flank - 1 + (inner - 0.5 * top) / np.maximum(inner - outer, 1e-12) - (at + shift)
    sharp, usual = np.quantile(width[ends], (0.2, 0.5)) if ends.any() else (0.0, 0.0)
    fading = np.where(ends, np.clip(width - sharp, 0.0, MOST_FADING * sharp), 0.0)
    return index, np.array([at + shift, fading]), (float(sharp), float(usual))


def _tolerance_px(place: FloatArray) -> float:
    return AGREE_PX + float(place[2]) / 200


def _agreed(view: View, edges: _Edges, around: FloatArray) -> FloatArray | None:
    """Return the outline, out of random triples of edges, that most radii agree with, refined on those."""
    rng = np.random.default_rng(1)
    tolerance = _tolerance_px(around)
    best, most = around, _agreeing(view, edges, around, tolerance)
    for _ in range(TRIALS):
        three = rng.choice(len(edges.points), 3, replace=False)
        place = view.through(edges.points[three])
        if place is None or np.abs(place - around)[:3].max() > 0.25 * around[2]:
            continue
        count = _agreeing(view, edges, place, tolerance)
        if count > most:
            best, most = place, count
    return _refined(view, edges.points, best, tolerance) if most >= 12 else None


def _agreeing(view: View, edges: _Edges, place: FloatArray, tolerance: float) -> int:
    near = np.abs(view.distance_px(edges.points, place)) < tolerance
    return len(np.unique(edges.radius_index[near]))


def _refined(view: View, points: FloatArray, place: FloatArray, tolerance: float) -> FloatArray:
    """Fit by least squares with Tukey's weights, whose width shrinks to the edges' own scatter."""
    for _ in range(8):
        away = view.distance_px(points, place)
        near = np.abs(away) < tolerance
        scatter = 1.4826 * float(np.median(np.abs(away[near]))) if near.any() else tolerance
        width = float(np.clip(4.685 * scatter, 0.5 * tolerance, tolerance))
        weight = np.where(np.abs(away) < width, 1 - (away / width) ** 2, 0.0)
        if np.count_nonzero(weight) < 6:
            return place
        moved = _least_squares(view, points[weight > 0], weight[weight > 0], place)
        if np.abs(moved - place)[:3].max() < 1e-4:
            return moved
        place = moved
    return place


def _least_squares(view: View, points: FloatArray, weight: FloatArray, place: FloatArray) -> FloatArray:
    """Fit what is unknown of an outline; a stretch costs as if one sector's edges spoke against it."""
    free = view.unknowns
    strictness = np.sqrt(len(points) / SECTORS) / USUAL_STRETCH

    def misfit(trial: FloatArray) -> FloatArray:
        whole = np.array([*trial, *place[free:]])
        return np.concatenate([weight * view.distance_px(points, whole), strictness * whole[3:free]])

    found = place[:free].copy()
    for _ in range(GAUSS_NEWTON_STEPS):
        now = misfit(found)
        slopes = [(misfit(found + step) - now) / step.sum() for step in np.diag([1e-3, 1e-3, 1e-3, 1e-6, 1e-6][:free])]
        move = np.linalg.lstsq(np.stack(slopes, axis=1), -now, rcond=None)[0]
        found += move
        if np.abs(move).max() < 1e-5:
            break
    return np.array([*found, *place[free:]])


def _measured(view: View, edges: _Edges, place: FloatArray) -> Outline:
    """Return the outline with what it rests on and its uncertainty."""
    tolerance = _tolerance_px(place)
    place = _refined(view, edges.points, place, tolerance)
    away = view.distance_px(edges.points, place)
    scatter = 1.4826 * float(np.median(np.abs(away[np.abs(away) < tolerance]))) if len(away) else tolerance
    near = np.abs(away) < np.clip(3 * scatter, 0.5 * tolerance, tolerance)
    points = edges.points[near]
    return Outline(
        view=view,
        place=place,
        covariance=_jackknife(view, points, place) + _in_place(_bias_px(edges)),
        points=points,
        coverage=len(np.unique(edges.radius_index[near])) / edges.radii,
        blur_px=edges.blur_px,
        scatter_px=float(np.sqrt(np.mean(away[near] ** 2))) if near.any() else tolerance,
    )


def _bias_px(edges: _Edges) -> float:
    """Return what all edges of an outline may be off together."""
    fading_px = edges.blur_px - edges.sharp_px
    return float(np.linalg.norm([EDGE_BIAS_PX, EDGE_BIAS_SHARE * edges.sharp_px, FADING_BIAS_SHARE * fading_px]))


def _jackknife(view: View, points: FloatArray, place: FloatArray) -> FloatArray:
    """Return the covariance (5, 5) of an outline from fits that leave out one sector each."""
    turn = np.arctan2(points[:, 1] - place[1], points[:, 0] - place[0])
    sector = ((turn + np.pi) / (2 * np.pi) * SECTORS).astype(np.int64) % SECTORS
    used = [n for n in range(SECTORS) if (sector == n).any()]
    if len(used) < 4:
        return _in_place(0.05 * float(place[2]))
    ones = np.ones(len(points))
    fits = np.array([_least_squares(view, points[sector != n], ones[sector != n], place) for n in used])
    away = fits - fits.mean(axis=0)
    covariance: FloatArray = (len(used) - 1) / len(used) * (away.T @ away)
    return covariance


def _in_place(error_px: float) -> FloatArray:
    """Return the covariance (5, 5) of an outline whose centre and radius are uncertain by this much each."""
    return np.diag([error_px**2] * 3 + [0.0, 0.0])
