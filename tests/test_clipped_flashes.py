"""Patterns of several lights whose flashes clip in one round and not in the next: nothing moved there."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.model.coded import Coded
from psvideo.model.turn import CLOCKWISE, UPRIGHT, Turn
from psvideo.plates.align.velocity.brightness import evened
from psvideo.plates.align.velocity.flow import changed, sketch_of, white_of
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import Mixture
from psvideo.plates.mixing.several_pictures import combined
from psvideo.plates.nearest_rows import with_nearest_rows
from psvideo.plates.upright import upright

ROWS, COLS = 96, 160
PATTERNS = np.array([(1, 1, 0), (1, 0, 1), (0, 1, 1)], float)
UPSIDE_DOWN = Turn(rows_flipped=True, cols_flipped=True)


def plate(number: int, *, split: bool, moved: int = 0) -> LightPlate:
    """The third light of a still scene, in which the first two clip together over a blob, unless two frames share their
    flash (``split``); a stripe beside it that is ``moved`` does so for all lights."""
    rng = np.random.default_rng(number)
    lights = np.full((3, ROWS, COLS), 0.1, np.float32)
    lights[:, 30:60, 40:90] = np.array([0.75, 0.70, 0.1], np.float32)[:, None, None]
    lights[:, 30:60, 110 + moved : 130 + moved] = 0.4
    pictures = [_picture(np.tensordot(pattern, lights, 1), split, rng) for pattern in PATTERNS]
    shares = np.linalg.inv(PATTERNS)[2]
    full = max(float(shares[shares > 0].sum()), 1.0)
    mixed = combined(pictures, [float(share) for share in shares], ceiling=full)
    return LightPlate(
        light="c", number=number, time_s=float(number), picture=mixed, seen=np.ones(ROWS, np.bool_), saturation=full,
        unmixed=True,
    )  # fmt: skip


def _picture(flash: NDArray[np.float64], split: bool, rng: np.random.Generator) -> Mixture:
    parts = [flash / 2, flash / 2] if split else [flash]
    frames = [np.clip(part + rng.normal(0, 0.0005, flash.shape), 0, 1).astype(np.float32) for part in parts]
    return Mixture(frames=tuple(Coded(codes=frame) for frame in frames), coefficients=np.ones((len(parts), ROWS)))


def share_changed(before: LightPlate, after: LightPlate) -> float:
    """Which share of the picture's blocks is said to have changed."""
    white = white_of(after)
    one, other = sketch_of(before, white=white), sketch_of(after, white=white)
    return float(changed(one, evened(one, other)).mean())


@pytest.mark.parametrize("turn", [UPRIGHT, CLOCKWISE, UPSIDE_DOWN], ids=["upright", "clockwise", "upside down"])
def test_a_still_scene_whose_flashes_clip_every_other_round_rests_however_it_is_turned(turn: Turn) -> None:
    assert share_changed(upright(plate(1, split=False), turn), upright(plate(2, split=True), turn)) == 0
    assert share_changed(upright(plate(1, split=True), turn), upright(plate(2, split=False), turn)) == 0


@pytest.mark.parametrize("turn", [UPRIGHT, CLOCKWISE, UPSIDE_DOWN], ids=["upright", "clockwise", "upside down"])
def test_what_moves_beside_a_clipped_flash_is_still_seen(turn: Turn) -> None:
    before, after = plate(1, split=False), plate(2, split=True, moved=12)
    assert share_changed(upright(before, turn), upright(after, turn)) > 0.02


def test_rows_of_other_rounds_bring_along_what_was_clipped_there() -> None:
    given = []
    for n, one in enumerate(plate(number, split=number % 2 == 0) for number in range(1, 5)):
        seen = np.ones(ROWS, np.bool_)
        seen[12 * n + 20 : 12 * n + 32] = False
        given.append(replace(one, picture=one.picture.within(seen), seen=seen))
    whole = list(with_nearest_rows(given))
    assert all(one.seen.all() for one in whole)
    for turn in (UPRIGHT, CLOCKWISE):
        turned = [upright(one, turn) for one in whole]
        for before, after in pairwise(turned):
            assert share_changed(before, after) == 0
