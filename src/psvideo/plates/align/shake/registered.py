"""By how much one picture is shifted against another, as a whole: phase correlation, then steps of Lucas and Kanade.

B. D. Lucas and T. Kanade, "An Iterative Image Registration Technique with an Application to Stereo Vision", IJCAI 1981,
here on detail of paint and shape, with weights that leave out what does not fit: what moves by itself, and shadows.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.arrays import Doubles, Floats

STEPS, SMALL_PX = 8, 0.004
"""So many steps at most, until one is smaller than the second."""
ODD = np.float32(20.0)
"""What differs by so many codes of detail counts a quarter."""
MARGIN_PX = 8
"""What lies so near to the border may come from beyond it."""
FARTHEST = 0.1
"""Nothing is shifted by more than this share of the picture's shorter side between two flashes."""
HALVED_PX = 128
"""Pictures from this size on, across their shorter side, are compared at half of it first; less would show too little.
"""
HALF, LEAST = np.float32(0.5), 1e-6


@dataclass(frozen=True, kw_only=True)
class Shift:
    """Things of one picture are so far to the right and down in the other, ``px`` (2,); how ``alike`` both are then, a
    correlation; and how much of them is ``unlike``, 0 to 1."""

    px: Doubles
    alike: float
    unlike: float


def shifted(picture: Floats, px: Doubles, fill: int = cv2.BORDER_REPLICATE) -> Floats:
    """Return a picture whose things are so far (2,) to the right and down."""
    way = np.array([[1, 0, px[0]], [0, 1, px[1]]], np.float64)
    return np.asarray(cv2.warpAffine(picture, way, picture.shape[::-1], flags=cv2.INTER_LINEAR, borderMode=fill))


def registered(one: Floats, other: Floats) -> Shift:
    """Return the shift between two pictures of detail, around 0, (row, col)."""
    return _refined(one, other, roughly(one, other))


def roughly(one: Floats, other: Floats) -> Doubles:
    """Return about the same, (2,), from pictures of half the size where they are large: the likelier of what is found
    there from none, and from where phases correlate."""
    scale = 2 if min(one.shape) >= HALVED_PX else 1
    small = [_halved(each) for each in (one, other)] if scale > 1 else [one, other]
    window = cv2.createHanningWindow(small[0].shape[::-1], cv2.CV_32F)
    start, _ = cv2.phaseCorrelate(*(each * window for each in small))  # given the window, it would put it on them
    starts = [np.zeros(2)]
    if 0.5 < np.abs(start).max() < FARTHEST * min(small[0].shape):
        starts.append(np.array(start, np.float64))
    found = [_refined(small[0], small[1], start) for start in starts]
    return scale * min(found, key=lambda shift: shift.unlike).px


def _halved(picture: Floats) -> Floats:
    rows, cols = (size // 2 for size in picture.shape)
    return np.asarray(cv2.resize(picture, (cols, rows), interpolation=cv2.INTER_AREA), np.float32)


def _refined(one: Floats, other: Floats, start_px: Doubles) -> Shift:
    px, inner = start_px, (slice(MARGIN_PX, -MARGIN_PX),) * 2
    own = one[inner]
    own_across, own_down = _slopes(one)
    for _ in range(STEPS):
        back = shifted(other, -px)
        theirs = _slopes(back)
        across, down = HALF * (own_across + theirs[0])[inner], HALF * (own_down + theirs[1])[inner]
        left = own - back[inner]
        weight = np.square(np.float32(1) / (1 + np.square(left / ODD))).astype(np.float32)
        slopes = across * weight, down * weight
        square = np.array([[_summed(a, b) for b in (across, down)] for a in slopes], np.float64)
        step = np.linalg.solve(square + LEAST * np.eye(2), [_summed(a, left) for a in slopes])
        px = px + np.clip(step, -2, 2)
        if np.abs(step).max() < SMALL_PX or np.abs(px).max() > FARTHEST * min(one.shape):
            break
    back = shifted(other, -px)[inner]
    apart = np.square(own - back)
    unlike = float(np.mean(apart / (apart + ODD * ODD)))
    return Shift(px=px, alike=correlation(own, back), unlike=unlike)


def correlation(one: Floats, other: Floats) -> float:
    """Return how alike two pictures of detail are, -1 to 1."""
    return _summed(one, other) / (float(np.sqrt(_summed(one, one) * _summed(other, other))) + LEAST)


def _summed(one: Floats, other: Floats) -> float:
    """Return the sum of a product; BLAS would cut it by threads."""
    return float(np.sum(one * other, dtype=np.float64))


def _slopes(picture: Floats) -> tuple[Floats, Floats]:
    across, down = (cv2.Sobel(picture, cv2.CV_32F, *way, scale=1 / 8) for way in ((1, 0), (0, 1)))
    return np.asarray(across, np.float32), np.asarray(down, np.float32)
