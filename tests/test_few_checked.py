"""Under four and five lights a model of the subject says how far normals may be off, and takes none of a matte one."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from angles import angles_deg
from numpy.typing import NDArray
from ring_and_ball import ring

from psvideo.model.surface import MEASURED, Misfit, Reflectance, Surface
from psvideo.report.judge.typical_error import MEAN_OF_HELD
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.robust.subject_points import SubjectPoints
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust import few_checked, signs
from psvideo.solve.normals.trust.by_other_rig import LeftOver, other_rig

Array = NDArray[np.float64]
SIZE = 72
UP = np.array([0.0, 0.0, 1.0])
TURNED, SLANT = np.radians([[184, 342, 52, 341], [29, 34, 52, 33]])
FOUR = np.stack([np.sin(SLANT) * np.cos(TURNED), np.sin(SLANT) * np.sin(TURNED), np.cos(SLANT)], axis=-1)
"""Lights whose residual hardly shows a sheen: what they leave of one is no more than noise."""


def ball() -> tuple[Array, NDArray[np.bool_]]:
    rows, cols = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    x, y = cols / (0.48 * SIZE), -rows / (0.48 * SIZE)
    inside = x * x + y * y < 0.8
    normals = np.stack([x, y, np.sqrt(np.where(inside, 1 - x * x - y * y, 1))], axis=-1)
    return normals * inside[..., None], inside


def shot(
    normals: Array, ways: Array, shade: Callable[[Array, Array], Array], noise: float = 0.001
) -> list[NDArray[np.float32]]:
    """Plates of what ``shade`` makes of the cosines to the light and to half way, with a camera's noise."""
    rng, half = np.random.default_rng(3), ways + UP
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    seen = [shade(np.maximum(normals @ a, 0), np.maximum(normals @ b, 0)) for a, b in zip(ways, half, strict=True)]
    return [(each + rng.normal(0, noise, each.shape)).astype(np.float32) for each in seen]


def matte(c: Array, _: Array) -> Array:
    return 0.5 * c


def glossy(c: Array, h: Array) -> Array:
    return 0.3 * c + 0.3 * h**8 * (c > 0)


def under(ways: Array) -> Illumination:
    return Illumination(directions=ways, intensities=np.ones((len(ways), 1)))


def solved(shade: Callable[[Array, Array], Array], noise: float = 0.001) -> tuple[Surface, Array]:
    """Return what the four lights say of the ball, and by how much it is off where it was measured, else 0."""
    normals, inside = ball()
    found = Solving(error=True).solve(shot(normals, FOUR, shade, noise), under(FOUR), mask=inside)
    assert found.source is not None
    return found, np.where(found.source == MEASURED, angles_deg(found.normals, normals), 0)


