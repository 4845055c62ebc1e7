"""How much of what residuals hold beyond noise turns normals: of three channels, what they have together.

A normal follows what a pixel's channels measure together. How they stand to each other under one light and the next
turns it hardly, but is in its residuals: movies keep colour at half the picture's size, and coarsely.
"""

import numpy as np

from psvideo.model.surface import Surface
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.plate_noise import PlateNoise, rows_of
from psvideo.solve.normals.task import Floats

ROWS, PIXELS = 12, 1 << 12
"""Looked at are so many rows, evenly spread, and so many of their pixels; of small pictures all."""
LEAST_PIXELS = 64
USUAL = 0.9
"""Highlights and the edges of shadows stand out: pixels of larger residuals than this share of them are left aside."""


def share_together(surface: Surface, one: Evidence, noise: PlateNoise) -> float:
    """Return the share, 1 at most, of squared residuals beyond ``noise`` that a pixel's channels have together.

    Of L lights three channels leave 3 L - 5 numbers over, once two of a normal and three of albedo are known: L - 3
    together, and 2 (L - 1) of how they stand to each other. 1 where there is one channel or hardly a pixel is lit by
    all lights, and towards 1 the less there is beyond noise.
    """
    if surface.residual is None or surface.albedo.ndim == 2:
        return 1.0
    lights, (rows, cols) = len(one.plates), surface.valid.shape
    some = np.arange(0, rows, max(min(rows // ROWS, rows * cols // PIXELS), 1))
    step = -(-some.size * cols // PIXELS)
    plates = [(rows_of(plate, some)[:, ::step] - one.black_level) * one.scale for plate in one.plates]
    values = np.stack(plates).astype(np.float32)  # (light, row, col, channel)
    lit = (values.min(axis=-1) > one.usable.dark_level) & (values.max(axis=-1) < one.usable.saturation)
    known = surface.valid[some, ::step] & lit.all(axis=0)
    if np.count_nonzero(known) < LEAST_PIXELS:
        return 1.0
    every = 3 * lights * surface.residual[some, ::step][known].astype(np.float32) ** 2
    usual = every <= np.quantile(every, USUAL)
    shown = values[:, known][:, usual]
    variance = noise.read + noise.photon * float(shown.mean())
    by_noise = (3 * lights - 5) * variance
    beyond = max(float(every[usual].mean()) - by_noise, 0.0)
    between = max(float(_between(shown, one).mean()) - 2 * (lights - 1) * variance, 0.0)
    return 1 - min(between, beyond) / (beyond + by_noise)


def _between(values: Floats, one: Evidence) -> Floats:
    """Return what channels (light, pixel, channel) do not share, squared and summed over a pixel's lights."""
    intensities = one.lit.intensities
    tint = (intensities / intensities.mean(axis=1, keepdims=True)).astype(np.float32)[:, None]
    even = values / tint
    colour = even.mean(axis=0)
    colour /= np.maximum(np.linalg.norm(colour, axis=-1, keepdims=True), np.float32(1e-12))
    shared = (even * colour).sum(axis=-1, keepdims=True) * colour
    return np.asarray((((even - shared) * tint) ** 2).sum(axis=(0, 2)), np.float32)
