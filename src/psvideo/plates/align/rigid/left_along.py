"""What one surface leaves of the plates of all lights along every pixel's way, over windows."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.rigid.along_motion import left_of
from psvideo.plates.align.rigid.plates_seen import PlatesSeen
from psvideo.plates.align.velocity.all_lights import WINDOW_PX, AllLights
from psvideo.plates.align.velocity.followed import Followed, mean_over, odd_width

STRIDE = 2
"""Every so many pixels in rows and columns one is asked: windows are wider."""
NOTHING = np.empty((0, 0, 0), np.float32)
TOLD, LEAST = np.float32(0.5), np.float32(1e-3)
"""Windows tell where as many plates as the first are lit on average, beyond what a normal and an albedo need."""


@dataclass(frozen=True, kw_only=True)
class LeftAlong:
    """What no surface explains over windows, ``wide``, 0 to 1, and 1 where too little is lit to tell; and where it is
    ``told``; both (row, col)."""

    wide: Floats
    told: Flags

    @classmethod
    def of(
        cls,
        lights: AllLights,
        plates: PlatesSeen,
        lamps: Floats,
        found: Followed,
        where: Flags | None = None,
        near: Floats | None = None,
    ) -> "LeftAlong":
        """Return that of ``plates`` under ``lamps`` (plate, 4 or more) along the ways that were ``found``, by pixels of
        ``where`` (row, col), or by all; they are so ``near`` the ground (row, col), or on it."""
        shape = lights.shape
        asked = np.ones(shape, np.bool_) if where is None else where
        asked = asked[::STRIDE, ::STRIDE]
        rows, cols = (some * STRIDE for some in np.nonzero(asked))
        ways = [plane[rows, cols] for plane in (*found.velocity, *found.bends)]
        above = plates.above(np.zeros(len(rows), np.float32) if near is None else near[rows, cols], (rows, cols))
        left, beyond = np.zeros((2, *asked.shape), np.float32)
        left[asked], beyond[asked] = left_of(plates, lamps, np.stack([cols, rows, *ways, above]), NOTHING)

        def over(values: Floats) -> Floats:
            return mean_over(values, odd_width(WINDOW_PX, lights.step * STRIDE))

        def full(values: Floats) -> Floats:
            return np.asarray(cv2.resize(values, shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)

        count = over(beyond)
        share = np.divide(over(left * beyond), np.maximum(count, LEAST), dtype=np.float32)
        told, wide = full(count) > TOLD, full(share)
        return cls(wide=np.where(told, wide, np.float32(1)), told=told)

    def least(self, other: "LeftAlong") -> "LeftAlong":
        """Return the least that two ways leave, and what either tells."""
        return replace(self, wide=np.minimum(self.wide, other.wide), told=self.told | other.told)
