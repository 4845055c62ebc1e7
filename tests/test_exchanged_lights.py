"""Two lights of a rig that are taken for each other are named, and other faults are not called an exchange."""

import numpy as np
import pytest

from psvideo.report.judge.rig_by_plates import lights_exchanged
from psvideo.report.observe.rig_and_curve.rigfit import RigFit, rig_fit


def ways(lights: int) -> np.ndarray:
    """Return directions around the camera, at two heights in turn."""
    around = np.arange(lights) * 2 * np.pi / lights
    slant = np.radians(np.where(np.arange(lights) % 2, 30.0, 50.0))
    return np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.cos(slant)], axis=-1)


def fit_of(rig: np.ndarray, *, seed: int, sheen: float = 0.1) -> RigFit:
    """Return what points of a bumpy surface with some sheen, under ``ways``, say of a rig."""
    rng, true = np.random.default_rng(seed), ways(len(rig))
    normals = np.concatenate([rng.normal(size=(3000, 2)) * 0.35, np.ones((3000, 1))], axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    halves = true + np.array([0, 0, 1])
    halves /= np.linalg.norm(halves, axis=1, keepdims=True)
    light = rng.uniform(0.2, 0.7, (3000, 1)) * np.maximum(normals @ true.T, 0)
    light += sheen * np.maximum(normals @ halves.T, 0) ** 20 + 0.003 * rng.normal(size=light.shape)
    fit = rig_fit(np.clip(light, 0, 1), rig[None], rng.uniform(-0.5, 0.5, (3000, 2)))
    assert fit is not None
    return fit


@pytest.mark.parametrize("lights", [8, 12])
@pytest.mark.parametrize("seed", range(4))
def test_two_exchanged_lights_are_named(lights: int, seed: int) -> None:
    one, other = np.sort(np.random.default_rng(seed).choice(lights, 2, replace=False))
    rig = ways(lights)
    rig[[one, other]] = rig[[other, one]]
    fit = fit_of(rig, seed=seed)
    assert fit.exchanged == (one, other)
    said = lights_exchanged([f"lamp {n}" for n in range(lights)], fit)
    assert said is not None
    assert said.grade in ("doubtful", "bad")
    assert f"'lamp {one}' and 'lamp {other}' are exchanged" in said.found


@pytest.mark.parametrize("lights", [6, 8, 12])
@pytest.mark.parametrize("seed", range(4))
def test_other_faults_of_a_rig_are_no_exchange(lights: int, seed: int) -> None:
    right = ways(lights)
    off = right + 0.12 * np.random.default_rng(50 + seed).normal(size=right.shape)
    weak = right * np.where(np.arange(lights) == seed, 0.6, 1.0)[:, None]
    for rig in (right, right * [-1, 1, 1], np.roll(right, 1, axis=0), off, weak):
        for sheen in (0.0, 0.5):
            fit = fit_of(rig, seed=seed, sheen=sheen)
            assert fit.exchanged is None
            assert lights_exchanged([f"lamp {n}" for n in range(lights)], fit) is None


def test_five_lights_do_not_tell_an_exchange() -> None:
    assert fit_of(ways(5)[[1, 0, 2, 3, 4]], seed=0).exchanged is None
