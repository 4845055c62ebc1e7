"""The coarse grid of points at which a surface is judged, and means over squares of it.

What speaks against normals is smooth, and noise is not: so it is looked for at every nth row and column, and around
every such point.
"""

import functools
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import thin
from psvideo.model.arrays import Bytes, Floats
from psvideo.model.surface import Surface

AROUND, FAR_AROUND, LEAST_AROUND = 0.1, 0.5, 7
"""The rest is looked at around a point, over such shares of the subject's size (the root of its points), whatever the
picture's, and over no less than this many points: their residuals are of noise as well."""


@dataclass(frozen=True, kw_only=True)
class ThinSurface:
    """Every ``step``-th row and column of a surface, and errors there in degrees: what noise makes, what residuals
    predict, and what they would predict of nothing but noise. ``noisier``: by how much the square of noise is larger
    than that, as repeats show it (``repeats.py``); None where they do not."""

    step: int
    surface: Surface
    noise_deg: Floats
    fit_deg: Floats
    fit_of_noise_deg: Floats
    noisier: Floats | None = None

    @cached_property
    def planes(self) -> Floats:
        """The normals, (3, row, col)."""
        return np.ascontiguousarray(np.moveaxis(self.surface.normals, -1, 0), np.float32)

    @cached_property
    def brightness(self) -> Floats:
        """Albedo (row, col), of three channels their mean."""
        return brightness(self.surface.albedo)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Where there is a normal."""
        return self.surface.valid

    @cached_property
    def widths(self) -> tuple[int, int]:
        """How many points are around a point, and far around."""
        return width_of(self.known, AROUND), width_of(self.known, FAR_AROUND)

    @cached_property
    def known_bytes(self) -> Bytes:
        """The same, as compiled loops take it."""
        return np.ascontiguousarray(self.surface.valid).view(np.uint8)


def every_nth(surface: Surface, step: int) -> Surface:
    """Return every ``step``-th row and column of a surface as it was solved, in new memory."""
    return replace(
        surface,
        normals=thin(surface.normals, step),
        albedo=thin(surface.albedo, step),
        valid=surface.valid[::step, ::step],
        residual=None if surface.residual is None else thin(surface.residual, step),
        error_deg=None if surface.error_deg is None else thin(surface.error_deg, step),
        source=None,
    )


def width_of(known: NDArray[np.bool_] | Floats, share: float) -> int:
    """Return how many points, an odd number, are a share of the size of a subject of all ``known`` ones."""
    return max(int(share * np.sqrt(np.count_nonzero(known))) // 2 * 2 + 1, LEAST_AROUND)


def brightness(albedo: NDArray[np.floating]) -> Floats:
    """Return albedo (row, col), of three channels their mean."""
    if albedo.ndim == 2:
        return np.asarray(albedo, np.float32)
    total = functools.reduce(np.add, np.moveaxis(albedo, -1, 0).astype(np.float32))  # numpy is slow along a short axis
    return np.asarray(total / np.float32(albedo.shape[-1]), np.float32)


def line(plane: Floats) -> Floats:
    """Return a plane as one line of float32, in the same memory where it is one."""
    return np.ascontiguousarray(plane, np.float32).reshape(-1)


def blurred(planes: Floats, width: int, into: Floats | None = None) -> Floats:
    """Return means of planes, (row, col) or (plane, row, col), over squares beyond whose borders there is nothing; they
    lie ``into`` other memory of that shape, if any is given."""
    means: Floats = np.empty(planes.shape, np.float32) if into is None else into
    each = (picture.reshape(-1, *planes.shape[-2:]) for picture in (planes, means))
    for given, mean in zip(*each, strict=True):
        cv2.blur(given, (width, width), mean, borderType=cv2.BORDER_CONSTANT)
    return means
