"""Albedo that pales without darkening shows what a coloured surface mirrors under three lights, and paint does not."""

import cv2
import numpy as np
import pytest
from bench.accuracy_measure import Case, angles_deg
from bench.predicted import SIZE, shapes
from ring_and_ball import ring

from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.by_colour import paleness, spread_across_and_along
from psvideo.solve.normals.trust.judging import looked_at

(_, BALL, INSIDE), (_, WAVES, EVERYWHERE) = shapes()[:2]
UP = np.array([0.0, 0.0, 1.0])
GREEN, PALE = np.array([0.25, 0.52, 0.24]), np.array([0.4, 0.5, 0.4])
THREE = ring(3, 35)


def shot(
    colour: np.ndarray, *, shine: float = 0.0, noise: float = 0.002, ways: np.ndarray = THREE, shape: np.ndarray = BALL
) -> Case:
    """Return normals (row, col, 3) of a colour (channel,) or (row, col, channel) that mirror their white lamps."""
    rng, half = np.random.default_rng(1), ways + UP
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    plates = []
    for way, between in zip(ways, half, strict=True):
        own = colour * np.maximum(shape @ way, 0)[..., None]
        light = own + shine * np.maximum(shape @ between, 0)[..., None] ** 40
        plates.append((light + rng.normal(0, noise, light.shape)).astype(np.float32))
    lit = Illumination(directions=ways, intensities=np.ones((len(ways), 3)))
    return Case("shape", plates, lit, shape, INSIDE if shape is BALL else EVERYWHERE)


def shown_and_true_deg(case: Case, *, half: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Return by how many degrees normals are turned, as colour shows it, and as they are, of every one."""
    solved, one, noise = Solving(error=True, half=half).measured(LitPlates(case.plates, case.lit, mask=case.mask))
    points, found = looked_at(solved, one, noise)
    assert points.step == 1
    known = solved.valid
    shown = np.broadcast_to(np.float32(found.by_colour_deg), known.shape)[known]
    return shown, angles_deg(solved.normals[known], case.truth[known])


@pytest.mark.parametrize("half", [False, True])
def test_where_a_coloured_surface_shines_its_colour_shows_it(half: bool) -> None:
    shown, true = shown_and_true_deg(shot(GREEN, shine=0.15), half=half)
    wrong, right = true > 10, true < 1
    assert wrong.mean() > 0.05
    assert np.mean(shown[wrong] > 4) > 0.8
    assert np.mean(shown[right] < 1) > 0.8


def test_what_shines_is_not_trusted_and_what_does_not_is() -> None:
    case = shot(GREEN, shine=0.15)
    surface = Solving(error=True).solve(case.plates, case.lit, mask=case.mask)
    valid = surface.valid & case.mask
    assert np.mean(angles_deg(surface.normals[valid], case.truth[valid]) > 10) < 0.02
    assert valid.sum() > 0.2 * case.mask.sum()


@pytest.mark.parametrize("noise", [0.0, 0.002, 0.01])
def test_paint_of_other_colours_is_no_shine(noise: float) -> None:
    soft = cv2.GaussianBlur(np.random.default_rng(1).normal(size=(SIZE, SIZE)), (0, 0), 6)
    where = (soft > 0)[..., None]
    for other in (PALE * 0.5, GREEN * 0.4, GREEN[::-1], np.array([0.7, 0.7, 0.7]), np.array([0.1, 0.1, 0.1])):
        shown, _ = shown_and_true_deg(shot(np.where(where, GREEN, other), noise=noise, shape=WAVES))
        assert np.mean(shown > 1) < 0.05, other


def test_grey_surfaces_and_grey_pictures_say_nothing() -> None:
    assert not shown_and_true_deg(shot(np.full(3, 0.4), shine=0.15))[0].any()
    case = shot(GREEN, shine=0.15)
    lit = Illumination(directions=case.lit.directions, intensities=np.ones((3, 1)))
    grey = case._replace(plates=[plate.mean(axis=-1) for plate in case.plates], lit=lit)
    assert not shown_and_true_deg(grey)[0].any()


def test_lights_that_check_each_other_show_it_without_colour() -> None:
    assert not shown_and_true_deg(shot(GREEN, shine=0.15, ways=ring(5, 35)))[0].any()


def test_paleness_is_the_share_that_is_white() -> None:
    known, white = np.ones((40, 60), bool), np.zeros((40, 60), np.float32)
    white[15:25, 20:40] = np.linspace(0, 0.3, 20)
    colours = (GREEN[:, None, None] + white).astype(np.float32)
    share = white / (GREEN.mean() + white)
    found = paleness(colours, known)
    assert found is not None
    np.testing.assert_allclose(found, share, atol=0.01)
    assert paleness(np.ones((3, 40, 60), np.float32), known) is None


def test_a_normal_where_lights_spread_little_across_is_no_better_than_what_is_around() -> None:
    """Where lights turn normals far, some end in the direction into which they are turned: these are not trusted."""
    ways = np.array([[0.1, 0.0, 1.0], [0.3, 0.1, 1.0], [-0.2, 0.25, 1.0]])
    case = shot(GREEN, ways=ways / np.linalg.norm(ways, axis=1, keepdims=True), shape=WAVES)
    solved, one, noise = Solving(error=True).measured(LitPlates(case.plates, case.lit, mask=case.mask))
    points, _ = looked_at(solved, one, noise)
    inverse = np.linalg.inv(case.lit.directions)
    worst = np.linalg.eigh(inverse @ inverse.T)[1][:, -1]
    points.planes[:, 40:42, 40:42] = worst[:, None, None]
    across, along = spread_across_and_along(points, case.lit, points.known)
    assert across[40:42, 40:42].min() > 0.5 * np.median(across[points.known])
    np.testing.assert_allclose((across + along)[points.known].min(), np.trace(inverse @ inverse.T), rtol=1e-3)
