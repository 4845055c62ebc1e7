"""What every compiled solver needs around its kernel: arrays checked, bands of rows side by side, a surface made."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Image, Mask, Samples
from psvideo.model.surface import Surface
from psvideo.plates.mixing.mixture import Mixture
from psvideo.plates.mixing.several_pictures import MakeRows, rows_maker
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.result import Result
from psvideo.solve.normals.task import Task

Memory = TypeVar("Memory")

BAND_PIXELS = 1 << 16
"""Pixels of one band; fewer are solved before a thread has started."""
MADE_SAMPLES, LEAST_MADE_ROWS = 1 << 18, 8
"""Samples of the plates that are made at a time, of all lights: they stay in a core's second cache beside what is read
and written; but this many rows, since every call costs something."""
BANDS_ROWS = 128
"""A thread makes and solves about this many rows one after another, in the same memory."""


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


@dataclass(frozen=True, kw_only=True)
class ShownPlates:
    """A solver's plates, one per light: ``samples`` as arrays, or stand-ins of their shape; ``makes`` gives every
    thread what makes rows."""

    samples: list[Samples]
    makes: Callable[[], MakeRows] | None = None

    @classmethod
    def of(cls, plates: Sequence[Samples] | Sequence[Mixture]) -> "ShownPlates":
        """Hold arrays, contiguous, or pictures that are not made yet."""
        mixtures = [plate for plate in plates if isinstance(plate, Mixture)]
        if mixtures:
            stand_ins: list[Samples] = [np.broadcast_to(np.float32(0), plate.shape) for plate in mixtures]
            return cls(samples=stand_ins, makes=rows_maker(mixtures))
        return cls(samples=[np.ascontiguousarray(plate) for plate in plates])

    def as_floats(self) -> "ShownPlates":
        """Return the same where codes are made into floats band by band."""
        codes = self.samples
        if self.makes is not None or codes[0].dtype == np.float32:
            return self

        def make(rows: NDArray[np.intp], first: int, into: Image) -> None:
            for plate, part in zip(codes, into, strict=True):
                part[rows - first] = plate[rows]

        return ShownPlates(samples=[np.broadcast_to(np.float32(0), plate.shape) for plate in codes], makes=lambda: make)

    @property
    def shape(self) -> tuple[int, ...]:
        """A plate's shape."""
        return self.samples[0].shape

    def in_bands(
        self,
        run: Callable[[Task, Memory, int, int], None],
        given: Task,
        memory: Callable[[Task], Memory],
        *,
        threads: int | None,
        step: int = 1,
        needed: NDArray[np.bool_] | None = None,
    ) -> None:
        """Call ``run(task, memory, first, last)`` for bands of rows side by side; it needs every ``step``-th row, of
        those that are ``needed`` (row,), and reads no others. ``memory`` is what makes room to work in, of which no two
        calls at a time have the same.

        Plates that are not made yet are made band by band; the task finds the rows where they would lie if the whole
        plates did. (Numba's own thread pool may abort when two use it.)
        """
        rows, cols = self.shape[:2]
        makes = self.makes
        if makes is None:
            over_ranges(
                lambda first, last: run(given, memory(given), first, last),
                rows,
                each=BAND_PIXELS // cols,
                threads=threads,
            )
            return

        lights, samples = len(self.samples), int(np.prod(self.shape[1:]))
        made_rows = max(MADE_SAMPLES // (lights * samples), LEAST_MADE_ROWS)
        made_rows = step * max(made_rows // step, 1)  # there is room for the rows between as well

        def bands(begin: int, end: int) -> None:
            held = np.empty((lights, made_rows, *self.shape[1:]), np.float32)
            begins = np.array([plate.ctypes.data for plate in held], np.intp)
            begins = np.pad(begins, (0, len(given.plates) - lights), mode="edge")
            room, make = memory(given), makes()
            for first in range(begin, end, made_rows):
                last = min(first + made_rows, end)
                wanted = np.arange(-(-first // step) * step, last, step)
                wanted = wanted if needed is None else wanted[needed[wanted]]
                if len(wanted):
                    make(wanted, first, held)
                    run(given._replace(plates=begins - first * held.strides[1]), room, first, last)

        over_ranges(bands, rows, each=-(-BANDS_ROWS // made_rows) * made_rows, threads=threads)


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
