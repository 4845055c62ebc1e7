"""Rounds at rest share their doubts: these are looked for in every fourth of them, and anew where anything changed."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.clip import open_masks
from psvideo.model.plan import Plan
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Surface
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import POOLED_ROUNDS, VOTING_BLOCKS, Round
from psvideo.solve.at_rest import LOOKS_EVERY
from psvideo.solve.instants import surfaces
from psvideo.solve.normals import plate_noise, solving
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.trust import judging, signs
from psvideo.solve.normals.trust.doubts import POOLED_LOOKS, Doubt, Doubts

NAMES = ("a", "b", "c", "d")
WAYS = np.array([[0.5, 0.1, 0.86], [-0.4, 0.4, 0.82], [-0.1, -0.6, 0.79], [0.1, 0.1, 0.99]])
RIG = Rig(lights=tuple(Light(name=name, direction=tuple(way)) for name, way in zip(NAMES, WAYS, strict=True)))
STANDS, CHANGED = np.ones((2, 2), np.bool_), np.array([[True, True], [False, True]])
ROWS, COLS = 40, 48
MakePlan = Callable[..., Plan]


def a_round(number: int, *, stood: NDArray[np.bool_] | None = STANDS, **more: Any) -> Round:
    """A ball that stands still, in a camera's noise that is each round's own."""
    rng = np.random.default_rng(number)
    across, down = np.meshgrid((np.arange(COLS) - 23.5) / 18, (19.5 - np.arange(ROWS)) / 18)
    inside = across**2 + down**2 < 1
    normals = np.stack([across, down, np.sqrt(np.maximum(1 - across**2 - down**2, 0))], axis=-1)
    plates = []
    for n, (name, way) in enumerate(zip(NAMES, WAYS, strict=True)):
        light = 0.6 * inside * np.maximum(normals @ (way / np.linalg.norm(way)), 0)
        picture = (light + rng.normal(0, 0.01, light.shape)).astype(np.float32)
        seen, time_s = np.ones(ROWS, np.bool_), 0.01 * (5 * number + n)
        plates.append(LightPlate(light=name, number=number, time_s=time_s, picture=mixture_of(picture), seen=seen))
    return Round(number=number, plates=tuple(plates), stood=stood, **more)


def solved(rounds: list[Round], make_plan: MakePlan, **options: Any) -> list[Surface]:
    return [one.surface for one in surfaces(rounds, make_plan(lights=NAMES), RIG, **options)]


@pytest.fixture
def looks(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many looks there were, one number for each."""
    counted: list[int] = []
    signs_of = signs.signs_of

    def counting(*given: Any, **options: Any) -> Any:
        counted.append(len(counted))
        return signs_of(*given, **options)

    monkeypatch.setattr(judging, "signs_of", counting)
    return counted


def test_of_rounds_at_rest_the_first_and_every_fourth_look(make_plan: MakePlan, looks: list[int]) -> None:
    solved([a_round(number) for number in range(1001, 1001 + 2 * POOLED_ROUNDS)], make_plan)
    assert len(looks) == 1 + 2 * POOLED_ROUNDS // LOOKS_EVERY


UNSURE = np.full((4, 2, 2), 0.01, np.float32)


@pytest.mark.parametrize(
    "changed",
    [
        pytest.param(a_round(1002, stood=CHANGED), id="a corner changed"),
        pytest.param(a_round(1002, stood=None), id="nobody compared it"),
        pytest.param(a_round(1003), id="a round is missing before it"),
        pytest.param(a_round(1002, unsure=UNSURE), id="it was moved"),
    ],
)
def test_what_changed_is_looked_at_anew(changed: Round, make_plan: MakePlan, looks: list[int]) -> None:
    solved([a_round(1001), changed], make_plan)
    assert len(looks) == 2


