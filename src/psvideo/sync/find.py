"""Find when every flash fired, from the picture alone: row profiles in, Timing out.

One global fit over many frames instead of a search for each frame's darkest row (``rowfit``): the strobe's phase and
the ratio of the two clocks are searched, the brightness of every row under every light is eliminated. A coarse grid
over a few dozen frames finds the place in the cycle; from there the clip is tracked, frames that were dropped or
repeated without a word are found, and a robust fit over all frames sharpens the clock, its drift, and what the plan
does not know exactly: readout, exposure, the LEDs' tails. The cycle's marker shows which light is which.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import NoStrobeError
from psvideo.model.arrays import Doubles
from psvideo.model.first_light import check_first_light
from psvideo.model.plan import UNKNOWN_CLOCK_PPM, Plan
from psvideo.model.timing import DroppedFrames, Timing
from psvideo.model.units import counted
from psvideo.sync.clip_parts import parts_of, timing_of_parts
from psvideo.sync.flashes_seen import synced_timing
from psvideo.sync.frames_taken import FramesTaken, timing_of_take
from psvideo.sync.named_strobe import FoundStrobe, named_strobe
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.quiet import loud_part
from psvideo.sync.rowfit.tracking.course import window_frames
from psvideo.sync.verdict.believed import Verdict, believed_fit
from psvideo.sync.verdict.elsewhere import rows_open_at_once
from psvideo.sync.verdict.few_kinds import comes_again, in_step_with_frames, other_times_as_well, shows_the_same
from psvideo.sync.verdict.overexposed import overexposed
from psvideo.sync.verdict.refusal import clock_too_far, nothing_to_find, too_few_lit, why_not

ADVICE = (
    "Check that plan.toml is the plan that the strobe played (frame rate, flash durations, dark time), that the lights "
    "flashed brightly enough, and that the exposure was fixed."
)


def timing_from_rows(
    plan: Plan,
    indices: NDArray[np.int64],
    profiles: Doubles,
    *,
    clip: str = "clip",
    first_light: str | None = None,
    dropped: Sequence[DroppedFrames] = (),
    numbers: Sequence[int] | None = None,
    doubt: NDArray[np.floating] | None = None,
) -> Timing:
    """Return when every flash of a clip fired.

    ``indices`` (frame,) are the frames' places in time by their numbering and ``profiles`` (frame, row) their row
    means in linear light; ``doubt`` (frame, row) is by how much a mean may be wrong beyond noise (saturated pixels).
    ``numbers`` (frame,) are the frames' own numbers, by which dropped and repeated ones are reported (left out: the
    indices). Raises PsvideoError where the profiles do not look like the plan's strobe.
    """
    check_first_light(plan, first_light)
    if plan.mode == "synced":
        return synced_timing(plan, indices, clip=clip, dropped=dropped, first_light=first_light)
    rows = _to_fit(plan, indices, profiles, doubt, clip=clip)
    verdict = believed_fit(plan, rows)
    _refuse_where_others_fit(plan, rows, verdict, clip)  # of their parts, shorter ones show even less
    take = FramesTaken(
        plan=plan,
        clip=clip,
        indices=np.asarray(indices, np.int64),
        numbers=np.asarray(indices if numbers is None else numbers, np.int64),
        dropped=tuple(dropped),
    )
    parts = parts_of(plan, rows, verdict)
    if parts:
        return timing_of_parts(take, parts, first_light)
    _refuse_unless_believed(plan, rows, verdict, clip)
    return timing_of_take(take, named_strobe(plan, verdict.found, first_light, take.indices))


def find_strobe(
    plan: Plan,
    indices: NDArray[np.int64],
    profiles: Doubles,
    *,
    clip: str = "clip",
    first_light: str | None = None,
    doubt: NDArray[np.floating] | None = None,
    most_rows: int | None = None,
) -> FoundStrobe:
    """Return the strobe's clock against the camera's, from row profiles as ``timing_from_rows`` takes them.

    Neighbouring rows are averaged to ``most_rows`` where there are more: less time, and a little less sure. Raises
    NoStrobeError where the profiles do not look like the plan's strobe.
    """
    rows = _to_fit(plan, indices, profiles, doubt, clip=clip)
    rows = rows if most_rows is None else rows.binned(most_rows)
    verdict = believed_fit(plan, rows)
    _refuse_unless_believed(plan, rows, verdict, clip)
    return named_strobe(plan, verdict.found, first_light, indices)


def _to_fit(
    plan: Plan,
    indices: NDArray[np.int64],
    profiles: Doubles,
    doubt: NDArray[np.floating] | None,
    *,
    clip: str,
) -> Profiles:
    rows = as_profiles(plan, indices, profiles, doubt)
    hopeless = nothing_to_find(plan, rows)
    if hopeless:
        raise NoStrobeError(f"{clip}: {hopeless}")
    return rows


def _refuse_unless_believed(plan: Plan, rows: Profiles, verdict: Verdict, clip: str) -> None:
    _refuse_where_others_fit(plan, rows, verdict, clip)
    if not verdict.believed:
        raise NoStrobeError(_not_found(plan, rows, verdict.found, clip))


def _refuse_where_others_fit(plan: Plan, rows: Profiles, verdict: Verdict, clip: str) -> None:
    if verdict.other is not None:
        if abs(verdict.found.fit.beat.clock.mean_offset_ppm()) > UNKNOWN_CLOCK_PPM:  # the strobe played another plan
            raise NoStrobeError(_not_found(plan, rows, verdict.found, clip))
        at_once = rows_open_at_once(plan, verdict.found.fit.beat)
        raise NoStrobeError(f"{clip}: {other_times_as_well(plan, verdict.found, verdict.other, at_once=at_once)}")


def _not_found(plan: Plan, rows: Profiles, found: ClipFit, clip: str) -> str:
    kept, beat = found.rows, found.fit.beat
    if shows_the_same(plan, kept, beat) and comes_again(plan, kept, beat):
        return f"{clip}: {in_step_with_frames(plan)}"
    lit = rows.take(loud_part(rows))
    reason = overexposed(rows) or too_few_lit(plan, rows) or why_not(plan, lit) or clock_too_far(plan, found)
    explained = f"explains {100 * max(found.fit.explained, 0):.0f} % of the rows' changes from frame to frame"
    if found.steps:
        explained = (
            f"{explained}, but only if frames are missing or repeated at {counted(found.steps, 'place')} that their "
            "numbers do not show"
        )
    return f"{clip}: no strobe like the plan's was found in the picture: the best fit {explained}. {reason or ADVICE}"


def as_profiles(
    plan: Plan, indices: NDArray[np.int64], values: Doubles, doubt: NDArray[np.floating] | None
) -> Profiles:
    """Lay out the profiles for fitting, rows in the order in which they open as far as that is known."""
    height = values.shape[1]
    rows = Profiles(
        value=np.ascontiguousarray(values, np.float64),
        index=np.asarray(indices, np.int64),
        period_s=plan.camera.frame_period_s,
        place=np.arange(height, dtype=np.float64),
        window_start=np.zeros(1, np.int64),
        doubt=None if doubt is None else np.ascontiguousarray(doubt, np.float64),
    )
    return rows.windowed(window_frames(plan))
