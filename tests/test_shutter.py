"""Row weights: what share of which flash each row of each frame saw."""

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from psvideo.model.camera import Camera
from psvideo.model.rows.shutter import frames_touched, row_weights

shares = st.floats(0.0, 1.0)
PERIOD_S = 0.01


def camera(*, exposure: float = 1.0, readout: float = 1.0, height_px: int = 23) -> Camera:
    return Camera(
        width_px=4,
        height_px=height_px,
        fps=Fraction(100),
        exposure_s=exposure * PERIOD_S,
        readout_s=readout * PERIOD_S,
    )


def weights_of_one(shot: Camera, start_s: float, duration_s: float) -> np.ndarray:
    weights: np.ndarray = row_weights(shot, np.array([start_s]), np.array([duration_s]), frames=range(-3, 12))[0]
    return weights


@given(readout=st.floats(-1, 1), start=st.floats(0, 8), duration=st.floats(0.001, 0.9))
def test_at_360_degrees_every_row_sees_the_whole_flash_over_its_frames(
    readout: float, start: float, duration: float
) -> None:
    weights = weights_of_one(camera(readout=readout), start * PERIOD_S, duration * PERIOD_S)
    np.testing.assert_allclose(weights.sum(axis=0), 1.0, atol=1e-9)


@given(exposure=st.floats(0.05, 1), readout=st.floats(-1, 1), start=st.floats(0, 8), duration=st.floats(0.001, 0.9))
def test_the_share_is_what_counting_instants_finds(
    exposure: float, readout: float, start: float, duration: float
) -> None:
    shot = camera(exposure=exposure, readout=readout, height_px=5)
    weights = weights_of_one(shot, start * PERIOD_S, duration * PERIOD_S)
    instants_s = (start + duration * (np.arange(4000) + 0.5) / 4000) * PERIOD_S
    for n in range(-3, 12):
        for row, offset_s in enumerate(shot.row_offsets_s()):
            opens_s = n * PERIOD_S + offset_s
            counted = np.mean((instants_s >= opens_s) & (instants_s < opens_s + shot.exposure_s))
            assert abs(weights[n + 3, row] - counted) < 1e-3


@given(
    exposure=st.floats(0.05, 1),
    readout=st.floats(-1, 1),
    start=st.floats(0, 1),
    durations=st.lists(st.floats(0.01, 0.5), min_size=2, max_size=6),
)
def test_under_the_rolling_rule_no_row_is_lit_by_two_flashes(
    exposure: float, readout: float, start: float, durations: list[float]
) -> None:
    duration_s = np.array(durations) * PERIOD_S
    gaps_s = np.concatenate([[0.0], np.cumsum(duration_s[:-1] + exposure * PERIOD_S)])
    weights = row_weights(
        camera(exposure=exposure, readout=readout), start * PERIOD_S + gaps_s, duration_s, frames=range(0, 10)
    )
    assert ((weights > 1e-9).sum(axis=0) <= 1).all()


@given(start=st.floats(0, 5), duration=st.floats(0.01, 0.9))
def test_a_global_shutter_is_the_limit_of_no_readout(start: float, duration: float) -> None:
    weights = weights_of_one(camera(readout=0.0), start * PERIOD_S, duration * PERIOD_S)
    assert (weights == weights[:, :1]).all()
    nearly = weights_of_one(camera(readout=1e-9), start * PERIOD_S, duration * PERIOD_S)
    np.testing.assert_allclose(weights, nearly, atol=1e-5)


@given(start=st.floats(0, 5), duration=st.floats(0.01, 0.9), readout=st.floats(0.01, 1))
def test_bottom_up_is_top_down_upside_down(start: float, duration: float, readout: float) -> None:
    down = weights_of_one(camera(readout=readout), start * PERIOD_S, duration * PERIOD_S)
    up = weights_of_one(camera(readout=-readout), start * PERIOD_S, duration * PERIOD_S)
    np.testing.assert_allclose(up, down[:, ::-1], atol=1e-9)


@given(exposure=st.floats(0.05, 1), readout=st.floats(-1, 1), start=st.floats(0, 8), duration=st.floats(0.01, 0.9))
def test_the_frames_touched_are_those_with_any_weight(
    exposure: float, readout: float, start: float, duration: float
) -> None:
    shot = camera(exposure=exposure, readout=readout)
    weights = weights_of_one(shot, start * PERIOD_S, duration * PERIOD_S)
    lit = np.flatnonzero((weights > 1e-9).any(axis=1)) - 3
    first, last = frames_touched(shot, np.array([start * PERIOD_S]), np.array([duration * PERIOD_S]))
    if lit.size:
        assert first[0] <= lit[0]
        assert lit[-1] <= last[0]
    touched_but_dark = set(range(first[0], last[0] + 1)) - set(lit.tolist())
    assert not touched_but_dark or exposure < 1 or weights.max() < 1e-9 or min(touched_but_dark) in (first[0], last[0])


def test_a_flash_touches_three_frames_exactly_where_row_0_is_split_and_the_last_row_is_still_a_frame_behind() -> None:
    shot = camera(height_px=1000)
    for start in np.arange(0.8505, 1.0, 0.01):
        first, last = frames_touched(shot, np.array([start * PERIOD_S]), np.array([0.1 * PERIOD_S]))
        three = last[0] - first[0] + 1 == 3
        assert three == (0.9 < start < 0.999)
