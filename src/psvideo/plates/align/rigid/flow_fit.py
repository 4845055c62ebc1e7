"""The rigid motion that is nearest to velocities that were found, of which many are wrong."""

import numpy as np

from psvideo.model.arrays import Doubles, Floats
from psvideo.plates.align.rigid.rigid_motion import NUMBERS, BodyPoints, RigidMotion

ROUNDS, USUAL = 30, 1.2
"""Least squares are solved so often, each time with Cauchy's weights: what is off by the second times what half of the
points are off by counts half."""
FIRM, LEAST = 1e-6, 1e-9


def motion_of_flow(points: BodyPoints, velocity: Floats, unit: Doubles) -> RigidMotion:
    """Return the motion of a body whose ``points`` (point,) were found to have a ``velocity`` (2, point), in pixels per
    second. ``unit`` (number,) makes the motion's numbers count alike."""
    columns = points.per_number() * unit[:, None, None]
    weight, numbers = np.ones(velocity.shape[1]), np.zeros(NUMBERS)
    for _ in range(ROUNDS):
        weighted = columns * weight
        squares = np.einsum("iap,jap->ij", weighted, columns)
        squares += FIRM * np.trace(squares) * np.eye(NUMBERS) / NUMBERS
        numbers = np.linalg.solve(squares, np.einsum("iap,ap->i", weighted, velocity))
        off = np.hypot(*(np.einsum("i,iap->ap", numbers, columns) - velocity))
        weight = 1 / (1 + np.square(off / (USUAL * np.median(off) + LEAST)))
    return RigidMotion(numbers=numbers * unit)
