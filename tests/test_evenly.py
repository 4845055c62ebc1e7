"""By how much plates differ on a pixel's own side of an edge."""

import cv2
import numpy as np

from psvideo.plates.align.doubt.evenly import EACH_PX, evenly_changed

BARE = 3.0
WIDE = (13, 13)


def told(apart: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    whole = np.asarray(cv2.blur(apart, WIDE), np.float32)
    left = np.asarray(cv2.blur((apart - whole) ** 2, (5, 5)), np.float32)
    return evenly_changed(apart, (whole, left), (EACH_PX, EACH_PX), BARE)


def faces() -> np.ndarray:
    rng = np.random.default_rng(3)
    apart = rng.normal(0, 1, (60, 80)).astype(np.float32)
    apart[:, :33] += 12
    apart[:, 33:] -= 20
    return apart


def test_each_of_two_faces_is_changed_by_its_own_amount_up_to_their_edge() -> None:
    shading, left = told(faces())
    assert np.abs(shading[:, :33] - 12).max() < 1
    assert np.abs(shading[:, 33:] + 20).max() < 1
    assert left.max() < BARE**2
    assert np.abs(cv2.blur(faces(), WIDE)[:, 28:38] - shading[:, 28:38]).max() > 10, "a wide window mixes them"


def test_what_is_painted_is_judged_as_before() -> None:
    rng = np.random.default_rng(4)
    apart = rng.normal(0, 8, (60, 80)).astype(np.float32)
    shading, left = told(apart)
    whole = cv2.blur(apart, WIDE)
    assert np.array_equal(shading, whole)
    assert np.array_equal(left, cv2.blur((apart - whole) ** 2, (5, 5)))
