"""Pixels that are off by themselves stand out in albedo and residuals together; paint and noise do not."""

import cv2
import numpy as np
import pytest
from bench.accuracy_measure import Case, angles_deg
from bench.predicted import SIZE, shapes
from ring_and_ball import ring

from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust.by_length import by_length_deg
from psvideo.solve.normals.trust.judging import looked_at

(_, BALL, INSIDE), (_, WAVES, EVERYWHERE) = shapes()[:2]
TWELVE = np.concatenate([ring(8, 45), ring(4, 20)])


def shot(
    shape: np.ndarray, *, noise: float = 0.002, paint: float = 0.0, shaded: np.ndarray | None = None,
    ways: np.ndarray = TWELVE, share: float = 0.5,
) -> Case:  # fmt: skip
    """Return a matte surface; where it is ``shaded`` (row, col), every third light gives so much less of itself, as
    soft shadows and light from elsewhere make it. ``paint`` is how much the logarithm of its albedo varies."""
    rng = np.random.default_rng(1)
    fine = cv2.GaussianBlur(np.random.default_rng(9).normal(size=(SIZE, SIZE, 1)), (0, 0), 1.5)[..., None]
    albedo = np.array([0.5, 0.4, 0.3]) * np.exp(paint * fine / fine.std())
    plates = []
    for number, way in enumerate(ways):
        light = albedo * np.maximum(shape @ way, 0)[..., None]
        if shaded is not None and number % 3 == 0:
            light = light * (1 - share * shaded)[..., None]
        plates.append((light + rng.normal(0, noise, light.shape)).astype(np.float32))
    lit = Illumination(directions=ways, intensities=np.ones((len(ways), 3)))
    return Case("shape", plates, lit, shape, INSIDE if shape is BALL else EVERYWHERE)


def spots() -> np.ndarray:
    """Where a twentieth of the picture is shaded, in spots of a few pixels."""
    soft = cv2.GaussianBlur(np.random.default_rng(5).normal(size=(SIZE, SIZE)), (0, 0), 1.5)
    return np.asarray(soft > np.quantile(soft, 0.95), np.float64)


def shown_deg(case: Case) -> np.ndarray:
    solved, one, noise = Solving(error=True).measured(LitPlates(case.plates, case.lit, mask=case.mask))
    points, found = looked_at(solved, one, noise)
    assert points.step == 1
    return np.asarray(np.broadcast_to(np.float32(found.by_length_deg), solved.valid.shape))


@pytest.mark.parametrize("shape", [BALL, WAVES])
@pytest.mark.parametrize(("paint", "noise"), [(0.0, 0.002), (0.3, 0.002), (0.3, 0.02), (0.0, 0.03)])
def test_paint_and_noise_show_nothing(shape: np.ndarray, paint: float, noise: float) -> None:
    case = shot(shape, paint=paint, noise=noise)
    assert np.mean(shown_deg(case)[case.mask] > 1) < 0.01


@pytest.mark.parametrize("paint", [0.0, 0.1])
def test_pixels_that_are_off_by_themselves_show_it(paint: float) -> None:
    shaded = spots()
    case = shot(WAVES, shaded=shaded, paint=paint)
    shown = shown_deg(case)
    surface = Solving(error=True).solve(case.plates, case.lit, mask=case.mask)
    off = angles_deg(surface.normals, case.truth)
    wrong, right = off > 4, off < 1
    assert wrong.mean() > 0.01
    assert np.mean(shown[wrong] > 1) > 0.7
    assert np.mean(shown[right] > 1) < 0.05


def test_three_lights_which_explain_everything_show_nothing() -> None:
    assert not shown_deg(shot(WAVES, shaded=spots(), ways=ring(3, 40))).any()


def test_what_is_usual_around_counts_nothing() -> None:
    """All of a surface that varies alike is as good or bad as its surroundings say."""
    case = shot(WAVES, paint=0.2)
    solved, one, noise = Solving(error=True).measured(LitPlates(case.plates, case.lit, mask=case.mask))
    points, _ = looked_at(solved, one, noise)
    alike = np.full(points.known.shape, 9, np.float32)
    assert np.mean(by_length_deg(points, alike, np.zeros_like(alike)) > 3) < 0.02