def test_rounds_under_masks_of_their_own_look_each(make_plan: MakePlan, looks: list[int], tmp_path: Path) -> None:
    """A mask may show what no look has seen."""
    for number in (1001, 1002):
        cv2.imwrite(str(tmp_path / f"mask.{number}.png"), np.full((ROWS, COLS), 255, np.uint8))
    masks = open_masks(tmp_path, width_px=COLS, height_px=ROWS)
    solved([a_round(1001), a_round(1002)], make_plan, masks=masks)
    assert len(looks) == 2


def test_a_round_that_moved_leaves_nothing_to_the_next(make_plan: MakePlan, looks: list[int]) -> None:
    solved([a_round(1001, unsure=UNSURE), a_round(1002), a_round(1003)], make_plan)
    assert len(looks) == 2


def test_a_round_of_which_rows_are_missing_leaves_nothing_to_the_next(make_plan: MakePlan, looks: list[int]) -> None:
    whole = a_round(1001)
    seen = np.arange(ROWS) > 5
    cut = replace(whole, plates=(replace(whole.plates[0], seen=seen), *whole.plates[1:]))
    solved([cut, a_round(1002), a_round(1003)], make_plan)
    assert len(looks) == 2


def test_how_noisy_plates_are_is_known_from_the_last_look(make_plan: MakePlan, monkeypatch: pytest.MonkeyPatch) -> None:
    asked, noise_of = list[int](), plate_noise.noise_of

    def counting(*given: Any) -> PlateNoise:
        asked.append(len(asked))
        return noise_of(*given)

    monkeypatch.setattr(solving, "noise_of", counting)
    solved([a_round(number) for number in range(1001, 1001 + POOLED_ROUNDS)], make_plan)
    assert len(asked) == 1 + POOLED_ROUNDS // LOOKS_EVERY


def test_rounds_that_say_nothing_of_each_other_look_each(make_plan: MakePlan, looks: list[int]) -> None:
    solved([a_round(number) for number in range(1001, 1004)], make_plan, one_by_one=True)
    assert len(looks) == 3


def test_a_run_that_begins_with_the_blocks_before_looks_and_trusts_the_same(make_plan: MakePlan) -> None:
    """Runs are cut into pieces, stopped and resumed there: the bytes are the same."""
    first, before = 1001 // POOLED_ROUNDS * POOLED_ROUNDS + POOLED_ROUNDS, VOTING_BLOCKS * POOLED_ROUNDS
    rounds = [a_round(number) for number in range(1001, first + before + POOLED_ROUNDS + 3)]
    whole = solved(rounds, make_plan)[first + before - 1001 :]
    beginning = [replace(one, stood=None) if one.number == first else one for one in rounds[first - 1001 :]]
    piece = solved(beginning, make_plan)[before:]
    assert len(whole) == len(piece) == POOLED_ROUNDS + 3
    for one, other in zip(whole, piece, strict=True):
        np.testing.assert_array_equal(one.valid, other.valid)
        np.testing.assert_array_equal(one.normals, other.normals)


def look(value: float) -> Doubt:
    plane = np.full((2, 3), value, np.float32)
    return Doubt(
        doubt_deg=plane,
        usual_deg=2 * plane,
        lost_deg=plane,
        by_slope_deg=plane,
        shadows_lit=value / 10,
        explained=value / 20,
    )


def test_doubts_are_the_mean_of_the_last_looks() -> None:
    doubts = Doubts()
    for value in (9.0, 1.0, 2.0, 3.0, 6.0):
        doubts = doubts.and_of(look(value), PlateNoise(read=value, photon=0.0))
    assert doubts.noise == PlateNoise(read=6.0, photon=0.0)
    assert len(doubts.looks) == POOLED_LOOKS
    np.testing.assert_allclose(doubts.mean.doubt_deg, 3)
    np.testing.assert_allclose(doubts.mean.usual_deg, 6)
    assert doubts.mean.shadows_lit == pytest.approx(0.3)


def test_a_block_of_rounds_holds_the_looks_that_are_pooled() -> None:
    assert POOLED_ROUNDS % LOOKS_EVERY == 0
    assert POOLED_LOOKS * LOOKS_EVERY <= POOLED_ROUNDS
