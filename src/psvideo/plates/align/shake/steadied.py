"""Sketches shifted to where the picture is at an instant, and what plates are taken from that lie elsewhere."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Codes8
from psvideo.plates.align.light_history import DueInstant, Held
from psvideo.plates.align.pixel_sources import outside
from psvideo.plates.align.shake.camera_path import CameraPath, camera_path
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.align.velocity.moving_kernel import AFTER, AT_REST, BEFORE, BOTH, NOWHERE

Shifts = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class Steadied:
    """The camera's ``path`` about an instant, and the ``shape`` (row, col) of the sketches that it was found with."""

    path: CameraPath
    instant_s: float
    shape: tuple[int, ...]

    def pair(self, pair: Pair) -> Pair:
        """Return a light's sketches as if the camera had stood where it is at the instant."""
        return Pair(before=self._sketch(pair.before), after=self._sketch(pair.after))

    def shifts(self, before_s: float, after_s: float) -> Shifts:
        """Return how far the picture of two plates lies to the right and down of the instant's, as a share of its width
        and height."""
        one, other = ((float(x), float(y)) for x, y in (self._px(at) / self.shape[::-1] for at in (before_s, after_s)))
        return one, other

    def source(
        self, source: Codes8, motion: Followed, times_s: tuple[float, float], there: tuple[bool, bool]
    ) -> Codes8:
        """Return what is taken of the plates of ``times_s``: the nearer one moved, where it would be taken as it is;
        the other one, where the picture of the first ended; and nothing where neither is ``there``."""
        nearer = BEFORE if motion.time_s - times_s[0] <= times_s[1] - motion.time_s else AFTER
        gone = []
        for time_s, held in zip(times_s, there, strict=True):
            shift = (self._px(time_s) / motion.step).astype(np.float32)
            way = motion.way(motion.time_s - time_s) - shift[:, None, None]
            gone.append(outside(way) if held else np.ones_like(motion.moves))
        taken = np.where(source == AT_REST, np.uint8(nearer), source)
        taken[gone[0] & np.isin(taken, (BEFORE, BOTH))] = AFTER
        taken[gone[1] & np.isin(taken, (AFTER, BOTH))] = BEFORE
        taken[gone[0] & gone[1]] = NOWHERE
        return taken

    def per_s(self, step: int) -> tuple[float, float]:
        """Return how fast the picture goes at the instant, right and down, in pixels of ``step`` of the sketches'."""
        right, down = self.path.per_s(self.instant_s) / step
        return float(right), float(down)

    def _px(self, time_s: float) -> NDArray[np.float64]:
        return self.path.shift_px(time_s, self.instant_s)

    def _sketch(self, sketch: Sketch) -> Sketch:
        right, down = -self._px(sketch.time_s)
        way = np.array([[1, 0, right], [0, 1, down]], np.float64)
        size = self.shape[::-1]
        seen = np.ascontiguousarray(np.broadcast_to(sketch.seen, self.shape)).view(np.uint8)
        shown = cv2.warpAffine(255 * seen, way, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        codes = cv2.warpAffine(sketch.codes, way, size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        filled = sketch.filled
        if sketch.filled is not None:
            moved = cv2.warpAffine(sketch.filled, way, size, flags=cv2.INTER_NEAREST, borderMode=cv2.BORDER_REPLICATE)
            filled = np.asarray(moved, np.uint8)
        return replace(sketch, codes=np.asarray(codes, np.uint8), seen=np.asarray(shown > 127), filled=filled)


def steady_at(held: Held, instant: DueInstant, pairs: Sequence[Pair]) -> Steadied | None:
    """Return where the picture is at an instant as a whole, None where the camera does not shake, where a light stood
    still all the same, or where a part of the plates comes from other rounds, and so from elsewhere. ``pairs`` are
    those of lights under which something moves, in their order."""
    given, every = iter(pairs), list[Pair]()
    for light in held.lights:
        own = held.shots[light][instant.round]
        if light in instant.moving:
            every.append(next(given))
        elif own.sketch is not None and own.time_s == instant.time_s:
            every.append(Pair(before=own.sketch, after=own.sketch))
    if len(every) < len(held.lights) or any(not plate.own.all() for plate in held.plates_of(instant)):
        return None
    path = camera_path(every, held.lamps)
    return None if path is None else Steadied(path=path, instant_s=instant.time_s, shape=pairs[0].before.codes.shape)
