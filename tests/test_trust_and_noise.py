"""What noise hides is not trusted the more for it: with less noise as much of a subject is valid, or more."""

import numpy as np
import pytest
from bench.predicted import shapes, shot
from ring_and_ball import ring

import psvideo as ps
from psvideo.solve.normals.solving import Solving

LEVELS = (0.001, 0.004, 0.008, 0.012, 0.016, 0.02, 0.03)
SURFACES = {name: (normals, inside) for name, normals, inside in shapes()}


def trusted(subject: str, lights: int, slant_deg: float, *, gloss: float) -> np.ndarray:
    """Return which share of a subject is valid at each of LEVELS of noise."""
    normals, inside = SURFACES[subject]
    cases = [shot(normals, inside, ring(lights, slant_deg), noise=level, gloss=gloss) for level in LEVELS]
    return np.array([Solving().solve(one.plates, one.lit, mask=inside).valid[inside].mean() for one in cases])


@pytest.mark.parametrize("subject", ["ball", "waves", "bumps"])
@pytest.mark.parametrize(("lights", "slant_deg"), [(4, 40), (5, 40), (5, 55)])
def test_with_less_noise_no_less_of_a_glossy_subject_is_trusted(subject: str, lights: int, slant_deg: float) -> None:
    shares = trusted(subject, lights, slant_deg, gloss=0.15)
    more_noise = np.maximum.accumulate(shares[::-1])[::-1]
    assert (shares >= more_noise - 0.2).all(), shares


@pytest.mark.parametrize("lights", [4, 5])
def test_what_noise_could_hide_does_not_spoil_matte_subjects(lights: int) -> None:
    shares = trusted("bumps", lights, 40, gloss=0.0)
    assert (shares[:-1] > 0.96).all(), shares


@pytest.mark.parametrize(("lights", "slant_deg"), [(5, 15), (8, 15), (8, 25), (12, 25), (8, 60)])
def test_noise_that_goes_with_light_is_that_of_the_light_there(lights: int, slant_deg: float) -> None:
    """A wall gets more light, and more photon noise, from lamps near its normal than from lamps all around."""
    lamps = ring(lights, slant_deg)
    level = 0.1 * lamps[:, 2]
    rng = np.random.default_rng(lights)
    plates = [one + np.sqrt(8e-5 * one) * rng.standard_normal((160, 240)) for one in level]
    surface = ps.solve_images(np.stack(plates).astype(np.float32), lamps)
    off_deg = np.degrees(np.arccos(np.clip(surface.normals[..., 2].astype(np.float64), -1, 1)))
    assert surface.error_deg is not None
    claimed = float(np.median(surface.error_deg)) / float(np.sqrt(np.mean(off_deg**2)))
    assert 1.0 < claimed < 1.3  # 1.15 was asked for: so many standard deviations hold 68 %


@pytest.mark.parametrize("dark", [(0, 1), (2, 3), (0, 2)])
def test_where_only_three_of_five_lights_reach_noise_is_claimed_once(dark: tuple[int, int]) -> None:
    """A third of a painted wall lies in the shadow of two lights; in the last case claims were 3.4 times the error."""
    rng = np.random.default_rng(0)
    lamps = ring(4, 40)
    lamps = np.vstack([lamps, [0.1, 0.05, np.sqrt(1 - 0.0125)]])
    albedo = rng.uniform(0.2, 0.6, (20, 30)).repeat(8, 0).repeat(8, 1)
    shadow = np.zeros(albedo.shape, np.bool_)
    shadow[:, 160:] = True
    lit = [np.where(shadow, 0, albedo) if n in dark else albedo for n in range(5)]
    plates = [0.8 * lamp[2] * one + rng.normal(0, 0.0015, one.shape) for lamp, one in zip(lamps, lit, strict=True)]
    surface = ps.solve_images(np.stack(plates).astype(np.float32), lamps)
    inner = (slice(10, -10), slice(170, -10))
    off_deg = np.degrees(np.arccos(np.clip(surface.normals[inner][..., 2].astype(np.float64), -1, 1)))
    assert surface.error_deg is not None
    claimed = surface.error_deg[inner].astype(np.float64)
    assert 0.6 < np.mean(off_deg <= claimed) < 0.85
    assert np.mean(off_deg <= 2 * claimed) > 0.95
