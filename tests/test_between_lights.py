"""What repeats itself fits the next of its kind from round to round, but not from flash to flash."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from psvideo.plates.align.velocity import all_lights, between_lights
from psvideo.plates.align.velocity.between_lights import BetweenLights
from psvideo.plates.align.velocity.correlation import displacements
from psvideo.plates.align.velocity.flow import Sketch
from psvideo.plates.align.velocity.followed import Pair
from psvideo.plates.align.velocity.moving import followed_at

SHAPE, LIGHTS, SQUARE_PX, ROUND_S = (120, 160), 4, 16.0, 1.0
FLASHES_S = ROUND_S / (LIGHTS + 1) * (np.arange(LIGHTS) - (LIGHTS - 1) / 2)
"""The flashes of the round in whose middle the instant 0 lies; behind them is a dark slot."""
INNER = np.s_[24:-24, 32:-32]


def cloth(light: int, right_px: float, turned: float = 0.0) -> np.ndarray:
    """The codes of a checkered cloth, so far to the right or turned about its middle, with the shading of one light and
    some noise."""
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    shading = 15 * np.cos(light + y / 40) + (20 - 10 * light) * (x / SHAPE[1] - 0.5)
    x, y = turned_back(x, y, turned)
    checks = np.tanh(4 * np.sin(np.pi * (x - right_px) / SQUARE_PX)) * np.tanh(4 * np.sin(np.pi * y / SQUARE_PX))
    noise = np.random.default_rng([light, int(1000 * (right_px + turned)) % 100_000]).normal(0, 1, SHAPE)
    return np.asarray(np.clip(120 + 40 * checks + shading + noise, 0, 255), np.uint8)


def turned_back(x: np.ndarray, y: np.ndarray, radians: float) -> tuple[np.ndarray, np.ndarray]:
    """Where points lay before the picture turned about its middle."""
    right, down = x - (SHAPE[1] - 1) / 2, y - (SHAPE[0] - 1) / 2
    cos, sin = math.cos(radians), math.sin(radians)
    return cos * right + sin * down + (SHAPE[1] - 1) / 2, cos * down - sin * right + (SHAPE[0] - 1) / 2


def sketch(light: int, time_s: float, right_px: float, turned: float = 0.0) -> Sketch:
    codes = cloth(light, right_px, turned)
    blocks = codes.reshape(SHAPE[0] // 8, 8, SHAPE[1] // 8, 8).mean(axis=(1, 3)).astype(np.float32)
    seen = np.ones((SHAPE[0], 1), np.bool_)
    return Sketch(number=1, time_s=time_s, codes=codes, seen=seen, blocks=blocks, white=1.0)


def pairs(way_px: Callable[[float], float], turn: float = 0.0) -> list[Pair]:
    """Every light's plates before and after the instant 0, of a cloth that goes this way and turns by so much in a
    round."""
    times_s = [(time_s - ROUND_S * (time_s > 0), time_s + ROUND_S * (time_s <= 0)) for time_s in FLASHES_S]
    return [
        Pair(
            before=sketch(light, one, way_px(one), turn * one), after=sketch(light, other, way_px(other), turn * other)
        )
        for light, (one, other) in enumerate(times_s)
    ]


@pytest.mark.parametrize(("far", "at_rest"), [(0.5, 0.98), (1.0, 0.6)])
def test_a_checkered_cloth_at_its_turning_point_goes_nowhere(far: float, at_rest: float) -> None:
    found = followed_at(pairs(lambda time_s: far * SQUARE_PX / 2 * (1 - math.cos(math.pi * time_s / ROUND_S))), 0.0)
    assert (np.hypot(*found.velocity)[INNER] < SQUARE_PX / 4).mean() > at_rest


def test_a_checkered_cloth_that_slides_is_still_followed() -> None:
    found = followed_at(pairs(lambda time_s: 9 * time_s / ROUND_S), 0.0)
    assert np.abs(found.velocity[0][INNER] - 9 / ROUND_S).mean() < 0.5


@pytest.mark.parametrize("turn", [0.25, -0.25])
def test_a_checkered_cloth_that_turns_is_followed_from_flash_to_flash(turn: float) -> None:
    """From round to round its corners come to lie nearer to other squares."""
    found = followed_at(pairs(lambda _: 0.0, turn), 0.0)
    y, x = (axis.astype(np.float64) for axis in np.mgrid[: SHAPE[0], : SHAPE[1]])
    true = np.stack([-(y - (SHAPE[0] - 1) / 2), x - (SHAPE[1] - 1) / 2]) * turn / ROUND_S
    off = np.hypot(*(found.velocity - true))[INNER]
    assert (off < 2).mean() > 0.9


def test_what_steps_from_light_to_light_propose_is_the_true_way_whatever_their_shading() -> None:
    spans_s = np.array([(-time_s, ROUND_S) if time_s <= 0 else (ROUND_S, time_s) for time_s in FLASHES_S], np.float32)
    codes = [(cloth(light, 26 * time_s / ROUND_S),) * 2 for light, time_s in enumerate(FLASHES_S)]
    (velocity,) = BetweenLights.of(codes, spans_s, SHAPE).proposed()
    assert np.abs(velocity[0][INNER] - 26 / ROUND_S).mean() < 0.5
    assert np.abs(velocity[1][INNER]).mean() < 0.5


def test_lights_of_one_flash_propose_nothing() -> None:
    codes = [(cloth(light, 0.0),) * 2 for light in range(LIGHTS)]
    assert BetweenLights.of(codes, np.full((LIGHTS, 2), 0.5, np.float32), SHAPE).proposed() == []


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


WAVE_PX = 66.0
"""From one fold of a waving cloth to the next."""
FOLDS = (192, 256)


def waving(light: int, time_s: float, px: float) -> Sketch:
    """The codes of a cloth whose folds go so far to the right in a round; its faint paint sways with them."""
    y, x = np.mgrid[: FOLDS[0], : FOLDS[1]].astype(np.float64)
    phase = 2 * np.pi / WAVE_PX * (x + 0.35 * y - px * time_s / ROUND_S)
    other = 2 * np.pi * y / 90 + np.pi / WAVE_PX * px * time_s / ROUND_S
    steep = 2 * np.pi / WAVE_PX * 9 * np.cos(phase)
    normals = np.stack([-steep, -0.35 * steep - 2 * np.pi / 90 * 5 * np.cos(other), np.ones_like(x)])
    normals /= np.linalg.norm(normals, axis=0)
    turn = 2 * np.pi * light / 3 + 0.35
    lit = np.tensordot([0.57 * np.cos(turn), 0.57 * np.sin(turn), 0.82], normals, 1)
    skin = np.random.default_rng(2).normal(size=(2, FOLDS[0] + 64, FOLDS[1] + 64))
    paint = sum(
        size * cv2.GaussianBlur(one, (0, 0), wide) for one, size, wide in zip(skin, (1.4, 0.25), (6, 2), strict=True)
    )
    sway = [place.astype(np.float32) for place in (x + 32 + 6 * np.cos(phase), y + 32 + 4 * np.sin(other))]
    shown = (
        0.5 * (1 + cv2.remap(np.asarray(paint, np.float32), sway[0], sway[1], cv2.INTER_LINEAR)) * np.maximum(lit, 0)
    )
    noise = np.random.default_rng([light, int(1000 * (time_s + 5))]).normal(0, 1, FOLDS)
    codes = np.asarray(np.clip(255 * np.sqrt(shown) + noise, 0, 255), np.uint8)
    blocks = codes.reshape(FOLDS[0] // 8, 8, FOLDS[1] // 8, 8).mean(axis=(1, 3)).astype(np.float32)
    return Sketch(number=1, time_s=time_s, codes=codes, seen=np.ones((FOLDS[0], 1), np.bool_), blocks=blocks, white=1.0)


@pytest.mark.parametrize("px", [11.0, 16.0])
def test_folds_under_three_lights_are_not_followed_to_the_next_but_one(px: float) -> None:
    times_s = ROUND_S / 4 * (np.arange(3) - 1)
    shown = [
        Pair(before=waving(light, one, px), after=waving(light, one + ROUND_S, px))
        for light, one in enumerate(times_s - ROUND_S * (times_s > 0))
    ]
    found = followed_at(shown, 0.0)
    assert (np.hypot(*found.velocity) * ROUND_S > WAVE_PX / 2).mean() < 0.05


@pytest.mark.parametrize(("threads", "most"), [("1", 1), ("2", 1), ("4", 2)])
def test_flows_leave_the_threads_that_write_to_these(
    threads: str, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    """Each holds as much as a plate, on top of what is being written."""
    at_a_time, counts, lock = [0], list[int](), threading.Lock()

    def counted(one: np.ndarray, *_: object, **__: object) -> np.ndarray:
        with lock:
            at_a_time[0] += 1
            counts.append(at_a_time[0])
        time.sleep(0.02)
        with lock:
            at_a_time[0] -= 1
        return np.zeros((*one.shape, 2), np.float32)

    monkeypatch.setenv("PSVIDEO_THREADS", threads)
    for room in (all_lights, between_lights):
        monkeypatch.setattr(room, "flow_from", counted)
    followed_at(pairs(lambda time_s: 9 * time_s / ROUND_S), 0.0)
    assert len(counts) > 1
    assert max(counts) <= most
