"""Velocities vary evenly over a thing that turns: planes are fitted to those that were found, and lead on beside them.

What flow proposes is off by a part of a pixel, to another side in every piece of a picture, and bare or slanting parts
show none of it. A plane through the velocities around a pixel is nearer to the true one, and holds a little beyond.
"""

from dataclasses import replace

import cv2
import numpy as np

from psvideo.model.arrays import Doubles, Flags, Floats
from psvideo.plates.align.velocity.all_lights import AllLights
from psvideo.plates.align.velocity.followed import Followed, mean_over, odd_width

PLANE_PX = 15
"""Planes are fitted over windows of so many pixels of the sketches."""
AS_OWN = np.float32(1.2)
"""A plane's velocity is taken where plates are at most so many times as unlike along it as along the pixel's own, over
either window: two things that pass each other lie in no plane."""
JOINED, ENOUGH = 2, np.float32(0.3)
"""So often, what is undecided joins, where more than the second of its window moves."""
AS_REST, AMIDST = np.float32(1.3), np.float32(0.2)
"""It joins where plates are at most so many times as unlike along the plane as at rest, and where before and behind it
what moves exceeds what rests by the second, in shares of the window: what is hidden there belongs to what rests."""
LEAST, LEAST_SPREAD = 1e-9, 1e-3
"""Windows of one pixel, or of a line, get a plane without a slope across."""


def fitted_by_planes(
    lights: AllLights, found: Followed, *, sure: Flags, apart: Flags, rest: tuple[Floats, Floats]
) -> Followed:
    """Return what was ``found`` with velocities of planes where plates are as alike along them, and with what is
    undecided beside it.

    What is ``sure`` (row, col) keeps its velocity, and what is ``apart`` (row, col) joins nothing. ``rest`` is how
    unlike plates are at rest, over a wide and a fine window, (row, col).
    """
    if not found.moves.any():
        return found
    moves = found.moves
    velocity = _evened(lights, found.velocity, moves, moves & ~sure)
    size = odd_width(PLANE_PX, lights.step)
    resting_share = mean_over(found.rests.astype(np.float32), size)
    for _ in range(JOINED):
        plane, around = planes_through(velocity, moves, size)
        joins = (around > ENOUGH) & ~moves & ~found.rests & ~apart
        for along, resting in zip(lights.unlike_over_windows(plane), rest, strict=True):
            joins &= along <= AS_REST * resting
        joins &= lights.least_at_ends(around - resting_share, plane) > AMIDST
        velocity, moves = np.where(joins, plane, velocity), moves | joins
    return replace(
        found, velocity=velocity * moves, moves=moves, unchanged=np.where(moves, np.int16(0), found.unchanged)
    )


def _evened(lights: AllLights, velocity: Floats, moves: Flags, asked: Flags) -> Floats:
    """Return the velocity of what ``moves`` with planes', where that is ``asked`` and plates are as alike."""
    plane, _ = planes_through(velocity, moves, odd_width(PLANE_PX, lights.step))
    taken = asked.copy()
    for along, own in zip(lights.unlike_over_windows(plane), lights.unlike_over_windows(velocity), strict=True):
        taken &= along <= AS_OWN * own
    return np.where(taken, plane, velocity)


def planes_through(velocity: Floats, moves: Flags, size: int) -> tuple[Floats, Floats]:
    """Return planes through velocities (2, row, col) of what ``moves``, fitted by least squares over windows of a
    ``size`` and read at their middles, and which share of each window moves, (row, col)."""
    weight = moves.astype(np.float64)
    y, x = (axis.astype(np.float64) for axis in np.mgrid[: weight.shape[0], : weight.shape[1]])
    around = _mean(weight, size)

    def over(values: Doubles) -> Doubles:
        return _mean(weight * values, size) / np.maximum(around, LEAST)

    middle_x, middle_y = over(x), over(y)
    xx, yy = over(x * x) - middle_x**2 + LEAST_SPREAD, over(y * y) - middle_y**2 + LEAST_SPREAD
    xy = over(x * y) - middle_x * middle_y
    area = xx * yy - xy * xy
    planes = np.empty_like(velocity)
    for plane, own in zip(planes, velocity.astype(np.float64), strict=True):
        mean = over(own)
        with_x, with_y = over(own * x) - mean * middle_x, over(own * y) - mean * middle_y
        slope_x, slope_y = (with_x * yy - with_y * xy) / area, (with_y * xx - with_x * xy) / area
        plane[:] = mean + slope_x * (x - middle_x) + slope_y * (y - middle_y)
    return planes, around.astype(np.float32)


def _mean(values: Doubles, size: int) -> Doubles:
    return np.asarray(cv2.blur(values, (size, size), borderType=cv2.BORDER_CONSTANT), np.float64)
