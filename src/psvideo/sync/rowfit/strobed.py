"""Whether frames show the plan's strobe at all, at any place in its cycle, or another picture.

A subject that moves spoils what brightnesses predict, but not where flashes split the rows: under the strobe one
phase leaves clearly less than others do, with brightnesses fitted to the very frames that are asked. Without a strobe
all phases leave alike, and as much as chance lets them.
"""

from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.course import TRACK_ROWS, window_frames

EXPLAINED = 0.5
"""Frames show the strobe where it explains this share of their rows' changes,"""
LEFT = 0.6
"""or where the best phase leaves less than this share of what the middle one of all phases leaves."""
APART = (0.25, 0.375, 0.5, 0.625, 0.75)
"""Phases to hold one against, in times from flash to flash: rows then see other flashes, whatever these are called."""
STEPS = 2
"""Phases are tried in such parts of the shortest flash."""
LEAST_FRAMES = 4
"""Frames for each brightness that is fitted to them, from which on these explain little by chance."""


def least_frames(plan: Plan) -> int:
    """Return how many frames can tell whether they show the strobe."""
    return LEAST_FRAMES * (len(plan.lit_slots) + 1)


def shows_strobe(plan: Plan, rows: Profiles, beat: Beat) -> bool:
    """Return whether frames, at least ``least_frames`` of them, show the strobe at any place in its cycle."""
    shifts_s = np.arange(0.0, plan.cycle_s, plan.shortest_flash_s / STEPS)
    return _one_stands_out(plan, rows, beat, shifts_s, shifts_s)


def lost_somewhere(plan: Plan, found: ClipFit) -> bool:
    """Return whether some frames in a row of a clip do not show the strobe where its fit says that it is."""
    count = window_frames(plan)
    rows = replace(found.rows.binned(TRACK_ROWS), restless=None)
    pitch_s = plan.cycle_s / len(plan.cycle_slots)
    others_s = pitch_s * np.array(APART)
    return any(
        not _one_stands_out(plan, rows.take(slice(at, at + count)), found.fit.beat, np.zeros(1), others_s)
        for at in range(0, len(rows.value) - count + 1, max(count // 4, 1))
    )


def _one_stands_out(plan: Plan, rows: Profiles, beat: Beat, shifts_s: Doubles, others_s: Doubles) -> bool:
    """Return whether the best of some shifts explains the rows' changes, or clearly more than others do."""
    rows = replace(rows.one_window(), doubt=None)

    def left(shift_s: float) -> float:
        moved = beat.with_phase(beat.clock.phase_s + shift_s * beat.clock.rate)
        return float((unexplained(plan, rows, moved) ** 2).sum())

    least = min(left(one) for one in shifts_s.tolist())
    if least < (1 - EXPLAINED) * float(((rows.value - rows.value.mean(axis=0)) ** 2).sum()):
        return True
    return least < LEFT * float(np.median([left(one) for one in others_s.tolist()]))
