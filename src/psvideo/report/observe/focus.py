"""How sharp the sharpest edges are: S. Zhuo and T. Sim, "Defocus map estimation from a single image", Pattern
Recognition 44, 2011, section 3. An edge blurred once more loses the more of its slope the sharper it was."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median, quantile
from psvideo.model.arrays import Bytes, Floats
from psvideo.plates.mixing.mixture import Mixture

SCALES_PX = ((0.0, 1.5, 1.0), (1.5, 4.0, 2.5), (4.0, 9.0, np.inf))
"""Blur before and after (standard deviations), and up to which result these two measure it: noise makes soft edges look
sharper, so that they are compared once both pictures are smooth."""
TILE = (15, 15)
"""Edges are judged by what they are over this many pixels: single ones are at the mercy of noise."""
LEAST_EDGES = 40
SHARPEST = 0.1
NOISE_FACTOR = 8.0
LARGEST_PX = 1600
"""Wider pictures are judged by their middle: defocus must not be averaged away."""
SQUARE_PX, SQUARES = 160, 12
"""Of larger pictures, this many squares are looked at closely: those with the steepest edges, seen every fourth
pixel."""
BAND_ROWS = 32
COARSE = 4
EACH = 4
"""Noise is the median over every nth row and column: it varies by less than a hundredth."""
STEEP_SQUARE = 0.98
STEEPEST = 1e-3
"""A slope counts from a quarter of the one that this share of the picture exceeds."""
KERNEL = np.array([[-0.5, 0, 0.5]], np.float32)
Kind = TypeVar("Kind", Floats, Bytes)


def middle_of(picture: Mixture) -> NDArray[np.float32]:
    """Return the middle of a picture, grey (row, col), which is what its sharpness is judged by."""
    rows, cols = picture.shape[:2]
    top, left = max(rows - LARGEST_PX, 0) // 2, max(cols - LARGEST_PX, 0) // 2
    read, grey = picture.reader(), np.empty((rows - 2 * top, cols - 2 * left), np.float32)
    room = np.empty((BAND_ROWS, *picture.shape[1:]), np.float32)  # it stays in a core's second cache
    for first in range(0, len(grey), BAND_ROWS):
        band = grey[first : first + BAND_ROWS]
        made = read(top + first, top + first + len(band), room[: len(band)])[:, left : cols - left]
        band[:] = made if made.ndim == 2 else made[..., 1]
    return grey


def sharpest_blur_px(grey: NDArray[np.float32]) -> float | None:
    """Return the standard deviation of the blur that the sharpest tenth of a grey picture's edges have, in pixels.

    About 0.6 is as sharp as pixels can show, a demosaiced picture has 0.8. None where no edge stands out of the noise.
    """
    squares = _steepest_squares(grey)
    noise, whole = _noise(grey), grey.size / squares.size
    slopes, blur_px, least_px = _Slopes(squares=squares), None, 0.0
    for first_px, again_px, most_px in SCALES_PX:
        found = _blur_between(slopes, first_px, again_px, noise=noise, steepest=STEEPEST * whole)
        blur_px = blur_px if found is None else max(found, least_px)
        least_px = most_px
        if found is not None and found <= most_px:
            break
    return blur_px


def _steepest_squares(grey: NDArray[np.float32]) -> Floats:
    """Return the squares of a picture that have the steepest edges, (square, row, col); a small picture as it is."""
    down, across = (size // SQUARE_PX for size in grey.shape)
    if grey.size <= SQUARES * SQUARE_PX**2 or down * across <= SQUARES:
        return grey[None]
    top, left = (size % SQUARE_PX // 2 for size in grey.shape)
    inside = grey[top : top + down * SQUARE_PX, left : left + across * SQUARE_PX]
    steep = np.sort(_in_squares(_slope(inside[::COARSE, ::COARSE]), SQUARE_PX // COARSE).reshape(down * across, -1))
    place = steep[:, int(STEEP_SQUARE * steep.shape[1])]
    best = np.sort(np.argsort(-place, kind="stable")[:SQUARES])
    return np.ascontiguousarray(_in_squares(inside, SQUARE_PX)[best])


def _in_squares(picture: NDArray[np.float32], side: int) -> Floats:
    """Return a picture (row, col) cut into squares, (square, row, col)."""
    rows, cols = picture.shape
    return picture.reshape(rows // side, side, cols // side, side).swapaxes(1, 2).reshape(-1, side, side)


def _noise(grey: NDArray[np.float32]) -> float:
    """Return the standard deviation of noise, from what a median over neighbours takes away."""
    some = slice(None, None, EACH)
    off = grey[some, some] - np.asarray(cv2.medianBlur(grey, 3))[some, some]
    return 1.4826 * median(np.abs(off))


@dataclass(frozen=True, kw_only=True)
class _Slopes:
    """Slopes of squares after a blur, (square, row, col): to the right, down, their size; each blur is made once."""

    squares: Floats
    _made: dict[float, tuple[Floats, Floats, Floats]] = field(default_factory=dict)

    def after(self, sigma_px: float) -> tuple[Floats, Floats, Floats]:
        """Return the slopes after a blur."""
        if sigma_px not in self._made:
            pairs = [_slopes(_blurred(one, sigma_px)) for one in self.squares]
            right, down = (np.stack(planes) for planes in zip(*pairs, strict=True))
            self._made[sigma_px] = right, down, np.stack([_size(*pair) for pair in pairs])
        return self._made[sigma_px]


def _blur_between(slopes: _Slopes, first_px: float, again_px: float, *, noise: float, steepest: float) -> float | None:
    """Return the blur of the sharpest edges from their slopes after two blurs; None where too few stand out."""
    right, down, steep = slopes.after(first_px)
    if first_px:
        noise /= 2 * np.sqrt(np.pi) * first_px  # what such a blur leaves of noise that is new in every pixel
    edges = steep > max(NOISE_FACTOR * noise, 0.25 * quantile(steep[:, ::2, ::2], 1 - steepest))
    rim = 4 + round(2 * again_px)
    edges[:, :rim], edges[:, -rim:], edges[:, :, :rim], edges[:, :, -rim:] = False, False, False, False
    if np.count_nonzero(edges) < LEAST_EDGES:
        return None
    edges &= np.stack([_ridge(*one) for one in zip(right, down, steep, strict=True)])
    if np.count_nonzero(edges) < LEAST_EDGES:  # a wide blur takes most of the time
        return None
    soft = slopes.after(again_px)[2]
    edges &= soft > 0
    long = edges & (_each(_summed, edges.view(np.uint8)) >= TILE[0] / 2)
    if np.count_nonzero(long) < LEAST_EDGES:
        return None
    along = [_each(_summed, one * edges)[long] for one in (steep, soft)]
    ratios = np.maximum((along[0] / along[1]) ** 2, 1 + 1e-3)
    blur_px = np.sqrt(np.maximum(again_px**2 - ratios * first_px**2, 0) / (ratios - 1))
    return quantile(blur_px, SHARPEST)


def _each(function: Callable[[Kind], Kind], squares: Kind) -> Kind:
    return np.stack([function(one) for one in squares])


def _summed(square: Kind) -> Kind:
    """Return sums over TILE; of no more flags than a byte counts."""
    return np.asarray(cv2.boxFilter(square, -1, TILE, normalize=False), square.dtype)


def _blurred(square: Floats, sigma_px: float) -> Floats:
    return np.asarray(cv2.GaussianBlur(square, (0, 0), sigma_px), np.float32) if sigma_px else square


def _ridge(right: Floats, down: Floats, steep: Floats) -> NDArray[np.bool_]:
    """Return where the slope is greatest across its edge."""
    across = np.abs(right) > np.abs(down)
    row = steep >= cv2.dilate(steep, np.ones((1, 3), np.uint8))
    col = steep >= cv2.dilate(steep, np.ones((3, 1), np.uint8))
    return np.asarray(np.where(across, row, col), np.bool_)


def _slope(grey: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the slope's size by central differences."""
    return _size(*_slopes(grey))


def _slopes(grey: Floats) -> tuple[Floats, Floats]:
    """Return central differences to the right and down."""
    right, down = (cv2.filter2D(grey, cv2.CV_32F, kernel) for kernel in (KERNEL, KERNEL.T))
    return np.asarray(right, np.float32), np.asarray(down, np.float32)


def _size(right: Floats, down: Floats) -> Floats:
    return np.asarray(cv2.magnitude(right, down), np.float32)
