"""Light that every lamp adds, or lacks, alike, as far as albedo that goes with the slope shows it.

Haze and skin add a share of every lamp's light, a lamp that nobody switched off or a black level that is wrong as much
to every plate, or take it away, and clay sends back less of it where it faces the lens. Lamps on a ring about the lens
take that for normals that face the lens more or less, and leave nothing over, however many they are.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles, Floats, Mask
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.robust.reflectance import ROWS, points_at
from psvideo.solve.normals.trust.slope_pairs import LEAST_PAIRS, SlopePairs, of_place, robustly
from psvideo.solve.normals.trust.thin_surface import ThinSurface
from psvideo.solve.normals.trust.unchecked import ALL_EXPLAINED, turned_unseen

SEEN, UNSEEN = 5.0, 10.0
"""Where every lamp adds light alike, normals turn by so many times what all residuals together show of it: up to the
first they show it, from the second on hardly. Lamps that all stand at the same angle to one axis, as on a ring about
the lens, take it for a normal that leans to that axis. (Rings of 4, 6 and 8 lights whose angles differ by 2 degrees:
400, 38 and 22; by 12 degrees, 5 lights: 8, and normals of skin were 6 degrees off. Chance sets of 5 and 8 of
photographs' lights: 7.7 and 3.7 half of the time.)"""
ONE_STRENGTH = 0.02
"""Lamps whose strengths differ by less than this share of their mean are alike."""
FOLLOWED = 0.2
"""Normals that lie farther from what least squares gives than this share of what albedo says follow the subject's
model, which explains such albedo. (Balls of clay 0.3 to 1.1; waves of clay, where a model is found and hardly followed,
0.)"""
MOST_ADDED, NONE_ADDED = 0.5, 1.0
"""Lamps add up to such a share of what they send (wax and skin 0.1 to 0.35, haze up to 0.3), and surely not the second.
What looks like more is paint: where a surface shines alike all over a face of a box, its darker paint turns normals
farther, by 0.4 degrees where albedo differs by 5 %, as if lamps added 7 to 13 times what they send."""
LOOKED_AT = 1000
"""That is looked at in so many points."""
SURE = 3.0
"""Of light that all lamps add counts what is more than so many standard errors."""


class Added(NamedTuple):
    """Light that all lamps add: how ``unseen`` it is by residuals, 0 to 1, and which ``vector`` (3,) lamps take it for
    beside a normal, where every lamp adds, or the mean lamp, as much as it sends to a surface that faces it."""

    unseen: float
    vector: Doubles


def added_unseen(lit: Illumination) -> tuple[Added, ...]:
    """Return which light residuals of four lights and more hardly show: that of which each lamp adds the same share of
    its own, and, where strengths differ, that which is the same in every plate. None of three, which leave nothing
    over, whatever it is, and what albedo shows of it was measured as a whole."""
    if len(lit.directions) <= ALL_EXPLAINED:
        return ()
    strengths = lit.intensities.mean(axis=1) / lit.intensities.mean()
    shares = [np.ones(len(strengths))]
    if np.ptp(strengths) > ONE_STRENGTH:
        shares.append(1 / strengths)
    inverse, found = np.linalg.pinv(lit.directions), list[Added]()
    for each in shares:
        turned = turned_unseen(lit, shares=tuple(each.tolist()))
        unseen = min(max((turned - SEEN) / (UNSEEN - SEEN), 0.0), 1.0)
        if unseen:
            found.append(Added(unseen, inverse @ each))
    return tuple(found)


def turned_by_added_deg(
    points: ThinSurface, pairs: SlopePairs, added: Sequence[Added], *, modelled_deg: float = 0.0
) -> Floats:
    """Return by how many degrees light turns every normal that all lamps add alike, (row, col): as much of it as makes
    albedo differ as it does, of the kind that turns it most. It stretches normals that lean to its vector, and turns
    those that do not. Light that is missing makes albedo go the other way; where a model of the subject turned normals
    by ``modelled_deg``, it explains such albedo."""
    most = np.zeros(points.known.shape, np.float32)
    for unseen, vector in added:
        much = _surely(pairs, (pairs.there - pairs.here) @ vector)
        believed = _believed(much)
        along = np.tensordot(vector.astype(np.float32), points.planes, axes=1)
        across = np.sqrt(np.maximum(np.float32(vector @ vector) - along * along, np.float32(0)))
        turned = np.degrees(np.float32(unseen * believed * abs(much))) * across
        if much < 0 and modelled_deg:
            said = FOLLOWED * median(turned[points.known])
            turned *= np.float32(max(1 - modelled_deg / max(said, 1e-6), 0.0))
        if believed < 1 and not modelled_deg:  # a model parts its paints by itself
            turned += np.float32(unseen * (1 - believed) * turned_by_paint_deg(pairs))
        most = np.maximum(most, turned)
    return np.asarray(most, np.float32)


def modelled_deg(points: ThinSurface, one: Evidence, known: Mask) -> float:
    """Return by how many degrees a model of the subject turned typical normals from what least squares gives, where all
    lamps shine on ``known`` points (row, col); 0 where there is no model, or nothing to compare with."""
    misfit = points.surface.misfit
    if misfit is None or misfit.reflectance is None or not known.any():
        return 0.0
    rows = np.flatnonzero(known.any(axis=1))
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, ROWS).astype(np.intp))]
    where, cols = np.nonzero(known[rows])
    chosen = np.linspace(0, len(where) - 1, min(LOOKED_AT, len(where))).astype(np.intp)
    here = rows[where[chosen]], cols[chosen]
    found = points_at(
        one.plates, one.lit, (here[0] * points.step, here[1] * points.step), one.usable,
        points.surface.normals[here].astype(np.float64),
        seen=one.seen, black_level=one.black_level, scale=one.scale,
    )  # fmt: skip
    lit = found.counts.all(axis=0)
    if not lit.any():
        return 0.0
    towards, measured = np.moveaxis(found.towards[:, lit], 1, 0), found.measured[:, lit].T
    plain = (np.linalg.pinv(towards) @ measured[..., None])[..., 0]
    cosines = (plain * found.normals[lit]).sum(axis=1) / np.maximum(np.linalg.norm(plain, axis=1), 1e-12)
    return float(np.degrees(median(np.arccos(np.clip(cosines, -1, 1)))))


