"""Sketches shifted to where the picture is at an instant, and what plates are taken from that lie elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Codes8
from psvideo.plates.align.light_history import DueInstant, Held
from psvideo.plates.align.pixel_sources import outside
from psvideo.plates.align.shake.camera_path import CameraPath, camera_path
from psvideo.plates.align.velocity.brightness import evened
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.align.velocity.moving_kernel import AFTER, AT_REST, BEFORE, BOTH, NOWHERE
from psvideo.plates.light_plate import LightPlate

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


def steady_at(held: Held, instant: DueInstant, pairs: Mapping[str, Pair]) -> Steadied | None:
    """Return where the picture is at an instant as a whole, None where the camera does not shake, or where a part of
    the plates comes from other rounds, and so from elsewhere. ``pairs`` are those of lights under which something
    moves.

    Under other lights both plates lie on each other by chance, as where a hand turns back, but not where the picture is
    at the instant: those that were handed on as they are, are taken back.
    """
    every = [pairs.get(light) or _pair_that_stood(held, light, instant) for light in held.lights]
    known = [pair for pair in every if pair is not None]
    stood = [light for light in held.lights if light not in pairs and not _shows(held, light, instant)]
    plates = [*held.plates_of(instant), *(held.own_shot(light, instant).plate for light in stood)]
    if len(known) < len(every) or not all(plate is not None and _is_whole(plate) for plate in plates):
        return None
    path = camera_path(known, held.lamps)
    if path is None:
        return None
    for light in stood:
        held.take_back(light, instant)
    return Steadied(path=path, instant_s=instant.time_s, shape=known[0].before.codes.shape)


def _is_whole(plate: LightPlate) -> bool:
    return not plate.brought and bool(plate.own.all())


def _shows(held: Held, light: str, instant: DueInstant) -> bool:
    return held.shots[light][instant.round].time_s == instant.time_s


def _pair_that_stood(held: Held, light: str, instant: DueInstant) -> Pair | None:
    shots = held.pair_around(light, instant)
    if shots is None or shots[0].sketch is None or shots[1].sketch is None:
        return None
    before, after = shots[0].sketch, shots[1].sketch
    return Pair(before=before, after=before if after is before else evened(before, after))
