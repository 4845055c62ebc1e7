"""How the light of each lamp falls off over the picture, beyond what the rig explains: lens vignetting, narrow lamps.

``psvideo calibrate flat-field`` measures it on a white target; ``psvideo normals`` divides it out where it is given. A
light's falloff is ``exp(polynomial)`` of degree DEGREE in column and row over half the picture's width, 1 where its
intensity in the rig was measured. Beyond the target, where nothing was measured, it stays as at the edge.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles

DEGREE = 4
POWERS = tuple((across, down) for total in range(DEGREE + 1) for down in range(total + 1) for across in [total - down])
"""Powers of column and row of a polynomial's terms, in the file's order."""


@dataclass(frozen=True, kw_only=True)
class Falloff:
    """Every light's falloff over pictures of one size; ``box`` (left, top, right, bottom) is where it was measured.

    ``lights`` are names with their polynomial's coefficients.
    """

    width_px: int
    height_px: int
    box: tuple[int, int, int, int]
    lights: tuple[tuple[str, tuple[float, ...]], ...]

    def field(self, light: str) -> NDArray[np.float32]:
        """Return what share of its light arrives at every pixel (row, col), 1 where the intensity was measured.

        Raises PsvideoError where the light was not measured.
        """
        known = dict(self.lights)
        if light not in known:
            raise PsvideoError(
                f"The flat field holds no light {light!r}; it holds {', '.join(known)}. Measure it with all lights of "
                "the plan (psvideo calibrate flat-field and its `flat`)."
            )
        left, top, right, bottom = self.box
        cols = np.clip(np.arange(self.width_px), left, right - 1)
        rows = np.clip(np.arange(self.height_px), top, bottom - 1)
        across, down = terms(cols, rows, width_px=self.width_px, height_px=self.height_px)
        total = sum(factor * np.outer(down**j, across**i) for factor, (i, j) in zip(known[light], POWERS, strict=True))
        return np.exp(total).astype(np.float32)


def terms(
    cols: NDArray[np.integer], rows: NDArray[np.integer], *, width_px: int, height_px: int
) -> tuple[Doubles, Doubles]:
    """Return columns and rows counted from the picture's middle, in half its width."""
    half = width_px / 2
    across: Doubles = (cols.astype(np.float64) - (width_px - 1) / 2) / half
    down: Doubles = (rows.astype(np.float64) - (height_px - 1) / 2) / half
    return across, down
