"""Where a flash lies in the camera's frame, and how far it may move between two frames without any row showing it.

A flash that a whole pause between two frames holds lights all rows of one frame, wherever in the pause it is: no row
tells. A strobe that rolls is there for a moment, and its clock is known from before; one that is held may stay.
"""

import numpy as np

from psvideo.model.camera import Camera
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import FoundClock, train_between

EDGE_ROWS = 1.0
"""At the border a row that sees a little less of a flash than all of it says hardly more than none."""


def flash_place(plan: Plan, camera: Camera, clock: FoundClock, at_s: float) -> float:
    """Return where the middles of the flashes about a time lie in the frame, as a share of its period, from 0 to 1: at
    0 it is seen by the row that opens first as it opens and closes."""
    period_s = camera.frame_period_s
    train = train_between(plan, clock, at_s, at_s)
    near = np.abs(train.start_s - at_s) < plan.cycle_s
    middle_s = train.start_s[near] + 0.5 * train.duration_s[near] + 0.5 * (period_s - camera.exposure_s)
    turn = np.exp(2j * np.pi * middle_s / period_s).mean()
    return float(np.angle(turn)) / (2 * np.pi) % 1.0


def unseen_s(plan: Plan, camera: Camera, clock: FoundClock, at_s: float) -> float:
    """Return how long the stretch is in which the flashes about a time may lie and no row tells where; 0 where rows
    do."""
    period_s, row_s = camera.frame_period_s, abs(camera.row_time_s)
    pause_s = period_s - (camera.height_px - 1) * row_s
    free_s = pause_s - plan.shortest_flash_s + EDGE_ROWS * row_s
    if free_s <= 0:
        return 0.0
    from_middle_s = (flash_place(plan, camera, clock, at_s) * period_s + 0.5 * pause_s) % period_s
    away_s = min(from_middle_s, period_s - from_middle_s)
    return free_s if away_s <= 0.5 * free_s + EDGE_ROWS * row_s else 0.0
