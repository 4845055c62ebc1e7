"""Lock from nothing: the offline finder, run on the last second or two of row profiles."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import UsageError
from psvideo.model.arrays import Doubles
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan
from psvideo.model.timing import Order
from psvideo.sync.find import find_strobe
from psvideo.sync.flashes_seen import fitted_camera
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.coarse.seed import SEED_FRAMES
from psvideo.sync.rowfit.fit import FLASH_ROWS

LONGEST_S = 2.0
"""Older profiles than this are not looked at: whatever spoiled them is to be forgotten."""
LOCK_ROWS = 180
"""A sixth of 1080, which gives the phase to 0.02 of theirs; more where a flash would not span ``FLASH_ROWS``."""
SLOPE_S = 0.2
"""A bent clock's rate is read over this long before its end."""
UNSURE = 3.0
"""The finder's errors hold for the whole stretch; at its ends, from where the clock is followed, it may be so much less
sure."""


@dataclass(frozen=True, kw_only=True)
class Lock:
    """The strobe as it was found: its ``beat`` on a straight clock, the ``camera`` with the shutter that was found.

    ``order`` is how the lights' names are known. ``error_s`` and ``error_ppm`` are the standard errors of phase and
    rate at the time ``at_s``, the first frame's. ``places`` (frame,) are the frames' true places in time: some may have
    gone missing without a word. ``trusted_from`` is the first place from which frames fit.
    """

    beat: Beat
    camera: Camera
    order: Order
    at_s: float
    error_s: float
    error_ppm: float
    places: NDArray[np.int64]
    trusted_from: int


def check_followed(plan: Plan) -> None:
    """Raise UsageError where a plan's strobe cannot be followed: a synced one has no time to be found."""
    if plan.mode == "synced":
        raise UsageError(
            "The plan is a synced one (one flash a frame, by a cable), and the live view follows strobes that run on "
            "their own. Record the take and use normals, or write the plan for a strobe of mode rolling."
        )


def frames_to_lock(plan: Plan) -> int:
    """Return how many frames the finder wants: a cycle with its marker and half as long again."""
    return max(SEED_FRAMES, int(1.5 * plan.marker_s / plan.camera.frame_period_s) + 2)


def rows_to_lock(plan: Plan) -> int:
    """Return to how many rows frames may be averaged: the finder's time goes with them, and who follows gets surer."""
    camera = plan.camera
    reads_s = camera.frame_period_s if camera.readout_s is None else abs(camera.readout_s)
    shortest_s = plan.shortest_flash_s
    return max(LOCK_ROWS, int(FLASH_ROWS * reads_s / shortest_s) + 1)


def lock(
    plan: Plan,
    index: NDArray[np.int64],
    profiles: Doubles,
    *,
    doubt: NDArray[np.floating] | None = None,
    first_light: str | None = None,
) -> Lock:
    """Return the strobe that frames show, from their places in time (frame,) and row means (frame, row).

    Raises NoStrobeError where they do not show the plan's strobe.
    """
    begin = int(index[0])
    strobe = find_strobe(
        plan, index - begin, profiles, clip="live", first_light=first_light, doubt=doubt, most_rows=rows_to_lock(plan)
    )
    fit, places = strobe.found.fit, strobe.found.track.index
    period_s = plan.camera.frame_period_s
    span_s = float(places[-1] + 1) * period_s
    straight = _straight(fit.beat.clock, 0.5 * span_s)
    clock = replace(straight, phase_s=straight.phase_s + begin * period_s)
    return Lock(
        beat=replace(fit.beat, clock=clock),
        camera=fitted_camera(plan, fit),
        order=strobe.order,
        at_s=begin * period_s,
        error_s=UNSURE * fit.shift_error_s,
        error_ppm=UNSURE * float(np.sqrt(12.0)) * fit.shift_error_s / span_s * 1e6,
        places=places + begin,
        trusted_from=int(strobe.found.trusted[0]) + begin,
    )


def _straight(clock: FoundClock, at_s: float) -> FoundClock:
    """Return a clock without bends that runs as this one does at a time."""
    if not clock.knot_s:
        return clock
    now, before = clock.bend(np.array([at_s, at_s - SLOPE_S])).tolist()
    bare = replace(clock, knot_s=(), bend_s=())
    return bare.shifted(now, 1e6 * (now - before) / SLOPE_S, pivot_s=at_s)
