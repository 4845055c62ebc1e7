"""Light that ends at one level below the largest code: there the sensor saturates, and the plan does not say so.

Logarithmic curves and PQ reach beyond what any sensor records, so that a clipped sample is no largest code. Where
``white_level`` says which code it is, it is known as clipped; where nothing says so, it passes for a measurement.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.record import Clip
from psvideo.clip.transfer import DISPLAYED, find_curve
from psvideo.model.rows.clipping import SATURATED

ROUNDS, LEAST_FRAMES, MOST_FRAMES = 2, 12, 32
"""Frames that follow each other are looked at, and show every light."""
SAMPLES = 40_000
NEAR, BELOW, OVERSHOOT = 0.03, 0.09, 0.15
"""A level that is clipped comes out no further than the first share of it through codes; compression lets some samples
shoot over, up to the third. The band up to the second lies below it, and is as wide."""
MOST_ABOVE = 0.5
"""Samples above the level, as a share of those at it: what compression lets shoot over."""
LEAST_SHARE, HEAPED = 0.01, 1.5
"""A frame's samples that lie at the level, and how many times as many there are as in the band below: of a uniform
sphere hardly more, and only of a flat uniform surface, or by clipping, as many."""
LEVEL = 0.02
"""Flat surfaces are as bright as their lights; clipped ones are alike under all, within two codes of 10 bits."""
ALONE = 2.4
"""One light's flash shows in two frames. A level that shows in this many frames a round is that of several lights."""
DIMMEST = 0.05
"""Of samples at the level, this share is darker than the code that is advised, so that the others count as clipped."""


@dataclass(frozen=True, kw_only=True)
class Heap:
    """The light at which a frame's brightest samples heap up, the dimmest of them, and which share they are."""

    level: float
    dimmest: float
    share: float


@dataclass(frozen=True, kw_only=True)
class HiddenLevel:
    """A level at which frames end: the light of its dimmest samples, and the largest share of a frame that is there."""

    dimmest: float
    share: float


def may_hide(clip: Clip) -> bool:
    """Return whether a clip's sensor may saturate below the largest code, at one that the plan does not name."""
    encoding = clip.plan.camera.encoding
    name = find_curve(encoding.transfer).name
    records = name == "st2084" or name not in DISPLAYED
    return records and encoding.white_level is None and clip.header.bits is not None


def may_lie_below(clip: Clip) -> bool:
    """Return whether a clip's codes may all stand for less than no light: a logarithm's black lies far above code 0."""
    return clip.header.bits is not None and find_curve(clip.plan.camera.encoding.transfer).name not in DISPLAYED


def numbers_to_look_at(clip: Clip, numbers: Sequence[int]) -> tuple[int, ...]:
    """Return which of a clip's frames to look at, from the middle of those that are used."""
    plan = clip.plan
    round_s = plan.cycle_s / len(plan.dark_rounds)
    count = min(max(math.ceil(ROUNDS * round_s / plan.camera.frame_period_s), LEAST_FRAMES), MOST_FRAMES)
    first = max((len(numbers) - count) // 2, 0)
    return tuple(numbers[first : first + count])


def hidden_level(thin: Sequence[NDArray[np.float32]], clip: Clip) -> HiddenLevel | None:
    """Return the level at which frames, of each its ``rising_samples``, end below saturation; None where not."""
    top = max((float(one[int(0.999 * one.size)]) for one in thin), default=0.0)
    places = np.linspace(1 - OVERSHOOT, 1, 16) * top
    level = max(places, key=lambda place: sum(_heaped(one, place)[1] - _heaped(one, place)[0] for one in thin))
    heaps = [heap for one in thin if (heap := _heap(one, float(level)))]
    if level >= SATURATED or len(heaps) * len(clip.plan.flashes) < ALONE * len(thin) or not heaps:
        return None
    levels = [heap.level for heap in heaps]
    if max(levels) > (1 + LEVEL) * min(levels):
        return None
    return HiddenLevel(dimmest=min(heap.dimmest for heap in heaps), share=max(heap.share for heap in heaps))


def rising_samples(frame: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return some samples of a frame, linear light by the clip's plan, in rising order: as many as are looked at, by
    their brightest channel."""
    step = max(round((frame.shape[0] * frame.shape[1] / SAMPLES) ** 0.5), 1)
    some = np.nan_to_num(frame[::step, ::step], nan=0.0)
    return np.sort((some.max(axis=-1) if some.ndim == 3 else some).ravel())


def _heaped(rising: NDArray[np.float32], level: float) -> tuple[int, int, int]:
    """Return how many of a frame's samples lie below a level, at it, and above."""
    ends = np.searchsorted(rising, [level * (1 - BELOW), level * (1 - NEAR), level * (1 + NEAR)])
    return int(ends[1] - ends[0]), int(ends[2] - ends[1]), int(rising.size - ends[2])


def _heap(rising: NDArray[np.float32], level: float) -> Heap | None:
    """Return how a frame's samples heap up at a level; None where they do not."""
    below, count, above = _heaped(rising, level)
    share = count / rising.size
    if share < LEAST_SHARE or count < HEAPED * below or above > MOST_ABOVE * count:
        return None
    at = rising[rising.size - above - count : rising.size - above]
    return Heap(level=float(np.median(at)), dimmest=float(np.quantile(at, DIMMEST)), share=share)
