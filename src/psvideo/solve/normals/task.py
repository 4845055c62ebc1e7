"""What the compiled solvers are given: lights and samples as plain arrays."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Bytes, Doubles, Floats, Mask, Samples
from psvideo.model.rows.clipping import ROUNDING
from psvideo.model.surface import Reflectance
from psvideo.solve.depth.view import View
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.result import Result

PIXEL_CONDITION = 12.0  # beyond it, with the lights that shadow leaves, albedo begins to burst in real creases

FEW = 9
"""Up to this many distant lights a pixel's measurements stay in registers (``few_lights.py``)."""

LIGHTS = np.float32(0.003)
"""Lights and lenses are never known better than this share of the signal."""

_NO_LIMIT = -1e9


@dataclass(frozen=True, kw_only=True)
class Usable:
    """Which measurements a pixel's solution may use, in units of the plates (1.0 = sensor saturation).

    A measurement counts where it is seen, below ``saturation`` in all channels, above ``dark_level`` as it is, whatever
    its light's strength, for noise in the dark is no less under a weak lamp or a distant one (where lights' colours
    differ, more of it under those whose channels are noisier); and where it is, relative to what its light sends there,
    above ``shadow_ratio`` times the mean of the pixel's measurements: in shadow, attached or cast, a surface does not
    show n . d. A light that grazes the surface is left out with them, which costs little.
    """

    saturation: float = 1.0
    dark_level: float = 0.004
    shadow_ratio: float = 0.1


EVERYTHING = Usable(saturation=np.inf, dark_level=_NO_LIMIT, shadow_ratio=_NO_LIMIT)  # plain least squares


class Near(NamedTuple):
    """What gives every pixel a matrix of its own: where the lights stand, and where the surface is; and the way to the
    camera, where that is known."""

    positions: Floats  # (light, 3) in metres; of a distant light its direction
    is_near: Bytes  # (light,)
    axes: Floats  # (light, 3): unit vectors, the way a light shines
    anisotropy: Floats  # (light,): the light falls off with this power of the cosine from its axis
    strengths: Floats  # (light,): intensity at 1 m, or of a distant light, in the matrix's unit; 0 for a copy
    depth: Floats  # (row, col) in metres along the camera's axis, or empty
    pinhole: Floats  # (4,): 1 / focal length (x, y) and the principal point (col, row), in pixels; empty: far away


class Task(NamedTuple):
    """What to solve. A plate's samples lie in memory pixel by pixel, channels side by side.

    The kernel takes three lights at a time: arrays by light are filled up to whole threes with copies of the last
    light that weigh nothing.
    """

    plates: NDArray[np.intp]  # (light,) addresses of the plates' first samples
    like: Samples  # any array of the samples' type
    lights: int  # without the copies
    cols: int
    tone: Floats  # (light, channel, 4): gain, offset and ceiling of the samples; factor from measurement to plate
    matrix: Floats  # (light, 3): intensity * direction, one for all channels; 0 for a copy
    per_strength: Floats  # (light,): 1 / intensity
    shares: Floats  # (channel,): by how much channels count beside the surface's own colour, 1 in the mean
    believed: Floats  # (channel,): how far that colour is taken from the channel itself, 1 in the best lit one
    near: Near  # but for its pinhole empty where all lights are distant; else matrix and per_strength hold for the
    # surface's middle only
    inverse: Floats  # (light, 3): the matrix's transposed pseudo-inverse, for samples as they are; 0 for a copy
    origin: Floats  # (3,): what black samples would give with it, to be added
    least: np.float32  # the smallest 1 / intensity
    most: np.float32  # the largest
    noise: Floats  # (light, 2): the noise variance of a dark measurement, and per unit of light; 0 where not known
    dark: Floats  # (light,): a measurement counts where it is above this,
    ratio: np.float32  # and, relative to the intensity, above this times the pixel's mean
    condition_squared: np.float32  # largest trace(A) * trace(A^-1) of the usable lights' normal equations
    albedo_scale: np.float32
    seen: Bytes  # (light, row, col or 1), or empty
    mask: Bytes  # (row, col), or empty


class Work(NamedTuple):
    """The kernel's working memory for one block of pixels."""

    planes: Floats
    values: Floats  # (light * channel, pixel)
    measurements: Floats  # (light, pixel): the channels combined
    matrix: Floats  # the task's; for near lights (light, 3, pixel)
    per_strength: Floats  # the task's; for near lights (light, pixel)


