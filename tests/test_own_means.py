"""What moves and what stands still beside it: neither speaks for the other, and what is bare follows."""

import numpy as np
import pytest

from psvideo.plates.align.doubt.own_means import own_mean
from psvideo.plates.align.velocity import moving, plane_fits
from psvideo.plates.align.velocity.flow import Sketch, sketch_of
from psvideo.plates.align.velocity.followed import Pair
from psvideo.plates.align.velocity.moving import followed_at
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of

SHAPE, STEP_PX, SIDE, HEM = (72, 96), 3, 44, 9


def test_a_mean_is_of_its_own_kind_only() -> None:
    moves = np.zeros((12, 16), np.bool_)
    moves[:, 8:] = True
    values = np.where(moves, 5, 1).astype(np.float32)
    np.testing.assert_allclose(own_mean(values, (5, 5), moves), values, rtol=1e-5)
    assert own_mean(values, (5, 5), np.zeros_like(moves))[6, 7] > 1.5


def _sketch(light: int, step: int) -> Sketch:
    """A wall with grain, and before it a square that slides: grain at its hem, within it a ramp of shading only."""
    grain = np.random.default_rng(3).uniform(0.3, 0.5, SHAPE)
    square = np.random.default_rng(4).uniform(0.2, 0.6, (SIDE, SIDE))
    y, x = np.mgrid[:SIDE, :SIDE] / SIDE
    square[HEM:-HEM, HEM:-HEM] = (0.25 + 0.12 * (x if light else y))[HEM:-HEM, HEM:-HEM]
    left = 20 + STEP_PX * step
    grain[14 : 14 + SIDE, left : left + SIDE] = square
    image = np.asarray(grain, np.float32)
    plate = LightPlate(
        light=f"l{light}", number=step, time_s=float(step), picture=mixture_of(image), seen=np.ones(SHAPE[0], np.bool_)
    )
    return sketch_of(plate, white=1.0)


def test_what_is_bare_follows_what_moves_around_it(monkeypatch: pytest.MonkeyPatch) -> None:
    pairs = [Pair(before=_sketch(light, 0), after=_sketch(light, 2)) for light in range(3)]
    inner, wall = np.s_[26:46, 37:53], np.s_[:, :10]
    found = followed_at(pairs, 1.0)
    assert found.moves[inner].mean() > 0.99
    assert not found.moves[wall].any()
    assert np.abs(found.velocity[0][inner] - STEP_PX).mean() < 0.3
    monkeypatch.setattr(moving, "GROWN", 0)
    monkeypatch.setattr(plane_fits, "JOINED", 0)
    assert followed_at(pairs, 1.0).moves[inner].mean() < 0.96
