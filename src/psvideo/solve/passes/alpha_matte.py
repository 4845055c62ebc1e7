"""A soft matte from what the lights reach: 1 where they light something, 0 in the void, between where both share a
pixel.

What lights reach stands out of noise. A backdrop that catches a little of their light does so as well: where the
picture's brightnesses fall into two clearly separate heaps, and the dark one lies along the picture's border, the
border between the heaps is taken (N. Otsu, "A threshold selection method from gray-level histograms", IEEE
Transactions on Systems, Man and Cybernetics 9, 1979, on logarithms). A border pixel shows its two sides in
proportion, under every light in the same: the share is a least-squares fit over the lights.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.model.arrays import Floats, Mask
from psvideo.model.channels import mean_of_channels
from psvideo.solve.filling.filled import holes_in
from psvideo.solve.normals.plate_noise import LEAST, PlateNoise
from psvideo.solve.normals.solving import CERTAIN
from psvideo.solve.passes.plate_rows import PlateRows

SEPARATE, TIMES_BRIGHTER = 0.7, 6.0
"""Two heaps are separate from this share of the variance between them on, where their middles differ this much. (A
subject before a black curtain: 0.94 and 12 to 34; before a lit wall: 0.5 to 0.8, but 1.5 to 3.8.)"""
AT_BORDER = 0.25
"""The dark heap is a backdrop where it has this share of the picture's border; else it is dark hair or cloth."""
BINS = 128
BESIDE = np.ones((3, 3), np.uint8)


def soft_matte(rows: PlateRows, noise: PlateNoise, *, mask: Mask | None = None) -> Floats:
    """Return how much of each pixel the subject covers, (row, col), 0 to 1; ``mask`` is where it may be."""
    channels = 1 if len(rows.shape) == 2 else rows.shape[2]
    level = CERTAIN * max(noise.dark / float(np.sqrt(channels)), noise.least)
    most = np.zeros(rows.shape[:2], np.float32)

    def brightest(first: int, last: int) -> None:
        for light in range(len(rows.readers)):
            np.maximum(most[first:last], mean_of_channels(rows.light(light, first, last)), out=most[first:last])

    rows.over_bands(brightest)
    lit = cv2.medianBlur((most > lit_from(most, level)).view(np.uint8), 3) > 0
    lit |= holes_in(lit)
    inside = cv2.erode(lit.view(np.uint8), BESIDE, borderType=cv2.BORDER_REPLICATE) > 0
    outside = cv2.dilate(lit.view(np.uint8), BESIDE, borderType=cv2.BORDER_REPLICATE) == 0
    alpha = _shared(rows, _Sides.of(inside, outside), np.float32(level)) if inside.any() else np.zeros_like(most)
    return alpha if mask is None else np.where(mask, alpha, np.float32(0))


def lit_from(most: Floats, level: float) -> float:
    """Return the brightness from which on a pixel is the subject's, no less than ``level``, the noise's.

    most: (row, col), the brightest that any light shows.
    """
    logs = np.log(np.maximum(most, np.float32(max(level, LEAST))))
    edges = np.linspace(float(logs.min()), float(logs.max()) + 1e-6, BINS + 1)
    place = ((logs - np.float32(edges[0])) * np.float32(1 / (edges[1] - edges[0]))).astype(np.intp)
    count = np.bincount(np.minimum(place, BINS - 1).ravel(), minlength=BINS)
    middles, share = (edges[1:] + edges[:-1]) / 2, count / count.sum()
    below, mean = np.cumsum(share), np.cumsum(share * middles)
    two = (below > 0) & (below < 1 - 1e-9)
    between = np.where(two, (mean[-1] * below - mean) ** 2 / np.where(two, below * (1 - below), 1), 0)
    best = int(np.argmax(between))
    spread = float((share * (middles - mean[-1]) ** 2).sum())
    dark = logs < edges[best + 1]
    if between[best] < SEPARATE * spread or not dark.any() or dark.all():
        return level
    times = float(np.exp(median(logs[~dark]) - median(logs[dark])))
    border = np.concatenate([dark[0], dark[-1], dark[:, 0], dark[:, -1]])
    apart = times >= TIMES_BRIGHTER and border.mean() >= AT_BORDER
    return max(float(np.exp(edges[best + 1])), level) if apart else level


@dataclass(frozen=True, kw_only=True)
class _Sides:
    """The pixels that may show both sides, and for each of them the nearest one that shows either alone.

    inside, outside: (row, col). border: (pixel, 2), places between them; subject, void: (pixel,), flat places.
    """

    inside: Mask
    border: NDArray[np.intp]
    subject: NDArray[np.intp]
    void: NDArray[np.intp]

    @classmethod
    def of(cls, inside: Mask, outside: Mask) -> "_Sides":
        between = ~(inside | outside)
        return cls(
            inside=inside,
            border=np.argwhere(between),
            subject=_nearest(inside)[between],
            void=_nearest(outside)[between] if outside.any() else np.zeros(0, np.intp),
        )


def _nearest(where: Mask) -> NDArray[np.intp]:
    """Return for every pixel the flat place of the nearest one of ``where``."""
    _, labels = cv2.distanceTransformWithLabels(
        (~where).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    places = np.zeros(int(labels.max()) + 1, np.intp)
    places[labels[where]] = np.flatnonzero(where)
    nearest: NDArray[np.intp] = places[labels]
    return nearest


def _shared(rows: PlateRows, sides: _Sides, level: np.float32) -> Floats:
    """Return the matte: the border's pixels fitted over the lights as a share of their subject's side."""
    alpha = sides.inside.astype(np.float32)
    if not len(sides.void):
        return np.ones_like(alpha)
    product, square = np.zeros(len(sides.border), np.float32), np.zeros(len(sides.border), np.float32)
    for light in range(len(rows.readers)):
        plane = np.empty(rows.shape[:2], np.float32)

        def read(first: int, last: int, light: int = light, plane: Floats = plane) -> None:
            plane[first:last] = mean_of_channels(rows.light(light, first, last))

        rows.over_bands(read)
        flat = plane.reshape(-1)
        void = flat[sides.void]
        across = np.maximum(flat[sides.subject] - void, 0)
        product += (plane[tuple(sides.border.T)] - void) * across
        square += across * across
    alpha[tuple(sides.border.T)] = np.clip(product / np.maximum(square, level * level), 0, 1)
    return alpha