def without_model(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out what the model says, and what albedo shows that goes with the slope, which would count as well."""
    monkeypatch.setattr(signs, "turned_by_causes", lambda *_, **__: None)
    monkeypatch.setattr(signs, "by_slope_deg", lambda *_, **__: np.float32(0))


def test_a_sheen_under_four_lights_is_counted_in_what_normals_may_be_off_by(monkeypatch: pytest.MonkeyPatch) -> None:
    found, off = solved(glossy)
    without_model(monkeypatch)
    before, _ = solved(glossy)
    assert found.error_deg is not None
    assert before.error_deg is not None
    here = np.asarray(found.source == MEASURED)
    same = (found.normals == before.normals).all(axis=-1)
    assert same[here].mean() > 0.998, "a light is left out of single pixels that are doubted for it"
    assert off[here].mean() > 5
    within = [float((off <= 2 * error)[here].mean()) for error in (before.error_deg, found.error_deg)]
    assert within[0] < 0.5
    assert within[1] > 0.8
    wrong = [float((each.valid & (off > 5)).sum() / here.sum()) for each in (before, found)]
    assert wrong[0] > 0.5
    assert wrong[1] < 0.15


@pytest.mark.parametrize("noise", [0.001, 0.01, 0.02])
def test_noise_of_a_matte_subject_passes_for_no_model_and_no_slope(
    noise: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = solved(matte, noise)
    without_model(monkeypatch)
    before, _ = solved(matte, noise)
    assert found.error_deg is not None
    assert before.error_deg is not None
    assert found.valid.sum() > 0.5 * np.count_nonzero(found.source == MEASURED)
    assert float((found.valid != before.valid).mean()) < 0.002
    assert found.error_deg.mean() < 1.03 * before.error_deg.mean()


def test_the_model_turns_normals_by_about_what_they_are_off_by() -> None:
    """Least squares over four lights of a ball that shines as the model does: a turn for every point."""
    rng = np.random.default_rng(6)
    truth = rng.normal(size=(400, 3)) * (1, 1, 0.5) + 1.4 * UP
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)
    truth = truth[(truth @ FOUR.T > 0.15).all(axis=1)]
    half = (FOUR + UP) / np.linalg.norm(FOUR + UP, axis=1, keepdims=True)
    c, h = truth @ FOUR.T, truth @ half.T
    measured = (0.5 * c + 0.25 * h**8).T
    g = np.linalg.lstsq(FOUR, measured, rcond=None)[0].T
    points = SubjectPoints(
        measured=measured,
        counts=np.ones_like(measured),
        seen=np.ones_like(measured),
        towards=np.repeat(FOUR[:, None], len(truth), axis=1),
        half=np.repeat(half[:, None], len(truth), axis=1),
        to_camera=np.broadcast_to(UP, truth.shape),
        normals=g / np.linalg.norm(g, axis=1, keepdims=True),
    )
    turned = few_checked.causes(points, g).by_model_deg
    off = angles_deg(g / np.linalg.norm(g, axis=1, keepdims=True), truth)
    assert off.mean() > 3
    assert 0.5 < turned.mean() / off.mean() < 2
    flat = SubjectPoints(
        measured=0.5 * c.T + rng.normal(0, 0.002, c.T.shape),
        counts=points.counts,
        seen=points.seen,
        towards=points.towards,
        half=points.half,
        to_camera=points.to_camera,
        normals=truth,
    )
    assert few_checked.causes(flat, 0.5 * truth).by_model_deg.max() < 1


@pytest.mark.parametrize(
    ("soft", "others", "least", "most"),
    [
        ((0.27, 0.84), (0.64, 0.87), 0.0, 0.0),  # a glossy bust that turns, in one round of six
        ((0.25, 0.86), (0.14, 0.82), 0.0, 0.0),  # another round
        ((0.10, 0.20), (0.50, 0.60), 1.0, 1.0),  # wax
        ((0.40, 0.60), (0.65, 0.70), 0.1, 0.9),
    ],
)
def test_softness_leaves_less_by_its_own_weights_and_evenly(
    soft: tuple[float, float], others: tuple[float, float], least: float, most: float
) -> None:
    held = few_checked.much_less_left(LeftOver(*soft), LeftOver(*others))
    assert least <= held <= most


def wax(c: Array, _: Array) -> Array:
    return 0.5 * (0.85 * c + 0.15)


def turned_each(ways: Array, wrong_deg: float, seed: int) -> Array:
    """Directions that are off by so much, each its own way."""
    across = np.cross(ways, np.random.default_rng(seed).normal(size=ways.shape))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return np.asarray(np.cos(np.radians(wrong_deg)) * ways + np.sin(np.radians(wrong_deg)) * across)


@pytest.mark.parametrize("seed", [1, 3, 4, 6])
def test_lights_on_a_ring_that_are_a_little_off_pass_for_no_softness(seed: int) -> None:
    normals, inside = ball()
    ways = ring(4, 35)
    claimed = under(turned_each(ways, 2, seed))
    found = Solving(error=True).solve(shot(normals, ways, matte), claimed, mask=inside)
    assert found.likely_deg is not None
    here = inside & found.measured
    off = angles_deg(found.normals, normals)[here].mean()
    assert 0.67 * off < MEAN_OF_HELD * found.likely_deg < 2.5 * off


def test_softness_counts_beside_lights_that_stand_otherwise() -> None:
    found, off = solved(wax)
    assert found.error_deg is not None
    here = np.asarray(found.source == MEASURED)
    assert off[here].mean() > 4
    assert found.error_deg[here].mean() > 0.5 * off[here].mean()


def test_other_lights_leave_little_of_what_a_rig_that_is_off_leaves_and_much_of_gloss() -> None:
    normals, inside = ball()
    some = (normals[inside] @ FOUR.T > 0.15).all(axis=1)
    truth = normals[inside][some][::7]

    def left(measured: Array, claimed: Array) -> LeftOver:
        g: Array = np.linalg.lstsq(claimed, measured, rcond=None)[0].T.astype(np.float64)
        points = SubjectPoints(
            measured=measured,
            counts=np.ones_like(measured),
            seen=np.ones_like(measured),
            towards=np.repeat(claimed[:, None], len(truth), axis=1),
            half=np.repeat(claimed[:, None], len(truth), axis=1),
            to_camera=np.broadcast_to(UP, truth.shape),
            normals=g / np.linalg.norm(g, axis=1, keepdims=True),
        )
        return other_rig(points, g).left

    assert max(left(FOUR @ truth.T, turned_each(FOUR, 3, 2))) < 0.02
    half = (FOUR + UP) / np.linalg.norm(FOUR + UP, axis=1, keepdims=True)
    assert left(0.5 * FOUR @ truth.T + 0.2 * (half @ truth.T) ** 20, FOUR).evenly > 0.3


def test_angles_around_are_means_of_a_gaussian() -> None:
    rng, shape = np.random.default_rng(8), (60, 80)
    rows, cols = rng.integers(0, 60, 300), rng.integers(0, 80, 300)
    angles = rng.gamma(2, 3, 300)
    _, first = np.unique(rows * 80 + cols, return_index=True)
    rows, cols, angles = rows[first], cols[first], angles[first]
    both = np.stack([angles, 2 * angles + 1], axis=-1)
    around = few_checked._around(shape, (rows, cols), both, 60 * 80)
    assert np.allclose(around[..., 1], 2 * around[..., 0] + 1, rtol=1e-5)
    around = around[..., 0]
    row, col = np.mgrid[:60, :80]
    square = (row[..., None] - rows) ** 2 + (col[..., None] - cols) ** 2
    near = np.exp(-square / (2 * (few_checked.AROUND * np.sqrt(60 * 80)) ** 2))
    true = (near @ angles) / near.sum(axis=-1)
    inside = np.s_[10:-10, 10:-10]
    assert np.abs(around[inside] - true[inside]).mean() < 0.15 * true.std()
    lonely = few_checked._around((60, 80), (np.array([3]), np.array([4])), np.array([[7.0]]), 400)
    np.testing.assert_allclose(lonely, 7, rtol=1e-5)


@pytest.mark.parametrize(("lights", "looked_at"), [(3, False), (5, True), (8, True), (9, False)])
def test_three_lights_leave_nothing_and_with_nine_it_averages_out(lights: int, looked_at: bool) -> None:
    normals, inside = ball()
    ways = ring(lights, 35)
    found, one, _ = Solving(error=True).measured(LitPlates(shot(normals, ways, glossy), under(ways), mask=inside))
    found = replace(found, misfit=None)
    assert (few_checked.turned_by_causes(found, 1, one, inside) is not None) == looked_at
    model = Reflectance(curve=0.0, rough=0.5, soft=0.0, broad=0.0, middle=0.0, narrow=0.0)
    by_model = replace(found, misfit=Misfit(share=0.01, error_deg=1.0, reflectance=model))
    assert few_checked.turned_by_causes(by_model, 1, one, inside) is None
