"""What is left over comes of, under four to eight lights: a reflectance of the subject, or lights that are off.

Four and five lights are too few to solve by a model of the reflectance: every model explains too much, a sheen passes
for a turned normal, and a turned normal for a sheen. But by how much the model that fits all of the subject would turn
normals says how far they may be off. And where a model, or a rig that is off, leaves next to nothing of what lights
leave over, that is known to be the cause: normals are off by what it turns them (``rig_spread``), and not by what is
typical of a residual as large.
"""

from dataclasses import replace
from typing import NamedTuple, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.model.arrays import Doubles, Floats, Mask
from psvideo.model.surface import Surface
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.robust.reflectance import FEWEST, ROWS, points_at
from psvideo.solve.normals.robust.reflectance_fit import (
    FOR_SHINE,
    LEAST_EXPLAINED,
    LEAST_ROUGH,
    LEAST_SOFT,
    MUCH_LESS_LEFT,
)
from psvideo.solve.normals.robust.reflectance_model import ROUGH, SOFT, Kind, Sought, alternated, explained_evenly
from psvideo.solve.normals.robust.subject_points import LEAST_POINTS, SubjectPoints, sizes_of
from psvideo.solve.normals.trust.by_other_rig import LeftOver, other_rig
from psvideo.solve.normals.trust.rig_spread import turned_by_rig_deg

FEWEST_LIGHTS, MOST_LIGHTS = 4, 8
"""Three lights leave nothing that a model could explain; under more than the second number what each is off by averages
out."""
SHADOWED = 0.2
"""Below this share of the point's mean, light may come from neighbouring surfaces."""
LEAST_EVENLY = 0.05
"""Of what four lights leave of a matte subject a model explains up to 0.03 where all measurements count alike, though
up to 0.9 of what its weights leave; of what shines a little 0.1, and much 0.5 to 0.9."""
ENOUGH_LESS = 0.3
"""Where softness leaves MUCH_LESS_LEFT over 1 and this of what others leave, it counts wholly."""
LESS_EVENLY, CLEARLY_EVENLY = 0.96, 0.06
"""So much less than the others must softness leave where all measurements count alike, and counts wholly over 1 and the
second of it: what fits by the weights of one fit alone is a sheen on a subject that moves."""
AS_RIG, THAN_RIG, LEAST_BY_RIG = 1.2, 2.0, 0.003
"""A model counts wholly where it leaves up to so many times what other lights would, and not at all from the second
number on; these leave the third share at least, as noise does. Of wax and clay a model leaves 0.02 to 1.3 times as
much, of what shines under a right rig 0.01 to 1.2; of what is matte, under lights 2 and 5 degrees off, 3 to 40 times,
though it explains two thirds: lights nearly on a ring can hardly tell softness, and a little of a rig passes for much
of it."""
TURNS = 2
"""How often model and normals follow each other: four times cost twice as much and say the same."""
LEAST_LEFT = 0.01
"""No surface follows a model better than to this share of its albedo: fitted to less, models turned normals the more,
the less noise there was."""
AROUND = 0.07
"""Angles are means around a point, Gaussian of this standard deviation, as a share of the subject's size."""
CLEAR, CLEARLY_LEFT, MOST_NOISE = 0.12, 3.0, 0.5
"""What leaves up to this share where all measurements count alike is wholly the cause of what is left over, and none
where it leaves so many times as much; beside noise, which is known no better than to a fifth and taken off up to the
third."""
SURE_UNDER_FOUR = 0.7
"""Four lights show three numbers of their rig's twelve: what others explain is known to be their doing by so much.
Wholly, of photographs under four a sphere claimed 2 times, and a rendered bunny half of what is true."""
FAR = 1e-3
"""Where points are farther than that, the mean of all of them counts, as this much of one."""


class Turned(NamedTuple):
    """What models of the subject and other lights say, at points or around those of a grid: by how many degrees a model
    would turn the normals, ``by_model_deg``, though it need not be right; and how far what is left over is
    ``explained``, 0 to 1, by what turns normals ``by_cause_deg``: by lights that are off if ``by_rig``."""

    by_model_deg: Floats
    explained: float
    by_cause_deg: Floats
    by_rig: bool


