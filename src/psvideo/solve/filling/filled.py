"""A surface with its holes filled: every pixel of the subject has a normal and an albedo, and says how it got them."""

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import let_go, thin
from psvideo.model.arrays import Bytes, Floats, Mask, Samples
from psvideo.model.surface import MEASURED, NO_LIGHT, ONE_LIGHT, TWO_LIGHTS, Surface
from psvideo.solve.filling.bucket_queue import queue_for
from psvideo.solve.filling.growing import grow
from psvideo.solve.filling.looking import KEPT, MOST_COUNTED, Said, look_rows, mark_lit_rows, said_for
from psvideo.solve.filling.neighbours import REACH_PX
from psvideo.solve.filling.tiles import AT_ONCE, THREE_LIGHTS, bring_back, tiles_around
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.task import Task, Work
from psvideo.solve.normals.trust.thin_surface import blurred

MOST_LIGHTS_AROUND = 5
"""A lit pixel belongs to the subject where this many of the nine around it are lit or solved; noise does not."""
LARGEST_HOLE = 0.005
"""What no light reaches belongs to the subject where that encloses it and it is no larger share of the picture."""
AT_SEAM_DEG = np.array([28, 19, 2, 2], np.float32)
TIMES_AROUND, PER_ROOT_DEG, MOST_ERROR_DEG = np.float32(1.5), np.float32(45), np.float32(60)
"""How far two thirds of the filled pixels are off at most: the sum of AT_SEAM_DEG (for no, one, two and three lights),
of TIMES_AROUND times the error of what was measured around, since what spoils three lights spoils fewer more, and of
PER_ROOT_DEG times the root of the distance from solved pixels over the longer side of the picture. Measured under sets
of 3 to 12 lights on a bear, a cat and a ball (DiLiGenT), another renderer's bunny, and virtual shapes of seven
materials that light each other. (With the error that is typical of the whole picture instead, claims of one set beside
those of another are off by a fifth more.)"""
AROUND, FARTHER = 0.04, np.float32(1e-3)
"""Errors around are means over about such a share of the subject's size; what lies farther counts as this much of one
point."""
OF_THREE = np.float32(0.5)
"""So much of that where three lights give a normal, and a fourth is left out. (Of a bear, a cat and a ball under eight
sets of four, typically 14 to 22, 7 and 3 degrees off; the whole of it was 34, 27 and 19.)"""
CLASSES = np.array([NO_LIGHT, ONE_LIGHT, TWO_LIGHTS, MEASURED], np.uint8)


def filled(surface: Surface, one: Evidence, *, solved: Mask, noise: float, without: Bytes | None = None) -> Surface:
    """Return the surface with a normal and an albedo in every pixel of the subject; its memory is taken over.

    solved: (row, col), where the surface has a normal, trusted or not.
    noise: the standard deviation of a dark sample, in units of saturation.
    without: (row, col), which lights are left out of a solved pixel, which is estimated from the others (see
        ``leaving_out``).

    The subject is what the mask allows; without one, what any light reaches, and small holes in it. What was solved
    with all lights stays to the bit. ``source`` says of every pixel how many lights its normal is from.
    """
    wanted = _wanted(solved, one)
    if without is not None:
        solved = solved & (without == 0)
        wanted |= without > 0
        if surface.error_deg is not None:
            surface.error_deg[wanted] = 0  # of a normal that is not kept
    where = _places(wanted)
    if not len(where):
        return replace(surface, source=_source(solved))
    asked = wanted.view(np.uint8) if without is None else wanted | without
    said = said_for(len(where), noise, kept=MOST_COUNTED if without is None else KEPT)
    _look(one, asked, said)
    normals, albedo = _bits(np.moveaxis(surface.normals, -1, 0)), _bits(_channels(surface.albedo))
    tiles = tiles_around(wanted, solved, normals, albedo, reach_px=REACH_PX, spare=one.spare)
    del wanted, asked
    away = np.zeros(len(where), np.float32)
    grow(tiles, said, where, queue_for(len(where)), away)
    del said
    lights = bring_back(tiles, where, normals, albedo)
    source = _source(solved)
    source[where[:, 0], where[:, 1]] = CLASSES[np.minimum(lights, THREE_LIGHTS)]
    return replace(surface, source=source, error_deg=_errors(surface, where, lights, away, one.step_of(solved.shape)))


def _places(wanted: Mask) -> NDArray[np.int32]:
    """Return the rows and columns of the pixels that are wanted, (pixel, 2), as ``np.argwhere`` does: it goes through
    pictures pixel by pixel, and through one line twenty times as fast where there are few."""
    return np.stack(np.divmod(np.flatnonzero(wanted), wanted.shape[1]), axis=1).astype(np.int32)


