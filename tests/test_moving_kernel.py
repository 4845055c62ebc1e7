"""How unlike plates are along velocities, in vectors of eight pixels, against single pixels in plain Python."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.compute.eight_lanes import EIGHT
from psvideo.plates.align.velocity.moving_kernel import UNLIKE_SQUARE, unlike_rows


def _between(picture: NDArray[np.uint8], row: float, col: float) -> float:
    row, col = min(max(row, 0), picture.shape[0] - 1), min(max(col, 0), picture.shape[1] - 1)
    total = 0.0
    for at_row, over in ((math.floor(row), 1 - row % 1), (math.ceil(row), row % 1)):
        for at_col, beside in ((math.floor(col), 1 - col % 1), (math.ceil(col), col % 1)):
            total += over * beside * float(picture[at_row, at_col])
    return total


@pytest.mark.parametrize("fine", [(9, 21), (19, 43), (6, 3), (1, 4)])
def test_how_unlike_plates_are_is_what_single_pixels_make_it(fine: tuple[int, int]) -> None:
    rng = np.random.default_rng(3)
    coarse = (max(fine[0] // 2, 1), max(fine[1] // 2, 1)) if fine[1] == 43 else fine
    befores, afters = rng.integers(0, 30, (2, 3, *fine)).astype(np.uint8)
    spans_s = rng.uniform(-0.2, 1, (3, 2, coarse[0])).astype(np.float32)
    velocity = rng.uniform(-12, 12, (2, *coarse)).astype(np.float32)
    out = np.full(coarse, -1, np.float32)
    room = np.zeros((4, -(-coarse[1] // EIGHT) * EIGHT), np.float32)
    unlike_rows(befores, afters, spans_s, velocity, 1 if coarse[0] > 1 else 0, coarse[0], room, out)
    high, wide = fine[0] / coarse[0], fine[1] / coarse[1]
    for row in range(coarse[0]):
        for col in range(coarse[1]):
            if row == 0 and coarse[0] > 1:
                assert out[row, col] == -1
                continue
            x, y = (float(plane[row, col]) * per for plane, per in zip(velocity, (wide, high), strict=True))
            across, down = (col + 0.5) * wide - 0.5, (row + 0.5) * high - 0.5
            total = 0.0
            for light, (since, until) in enumerate(spans_s[:, :, row].tolist()):
                one = _between(befores[light], down - y * since, across - x * since)
                other = _between(afters[light], down + y * until, across + x * until)
                total += (other - one) ** 2 / ((other - one) ** 2 + float(UNLIKE_SQUARE))
            assert out[row, col] == pytest.approx(total, abs=2e-4), (row, col)
