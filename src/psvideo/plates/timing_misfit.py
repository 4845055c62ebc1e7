"""Whether a timing that was read from a file can be a take's: what ``sync`` writes of the take always can.

A file may be another clip's, or have been edited: a flash that starts in a thousand years makes a run without end, and
a hole behind a frame that is not there is nowhere. Bounds are wide: a fit's own errors and unknown clocks lie within.
"""

from collections.abc import Callable, Iterator

import numpy as np

from psvideo.clip import Take
from psvideo.model.plan import UNKNOWN_CLOCK_PPM
from psvideo.model.timing import Timing, places_in_time
from psvideo.model.units import show_ppm, show_seconds

MOST_OFF_PPM = 2 * UNKNOWN_CLOCK_PPM
"""Twice what clocks of unknown tolerance differ by: no strobe's clock is off by more."""
MOST_OVER = 1.1
"""A fit may find a shutter longer by this factor than the frame period, and tails than a flash: it has errors."""
NEAR_FRAMES = 2
"""Flashes may lie this many frames outside of the clip."""


def misfit(timing: Timing, take: Take) -> str | None:
    """Return why a timing cannot be this take's, None where it can: the first of all reasons, as part of a sentence."""
    return next((wrong for check in CHECKS for wrong in check(timing, take)), None)


def _whose(timing: Timing, take: Take) -> Iterator[str]:
    period_s = take.plan.camera.frame_period_s
    if timing.clip != take.clip.name:
        yield f"is the timing of the clip {timing.clip!r}, and this clip is {take.clip.name!r}"
    if abs(timing.frame_period_s / period_s - 1) > 1e-6:
        yield f"has frames of {timing.frame_period_s:.6g} s, and the plan {period_s:.6g} s"


def _shutter(timing: Timing, take: Take) -> Iterator[str]:
    """Judge what the camera and the LEDs are said to be like."""
    plan, most_s = take.plan, MOST_OVER * timing.frame_period_s
    readout_s = abs(timing.row_time_s) * plan.camera.height_px
    tails_s = MOST_OVER * max(plan.rise_s, plan.fall_s, *(flash.duration_s for flash in plan.flashes))
    frame = f"the frame period of {show_seconds(timing.frame_period_s)}"
    if timing.exposure_s > most_s:
        yield f"key 'exposure_s' is {timing.exposure_s:g}: expected no longer than {frame}"
    if readout_s > most_s:
        yield (
            f"key 'row_time_s' is {timing.row_time_s:g}, so that {plan.camera.height_px} rows take "
            f"{show_seconds(readout_s)}: expected no longer than {frame}"
        )
    for key, tail_s in (("rise_s", timing.rise_s), ("fall_s", timing.fall_s)):
        if tail_s > tails_s:
            yield f"key '{key}' is {tail_s:g}: expected no longer than the plan's longest flash or tail"
    if abs(timing.clock_offset_ppm) > MOST_OFF_PPM:
        yield f"key 'clock_offset_ppm' is {timing.clock_offset_ppm:g}: expected within {show_ppm(MOST_OFF_PPM)} of 0"


def _missing(timing: Timing, take: Take) -> Iterator[str]:
    """Judge where frames are said to be missing. What the numbers do not show is known by flashes on either side."""
    numbers = take.clip.numbers
    following = dict(zip(numbers, (*numbers[1:], numbers[-1] + 1), strict=True))
    seen: set[int] = set()
    most = float(np.ptp(timing.start_s)) / timing.frame_period_s + NEAR_FRAMES if timing.flashes else 0.0
    for n, hole in enumerate(timing.dropped_frames, 1):
        key = f"key 'dropped_frames[{n}].after' is {hole.after}"
        if hole.after not in following:
            yield f"{key}: expected {_numbered(take)}"
            continue
        if hole.after in seen:
            yield f"{key}, as that of another hole: expected each hole once"
        seen.add(hole.after)
        most -= max(hole.count - (following[hole.after] - hole.after - 1), 0)
        if most < 0:
            yield f"key 'dropped_frames[{n}].count' is {hole.count}: expected no more frames than the flashes span"


def _repeated(timing: Timing, take: Take) -> Iterator[str]:
    """Judge which frames are said to show the same moment as those before them."""
    numbers, seen = set(take.clip.numbers), set[int]()
    for n, number in enumerate(timing.repeated_frames, 1):
        key = f"key 'repeated_frames[{n}]' is {number}"
        if number not in numbers:
            yield f"{key}: expected {_numbered(take)}"
        if number in seen:
            yield f"{key}, as another one: expected each frame once"
        seen.add(number)
    if seen >= numbers:
        yield "key 'repeated_frames' lists all of the clip's frames: expected some that are not repeated"


def _numbered(take: Take) -> str:
    numbers = take.clip.numbers
    return f"the number of one of the clip's frames, which are {numbers[0]} to {numbers[-1]}"


def _slots(timing: Timing, take: Take) -> Iterator[str]:
    plan = take.plan
    if [flash.index for flash in timing.flashes] != list(range(len(timing.flashes))):
        yield "its flashes are not numbered 0, 1, 2 and so on without a hole"
    for flash in timing.flashes:
        if flash.slot >= len(plan.flashes) or dict(flash.lights) != dict(plan.flashes[flash.slot].lights):
            yield f"its flash {flash.index} (slot {flash.slot}, {dict(flash.lights)}) is not in the plan's list"


def _durations(timing: Timing, take: Take) -> Iterator[str]:
    """Judge how long flashes last; a synced one ends with its frame's exposure."""
    plan = take.plan
    planned_s = np.array([plan.flashes[flash.slot].duration_s for flash in timing.flashes])
    least_s = np.minimum(planned_s, timing.exposure_s) if plan.mode == "synced" else planned_s
    off = MOST_OFF_PPM * 1e-6
    wrong = (timing.duration_s < (1 - off) * least_s) | (timing.duration_s > (1 + off) * planned_s)
    for n in np.flatnonzero(wrong):
        yield (
            f"key 'flashes[{n + 1}].duration_s' is {timing.duration_s[n]:g}: expected the plan's "
            f"{planned_s[n]:g} s, and no more than {show_ppm(MOST_OFF_PPM)} off"
        )


def _starts(timing: Timing, take: Take) -> Iterator[str]:
    """Judge when flashes start: one after the other, while the clip is exposed."""
    last = max(places_in_time(timing, take.clip.numbers).values())
    near_s = NEAR_FRAMES * timing.frame_period_s
    shutter_s = timing.exposure_s + abs(timing.row_time_s) * take.plan.camera.height_px
    until_s = last * timing.frame_period_s + shutter_s + near_s
    for n in np.flatnonzero((timing.start_s + timing.duration_s < -near_s) | (timing.start_s > until_s)):
        yield (
            f"key 'flashes[{n + 1}].start_s' is {timing.start_s[n]:g}: expected a time while the clip is exposed, "
            f"which is from 0 to {until_s - near_s:.6g} s"
        )
    for n in np.flatnonzero(np.diff(timing.start_s) < 0) + 1:
        yield (
            f"key 'flashes[{n + 1}].start_s' is {timing.start_s[n]:g}, before the flash listed ahead of it: "
            "expected flashes in the order in which they start"
        )


CHECKS: tuple[Callable[[Timing, Take], Iterator[str]], ...] = (
    _whose,
    _shutter,
    _missing,
    _repeated,
    _slots,
    _durations,
    _starts,
)
"""In this order: each relies on what those before it have judged."""
