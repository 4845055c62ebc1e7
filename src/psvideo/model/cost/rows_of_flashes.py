"""What rows and frames see of a plan's flashes: shares of rows, frames a flash, and how the dark row moves."""

import math
from collections.abc import Iterator
from itertools import pairwise

from psvideo.model.plan import Plan


def mixed_share(plan: Plan, *, exposure_s: float, dark_s: float) -> float:
    """Return the share of rows that see light of two flashes, for the exposure and dark time that were found: 0 where
    the dark time is as long as the exposure. Dark slots lie between flashes that no exposure sees together."""
    slots = [plan.flashes[slot].is_dark for slot in plan.cycle_slots]
    pairs = sum(not (one or other) for one, other in pairwise([*slots, slots[0]]))
    longer_s = plan.dark_s * len(slots) - dark_s * len(slots)
    return min(max(exposure_s - dark_s, 0.0) * pairs / max(plan.cycle_s - longer_s, 1e-12), 1.0)


def row_shares(plan: Plan, duration_s: float) -> tuple[float, float]:
    """Return (partial, missing): the rows of a plate that no frame holds whole, and that none saw, mean over phases.

    A row's openings last the exposure and come once a frame, so these shares do not depend on the readout.
    """
    if plan.mode == "synced":
        return 0.0, 0.0
    period_s, exposure_s = plan.camera.frame_period_s, plan.camera.exposure_s
    whole = max(exposure_s - duration_s, 0.0) / period_s
    missing = max(period_s - exposure_s - duration_s, 0.0) / period_s
    return max(1.0 - whole - missing, 0.0), missing


def frames_per_flash(plan: Plan, duration_s: float) -> tuple[int, int, float] | None:
    """Return (fewest, most, share of start phases with the most) of the frames that see some of a flash (§3.3).

    Frame n is touched where ``(s - R - Te) / Tc < n < (s + d) / Tc`` with R the last row's opening after the first's:
    an open interval whose length alone decides. None where the readout is unknown.
    """
    camera = plan.camera
    if plan.mode == "synced":
        return 1, 1, 1.0
    if camera.readout_s is None:
        return None
    last_row_s = abs(camera.readout_s) - abs(camera.row_time_s)
    length = (duration_s + last_row_s + camera.exposure_s) / camera.frame_period_s
    if abs(length - round(length)) < 1e-9:
        return round(length), round(length), 1.0
    fewest = math.floor(length)
    return fewest, fewest + 1, length - fewest


def dark_row_move_px(plan: Plan, slot: int) -> float | None:
    """Return by how many rows the dark row before a flash of this slot seems to move until the next frame.

    Negative is up. With one flash a frame this is eq. 13; with more of them the dark row that is nearest in the next
    frame belongs to a later flash. Beside a dark slot there is no dark row. None where no two frames show the row:
    without a rolling readout (global, unknown), in synced mode, and where the nearest one lies a picture away.
    """
    camera = plan.camera
    if plan.mode == "synced" or not camera.readout_s:
        return None
    later_s = camera.frame_period_s * (2 if plan.mode == "half-rate" else 1)
    slots = plan.cycle_slots
    moves_s = [move for at, own in enumerate(slots) if own == slot for move in _dark_row_moves_s(plan, at, later_s)]
    nearest_s = min(moves_s, key=abs, default=math.inf)
    return nearest_s / camera.row_time_s if abs(nearest_s) < abs(camera.readout_s) else None


def _dark_row_moves_s(plan: Plan, at: int, later_s: float) -> Iterator[float]:
    """Yield how much later than the dark row before a flash of the cycle the following ones open, ``later_s`` on."""
    lit = [not plan.flashes[slot].is_dark for slot in plan.cycle_slots]
    if not (lit[at - 1] and lit[at]):
        return
    passed_s = 0.0
    while passed_s < 2 * later_s:
        if lit[at - 1] and lit[at]:
            yield passed_s - later_s
        passed_s += plan.flashes[plan.cycle_slots[at]].duration_s + plan.dark_s
        at = (at + 1) % len(lit)
