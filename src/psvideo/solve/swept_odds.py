"""How likely distances are by what they leave of near lights' light, and by where the rest of the picture stands."""

import cv2
import numpy as np
from numpy.typing import NDArray

RATIOS = np.geomspace(0.5, 2.5, 25)
"""Of the plane's distance, 7 % apart; between them a parabola is laid."""
AROUND = 5
"""Costs are averaged over squares of this many points."""
STAY = 0.05
"""The cost of standing off the plane by a factor e, squared; little beside what tells one distance from another."""
LEAST_GAIN = 0.005
"""A distance is taken where its cost is this much below the plane's: about a tenth of a standard error squared."""
FOUND, RELIEF = 0.8, 0.1
"""The prior on distances: this share of the picture lies within about this share of distances that were found, the rest
anywhere."""
DOUBTED = 0.5
"""Where a rig is off, it is asked how unsure a distance is with this share instead: such lamps put the most of a
picture elsewhere, all of it alike."""
PRIOR = 0.5
"""The best distance is taken with so much of that prior's logarithm, in which the plane is as likely as any: several
explain a point that four lights reach, or that lies at an edge, nearly alike. With all of it, what is dim is put where
the most of the picture is."""
SURE = 0.01
"""Better than to this share no distance is known."""


def averaged(planes: NDArray[np.floating], sound: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return costs of single points (ratio, row, col) averaged over neighbours, by how ``sound`` these are."""
    known = np.asarray(cv2.blur(sound, (AROUND, AROUND)), np.float64)
    each = [np.asarray(cv2.blur(plane * sound, (AROUND, AROUND)), np.float64) for plane in planes]
    return np.stack(each) / np.maximum(known, 1e-9)


def best_of(costs: NDArray[np.float64], lights: int, reached: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return the logarithm of the best ratio of every point, by ``costs`` (ratio, row, col) of some lights: 0 where the
    plane is as good. A point is thought to stand where most of those do that are ``reached``, or on the plane."""
    before = np.maximum(_beforehand(_least(costs)[reached], FOUND), _beforehand(np.zeros(1), FOUND))
    return _least(costs - PRIOR / _told(lights) * before)


def unsure_of(
    costs: NDArray[np.float64],
    lights: int,
    taken: NDArray[np.float64],
    reached: NDArray[np.bool_],
    *,
    rig_is_off: bool = False,
) -> NDArray[np.float32]:
    """Return how far off the distance may be that was ``taken``, (row, col), logarithms both: the root mean square of
    how far others lie from it, by how much worse they explain the light."""
    logs = np.log(RATIOS)[:, None, None]
    before = _beforehand(taken[reached], DOUBTED if rig_is_off else FOUND)
    likely = np.exp(before - _told(lights) * (costs - costs.min(axis=0)))
    likely /= likely.sum(axis=0)
    return np.asarray(np.sqrt((likely * (logs - taken) ** 2).sum(axis=0) + SURE**2), np.float32)


def _told(lights: int) -> float:
    """Return by how much the logarithm of the odds falls with a cost. What distances leave of the light is the
    surface's own, and alike in neighbours: a square of points is one measurement per light and point of its width."""
    return 0.5 * lights * AROUND


def _beforehand(found: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return the logarithm of how likely every ratio is before a point's own light is looked at, (ratio, 1, 1): a point
    stands where most of those were ``found`` that are reached, (point,), logarithms, or anywhere: a wall behind the
    subject may be as far as any part of it."""
    near = np.exp(-0.5 * ((found - np.log(RATIOS)[:, None]) / RELIEF) ** 2).mean(axis=1)
    return np.asarray(np.log(share * near + (1 - share) * RELIEF)[:, None, None])


def _least(costs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the logarithm of the best ratio of every point, 0 where the plane is as good."""
    logs = np.log(RATIOS)
    apart = logs[1] - logs[0]
    held = costs + STAY * logs[:, None, None] ** 2 * apart
    place = np.clip(np.argmin(held, axis=0), 1, len(RATIOS) - 2)[None]
    before, here, after = (np.take_along_axis(held, place + shift, axis=0)[0] for shift in (-1, 0, 1))
    bent = np.maximum(before - 2 * here + after, 1e-12)
    found = logs[place[0]] + np.clip(0.5 * (before - after) / bent, -0.5, 0.5) * apart
    plane = held[int(np.argmin(np.abs(logs)))]
    return np.asarray(np.where(plane - here > LEAST_GAIN, found, 0))
