"""Robust solving: exact on matte surfaces, at least as good as least absolute residuals, and honest about its doubt."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from angles import angles_deg, error_deg
from numpy.typing import NDArray
from ring_and_ball import ball, ring
from scipy.optimize import linprog  # type: ignore[attr-defined]

import psvideo as ps
from psvideo.cli.app import main
from psvideo.model.surface import Misfit
from psvideo.report.judge.of_accuracy import accuracy
from psvideo.report.judgement import Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.observed import Observed
from psvideo.solve.depth import View
from psvideo.solve.normals.asked_surface import AskedSurface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.robust import huber1981
from psvideo.solve.normals.robust.huber1981 import solve
from psvideo.solve.normals.robust.weighing import Reweighting
from psvideo.solve.normals.solving import ROBUST_FROM_LIGHTS, Solving, trust_note
from psvideo.synth import read_scene
from psvideo.synth.stage import set_stage
from psvideo.synth.subject.shading import light_collected
from psvideo.synth.truth import true_normals

Array = NDArray[np.float64]
Plates = list[NDArray[np.float32]]
SCENES = Path(__file__).resolve().parents[1] / "data_synth"
TRUST_ALL = Reweighting(most_error_deg=179.0)


def lit_by(directions: Array, *, channels: int = 1) -> Illumination:
    strengths = np.random.default_rng(len(directions)).uniform(0.6, 1.1, (len(directions), channels))
    return Illumination(directions=directions, intensities=strengths)


def shoot(normals: Array, lit: Illumination, albedo: Array | float = 0.6) -> Plates:
    """Plates of a matte surface with attached shadows."""
    shade = np.maximum(0, np.einsum("rcx,lx->lrc", normals, lit.directions))
    if lit.intensities.shape[1] == 1:
        return list((shade * lit.intensities[:, 0, None, None] * albedo).astype(np.float32))
    return list((shade[..., None] * lit.intensities[:, None, None, :] * albedo).astype(np.float32))


@pytest.fixture(scope="module")
def gloss() -> tuple[Plates, Illumination, Array]:
    """The scene of gloss and cast shadows under its eight lights, clipped at 1.0."""
    stage = set_stage(read_scene(SCENES / "gloss.toml"), SCENES)
    assert stage.still is not None
    plates = [stage.still.hits.image(light_collected(stage.still, light)) for light in stage.rig.lights]
    directions = np.array([light.direction for light in stage.rig.lights], np.float64)
    lit = Illumination(directions=directions, intensities=np.full((8, 3), 0.8))
    return [np.minimum(plate, 1) for plate in plates], lit, true_normals(stage.still.hits).astype(np.float64)


@pytest.mark.parametrize("loss", ["cauchy", "tukey"])
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("lights", [3, 4, 5, 8, 17])
def test_a_matte_ball_comes_out_exactly(lights: int, channels: int, loss: str) -> None:
    normals, inside = ball(reach_deg=89)
    lit = lit_by(ring(lights, 40), channels=channels)
    albedo = np.array([0.7, 0.3, 0.05])[:channels]
    plates = shoot(normals, lit, albedo if channels == 3 else 0.7)
    surface = solve(LitPlates(plates, lit), reweighting=Reweighting(loss=loss))  # type: ignore[arg-type]
    assert error_deg(surface, normals).max() < 1e-3
    np.testing.assert_allclose(surface.albedo[surface.valid].reshape(-1, channels)[:, 0], 0.7, rtol=1e-4)
    assert surface.residual is not None
    assert surface.residual.max() < 3e-6
    assert not surface.valid[~inside].any()
    assert np.isfinite(surface.normals).all()


def test_three_channels_of_any_colours_give_one_normal() -> None:
    normals, inside = ball(reach_deg=60)
    lit = lit_by(ring(8, 40), channels=3)
    red = shoot(normals, lit, np.array([0.6, 0.0, 0.0]))
    highlight = 0.5 * np.maximum(0, np.einsum("rcx,lx->lrc", normals, _halves(lit.directions))) ** 60
    shiny = [
        np.minimum(plate + gleam[..., None], 1).astype(np.float32) for plate, gleam in zip(red, highlight, strict=True)
    ]
    assert error_deg(solve(LitPlates(shiny, lit)), normals, inside).mean() < 0.7
    assert error_deg(woodham1980.solve(LitPlates(shiny, lit)), normals, inside).mean() > 3


def _halves(directions: Array) -> Array:
    halves = directions + np.array([0.0, 0.0, 1.0])
    unit: Array = halves / np.linalg.norm(halves, axis=1, keepdims=True)
    return unit


def test_noise_on_a_matte_surface_costs_at_most_a_third_more_than_least_squares() -> None:
    normals, inside = ball(reach_deg=50)
    lit = lit_by(ring(8, 35))
    rng = np.random.default_rng(2)
    plates = [(plate + rng.normal(0, 0.005, plate.shape)).astype(np.float32) for plate in shoot(normals, lit)]
    plain = error_deg(woodham1980.solve(LitPlates(plates, lit)), normals, inside).mean()
    assert error_deg(solve(LitPlates(plates, lit)), normals, inside).mean() < 1.33 * plain


def l1_normals(measured: Array, usable: NDArray[np.bool_], directions: Array) -> Array:
    """Least absolute residuals over the usable measurements (pixel, light), reweighted until nothing changes."""
    weights = usable.astype(np.float64)
    for _ in range(300):
        equations = np.einsum("pl,li,lj->pij", weights, directions, directions) + 1e-12 * np.eye(3)
        right = np.einsum("pl,li,pl->pi", weights, directions, measured)
        g = np.linalg.solve(equations, right[..., None])[..., 0]
        weights = usable / np.maximum(np.abs(measured - g @ directions.T), 1e-8)
    return np.asarray(g)


def linear_program(measured: Array, directions: Array) -> float:
    """The least sum of absolute residuals of one pixel, exactly."""
    lights = len(measured)
    block = np.block([[directions, -np.eye(lights)], [-directions, -np.eye(lights)]])
    cost = np.concatenate([np.zeros(3), np.ones(lights)])
    found = linprog(  # type: ignore[no-untyped-call]
        cost, A_ub=block, b_ub=np.concatenate([measured, -measured]), bounds=[(None, None)] * 3 + [(0, None)] * lights
    )
    return float(found.fun)


def test_gloss_and_cast_shadows_come_out_as_well_as_by_least_absolute_residuals(
    gloss: tuple[Plates, Illumination, Array],
) -> None:
    plates, lit, truth = gloss
    surface = solve(LitPlates(plates, lit), reweighting=TRUST_ALL)
    chosen = np.flatnonzero(surface.valid.ravel())
    chosen = np.random.default_rng(4).choice(chosen, 6000, replace=False)
    samples = np.array([plate.reshape(-1, 3)[chosen] for plate in plates], np.float64) / 0.8
    share = samples.sum(axis=0) / samples.sum(axis=(0, 2))[:, None]
    measured = (samples * share).sum(axis=2).T
    seen = (samples * 0.8 < 1).all(axis=2).T
    usable = seen & (measured > 0.4 * (measured * seen).sum(axis=1, keepdims=True) / seen.sum(axis=1, keepdims=True))
    found = l1_normals(measured, usable, lit.directions)
    for pixel in range(25):
        own = np.abs(measured[pixel] - found[pixel] @ lit.directions.T)[usable[pixel]].sum()
        assert own == pytest.approx(
            linear_program(measured[pixel][usable[pixel]], lit.directions[usable[pixel]]), abs=1e-4
        )
    expected = angles_deg(found, truth.reshape(-1, 3)[chosen])
    ours = angles_deg(surface.normals.reshape(-1, 3)[chosen], truth.reshape(-1, 3)[chosen])
    assert ours.mean() <= expected.mean()
    assert np.quantile(ours, 0.99) <= np.quantile(expected, 0.99)
    plain = error_deg(woodham1980.solve(LitPlates(plates, lit)), truth).mean()
    assert ours.mean() < 0.3 * plain


@pytest.mark.parametrize(
    ("noise", "lights"), [(0.0, range(8)), (0.005, range(8)), (0.005, (0, 1, 2, 3, 4, 6)), (0.01, range(8))]
)
def test_the_predicted_error_covers_the_true_one(
    gloss: tuple[Plates, Illumination, Array], noise: float, lights: tuple[int, ...]
) -> None:
    plates, lit, truth = gloss
    rng = np.random.default_rng(3)
    noisy = [(plates[n] + rng.normal(0, noise, plates[n].shape)).astype(np.float32) for n in lights]
    some = Illumination(directions=lit.directions[list(lights)], intensities=lit.intensities[list(lights)])
    surface = solve(LitPlates(noisy, some))
    assert surface.error_deg is not None
    true, predicted = error_deg(surface, truth), surface.error_deg[surface.valid]
    assert surface.misfit is not None
    assert predicted.max() <= max(Reweighting().most_error_deg, 2.5 * surface.misfit.error_deg) + 1e-3
    assert np.mean(true <= predicted) >= 0.63  # a Rayleigh distribution's share
    assert np.mean(true <= 2 * predicted) >= 0.95
    assert np.mean(true <= 10) >= 0.98
    doubted = solve(LitPlates(noisy, some), reweighting=TRUST_ALL)
    left_out = doubted.valid & ~surface.valid
    assert error_deg(doubted, truth, left_out).mean() > 1.5 * true.mean()
    assert surface.valid.mean() > 0.85


def turned(lit: Illumination, wrong_deg: float) -> Illumination:
    """The rig with every direction off by so much, each its own way."""
    across = np.random.default_rng(2).normal(size=lit.directions.shape)
    across -= np.sum(across * lit.directions, axis=1, keepdims=True) * lit.directions
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    said = np.cos(np.radians(wrong_deg)) * lit.directions + np.sin(np.radians(wrong_deg)) * across
    return Illumination(directions=said, intensities=lit.intensities)


def two_rings() -> Illumination:
    return Illumination(directions=np.concatenate([ring(4, 28), ring(8, 45)]), intensities=np.ones((12, 1)))


def test_a_rig_that_is_wrong_is_no_single_pixels_fault() -> None:
    normals, inside = ball(reach_deg=60)
    lit = two_rings()
    rng = np.random.default_rng(6)
    plates = [(plate + rng.normal(0, 0.002, plate.shape)).astype(np.float32) for plate in shoot(normals, lit)]
    right, wrong = solve(LitPlates(plates, lit)), solve(LitPlates(plates, turned(lit, 5)))
    assert right.misfit is not None
    assert wrong.misfit is not None
    assert wrong.misfit.share > 2 * right.misfit.share
    assert wrong.misfit.error_deg > 2 * right.misfit.error_deg
    assert right.valid[inside].mean() > 0.99
    assert wrong.valid[inside].mean() > 0.95
    assert np.mean(error_deg(wrong, normals) < 10) > 0.97
    beside_others = solve(LitPlates(plates, turned(lit, 5)), misfit=right.misfit)
    assert beside_others.valid[inside].mean() < 0.8  # what a picture of which all else fits would say of these pixels


def test_normals_that_sheen_turns_are_mostly_called_invalid() -> None:
    """Half of the ball is matte, the other half has a sheen as broad as a satin cloth's, as bright as its paint."""
    normals, inside = ball(128, reach_deg=60)
    lit = two_rings()
    lobe = np.maximum(0, np.einsum("rcx,lx->lrc", normals, _halves(lit.directions))) ** 20
    lobe *= np.maximum(0, np.einsum("rcx,lx->lrc", normals, lit.directions)) * np.arange(128) // 64
    rng = np.random.default_rng(7)
    plates = [
        (plate + 0.6 * sheen + rng.normal(0, 0.002, plate.shape)).astype(np.float32)
        for plate, sheen in zip(shoot(normals, lit, 0.3), lobe, strict=True)
    ]
    surface = solve(LitPlates(plates, lit))
    everything = solve(LitPlates(plates, lit), reweighting=TRUST_ALL)
    far = angles_deg(np.where(everything.valid[..., None], everything.normals, [0, 0, 1]), normals) > 10
    valid, invalid = surface.valid & inside, everything.valid & inside & ~surface.valid
    assert far[valid].mean() < 0.03
    assert far[invalid].mean() > 10 * far[valid].mean()
    assert valid[:, :60].sum() > 0.97 * inside[:, :60].sum()


