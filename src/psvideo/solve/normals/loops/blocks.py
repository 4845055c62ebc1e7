"""Planes of a block of pixels, one after another in a flat working array, BLOCK apart, and the numbers of all kernels.

The compiler so sees that planes do not overlap.
"""

import numpy as np

from psvideo.solve.normals.task import Task, Work

# Pixels of one block; not a power of two, whose planes would all fall on the same lines of the processor's cache.
BLOCK = 480
MISSING = np.float32(-1e30)
ABSENT = np.float32(-1e29)  # what is below this is MISSING
ZERO, ONE, THREE, TINY = np.float32(0), np.float32(1), np.float32(3), np.float32(1e-9)
# In perspective what is seen may turn from the camera's axis by more than 90 degrees: by half the view (here 20).
LEAST_Z = np.float32(-0.342)
SLIGHTLY_MORE = np.float32(1.000001)

# The planes of the working array: g, later the normal; what deciding on measurements needs; the normal equations.
X, Y, Z, ALBEDO, LIMIT, LOW, HIGH, SUM, COUNT = (BLOCK * plane for plane in range(9))
XX, XY, XZ, YY, YZ, ZZ = (BLOCK * plane for plane in range(9, 15))
SUMS = 15 * BLOCK  # of three channels, what colour_kernel.py adds up: three planes each
PLANES = 24


def working_memory(task: Task) -> Work:
    """What one call of ``solve_rows`` works in; no two calls at a time may share it."""
    lights, channels = task.tone.shape[:2]
    values = np.full((lights * channels, BLOCK), MISSING, np.float32)
    combined = values if channels == 1 else np.full((lights, BLOCK), MISSING, np.float32)
    is_near = task.near.depth.size > 0
    return Work(
        planes=np.empty(PLANES * BLOCK, np.float32),
        values=values,
        measurements=combined,
        matrix=np.zeros((lights, 3, BLOCK), np.float32) if is_near else task.matrix,
        per_strength=np.zeros((lights, BLOCK), np.float32) if is_near else task.per_strength,
    )
