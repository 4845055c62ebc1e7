"""How far off a report says that typical normals are: near what is true, and within the grade that it gives."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from angles import angles_deg
from judged_footage import SHAPES, Footage, accuracy
from ring_and_ball import ring

from psvideo.model.surface import Misfit
from psvideo.report.judge.typical_error import MEAN_OF_HELD
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.usual_errors import OF_FIVE, OF_SIX, POWER, SPREAD_OF_FITTED, beside_fitted

FACTOR = 1.5


def under(ways: np.ndarray) -> Illumination:
    return Illumination(directions=ways, intensities=np.ones((len(ways), 1)))


def test_lights_turn_normals_by_what_is_not_matte_less_the_farther_apart_they_stand() -> None:
    """On a ring of n lights, s from the axis, the trace is (4 / sin^2 s + 1 / cos^2 s) / n."""
    for lights, slant_deg in product((5, 6, 8), (35, 45)):
        sine, cosine = np.sin(np.radians(slant_deg)), np.cos(np.radians(slant_deg))
        spread = 4 / sine**2 + 1 / cosine**2
        less = (spread / SPREAD_OF_FITTED) ** {5: OF_FIVE, 6: OF_SIX, 8: POWER}[lights]
        assert beside_fitted(under(ring(lights, slant_deg))) == pytest.approx(less)
    assert beside_fitted(under(ring(5, 15))) == 1.0


@pytest.mark.parametrize(
    ("predicted_deg", "likely_deg", "words"),
    [
        (1.2, 0.8, "good: no more than about a degree"),
        (2.9, 1.8, "good: about 2 degrees"),
        (3.2, 2.0, "doubtful: about 3 degrees"),
        (9.0, 6.2, "doubtful: about 6 degrees"),
        (14.0, 17.0, "doubtful: about 15 degrees"),
        (16.0, 11.0, "bad: about 15 degrees"),
        (29.0, 20.0, "bad: about 20 degrees"),
    ],
)
def test_what_is_likely_is_said_within_the_borders_of_the_grade(
    predicted_deg: float, likely_deg: float, words: str
) -> None:
    one = Footage(solved=True).observed(0)
    misfit = Misfit(share=0.01, error_deg=predicted_deg / MEAN_OF_HELD)
    one.facts = KeptFacts(replace(facts, misfit=misfit, likely_deg=likely_deg / MEAN_OF_HELD) for facts in one.facts)
    (line,) = accuracy(one)
    grade, amount = words.split(": ")
    assert line.grade == grade
    assert f"a typical normal is off by {amount}" in line.found


def spread(lights: int, slant_deg: float, seed: int) -> np.ndarray:
    """Lights around the axis as hands place them: 20 degrees beside even, and 10 nearer or farther."""
    rng = np.random.default_rng(seed)
    around = np.arange(lights) * 2 * np.pi / lights + np.radians(rng.uniform(-20, 20, lights))
    slant = np.radians(slant_deg + rng.uniform(-10, 10, lights))
    return np.stack([np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.cos(slant)], axis=-1)


def _said_over_true(shape: str, ways: np.ndarray, wrong_deg: float, gloss: float, seed: int) -> tuple[float, float]:
    """Return what is likely, and what was predicted, over what is true of a solved take, in the mean over normals."""
    rng = np.random.default_rng(seed)
    normals, albedo = SHAPES[shape](float(seed))
    across = np.cross(ways, rng.normal(size=ways.shape))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    claimed = np.cos(np.radians(wrong_deg)) * ways + np.sin(np.radians(wrong_deg)) * across
    half = ways + np.array([0, 0, 1])
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    plates = []
    for way, between in zip(ways, half, strict=True):
        cosine = np.maximum(normals @ way, 0)
        light = 0.7 * albedo * cosine + gloss * np.maximum(normals @ between, 0) ** 20 * (cosine > 0)
        plates.append((light + rng.normal(0, 0.002, light.shape)).astype(np.float32))
    found = Solving(error=True).solve(plates, under(claimed), mask=albedo > 0)
    measured = found.measured & (albedo > 0)
    true_deg = float(angles_deg(found.normals[measured], normals[measured]).mean())
    assert found.misfit is not None
    assert found.likely_deg is not None
    return MEAN_OF_HELD * found.likely_deg / true_deg, MEAN_OF_HELD * found.misfit.error_deg / true_deg


def test_most_takes_under_five_lights_are_off_by_what_is_likely_and_by_what_is_predicted_of_their_normals() -> None:
    """Of right rigs and of wrong ones, of what shines and what does not."""
    takes = product(("ball", "waves", "bottle"), (30, 42), ((2, 0.0), (5, 0.0), (0, 0.12)))
    ratios = [
        _said_over_true(shape, spread(5, slant_deg, seed), *fault, seed)
        for seed, (shape, slant_deg, fault) in enumerate(takes)
    ]
    likely, predicted = (np.abs(np.log(ratios)) < np.log(FACTOR)).mean(axis=0)
    assert likely > 0.55
    assert predicted > 0.55
