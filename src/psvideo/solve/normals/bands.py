"""What every compiled solver needs around its kernel: arrays checked, bands of rows side by side, a surface made."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.surface import Surface
from psvideo.plates.mixture import Reader
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.task import Mask, Result, Samples, Task

BAND_PIXELS = 1 << 16
"""Pixels of one band; fewer are solved before a thread has started."""
MADE_PIXELS = 1 << 15
"""Pixels of one band of plates that are made for it: those of a few lights stay in a core's second cache."""


def check_arrays(plates: Sequence[Samples], lit: Illumination, seen: Mask | None, mask: Mask | None) -> None:
    """Raise ValueError where plates, lights, ``seen`` and ``mask`` do not belong together."""
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


def in_bands(run: Callable[[int, int], None], *, rows: int, cols: int, threads: int | None) -> None:
    """Call ``run(first, last)`` for bands of rows side by side. (Numba's own thread pool may abort when two use it.)"""
    over_ranges(run, rows, each=BAND_PIXELS // cols, threads=threads)


def shown_in_bands(
    run: Callable[[Task, int, int], None], given: Task, readers: Sequence[Reader], shape: tuple[int, ...]
) -> None:
    """Call ``run(task, first, last)`` for bands of rows side by side, of plates of which only these rows are made.

    The task finds the rows where they would lie if the whole plates did.
    """
    rows, cols = shape[:2]

    def band(first: int, last: int) -> None:
        held = np.empty((len(readers), last - first, *shape[1:]), np.float32)
        for read, into in zip(readers, held, strict=True):
            read(first, last, into)
        row_bytes = held.strides[1]
        begins = np.array([plate.ctypes.data - first * row_bytes for plate in held], np.intp)
        copies = len(given.plates) - len(readers)
        run(given._replace(plates=np.pad(begins, (0, copies), mode="edge")), first, last)

    over_ranges(band, rows, each=MADE_PIXELS // cols)


def surface_of(result: Result, error: Samples | None, shape: tuple[int, ...], *, half: bool) -> Surface:
    """Return what a kernel stored as the surface of plates of that shape."""
    rows, cols = shape[:2]
    as_float: Any = np.float16 if half else np.float32
    albedo = result.albedo.view(as_float).reshape(-1, rows, cols)
    return Surface(
        normals=result.normals.view(as_float).reshape(3, rows, cols).transpose(1, 2, 0),
        albedo=albedo[0] if len(shape) == 2 else albedo.transpose(1, 2, 0),
        valid=result.valid.view(np.bool_).reshape(rows, cols),
        residual=result.residual.view(as_float).reshape(rows, cols) if result.residual.size else None,
        error_deg=error.view(as_float).reshape(rows, cols) if error is not None and error.size else None,
    )
