"""What repeats show of noise: where nothing changed from one round to the next, normals differ by noise alone.

Plates show their noise by their finest detail. A codec takes that away and leaves coarser errors, which neighbours
share: they are many times what detail shows, and grow where there is texture. Lamps that flicker turn normals too.
Whatever it is, normals that were measured twice show it.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.arrays import Flags, Floats, Mask
from psvideo.solve.normals.evidence import Indirect
from psvideo.solve.normals.trust.thin_surface import ThinSurface

HELD = 0.68
"""Predicted errors of noise hold for this share of normals."""
PLAIN, USUAL = 0.91, 1.05
"""Without compression so many normals change by no more than the first of these times what is predicted (0.88 to 0.95
was seen); in a square, by chance, by up to the second."""
SQUARE_PX, ENOUGH, FEW = 12, 64, 10
"""Noise is looked at in squares of so many points, where so many of them stand still, if so many squares do."""
CODED_WORSE = 0.8
"""Elsewhere it is as large as in so many of these squares: a codec's is larger where something moves."""
MOST = 8.0
"""Noise is no more than so many times what detail shows: the rest has other reasons."""


@dataclass(frozen=True, kw_only=True)
class Repeat:
    """A round's normals (row, col, 3) at the points, where they are ``known``, and by how many degrees noise would turn
    them; (row, col)."""

    normals: Floats
    noise_deg: Floats
    known: Mask

    @classmethod
    def of(cls, points: ThinSurface, indirect: Indirect) -> "Repeat":
        """Return what one round leaves for the next one to be compared with."""
        noise_deg = points.noise_deg * np.sqrt(indirect.wider)
        normals = np.asarray(points.surface.normals, np.float32)
        return cls(normals=normals, noise_deg=noise_deg, known=points.known)


def noise_times(before: Repeat, now: Repeat, stood: Flags) -> Floats | None:
    """Return by how much the square of noise is larger at every point, (row, col), than detail shows it, 1 and more, as
    two rounds show it where nothing changed in between (``stood``, on a grid of its own); None where nothing tells."""
    rows, cols = now.known.shape
    if before.known.shape != now.known.shape or min(rows, cols) < SQUARE_PX:
        return None
    grown = cv2.resize(stood.astype(np.uint8), (cols, rows), interpolation=cv2.INTER_NEAREST)
    stands = np.asarray(cv2.erode(grown, np.ones((3, 3), np.uint8)) > 0)
    noise = np.square(before.noise_deg) + np.square(now.noise_deg)
    tells = stands & before.known & now.known & (noise > 0)
    across, up, facing = np.moveaxis(now.normals - before.normals, -1, 0)
    change = across * across + up * up + facing * facing
    times = np.full(tells.shape, np.inf, np.float32)
    np.divide(change, noise * np.float32(np.radians(1) ** 2), out=times, where=tells)
    each = _in_squares(times)
    told = np.isfinite(each)
    if np.count_nonzero(told) < FEW or each[told].max() <= USUAL**2:
        return None
    each[~told] = np.quantile(each[told], CODED_WORSE)
    each = np.clip(1 + (each - np.float32(USUAL**2)) / np.float32(PLAIN**2), 1, np.float32(MOST**2))
    return np.asarray(cv2.resize(each, (cols, rows), interpolation=cv2.INTER_LINEAR), np.float32)


def _in_squares(times: Floats) -> Floats:
    """Return in every square what most of the points do not exceed; infinite where few tell it."""
    down, over = (size // SQUARE_PX for size in times.shape)
    squares = times[: down * SQUARE_PX, : over * SQUARE_PX].reshape(down, SQUARE_PX, over, SQUARE_PX)
    ordered = np.sort(squares.swapaxes(1, 2).reshape(down, over, -1), axis=-1)
    counts = np.isfinite(ordered).sum(axis=-1)
    places = (HELD * np.maximum(counts - 1, 0)).round().astype(np.intp)
    found = np.take_along_axis(ordered, places[..., None], axis=-1)[..., 0]
    return np.where(counts >= ENOUGH, found, np.float32(np.inf))
