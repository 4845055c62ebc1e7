"""Normals and albedo by linear least squares, the classic of photometric stereo.

R. J. Woodham, "Photometric method for determining surface orientation from multiple images", Optical Engineering 19(1),
1980. A matte surface under distant light l shows I_l = E_l a (n . d_l); with three or more lights not in one plane,
a n is the least-squares solution of these equations, which minimises the plates' residual.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from psvideo.normals.illumination import MAX_CONDITION, Illumination
from psvideo.surface import Surface

if TYPE_CHECKING:
    from psvideo.normals.kernel import Result, Task

Plate = NDArray[np.float32] | NDArray[np.uint16]
Mask = NDArray[np.bool_]

_SERIAL_PIXELS = 1 << 16  # smaller pictures are solved before a thread has started
_NO_LIMIT = -1e9


@dataclass(frozen=True, kw_only=True)
class Usable:
    """Which measurements a pixel's solution may use, all in units of the plates (1.0 = sensor saturation).

    A measurement counts where it is seen, below ``saturation`` in all channels, above ``dark_level``, and, in shares of
    the lights' intensities, above ``shadow_ratio`` times the mean over the pixel's lights: in shadow, attached or cast,
    n . d is not what the surface shows. A light that grazes the surface is left out with them, which costs little.
    """

    saturation: float = 1.0
    dark_level: float = 0.004
    shadow_ratio: float = 0.1


EVERYTHING = Usable(saturation=np.inf, dark_level=_NO_LIMIT, shadow_ratio=_NO_LIMIT)  # plain least squares


def solve(
    plates: Sequence[Plate],
    lit: Illumination,
    *,
    seen: Mask | None = None,
    mask: Mask | None = None,
    usable: Usable = Usable(),
    black_level: float = 0.0,
    scale: float = 1.0,
    half: bool = False,
    residual: bool = True,
    threads: int | None = None,
) -> Surface:
    """Return the surface that explains one plate per light.

    plates: one per light of ``lit``, in its order, each (row, col) or (row, col, 3), all of one type: float32 with 1.0 =
        saturation, or uint16 codes, for which (code - ``black_level``) * ``scale`` is that.
    seen: True where a plate's rows were exposed, shape (light, row) or (light, row, col); by default all.
    mask: True where to solve, shape (row, col); by default everywhere.
    half: give half floats instead of float32.

    Of three channels, one normal: each channel counts by its own brightness in the pixel; then each gets its
    least-squares albedo for that normal. A pixel is valid where three or more usable measurements remain whose lights
    are not nearly coplanar (condition number at most MAX_CONDITION, or the rig's own), and the normal faces the camera.
    With three lights that means: none in shadow, none saturated. What remains in a valid pixel is noise, and whatever
    is not matte (specular highlights, light from neighbouring surfaces).

    The result does not depend on ``threads``. Raises ValueError where the arrays do not belong together.
    """
    from psvideo.normals.kernel import Result  # numba is slow to import, and most commands need no solver

    _check(plates, lit, seen, mask)
    plates = [np.ascontiguousarray(plate) for plate in plates]  # the task holds their addresses only
    task = _task(plates, lit, seen, mask, usable, black_level, scale)
    rows, cols = plates[0].shape[:2]
    channels = task.tone.shape[1]
    stored = np.uint16 if half else np.float32
    result = Result(
        normals=np.empty((3, rows * cols), stored),
        albedo=np.empty((channels, rows * cols), stored),
        valid=np.empty(rows * cols, np.uint8),
        residual=np.empty(rows * cols if residual else 0, stored),
    )
    _solve_in_bands(task, result, rows, threads)
    as_float = np.float16 if half else np.float32
    albedo = result.albedo.view(as_float).reshape(channels, rows, cols)
    return Surface(
        normals=result.normals.view(as_float).reshape(3, rows, cols).transpose(1, 2, 0),
        albedo=albedo[0] if plates[0].ndim == 2 else albedo.transpose(1, 2, 0),
        valid=result.valid.view(np.bool_).reshape(rows, cols),
        residual=result.residual.view(as_float).reshape(rows, cols) if residual else None,
    )


def _solve_in_bands(task: "Task", result: "Result", rows: int, threads: int | None) -> None:
    """Solve bands of rows side by side; numba's own thread pools abort when two threads of a program use them."""
    from psvideo.normals.kernel import solve_rows

    def run(band: tuple[int, int]) -> None:
        try:
            solve_rows(task, result, *band)
        except OSError:  # the compiled code could not be kept on disk; it is there all the same
            solve_rows(task, result, *band)

    workers = threads or os.cpu_count() or 1
    if workers == 1 or rows * task.cols <= _SERIAL_PIXELS:
        run((0, rows))
        return
    edges = np.linspace(0, rows, 4 * workers + 1).astype(int).tolist()  # more bands than workers: they differ in work
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(run, zip(edges[:-1], edges[1:], strict=True)))


