"""A fit as Timing: every flash that the clip saw any of, and the camera's shutter as it was found."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.camera import Camera
from psvideo.model.first_light import first_lit, is_called
from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import DroppedFrames, Flash, Order, Timing
from psvideo.sync.rowfit.beat import Beat, train_between
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.refine import Fit
from psvideo.sync.rowfit.unknowns.mains_swing import mains_swing

NO_READOUT = 3.0
"""A readout of fewer standard errors is taken for a global shutter."""


def fitted_camera(plan: Plan, fit: Fit) -> Camera:
    """Return the plan's camera with the shutter that was found; a readout within its error of 0 becomes 0."""
    beat = fit.beat
    may_be_none = beat.row_time_s < NO_READOUT * fit.errors_s.get("row_time_s", 0.0)
    readout_s = 0.0 if may_be_none else beat.row_time_s * plan.camera.height_px * (-1 if beat.upward else 1)
    return replace(plan.camera, exposure_s=beat.exposure_s, readout_s=readout_s)


def timing_of_fit(
    plan: Plan,
    found: ClipFit,
    *,
    order: Order,
    clip: str,
    dropped: tuple[DroppedFrames, ...],
    repeated: tuple[int, ...],
) -> Timing:
    """List every flash that the clip saw any of, and mark those that its start or end cuts; no notes yet."""
    beat, camera = found.fit.beat, fitted_camera(plan, found.fit)
    row_time_s = camera.row_time_s
    return Timing(
        clip=clip,
        frame_period_s=camera.frame_period_s,
        exposure_s=camera.exposure_s,
        row_time_s=row_time_s,
        clock_offset_ppm=beat.clock.mean_offset_ppm(),
        phase_error_rows=found.fit.shift_error_s / (abs(row_time_s) or camera.frame_period_s / camera.height_px),
        rise_s=beat.rise_s,
        fall_s=beat.fall_s,
        mains=mains_swing(plan, found.rows, found.fit),
        order=order,
        dropped_frames=dropped,
        repeated_frames=repeated,
        phase_error_s=found.fit.shift_error_s,
        row_time_error_s=found.fit.errors_s.get("row_time_s"),
        flashes=flashes_of_fit(plan, found, beat),
    )


def flashes_of_fit(plan: Plan, found: ClipFit, beat: Beat) -> tuple[Flash, ...]:
    """Return the flashes of which the clip saw any, under the names of a ``beat`` that differs from the fit's by these
    alone."""
    camera, index = fitted_camera(plan, found.fit), found.rows.index
    span = int(index[0]), int(index[-1])
    return flashes_seen(plan, beat, camera, span, trusted=found.trusted, unsure=found.unsure, late=found.jitter.of)


def flashes_seen(
    plan: Plan,
    beat: Beat,
    camera: Camera,
    span: tuple[int, int],
    *,
    trusted: tuple[int, int],
    unsure: NDArray[np.int64] | Sequence[int] = (),
    late: Callable[[Doubles], Doubles] = np.zeros_like,
) -> tuple[Flash, ...]:
    """Return the flashes of which the frames from the first to the last of a ``span`` saw any, in order.

    Complete are those that no frame outside of ``trusted`` saw, nor one at an ``unsure`` (place,) place in time;
    ``late`` gives by how much flashes that start at given times come late.
    """
    period_s = camera.frame_period_s
    from_s = max(span[0] - 2, 0) * period_s
    train = train_between(plan, beat.clock, from_s, (span[1] + 2) * period_s)
    start_s = train.start_s + late(train.start_s)
    first, last = frames_touched(camera, start_s, train.duration_s)
    seen = (last >= span[0]) & (first <= span[1])
    complete = (first >= trusted[0]) & (last <= trusted[1])
    doubtful = np.sort(np.asarray(unsure, np.int64))
    complete &= np.searchsorted(doubtful, first) == np.searchsorted(doubtful, last, side="right")
    return tuple(
        Flash(
            index=number,
            slot=int(train.slot[k]),
            lights=plan.flashes[train.slot[k]].lights,
            start_s=float(start_s[k]),
            duration_s=float(train.duration_s[k]),
            complete=bool(complete[k]),
        )
        for number, k in enumerate(np.flatnonzero(seen))
    )


WITHIN = 1e-9
"""A synced flash begins this share of the exposure after it and ends as much before: rounding puts none into two
frames, of which the clip may lack the second."""


def synced_timing(
    plan: Plan,
    indices: NDArray[np.int64],
    *,
    clip: str,
    dropped: Sequence[DroppedFrames],
    first_light: str | None = None,
) -> Timing:
    """One flash a frame, in the plan's order: nothing is left to find, and when its rows open does not matter.

    Place 0 in time holds the plan's first flash, or, where a ``first_light`` of the plan is named, the first frame that
    is looked at holds the nearest after it from which that one is the first to be lit. ``indices`` (frame,) are these
    frames' places in time, ascending; a flash between them whose frame is not there is incomplete.
    """
    period_s, exposure_s = plan.camera.frame_period_s, plan.camera.exposure_s
    first, last = int(indices[0]), int(indices[-1])
    train = plan.train(first if first_light is None else _turn_to(plan, first_light), last + 1 - first)
    there = np.isin(np.arange(first, last + 1), indices)
    flashes = tuple(
        Flash(
            index=n,
            slot=int(slot),
            lights=plan.flashes[slot].lights,
            start_s=(first + n) * period_s + WITHIN * exposure_s,
            duration_s=min(float(duration_s), (1 - 2 * WITHIN) * exposure_s),
            complete=bool(there[n]),
        )
        for n, (slot, duration_s) in enumerate(zip(train.slot, train.duration_s, strict=True))
    )
    return Timing(
        clip=clip,
        frame_period_s=period_s,
        exposure_s=plan.camera.exposure_s,
        row_time_s=0.0,
        clock_offset_ppm=0.0,
        phase_error_rows=0.0,
        order="given",
        dropped_frames=tuple(dropped),
        flashes=flashes,
    )


def _turn_to(plan: Plan, first_light: str) -> int:
    """Return how many flashes of the cycle come before the one from which a light is the first to be lit."""
    cycle = [plan.flashes[slot] for slot in plan.cycle_slots]
    firsts = (first_lit([*cycle[turn:], *cycle]) for turn in range(len(cycle)))
    return next(turn for turn, first in enumerate(firsts) if first is not None and is_called(first, first_light))
