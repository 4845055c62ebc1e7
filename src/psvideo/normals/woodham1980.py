"""Normals and albedo by linear least squares, the classic of photometric stereo.

R. J. Woodham, "Photometric method for determining surface orientation from multiple images", Optical Engineering 19(1),
1980. A matte surface under distant light l shows I_l = E_l a (n . d_l); with three or more lights not in one plane,
a n is the least-squares solution of these equations, which minimises the plates' residual.
"""

import itertools
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from psvideo.normals.illumination import Illumination
from psvideo.normals.task import EVERYTHING, Mask, Result, Samples, Task, Usable, empty_result, task
from psvideo.surface import Surface

__all__ = ["EVERYTHING", "Usable", "solve"]

_SERIAL_PIXELS = 1 << 16  # smaller pictures are solved before a thread has started


def solve(
    plates: Sequence[Samples],
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

    plates: one per light of ``lit``, in its order, each (row, col) or (row, col, 3), all of one type: float32 with
        1.0 = saturation, or uint16 codes, for which (code - ``black_level``) * ``scale`` is that.
    seen: True where a plate's rows were exposed, shape (light, row) or (light, row, col); by default all.
    mask: True where to solve, shape (row, col); by default everywhere.
    half: give half floats instead of float32.

    Of three channels, one normal: each channel counts by its own brightness in the pixel; then each gets its
    least-squares albedo for that normal. A pixel is valid where three or more usable measurements remain, their lights
    are not nearly coplanar (Frobenius condition number at most PIXEL_CONDITION, or the rig's own), and the normal turns
    from the camera's axis by 110 degrees at most (in perspective, what is seen may turn by more than 90). With three
    lights that means: none in shadow, none saturated. What remains in a valid pixel is noise, and whatever is not matte
    (highlights, light from neighbouring surfaces).

    The result does not depend on ``threads``. Raises ValueError where the arrays do not belong together.
    """
    _check(plates, lit, seen, mask)
    samples = [np.ascontiguousarray(plate) for plate in plates]
    rows, cols = samples[0].shape[:2]
    channels = lit.intensities.shape[1]
    result = empty_result(rows * cols, channels, half=half, residual=residual)
    _solve_in_bands(task(samples, lit, seen, mask, usable, black_level, scale), result, rows, threads)
    as_float: Any = np.float16 if half else np.float32
    albedo = result.albedo.view(as_float).reshape(channels, rows, cols)
    return Surface(
        normals=result.normals.view(as_float).reshape(3, rows, cols).transpose(1, 2, 0),
        albedo=albedo[0] if plates[0].ndim == 2 else albedo.transpose(1, 2, 0),
        valid=result.valid.view(np.bool_).reshape(rows, cols),
        residual=result.residual.view(as_float).reshape(rows, cols) if residual else None,
    )


def _solve_in_bands(given: Task, result: Result, rows: int, threads: int | None) -> None:
    """Solve bands of rows side by side. (Numba's own thread pool may abort when two threads of a program use it.)"""
    from psvideo.normals.kernel import solve_rows, working_memory  # numba takes long to import: only where it is used

    def run(band: tuple[int, int]) -> None:
        work = working_memory(given)
        try:
            solve_rows(given, result, work, *band)
        except OSError:  # the compiled code could not be kept on disk for the next run; it is there all the same
            solve_rows(given, result, work, *band)

    workers = threads or os.cpu_count() or 1
    if workers == 1 or rows * given.cols <= _SERIAL_PIXELS:
        run((0, rows))
        return
    edges = np.linspace(0, rows, 4 * workers + 1).astype(int).tolist()  # more bands than workers: they differ in work
    with ThreadPoolExecutor(workers) as pool:
        list(pool.map(run, itertools.pairwise(edges)))


def _check(plates: Sequence[Samples], lit: Illumination, seen: Mask | None, mask: Mask | None) -> None:
    lights, channels = lit.intensities.shape
    shape, kind = plates[0].shape, plates[0].dtype
    if len(plates) != lights or any(plate.shape != shape or plate.dtype != kind for plate in plates):
        raise ValueError(f"{len(plates)} plates for {lights} lights, or plates that differ in shape or type")
    if (
        kind not in (np.float32, np.uint16)
        or shape[2:] not in ((), (channels,))
        or (channels, len(shape))
        not in (
            (1, 2),
            (1, 3),
            (3, 3),
        )
    ):
        raise ValueError(f"plates of {kind} {shape} and intensities of {channels} channel(s); see solve's description")
    if seen is not None and (seen.dtype != np.bool_ or seen.shape not in ((lights, shape[0]), (lights, *shape[:2]))):
        raise ValueError(f"seen has shape {seen.shape} and type {seen.dtype}; expected (light, row[, col]) of bool")
    if mask is not None and (mask.dtype != np.bool_ or mask.shape != shape[:2]):
        raise ValueError(f"mask has shape {mask.shape} and type {mask.dtype}; expected {shape[:2]} of bool")
