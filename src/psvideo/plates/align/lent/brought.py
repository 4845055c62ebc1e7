"""Rows of other flashes moved to the instant of the plate that lacks them, along how everything moves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from psvideo.model.arrays import Flags, Floats, Image
from psvideo.plates.align.velocity.flow import pixel_places
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of


@dataclass(frozen=True, kw_only=True)
class LentRows:
    """Rows in one piece that a flash showed, from the ``first`` on, and when."""

    image: Image
    first: int
    time_s: float


@dataclass(frozen=True, kw_only=True)
class _Motion:
    """How everything moves at a plate's instant, on its pixels: the velocity of what moves there or nearest, (2, row,
    col) in pixels per second, and what moves, (row, col)."""

    velocity: Floats
    moves: Flags

    @classmethod
    def at(cls, motion: Followed, time_s: float, shape: tuple[int, int]) -> "_Motion":
        way = np.float32(time_s - motion.time_s) * motion.nearby
        x, y = pixel_places(*motion.moves.shape)
        x, y = x - way[0], y - way[1]
        moves = cv2.remap(motion.moves.astype(np.uint8), x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
        scale = [np.float32(many / few) for many, few in zip(shape[::-1], motion.moves.shape[::-1], strict=True)]
        planes = [
            cv2.resize(cv2.remap(plane, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), shape[::-1]) * per
            for plane, per in zip(motion.nearby, scale, strict=True)
        ]
        moves = cv2.resize(moves, shape[::-1], interpolation=cv2.INTER_NEAREST)
        return cls(velocity=np.stack(planes), moves=moves > 0)


MOST_S = 0.2
ALIKE = np.float32(0.15)


def brought(plate: LightPlate, own: Flags, lent: Sequence[LentRows], motion: Followed) -> LightPlate:
    """Return a plate whose rows that are not its ``own`` (row,) are moved to its instant."""
    rows, cols = plate.shape[:2]
    at = _Motion.at(motion, plate.time_s, (rows, cols))
    image, seen = plate.image.copy(), np.array(plate.pixels_seen)
    lacks = ~own[:, None] & np.ones((1, cols), np.bool_)
    sides = []
    for later in (False, True):
        given = [one for one in lent if (one.time_s > plate.time_s) == later]
        given.sort(key=lambda one: abs(one.time_s - plate.time_s))
        sides.append(_moved(image, lacks, given, at, plate))
    (before, first_s), (after, then_s) = sides
    there, then = np.isfinite(first_s), np.isfinite(then_s)
    share = np.where(there & then, first_s / np.maximum(first_s + then_s, 1e-9), np.where(there, 0, 1)).astype(np.float32)
    differ = np.abs(after - before).reshape(rows, cols, -1).max(axis=2)
    most = np.maximum(after, before).reshape(rows, cols, -1).max(axis=2)
    apart = there & then & (differ > ALIKE * most + 0.01)
    share = np.where(apart, (first_s > then_s), share).astype(np.float32)
    wide = share if image.ndim == 2 else share[..., None]
    made = before * (1 - wide) + after * wide
    affected = lacks & (at.moves | _hidden(at, lent, plate, lacks))
    known = affected & (there | then)
    image[known] = made[known]
    seen &= ~(affected & ~known)
    return replace(
        plate,
        picture=mixture_of(image),
        seen=seen if not seen.all(axis=1)[plate.rows_seen].all() else plate.seen,
        brought=True,
    )


def _hidden(at: _Motion, lent: Sequence[LentRows], plate: LightPlate, lacks: Flags) -> Flags:
    hidden = np.zeros_like(lacks)
    shown_s = plate.flashed_s.astype(np.float32)[:, None]
    return hidden | _covered(at, (np.float32(plate.time_s) - shown_s))


def _covered(at: _Motion, span_s: Floats | np.float32) -> Flags:
    """Return what something that moves hides so long before the instant, of what stands."""
    x, y = pixel_places(*at.moves.shape)
    x, y = x + at.velocity[0] * span_s, y + at.velocity[1] * span_s
    there = cv2.remap(at.moves.astype(np.uint8), x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray((there > 0) & ~at.moves)


def _moved(image: Image, lacks: Flags, given: Sequence[LentRows], at: _Motion, plate: LightPlate):
    made, away_s = np.zeros_like(image), np.full(lacks.shape, np.inf)
    left = lacks.copy()
    x, y = pixel_places(*lacks.shape)
    for one in given:
        span_s = plate.time_s - one.time_s
        if abs(span_s) > MOST_S:
            break
        if not left.any():
            break
        way = np.float32(span_s) * at.velocity * at.moves
        across, down = x - way[0], y - way[1] - np.float32(one.first)
        within = left & (down >= -0.5) & (down <= len(one.image) - 0.5) & (across >= -0.5) & (across <= lacks.shape[1] - 0.5)
        within &= at.moves | ~_covered(at, np.float32(span_s))
        if not within.any():
            continue
        got = cv2.remap(one.image, across, down, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        if one.image.max() >= plate.saturation:
            full = (one.image >= plate.saturation).astype(np.float32)
            near = cv2.remap(full, across, down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
            got = np.where(near > 0, np.maximum(got, plate.saturation), got)
        made[within] = got[within]
        away_s[within] = abs(span_s)
        left &= ~within
    return made, away_s
