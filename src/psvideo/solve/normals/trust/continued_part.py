"""A part of a surface, and what continues from around into the pixels of it that are asked: see ``continued``."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Floats, Indices, Mask
from psvideo.model.surface import Surface

REACH_PX, NEAR_PX = 3, 1.5
"""Pixels this far around tell, by a Gaussian of the second; of large pictures, whose motion is found on a coarser grid,
every n-th one."""
ALBEDO_MARGIN = 0.02
"""What is brighter or darker than all around by more than this share is another thing: a wire before a wall."""
FEWEST, MOST_UNCERTAIN = 0.2, 3.0
"""At least this share of the window must tell; and a plane's value is no more uncertain than so many times a mean's, as
it is beside what tells."""
PAINT_DEG, FARTHEST_DEG = 10.0, 25.0
"""Where paint changes by a factor e to the next pixel, normals are off by so many degrees, and may well be by so many:
plates that lie a part of a pixel beside each other show another share of either paint each."""
LEAST_STEP, MOST_STEP = 0.2, 2.0
"""Smaller steps of paint are noise, as logarithms, and larger ones edges of shadows."""
DEPARTS_DEG = 2.5
"""At an edge of paint that is asked only of what departs from the mean around by more: looking takes long."""
GAIN, AGREES = 0.8, 1.5
"""What continues must be surer than this times the pixel's own error, and may contradict it by so many times what that
may well be."""
OF_APART = 0.4
"""So much of what it contradicts the pixel's own normal by, and paint does not explain, it may be off itself."""
LEAST_DEG, LEAST_LEVEL = 0.2, 0.01
TWO_PX, BAND_ROWS = 2, 256
"""So far away something must be sure; and so many rows of a picture are looked at together: what bounds memory."""
AT_ONCE = 4096
"""Points that a thread takes together."""


@dataclass(frozen=True, kw_only=True)
class AskedPixels:
    """What is asked: normals with errors up to ``limit_deg``, by every ``stride``-th pixel around, of whose errors the
    share ``of_around`` is common to them, and those at edges of paint as well if ``at_paint``."""

    limit_deg: float
    stride: int
    of_around: float
    at_paint: bool


@dataclass(frozen=True, kw_only=True)
class ContinuedPart:
    """What lies around the pixels that are asked: their ``places`` (point, 2) from its ``corner`` on; ``normals`` (3,
    row, col), the mean albedo, ``level``, by how much that changes, ``step``, and ``error`` in degrees, (row, col); and
    what is ``sure``, of which every ``stride``-th pixel in rows and columns is looked at."""

    places: Indices
    corner: tuple[int, int]
    normals: Floats
    level: Floats
    step: Floats
    error: Floats
    sure: Mask
    stride: int

    @classmethod
    def around(
        cls, given: tuple[Surface, NDArray[np.floating]], there: Mask | None, asked: AskedPixels, first: int
    ) -> "ContinuedPart | None":
        """Return what lies around what is asked in rows from ``first`` on of a surface, ``given`` with its errors, of
        what is ``there`` (row, col; all where None): what was solved and is not sure, and what lies at an edge of
        paint; None where nothing is."""
        (surface, error), stride = given, asked.stride
        reach = REACH_PX * stride
        rows = slice(max(first - reach, 0), min(first + BAND_ROWS + reach, len(error)))
        solved, sure = error[rows] > 0, surface.valid[rows].copy()
        if there is not None:
            solved &= there[rows]
            sure &= there[rows]
        looked = solved if asked.at_paint else solved & ~sure & _beside(sure)
        looked[: first - rows.start] = False  # other bands' rows
        looked[first + BAND_ROWS - rows.start :] = False
        if not looked.any() or not sure.any():
            return None
        spans = [np.flatnonzero(looked.any(axis=axis)) for axis in (1, 0)]
        part = tuple(slice(max(int(span[0]) - reach, 0), int(span[-1]) + reach + 1) for span in spans)
        places, sure = looked[part], np.ascontiguousarray(sure[part])
        level = _level(surface.albedo[rows][part])
        normals = np.ascontiguousarray(np.moveaxis(surface.normals[rows][part], -1, 0), np.float32)
        step = np.zeros_like(level)
        if asked.at_paint:
            step = _paint_step(level, error[rows][part] > 0, stride)
            places &= ~sure | ((step > 0) & _departs(normals, sure, 2 * reach + 1))
        return cls(
            places=np.argwhere(places).astype(np.uint32),
            corner=(rows.start + part[0].start, part[1].start),
            normals=normals,
            level=level,
            step=step,
            error=np.ascontiguousarray(error[rows][part], np.float32),
            sure=sure,
            stride=stride,
        )

    def taken(self, asked: AskedPixels) -> tuple[tuple[Indices, Indices], Floats, Floats]:
        """Return rows and columns of the points that continue, with their normals and errors in degrees."""
        normals, error_deg, takes = self.looked_at(asked)
        rows, cols = (self.places[takes] + np.array(self.corner, np.uint32)).T
        return (rows, cols), normals[takes].astype(np.float32), error_deg[takes].astype(np.float32)

    def looked_at(self, asked: AskedPixels) -> tuple[Doubles, Doubles, Mask]:
        """Return the points' normals (point, 3) and errors in degrees with what continues from around, and which of
        them are sure enough."""
        found = self._found()
        rows, cols = self.places.T
        own = self.normals[:, rows, cols].T.astype(np.float64)
        claimed_deg, steps = (plane[rows, cols].astype(np.float64) for plane in (self.error, self.step))
        onward, uncertain, share = found[:, :3], found[:, 4], found[:, 5]
        apart = np.degrees(np.arccos(np.clip((own * onward).sum(axis=1), -1, 1)))
        own_deg, most_deg = (np.hypot(claimed_deg, each * steps) for each in (PAINT_DEG, FARTHEST_DEG))
        unexplained = OF_APART * apart * np.square(claimed_deg / own_deg)
        error_deg = np.hypot(asked.of_around * found[:, 3], unexplained)
        takes = (share > FEWEST) & (uncertain < MOST_UNCERTAIN) & (error_deg <= asked.limit_deg)
        takes &= (error_deg < GAIN * own_deg) & (apart < AGREES * most_deg)
        counts = [1 / np.square(np.maximum(each, LEAST_DEG))[:, None] for each in (own_deg, error_deg)]
        mean = counts[0] * own + counts[1] * onward
        return mean / np.linalg.norm(mean, axis=1, keepdims=True), error_deg, takes

    def _found(self) -> Doubles:
        """Return what ``continue_points`` finds of all places."""
        from psvideo.solve.normals.trust.continued_kernel import AroundPoint, continue_points

        around = AroundPoint(
            normals=self.normals,
            level=self.level,
            error=self.error,
            sure=self.sure.view(np.uint8),
            near=_nearness(),
            stride=self.stride,
            margin=ALBEDO_MARGIN,
            fewest=FEWEST,
        )
        found = np.empty((len(self.places), 6))

        def look(first: int, last: int) -> None:
            continue_points(self.places, around, found, first, last)

        over_ranges(look, len(self.places), each=AT_ONCE)
        return found


