"""The outline that most of a sphere's rim agrees on, with its uncertainty, from pictures taken together.

Every spoke says how likely each place of the rim is on it (``rim_spokes``). The outline is the one that is likeliest
over all spokes, looked for from coarse to fine: first a mirror that shows nothing within its rim; where too few spokes
agree with it, one that mirrors the room there, from the first one's place and from a larger circle, as mirrored edges
lie inside the rim and never outside. The uncertainty is how far outlines that are nearly as likely lie apart, how far
the other model of the rim (``rim_model``) lies off, and what all edges may be off together.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.special import ndtri
from scipy.stats.qmc import Sobol

from psvideo.calibrate.sphere.rim_model import Surface
from psvideo.calibrate.sphere.rim_spokes import Spokes, agreeing, looked_up, spokes_of, widened
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.model.arrays import Doubles, Floats

USUAL_STRETCH = 0.005
"""How far from a circle an outline is expected to be where perspective is unknown (a sphere 8 degrees off the axis)."""
COARSE = ((0.08, 8.0), (0.03, 5.0))
FINE = (0.012, 3.0)
"""How far from the expected outline the rim is looked for, round by round: as a share of the radius, in pixels."""
COARSE_SPOKES = 64
COARSE_BLURS_PX = (0.8, 1.5, 2.7)
CLEAR = 0.9
"""Where this share of the spokes agrees with a mirror that shows nothing within its rim, no other is looked for. (Of 39
virtual balls in rooms 6 reach it, all within 1.1 pixels; so does the photographed one of psbox.)"""
WIDE, LARGER = (0.05, 6.0, 30.0), (1.0, 1.08)
"""How far from a rough outline the rim of a mirror in a room is looked for: as a share of the radius, in pixels at
least and at most; and from which multiples of the rough radius."""
SECTORS = 12
"""All spokes count as this many: what misleads one misleads its neighbours."""
DRAWS, ROUNDS = 2048, 4
"""This many outlines are drawn to see how far likely ones lie apart, in this many rounds, each about the last one's."""
FOLLOWED = 0.6
"""Share of the spokes that must agree on an outline that moved since the first picture."""
BIAS_PX, BIAS_PER_BLUR = 0.25, 0.1
"""What an outline may be off in x, y and radius in any case, and per pixel of blur: near its rim a ball mirrors what is
behind it, and a horizon there passes for the rim on all of one side. (23 balls in rooms with floors, ceilings and
windows, radius 40 to 90 pixels: 70 % of the numbers are within the claim and 91 % within twice; 0.1: 62 and 83 %.)"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Rim:
    """An outline (5,) with covariance (5, 5); the spokes' points that agree (point, 2), their share of all spokes;
    ``blur_px`` is the standard deviation of the edge's blur."""

    place: Doubles
    covariance: Doubles
    points: Doubles
    coverage: float
    evidence: float
    blur_px: float


@dataclass(frozen=True, kw_only=True, eq=False)
class RoughOutline:
    """Roughly an outline (5,), the share of spokes that agree with it, and how much likelier they make it than chance
    (natural logarithm)."""

    place: Doubles
    coverage: float
    evidence: float


def seek_rim(
    pictures: Sequence[Floats], view: SphereView, around: Doubles, *, surface: Surface = "mirror"
) -> RoughOutline | None:
    """Return roughly the outline near an expected one (5,), from few spokes; None where none is near it."""
    place = around
    for share, least_px in COARSE:
        most_px = float(np.ceil(max(share * place[2], least_px)))
        spokes = spokes_of(pictures, view, place, surface, most_px, most_spokes=COARSE_SPOKES, blurs=COARSE_BLURS_PX)
        place = _likeliest(spokes, view.unknowns)
        if not _sensible(place, around):
            return None
    agree, evidence = agreeing(spokes, place, view.unknowns)
    return RoughOutline(
        place=place, coverage=float(agree.mean()), evidence=evidence * float(place[2]) / len(spokes.odds)
    )


def fit_rim(
    pictures: Sequence[Floats], view: SphereView, around: Doubles, *, surface: Surface = "mirror"
) -> Rim | None:
    """Return the outline within a few pixels of an expected one (5,); None where it is not there."""
    spokes = spokes_of(pictures, view, around, surface, _fine_px(around))
    place = _likeliest(spokes, view.unknowns)
    # in a single picture an edge of the room and the rim look alike: only other lights change the one and not the other
    in_rooms = surface == "mirror" and len(pictures) > 1
    if in_rooms and agreeing(spokes, place, view.unknowns)[0].mean() < CLEAR:
        near = _in_a_room(pictures, view, around)
        if near is None:
            return None
        around = near
        spokes = spokes_of(pictures, view, around, surface, _fine_px(around), mirrored=True)
        place = _likeliest(spokes, view.unknowns)
    return _measured(pictures, view, spokes, place, surface) if _sensible(place, around) else None


def follow_rim(pictures: Sequence[Floats], view: SphereView, around: Doubles) -> Doubles | None:
    """Return where a mirror's outline (5,), known from other pictures, is in these; None where too little shows."""
    for mirrored in (False, True):
        spokes = spokes_of(pictures, view, around, "mirror", _fine_px(around), mirrored=mirrored)
        place = _likeliest(spokes, view.unknowns, coarse=False)
        share = agreeing(spokes, place, view.unknowns)[0].mean()
        if share >= CLEAR or len(pictures) == 1:
            break
    return place if _sensible(place, around) and share >= FOLLOWED else None


