"""Genlock through the picture: by how much the strobe's period is to be trimmed so that the dark row stands still.

Between two flashes lies a band of rows that no flash lights whole: the dark row. Where every flash comes a whole number
of frames after the one before, it stands at one row, and moves only as far as the two clocks differ. A strobe whose
period is trimmed by that difference, and a little more or less for a while, has it where the user wants it.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.errors import UsageError
from psvideo.live.following.between_frames import flash_place
from psvideo.live.following.follow import Follower
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan
from psvideo.strobe.link.boards import MAX_TRIM_PPM

PULL_S = 0.25
"""The dark row's distance shrinks to a third in this time: slower than the clock is measured (every 8 frames)."""
MOST_PULL_PPM = 4000.0
"""The strobe is never sent faster than this towards the row: half a frame at 120 frames a second in one second."""
STEP_PPM = 1600
"""A trim changes by no more than this at once, so that a moment that is not known to some frames costs a few rows."""
EVERY_S = 0.1
"""Between two trims of the strobe."""
MOST_BLIND = 0.25
"""Rows may be blind between two frames for this share of the shortest flash. What one frame's row misses of a flash
the next frame shows then, and their ratio says where the dark row is though it stands still; rows that are blind have
nothing to be compared with, and the dark row would creep."""
MOST_APART_PPM = 5000.0
"""A plan whose flashes come this near to whole frames can be held; the rest of a board's range is for the clocks."""


@dataclass(frozen=True, kw_only=True)
class WantedRow:
    """Where the middle of the dark row is to stand: ``row`` counts from the row that opens first.

    Rows from the camera's height on are those of the pause between two frames, which nobody sees.
    """

    row: float


def check_holds(plan: Plan) -> None:
    """Raise UsageError where the dark row cannot stand still: flashes do not come every whole number of frames."""
    camera = plan.camera
    step_s = plan.cycle_s / len(plan.cycle_slots)
    frames = max(round(step_s / camera.frame_period_s), 1)
    apart_ppm = 1e6 * (step_s / (frames * camera.frame_period_s) - 1)
    blind_s = camera.frame_period_s - camera.exposure_s
    if blind_s > MOST_BLIND * min(flash.duration_s for flash in plan.flashes):
        raise UsageError(
            f"`lock`: rows are blind for {1e3 * blind_s:.4g} ms between two frames (a shutter of "
            f"{camera.shutter_deg:.4g} degrees), and a dark row that stands still cannot be followed then. Open the "
            "shutter to 360 degrees, and write that into the plan."
        )
    lengths = [flash.duration_s for flash in plan.flashes]
    if abs(apart_ppm) > MOST_APART_PPM or max(lengths) - min(lengths) > 0.02 * camera.frame_period_s:
        raise UsageError(
            f"`lock`: this plan's flashes come every {1e3 * step_s:.4g} ms and frames every "
            f"{1e3 * camera.frame_period_s:.4g} ms, so its dark row rolls through the picture and no trim of some ppm "
            'can hold it. Plan flashes of one length that come every other frame (`mode="half-rate"`).'
        )


def target_of(camera: Camera, wanted: str) -> WantedRow:
    """Return where the dark row is to stand, from ``edge``, a row's number, or rows to keep it away from (``200-500``).

    Raises UsageError where that cannot be read, or the rows are not the picture's.
    """
    around = rows_around(camera)
    if wanted == "edge":
        return WantedRow(row=_opened(camera, 0.5 * (camera.height_px + around)) if around > camera.height_px else 0.0)
    first, dash, last = wanted.partition("-")
    if (
        not first.isdecimal()
        or (dash and not last.isdecimal())
        or not int(first) <= int(last or first) < camera.height_px
    ):
        raise UsageError(
            f'`lock` {wanted}: expected "edge", the row at which the dark row shall stand, or the rows to keep it away '
            f"from, such as {camera.height_px // 4}-{3 * camera.height_px // 4}; rows are 0 to {camera.height_px - 1}."
        )
    if not dash:
        return WantedRow(row=_opened(camera, float(first)))
    middle = _opened(camera, 0.5 * (int(first) + int(last)))
    return WantedRow(row=(middle + 0.5 * around) % around)


def rows_around(camera: Camera) -> float:
    """Return how many rows' times a frame lasts: those of the picture, and of the pause until the next frame."""
    return camera.frame_period_s / abs(camera.row_time_s)


def _opened(camera: Camera, row: float) -> float:
    """Return a row by its place in the order in which rows open."""
    return row if camera.row_time_s >= 0 or row >= camera.height_px else camera.height_px - 1 - row


@dataclass(frozen=True, kw_only=True)
class DarkRow:
    """Where the middle of the dark row is, as in ``WantedRow``, and by how many ppm of the time it moves later."""

    row: float
    slip_ppm: float

    def short_of(self, target: WantedRow, around: float) -> float:
        """Return how many rows it lacks to a target, the shorter way around the frame."""
        return (target.row - self.row + 0.5 * around) % around - 0.5 * around


def dark_row(follower: Follower, at_s: float) -> DarkRow:
    """Return the dark row at a time: the middle of a flash, seen by rows as they open and close."""
    plan, camera = follower.plan, follower.lock.camera
    step_s = plan.cycle_s / len(plan.cycle_slots)
    rate = follower.clock.rate + 1e-6 * follower.trims.now_ppm
    frames = max(round(step_s / camera.frame_period_s), 1)
    row = flash_place(plan, camera, follower.clock, at_s) * rows_around(camera)
    return DarkRow(row=row, slip_ppm=1e6 * (step_s * rate / (frames * camera.frame_period_s) - 1))


def next_trim_ppm(now_ppm: int, seen: DarkRow, target: WantedRow, camera: Camera) -> int:
    """Return the trim (whole ppm; later above 0) that brings the dark row to its target and keeps it there.

    ``now_ppm`` is the trim that counts. It changes by at most ``STEP_PPM``, and never leaves a board's range.
    """
    short_s = seen.short_of(target, rows_around(camera)) * abs(camera.row_time_s)
    pull_ppm = float(np.clip(1e6 * short_s / PULL_S, -MOST_PULL_PPM, MOST_PULL_PPM))
    wanted = now_ppm + pull_ppm - seen.slip_ppm
    step = float(np.clip(wanted - now_ppm, -STEP_PPM, STEP_PPM))
    return int(np.clip(round(now_ppm + step), -MAX_TRIM_PPM, MAX_TRIM_PPM))
