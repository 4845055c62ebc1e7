"""Contact sheets hold as many pictures as there are, each large enough to be seen."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.pictures.contact import LEAST_TILE_PX, Strip, Tile, sheet
from psvideo.pictures.on_screen import smaller


@pytest.mark.parametrize("count", [1, 11, 12, 96])
def test_every_picture_stands_on_the_sheet_and_none_becomes_too_small_to_see(count: int) -> None:
    red = np.full((30, 40, 3), (255, 0, 0), np.uint8)
    made = sheet([Strip("Plates", [Tile("", red)] * count)], width_px=1200)
    found, _, facts, _ = cv2.connectedComponentsWithStats((made == (255, 0, 0)).all(axis=2).astype(np.uint8))
    assert made.shape[1] == 1200
    assert found - 1 == count
    assert facts[1:, cv2.CC_STAT_WIDTH].min() >= LEAST_TILE_PX


@pytest.mark.parametrize("stored", [np.float16, np.float32, np.float64])
def test_a_large_picture_is_shown_by_the_means_of_its_squares_however_it_lies_in_memory(stored: type) -> None:
    rng = np.random.default_rng(0)
    planes: NDArray[np.floating] = rng.uniform(-1, 1, (3, 14, 23)).astype(stored)
    whole = planes[:, :12, :21].astype(np.float64).reshape(3, 4, 3, 7, 3).mean(axis=(2, 4))
    size = (6, 4)  # 7 squares across become 6
    expected = np.stack([cv2.resize(plane, size, interpolation=cv2.INTER_AREA) for plane in whole], axis=-1)
    apart = np.moveaxis(planes, 0, -1)
    for picture, means in ((apart, expected), (apart.copy(), expected), (planes[1], expected[..., 1])):
        made = smaller(picture, 6)
        assert made.dtype == np.float32
        np.testing.assert_allclose(made, means, atol=1e-6)