def turned_by_paint_deg(pairs: SlopePairs) -> float:
    """Return by how many degrees what a surface mirrors, the same on every paint, turns its normals: it turns the less
    bright ones more, by the whole of it where albedo is e times less. (Faces of painted boxes with broad and narrow
    sheens, under four lights: 1.1 to 9 degrees, in truth 0.7 to 5.)"""
    albedo = pairs.differs
    along = ((pairs.there - pairs.here) * albedo[:, None]).sum(axis=0) / max(float((albedo**2).sum()), 1e-12)
    return float(np.degrees(np.linalg.norm(along)))


def _believed(much: float) -> float:
    """Return how far light that is so much of what lamps send is light that they add, 0 to 1.

    >>> _believed(0.3), _believed(-0.75), _believed(7.8)
    (1.0, 0.5, 0.0)
    """
    return min(max((NONE_ADDED - abs(much)) / (NONE_ADDED - MOST_ADDED), 0.0), 1.0)


def _surely(pairs: SlopePairs, stretches: Doubles) -> float:
    """Return how many times by what ``stretches`` normals (pair,) albedo differs, as far as the quarters of the subject
    agree on it: each by what its place leaves of that, since paint in large soft blobs goes with the slope and the
    place of one quarter or another, and by the whole of it, whichever is less. Of a ball place leaves little, which a
    surface that is not matte, or a wrong rig, shows in a way of its own."""
    low, right = (pairs.place > np.median(pairs.place, axis=0)).T
    quarters = (low & right, low & ~right, ~low & right, ~low & ~right)
    if min(np.count_nonzero(one) for one in quarters) < LEAST_PAIRS / 8:
        return 0.0
    moves = of_place(pairs.other) - of_place(pairs.place)
    beside, whole = (_agreed(pairs, stretches, each, quarters) for each in (moves, moves[:, :0]))
    return float(np.clip(whole, min(beside, 0.0), max(beside, 0.0)))


def _agreed(pairs: SlopePairs, stretches: Doubles, moves: Doubles, quarters: Sequence[Mask]) -> float:
    """Return the same in the mean of quarters, nearer to nothing by SURE standard errors, where albedo may go with what
    ``moves`` (pair, any) as well."""
    found = list[tuple[float, float]]()
    for one in quarters:
        numbers, weights = robustly(np.concatenate([stretches[one, None], moves[one]], axis=1), pairs.differs[one])
        root = np.sqrt(weights)
        weighed, own = moves[one] * root[:, None], stretches[one] * root
        left = own - weighed @ np.linalg.lstsq(weighed, own, rcond=None)[0]
        found.append((float(numbers[0]), float((left**2).sum())))
    each, counts = np.array(found).T
    counts /= max(float(counts.sum()), 1e-12)
    mean = float((counts * each).sum())
    error = SURE * float(np.sqrt(len(each) / (len(each) - 1) * ((counts * (each - mean)) ** 2).sum()))
    return mean - float(np.clip(mean, -error, error))
