"""What repeats itself fits the next of its kind from round to round, but not from flash to flash."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from psvideo.plates.align.velocity import all_lights
from psvideo.plates.align.velocity.between_lights import BetweenLights
from psvideo.plates.align.velocity.correlation import displacements
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Pair
from psvideo.plates.align.velocity.moving import followed_at

SHAPE, LIGHTS, SQUARE_PX, ROUND_S = (120, 160), 4, 16.0, 1.0
FLASHES_S = ROUND_S / (LIGHTS + 1) * (np.arange(LIGHTS) - (LIGHTS - 1) / 2)
"""The flashes of the round in whose middle the instant 0 lies; behind them is a dark slot."""
INNER = np.s_[24:-24, 32:-32]


def cloth(light: int, right_px: float) -> np.ndarray:
    """The codes of a checkered cloth, so far to the right, with the shading of one light and some noise."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    checks = np.tanh(4 * np.sin(np.pi * (x - right_px) / SQUARE_PX)) * np.tanh(4 * np.sin(np.pi * y / SQUARE_PX))
    shading = 15 * np.cos(light + y / 40) + (20 - 10 * light) * (x / SHAPE[1] - 0.5)
    noise = np.random.default_rng([light, int(1000 * right_px) % 100_000]).normal(0, 1, SHAPE)
    return np.asarray(np.clip(120 + 40 * checks + shading + noise, 0, 255), np.uint8)


def sketch(light: int, time_s: float, right_px: float) -> Sketch:
    codes = cloth(light, right_px)
    blocks = codes.reshape(SHAPE[0] // 8, 8, SHAPE[1] // 8, 8).mean(axis=(1, 3)).astype(np.float32)
    seen = np.ones((SHAPE[0], 1), np.bool_)
    return Sketch(number=1, time_s=time_s, codes=codes, seen=seen, blocks=blocks, white=1.0)


def pairs(way_px: Callable[[float], float]) -> list[Pair]:
    """Every light's plates before and after the instant 0, of a cloth that goes this way."""
    times_s = [(time_s - ROUND_S * (time_s > 0), time_s + ROUND_S * (time_s <= 0)) for time_s in FLASHES_S]
    return [
        Pair(before=sketch(light, one, way_px(one)), after=sketch(light, other, way_px(other)))
        for light, (one, other) in enumerate(times_s)
    ]


@pytest.mark.parametrize(("far", "at_rest"), [(0.5, 0.98), (1.0, 0.6)])
def test_a_checkered_cloth_at_its_turning_point_goes_nowhere(far: float, at_rest: float) -> None:
    found = followed_at(pairs(lambda time_s: far * SQUARE_PX / 2 * (1 - math.cos(math.pi * time_s / ROUND_S))), 0.0)
    assert (np.hypot(*found.velocity)[INNER] < SQUARE_PX / 4).mean() > at_rest


def test_a_checkered_cloth_that_slides_is_still_followed() -> None:
    found = followed_at(pairs(lambda time_s: 9 * time_s / ROUND_S), 0.0)
    assert np.abs(found.velocity[0][INNER] - 9 / ROUND_S).mean() < 0.5


@pytest.mark.parametrize("goes_px", [0.0, 9.0, -9.0])
def test_lights_agree_along_the_true_way_whatever_their_shading(goes_px: float) -> None:
    spans_s = np.array([(-time_s, ROUND_S) if time_s <= 0 else (ROUND_S, time_s) for time_s in FLASHES_S], np.float32)
    codes = [(cloth(light, goes_px * time_s / ROUND_S),) * 2 for light, time_s in enumerate(FLASHES_S)]
    between = BetweenLights.of(codes, spans_s, SHAPE)

    def disagree(px: float) -> float:
        velocity = np.zeros((2, *SHAPE), np.float32)
        velocity[0] = px / ROUND_S
        return float(between.disagree(velocity, 27)[INNER].mean())

    true = disagree(goes_px)
    assert true < 0.1
    for beside_px in (-2 * SQUARE_PX, 2 * SQUARE_PX):
        assert disagree(goes_px + beside_px) > true + 0.5


@pytest.mark.parametrize(("px", "far"), [(9, False), (70, True)])
def test_what_leaves_the_picture_is_not_looked_for_far_away(
    px: int, far: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A camera that turns brings new things in at one side, which no plate before shows: that is no puzzle."""
    rng, asked = np.random.default_rng(3), list[tuple[Any, ...]]()
    wide = np.clip(120 + 60 * cv2.GaussianBlur(rng.normal(0, 6, (SHAPE[0], SHAPE[1] + 200)), (0, 0), 3), 0, 255)

    def panned(light: int, time_s: float) -> Sketch:
        left = round(px * (time_s + 1.5 * ROUND_S) / ROUND_S)
        codes = np.asarray(wide[:, left : left + SHAPE[1]] * (0.7 + 0.1 * light), np.uint8)
        return replace(sketch(light, time_s, 0.0), codes=codes)

    shown = [
        Pair(before=panned(light, one), after=panned(light, one + ROUND_S))
        for light, one in enumerate(FLASHES_S - ROUND_S * (FLASHES_S > 0))
    ]

    def asking(*given: Any) -> list[tuple[float, float]]:
        asked.append(given)
        return displacements(*given)

    monkeypatch.setattr(all_lights, "displacements", asking)
    found = followed_at(shown, 0.0)
    assert bool(asked) == far
    assert np.abs(found.velocity[0][24:-24, 64:-64] + px / ROUND_S).mean() < 1.5
