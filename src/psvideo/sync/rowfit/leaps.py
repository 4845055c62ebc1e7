"""Where frames ahead of those that are known begin to show the strobe elsewhere in its cycle, or no more."""

from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import brightnesses
from psvideo.sync.rowfit.moved_at_breaks import moved
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.strobed import least_frames, shows_strobe
from psvideo.sync.rowfit.tracking.course import window_frames
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, losses_of
from psvideo.sync.rowfit.tracking.misfires import losses_but_for_misfires
from psvideo.sync.rowfit.tracking.steps_ahead import JUMP_COST, MOST

LEAST_AFTER, AFTER = 8, 16
"""Frames after a restart that must show the new phase, and how many are asked."""
PARTS, FINE_PARTS = 3, 24
"""The new phase is looked for in steps of this share of the shortest flash, first all over the cycle, then near."""
WHOLE_FRAMES = 0.125
"""A move that is whole frames to within this share of the shortest flash is frames that are missing."""
MOSTLY = 0.8
"""The strobe may have stopped where this share of the frames after the first odd one are odd."""


def leap(plan: Plan, rows: Profiles, beat: Beat, known: slice, ahead: slice, extra: Integers, sign: int) -> int | None:
    """Return which frame ahead of those that are known is the first after a restart; None where none is.

    ``extra`` (frame,) is by how many frames more than numbered the best course of missing frames puts those ahead
    away; ``sign`` is -1 where these come before the known ones.
    """
    learnt = rows.take(known)
    light = brightnesses(plan, learnt, beat)
    usual = float(np.median(losses_of(plan, learnt, learnt, beat, light)))
    span = slice(ahead.start, min(ahead.stop + AFTER, len(rows.value)))
    if sign < 0:
        span = slice(max(ahead.start - AFTER, 0), ahead.stop)
    asked = rows.take(span).one_window()
    beyond = span.start > 0, span.stop < len(rows.value)
    stayed = losses_but_for_misfires(plan, learnt, asked, beat, light, beyond=beyond)[::sign]
    odd = np.flatnonzero(stayed > usual + SUSPICIOUS)
    if not len(odd) or len(stayed) - int(odd[0]) - 1 < LEAST_AFTER:
        return None
    first = int(odd[0]) + 1
    after = slice(first, first + AFTER) if sign > 0 else slice(max(len(stayed) - first - AFTER, 0), len(stayed) - first)
    shift_s = _likeliest_shift_s(plan, learnt, rows.take(span).take(after).one_window(), beat, light)
    went = losses_of(plan, learnt, moved(asked, shift_s), beat, light)[::sign]
    course = rows.take(ahead).one_window()
    course = replace(course, index=course.index + sign * extra)
    bridged = losses_of(plan, learnt, course, beat, light)[::sign]
    if float(np.median(went[first : first + AFTER])) > usual + SUSPICIOUS:
        anywhere = _least_losses(plan, learnt, rows.take(span).take(after).one_window(), beat, light)
        predicted = float(np.median(anywhere)) < usual + SUSPICIOUS
        return None if predicted else _lost(plan, rows, beat, ahead, sign, bridged > usual + SUSPICIOUS)
    if _whole_frames(plan, rows, beat, shift_s):
        return None
    count = len(extra)
    steps = int((np.diff(extra[::sign], prepend=0) != 0).sum())
    cost = float(bridged.sum()) + JUMP_COST * steps
    here = np.append(0.0, np.cumsum(stayed[:count])) + np.append(np.cumsum(went[:count][::-1])[::-1], 0.0)
    best = int(here.argmin())
    if here[best] + 2 * JUMP_COST > cost:
        return None
    at = ahead.start + best if sign > 0 else ahead.stop - best
    return at if 0 < at < len(rows.value) else None


def _lost(plan: Plan, rows: Profiles, beat: Beat, ahead: slice, sign: int, odd: Mask) -> int | None:
    """Return the first frame ahead from which on the strobe is seen no more; None where it is.

    ``odd`` (frame,) are the frames just ahead that fit no place in time, the nearest first.
    """
    first = int(np.argmax(odd))
    if not odd.any() or odd[first:].mean() < MOSTLY:
        return None
    least, most = least_frames(plan), window_frames(plan)
    at = ahead.start + first if sign > 0 else ahead.stop - first
    asked = slice(at, min(at + most, len(rows.value))) if sign > 0 else slice(max(at - most, 0), at)
    if asked.stop - asked.start < least or shows_strobe(plan, rows.take(asked), beat):
        return None
    return at if 0 < at < len(rows.value) else None


def _likeliest_shift_s(plan: Plan, learnt: Profiles, rows: Profiles, beat: Beat, light: Doubles) -> float:
    """Return by how much frames must come later for known brightnesses to predict them best, within one cycle."""

    def best_s(shifts_s: Doubles) -> float:
        losses = [float(losses_of(plan, learnt, moved(rows, one), beat, light).sum()) for one in shifts_s.tolist()]
        return float(shifts_s[int(np.argmin(losses))])

    shortest_s = plan.shortest_flash_s
    cycle_s = plan.cycle_s * beat.clock.rate
    rough_s = best_s(np.arange(0.0, cycle_s, shortest_s / PARTS))
    return best_s(rough_s + np.arange(-FINE_PARTS, FINE_PARTS + 1) / FINE_PARTS / PARTS * shortest_s)


def _least_losses(plan: Plan, learnt: Profiles, rows: Profiles, beat: Beat, light: Doubles) -> Doubles:
    """Return how badly known brightnesses predict each frame at its best place in the cycle, shape (frame,)."""
    shifts_s = np.arange(0.0, plan.cycle_s * beat.clock.rate, plan.shortest_flash_s / PARTS)
    losses = [losses_of(plan, learnt, moved(rows, one), beat, light) for one in shifts_s.tolist()]
    least: Doubles = np.min(losses, axis=0)
    return least


def _whole_frames(plan: Plan, rows: Profiles, beat: Beat, shift_s: float) -> bool:
    """Return whether frames that are missing (or repeated) explain a shift as well."""
    cycle_s = plan.cycle_s * beat.clock.rate
    frames_s = np.arange(-MOST, 2 * MOST + 1) * rows.period_s
    apart_s = np.abs((shift_s - frames_s + 0.5 * cycle_s) % cycle_s - 0.5 * cycle_s)
    return float(apart_s.min()) < WHOLE_FRAMES * plan.shortest_flash_s
