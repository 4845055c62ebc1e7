"""Where plates as they are show one surface, and plates brought to an instant do not: nothing is moved there.

Flow that fits by chance, and a blend of two plates between which an edge passed, turn normals. Of four lights and more
one normal and one albedo tell: they explain the plates of all lights where these show the same surface, once what near
ones send is evened out (``plate_lamps``). Where most lights show that nothing passed, what changes under the others is
a shadow, and nothing is moved there either.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Flags
from psvideo.plates.align.as_they_are_kernel import SOLVED, leave_rows
from psvideo.plates.align.doubt.lone_edges import InstantSketch
from psvideo.plates.align.doubt.unsure import unsure_of
from psvideo.plates.align.pixel_sources import Taken
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.all_lights import STILL_SHARE
from psvideo.plates.align.velocity.brightness import EVERY_CODE, SCALE, light_of
from psvideo.plates.align.velocity.flow import TOE, all_of, comparable
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.align.velocity.moving_kernel import AT_REST, NOWHERE

LEFT = np.float32(0.5)
"""Plates as they are must leave less than this share of what moved ones leave, beyond what is usual."""
MATTE = 0.03
"""Surfaces that stand still leave this share of their albedo: they are not quite matte, and rigs are a little off."""
WINDOW_PX, AROUND_PX = 3, 7
"""What is left is compared over the first; most of what lies within the second must agree."""
LEAST_LIT = 0.03
"""What shows less light, as a share of white, is in shadow."""
BAND_PIXELS = 1 << 15


@dataclass(frozen=True, kw_only=True)
class BothWays:
    """A light's sketches at an instant: of the plate as it is, and of what was brought to the instant."""

    rest: InstantSketch
    moved: InstantSketch

    @classmethod
    def standing(cls, sketch: InstantSketch) -> "BothWays":
        """Return those of a light under which nothing moved."""
        return cls(rest=sketch, moved=sketch)


def nearest_of(pair: Pair, motion: Followed) -> InstantSketch:
    """Return what the nearer plate of a pair shows as it is, on the velocities' grid."""
    since_s, until_s = motion.time_s - pair.before.time_s, pair.after.time_s - motion.time_s
    nearer = pair.before if since_s <= until_s else pair.after
    return InstantSketch.standing(nearer, motion.moves.shape)


def fits_as_it_is(lamps: Lamps, lights: Sequence[BothWays]) -> Flags:
    """Return where one surface explains the plates as they are, and not those brought to the instant, (row, col).
    ``lights`` come in the order of the lamps."""
    rest, moved = (np.stack([getattr(one, way).codes for one in lights]) for way in ("rest", "moved"))
    whites = np.array([one.rest.white for one in lights])
    light = light_of(EVERY_CODE).astype(np.float64) * whites[:, None]
    noise = max(one.moved.noise for one in lights) / np.sqrt(2)
    variance = (2 * noise / SCALE) ** 2
    floor = LEAST_LIT * whites.max() / np.linalg.norm(lamps.matrix, axis=1).mean()
    factors = np.array([MATTE**2, 2 * variance * whites.mean(), 2 * variance * TOE * whites.mean() ** 2, floor])
    left, evening = np.empty((3, *rest.shape[1:]), np.float32), lamps.evenings(rest.shape[1:])

    def run(first: int, last: int) -> None:
        leave_rows(rest, moved, light, lamps.matrix, evening, LEAST_LIT * whites, factors, first, last, left)

    over_ranges(run, left.shape[1], each=max(BAND_PIXELS // left.shape[2], 1))
    own, theirs, usual = (cv2.blur(plane, (WINDOW_PX, WINDOW_PX)) for plane in left)
    fits = own < LEFT * theirs - usual
    share = cv2.blur(fits.astype(np.float32), (AROUND_PX, AROUND_PX))
    return np.asarray(share > np.float32(0.5))


def stands_under(motion: Followed, lights: int) -> Flags:
    """Return what stands still, (row, col): most of so many ``lights`` show it unchanged.

    What passes within a round changes every light: those before it differ from their next plate, those after it from
    their last one. So what changes under few of them is their shadow, and leaves the surface as it is.
    """
    return np.asarray(~motion.moves & (motion.unchanged >= max(SOLVED, STILL_SHARE * lights)))


@dataclass(frozen=True, kw_only=True)
class AsTheyAre:
    """Where all lights keep their nearer plate, (row, col): ``fits``, where only so they show one surface, and
    ``stands``, where nothing but shadows passed."""

    fits: Flags
    stands: Flags

    def taken(self, one: Taken, pair: Pair, motion: Followed) -> Taken:
        """Return what is taken of a light's plates; ``motion`` no longer moves there. What stands is as sure as without
        motion."""
        if not (still := self.fits | self.stands).any():
            return one
        unsure = one.unsure
        if self.fits.any():
            two, shape = comparable(pair.before, pair.after), motion.moves.shape[::-1]
            before, after = (cv2.resize(codes, shape, interpolation=cv2.INTER_AREA).astype(np.uint8) for codes in two)
            unsure = np.where(self.fits, unsure_of(pair, before, after, motion, one.shows.noise), unsure)
        codes = np.where(still, nearest_of(pair, motion).codes, one.shows.codes)
        return replace(
            one,
            source=np.where(still, np.uint8(AT_REST), one.source),
            unsure=np.where(self.stands, np.float32(0), unsure),
            shows=replace(one.shows, codes=codes),
        )

    def source(self, one: Taken, own: Codes8) -> Codes8:
        """Return what a light's pixels come from, ``own`` elsewhere. What was left out of what stands stays so: enough
        other lights are sure."""
        return np.where(self.fits | (self.stands & (own != NOWHERE)), one.source, own)


def seen_by_all(pairs: Sequence[Pair], motion: Followed) -> Flags:
    """Return which of the velocities' pixels the nearer plates of all lights show, (row, 1), or (row, col) where the
    picture was turned."""
    seen = np.ones((motion.moves.shape[0], 1), np.bool_)
    for pair in pairs:
        since_s, until_s = motion.time_s - pair.before.time_s, pair.after.time_s - motion.time_s
        seen = seen & all_of((pair.before if since_s <= until_s else pair.after).seen, motion.step)
    return seen
