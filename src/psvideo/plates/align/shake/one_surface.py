"""How well one surface explains the lights' pictures, each shifted by its own amount: which shifts it explains best.

Paint and outlines show a shift between two lights, but shading and shadows seem shifted too, and another way under
every light. Of four lights and more a matte surface explains the pictures only where they lie on each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.model.arrays import Doubles, Flags, Floats
from psvideo.plates.align.shake.registered import shifted

MATTE = 0.05
"""What a matte surface leaves of light where pictures lie on each other, as a share."""
LEAST_LIT, CLIPPED = np.float32(0.03), np.float32(0.95)
"""As shares of white: less is shadow, more may be clipped."""
BESIDE_PX, BORDER_PX = 5, 12
"""What lies so near to shadows and clipped light, or to the border, is left out."""
FEWEST = 2000
"""So many pixels that all lights reach, at least."""
STEPS, LONGEST_PX, SMALL_PX = 12, 1.5, 0.01
DAMPING = 1e-3


@dataclass(frozen=True, kw_only=True)
class OneSurface:
    """``light`` (light, row, col) as a share of white, and what no normal and albedo explain of it, ``odd`` (some,
    light): orthonormal rows."""

    light: Floats
    odd: Doubles

    @classmethod
    def of(cls, light: Sequence[Floats], whites: Sequence[float], matrix: Doubles) -> "OneSurface":
        """``light`` is one picture a light, 1 where it is ``whites``, and ``matrix`` (light, 3) the lights' directions
        times their strengths."""
        odd = np.linalg.svd(matrix / np.array(whites)[:, None])[0][:, 3:].T
        return cls(light=np.stack(light), odd=odd)

    def left(self, shifts: Doubles) -> float:
        """Return which share of the pictures no surface explains where each is shifted back by its own (light, 2), 0 to
        1; 1 where too little is lit by all."""
        light, lit = self._back(shifts)
        if np.count_nonzero(lit) < FEWEST:
            return 1.0
        square = np.square(self._residual(light[:, lit]))
        return float(np.mean(square / (square + MATTE**2)))

    def refined(self, shifts: Doubles) -> Doubles:
        """Return shifts, (light, 2), that leave less, from some on."""
        found, least = shifts, self.left(shifts)
        for _ in range(STEPS):
            step = self._step(found)
            if step is None:
                break
            found, left = found + step, self.left(found + step)
            if left < least:
                shifts, least = found, left
            if np.abs(step).max() < SMALL_PX:
                break
        return shifts

    def _step(self, shifts: Doubles) -> Doubles | None:
        light, lit = self._back(shifts)
        if np.count_nonzero(lit) < FEWEST:
            return None
        ways = ((1, 0), (0, 1))
        slopes = np.stack([cv2.Sobel(one, cv2.CV_32F, *way, scale=1 / 8)[lit] for one in light for way in ways])
        mean = light[:, lit].mean(axis=0)
        square, wanted = np.zeros((len(slopes),) * 2), np.zeros(len(slopes))
        for odd, own in zip(self.odd, self._residual(light[:, lit]), strict=True):
            weight = np.square(1 / (1 + np.square(own / MATTE)))
            each = slopes * np.repeat(odd, 2).astype(np.float32)[:, None] / mean
            square += (each * weight) @ each.T
            wanted -= np.einsum("ip,p->i", each * weight, own)  # BLAS would cut sums by threads
        square += DAMPING * np.trace(square) / len(square) * np.eye(len(square))
        step = np.linalg.solve(square, wanted).reshape(-1, 2)
        return np.asarray(np.clip(step - step.mean(axis=0), -LONGEST_PX, LONGEST_PX), np.float64)

    def _back(self, shifts: Doubles) -> tuple[Floats, Flags]:
        light = np.stack([shifted(one, -own) for one, own in zip(self.light, shifts, strict=True)])
        reached = np.asarray(((light > LEAST_LIT) & (light < CLIPPED)).all(axis=0), np.bool_)
        lit = cv2.erode(reached.view(np.uint8), np.ones((BESIDE_PX,) * 2, np.uint8)) > 0
        inner = np.zeros_like(lit)
        inner[BORDER_PX:-BORDER_PX, BORDER_PX:-BORDER_PX] = True
        return light, np.asarray(lit & inner)

    def _residual(self, light: Floats) -> Floats:
        return np.asarray(self.odd.astype(np.float32) @ light / light.mean(axis=0), np.float32)
