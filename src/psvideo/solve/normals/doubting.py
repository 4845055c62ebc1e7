"""What may turn normals beyond noise: surfaces that are not matte, a rig that is wrong, light from around.

Three signs are looked for on a coarse grid, and around every pixel, since they are smooth where noise is not. What the
lights leave unexplained says how far the model is from the surface. Light that shows where a lamp does not reach came
by way of other surfaces, which light everything alike and leave no residual. And where either is, edges and creases are
worse than what is around them.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.surface import Surface
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.task import Floats, Samples, Task

GRID_PX = 480
"""The grid has at most so many points along the longer side."""
NEAR, AROUND = 9, 27
"""Bends are angles to the mean of a square of so many points; the rest is averaged over the larger one."""
MOST_FIT_DEG = np.float32(12)
"""What residuals predict counts as no more around a point: a line of rows that went wrong is not its surroundings."""
LEAST_LIGHTS = 0.02
"""So many lights that do not reach a point, in the mean, must there be for light from around to be known."""


@dataclass(frozen=True, kw_only=True)
class Doubting:
    """How much the signs count, in degrees.

    misfit_deg, misfit_power, little_deg: the error m that residuals predict beyond noise counts as m / (m + 1)^power of
        these, since it depends on which lights there are more than the true error does; hardly where it is little.
    indirect_deg, own_indirect_deg: light from around, as a share of the albedo: around a point, and in it.
    bent_share, bent_indirect_deg, most_bent_deg, sharp_deg: the angle to the mean normal times the misfit in degrees
        and the light from around, which counts as so many; both together as no more than so many, and angles as no
        more than the last.

    Fitted together, and rounded, on a ball, a bear and a cat (DiLiGenT), a sphere (Washington), and 16 virtual subjects
    of seven materials with light between their surfaces, under 5 to 96 lights and rigs that were off by up to 3
    degrees; none of them was left out to test the others.
    """

    misfit_deg: float = 2.5
    misfit_power: float = 0.65
    little_deg: float = 0.5
    indirect_deg: float = 26.0
    own_indirect_deg: float = 38.0
    bent_share: float = 0.055
    bent_indirect_deg: float = 100.0
    most_bent_deg: float = 20.0
    sharp_deg: float = 80.0


@dataclass(frozen=True, kw_only=True)
class ThinSurface:
    """Every ``step``-th row and column of a surface, and errors there in degrees: what noise makes, what residuals
    predict, and what they would predict of nothing but noise."""

    step: int
    surface: Surface
    noise_deg: Floats
    fit_deg: Floats
    fit_of_noise_deg: Floats

    @property
    def known(self) -> NDArray[np.bool_]:
        """Where there is a normal."""
        return self.surface.valid


def step_of(shape: tuple[int, ...]) -> int:
    """Return how many rows and columns of a picture lie between two points."""
    return max(-(-max(shape[:2]) // GRID_PX), 1)


def doubt_deg(points: ThinSurface, one: Evidence, surface: Surface, *, how: Doubting = Doubting()) -> Floats:
    """Return by how many degrees normals may be off beyond noise, (row, col) of the points."""
    weight = points.known.astype(np.float32)
    near, around = (_mean(weight, width) for width in (NEAR, AROUND))
    fit = np.minimum(points.fit_deg, MOST_FIT_DEG)
    squares = np.where(points.known, fit**2 - points.fit_of_noise_deg**2, np.float32(0))
    misfit = np.sqrt(np.maximum(_mean(squares, AROUND) / around, 0))
    sums, counts = _indirect(points, one, surface)
    noise = np.radians(points.noise_deg)
    indirect = np.maximum(_mean(sums, AROUND) / np.maximum(_mean(counts, AROUND), LEAST_LIGHTS), 0)
    own = np.maximum(sums / np.maximum(counts, 1) - noise, 0)
    bent = np.sqrt(np.maximum(_bent_deg(points, near) ** 2 - points.noise_deg**2, 0))
    both = misfit + np.float32(how.bent_indirect_deg) * indirect
    both /= 1 + both / np.float32(how.most_bent_deg)
    bent /= 1 + bent / np.float32(how.sharp_deg)
    doubt = misfit**2 / (misfit + np.float32(how.little_deg)) / (misfit + 1) ** np.float32(how.misfit_power)
    doubt *= np.float32(how.misfit_deg)
    doubt += np.float32(how.bent_share) * both * bent
    doubt += np.float32(how.indirect_deg) * indirect + np.float32(how.own_indirect_deg) * own
    return np.asarray(doubt, np.float32)


def _bent_deg(points: ThinSurface, near: Floats) -> Floats:
    """Return the angle between every normal and the mean of those around it."""
    planes = [points.surface.normals[..., axis].astype(np.float32) for axis in range(3)]
    means = [_mean(plane, NEAR) / near for plane in planes]
    along = sum(plane * mean for plane, mean in zip(planes, means, strict=True))
    length = np.sqrt(sum(mean * mean for mean in means))
    cosine = along / np.maximum(length, np.float32(1e-6))
    return np.asarray(np.degrees(np.sqrt(np.maximum(2 - 2 * cosine, 0))), np.float32)


def _mean(plane: Floats, width: int) -> Floats:
    """Return means over squares; of nothing a little, so that it can be divided by."""
    return np.asarray(cv2.blur(plane, (width, width), borderType=cv2.BORDER_CONSTANT) + np.float32(1e-9), np.float32)


def _indirect(points: ThinSurface, one: Evidence, surface: Surface) -> tuple[Floats, Floats]:
    """Return at every point the light from lamps that do not reach it, in units of albedo, summed, and their number."""
    from psvideo.solve.normals.judging_kernel import indirect_rows
    from psvideo.solve.normals.kernel import working_memory

    sums, counts = np.zeros_like(points.noise_deg), np.zeros_like(points.noise_deg)
    planes, albedo = stored(surface)

    def look(given: Task, first: int, last: int) -> None:
        indirect_rows(given, working_memory(given), planes, albedo, sums, counts, first, last, points.step)

    one.in_bands(look, step=points.step)
    return sums, counts


def stored(surface: Surface) -> tuple[Samples, Samples]:
    """Return normals (3, row, col) and albedo (channel, row, col) as compiled loops take them, in the same memory."""
    albedo = surface.albedo
    return bits(np.moveaxis(surface.normals, -1, 0)), bits(
        albedo[None] if albedo.ndim == 2 else np.moveaxis(albedo, -1, 0)
    )


def bits(planes: NDArray[np.floating]) -> Samples:
    """Return numbers as compiled loops take them: half floats as their bits."""
    return planes.view(np.uint16) if planes.dtype == np.float16 else planes