def ball_that_stands() -> tuple[Plates, Illumination]:
    """Plates of a ball under five lights, with a noise of 0.002."""
    normals, _ = ball(reach_deg=60)
    lit, rng = lit_by(ring(5, 40)), np.random.default_rng(9)
    return [plate + rng.normal(0, 0.002, plate.shape).astype(np.float32) for plate in shoot(normals, lit)], lit


def test_what_was_not_followed_does_not_spoil_what_stands_around_it() -> None:
    """Two thirds of the plates lie beside each other, and say that they may: the rest is judged as if alone."""
    plates, lit = ball_that_stands()
    cols = plates[0].shape[1]
    moves = slice(0, 2 * cols // 3)
    passed = [plate.copy() for plate in plates]
    for n, plate in enumerate(passed):
        plate[:, moves] = np.roll(plate[:, moves], 5 * n, axis=1)
    unsure = np.zeros((5, *plates[0].shape), np.float32)
    unsure[:, :, moves] = 0.3
    rest = np.s_[:, 2 * cols // 3 + cols // 8 :]
    noise = PlateNoise(read=4e-6, photon=0.0)
    alone, beside, blamed = (
        solve(LitPlates(images, lit, unsure=given), plate_noise=noise)
        for images, given in ((plates, None), (passed, unsure), (passed, None))
    )
    typical = list[float]()
    for one in (alone, beside, blamed):
        assert one.error_deg is not None
        typical.append(float(np.median(one.error_deg[rest][one.albedo[rest] > 0.3])))
    assert typical[1] < 1.2 * typical[0]
    assert typical[2] > 2 * typical[0], "or this would show nothing"


def test_what_moves_is_typical_of_a_picture_only_where_it_fits_better_than_what_stands() -> None:
    """Two thirds of the plates lie beside each other, though their plates of a round agree: followed a little off."""
    plates, lit = ball_that_stands()
    cols = plates[0].shape[1]
    moves = np.zeros(plates[0].shape, np.bool_)
    moves[:, : 2 * cols // 3] = True
    passed = [np.where(moves, np.roll(plate, 5 * n, axis=1), plate) for n, plate in enumerate(plates)]
    unsure, noise = np.zeros((5, *plates[0].shape), np.float32), PlateNoise(read=4e-6, photon=0.0)
    alone, beside, blamed, otherwise = (
        solve(LitPlates(images, lit, unsure=unsure, moves=given), plate_noise=noise).misfit
        for images, given in ((plates, None), (passed, moves), (passed, None), (passed, ~moves))
    )
    assert alone is not None
    assert beside is not None
    assert blamed is not None
    assert beside.share < 1.2 * alone.share
    assert blamed.share > 2 * alone.share, "or this would show nothing"
    assert otherwise == blamed, "what stands and was not followed says less for itself than for all"


def test_where_nothing_can_contradict_no_misfit_is_claimed() -> None:
    normals, _ = ball(48, reach_deg=30)
    lit = lit_by(ring(3, 35))
    assert solve(LitPlates(shoot(normals, lit), lit)).misfit is None
    assert solve(LitPlates([np.zeros((8, 8), np.float32)] * 6, lit_by(ring(6, 35)))).misfit is None


def test_the_report_says_what_no_pixel_is_blamed_for() -> None:
    def judged(misfit: Misfit) -> list[Judgement]:
        one = InstantFacts(number=1001, time_s=0, valid_share=1, clipped_share=0, unseen_share=0, misfit=misfit)
        return list(accuracy(Observed(lights=("a", "b"), facts=KeptFacts([one]))))

    (doubt,) = judged(Misfit(share=0.043, error_deg=9.4))  # two thirds are within it; the mean is 0.83 of it
    assert doubt.grade == "doubtful"
    assert "off by about 8 degrees" in doubt.found
    assert "not quite matte" in doubt.found
    (said,) = judged(Misfit(share=0.012, error_deg=2.1))
    assert said.grade == "good"


def test_the_predicted_error_grows_with_the_noise() -> None:
    normals, inside = ball(reach_deg=45)
    lit = lit_by(ring(8, 40))
    rng = np.random.default_rng(0)
    ratios = []
    for noise in (0.01, 0.02, 0.04):
        plates = [(plate + rng.normal(0, noise, plate.shape)).astype(np.float32) for plate in shoot(normals, lit)]
        surface = solve(LitPlates(plates, lit), reweighting=TRUST_ALL)
        assert surface.error_deg is not None
        true = np.sqrt(np.mean(error_deg(surface, normals, inside) ** 2))
        ratios.append(np.sqrt(np.mean(surface.error_deg[inside] ** 2.0)) / true)
    assert all(0.7 < ratio < 1.5 for ratio in ratios)


@pytest.mark.parametrize("spoilt", range(4))
def test_of_four_measurements_the_highlight_is_left_out(spoilt: int) -> None:
    """The highlight falls where the surface mirrors its light, as highlights do."""
    lit = Illumination(directions=ring(4, 40), intensities=np.ones((4, 1)))
    normals = np.tile(_halves(lit.directions)[spoilt], (4, 4, 1))
    plates = shoot(normals, lit)
    assert error_deg(solve(LitPlates(plates, lit)), normals).max() < 1e-3
    plates[spoilt] = plates[spoilt] + np.float32(0.2)
    assert error_deg(solve(LitPlates(plates, lit)), normals).max() < 1e-3
    assert error_deg(woodham1980.solve(LitPlates(plates, lit)), normals).min() > 3


@pytest.mark.parametrize("spoilt", range(4))
def test_through_a_lens_the_highlight_of_four_is_the_one_that_is_mirrored_to_it(spoilt: int) -> None:
    """Far beside the axis, opposite the light: along the axis the surface would mirror another."""
    lit = Illumination(directions=ring(4, 40), intensities=np.ones((4, 1)))
    to_camera = ring(4, 55)[(spoilt + 2) % 4]
    across, up = 1e5 * to_camera[:2] / to_camera[2]
    lens = View(focal_px=(1e5, 1e5), principal_px=(across, -up))
    half = lit.directions[spoilt] + to_camera
    normals = np.tile(half / np.linalg.norm(half), (4, 4, 1))
    plates = shoot(normals, lit)
    plates[spoilt] = plates[spoilt] + np.float32(0.08)
    assert error_deg(solve(LitPlates(plates, lit)), normals).min() > 3
    assert error_deg(solve(LitPlates(plates, replace(lit, view=lens))), normals).max() < 1e-2


def test_four_measurements_that_agree_are_all_used() -> None:
    normals, inside = ball(reach_deg=30)
    lit = Illumination(directions=ring(4, 40), intensities=np.ones((4, 1)))
    rng = np.random.default_rng(1)
    plates = [(plate + rng.normal(0, 0.001, plate.shape)).astype(np.float32) for plate in shoot(normals, lit)]
    plain = error_deg(woodham1980.solve(LitPlates(plates, lit)), normals, inside).mean()
    assert error_deg(solve(LitPlates(plates, lit)), normals, inside).mean() < 1.2 * plain


def test_what_is_not_seen_saturated_or_masked_counts_for_nothing() -> None:
    normals, inside = ball(48, reach_deg=30)
    lit = Illumination(directions=ring(8, 35), intensities=np.ones((8, 1)))
    plates = shoot(normals, lit, 0.8)
    plates[0][:] = 0.5
    plates[1][:] = 1.0
    plates[2][:20] = np.nan
    seen = np.ones((8, 48), bool)
    seen[0] = False
    mask = inside.copy()
    mask[:, :10] = False
    surface = solve(LitPlates(plates, lit, seen=seen, mask=mask))
    assert surface.valid[mask].all()
    assert not surface.valid[~mask].any()
    assert error_deg(surface, normals).max() < 1e-3
    for plane in (surface.normals, surface.albedo, surface.residual, surface.error_deg):
        assert plane is not None
        assert np.isfinite(plane).all()
        assert not plane[~surface.valid].any()


@pytest.mark.parametrize("spoilt", [1.0, np.nan])
def test_in_colour_what_cannot_be_read_is_left_out_as_what_is_not_seen_to_the_byte(spoilt: float) -> None:
    """The block was read once as if all could be used; the marks are made of what lies there."""
    normals, _ = ball(48, reach_deg=30)
    lit = Illumination(directions=ring(8, 35), intensities=np.ones((8, 3)))
    plates = [plate * np.array([0.7, 0.6, 0.5], np.float32) for plate in shoot(normals, lit)]
    seen = np.ones((8, 48, 48), np.bool_)
    seen[2, 20:24, 17], seen[5, 24, 24:30] = False, False
    unseen = solve(LitPlates([plate.copy() for plate in plates], lit, seen=seen))
    for light, (green, blue) in ((2, (1, 2)), (5, (0, 0))):
        plates[light][~seen[light], green], plates[light][~seen[light], blue] = spoilt, spoilt
    left_out = solve(LitPlates(plates, lit))
    assert left_out.normals.tobytes() == unseen.normals.tobytes()
    assert left_out.albedo.tobytes() == unseen.albedo.tobytes()


def test_the_result_depends_neither_on_threads_nor_on_where_a_pixel_lies() -> None:
    rng = np.random.default_rng(0)
    plates = list(rng.random((7, 300, 500), np.float32))
    lit = Illumination(directions=ring(7, 35), intensities=np.ones((7, 1)))
    one, four = solve(LitPlates(plates, lit), threads=1), solve(LitPlates(plates, lit), threads=4)
    np.testing.assert_array_equal(one.normals, four.normals)
    np.testing.assert_array_equal(one.error_deg, four.error_deg)
    part = solve(LitPlates([np.ascontiguousarray(plate[100:110, 7:90]) for plate in plates], lit), misfit=one.misfit)
    np.testing.assert_allclose(part.normals, one.normals[100:110, 7:90], atol=2e-3)


def test_codes_and_half_floats_give_the_same_surface() -> None:
    normals, _ = ball(64, reach_deg=89)
    lit = Illumination(directions=ring(6, 35), intensities=np.ones((6, 1)))
    codes = [np.round(plate * 60_000 + 512).astype(np.uint16) for plate in shoot(normals, lit)]
    exact = solve(LitPlates(codes, lit, black_level=512, scale=1 / 60_000))
    half = solve(
        LitPlates(codes, lit, black_level=512, scale=1 / 60_000),
        asked=AskedSurface(half=True, residual=False, error=False),
    )
    assert half.normals.dtype == np.float16
    assert half.residual is None
    assert half.error_deg is None
    np.testing.assert_array_equal(half.valid, exact.valid)
    np.testing.assert_allclose(half.normals, exact.normals, atol=6e-4)


def test_more_rounds_and_other_weights_change_little_where_one_measurement_is_spoilt() -> None:
    normals, inside = ball(48, reach_deg=40)
    lit = Illumination(directions=ring(8, 35), intensities=np.ones((8, 1)))
    plates = shoot(normals, lit)
    plates[3] = plates[3] + np.float32(0.3)
    for how in (Reweighting(), Reweighting(rounds=8), Reweighting(loss="tukey")):
        assert error_deg(solve(LitPlates(plates, lit), reweighting=how), normals, inside).mean() < 0.05
    blind = replace(TRUST_ALL, rounds=1, width=100.0)
    assert error_deg(solve(LitPlates(plates, lit), reweighting=blind), normals, inside).mean() > 1


def test_auto_is_robust_from_five_lights_on() -> None:
    assert [Solving().method(lights) for lights in (3, 4, 5, 8)] == ["least-squares"] * 2 + ["robust"] * 2
    assert ROBUST_FROM_LIGHTS == 5
    assert Solving(solver="robust").method(4) == "robust"
    assert Solving(solver="least-squares").method(48) == "least-squares"
    normals, _ = ball(32, reach_deg=89)
    lit = lit_by(ring(5, 35))
    plates = shoot(normals, lit)
    for solver in ("auto", "least-squares"):
        assert Solving(solver=solver, error=True).solve(plates, lit).error_deg is not None
        assert Solving(solver=solver).solve(plates, lit).error_deg is None
    assert huber1981.solve(LitPlates(plates, lit)).valid.dtype == np.bool_


def test_the_note_says_what_three_lights_cannot_show() -> None:
    assert "highlights" in trust_note("least-squares", 3)
    assert "cannot be seen" in trust_note("robust", 3)
    assert "at most 5 degrees" in trust_note("robust", 8)


def test_the_command_says_which_solver_it_used_and_predicts_errors_with_either(tmp_path: Path) -> None:
    clip, out = tmp_path / "clip", tmp_path / "out"
    assert main(["synth", str(SCENES / "sphere.toml"), "-o", str(clip), "-q"]) == 0
    command = ["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(out), "-q"]
    assert main([*command, "--aov", "error"]) == 0
    assert len(list((out / "error").iterdir())) == len(list((out / "normals").iterdir())) > 0
    report = json.loads((out / "report.json").read_text())
    assert report["solver"] == "least-squares"
    assert "cannot be seen" in report["trust"]
    assert main([*command, "--aov", "error", "--solver", "robust", "--force"]) == 0
    assert json.loads((out / "report.json").read_text())["solver"] == "robust"
    assert len(list((out / "error").iterdir())) == len(list((out / "normals").iterdir())) > 0


def test_the_colour_of_pixels_that_are_solved_apart_is_their_own() -> None:
    """One light is too bright in a part, another shadowed in another, on a surface of one colour."""
    directions = np.array([[0.5, 0.3, 0.8], [-0.5, 0.3, 0.8], [0, -0.6, 0.8], [0.3, -0.3, 0.9], [-0.4, -0.3, 0.85]])
    directions = np.vstack([directions, [[0.1, 0.6, 0.8], [0.6, -0.1, 0.8], [0, 0, 1]]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    row, col = np.mgrid[:48, :64]
    normals = np.stack([(col - 32) / 60, (24 - row) / 60, np.ones((48, 64))], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    colour = np.array([0.6, 0.4, 0.2])
    images = np.moveaxis(np.clip(normals @ directions.T, 0, None), -1, 0)[..., None] * colour
    images[2, 10:30, 20:40] *= 1.8
    images[5, 5:12, 5:50] = 0
    images += np.random.default_rng(1).normal(0, 0.001, images.shape)
    surface = ps.solve_images(np.clip(images, 0, None).astype(np.float32), directions, solver="robust")
    albedo = np.asarray(surface.albedo, np.float64)
    for struck in (np.s_[12:28, 22:38], np.s_[6:11, 6:19]):
        assert surface.valid[struck].all()
        np.testing.assert_allclose(
            albedo[struck] / albedo[struck].sum(axis=-1, keepdims=True),
            np.broadcast_to(colour / 1.2, albedo[struck].shape),
            atol=0.01,
        )


@pytest.mark.parametrize("colour", [(0.6, 0.15, 0.08), (0.4, 0.4, 0.4)])
def test_a_white_highlight_is_not_in_the_albedo_under_it(colour: tuple[float, float, float]) -> None:
    normals, inside = ball(64, reach_deg=70)
    around, slant = np.arange(5) * 2 * np.pi / 5, np.radians(35)
    directions = np.stack(
        [np.sin(slant) * np.cos(around), np.sin(slant) * np.sin(around), np.cos(slant) + 0 * around], 1
    )
    half = directions + np.array([0, 0, 1])
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    shine = np.moveaxis(0.2 * np.maximum(normals @ half.T, 0) ** 200, -1, 0) * inside
    matte = np.moveaxis(np.maximum(normals @ directions.T, 0), -1, 0)[..., None] * colour
    noise = np.random.default_rng(2).normal(0, 0.001, matte.shape)
    off = []
    for plates in (matte + noise, matte + shine[..., None] + noise):
        surface = ps.solve_images(plates.astype(np.float32), directions, solver="robust")
        struck = (shine.max(axis=0) > 0.05) & surface.valid
        assert np.count_nonzero(struck) > 100
        off.append(np.abs(np.asarray(surface.albedo, np.float64)[struck] / colour - 1).mean(axis=0))
    assert off[0].max() < 0.01
    assert off[1].max() < 0.02
