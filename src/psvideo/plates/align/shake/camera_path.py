"""Where the picture was at every flash around an instant, as a whole: a camera in the hand shifts it.

Plates of one light, a round apart, show how far it went in between, to a few hundredths of a pixel. Plates of two
lights that follow each other show it by paint and outlines, but shading seems shifted too: by tenths of a pixel where
there is paint, by several pixels where all is bare. So where one surface explains the pictures of known lights the
places are those at which it does.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Doubles, Floats
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.shake.by_paint import places_by_paint
from psvideo.plates.align.shake.one_surface import OneSurface
from psvideo.plates.align.shake.registered import registered, roughly, shifted
from psvideo.plates.align.shake.shifting_picture import explained_by, stirs
from psvideo.plates.align.velocity.between_lights import MIDDLE, edges_of
from psvideo.plates.align.velocity.brightness import light_of
from psvideo.plates.align.velocity.flow import FINE_PIXELS, Sketch
from psvideo.plates.align.velocity.followed import Pair

FEWEST, SMALLEST_PX = 3, 64
"""So many lights, and pictures so wide and high."""
SHAKES_PX = 0.1
"""What goes on by less more or less from light to light, in the pictures that are compared, has one velocity, and is
followed by it."""
FITS, SURELY = 0.7, 0.05
"""One surface must leave less than the first along the path, as a share of what it leaves of the pictures as they are,
and less than the second of all: photographs of what is not matte leave 0.12 to 0.6, at places 1 to 5 px beside."""


@dataclass(frozen=True, kw_only=True)
class CameraPath:
    """Where the picture was, ``places_px`` (flash, 2), right and down in pixels of the sketches, at ``times_s``
    (flash,), ascending."""

    times_s: Doubles
    places_px: Doubles

    def shift_px(self, time_s: float, instant_s: float) -> Doubles:
        """Return how far to the right and down things are at a time of where they are at an instant, (2,)."""
        return self._at(time_s) - self._at(instant_s)

    def per_s(self, instant_s: float) -> Doubles:
        """Return how fast the picture goes on at an instant, over the time from flash to flash, (2,)."""
        half_s = float(np.median(np.diff(self.times_s))) / 2
        return (self._at(instant_s + half_s) - self._at(instant_s - half_s)) / (2 * half_s)

    def _at(self, time_s: float) -> Doubles:
        """The place on the cubic through the two flashes before and after."""
        first = int(np.clip(np.searchsorted(self.times_s, time_s) - 2, 0, len(self.times_s) - 4))
        near = slice(first, first + 4)
        times = self.times_s[near]
        share = [np.prod([(time_s - b) / (a - b) for b in times if b != a]) for a in times]
        return np.asarray(np.array(share) @ self.places_px[near], np.float64)


def camera_path(pairs: Sequence[Pair], lamps: Lamps | None = None) -> CameraPath | None:
    """Return where the picture was at every flash of pairs, one for each light; None where it does not shift as a
    whole, or by one velocity. A light that shows the very instant has twice the same sketch. ``lamps`` are those of the
    pairs, in their order, where they are known."""
    moved = [pair for pair in pairs if len(_shown(pair)) > 1]
    if len(pairs) < FEWEST or len(moved) < FEWEST - 1 or not stirs(moved):
        return None
    scale = 2 if pairs[0].before.codes.size >= FINE_PIXELS else 1
    if min(pairs[0].before.codes.shape) < SMALLEST_PX * scale:
        return None
    details = over_ranges(lambda n, _: tuple(_detail(one, scale) for one in _shown(pairs[n])), len(pairs), each=1)
    both = [each for each in details if len(each) > 1]
    near = over_ranges(lambda n, _: roughly(*both[n]), len(both), each=1)
    if _apart_px(np.array(near)) < SHAKES_PX / 2:
        return None
    own = over_ranges(lambda n, _: registered(details[n][0], details[n][-1]), len(details), each=1)
    shifts = np.array([one.px for one in own])
    ways = shifts[[len(each) > 1 for each in details]]
    if _apart_px(ways) < SHAKES_PX or not explained_by(both, ways):
        return None
    times = np.array([sketch.time_s for pair in pairs for sketch in _shown(pair)])
    firsts = np.cumsum([0, *(len(each) for each in details[:-1])])
    places, painted = places_by_paint(times, [one for each in details for one in each], firsts, shifts)
    found = places if painted else None
    if (
        lamps is not None
        and lamps.checked
        and (sure := _by_surface(lamps, pairs, shifts, places[firsts], scale)) is not None
    ):
        found = sure
    if found is None:
        return None
    order = np.argsort(times, kind="stable")
    return CameraPath(times_s=times[order], places_px=scale * found[order])


def _by_surface(
    lamps: Lamps, pairs: Sequence[Pair], shifts: Doubles, guess: Doubles, scale: int
) -> NDArray[np.float64] | None:
    """Return the places of all flashes, (flash, 2), where one surface explains them; None where none does. ``shifts``
    (light, 2) are those between each pair, and ``guess`` where the first of it may be."""
    light = [_light(pair, way, scale) for pair, way in zip(pairs, shifts, strict=True)]
    light = [one * own for one, own in zip(light, lamps.evenings(light[0].shape), strict=True)]
    surface = OneSurface.of(light, [pair.before.white for pair in pairs], lamps.matrix)
    none = np.zeros_like(shifts)
    firsts = min((surface.refined(way) for way in (none, guess - guess.mean(axis=0))), key=surface.left)
    if surface.left(firsts) > min(FITS * surface.left(none), SURELY):
        return None
    ends = zip(firsts, firsts + shifts, pairs, strict=True)
    return np.array([place for one, other, pair in ends for place in (one, other)[: len(_shown(pair))]])


def _apart_px(ways: Doubles) -> float:
    """Return how far shifts (light, 2) are from their mean, a root of the mean of squares."""
    return float(np.sqrt(np.square(ways - ways.mean(axis=0)).sum(axis=1).mean()))


def _shown(pair: Pair) -> tuple[Sketch, ...]:
    return (pair.before,) if pair.before is pair.after else (pair.before, pair.after)


def _smaller(codes: Codes8, scale: int) -> Codes8:
    if scale == 1:
        return codes
    rows, cols = (size // scale for size in codes.shape)
    return np.asarray(cv2.resize(codes, (cols, rows), interpolation=cv2.INTER_AREA), np.uint8)


def _detail(sketch: Sketch, scale: int) -> Floats:
    return np.asarray(edges_of(_smaller(sketch.codes, scale)).astype(np.float32) - MIDDLE, np.float32)


def _light(pair: Pair, way: Doubles, scale: int) -> Floats:
    """Return what a light's plates show in the mean, as the one before lies, 1 = white."""
    both = (pair.before, pair.after)
    one, other = (light_of(_smaller(sketch.codes, scale).astype(np.float32)) for sketch in both)
    return np.asarray((one + shifted(other, -way)) / 2, np.float32)