def turned_by_causes(thin: Surface, step: int, one: Evidence, known: Mask, *, of_noise: float = 0.0) -> Turned | None:
    """Return what turns the normals around every point of every ``step``-th row and column, of which ``thin`` is the
    surface, (row, col); None where the lights are too many or too few, or the points, or normals follow a model
    already. ``known``: (row, col), the points that speak for the subject; noise makes the share ``of_noise`` of the
    squares of what is left over."""
    solved_by_it = thin.misfit is not None and thin.misfit.reflectance is not None
    if solved_by_it or not FEWEST_LIGHTS <= len(one.plates) <= MOST_LIGHTS:
        return None
    rows = np.flatnonzero(known.any(axis=1))
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, ROWS).astype(np.intp))] if len(rows) else rows
    where, cols = np.nonzero(known[rows])
    if len(where) < LEAST_POINTS:
        return None
    chosen = np.linspace(0, len(where) - 1, min(FEWEST, len(where))).astype(np.intp)
    here = rows[where[chosen]], cols[chosen]
    at = here[0] * step, here[1] * step
    usable = replace(one.usable, shadow_ratio=max(SHADOWED, one.usable.shadow_ratio))
    normals = thin.normals[here].astype(np.float64)
    points = points_at(
        one.plates, one.lit, at, usable, normals, seen=one.seen, black_level=one.black_level, scale=one.scale
    )
    sizes = sizes_of(points)
    some = sizes > 0
    if np.count_nonzero(some) < LEAST_POINTS:
        return None
    seen = points.only(some), points.normals[some] * sizes[some, None]
    turned = causes(*seen, of_noise=of_noise, distant=one.lit.near is None)
    angles = np.stack([turned.by_model_deg, turned.by_cause_deg], axis=-1).astype(np.float64)
    around = _around(known.shape, (here[0][some], here[1][some]), angles, int(known.sum()))
    return Turned(around[..., 0], turned.explained, around[..., 1], turned.by_rig)


def causes(points: SubjectPoints, g: Doubles, *, of_noise: float = 0.0, distant: bool = True) -> Turned:
    """Return what turns the normals of points, given times albedo (point, 3); noise makes the share ``of_noise`` of the
    squares of what is left over. Where lights are not ``distant`` the rig is no cause: distances that are off look as
    it does.

    By a model: one that shines, is rough or soft, whichever turns them most. A model that explains LEAST_EVENLY counts
    nothing, one that explains twice as much wholly: what comes and goes by its noise would flicker. Nor does one count
    where lights that stand a little otherwise would explain far more. Of so many lights that normals are solved by
    models, none is looked for.

    By a cause: a model or lights that are off, of those that leave next to nothing the one that turns them most.
    """
    sizes, most = np.linalg.norm(g, axis=1), np.zeros(len(g))
    typical, rig = median(sizes), other_rig(points, g)
    by_rig = explained = _clearly(rig.left, of_noise) * _sure_of_rig(len(points.measured)) if distant else 0.0
    by_cause = np.zeros(len(g))
    if explained:
        by_cause = explained * turned_by_rig_deg(points, g / sizes[:, None], rig)
    others = LeftOver(1.0, 1.0)
    for kind in get_args(Kind) if len(points.measured) < FOR_SHINE else ():
        one = alternated(points, g, typical, Sought(kind, least_left=LEAST_LEFT), turns=TURNS, least=LEAST_EXPLAINED)
        evenly = explained_evenly(points, g, typical, one.model)
        left = LeftOver(1 - one.explained, 1 - evenly)
        holds = _beyond(evenly, LEAST_EVENLY) * beside_rig(left, rig.left)
        holds *= _beyond(float(one.model[ROUGH]), LEAST_ROUGH) if kind == "rough" else 1.0
        if kind == "soft":  # the last: it must leave much less than the others, or lights that are off look like it
            holds *= _beyond(float(one.model[SOFT]), LEAST_SOFT) * much_less_left(left, others)
        others = LeftOver(min(left.weighted, others.weighted), min(left.evenly, others.evenly))
        cosines = (one.g * g).sum(axis=1) / np.maximum(np.linalg.norm(one.g, axis=1) * sizes, 1e-12)
        turned = np.degrees(np.arccos(np.clip(cosines, -1, 1)))
        most = np.maximum(most, holds * turned)
        clearly = holds * _clearly(left, of_noise)
        explained, by_cause = max(explained, clearly), np.maximum(by_cause, clearly * turned)
    by_cause /= max(explained, 1e-9)
    return Turned(most.astype(np.float32), explained, by_cause.astype(np.float32), by_rig == explained > 0)


