"""Ambient light where the plan has no dark slot: found from rows that saw a part of a flash only.

Every row of every frame sees some flash, but a share of about d / (Te + d) of them sees only a part of one. Where the
scene stands, ``frame = A + sum_s w[s] * L[s]``, with the shares w that timing gives and one unknown L for every slot of
the plan: a regression over a window of frames. Its weights are the same for all pixels of a row, so that the ambient
picture A is one linear combination of the frames, and is gathered while they pass. Whether the scene stood is judged on
small pictures of every frame, kept for the window. What moved, or is clipped, takes its ambient light from an earlier
window where it stood, else from what stands around it; how much that is, is said.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np

from psvideo.compute.ranks import quantile, rising_parts
from psvideo.model.arrays import Doubles, Flags, Image
from psvideo.model.camera import Camera
from psvideo.model.channels import mean_of_channels
from psvideo.model.plan import Plan
from psvideo.model.rows.clipping import LOSSY_MARGIN, SATURATED
from psvideo.model.rows.shutter import row_weights
from psvideo.model.timing import Timing
from psvideo.plates.ambient.lee1980 import without_noise

WINDOW_FRAMES = 128
"""Frames that one regression takes together: enough for plates within a few per cent of the best."""
EVERY_ROW, BLOCK_PX = 8, 16
"""Whether the scene stood still is judged in every eighth row, whose shares are exact, by means over 16 columns."""
TRUSTS_DIM = 0.25
"""Rows count by 1 / (this + the share of a flash that they saw): what is dim has less photon noise."""
MOSAIC = 2
"""A colour filter mosaic repeats after this many pixels."""
MOST_NOISE = 2.0
"""A row is known where the ambient picture's noise variance is at most this many times a frame's."""
MOST_KEPT = 0.01
"""A row is known only where it holds no more than this of any flash: in few frames a row may see whole flashes only,
from which nothing separates the ambient light."""
MOVED = 4.0
"""A block moved whose residuals are this many times what noise leaves of blocks as bright."""
AT_LEAST, AT_LEAST_SHARE = 1e-4, 3e-3
"""Residuals of less than this, and this share of the block's light, are no motion, however little noise there is."""
AROUND_BLOCKS = 3.0
"""What moved takes the light of blocks around it, weighted by a Gaussian of this standard deviation."""


@dataclass(frozen=True, kw_only=True)
class Design:
    """How a window's frames give the ambient light.

    frames: their indices, ascending. shares: (slot, frame, row), what each row saw of each lit slot's flashes. takes:
    (frame, row), the weights with which frames sum to the ambient light of one exposure. known: (row,), False where the
    window does not show it.
    """

    frames: tuple[int, ...]
    shares: Doubles
    takes: Doubles
    known: Flags


@dataclass(frozen=True, kw_only=True)
class Separated:
    """What a window of frames shows of the ambient light of one exposure.

    begins: its first frame. image: as a frame. stood: (block row, block col), True where it was measured, False where
    it was guessed from around. known: (row,), or (row, col) once it was turned upright.
    """

    begins: int
    image: Image
    stood: Flags
    known: Flags


def windows_of(numbers: Sequence[int]) -> list[tuple[int, ...]]:
    """Return a clip's frames in windows of about WINDOW_FRAMES, none much shorter than the others.

    >>> [len(window) for window in windows_of(range(300))]
    [150, 150]
    """
    count = max(round(len(numbers) / WINDOW_FRAMES), 1)
    edges = [round(n * len(numbers) / count) for n in range(count + 1)]
    return [tuple(numbers[first:last]) for first, last in pairwise(edges)]


def design_of(plan: Plan, camera: Camera, timing: Timing, frames: Iterable[int]) -> Design:
    """Return how frames (indices) give the ambient light under a plan that has no dark slot."""
    numbers = tuple(frames)
    slots = plan.lit_slots
    shares = np.zeros((len(slots), len(numbers), camera.height_px))
    start_s, duration_s = timing.start_s, timing.duration_s
    place = np.array([slots.index(flash.slot) for flash in timing.flashes])
    spread_s = abs(camera.row_offsets_s()).max() + camera.exposure_s
    for n, number in enumerate(numbers):
        begins_s = number * camera.frame_period_s
        near = (start_s + duration_s + timing.pulse.tail_s > begins_s - spread_s) & (start_s < begins_s + 2 * spread_s)
        seen = row_weights(
            camera, start_s[near], duration_s[near], frames=range(number, number + 1), pulse=timing.pulse
        )
        np.add.at(shares[:, n], place[near], seen[:, 0])
    takes, known = _takes(shares)
    return Design(frames=numbers, shares=shares, takes=takes, known=known)


def _takes(shares: Doubles) -> tuple[Doubles, Flags]:
    """Return the weights (frame, row) of the regression's constant, and the rows where they give it."""
    trust = 1.0 / (TRUSTS_DIM + shares.sum(axis=0))
    terms = np.concatenate([np.ones((1, *shares.shape[1:])), shares])
    equations = np.einsum("anr,nr,bnr->rab", terms, trust, terms)
    scale = np.trace(equations, axis1=1, axis2=2)[:, None, None]
    inverse = np.linalg.inv(equations + 1e-9 * scale * np.eye(len(terms)))
    takes: Doubles = np.einsum("rb,bnr->nr", inverse[:, 0, :], terms) * trust
    kept = np.einsum("nr,bnr->br", takes, terms)  # 1 of the ambient light and 0 of every flash, where they are known
    kept[0] -= 1
    known: Flags = np.asarray(((takes**2).sum(axis=0) <= MOST_NOISE) & (np.abs(kept).max(axis=0) <= MOST_KEPT))
    takes[:, ~known] = 0.0
    return takes, known


