"""Contact sheets hold as many pictures as there are, each large enough to be seen."""

import cv2
import numpy as np
import pytest

from psvideo.pictures.contact import LEAST_TILE_PX, Strip, Tile, sheet


@pytest.mark.parametrize("count", [1, 11, 12, 96])
def test_every_picture_stands_on_the_sheet_and_none_becomes_too_small_to_see(count: int) -> None:
    red = np.full((30, 40, 3), (255, 0, 0), np.uint8)
    made = sheet([Strip("Plates", [Tile("", red)] * count)], width_px=1200)
    found, _, facts, _ = cv2.connectedComponentsWithStats((made == (255, 0, 0)).all(axis=2).astype(np.uint8))
    assert made.shape[1] == 1200
    assert found - 1 == count
    assert facts[1:, cv2.CC_STAT_WIDTH].min() >= LEAST_TILE_PX