def _in_a_room(pictures: Sequence[Floats], view: SphereView, around: Doubles) -> Doubles | None:
    """Return roughly the outline of a mirror near an expected one where the room is mirrored within its rim."""
    share, least_px, largest_px = WIDE
    most_px = float(np.ceil(np.clip(share * around[2], least_px, largest_px)))
    found: list[tuple[float, Doubles]] = []
    for larger in LARGER:
        place = around * np.array([1, 1, larger, 1, 1])
        for _ in range(2):
            spokes = spokes_of(pictures, view, place, "mirror", most_px, most_spokes=COARSE_SPOKES, mirrored=True)
            place = _likeliest(spokes, view.unknowns)
        if _sensible(place, around):
            spread = float(agreeing(spokes, place, view.unknowns)[1]) / len(spokes.odds)
            found.append((spread - _unusual(place) / SECTORS, place))
    return max(found, key=lambda one: one[0])[1] if found else None


def _unusual(place: Doubles) -> float:
    """Return how unlikely an outline's stretch is by itself (natural logarithm)."""
    stretch = place[3:] / USUAL_STRETCH
    return float(0.5 * (stretch @ stretch))


def _fine_px(around: Doubles) -> float:
    return float(np.ceil(max(FINE[0] * around[2], FINE[1])))


def _sensible(place: Doubles, around: Doubles) -> bool:
    return bool(place[2] > 3 and np.abs(place - around)[:3].max() < 0.25 * around[2])


def _likeliest(spokes: Spokes, free: int, *, coarse: bool = True) -> Doubles:
    """Return the outline at which the spokes' odds are highest, looked for from coarse to fine."""
    scale = np.array([1, 1, 1, 2e-3, 2e-3])[:free]
    found = np.zeros(free)
    for width_px in (spokes.most_px / 2, spokes.most_px / 6, 0.0) if coarse else (0.0,):
        odds = widened(spokes.odds, width_px)
        first, exact = max(width_px / 3, 0.3), max(width_px / 50, 2e-3)

        def unlikely(moved: Doubles, odds: Doubles = odds) -> float:
            step = moved * scale
            place = spokes.around.copy()
            place[:free] += step
            return float(_unusual(place) - looked_up(odds, spokes.slopes @ step, spokes.most_px).sum())

        simplex = np.vstack([found, found + first * np.eye(free)])
        options = {"xatol": exact, "fatol": exact, "maxiter": 1200, "initial_simplex": simplex}
        found = minimize(unlikely, found, method="Nelder-Mead", options=options).x  # type: ignore[no-untyped-call]
    return np.concatenate([spokes.around[:free] + found * scale, spokes.around[free:]])


def _measured(pictures: Sequence[Floats], view: SphereView, spokes: Spokes, place: Doubles, surface: Surface) -> Rim:
    """Return an outline with what agrees with it and its uncertainty."""
    free = view.unknowns
    agree, evidence = agreeing(spokes, place, free)
    other: Surface = "matte" if surface == "mirror" else "mirror"
    doubt = _likeliest(spokes_of(pictures, view, place, other, spokes.most_px), free, coarse=False) - place
    bias_px = float(np.hypot(BIAS_PX, BIAS_PER_BLUR * spokes.blur_px))
    return Rim(
        place=place,
        covariance=_likely_apart(spokes, place, free)
        + np.diag(np.minimum(doubt**2, 9.0))
        + np.diag([bias_px**2] * 3 + [0.0, 0.0]),
        points=view.curve(place, len(agree))[agree],
        coverage=float(agree.mean()),
        evidence=evidence,
        blur_px=spokes.blur_px,
    )


def _likely_apart(spokes: Spokes, place: Doubles, free: int) -> Doubles:
    """Return the covariance (5, 5) of outlines by how likely they are, by importance sampling about the likeliest."""
    normal = np.asarray(ndtri(Sobol(free, rng=np.random.default_rng(0)).random(DRAWS)), np.float64)
    scale = np.array([1, 1, 1, 2e-3, 2e-3])[:free]
    covariance, middle = np.diag(scale**2), place[:free]
    for _ in range(ROUNDS):
        # wider than what is looked for, so that what lies far off is seen as well
        root = np.linalg.cholesky(2 * covariance + np.diag((0.05 * scale) ** 2))
        drawn = middle + normal @ root.T
        at = (drawn - spokes.around[:free]) @ spokes.slopes.T
        odds = looked_up(spokes.odds, at, spokes.most_px).sum(axis=1) * SECTORS / len(spokes.odds)
        places = np.zeros((DRAWS, 5))
        places[:, :free] = drawn
        odds -= [_unusual(one) for one in places]
        odds += 0.5 * (normal**2).sum(axis=1)
        share = np.exp(odds - odds.max())
        share /= share.sum()
        middle = share @ drawn
        covariance = (share[:, None] * (drawn - middle)).T @ (drawn - middle)
    away = middle - place[:free]
    whole = np.zeros((5, 5))
    whole[:free, :free] = covariance + np.outer(away, away)
    return whole
