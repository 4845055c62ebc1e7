"""Frames that see the strobe's cycle at few different times, which any flash times would explain: whether a clip's do,
and what to do."""

import numpy as np

from psvideo.model.arrays import Integers
from psvideo.model.plan import Plan
from psvideo.model.units import counted
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles

ALIKE = 0.2
"""Frames that see the cycle at times which differ by less than this share of the shortest flash are alike."""
SLOW = 3.0
"""A strobe that moves by no more than this many shortest flashes within a clip nearly keeps step with its frames."""
AGAIN = 0.5
"""Pictures come again where frames that see the cycle at one time change by less than this share of the squares by
which frames that follow one another do. (Lights at rest: 0.00; a subject that tumbles: 0.1 to 0.2; noise: 1.)"""


def shows_the_same(plan: Plan, rows: Profiles, beat: Beat) -> bool:
    """Return whether a rolling shutter sees no more different frames, again and again, than a row has brightnesses:
    ambient light and lights then explain them wherever the flashes fell.

    Frames are alike that see the cycle at the same time, or nearly. A global shutter sees plates whole all the same.
    """
    if beat.row_time_s == 0.0:
        return False
    return _few_kinds(plan, rows, beat, ALIKE)


def shows_few(plan: Plan, rows: Profiles, beat: Beat) -> bool:
    """Return whether frames see no more than so many, each of them moved by ``SLOW`` flashes at most in the course of
    the clip: a subject that moves may explain that as well as flashes that do."""
    return _few_kinds(plan, rows, beat, SLOW)


def comes_again(plan: Plan, rows: Profiles, beat: Beat) -> bool:
    """Return whether frames that see the cycle at the same time show the same picture, each of them several times: what
    few frames show, or what noise does, does not come again however few kinds of frames there are."""
    kind, count, _ = _kinds(plan, rows, beat)
    if len(kind) < 2 * count:
        return False
    order = np.lexsort((rows.index, kind))
    same = np.diff(kind[order]) == 0
    again = np.diff(rows.value[order], axis=0)[same]
    onward = np.diff(rows.value[np.argsort(rows.index, kind="stable")], axis=0)
    return float((again**2).mean()) < AGAIN * float((onward**2).mean())


def _few_kinds(plan: Plan, rows: Profiles, beat: Beat, moved: float) -> bool:
    """Return whether frames see the cycle around no more times than a row has brightnesses, and at those within so many
    of the shortest flash."""
    _, kinds, within_s = _kinds(plan, rows, beat)
    return kinds <= len(plan.lit_slots) + 1 and within_s < kinds * moved * plan.shortest_flash_s


def _kinds(plan: Plan, rows: Profiles, beat: Beat) -> tuple[Integers, int, float]:
    """Return around which of a few times each frame sees the cycle (frame,), around how many, and for how long these
    last together, in seconds."""
    cycle_s, alike_s = plan.cycle_s * beat.clock.rate, ALIKE * plan.shortest_flash_s
    at_s = rows.frame_start_s % cycle_s
    order = np.argsort(at_s, kind="stable")
    gaps_s = np.diff(np.append(at_s[order], at_s[order[0]] + cycle_s))
    apart = gaps_s > alike_s
    count = max(int(apart.sum()), 1)
    kind = np.empty(len(at_s), np.int64)
    kind[order] = (np.cumsum(apart) - apart) % count  # a gap lies behind its frame, and the last time may be the first
    return kind, count, float(cycle_s - gaps_s[apart].sum())


def in_step_with_frames(plan: Plan) -> str:
    """Say that frames repeat so soon that any time would explain them, and what to do."""
    frames = round(plan.cycle_s / plan.camera.frame_period_s)
    return (
        f"the strobe keeps step with the camera: the same {counted(frames, 'picture')} come again and again, and a row "
        f"has as many brightnesses ({counted(len(plan.lit_slots), 'light')} and what else shines), so that any flash "
        "times would explain them. Film long enough for the clocks to drift apart by a flash, or plan another dark "
        f"time (dark_s = {plan.dark_s + 0.1 * plan.camera.frame_period_s:.4g} under [strobe])."
    )


def other_times_as_well(plan: Plan, found: ClipFit, other: Beat, *, at_once: bool) -> str:
    """Say that flashes at other times explain the picture as well, under another clock, and what to do; ``at_once``:
    all rows open at nearly the same time."""
    one, another = found.fit.beat.clock.mean_offset_ppm(), other.clock.mean_offset_ppm()
    why = (
        "All rows open at nearly the same time, so that whether the beginning or the end of an exposure cuts a flash "
        "shows only in the strobe's clock"
        if at_once
        else "It does not show well enough when each flash fired, as where hardly any row opens or closes during one "
        "while the subject moves, so that the strobe's clock is not known"
    )
    return (
        f"flashes at other times explain the picture as well. {why}, and it may be {one:+.0f} ppm off the camera's or "
        f"{another:+.0f} ppm. Film longer, until every flash has come in and gone out of the exposure, or plan another "
        "dark time, so that flashes fall all over the frame (dark_s = "
        f"{plan.dark_s + 0.1 * plan.camera.frame_period_s:.4g} under [strobe])."
    )
