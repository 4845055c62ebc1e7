"""The detail of sketches, by which they are compared, against the same in plain numpy."""

import cv2
import numpy as np

from psvideo.plates.align.velocity.detail import CONTRAST, SHADING, SHADING_PX, detail_of, smoothed


def test_detail_is_what_is_left_without_shading_brought_down_to_the_most_contrast() -> None:
    rng = np.random.default_rng(6)
    codes = np.clip(rng.normal(90, 12, (40, 61)) + 100 * (np.arange(61) > 30), 0, 255).astype(np.uint8)
    smooth = smoothed(codes)
    shading = cv2.blur(smooth, (SHADING_PX, SHADING_PX))
    contrast = np.sqrt(cv2.blur((smooth - shading) ** 2, (SHADING_PX, SHADING_PX)))
    expected = 64 + (smooth - shading) * CONTRAST / np.maximum(contrast, CONTRAST) + (1 - SHADING) * shading
    made = detail_of(codes)
    assert made.dtype == np.uint8
    assert np.abs(made - expected).max() < 0.51, "codes round"
    assert contrast.max() > 2 * CONTRAST > 2 * contrast.min()


def test_codes_of_detail_stay_within_eight_bits() -> None:
    codes = np.full((30, 30), 255, np.uint8)
    codes[14:16] = 0
    assert detail_of(codes).max() < 255
    assert detail_of(np.zeros((30, 30), np.uint8)).max() == 64
