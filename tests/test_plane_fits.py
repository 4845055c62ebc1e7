"""Velocities of a thing that turns lie in planes: those even out what was found, and lead on beside it."""

import cv2
import numpy as np
import pytest

from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.velocity import moving, plane_fits
from psvideo.plates.align.velocity.all_lights import AllLights
from psvideo.plates.align.velocity.flow import Sketch, sketch_of
from psvideo.plates.align.velocity.followed import Followed, Pair
from psvideo.plates.align.velocity.plane_fits import fitted_by_planes, planes_through
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of

SHAPE, SIZE = (60, 80), 15
ROW, COL = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float32)
UPPER = np.less(ROW, SHAPE[0] // 2)
EVEN = np.stack([3 + 0.2 * COL - 0.1 * ROW, -1 + 0.05 * COL + 0.3 * ROW]).astype(np.float32)


def test_a_velocity_that_varies_evenly_is_its_own_plane_and_goes_on_beside_what_moves() -> None:
    moves = COL < 40
    planes, around = planes_through(EVEN * moves, moves, SIZE)
    within = np.s_[:, SIZE:-SIZE, SIZE:44]
    np.testing.assert_allclose(planes[within], EVEN[within], atol=0.02)
    assert around[30, 20] == pytest.approx(1)
    assert around[30, 40] == pytest.approx(7 / 15)
    assert not planes_through(EVEN, np.zeros_like(moves), SIZE)[0].any()


def test_what_was_found_a_little_off_is_evened_out() -> None:
    off = np.random.default_rng(2).normal(0, 1, EVEN.shape).astype(np.float32)
    planes, _ = planes_through(EVEN + off, np.ones(SHAPE, np.bool_), SIZE)
    assert (planes - EVEN)[:, SIZE:-SIZE, SIZE:-SIZE].std() < 0.1


def _grain(seed: int) -> Floats:
    grain = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=(SHAPE[0], 3 * SHAPE[1])), (0, 0), 1.5)
    return np.asarray(0.4 + 0.1 * grain / grain.std(), np.float32)


def _sketch(image: Floats, light: int, step: int) -> Sketch:
    seen = np.ones(SHAPE[0], np.bool_)
    shown = mixture_of(np.asarray(image * (0.7 + 0.1 * light), np.float32))
    return sketch_of(
        LightPlate(light=f"l{light}", number=step, time_s=float(step), picture=shown, seen=seen), white=1.0
    )


def _passing(light: int, step: int) -> Sketch:
    """The upper half of the picture goes right, the lower one left, by 2 px a second."""
    upper, lower = (np.roll(_grain(seed), way * 2 * step, axis=1) for seed, way in ((1, 1), (2, -1)))
    image = np.where(UPPER, upper[:, 80:160], lower[:, 80:160])
    return _sketch(np.asarray(image, np.float32), light, step)


def test_two_things_that_pass_each_other_keep_their_own_velocities(monkeypatch: pytest.MonkeyPatch) -> None:
    pairs = [Pair(before=_passing(light, 0), after=_passing(light, 2)) for light in range(3)]

    def off_px() -> float:
        velocity = moving.followed_at(pairs, 1.0).velocity
        inner, seam = np.s_[:, 10:-10], slice(SHAPE[0] // 2 - 5, SHAPE[0] // 2 + 5)
        return float(np.abs(velocity[0] - np.where(UPPER, 2, -2))[inner][seam].mean())

    assert off_px() < 0.35
    monkeypatch.setattr(plane_fits, "AS_OWN", np.float32(1e6))
    assert off_px() > 0.7, "planes across the seam are of neither"


ALONG = np.stack([0 * COL, 1 + 0.05 * COL]).astype(np.float32)
NOWHERE = np.zeros(SHAPE, np.bool_)


def _beside(velocity: Floats, rests: Flags = NOWHERE, apart: Flags = NOWHERE) -> Followed:
    """What is made of a bare picture whose left part was found to move."""
    even = np.full(SHAPE, 0.5, np.float32)
    pairs = [Pair(before=_sketch(even, light, 0), after=_sketch(even, light, 2)) for light in range(3)]
    moves, nothing = np.less(COL, 40), np.zeros(SHAPE, np.float32)
    unchanged = np.full(SHAPE, 3, np.int16)
    found = Followed(time_s=1.0, velocity=velocity * moves, moves=moves, rests=rests, unchanged=unchanged)
    return fitted_by_planes(AllLights.of(pairs, 1.0), found, sure=NOWHERE, apart=apart, rest=(nothing, nothing))


def test_what_is_undecided_beside_what_moves_joins_and_what_rests_or_is_apart_does_not() -> None:
    joined, below = _beside(ALONG), np.greater(ROW, 30)
    beside = np.s_[20:40, 40:42]
    assert joined.moves[beside].all()
    np.testing.assert_allclose(joined.velocity[:, 20:40, 40:42], ALONG[:, 20:40, 40:42], atol=0.05)
    assert not joined.unchanged[joined.moves].any()
    assert not joined.moves[:, 60:].any()
    for stays in (_beside(ALONG, rests=below), _beside(ALONG, apart=below)):
        assert not stays.moves[31:, 40:].any()
        assert stays.moves[12:18, 40:42].all()


def test_what_lies_before_or_behind_what_moves_does_not_go_along() -> None:
    across = np.stack([6 + 0 * COL, 0 * COL]).astype(np.float32)
    assert not _beside(across).moves[:, 40:].any()


def test_velocities_that_are_sure_stay_as_they_are() -> None:
    pairs = [
        Pair(before=_sketch(_grain(3)[:, :80], light, 0), after=_sketch(_grain(3)[:, :80], light, 2))
        for light in range(3)
    ]
    lights, moves, nothing = AllLights.of(pairs, 1.0), np.ones(SHAPE, np.bool_), np.zeros(SHAPE, np.float32)
    odd = np.where((ROW + COL) % 2 > 0, np.float32(1), np.float32(-1)) * np.ones((2, 1, 1), np.float32)
    found = Followed(time_s=1.0, velocity=odd, moves=moves, rests=~moves)
    made = fitted_by_planes(lights, found, sure=UPPER, apart=~moves, rest=(nothing, nothing)).velocity
    np.testing.assert_array_equal(made[:, UPPER], odd[:, UPPER])
    assert np.abs(made[:, ~UPPER]).mean() < 0.3
