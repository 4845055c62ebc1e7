"""Strengths of lights from the plates of any scene: right under shadows and highlights, near lamps and distant ones."""

import numpy as np
import pytest

from psvideo.report.observe.rig_and_curve.lamp_strengths import FEWEST_LIGHTS, lamp_strengths

POINTS = 1200
TRUE = np.array([1.0, 1.3, 1.0, 0.7, 1.0, 1.0, 1.05, 1.0, 1.0, 0.95])


def scene(lights: int, *, near: bool, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the light of points that face every way towards the camera, (point, light), and what the rig sends there:
    a fifth in cast shadow of a light, a tenth with a highlight."""
    rng = np.random.default_rng(seed)
    around = 0.3 + np.arange(lights) * 2 * np.pi / lights
    ways = np.stack([0.6 * np.cos(around), 0.6 * np.sin(around), np.full(lights, 0.8)], axis=-1)
    normals = rng.normal(size=(POINTS, 3)) * [0.4, 0.4, 0] + [0, 0, 1]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    sent = ways[None]
    if near:
        apart = 2.0 * ways[None] - rng.uniform(-0.5, 0.5, (POINTS, 1, 3)) * [1, 1, 0]
        sent = apart / np.linalg.norm(apart, axis=2, keepdims=True) ** 3 * 4
    light = rng.uniform(0.2, 0.8, (POINTS, 1)) * np.maximum((normals[:, None] * sent).sum(axis=2), 0) * TRUE[:lights]
    light[rng.random(light.shape) < 0.02] = 0.0
    light *= 1 + (rng.random(light.shape) < 0.01) * rng.uniform(0.5, 3, light.shape)
    return light + rng.normal(0, 1e-4, light.shape), sent


@pytest.mark.parametrize("near", [False, True])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("lights", [8, 10])
def test_strengths_come_out_as_they_are(lights: int, seed: int, near: bool) -> None:
    found = lamp_strengths(*scene(lights, near=near, seed=seed))
    assert found is not None
    np.testing.assert_allclose(found.ratios, TRUE[:lights] / np.median(TRUE[:lights]), rtol=0.01)
    assert found.left_free < 0.1 * found.left
    assert 0.05 < found.turned_deg < 15


def test_a_right_rig_is_left_as_it_is() -> None:
    light, sent = scene(8, near=False, seed=0)
    found = lamp_strengths(light / TRUE[:8], sent)
    assert found is not None
    np.testing.assert_allclose(found.ratios, 1, rtol=0.005)
    assert found.turned_deg < 0.2


@pytest.mark.parametrize(("lights", "points"), [(FEWEST_LIGHTS - 1, POINTS), (8, 80)])
def test_of_few_lights_or_points_nothing_is_said(lights: int, points: int) -> None:
    light, sent = scene(lights, near=False, seed=0)
    assert lamp_strengths(light[:points], sent) is None


@pytest.mark.parametrize("gives", [0.05, 1.0])
def test_a_light_that_the_rig_calls_weak_is_measured_as_strong_as_it_is(gives: float) -> None:
    light, sent = scene(8, near=False, seed=0)
    light, sixth = np.where(np.arange(8) == 5, gives, 1.0) * light, np.arange(8) == 5
    found = lamp_strengths(light, sent * np.where(sixth, 0.05, 1.0)[:, None])
    assert found is not None
    np.testing.assert_allclose(
        found.ratios, TRUE[:8] / np.median(TRUE[:8]) * np.where(sixth, gives / 0.05, 1), rtol=0.02
    )


def test_a_light_so_weak_that_a_black_level_counts_for_it_says_nothing() -> None:
    light, sent = scene(8, near=False, seed=0)
    weak = np.where(np.arange(8) == 5, 0.012, 1.0)
    assert lamp_strengths(light * weak, sent * weak[:, None]) is None


def test_of_a_light_that_reaches_hardly_anything_nothing_is_said() -> None:
    light, sent = scene(8, near=False, seed=0)
    assert lamp_strengths(light * np.where(np.arange(8) == 5, 0.03, 1.0), sent) is None


def test_what_no_strengths_explain_has_none() -> None:
    rng = np.random.default_rng(0)
    light = rng.random((500, 8))
    found = lamp_strengths(light, rng.normal(size=(1, 8, 3)))
    assert found is None or found.left_free > 0.5 * found.left
