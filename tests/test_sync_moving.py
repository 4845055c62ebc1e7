"""Timing found where the subject moves as fast as the dark row: from rows that two frames share a flash in."""

from dataclasses import replace

import numpy as np
import pytest
from bench.timing import against_truth
from bench.timing_cases import Case, groups
from bench.timing_scenes import plan_of, rolling_stripes

from psvideo.errors import NoStrobeError
from psvideo.model.row_profiles import collect_with_doubt
from psvideo.model.timing import Timing
from psvideo.sync.find import find_timing

EVERYTHING = groups()["Several at once"]["everything: void, tumbling, drift, tails, flicker, readout"]


def timed(case: Case, seed: int) -> tuple[Timing, float]:
    """Return a case's timing and the RMS error of its flashes in rows."""
    filmed = case.film(seed)
    index, profiles, doubt = collect_with_doubt(filmed.frames)
    timing = find_timing(case.claimed or case.plan, index, profiles, doubt=doubt)
    error_s, named = against_truth(timing, filmed, 1.0)
    assert named
    return timing, float(np.sqrt(np.mean(error_s**2))) / case.plan.camera.row_time_s


def test_slow_leds_show_on_a_subject_that_tumbles_with_everything_else_unknown() -> None:
    timing, off_rows = timed(replace(EVERYTHING, frames=150), seed=1)
    assert timing.fall_s == pytest.approx(5e-5, rel=0.1)
    assert off_rows < 0.15
    assert off_rows < 3 * timing.phase_error_rows


@pytest.mark.parametrize("share", [0.3, 0.5])
def test_stripes_that_keep_pace_with_the_dark_row_are_timed(share: float) -> None:
    plan = plan_of(lights=tuple("abcde"), durations_s=(0.0016,), height_px=160, readout=0.9)
    scene = rolling_stripes(speed=1.1, share=share, pitch=1.0, light=0.3)
    timing, off_rows = timed(Case(plan=plan, scene=scene, ambient=0.02), seed=3)
    assert off_rows < 0.02
    assert timing.phase_error_rows < 0.02


def test_stripes_that_feign_another_shutter_are_refused() -> None:
    plan = plan_of(lights=tuple("abcdefgh"), shutter=0.5, height_px=96)
    case = Case(plan=plan, scene=rolling_stripes(share=0.5, pitch=1.0), frames=96)
    with pytest.raises(NoStrobeError, match="no strobe like the plan's"):
        timed(case, seed=0)
