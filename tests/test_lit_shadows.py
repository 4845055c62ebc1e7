"""Shadows that are lit from around pass for light that grazes, and show in normals that keep one angle to the lamp."""

import numpy as np
import pytest
from bench.accuracy_measure import angles_deg
from bench.predicted import SIZE

from psvideo.model.surface import MEASURED, Surface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.judging import looked_at

ROW, COL = (np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2) / (SIZE / 2)
INSIDE = ROW**2 + COL**2 < 0.9
BALL = np.stack([COL, -ROW, np.sqrt(np.maximum(1 - ROW**2 - COL**2, 0.01))], axis=-1)
WAYS = np.array([[0.9, 0.0, 0.44], [-0.45, 0.78, 0.44], [-0.45, -0.78, 0.44]])
WAYS = WAYS / np.linalg.norm(WAYS, axis=1, keepdims=True)


def solved(normals: np.ndarray, around: float, *, noise: float = 0.001, seed: int = 1) -> tuple[Surface, np.ndarray]:
    """Return the surface, and what its shadows say, of normals whose shadows show this share of albedo."""
    rng, plates = np.random.default_rng(seed), []
    for way in WAYS:
        light = 0.5 * np.maximum(normals @ way, around)
        plates.append((light + rng.normal(0, noise, light.shape)).astype(np.float32))
    lit, solving = Illumination(directions=WAYS, intensities=np.ones((3, 1))), Solving(error=True)
    points, found = looked_at(*solving.measured(plates, lit, mask=INSIDE))
    shown = np.broadcast_to(found.shadows_deg, points.known.shape)
    return solving.solve(plates, lit, mask=INSIDE), shown


@pytest.mark.parametrize("around", [0.01, 0.03])
def test_a_shadow_that_is_lit_from_around_is_not_trusted(around: float) -> None:
    surface, _ = solved(BALL, around)
    dark = INSIDE & ((BALL @ WAYS.T).min(axis=-1) < -0.2)
    assert surface.source is not None
    off_deg = angles_deg(surface.normals[surface.valid], BALL[surface.valid])
    assert (surface.source == MEASURED)[dark].mean() > 0.5
    assert (off_deg > 10).mean() < 0.02
    well_lit = INSIDE & ((BALL @ WAYS.T).min(axis=-1) > 0.15)
    assert surface.valid[well_lit].mean() > 0.9


@pytest.mark.parametrize("noise", [0.0, 0.001, 0.01])
def test_what_a_lamp_grazes_beside_black_shadows_stays_trusted(noise: float) -> None:
    _, shown = solved(BALL, 0.0, noise=noise)
    assert not shown.any()


def test_a_plane_that_a_lamp_grazes_keeps_its_angle_to_it() -> None:
    """As it keeps every other one."""
    normals = np.broadcast_to(np.array([-0.4, 0.0, 0.917]), BALL.shape)
    for noise in (0.0, 0.002):
        _, shown = solved(normals, 0.0, noise=noise)
        assert not shown.any()
