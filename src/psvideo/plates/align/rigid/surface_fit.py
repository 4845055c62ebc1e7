"""The rigid motion along which one surface explains the plates of all lights best.

What no normal and albedo explain of the lights at a point, over their mean, is a residual; six numbers of the body are
fitted to those of a few thousand points: by Gauss and Newton's steps, damped as Levenberg and Marquardt do, with the
weights of Geman and McClure's function. Pictures are smoothed, first a lot, so that it starts from far.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Flags, Floats
from psvideo.plates.align.by_surface import CLIPPED, LEAST_LIT, MATTE
from psvideo.plates.align.rigid.rigid_motion import BodyPoints, RigidMotion
from psvideo.plates.align.velocity.followed import mean_velocity

ROUNDS, DONE = 20, 0.005
"""Steps at most; a step by less than the second, in a unit of every number, is the last."""
FARTHEST = 3.0
"""No number changes by more units in a step."""
FIRM, SOFTER, HARDER, GIVEN_UP = 0.01, 0.3, 4.0, 1e3
"""How firmly a step is held back, as a share of what is known; by how much less after one that gains, and more after
one that does not."""
LEAST = 1e-9


@dataclass(frozen=True, kw_only=True)
class AroundInstant:
    """A light's ``pictures`` around an instant, each (row, col, 3): light, and how much it grows to the right and
    down. ``spans_s`` are the times from them to the instant, below 0 where they come after it, and ``counts`` what they
    count in their mean."""

    pictures: tuple[Floats, ...]
    spans_s: tuple[float, ...]
    counts: tuple[float, ...]

    @staticmethod
    def picture(light: Floats, smooth_px: float) -> Floats:
        """Return the picture of a ``light`` (row, col), smoothed."""
        smooth = cv2.GaussianBlur(light, (0, 0), smooth_px)
        slopes = [cv2.Sobel(smooth, cv2.CV_32F, *axis, ksize=3, scale=1 / 8) for axis in ((1, 0), (0, 1))]
        return np.stack([smooth, *slopes], axis=-1)


@dataclass(frozen=True, kw_only=True)
class InPicture:
    """Some ``points`` (point,) of a body, and their places in the picture, ``row`` and ``col``, in its pixels."""

    points: BodyPoints
    row: Floats
    col: Floats

    @classmethod
    def of(cls, points: BodyPoints, rows: NDArray[np.intp], cols: NDArray[np.intp]) -> "InPicture":
        """Return those pixels of a body's ``points``, (row, col)."""
        return cls(points=points.at((rows, cols)), row=rows.astype(np.float32), col=cols.astype(np.float32))


def motion_of_surface(
    start: RigidMotion, seen: InPicture, lights: Sequence[AroundInstant], odd: Doubles, unit: Doubles
) -> RigidMotion:
    """Return the motion from ``start`` on that leaves the least of the ``lights``.

    ``odd`` (some, light) are orthonormal rows of what no normal and albedo explain; ``unit`` (number,) is by how much
    each number is to change to move points by about a pixel from plate to plate.
    """
    columns = seen.points.per_number() * unit.astype(np.float32)[:, None, None]
    best, firm = start, FIRM
    left = _left(best, seen, lights, odd)
    for _ in range(ROUNDS):
        squares, pull = left.equations(columns)
        while firm < GIVEN_UP:
            damped = squares + firm * np.diag(np.diag(squares) + LEAST)
            by = np.clip(np.linalg.solve(damped, pull), -FARTHEST, FARTHEST)
            other = best.changed(by * unit)
            theirs = _left(other, seen, lights, odd)
            if theirs.share < left.share:
                break
            firm *= HARDER
        else:
            return best
        best, left, firm = other, theirs, firm * SOFTER
        if np.abs(by).max() < DONE:
            break
    return best


@dataclass(frozen=True, kw_only=True)
class _AlongMotion:
    """What no surface explains at points, ``values`` (odd, point); how it grows as they are moved, ``slopes`` (2, odd,
    point); what is ``lit`` (point,) by all lights; and the mean ``share`` that is left there, 0 to 1."""

    values: Floats
    slopes: Floats
    lit: Flags
    share: float

    def equations(self, columns: Floats) -> tuple[Doubles, Doubles]:
        """Return the normal equations of the numbers whose ``columns`` (number, 2, point) are given."""
        square = np.square(self.values).sum(axis=0)
        weight = self.lit * np.square(MATTE / (square + MATTE * MATTE))
        steps = np.einsum("nap,aop->nop", columns, self.slopes)
        weighted = steps * weight
        squares = np.einsum("nop,mop->nm", weighted, steps, dtype=np.float64)
        return squares, -np.einsum("nop,op->n", weighted, self.values, dtype=np.float64)


def _left(motion: RigidMotion, seen: InPicture, lights: Sequence[AroundInstant], odd: Doubles) -> _AlongMotion:
    """Return what no surface explains along a motion."""
    velocity, bend = motion.velocity(seen.points), motion.bend(seen.points)
    light = np.zeros((len(lights), 3, seen.row.size), np.float32)
    for own, around in zip(light, lights, strict=True):
        for picture, span_s, counts in zip(around.pictures, around.spans_s, around.counts, strict=True):
            way = np.float32(span_s) * mean_velocity(velocity, bend, span_s)
            there = _shown(picture, seen.row - way[1], seen.col - way[0])
            own += there * np.array([[counts], [-counts * span_s], [-counts * span_s]], np.float32)
    mean = np.maximum(light[:, 0].mean(axis=0), LEAST_LIT)
    lit = (light[:, 0].min(axis=0) > LEAST_LIT) & (light[:, 0].max(axis=0) < CLIPPED)
    values, right, down = np.einsum("ol,lcp->cop", odd.astype(np.float32), light) / mean
    growth = light[:, 1:].mean(axis=0) / mean
    slopes = np.stack([right - values * growth[0], down - values * growth[1]])
    square = np.square(values).sum(axis=0)[lit]
    share = float(np.sum(square / (square + MATTE * MATTE), dtype=np.float64) / max(len(square), 1))
    return _AlongMotion(values=values, slopes=slopes, lit=lit, share=share if len(square) else 1.0)


def _shown(picture: Floats, row: Floats, col: Floats) -> Floats:
    """Return what a picture shows at places (point,), (3, point)."""
    there = cv2.remap(picture, col[None], row[None], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(there[0].T, np.float32)
