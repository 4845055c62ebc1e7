"""Where nothing changed, normals differ by noise alone: they show how large it is that plates' finest detail hides."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.model.arrays import Flags
from psvideo.model.plan import Plan
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Surface
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.solve.depth.view import View
from psvideo.solve.instants import surfaces
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.repeats import MOST, PLAIN, SQUARE_PX, USUAL, Repeat, noise_times
from psvideo.solve.normals.trust.thin_surface import ThinSurface
from psvideo.solve.normals.trust.torn import torn_angles_deg

ROWS, COLS = 8 * SQUARE_PX, 10 * SQUARE_PX
STANDS = np.ones((8, 10), np.bool_)
HOLDS = np.sqrt(-2 * np.log(1 - 0.68))
"""This many standard deviations of each axis hold 68 % of turns about two axes."""


def a_look(seed: int, sigma_deg: float | NDArray[np.float32] = 1 / HOLDS, *, noise_deg: float = 1.0) -> Repeat:
    """Normals that face the camera but for noise, of which ``noise_deg`` is claimed."""
    turns = np.random.default_rng(seed).normal(size=(ROWS, COLS, 2)) * np.radians(sigma_deg)[..., None]
    normals = np.concatenate([turns, np.ones((ROWS, COLS, 1))], axis=-1).astype(np.float32)
    known = np.ones((ROWS, COLS), np.bool_)
    return Repeat(normals=normals, noise_deg=np.full((ROWS, COLS), noise_deg, np.float32), known=known)


@pytest.mark.parametrize("seed", range(5))
def test_noise_that_is_as_large_as_claimed_stays_so(seed: int) -> None:
    times = noise_times(a_look(2 * seed), a_look(2 * seed + 1), STANDS)
    assert times is None or np.sqrt(np.median(times)) < 1.05


@pytest.mark.parametrize("more", [1.5, 2.0, 4.0])
def test_noise_that_is_larger_than_claimed_is_found(more: float) -> None:
    times = noise_times(a_look(0, more / HOLDS), a_look(1, more / HOLDS), STANDS)
    assert times is not None
    np.testing.assert_allclose(np.median(times), 1 + (more**2 - USUAL**2) / PLAIN**2, rtol=0.08)


def test_noise_is_larger_where_repeats_show_it() -> None:
    sigma = np.full((ROWS, COLS), 1 / HOLDS, np.float32)
    sigma[:, COLS // 2 :] *= 3
    times = noise_times(a_look(0, sigma), a_look(1, sigma), STANDS)
    assert times is not None
    left, right = np.sqrt(times[:, : COLS // 2 - SQUARE_PX]), np.sqrt(times[:, COLS // 2 + SQUARE_PX :])
    assert np.median(left) < 1.05
    np.testing.assert_allclose(np.median(right), 3 / PLAIN, rtol=0.08)


def test_noise_of_what_moved_is_that_of_most_of_what_stands() -> None:
    sigma = np.linspace(1, 3, COLS, dtype=np.float32)[None].repeat(ROWS, axis=0) / HOLDS
    stood = STANDS.copy()
    stood[:, :3] = False
    times = noise_times(a_look(0, sigma), a_look(1, sigma), stood)
    assert times is not None
    assert 2.4 < np.sqrt(times[ROWS // 2, SQUARE_PX]) < 3 / PLAIN


def test_what_moved_says_nothing_of_noise() -> None:
    turned = a_look(1, 30.0)
    assert noise_times(a_look(0), turned, np.zeros_like(STANDS)) is None
    corner = np.zeros_like(STANDS)
    corner[:3, :3] = True
    assert noise_times(a_look(0), turned, corner) is None


def test_a_picture_of_another_size_says_nothing() -> None:
    small = Repeat(normals=np.zeros((5, 5, 3), np.float32), noise_deg=np.ones((5, 5), np.float32), known=STANDS[:5, :5])
    assert noise_times(small, a_look(0, 5.0), STANDS) is None
    assert noise_times(small, small, STANDS) is None


def test_a_subject_of_which_no_noise_is_known_says_nothing() -> None:
    assert noise_times(a_look(0, noise_deg=0.0), a_look(1, noise_deg=0.0), STANDS) is None


def test_noise_is_never_called_more_than_so_many_times_itself() -> None:
    times = noise_times(a_look(0, 50.0), a_look(1, 50.0), STANDS)
    assert times is not None
    np.testing.assert_array_equal(times, MOST**2)


def test_normals_are_torn_by_no_more_than_the_noise_that_repeats_show() -> None:
    shape, none = (ROWS, COLS), np.zeros((ROWS, COLS), np.float32)
    look = a_look(0, 4 / HOLDS)
    surface = Surface(normals=look.normals, albedo=np.ones(shape, np.float32), residual=None, valid=look.known)
    points = ThinSurface(step=1, surface=surface, noise_deg=look.noise_deg, fit_deg=none, fit_of_noise_deg=none)
    noisier = replace(points, noisier=np.full(shape, 16.0, np.float32))
    before, after = (torn_angles_deg(one, none, none, View(), shape)[0] for one in (points, noisier))
    assert np.median(before) > 0.5
    assert np.median(after) == 0


NAMES = ("a", "b", "c", "d", "e")
WAYS = [(np.sin(0.6) * np.cos(turn), np.sin(0.6) * np.sin(turn), np.cos(0.6)) for turn in np.arange(5) * 2 * np.pi / 5]
RIG = Rig(lights=tuple(Light(name=name, direction=way) for name, way in zip(NAMES, WAYS, strict=True)))


def coarse_rounds(count: int, truth: NDArray[np.float64], stood: Flags | None) -> Iterator[Round]:
    """A surface that stands still, coded so that nothing fine is left of noise, and blocks of 8 are off as a whole."""
    for number in range(1001, 1001 + count):
        rng, plates = np.random.default_rng(number), list[LightPlate]()
        for n, (name, way) in enumerate(zip(NAMES, WAYS, strict=True)):
            blocks = rng.normal(0, 0.02, (ROWS // 8, COLS // 8))
            off = cv2.resize(blocks, (COLS, ROWS), interpolation=cv2.INTER_LINEAR)
            light = 0.5 * np.maximum(truth @ way, 0) * (1 + off) + rng.normal(0, 0.0005, (ROWS, COLS))
            picture, seen = mixture_of(light.astype(np.float32)), np.ones(ROWS, np.bool_)
            time_s = 0.01 * (6 * number + n)
            plates.append(LightPlate(light=name, number=number, time_s=time_s, picture=picture, seen=seen))
        yield Round(number=number, plates=tuple(plates), stood=stood)


def a_dome() -> NDArray[np.float64]:
    across, down = np.meshgrid(np.linspace(-0.6, 0.6, COLS), np.linspace(0.6, -0.6, ROWS))
    return np.stack([across, down, np.sqrt(1 - across**2 - down**2)], axis=-1)


def held(surface: Surface, truth: NDArray[np.float64]) -> tuple[float, float]:
    """The share of normals that are off by no more than is claimed, and the share that is trusted."""
    assert surface.error_deg is not None
    cosine = np.clip((np.asarray(surface.normals, np.float64) * truth).sum(axis=-1), -1, 1)
    return float((np.degrees(np.arccos(cosine)) <= surface.error_deg).mean()), float(surface.valid.mean())


def test_a_codecs_noise_is_claimed_as_such_and_not_as_a_surface_that_is_not_matte(
    make_plan: Callable[..., Plan],
) -> None:
    """Of the first round nothing is known: what is coarse counts as the surface's own, at twice its size."""
    truth = a_dome()
    rounds = list(coarse_rounds(3, truth, STANDS))
    solving = Solving(error=True)
    first, *later = (one.surface for one in surfaces(rounds, make_plan(lights=NAMES), RIG, solving=solving))
    claimed = [float(np.median(one.error_deg)) for one in (first, *later) if one.error_deg is not None]
    assert claimed[1] < 0.6 * claimed[0]
    for one in later:
        within, trusted = held(one, truth)
        assert 0.6 < within < 0.8
        assert trusted > 0.99