def _sure_of_rig(lights: int) -> float:
    return SURE_UNDER_FOUR if lights == FEWEST_LIGHTS else 1.0


def _clearly(left: LeftOver, of_noise: float) -> float:
    """Return how far something that leaves so much is the cause of what is left over beside noise, 0 to 1.

    >>> _clearly(LeftOver(0.01, 0.1), 0.0), _clearly(LeftOver(0.01, 0.2), 0.1), _clearly(LeftOver(0.01, 0.36), 0.0)
    (1.0, 1.0, 0.0)
    """
    most_noise = min(of_noise, MOST_NOISE)
    times = (max(left.weighted, left.evenly) - most_noise) / (1 - most_noise) / CLEAR
    return min(max((CLEARLY_LEFT - times) / (CLEARLY_LEFT - 1), 0.0), 1.0)


def much_less_left(soft: LeftOver, others: LeftOver) -> float:
    """Return how surely softness leaves less than the best of the other kinds, 0 to 1: much less by its weights, and
    less where all measurements count alike.

    >>> much_less_left(LeftOver(0.27, 0.84), LeftOver(0.64, 0.87))
    0.0
    >>> much_less_left(LeftOver(0.1, 0.2), LeftOver(0.5, 0.6))
    1.0
    """
    weighted = _beyond(MUCH_LESS_LEFT * others.weighted / max(soft.weighted, 1e-9), 1.0) / ENOUGH_LESS
    evenly = _beyond(LESS_EVENLY * others.evenly / max(soft.evenly, 1e-9), 1.0) / CLEARLY_EVENLY
    return min(weighted, 1.0) * min(evenly, 1.0)


def beside_rig(left: LeftOver, by_rig: LeftOver) -> float:
    """Return how far a model counts beside lights that stand otherwise, 0 to 1, by what either leaves.

    >>> beside_rig(LeftOver(0.22, 0.36), LeftOver(0.03, 0.05)), beside_rig(LeftOver(0.04, 0.06), LeftOver(0.06, 0.08))
    (0.0, 1.0)
    """
    times = max(one / max(other, LEAST_BY_RIG) for one, other in zip(left, by_rig, strict=True))
    return min(max((THAN_RIG - times) / (THAN_RIG - AS_RIG), 0.0), 1.0)


def _beyond(value: float, least: float) -> float:
    """Return 0 up to the least value, and 1 from twice as much on."""
    return min(max(value / least - 1, 0.0), 1.0)


def _around(
    shape: tuple[int, ...], at: tuple[NDArray[np.intp], NDArray[np.intp]], angles_deg: Doubles, points: int
) -> Floats:
    """Return the means of angles (point, which) at rows and columns around every point of a grid, (row, col, which)."""
    planes = np.zeros((*shape, angles_deg.shape[1] + 1), np.float32)
    planes[at] = np.concatenate([angles_deg, np.ones((len(angles_deg), 1))], axis=-1)
    width = int(AROUND * np.sqrt(6 * points)) // 2 * 2 + 1  # twice over squares this wide is nearly Gaussian
    for _ in range(2):
        planes = np.asarray(cv2.blur(planes, (width, width), borderType=cv2.BORDER_CONSTANT), np.float32)
    planes *= np.float32(width**2)
    common = (FAR * angles_deg.mean(axis=0)).astype(np.float32)
    return np.asarray((planes[..., :-1] + common) / (planes[..., -1:] + np.float32(FAR)), np.float32)