def separated(
    design: Design, images: Iterable[Image], *, before: Separated | None = None, mosaic: bool = False
) -> Separated:
    """Return the ambient light that a window's frames show; ``images`` are in linear light, in the design's order.

    ``before`` is an earlier window's, for what moves in this one. ``mosaic``: the frames are colour filter mosaics, of
    two by two pixels, and only samples behind the same filter are compared.
    """
    total: Image | None = None
    small = []
    for image, takes in zip(images, design.takes, strict=True):
        if total is None:
            total = np.zeros(image.shape, np.float32)
        total += takes.astype(np.float32).reshape(-1, *[1] * (image.ndim - 1)) * image
        small.append(_small(image))
    if total is None:
        raise ValueError("a window holds at least one frame")
    stood, variance = _judged(design, np.stack(small))
    averaged = BLOCK_PX * (1 if total.ndim == 2 else total.shape[2])
    noise = averaged * cv2.resize(variance, total.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    noise = noise * (design.takes**2).sum(axis=0).astype(np.float32)[:, None]
    step = MOSAIC if mosaic else 1
    for row, col in np.ndindex(step, step):
        own = np.s_[row::step, col::step]
        plane = without_noise(np.ascontiguousarray(total[own]), np.ascontiguousarray(noise[own]))
        earlier = None if before is None else (before.image[own], before.stood)
        total[own] = _guessed(plane, stood, earlier)
    return Separated(begins=design.frames[0], image=total, stood=stood, known=design.known)


def _first_row(rows: int) -> int:
    """Return the first row that is looked at: the middle of the first few, as many as there are."""
    return min(EVERY_ROW, rows) // 2


def _small(image: Image) -> Image:
    some = image[_first_row(len(image)) :: EVERY_ROW]
    some = np.ascontiguousarray(some if some.ndim == 2 else mean_of_channels(some))
    size = (max(some.shape[1] // BLOCK_PX, 1), len(some))
    return np.asarray(cv2.resize(some, size, interpolation=cv2.INTER_AREA), np.float32)


def _judged(design: Design, series: Image) -> tuple[Flags, Image]:
    """Return which blocks (row, col) the regression explains to their noise in all frames, and what that noise's
    variance is; ``series`` is (frame, row, col)."""
    shares = design.shares[:, :, _first_row(design.shares.shape[2]) :: EVERY_ROW]
    terms = np.concatenate([np.ones((1, *shares.shape[1:])), shares])
    rest = np.empty(series.shape, np.float32)
    for row in range(series.shape[1]):
        basis, _ = np.linalg.qr(terms[:, :, row].T)
        rest[:, row] = series[:, row] - basis @ (basis.T @ series[:, row])
    variance = (rest**2).mean(axis=0)
    level = series.mean(axis=0)
    noise = _noise_by_level(variance, level)
    expected = np.maximum(noise, (AT_LEAST + AT_LEAST_SHARE * level) ** 2 / MOVED)
    largest = np.abs(rest).max(axis=0)
    clipped = series.max(axis=0) > SATURATED - LOSSY_MARGIN
    stood = (variance < MOVED * expected) & (largest**2 < 16 * MOVED * expected) & ~clipped
    around = cv2.erode(stood.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0  # the rows between are not judged
    return np.asarray(around), noise


def _noise_by_level(variance: Image, level: Image) -> Image:
    """Return what noise leaves of a block as bright: read noise and photon noise, from the quieter blocks."""
    order = rising_parts(level, 8)
    levels = np.array([level.ravel()[part].mean() for part in order])
    quiet = np.array([quantile(variance.ravel()[part], 0.3) for part in order])
    slope, offset = np.polyfit(levels, quiet, 1) if np.ptp(levels) > 1e-4 else (0.0, float(quiet.mean()))
    floor = max(float(quiet.min()), 1e-12)
    return np.asarray(np.maximum(max(slope, 0.0) * level + offset, floor), np.float32)


def _guessed(image: Image, stood: Flags, before: tuple[Image, Flags] | None) -> Image:
    """Return the picture with what did not stand taken from an earlier window (what it gave, where it stood), else from
    around."""
    if stood.all():
        return image
    rows, cols = image.shape[:2]
    known = stood.astype(np.float32)
    flat = image.reshape(rows, cols, -1)
    small = np.asarray(cv2.resize(flat, known.shape[::-1], interpolation=cv2.INTER_AREA), np.float32)
    small = small.reshape(*known.shape, -1) * known[..., None]
    weight = cv2.GaussianBlur(known, (0, 0), AROUND_BLOCKS) + 1e-6 * float(known.mean()) + 1e-12
    around = cv2.GaussianBlur(small, (0, 0), AROUND_BLOCKS).reshape(small.shape) / weight[..., None]
    guess = np.asarray(cv2.resize(around, (cols, rows), interpolation=cv2.INTER_LINEAR)).reshape(flat.shape)
    if before is not None:
        earlier = _enlarged(before[1], rows, cols)
        guess = np.where(earlier[..., None], before[0].reshape(flat.shape), guess)
    found = np.where(_enlarged(stood, rows, cols)[..., None], flat, np.maximum(guess, 0))
    return found.reshape(image.shape).astype(np.float32)


def _enlarged(flags: Flags, rows: int, cols: int) -> Flags:
    return np.asarray(cv2.resize(flags.astype(np.uint8), (cols, rows), interpolation=cv2.INTER_NEAREST) > 0)