def _level(albedo: NDArray[np.floating]) -> Floats:
    """Return the mean of an albedo's channels, (row, col)."""
    if albedo.ndim == 2:
        return np.ascontiguousarray(albedo, np.float32)
    level = np.zeros(albedo.shape[:2], np.float32)
    for channel in range(albedo.shape[-1]):
        level += albedo[..., channel]
    level /= np.float32(albedo.shape[-1])
    return level


def _beside(sure: Mask) -> Mask:
    """Return where something within two pixels is sure: farther off too little of a window is."""
    near = cv2.dilate(np.ascontiguousarray(sure).view(np.uint8), np.ones((2 * TWO_PX + 1,) * 2, np.uint8))
    return np.asarray(near).astype(np.bool_)


def _paint_step(level: Floats, known: Mask, stride: int) -> Floats:
    """Return by which factor paint changes around every pixel at most, as a logarithm (row, col), 0 where it does not;
    of what is ``known`` of its ``level``."""
    square = np.ones((2 * stride + 1,) * 2, np.uint8)
    least = cv2.erode(np.where(known, level, np.float32(np.inf)), square)
    most = cv2.dilate(np.where(known, level, np.float32(0)), square)
    step = np.log(np.maximum(most, LEAST_LEVEL) / np.maximum(np.minimum(least, most), LEAST_LEVEL))
    return np.asarray(np.where(step > LEAST_STEP, np.minimum(step, MOST_STEP), 0), np.float32)


def _departs(normals: Floats, sure: Mask, window_px: int) -> Mask:
    """Return where normals (3, row, col) depart from the mean of what is sure around."""
    means = [cv2.blur(plane * sure, (window_px, window_px)) for plane in normals]
    along = sum((one * mean for one, mean in zip(normals, means, strict=True)), np.float32(0))
    length = np.sqrt(sum((mean * mean for mean in means), np.float32(0)))
    return np.asarray(along < np.float32(np.cos(np.radians(DEPARTS_DEG))) * length)


def _nearness() -> Doubles:
    """Return how much pixels around count by how near they are, (2 r + 1, 2 r + 1), 0 in the middle."""
    y, x = np.mgrid[-REACH_PX : REACH_PX + 1, -REACH_PX : REACH_PX + 1]
    near = np.exp(-(x * x + y * y) / (2 * NEAR_PX * NEAR_PX))
    near[REACH_PX, REACH_PX] = 0
    return np.asarray(near, np.float64)
