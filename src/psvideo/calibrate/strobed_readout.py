"""A camera's readout time from a strobed clip: where the dark rows lie, frame by frame, shows how fast rows open.

The fit measures the row time against the frame period, so as a share of the frame the readout owes nothing to any
clock. In seconds it rests on the frame rate being what the plan names, which the strobe vouches for within its clock's
tolerance.
"""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.calibrate.stripes.steps import Direction
from psvideo.clip import Take
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.take_timing import find_timing
from psvideo.sync.verdict.camera_remarks import READOUT_FOUND

MODEL_ERROR_SHARE = 2e-5
"""Share of the frame period by which virtual shoots were off beyond the fit's own error (240 rows and fewer)."""
SURE_ERRORS = 3.0
"""A readout that is no more than this many standard errors from zero does not show which end comes first."""


@dataclass(frozen=True, kw_only=True)
class StrobedReadout:
    """A measured readout time; all errors are standard errors.

    ``readout_s`` is negative where the bottom row comes first, as in plans. ``rows_error_s`` comes from the picture,
    ``clock_error_s`` from the strobe's clock, taken as uniform within ``tolerance_ppm``; ``error_s`` is both.
    ``frame_share`` is the readout as a share of the frame period, with its error from the picture alone.
    """

    readout_s: float
    error_s: float
    rows_error_s: float
    clock_error_s: float
    tolerance_ppm: float
    clock_offset_ppm: float
    frame_share: float
    frame_share_error: float
    rows: int
    frames: int
    flashes: int
    direction: Direction
    warnings: tuple[str, ...]


def readout_of(plan: Plan, timing: Timing, *, frames: int, tolerance_ppm: float | None = None) -> StrobedReadout:
    """Return the readout time that a timing found, the plan's own readout left aside.

    ``tolerance_ppm`` is how far the strobe's clock may be from true seconds (left out: what the plan says of it).
    Raises PsvideoError where the timing took the row time from the plan instead of measuring it.
    """
    if timing.row_time_error_s is None:
        raise PsvideoError(
            f"{timing.clip}: its timing does not show the readout, because rows of a {plan.mode} clip do not show when "
            "they open. Film a subject under a rolling plan (psvideo capture-plan), or an LED's stripes and `led_hz`."
        )
    rows, period_s = plan.camera.height_px, timing.frame_period_s
    readout_s = timing.row_time_s * rows
    rows_error_s = float(np.hypot(timing.row_time_error_s * rows, MODEL_ERROR_SHARE * period_s))
    clock_ppm = plan.clock_range_ppm if tolerance_ppm is None else tolerance_ppm
    clock_error_s = abs(readout_s) * clock_ppm * 1e-6 / np.sqrt(3)
    sure = abs(readout_s) > SURE_ERRORS * rows_error_s
    return StrobedReadout(
        readout_s=readout_s,
        error_s=float(np.hypot(rows_error_s, clock_error_s)),
        rows_error_s=rows_error_s,
        clock_error_s=float(clock_error_s),
        tolerance_ppm=clock_ppm,
        clock_offset_ppm=timing.clock_offset_ppm,
        frame_share=abs(readout_s) / period_s,
        frame_share_error=rows_error_s / period_s,
        rows=rows,
        frames=frames,
        flashes=len(timing.flashes),
        direction=("top-down" if readout_s > 0 else "bottom-up") if sure else "unknown",
        warnings=tuple(note for note in timing.notes if not note.startswith(READOUT_FOUND)),  # what is measured here
    )


def measure_take_readout(take: Take, *, tolerance_ppm: float | None = None, watch: Watch = unwatched) -> StrobedReadout:
    """Measure a camera's readout time from a strobed take; the plan's own value is not used.

    ``tolerance_ppm`` is how far the strobe's clock may be from true seconds (left out: what the plan says of it).
    Raises PsvideoError where no strobe is found.
    """
    unknown = replace(take.plan, camera=replace(take.plan.camera, readout_s=None))
    timing = find_timing(replace(take, clip=replace(take.clip, plan=unknown)), watch=watch)
    return readout_of(unknown, timing, frames=len(take.numbers), tolerance_ppm=tolerance_ppm)
