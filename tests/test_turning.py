"""What turns between two plates of every light is off by the height of an arc, which the lights do not show."""

import math

import numpy as np
import pytest

from psvideo.plates.align.doubt.turning import MOST_DEG, arc_deg
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.velocity.brightness import EVERY_CODE, light_of
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.solving import Solving

SHAPE, LIGHTS, WHITE = (48, 64), 5, 0.8
AROUND = np.arange(LIGHTS) * 2 * np.pi / LIGHTS
TOWARD = np.stack([0.4 * np.cos(AROUND), 0.4 * np.sin(AROUND), np.full(LIGHTS, math.sqrt(0.84))], axis=1)
STRENGTH = 0.9


def facing(turn_deg: float) -> np.ndarray:
    """A normal that turned so far about the vertical."""
    return np.array([math.sin(math.radians(turn_deg)), 0.1, math.cos(math.radians(turn_deg))]) / math.sqrt(1.01)


def codes(light: float) -> np.ndarray:
    """A sketch of so much light all over."""
    every = light_of(EVERY_CODE) * WHITE
    return np.full(SHAPE, int(np.abs(every - light).argmin()), np.uint8)


def arc_between(turns_deg: tuple[float, float]) -> float:
    ends = []
    for toward in TOWARD:
        before, after = (codes(0.7 * STRENGTH * float(facing(turn_deg) @ toward)) for turn_deg in turns_deg)
        ends.append((before, after, WHITE))
    return float(arc_deg(Lamps(names=tuple("abcde"), matrix=TOWARD * STRENGTH), ends)[20, 30])


@pytest.mark.parametrize("turned_deg", [10.0, 20.0, 30.0])
def test_what_turns_is_off_by_the_height_of_its_arc(turned_deg: float) -> None:
    height_deg = math.degrees(math.radians(turned_deg) ** 2 / 8)
    assert arc_between((-turned_deg / 2, turned_deg / 2)) == pytest.approx(height_deg, rel=0.1)


def test_what_does_not_turn_is_not_off_and_what_turns_far_by_no_more() -> None:
    assert arc_between((10.0, 10.0)) < 0.01
    assert arc_between((-30.0, 30.0)) == pytest.approx(float(MOST_DEG))


def test_lights_that_agree_take_nothing_off_it() -> None:
    lit = Illumination(directions=TOWARD, intensities=np.full((LIGHTS, 1), STRENGTH))
    rng = np.random.default_rng(3)
    plates = [
        np.asarray(0.6 * float(facing(5.0) @ toward) + rng.normal(0, 0.001, SHAPE), np.float32) for toward in TOWARD
    ]
    unsure, moves = np.full((LIGHTS, *SHAPE), 0.002, np.float32), np.ones(SHAPE, np.bool_)
    for arc in (0.0, 3.0):
        given = LitPlates(plates, lit, unsure=unsure, moves=moves, arc_deg=np.full(SHAPE, arc, np.float32))
        error_deg = Solving(error=True).solve_again(given)[0].error_deg
        assert error_deg is not None
        assert arc <= error_deg[20, 30] < arc + 1
