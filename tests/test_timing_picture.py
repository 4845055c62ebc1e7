"""The picture of a timing shows what fits and what does not."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from picture_file import read_picture

from psvideo.formats.screen_pictures import write_png
from psvideo.model.plan import Plan
from psvideo.pictures.contact import GAP_PX
from psvideo.pictures.timing_sheet import COLOURS, DARK, SIDE_PX, timing_picture
from psvideo.sync.find import timing_from_rows
from psvideo.sync.rowfit.compiled_profiles import residuals_of
from psvideo.synth import TrueClock, expose


def test_right_times_leave_nothing_and_wrong_ones_leave_red_and_blue(
    make_plan: Callable[..., Plan], tmp_path: Path
) -> None:
    plan = make_plan(height_px=60, width_px=2)
    rng = np.random.default_rng(0)
    scene = {slot: (0.2 + 0.5 * rng.random((60, 2))).astype(np.float32) for slot in plan.lit_slots}
    shot = expose(scene, plan, frames=40, clock=TrueClock(phase_s=0.004))
    profiles, places = shot.frames.mean(axis=2, dtype=np.float64), np.arange(40)
    timing = timing_from_rows(plan, places, profiles)
    late = replace(timing, flashes=tuple(replace(flash, start_s=flash.start_s + 4e-4) for flash in timing.flashes))
    assert np.abs(residuals_of(plan, timing, places, profiles)).max() < 1e-3
    assert np.abs(residuals_of(plan, late, places, profiles)).max() > 0.05
    right, wrong = (timing_picture(plan, one, places, profiles).astype(int) for one in (timing, late))
    coloured = [(np.ptp(picture, axis=2) > 60).mean() for picture in (right, wrong)]
    assert coloured[1] > coloured[0] + 0.01
    left = right[:, GAP_PX : GAP_PX + SIDE_PX]
    assert (left.min(axis=2) > 200).any(axis=1).sum() > 60, "numbers stand at the left of every plot"
    names = {flash.lit for flash in timing.flashes if flash.lit}
    for colour in (*COLOURS[: len(names)], DARK):
        squares = cv2.erode((right == colour).all(axis=2).astype(np.uint8), np.ones((12, 12), np.uint8))
        assert squares.any(), "every light's colour stands in the legend"
    write_png(tmp_path / "timing.png", right.astype(np.uint8))
    np.testing.assert_array_equal(read_picture(tmp_path / "timing.png")[..., ::-1], right)