def _source(solved: Mask) -> Bytes:
    return np.multiply(solved, MEASURED, dtype=np.uint8)


def _errors(
    surface: Surface, where: NDArray[np.int32], lights: Bytes, away: Floats, step: int
) -> NDArray[np.floating] | None:
    """Return the predicted errors with those of the filled pixels, which grow with the distance from what is
    solved and with how far what was measured around is off."""
    errors = surface.error_deg
    if errors is None:
        return None
    around = _around(errors, step)
    for first in range(0, len(where), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        rows, cols = where[some].T
        share = away[some] / np.float32(max(surface.valid.shape))
        measured_deg = TIMES_AROUND * around[rows // step, cols // step]
        each_deg = AT_SEAM_DEG[lights[some]] + measured_deg + PER_ROOT_DEG * np.sqrt(share)
        each_deg *= np.where(lights[some] == THREE_LIGHTS, OF_THREE, np.float32(1))
        errors[rows, cols] = np.minimum(each_deg, MOST_ERROR_DEG)
        let_go(errors[rows[0] : rows[-1] + 1])
    return errors


def _around(errors: NDArray[np.floating], step: int) -> Floats:
    """Return the mean of the errors around every ``step``-th row and column, 0 where there are none at all."""
    thinned = np.minimum(thin(errors, step).astype(np.float32), MOST_ERROR_DEG)
    known = (thinned > 0).astype(np.float32)
    common = thinned.sum(dtype=np.float64) / max(known.sum(dtype=np.float64), 1.0)
    wide = int(AROUND * np.sqrt(np.count_nonzero(known))) // 2 * 2 + 3
    planes = np.stack([thinned, known])
    for _ in range(2):  # twice over squares is nearly Gaussian
        planes = blurred(planes, wide)
    return np.asarray((planes[0] + FARTHER * np.float32(common)) / (planes[1] + FARTHER), np.float32)


def _wanted(solved: Mask, one: Evidence) -> Mask:
    """Return the subject's pixels (row, col) that have no normal yet."""
    if one.mask is not None:
        return np.asarray(one.mask & ~solved)
    if solved.all():
        return np.zeros_like(solved)
    lit = _lit(solved, one)
    around = cv2.boxFilter(lit, cv2.CV_8U, (3, 3), normalize=False, borderType=cv2.BORDER_REPLICATE)
    subject = solved | ((lit > 0) & (around >= MOST_LIGHTS_AROUND))
    del lit, around
    return np.asarray((subject | holes_in(subject)) & ~solved)


def _lit(solved: Mask, one: Evidence) -> Bytes:
    """Return 1 where any light reaches a pixel or it is solved, else 0."""
    lit = solved.astype(np.uint8)
    asked = np.ascontiguousarray(~solved).view(np.uint8)

    def mark(given: Task, work: Work, first: int, last: int) -> None:
        mark_lit_rows(given, work, asked, lit, first, last)

    one.in_bands(mark, None, needed=np.asarray(~solved.all(axis=1)))
    return lit


def holes_in(subject: Mask) -> Mask:
    """Return the small parts of the rest that the subject encloses."""
    count, labels, facts, _ = cv2.connectedComponentsWithStats((~subject).view(np.uint8), connectivity=4)
    rows, cols = subject.shape
    left, top, wide, high, size = facts.T
    inside = (left > 0) & (top > 0) & (left + wide < cols) & (top + high < rows)
    small = inside & (size <= max(LARGEST_HOLE * rows * cols, 1))
    small[0] = False
    return np.asarray(small[labels]) if count > 1 else np.zeros_like(subject)


def _look(one: Evidence, asked: Bytes, said: Said) -> None:
    counts = np.count_nonzero(asked, axis=1)
    begins = np.cumsum(counts) - counts

    def look(given: Task, work: Work, first: int, last: int) -> None:
        look_rows(given, work, asked, begins, said, first, last)

    one.in_bands(look, None, needed=counts > 0)


def _channels(albedo: NDArray[np.floating]) -> NDArray[np.floating]:
    return albedo[None] if albedo.ndim == 2 else np.moveaxis(albedo, -1, 0)


def _bits(planes: NDArray[np.floating]) -> Samples:
    """Return planes as the compiled loops take them, in the same memory."""
    if not planes.flags.c_contiguous:
        raise ValueError("a surface as the solvers make it expected: channels in planes of their own")
    return planes.view(np.uint16) if planes.dtype == np.float16 else planes
