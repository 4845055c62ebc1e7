"""Frames left out or shown twice in a regular pattern: found by folding a clip to the strobe's cycle.

A movie has no numbering, so one that was conformed (30 to 25 frames a second by leaving frames out, 24 to 60 by
repeating them) shows it only in the picture. Under the right numbering, frames that lie close together within the cycle
look alike, for any subject and any brightness of the lights; under a wrong one they do not. So every regular numbering
is scored by how much neighbours differ once the frames are folded to the cycle (phase dispersion: Stellingwerf 1978;
string length: Dworetsky 1983), and only the few best are worth a fit.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.profiles import Profiles

TWIN, TWIN_RECODED, TWIN_SHARE = 0.02, 0.08, 0.15
"""Frames of the same moment differ by at most this share of the rows' spreads; in a movie that was encoded again by the
second one, if that is at most the third one of what frames that follow one another usually differ by."""
TWIN_GAP = 2.0
"""And only if no others differ by more than that but by less than this many times as much."""
USUAL = 90
"""The percentile that is usual: in a movie that shows every moment four times, three frames of four are repeated."""
NEAR_FRAMES = 0.15
"""Frames so far apart within the cycle count half as much."""
LONGEST_EVERY, MOST_OF = 24, 12
"""One frame missing of this many is still searched for as a pattern; several missing of this many."""
LARGEST_STEP, LARGEST_OF = 4, 5
"""Frames per frame of the clip that are searched for, and of how many frames a pattern may consist beyond two."""

REPEATED_MOST, REPEATED_OF = 5, 6
"""How often one moment may be shown, and the longest such pattern, in frames, other than one repeated frame in many."""
ALIKE = 0.3
"""Frames that a pattern takes for repeated differ by at most this share of what others differ by."""
WORTH = 1.5
"""Numberings that fold this many times worse than the best are not worth a fit."""
LEAST_REGULAR = 3
"""Odd steps between frames from which on they may be called regular."""
BESIDE = 3
"""Neighbours on either side that a folded frame is held against."""
TOGETHER_FRAMES = 30
"""Frames so far apart in time count half as much: subjects move."""


@dataclass(frozen=True, kw_only=True)
class Numbering:
    """How a clip's frames may follow one another: which of them count, ``kept`` (frame,), and where those are in time.

    ``index`` has shape (kept frame,); ``plain`` is what it would be if nothing were missing beyond what the files'
    numbers show and what repeated frames stand for.
    """

    kept: Mask
    index: Integers
    plain: Integers


def twins(rows: Profiles) -> Mask:
    """Return the frames that look like the one before them as only a frame of the same moment does, shape (frame,)."""
    lit = rows.spread > 0.03 * rows.spread.max()
    change = (np.abs(np.diff(rows.value, axis=0)) / rows.spread)[:, lit].mean(axis=1)
    most = float(np.clip(TWIN_SHARE * np.percentile(change, USUAL), TWIN, TWIN_RECODED))
    ordered = np.append(np.sort(change), np.inf)
    few = np.searchsorted(ordered, TWIN)
    wider = np.arange(few, np.searchsorted(ordered, most)) + 1
    gaps = ordered[wider] / ordered[wider - 1]
    if len(wider) and gaps.max() > TWIN_GAP:
        few = wider[int(gaps.argmax())]
    return np.append(False, change < (ordered[few - 1] * (1 + 1e-9) + 1e-12 if few else 0.0))


def as_numbered(rows: Profiles) -> Numbering:
    """Return the numbering of the files."""
    return Numbering(kept=np.ones(len(rows.value), np.bool_), index=rows.index, plain=rows.index)


def stood_in(rows: Profiles, twin: Mask) -> Numbering:
    """Return the numbering in which repeated frames stand in for others that are missing."""
    return Numbering(kept=~twin, index=rows.index[~twin], plain=rows.index[~twin])


def inserted(rows: Profiles, twin: Mask) -> Numbering:
    """Return the numbering in which repeated frames take no time."""
    index = (rows.index - np.cumsum(twin))[~twin]
    return Numbering(kept=~twin, index=index, plain=index)


def regular(base: Numbering, step: Fraction, lead: int) -> Numbering:
    """Return a numbering in which every frame takes ``step`` frames, rounded down; ``lead`` shifts the pattern.

    >>> numbers = np.arange(7)
    >>> plain = Numbering(kept=np.ones(7, bool), index=numbers, plain=numbers)
    >>> regular(plain, Fraction(4, 3), 0).index.tolist(), regular(plain, Fraction(4, 5), 0).index.tolist()
    ([0, 1, 2, 4, 5, 6, 8], [0, 1, 2, 3, 4])
    """
    index = base.index[0] + _places(base.index, base.index[0], step, lead)
    if step > 1:
        return Numbering(kept=base.kept, index=index, plain=base.plain)
    new = np.append(True, np.diff(index) > 0)
    kept = base.kept.copy()
    kept[kept] = new
    return Numbering(kept=kept, index=index[new], plain=index[new])


def _places(index: Integers, first: int, step: Fraction, lead: int) -> Integers:
    places: Integers = ((index - first) * step.numerator + lead) // step.denominator
    return places


def patterns() -> list[tuple[Fraction, int]]:
    """Return every regular pattern that is searched for, as its step and its lead."""
    steps = {Fraction(every + 1, every) for every in range(1, LONGEST_EVERY + 1)}
    steps |= {Fraction(p, q) for q in range(1, MOST_OF + 1) for p in range(q + 1, 2 * q + 1) if gcd(p, q) == 1}
    larger = {Fraction(p, q) for q in range(1, LARGEST_OF + 1) for p in range(2 * q, LARGEST_STEP * q + 1)}
    repeats = {Fraction(every - 1, every) for every in range(2, LONGEST_EVERY + 1)}
    repeats |= {Fraction(p, q) for q in range(2, REPEATED_OF + 1) for p in range(1, q) if REPEATED_MOST * p >= q}
    every_step = sorted({Fraction(1)} | repeats | steps | larger)
    return [(step, lead) for step in every_step for lead in range(step.denominator)]


def regular_numberings(
    plan: Plan, rows: Profiles, base: Numbering, frames: slice, *, range_ppm: float, keep: int
) -> list[Numbering]:
    """Return the regular numberings under which some frames fold to the cycle best, best first.

    ``rows`` are the frames that ``base`` keeps and ``frames`` those of them to fold.
    """
    difference = _differences(rows.take(frames))
    index = base.index[frames]
    cycle_frames = _cycles(plan, rows, index, range_ppm)
    change = np.append(np.inf, np.diagonal(difference, 1))
    scored = []
    for step, lead in patterns():
        place = _places(index, int(base.index[0]), step, lead)
        if step >= 1 or _alike(change, np.append(False, np.diff(place) == 0)):
            scored.append((float(_folded(difference, place, cycle_frames).min()), step, lead))
    best = sorted(scored)[:keep]
    return [regular(base, step, lead) for score, step, lead in best if score < WORTH * best[0][0]]


def _alike(change: Doubles, repeated: Mask) -> bool:
    """Return whether frames that a pattern takes for repeated look it."""
    if not repeated.any() or repeated[1:].all():
        return False
    return float(np.median(change[repeated])) < ALIKE * float(np.median(change[~repeated]))


def fold_frames(plan: Plan, rows: Profiles) -> int:
    """Return how many frames fill the cycle densely."""
    return max(64, int(10 * plan.marker_s / rows.period_s))


def _differences(rows: Profiles) -> Doubles:
    """Return how much every two frames differ, shape (frame, frame)."""
    lit = rows.spread > 0.03 * rows.spread.max()
    value = (rows.value / rows.spread)[:, lit]
    difference: Doubles = np.stack([np.minimum(np.abs(value - one), 2.0).mean(axis=1) for one in value])
    return difference


def _cycles(plan: Plan, rows: Profiles, index: Integers, range_ppm: float) -> Doubles:
    """Return the lengths that a cycle may have, in frames, so close that none slips by more than a quarter flash."""
    shortest_s = plan.shortest_flash_s
    span_s = LARGEST_STEP / 2 * float(index[-1] - index[0] + 1) * rows.period_s
    slips = int(np.ceil(range_ppm * 1e-6 * span_s / (0.5 * shortest_s)))
    rate = 1.0 + np.linspace(-1.0, 1.0, 2 * slips + 1) * range_ppm * 1e-6
    cycles: Doubles = rate * plan.cycle_s / rows.period_s
    return cycles


def _folded(difference: Doubles, place: Integers, cycle_frames: Doubles) -> Doubles:
    """Return the mean difference of neighbours once frames are folded to each of the cycles, shape (cycle,)."""
    phase = place % cycle_frames[:, None]
    order = np.argsort(phase, axis=1)
    sorted_phase = np.take_along_axis(phase, order, axis=1)
    sums = np.zeros((2, len(cycle_frames)))
    for beside in range(1, BESIDE + 1):
        other = np.roll(order, -beside, axis=1)
        gap = (np.roll(sorted_phase, -beside, axis=1) - sorted_phase) % cycle_frames[:, None]
        apart = (gap / NEAR_FRAMES) ** 2 + ((place[order] - place[other]) / TOGETHER_FRAMES) ** 2
        weight = 1.0 / (1.0 + apart)
        sums += (weight * difference[order, other]).sum(axis=1), weight.sum(axis=1)
    mean: Doubles = sums[0] / sums[1]
    return mean


def regular_step(index: Sequence[int] | Integers, numbered: Sequence[int] | Integers) -> Fraction:
    """Return by how many frames a clip goes on per frame of its numbering, where that is regular; 1 elsewhere.

    >>> regular_step([0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13], range(11)), regular_step([0, 1, 2, 3, 5, 6, 7], range(7))
    (Fraction(4, 3), Fraction(1, 1))
    """
    at, numbered_at = np.asarray(index, np.int64), np.asarray(numbered, np.int64)
    odd = int((np.diff(at) != np.diff(numbered_at)).sum())
    mean = float(at[-1] - at[0]) / max(float(numbered_at[-1] - numbered_at[0]), 1.0)
    for q in range(1, LONGEST_EVERY + 1):
        p = round(mean * q)
        if odd >= LEAST_REGULAR and p != q and np.ptp(at * q - numbered_at * p) < q:
            return Fraction(p, q)
    return Fraction(1)
