"""The timing of a virtual shoot as it truly was, for tests that begin behind sync."""

from collections.abc import Sequence

import numpy as np

from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Flash, Timing
from psvideo.synth import TrueFlash


def true_timing(plan: Plan, flashes: Sequence[TrueFlash], *, frames: int, clock_offset_ppm: float = 30.0) -> Timing:
    """Return the times of all flashes; complete are those of which no row falls outside of the clip's frames."""
    start_s = np.array([flash.start_s for flash in flashes])
    duration_s = np.array([flash.duration_s for flash in flashes])
    first, last = frames_touched(plan.camera, start_s, duration_s)
    return Timing(
        clip="clip",
        frame_period_s=plan.camera.frame_period_s,
        exposure_s=plan.camera.exposure_s,
        row_time_s=plan.camera.row_time_s,
        clock_offset_ppm=clock_offset_ppm,
        phase_error_rows=0.0,
        order="marker",
        flashes=tuple(
            Flash(
                index=n,
                slot=flash.slot,
                lights=plan.flashes[flash.slot].lights,
                start_s=flash.start_s,
                duration_s=flash.duration_s,
                complete=bool(first[n] >= 0 and last[n] < frames),
            )
            for n, flash in enumerate(flashes)
        ),
    )
