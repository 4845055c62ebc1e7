"""The compiled loop that propagates noise through least squares: what a normal may be off by, in degrees."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, lent
from psvideo.solve.normals.blocks import ONE, ZERO
from psvideo.solve.normals.task import Floats, Samples


@FUSED.kept
def judge_rows(
    normals: Samples, albedo: Samples, residual: Samples, inverse: Floats, variances: Floats, scale: np.float32,
    error: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Fill the rows of ``error`` (row, col) from normals (3, row, col), albedo (channel, row, col) and ``residual``
    (row, col) or empty.

    inverse: (3, 3), of the lights' normal equations. variances: of a dark sample, and per unit of albedo.
    """
    n, a, r, out = lent(normals), lent(albedo), lent(residual), lent(error)
    channels, cols = len(a), out.shape[1]
    share = ONE / np.float32(channels)
    trace = inverse[0, 0] + inverse[1, 1] + inverse[2, 2]
    for row in range(first, last):
        for col in range(cols):
            x, y, z = decoded(n[0, row, col]), decoded(n[1, row, col]), decoded(n[2, row, col])
            size = ZERO
            for channel in range(channels):
                size += decoded(a[channel, row, col]) * share
            along = x * x * inverse[0, 0] + y * y * inverse[1, 1] + z * z * inverse[2, 2]
            along += np.float32(2) * (x * y * inverse[0, 1] + x * z * inverse[0, 2] + y * z * inverse[1, 2])
            variance = variances[0] + variances[1] * size
            if r.size:
                variance = max(variance, decoded(r[row, col]) ** 2)
            spread = variance * max(trace - along, ZERO) / (size * size)
            out[row, col] = min(scale * np.sqrt(spread), np.float32(180)) if size > ZERO else ZERO
