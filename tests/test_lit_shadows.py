"""Shadows that are lit from around pass for light that grazes, and show in normals that keep one angle to the lamp:
where they do, the lights that reach a pixel give its normal."""

from dataclasses import replace

import numpy as np
import pytest
from bench.accuracy_measure import angles_deg
from bench.predicted import SIZE

from psvideo.model.surface import MEASURED, TWO_LIGHTS, Surface
from psvideo.solve.filling.leaving_out import left_out
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.judging import judged, looked_at

ROW, COL = (np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2) / (SIZE / 2)
INSIDE = ROW**2 + COL**2 < 0.9
BALL = np.stack([COL, -ROW, np.sqrt(np.maximum(1 - ROW**2 - COL**2, 0.01))], axis=-1)
WAYS = np.array([[0.9, 0.0, 0.44], [-0.45, 0.78, 0.44], [-0.45, -0.78, 0.44]])
WAYS = WAYS / np.linalg.norm(WAYS, axis=1, keepdims=True)
FOUR = np.array([[0.9, 0.0, 0.44], [0.0, 0.5, 0.87], [0.0, -0.3, 0.95], [-0.2, 0.2, 0.95]])
FOUR = FOUR / np.linalg.norm(FOUR, axis=1, keepdims=True)


def solved(
    normals: np.ndarray, around: float, *, noise: float = 0.001, seed: int = 1, ways: np.ndarray = WAYS
) -> tuple[Surface, np.ndarray, Surface]:
    """Return the surface, what its shadows say, and the surface as three lights give it, of normals whose shadows show
    this share of albedo."""
    rng, plates = np.random.default_rng(seed), []
    for way in ways:
        light = 0.5 * np.maximum(normals @ way, around)
        plates.append((light + rng.normal(0, noise, light.shape)).astype(np.float32))
    lit, solving = Illumination(directions=ways, intensities=np.ones((len(ways), 1))), Solving(error=True)
    measured = solving.measured(LitPlates(plates, lit, mask=INSIDE))
    points, found = looked_at(*measured)
    shown = np.broadcast_to(found.shadows_deg, points.known.shape)
    return solving.solve(plates, lit, mask=INSIDE), shown, measured[0]


@pytest.mark.parametrize("around", [0.01, 0.03])
def test_a_shadow_that_is_lit_from_around_is_not_trusted(around: float) -> None:
    surface, _, measured = solved(BALL, around)
    dark = INSIDE & ((BALL @ WAYS.T).min(axis=-1) < -0.2)
    off_deg = angles_deg(surface.normals[surface.valid], BALL[surface.valid])
    assert measured.valid[dark].mean() > 0.5
    assert (off_deg > 10).mean() < 0.02
    well_lit = INSIDE & ((BALL @ WAYS.T).min(axis=-1) > 0.15)
    assert surface.valid[well_lit].mean() > 0.9


@pytest.mark.parametrize("around", [0.01, 0.03])
def test_in_a_shadow_that_is_lit_from_around_two_lights_and_the_albedo_give_the_normal(around: float) -> None:
    surface, _, measured = solved(BALL, around)
    dark = INSIDE & ((BALL @ WAYS.T).min(axis=-1) < -0.2) & measured.valid
    assert surface.source is not None
    assert surface.error_deg is not None
    assert (surface.source == TWO_LIGHTS)[dark].mean() > 0.75
    off_deg, before_deg = (angles_deg(one.normals[dark], BALL[dark]) for one in (surface, measured))
    assert before_deg.mean() > 15
    assert off_deg.mean() < 0.85 * before_deg.mean()
    assert (off_deg <= 2 * surface.error_deg[dark]).mean() > 0.9


def test_of_four_lights_the_three_that_reach_a_shadow_give_its_normal() -> None:
    surface, _, measured = solved(BALL, 0.02, ways=FOUR)
    dark = INSIDE & ((BALL @ FOUR.T).min(axis=-1) < -0.1) & (((BALL @ FOUR.T) > 0.1).sum(axis=-1) == 3)
    dark &= measured.valid
    off_deg, before_deg = (angles_deg(one.normals[dark], BALL[dark]) for one in (surface, measured))
    assert before_deg.mean() > 5
    assert off_deg.mean() < before_deg.mean() / 2
    assert surface.error_deg is not None
    claimed_deg = surface.error_deg[dark].astype(np.float64)
    assert (off_deg <= 2 * claimed_deg).mean() > 0.9
    assert np.median(claimed_deg) < 2 * np.percentile(off_deg, 90), "what fewer lights leave claims more"


def test_under_nine_lights_none_is_left_out_since_a_byte_does_not_say_which() -> None:
    ways = np.concatenate([FOUR[1:], np.repeat(FOUR[:1], 6, axis=0)])
    plates = [np.maximum(BALL @ way, 0.03).astype(np.float32) for way in ways]
    solving = Solving(solver="least-squares", error=True)
    solved_, one, noise = solving.measured(
        LitPlates(plates, Illumination(directions=ways, intensities=np.ones((len(ways), 1))), mask=INSIDE)
    )
    doubted = replace(judged(solved_, one, noise)[0], shadows_lit=1.0, valid=np.zeros_like(INSIDE))
    assert doubted.error_deg is not None
    doubted.error_deg[:] = 20
    assert left_out(doubted, one, solved=solved_.valid) is None


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01])
def test_a_lamp_that_grazes_counts_beside_black_shadows(noise: float) -> None:
    surface, _, measured = solved(BALL, 0.0, noise=noise)
    np.testing.assert_array_equal(surface.source == MEASURED, measured.valid)


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01])
def test_what_a_lamp_grazes_beside_black_shadows_stays_trusted(noise: float) -> None:
    _, shown, _ = solved(BALL, 0.0, noise=noise)
    assert not shown.any()


def test_a_plane_that_a_lamp_grazes_keeps_its_angle_to_it() -> None:
    """As it keeps every other one."""
    normals = np.broadcast_to(np.array([-0.4, 0.0, 0.917]), BALL.shape)
    for noise in (0.0, 0.002):
        _, shown, _ = solved(normals, 0.0, noise=noise)
        assert not shown.any()
