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

from psvideo.compute.spilled import let_go
from psvideo.model.surface import Surface
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.task import Floats, Samples, Task

GRID_PX = 480
"""The grid has at most so many points along the longer side."""
NEAR, AROUND = 9, 27
"""Bends are angles to the mean of a square of so many points; the rest is averaged over the larger one."""
MOST_FIT_DEG = np.float32(12)
"""What residuals predict counts as no more around a point: a line of rows that went wrong is not its surroundings."""
LEAST_REACH = np.float32(0.2)
"""Where fewer lights reach, residuals of noise predict more: as if no less than this share of them did."""
LEAST_LIGHTS = 0.02
"""So many lights that do not reach a point, in the mean, must there be for light from around to be known."""


@dataclass(frozen=True, kw_only=True)
class Doubting:
    """How much the signs count.

    misfit_deg, misfit_power, little_deg: the error m that residuals predict beyond noise counts as
        m^(1 + power) / (m + little) of these degrees: true errors depend less on how well the lights lie, and on how
        many there are, than what residuals predict; where it is little it is noise.
    indirect: how much of the angle counts by which light from around would turn the normal.
    per_bent_deg, most_bent_deg: by which share more it is for each degree to the mean normal around, up to so many:
        photographs say nothing of sharper bends, and hair and pleats of matte subjects are as good as what is around.

    Fitted, with ``Judging.fit_share``, on a ball, a bear and a cat (DiLiGenT), a sphere with a wrong rig (Washington),
    another renderer's bunny, and eight virtual shapes of six materials, under 5 to 96 lights. Each subject left out and
    predicted from the others: ``python -m bench predicted``.
    """

    misfit_deg: float = 4.5
    misfit_power: float = 0.15
    little_deg: float = 1.2
    indirect: float = 1.0
    per_bent_deg: float = 0.045
    most_bent_deg: float = 12.0


@dataclass(frozen=True, kw_only=True)
class Signs:
    """What is looked for, (row, col) of the points, in degrees: what residuals predict beyond noise, by which angle
    light from around would turn the normal, and bends."""

    misfit_deg: Floats
    indirect_deg: Floats
    bent_deg: Floats


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


def signs_of(points: ThinSurface, one: Evidence, surface: Surface) -> Signs:
    """Return what speaks against the points' normals."""
    weight = points.known.astype(np.float32)
    near, around = (_mean(weight, width) for width in (NEAR, AROUND))
    fit = np.minimum(points.fit_deg, MOST_FIT_DEG)
    sums, counts = _indirect(points, one, surface)
    reach = np.clip(1 - counts / np.float32(len(one.plates)), LEAST_REACH, 1)
    squares = np.where(points.known, fit**2 - (points.fit_of_noise_deg / reach) ** 2, np.float32(0))
    indirect = np.maximum(_mean(sums, AROUND) / np.maximum(_mean(counts, AROUND), LEAST_LIGHTS), 0)
    own = np.maximum(sums / np.maximum(counts, 1) - 2 * np.radians(points.noise_deg), 0)
    return Signs(
        misfit_deg=np.sqrt(np.maximum(_mean(squares, AROUND) / around, 0)),
        indirect_deg=np.degrees(indirect + own) * _turned(points.surface, one),
        bent_deg=np.sqrt(np.maximum(_bent_deg(points, near) ** 2 - points.noise_deg**2, 0)),
    )


def doubt_deg(signs: Signs, *, how: Doubting = Doubting()) -> Floats:
    """Return by how many degrees normals may be off beyond noise, (row, col) of the points."""
    misfit = np.float32(how.misfit_deg) * signs.misfit_deg ** np.float32(1 + how.misfit_power)
    misfit /= signs.misfit_deg + np.float32(how.little_deg)
    both = np.hypot(misfit, np.float32(how.indirect) * signs.indirect_deg)
    bent = np.minimum(signs.bent_deg, np.float32(how.most_bent_deg))
    return np.asarray(both * (1 + np.float32(how.per_bent_deg) * bent), np.float32)


def _turned(surface: Surface, one: Evidence) -> Floats:
    """Return by how many radians light turns the normal that every lamp adds alike, for each share of the albedo:
    least squares takes it for a vector, of which what lies across the normal turns it."""
    towards = one.lit.directions
    added = (np.linalg.pinv(towards) @ np.ones(len(towards))).astype(np.float32)
    normals = surface.normals.astype(np.float32)
    along = normals @ added
    return np.sqrt(np.maximum(np.float32(added @ added) - along * along, 0))


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
        let_go(*(plane[first:last] for plane in (*planes, *albedo)))

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
