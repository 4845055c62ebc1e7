"""Rows of other flashes moved to the instant of the plate that lacks them, along how everything moves.

A pixel that moves, or that something hides in the rows that are nearest, is taken from the flash before and the one
after that show its place there, by how near they are; from one of them where the other does not show it, or shows
something else. What no flash shows is not seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Flags, Floats, Image
from psvideo.model.channels import brightest_channel
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.light_plate import LightPlate

ALIKE, DARK = np.float32(0.15), np.float32(0.01)
"""Two flashes that differ by more than the first, as a share of the brighter, and the second of full light, do not show
the same: the nearer one is taken."""
BAND_ROWS = 64
HALF, LEAST_S = np.float32(0.5), np.float32(1e-9)


@dataclass(frozen=True, kw_only=True)
class LentRows:
    """Rows in one piece that a flash showed, (row, col) or (row, col, channel), from the ``first`` on, and when."""

    image: Image
    first: int
    time_s: float

    @cached_property
    def most(self) -> float:
        """The most that they show."""
        return float(self.image.max())


def brought(plate: LightPlate, own: Flags, lent: Sequence[LentRows], motion: Followed, reach_s: float) -> LightPlate:
    """Return a plate whose rows that are not its ``own`` (row,) are moved to its instant, of flashes no farther away
    than ``reach_s``. They are written into the picture that it has, which lies in memory and is nobody else's: a copy
    would take as much again."""
    image, seen = plate.image, np.array(plate.pixels_seen)
    near = sorted((one for one in lent if abs(one.time_s - plate.time_s) <= reach_s), key=lambda one: one.time_s)
    sides = [one for one in near if one.time_s < plate.time_s][::-1], [one for one in near if one.time_s > plate.time_s]
    ways_px = reach_s * np.abs(motion.velocity).max(axis=(1, 2)) * motion.step
    moving = _wider(motion, ways_px)

    def fill(top: int, bottom: int) -> None:
        rows = top + np.flatnonzero(~own[top:bottom])
        if len(rows) and (cols := _columns(moving, rows, plate.shape)):
            piece = _Piece.of(plate, motion, rows, cols)
            piece.fill(image, seen, sides)

    over_ranges(fill, len(own), each=BAND_ROWS)
    hidden = not seen[plate.rows_seen].all()
    return replace(plate, seen=seen if hidden else plate.seen, brought=True)


def _wider(motion: Followed, ways_px: Floats) -> Flags:
    """Return what moves and what it may hide, (row, col) of the velocities."""
    wide, high = (2 * int(np.ceil(way / motion.step)) + 1 for way in ways_px)
    return cv2.dilate(motion.moves.astype(np.uint8), np.ones((high, wide), np.uint8)) > 0


def _columns(moving: Flags, rows: NDArray[np.intp], shape: tuple[int, ...]) -> range:
    """Return the columns of a plate between which anything moves or may be hidden in some rows."""
    high, wide = shape[0] / moving.shape[0], shape[1] / moving.shape[1]
    some = moving[max(int(rows[0] / high) - 1, 0) : int(rows[-1] / high) + 2].any(axis=0)
    cols = np.flatnonzero(some)
    if not len(cols):
        return range(0)
    return range(max(int(cols[0] * wide) - 1, 0), min(int((cols[-1] + 1) * wide) + 1, shape[1]))


@dataclass(frozen=True, kw_only=True)
class _Piece:
    """Pixels of a plate, in ``rows`` and ``cols``: their places ``x`` and ``y``, how fast they or what is nearest to
    them moves, ``velocity`` (2, row, col), and what ``moves`` (row, col)."""

    plate: LightPlate
    motion: Followed
    rows: NDArray[np.intp]
    cols: range
    x: Floats
    y: Floats
    velocity: Floats
    moves: Flags

    @classmethod
    def of(cls, plate: LightPlate, motion: Followed, rows: NDArray[np.intp], cols: range) -> "_Piece":
        x, y = np.meshgrid(np.arange(cols.start, cols.stop, dtype=np.float32), rows.astype(np.float32))
        velocity = _velocity(motion, plate, x, y)
        span_s = np.float32(plate.time_s - motion.time_s)
        there = x - span_s * velocity[0], y - span_s * velocity[1]
        moves = _moves(motion, plate, *there)
        velocity = _velocity(motion, plate, *there)
        return cls(plate=plate, motion=motion, rows=rows, cols=cols, x=x, y=y, velocity=velocity, moves=moves)

    def fill(self, image: Image, seen: Flags, sides: tuple[Sequence[LentRows], Sequence[LentRows]]) -> None:
        """Put in what flashes before and after show of what moves, and of what it hides in the nearest rows."""
        place = np.ix_(self.rows, np.arange(self.cols.start, self.cols.stop))
        shown_s = self.plate.flashed_s[self.rows].astype(np.float32)[:, None]
        asked = self.moves | self._hidden(np.float32(self.plate.time_s) - shown_s)
        if not asked.any():
            return
        (before, since_s), (after, until_s) = (self._taken(side, asked) for side in sides)
        known = np.minimum(since_s, until_s) < np.inf
        made, own = self._blended((before, since_s), (after, until_s)), image[place]
        own[known] = made[known]
        image[place] = own
        seen[place] &= known | ~asked

    def _taken(self, side: Sequence[LentRows], asked: Flags) -> tuple[Image, Floats]:
        """Return what the nearest flashes of one side show of what is asked, and how far away they are, inf where none
        shows it."""
        made = np.zeros((*asked.shape, *self.plate.shape[2:]), np.float32)
        away_s, left = np.full(asked.shape, np.inf, np.float32), asked.copy()
        for one in side:
            span_s = np.float32(self.plate.time_s - one.time_s)
            way = span_s * self.velocity * self.moves
            across, down = self.x - way[0], self.y - way[1] - np.float32(one.first)
            within = left & _inside(down, len(one.image)) & _inside(across, self.plate.shape[1])
            if within.any():
                within &= self.moves | ~self._hidden(span_s)
                made[within] = _between(one, across, down, self.plate.saturation)[within]
                away_s[within] = np.abs(span_s)
                left &= ~within
            if not left.any():
                break
        return made, away_s

    def _hidden(self, span_s: Floats | np.float32) -> Flags:
        """Return what stands and was hidden so long before the instant by what moves."""
        since_s = span_s - np.float32(self.plate.time_s - self.motion.time_s)  # what moves is known of then
        x, y = self.x + since_s * self.velocity[0], self.y + since_s * self.velocity[1]
        return _moves(self.motion, self.plate, x, y) & ~self.moves

    def _blended(self, before: tuple[Image, Floats], after: tuple[Image, Floats]) -> Image:
        """Return both by how near they are, or the nearer one where they show different things."""
        (one, since_s), (other, until_s) = before, after
        both = np.isfinite(since_s) & np.isfinite(until_s)
        apart = brightest_channel(np.abs(other - one)) > ALIKE * brightest_channel(np.maximum(one, other)) + DARK
        share = (since_s > until_s).astype(np.float32)
        some = both & ~apart
        share[some] = since_s[some] / np.maximum(since_s[some] + until_s[some], LEAST_S)
        wide = share.reshape(*share.shape, *[1] * (one.ndim - 2))
        return np.asarray(one + wide * (other - one), np.float32)


def _inside(places: Floats, size: int) -> Flags:
    return np.asarray((places >= -HALF) & (places <= np.float32(size) - HALF))


def _between(lent: LentRows, across: Floats, down: Floats, saturation: float) -> Image:
    """Return a picture between its pixels; what lies beside clipped ones is clipped."""
    made = cv2.remap(lent.image, across, down, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    if lent.most < saturation:
        return np.asarray(made, np.float32)
    full = (lent.image >= saturation).astype(np.float32)
    near = cv2.remap(full, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.where(near > 0, np.maximum(made, np.float32(saturation)), made)


def _on_grid(motion: Followed, plate: LightPlate, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    high, wide = (np.float32(many / few) for many, few in zip(plate.shape[:2], motion.moves.shape, strict=True))
    return (x + HALF) / wide - HALF, (y + HALF) / high - HALF


def _velocity(motion: Followed, plate: LightPlate, x: Floats, y: Floats) -> Floats:
    """Return how fast what moves at places or nearest to them goes, in pixels of the plate per second."""
    grid = _on_grid(motion, plate, x, y)
    size = [many / few for many, few in zip(plate.shape[1::-1], motion.moves.shape[::-1], strict=True)]
    planes = [
        cv2.remap(plane, *grid, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE) * np.float32(per)
        for plane, per in zip(motion.nearby, size, strict=True)
    ]
    return np.stack(planes)


def _moves(motion: Followed, plate: LightPlate, x: Floats, y: Floats) -> Flags:
    grid, moves = _on_grid(motion, plate, x, y), motion.moves.astype(np.uint8)
    return np.asarray(cv2.remap(moves, *grid, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)) > 0
