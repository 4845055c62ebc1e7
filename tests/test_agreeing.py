"""What lights agree on is trusted where things move, however torn it looks; by hand, and of narrow bars."""

import math

import numpy as np
import pytest

from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.agreeing import LEAST_DOUBT_DEG, LEAST_LEFT_DEG, TIMES, Agreeing

SHAPE, LIGHTS = (120, 160), 5
AROUND = np.arange(LIGHTS) * 2 * np.pi / LIGHTS
LIT = Illumination(
    directions=np.stack(
        [0.45 * np.cos(AROUND), 0.45 * np.sin(AROUND), np.full(LIGHTS, math.sqrt(1 - 0.45**2))], axis=1
    ),
    intensities=np.ones((LIGHTS, 1)),
)


def plane(value: float) -> np.ndarray:
    return np.full((1, 1), value, np.float32)


def shown(doubt: float, left: float, *, free: float = 2.0, stirs: float = 1.0, least: float = 0.0) -> float:
    """What a doubt comes to under lights that leave so much."""
    agree = Agreeing(left_deg=plane(left), free=plane(free), stirs=plane(stirs), least_deg=plane(least))
    return float(agree.limited(plane(doubt))[0, 0])


def test_every_light_beyond_three_counts_as_much_as_the_doubt() -> None:
    left = math.hypot(2.0, LEAST_LEFT_DEG)
    assert shown(20.0, 2.0, free=1.0) == pytest.approx(TIMES * math.sqrt(left * 20), rel=1e-5)
    assert shown(20.0, 2.0, free=2.0) == pytest.approx(TIMES * (left * left * 20) ** (1 / 3), rel=1e-5)


def test_lights_take_doubt_away_and_never_add_to_it() -> None:
    assert shown(2.0, 30.0) == pytest.approx(2.0)
    assert shown(0.5 * float(LEAST_DOUBT_DEG), 0.0) == pytest.approx(0.5 * LEAST_DOUBT_DEG)
    assert shown(20.0, 0.0, free=0.0) == pytest.approx(20.0)


def test_what_stands_still_and_what_is_doubted_at_rest_too_stays() -> None:
    assert shown(20.0, 0.0, stirs=0.0) == pytest.approx(20.0)
    assert shown(20.0, 0.0, least=9.0) == pytest.approx(9.0)
    assert shown(20.0, 0.0, stirs=0.5, least=9.0) == pytest.approx(14.5)


def bars(shift_px: int = 0) -> np.ndarray:
    """Normals of round bars, twelve pixels wide, that lean back before a wall that leans forward."""
    cols = (np.arange(SHAPE[1]) - shift_px) % 24
    bar = cols < 12
    across, up = np.where(bar, (cols - 5.5) / 9, 0), np.where(bar, 0.4, -0.3)
    normals = np.stack([across, up, np.sqrt(1 - across**2 - up**2)], axis=-1)
    return np.asarray(np.broadcast_to(normals, (*SHAPE, 3)), np.float64)


def trusted(shifts_px: tuple[int, ...]) -> np.ndarray:
    """Where bars are trusted that move, of whose lights some show them elsewhere."""
    rng, plates = np.random.default_rng(4), []
    for toward, shift_px in zip(LIT.directions, shifts_px, strict=True):
        light = 0.5 * np.maximum(bars(shift_px) @ toward, 0)
        plates.append(np.asarray(light + rng.normal(0, 0.002, SHAPE), np.float32))
    unsure, moves = np.full((LIGHTS, *SHAPE), 0.002, np.float32), np.ones(SHAPE, np.bool_)
    return Solving(error=True).solve(plates, LIT, unsure=unsure, moves=moves).valid


def test_narrow_bars_are_trusted_though_their_outlines_are_torn_where_one_normal_explains_all_lights() -> None:
    assert trusted((0, 0, 0, 0, 0)).mean() > 0.95


def test_bars_that_lights_show_beside_each_other_are_not() -> None:
    assert trusted((0, 2, 0, 2, 0)).mean() < 0.4