class Looks(Protocol):
    """Looks at rows that a solver has solved, while their samples are there; see ``indirect.py``."""

    def memory(self) -> Work:
        """Return room for one thread."""

    def knowing(self, reflectance: Reflectance | None) -> "Looks":
        """Return the same, where it is known what the subject reflects beyond n . l."""

    def look(self, shown: Task, result: Result, work: Work, first: int, last: int) -> None:
        """Look at rows of the result, whose samples lie where ``shown.plates`` say."""


def task(
    plates: Sequence[Samples],
    lit: Illumination,
    seen: Mask | None,
    mask: Mask | None,
    usable: Usable,
    black_level: float,
    scale: float,
) -> Task:
    """Return the task for contiguous plates, of which it holds the addresses only."""
    rows, cols = plates[0].shape[:2]
    strength = lit.intensities.mean(axis=1)  # one matrix for all channels: each channel's plates are scaled to it
    unit = strength.mean()
    to_strength = strength[:, None] / lit.intensities
    gain = scale * to_strength
    ceiling = usable.saturation * (1 - ROUNDING) * to_strength
    tone = np.stack([gain, -black_level * gain, ceiling, 1 / to_strength], axis=-1)
    matrix = lit.directions * (strength / unit)[:, None]
    inverse = np.linalg.pinv(matrix)
    frobenius = (matrix**2).sum() * (inverse**2).sum()  # trace(A) * trace(A^-1) with all lights
    copies = -len(plates) % 3
    return Task(
        plates=np.array([plate.ctypes.data for plate in [*plates, *[plates[-1]] * copies]], np.intp),
        like=np.empty(0, plates[0].dtype),
        lights=len(plates),
        cols=cols,
        tone=_filled(tone, copies, mode="edge"),
        matrix=_filled(matrix, copies),
        per_strength=_filled(unit / strength, copies, mode="edge"),
        shares=_filled(lit.shares / lit.shares.mean(), 0),
        believed=_filled(np.sqrt(lit.shares / lit.shares.max()), 0),
        inverse=_filled(gain[:, :1] * inverse.T, copies),
        origin=_filled(inverse @ tone[:, 0, 1], 0),
        near=_near(lit, unit, copies, rows, cols),
        least=np.float32((unit / strength).min()),
        most=np.float32((unit / strength).max()),
        noise=np.zeros((len(plates) + copies, 2), np.float32),
        dark=_filled(max(usable.dark_level, _NO_LIMIT) * lit.noisiness, copies, mode="edge"),
        ratio=np.float32(max(usable.shadow_ratio, _NO_LIMIT)),
        condition_squared=np.float32(max(PIXEL_CONDITION**2, 1.001 * frobenius)),
        albedo_scale=np.float32(1 / unit),
        seen=np.empty((0, 0, 0), np.uint8) if seen is None else _bytes(seen).reshape(len(plates), rows, -1),
        mask=np.empty((0, 0), np.uint8) if mask is None else _bytes(mask),
    )


def _near(lit: Illumination, unit: float, copies: int, rows: int, cols: int) -> Near:
    field, pinhole = lit.near, _pinhole(lit.view, rows, cols)
    if field is None:
        line, plane = np.empty(0, np.float32), np.empty((0, 0), np.float32)
        return Near(plane, np.empty(0, np.uint8), plane, line, line, plane, pinhole)
    return Near(
        positions=_filled(field.positions_m, copies, mode="edge"),
        is_near=np.pad(_bytes(field.is_near), (0, copies)),
        axes=_filled(field.axes, copies, mode="edge"),
        anisotropy=_filled(field.anisotropy, copies),
        strengths=_filled(lit.intensities.mean(axis=1) / field.middle_gain / unit, copies),
        depth=np.ascontiguousarray(field.ground.depth_m, np.float32),
        pinhole=pinhole,
    )


def _pinhole(view: View, rows: int, cols: int) -> Floats:
    if view.focal_px is None:
        return np.empty(0, np.float32)
    return np.array([1 / view.focal_px[0], 1 / view.focal_px[1], *view.middle_px(rows, cols)], np.float32)


def _filled(values: Doubles, copies: int, *, mode: Literal["constant", "edge"] = "constant") -> Floats:
    filled = np.pad(values, ((0, copies), *[(0, 0)] * (values.ndim - 1)), mode=mode)
    return np.ascontiguousarray(filled, np.float32)


def _bytes(flags: Mask) -> Bytes:
    return np.ascontiguousarray(flags).view(np.uint8)
