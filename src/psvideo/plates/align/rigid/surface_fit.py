"""The rigid motion along which the plates of all lights, before an instant and after it, show one surface that turns.

Six numbers of the body are fitted to what is left of the plates at a thousand points (``along_motion``): by Gauss and
Newton's steps, damped as Levenberg and Marquardt do, with the weights of Geman and McClure's function. It starts from
far, in smooth pictures; from there on depth is fitted as well (``joint_fit``).
"""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.plates.align.rigid.along_motion import AlongMotion, InPicture
from psvideo.plates.align.rigid.plates_seen import PlatesSeen
from psvideo.plates.align.rigid.rigid_motion import RigidMotion

ROUNDS, DONE = 20, 0.03
"""Steps at most; a step by less than the second, in a unit of every number, is the last."""
FARTHEST = 3.0
"""No number changes by more units in a step."""
FIRM, SOFTER, HARDER, GIVEN_UP = 0.01, 0.3, 4.0, 1e3
"""How firmly a step is held back, as a share of what is known; by how much less after one that gains, and more after
one that does not."""
LEAST = 1e-9


def motion_of_surface(start: RigidMotion, seen: InPicture, plates: PlatesSeen, unit: Doubles) -> RigidMotion:
    """Return the motion from ``start`` on along which one surface explains the ``plates`` best.

    ``unit`` (number,) is by how much each number is to change to move points by about a pixel from plate to plate.
    """
    per_number = seen.points.per_number()
    best, firm = start, FIRM
    left = AlongMotion.of(best, seen, plates)
    for _ in range(ROUNDS):
        squares, pull = left.equations(per_number, unit)
        while firm < GIVEN_UP:
            damped = squares + firm * np.diag(np.diag(squares) + LEAST)
            by = np.clip(np.linalg.solve(damped, pull), -FARTHEST, FARTHEST)
            other = best.changed(by * unit)
            theirs = AlongMotion.of(other, seen, plates)
            if theirs.share < left.share:
                break
            firm *= HARDER
        else:
            return best
        best, left, firm = other, theirs, firm * SOFTER
        if np.abs(by).max() < DONE:
            break
    return best