def _task(
    plates: Sequence[Plate],
    lit: Illumination,
    seen: Mask | None,
    mask: Mask | None,
    usable: Usable,
    black_level: float,
    scale: float,
) -> "Task":
    from psvideo.normals.kernel import ABSENT, Task

    rows, cols = plates[0].shape[:2]
    strength = lit.intensities.mean(axis=1)  # one matrix for all channels: each channel's plates are scaled to it
    unit = strength.mean()
    to_strength = strength[:, None] / lit.intensities
    gain = scale * to_strength
    ceiling = usable.saturation * (1 - 1e-5) * to_strength  # the largest code may come out a rounding below 1.0
    tone = np.stack([gain, -black_level * gain, ceiling, 1 / to_strength], axis=-1)
    matrix = lit.directions * (strength / unit)[:, None]
    inverse = np.linalg.pinv(matrix)
    frobenius = (matrix**2).sum() * (inverse**2).sum()  # trace(A) * trace(A^-1)
    return Task(
        plates=np.array([plate.ctypes.data for plate in plates], np.intp),
        like=plates[0].reshape(-1)[:0],
        cols=cols,
        tone=tone.astype(np.float32),
        matrix=matrix.astype(np.float32),
        inverse=np.ascontiguousarray(inverse.T.astype(np.float32)),
        per_strength=(unit / strength).astype(np.float32),
        dark=np.float32(max(usable.dark_level, ABSENT)),
        ratio=np.float32(max(usable.shadow_ratio, _NO_LIMIT)),
        condition_squared=np.float32(max(MAX_CONDITION**2, 1.001 * frobenius)),
        albedo_scale=np.float32(1 / unit),
        seen=np.empty((0, 0, 0), np.uint8) if seen is None else _bytes(seen).reshape(len(plates), rows, -1),
        mask=np.empty((0, 0), np.uint8) if mask is None else _bytes(mask),
    )


def _bytes(flags: Mask) -> NDArray[np.uint8]:
    return np.ascontiguousarray(flags).view(np.uint8)


def _check(plates: Sequence[Plate], lit: Illumination, seen: Mask | None, mask: Mask | None) -> None:
    lights, channels = lit.intensities.shape
    shape, kind = plates[0].shape, plates[0].dtype
    if len(plates) != lights or any(plate.shape != shape or plate.dtype != kind for plate in plates):
        raise ValueError(f"{len(plates)} plates for {lights} lights, or plates that differ in shape or type")
    if shape[2:] not in ((), (channels,)) or channels not in (1, 3) or (len(shape) == 2 and channels != 1):
        raise ValueError(f"plates of shape {shape} for intensities of {channels} channels; expected 1 or 3, alike")
    if kind not in (np.float32, np.uint16):
        raise ValueError(f"plates of type {kind}; expected float32 or uint16")
    if seen is not None and (seen.dtype != np.bool_ or seen.shape not in ((lights, shape[0]), (lights, *shape[:2]))):
        raise ValueError(f"seen has shape {seen.shape} and type {seen.dtype}; expected (light, row[, col]) of bool")
    if mask is not None and (mask.dtype != np.bool_ or mask.shape != shape[:2]):
        raise ValueError(f"mask has shape {mask.shape} and type {mask.dtype}; expected {shape[:2]} of bool")
