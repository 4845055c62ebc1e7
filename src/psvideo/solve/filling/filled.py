"""A surface with its holes filled: every pixel of the subject has a normal and an albedo, and says how it got them."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import let_go, planes_for
from psvideo.model.surface import MEASURED, NO_LIGHT, ONE_LIGHT, TWO_LIGHTS, Surface
from psvideo.solve.filling.growing import LEFT_ALONE, SOLVED, THREE_LIGHTS, UNKNOWN, Picture, grow, queue_for
from psvideo.solve.filling.looking import Said, count_rows, look_rows, room_for
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.task import Bytes, Floats, Mask, Samples, Task, Work

MOST_LIGHTS_AROUND = 5
"""A pixel that light reaches is of the subject where so many of the nine around it are lit or solved: noise is not."""
LARGEST_HOLE = 0.005
"""What no light reaches belongs to the subject where that encloses it and it is no larger share of the picture."""
AT_SEAM_DEG = np.array([28, 19, 2], np.float32)
TIMES_TYPICAL, PER_ROOT_DEG, MOST_ERROR_DEG = np.float32(2.5), np.float32(55), np.float32(60)
"""Two thirds of the pixels that no, one and two lights reach are off by no more than the first beside what is solved,
and so many times what is typical there, since what spoils three lights spoils fewer more; and by the next times the
root of the distance from it over the longer side of the picture. On the virtual bust and others under sets of three and
four lights, a bear and a cat (DiLiGenT)."""
THIN = 4
"""What is typical is looked for in every fourth row and column."""
CLASSES = np.array([NO_LIGHT, ONE_LIGHT, TWO_LIGHTS, MEASURED], np.uint8)


def filled(surface: Surface, one: Evidence, *, solved: Mask, noise: float, threads: int | None = None) -> Surface:
    """Return the surface with a normal and an albedo in every pixel of the subject; its memory is taken over.

    solved: (row, col), where the surface has a normal, trusted or not.
    noise: the standard deviation of a dark sample, in units of saturation.

    The subject is what the mask allows; without one, what any light reaches, and small holes in it. What was solved
    stays to the bit. ``source`` says of every pixel how many lights its normal is from.
    """
    source = np.multiply(solved, MEASURED, dtype=np.uint8)
    wanted = _wanted(solved, one, threads)
    if not wanted.any():
        return replace(surface, source=source)
    where = np.ascontiguousarray(np.argwhere(wanted), np.int32)
    index = _places(solved, wanted, one.spare)
    said = _said(one, index, len(where), noise, threads)
    lights = np.full(solved.shape, np.uint8(UNKNOWN + 1))
    lights[solved], lights[wanted] = THREE_LIGHTS, UNKNOWN
    planes, channels = np.moveaxis(surface.normals, -1, 0), _channels(surface.albedo)
    picture = Picture(normals=_bits(planes), albedo=_bits(channels), places=index, lights=lights)
    away = np.zeros(len(where), np.float32)
    grow(picture, said, where, queue_for(len(where)), away)
    let_go(*planes, *channels, index)
    source[wanted] = CLASSES[np.minimum(lights[wanted], THREE_LIGHTS)]
    return replace(surface, source=source, error_deg=_errors(surface, where, lights[wanted], away))


def _places(solved: Mask, wanted: Mask, spare: Path | None) -> NDArray[np.int32]:
    """Return a pixel's place among those that are wanted, and what else ``growing.Picture`` says (row, col)."""
    index = planes_for(solved.shape, np.int32, pixels=solved.size, folder=spare)
    before = 0
    for row, (known, asked) in enumerate(zip(solved, wanted, strict=True)):
        index[row] = np.where(known, np.int32(SOLVED), np.int32(LEFT_ALONE))
        count = int(np.count_nonzero(asked))
        index[row, asked] = np.arange(before, before + count, dtype=np.int32)
        before += count
        let_go(index[row])
    return index


def _errors(surface: Surface, where: NDArray[np.int32], lights: Bytes, away: Floats) -> NDArray[np.floating] | None:
    """Return the predicted errors with those of the filled pixels, which grow with the distance from what is
    solved and with how far that is off."""
    if surface.error_deg is None:
        return None
    rows, cols = where.T
    around = surface.error_deg[::THIN, ::THIN].astype(np.float32)
    typical_deg = TIMES_TYPICAL * np.float32(np.median(around[around > 0])) if (around > 0).any() else np.float32(0)
    share = away / np.float32(max(surface.valid.shape))
    each_deg = AT_SEAM_DEG[lights] + typical_deg + PER_ROOT_DEG * np.sqrt(share)
    surface.error_deg[rows, cols] = np.minimum(each_deg, MOST_ERROR_DEG)
    return surface.error_deg


def _wanted(solved: Mask, one: Evidence, threads: int | None) -> Mask:
    """Return the subject's pixels (row, col) that have no normal yet."""
    if one.mask is not None:
        return np.asarray(one.mask & ~solved)
    if solved.all():
        return np.zeros_like(solved)
    lit = _lit(solved, one, threads)
    around = cv2.boxFilter(lit, cv2.CV_8U, (3, 3), normalize=False, borderType=cv2.BORDER_REPLICATE)
    subject = solved | ((lit > 0) & (around >= MOST_LIGHTS_AROUND))
    del lit, around
    return np.asarray((subject | holes_in(subject)) & ~solved)


def _lit(solved: Mask, one: Evidence, threads: int | None) -> Bytes:
    """Return 1 where any light reaches a pixel or it is solved, else 0."""
    counts = np.zeros(solved.shape, np.uint8)
    asked = np.ascontiguousarray(~solved).view(np.uint8)

    def count(given: Task, work: Work, first: int, last: int) -> None:
        count_rows(given, work, asked, counts, first, last)

    one.in_bands(count, threads, needed=np.asarray(~solved.all(axis=1)))
    return ((counts > 0) | solved).view(np.uint8)


def holes_in(subject: Mask) -> Mask:
    """Return the small parts of the rest that the subject encloses."""
    count, labels, facts, _ = cv2.connectedComponentsWithStats((~subject).astype(np.uint8), connectivity=4)
    rows, cols = subject.shape
    left, top, wide, high, size = facts.T
    inside = (left > 0) & (top > 0) & (left + wide < cols) & (top + high < rows)
    small = inside & (size <= max(LARGEST_HOLE * rows * cols, 1))
    small[0] = False
    return np.asarray(small[labels]) if count > 1 else np.zeros_like(subject)


def _said(one: Evidence, index: NDArray[np.int32], pixels: int, noise: float, threads: int | None) -> Said:
    said = room_for(pixels, noise)

    def look(given: Task, work: Work, first: int, last: int) -> None:
        look_rows(given, work, index, said, first, last)

    one.in_bands(look, threads, needed=np.asarray((index >= 0).any(axis=1)))
    return said


def _channels(albedo: NDArray[np.floating]) -> NDArray[np.floating]:
    return albedo[None] if albedo.ndim == 2 else np.moveaxis(albedo, -1, 0)


def _bits(planes: NDArray[np.floating]) -> Samples:
    """Return planes as the compiled loops take them, in the same memory."""
    if not planes.flags.c_contiguous:
        raise ValueError("a surface as the solvers make it expected: channels in planes of their own")
    return planes.view(np.uint16) if planes.dtype == np.float16 else planes
