"""Planes of large pictures that lie in a file: the system's page cache holds them while there is room, not the process.

Code that has worked on a part of them lets it go (``let_go``); a later access reads it back.
"""

import mmap
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from psvideo.errors import PsvideoError

Kind = TypeVar("Kind", bound=np.generic)
LARGE_PIXELS = 1 << 25
"""Pictures of more pixels have planes in files: just more than 8K video has, whose results come and go in memory."""
WORKED_ON_PIXELS = 1 << 20
"""From this many pixels on, what is worked on in steps lies in files while no step needs it."""
BAND_ROWS = 64
"""Of what is worked on row by row, this many are in memory at a time."""
APART_BYTES = 1 << 20
"""What is smaller lies in the heap."""
AROUND_BYTES = 1 << 20
"""This much before a part goes with it: where a page is read, the system hands over those around it too."""


def planes_for(shape: tuple[int, ...], kind: DTypeLike, *, pixels: int, folder: Path | None) -> NDArray[Any]:
    """Return room for planes of a picture of this many pixels: in memory, or, where that is large and there is a
    folder, in a nameless file there, which is gone with the array.

    Raises PsvideoError where the folder's disk has no room.
    """
    if folder is None or pixels <= LARGE_PIXELS:
        return np.empty(shape, kind)
    return in_file(shape, kind, folder)


def in_file(shape: tuple[int, ...], kind: DTypeLike, folder: Path) -> NDArray[Any]:
    """Return room, all 0, in a nameless file in a folder, as ``planes_for``."""
    size = int(np.prod(shape)) * np.dtype(kind).itemsize
    if not size:
        return np.empty(shape, kind)
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            if hasattr(os, "posix_fallocate"):  # a full disk is an error now, and no signal later
                os.posix_fallocate(file.fileno(), 0, size)
            else:
                file.truncate(size)
            held = mmap.mmap(file.fileno(), size)
    except OSError as fault:
        raise PsvideoError(
            f"{folder}: large pictures are worked on in files there, and one of {size / 1e6:.0f} MB has no room "
            f"({fault.strerror or fault}). Free some, or write to another disk."
        ) from fault
    return np.frombuffer(held, kind).reshape(shape)


def room_apart(shape: tuple[int, ...], kind: DTypeLike) -> NDArray[Any]:
    """Return room, all 0, in memory that the system gets back with the array, and of which it gives what is touched.

    In the heap, what comes for a while and goes again leaves holes behind, and the heap stays as large as it ever was.
    """
    size = int(np.prod(shape)) * np.dtype(kind).itemsize
    if size < APART_BYTES:
        return np.zeros(shape, kind)
    return np.frombuffer(mmap.mmap(-1, size), kind).reshape(shape)


def room_for(shape: tuple[int, ...], kind: DTypeLike, spare: Path | None) -> NDArray[Any]:
    """Return a plane of 0: where it is large and there is a folder, in a file there (see ``let_go``)."""
    if spare is None or np.prod(shape[:2]) < WORKED_ON_PIXELS:
        return np.zeros(shape, kind)
    return in_file(shape, kind, spare)


def room_of_planes(count: int, rows: int, cols: int, kind: DTypeLike, spare: Path | None) -> NDArray[Any]:
    """Return so many planes of 0, (plane, row, col): where they are large and there is a folder, in a file there."""
    if spare is None or rows * cols < WORKED_ON_PIXELS:
        return np.zeros((count, rows, cols), kind)
    return in_file((count, rows, cols), kind, spare)


def kept_in(plane: NDArray[Kind], spare: Path | None) -> NDArray[Kind]:
    """Return a plane, or, where it is large and there is a folder, a copy that lies in a file there."""
    if spare is None or plane.shape[0] * plane.shape[1] < WORKED_ON_PIXELS or lie_in_files(plane):
        return plane
    return _copied(plane, in_file(plane.shape, plane.dtype, spare))


def _copied(plane: NDArray[Kind], into: NDArray[Kind]) -> NDArray[Kind]:
    for first, last in bands(len(plane)):
        into[first:last] = plane[first:last]
        let_go(into[first:last], plane[first:last])
    return into


def bands(rows: int) -> Iterator[tuple[int, int]]:
    """Yield the first row of every band of BAND_ROWS, and the one after its last."""
    for first in range(0, rows, BAND_ROWS):
        yield first, min(first + BAND_ROWS, rows)


def thin(picture: NDArray[Any], step: int) -> NDArray[Any]:
    """Return every ``step``-th row and column of a picture (row, col[, channel]) in new memory, every channel a plane
    of its own there; planes in files are let go one after the other, since all of each comes into memory for it."""
    if picture.ndim == 3:
        return np.moveaxis(np.stack([thin(plane, step) for plane in np.moveaxis(picture, -1, 0)]), 0, -1)
    some = picture[::step, ::step].copy()
    let_go(picture)
    return some


def lie_in_files(*planes: NDArray[Any]) -> bool:
    """Return whether any of these lies in such a file: who lets go band by band asks once, and not for every band."""
    return any(_mapping_of(plane) is not None for plane in planes)


def let_go(*parts: NDArray[Any]) -> None:
    """Hand parts of such planes, whole rows, back to the system's cache; other arrays stay as they are.

    A colour picture's channels may lie in planes of their own.
    """
    if lie_in_files(*parts):
        _let_planes_go(
            [plane for part in parts for plane in ([part] if part.flags.c_contiguous else np.moveaxis(part, -1, 0))]
        )


def _let_planes_go(planes: list[NDArray[Any]]) -> None:
    for part in planes:
        held = _mapping_of(part)
        if held is None or not part.size or not hasattr(mmap, "MADV_DONTNEED"):
            continue
        begin = part.ctypes.data - np.frombuffer(held, np.uint8).ctypes.data
        first = max(begin - AROUND_BYTES, 0) // mmap.PAGESIZE * mmap.PAGESIZE
        held.madvise(mmap.MADV_DONTNEED, first, begin + part.nbytes - first)


def _mapping_of(array: NDArray[Any]) -> mmap.mmap | None:
    """Return what an array lies in, None where that is no file."""
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    if base is None:  # as nearly always
        return None
    base = base.obj if isinstance(base, memoryview) else base
    return base if isinstance(base, mmap.mmap) else None
