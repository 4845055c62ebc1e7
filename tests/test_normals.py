"""Least squares after Woodham: exact without noise, wrong by as much as it must be with faults, and never by more."""

import numpy as np
import pytest
from angles import error_deg
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from ring_and_ball import ball, ring

from psvideo.errors import PsvideoError
from psvideo.model.rig import Light
from psvideo.model.surface import Surface
from psvideo.solve.normals.asked_surface import AskedSurface
from psvideo.solve.normals.illumination import MAX_CONDITION, Illumination, illumination
from psvideo.solve.normals.least_squares.woodham1980 import EVERYTHING, Usable, solve
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.task import PIXEL_CONDITION

Array = NDArray[np.float64]
DEFAULT = Usable()


def lit_by(directions: Array, intensities: Array | None = None, *, channels: int = 1) -> Illumination:
    if intensities is None:
        intensities = np.ones((len(directions), channels))
    return Illumination(directions=directions, intensities=intensities)


def shoot(normals: Array, lit: Illumination, albedo: Array | float = 0.43) -> NDArray[np.float32]:
    """Plates (light, row, col[, channel]) of a matte surface with attached shadows."""
    shade = np.maximum(0, np.einsum("rcx,lx->lrc", normals, lit.directions))
    if lit.intensities.shape[1] == 1:
        grey: NDArray[np.float32] = (shade * lit.intensities[:, 0, None, None] * np.asarray(albedo)).astype(np.float32)
        return grey
    coloured: NDArray[np.float32] = (shade[..., None] * lit.intensities[:, None, None, :] * albedo).astype(np.float32)
    return coloured


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("lights", [3, 4, 5, 8])
def test_a_matte_ball_comes_out_exactly(lights: int, channels: int) -> None:
    normals, inside = ball(reach_deg=90)
    strengths = np.random.default_rng(lights).uniform(0.4, 1.2, (lights, channels))
    lit = lit_by(ring(lights, 40), strengths)
    albedo = np.array([0.7, 0.3, 0.05])[:channels]
    surface = solve(LitPlates(list(shoot(normals, lit, albedo if channels == 3 else 0.7)), lit))
    assert error_deg(surface, normals).max() < 1e-3
    truth = np.broadcast_to(albedo if channels == 3 else albedo[0], surface.albedo.shape)
    np.testing.assert_allclose(surface.albedo[surface.valid], truth[surface.valid], rtol=2e-5)
    assert surface.residual is not None
    assert surface.residual.max() < 2e-6
    assert not surface.valid[~inside].any()


def test_with_three_lights_a_normal_is_valid_exactly_where_no_light_is_in_shadow() -> None:
    normals, inside = ball(reach_deg=90)
    lit = lit_by(ring(3, 40))
    surface = solve(LitPlates(list(shoot(normals, lit, 0.8)), lit))
    shade = np.einsum("rcx,lx->lrc", normals, lit.directions)
    assert not surface.valid[(shade <= 0.003).any(axis=0)].any()
    assert surface.valid[inside & (shade >= 0.12).all(axis=0)].all()
    assert 0.5 < surface.valid[inside].mean() < 0.75
    assert not surface.normals[~surface.valid].any()
    assert not surface.albedo[~surface.valid].any()


def test_with_eight_lights_shadows_cost_neither_coverage_nor_accuracy() -> None:
    normals, inside = ball(reach_deg=90)
    lit = lit_by(ring(8, 40))
    plates = list(shoot(normals, lit, 0.8))
    surface = solve(LitPlates(plates, lit))
    assert surface.valid[inside].mean() > 0.99
    assert error_deg(surface, normals).max() < 1e-3
    assert error_deg(solve(LitPlates(plates, lit), usable=EVERYTHING), normals, inside).mean() > 1


NOISE, DIRECTION_1, DIRECTION_5 = "1 % noise", "directions off by 1°", "directions off by 5°"
EXPECTED_DEG = [  # the physics page's table; a ball as far as 50° from its middle, lights 35° off the axis, albedo 0.43
    (3, NOISE, 2.1),
    (8, NOISE, 1.4),
    (3, DIRECTION_1, 0.92),
    (8, DIRECTION_1, 0.60),
    (3, DIRECTION_5, 4.6),
    (8, DIRECTION_5, 3.0),
    (3, "intensities off by 3 %", 1.9),
    (8, "intensities off by 3 %", 1.3),
    (3, "intensities off by 10 %", 6.4),
    (8, "intensities off by 10 %", 4.4),
    (3, "sRGB taken for linear", 12.5),
    (3, "black level off by 1 %", 1.0),
    (3, "black level off by 4 %", 3.2),
]


@pytest.mark.parametrize(("lights", "fault", "expected_deg"), EXPECTED_DEG, ids=str)
def test_a_fault_costs_what_the_physics_says(lights: int, fault: str, expected_deg: float) -> None:
    normals, inside = ball(reach_deg=50)
    rng = np.random.default_rng(5)
    means = [error_deg(_solve_with(fault, normals, ring(lights, 35), rng), normals, inside).mean() for _ in range(25)]
    assert np.mean(means) == pytest.approx(expected_deg, rel=0.25)


def _solve_with(fault: str, normals: Array, directions: Array, rng: np.random.Generator) -> Surface:
    true = lit_by(directions)
    plates, believed = shoot(normals, true).astype(np.float64), true
    if fault == NOISE:
        plates = plates + rng.normal(0, 0.01, plates.shape)
    elif fault.startswith("directions"):
        believed = lit_by(_turned(directions, 1.0 if fault == DIRECTION_1 else 5.0, rng))
    elif fault.startswith("intensities"):
        share = 0.03 if "3 %" in fault else 0.1
        plates = plates * (1 + share * rng.normal(size=(len(directions), 1, 1)))
    elif fault.startswith("sRGB"):
        plates = np.where(plates <= 0.0031308, 12.92 * plates, 1.055 * np.maximum(plates, 1e-9) ** (1 / 2.4) - 0.055)
    else:
        plates = plates + (0.01 if "1 %" in fault else 0.04)
    return solve(LitPlates(list(plates.astype(np.float32)), believed))


def _turned(directions: Array, angle_deg: float, rng: np.random.Generator) -> Array:
    """Every direction turned by so much, each its own way."""
    across = np.cross(directions, rng.normal(size=directions.shape))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    turned: Array = directions * np.cos(np.radians(angle_deg)) + across * np.sin(np.radians(angle_deg))
    return turned


def test_a_channel_in_which_the_surface_is_black_adds_no_noise() -> None:
    normals, inside = ball(reach_deg=45)
    noise = np.random.default_rng(1).normal(0, 0.01, (3, *inside.shape, 3)).astype(np.float32)
    coloured = lit_by(ring(3, 40), channels=3)
    red = shoot(normals, coloured, np.array([0.6, 0.0, 0.0])) + noise
    together = error_deg(solve(LitPlates(list(red), coloured)), normals, inside).mean()
    alone = error_deg(solve(LitPlates(list(red[..., 0].copy()), lit_by(ring(3, 40)))), normals, inside).mean()
    assert together == pytest.approx(alone, rel=0.1)
    white = shoot(normals, coloured, np.array([0.6, 0.6, 0.6])) + noise
    assert error_deg(solve(LitPlates(list(white), coloured)), normals, inside).mean() == pytest.approx(
        alone / 3**0.5, rel=0.05
    )


def test_albedo_keeps_one_scale_for_any_picture() -> None:
    normals, _ = ball(48, reach_deg=90)
    lit = lit_by(ring(4, 40), np.full((4, 1), 0.5))
    dim = solve(LitPlates(list(shoot(normals, lit, 0.1)), lit))
    bright = solve(LitPlates(list(shoot(normals, lit, 0.9)), lit))
    assert np.median(dim.albedo[dim.valid]) == pytest.approx(0.1, rel=1e-4)
    assert np.median(bright.albedo[bright.valid]) == pytest.approx(0.9, rel=1e-4)


def test_the_residual_is_what_the_fit_leaves_in_units_of_saturation() -> None:
    normals, inside = ball(reach_deg=40)
    lit = lit_by(ring(8, 40), np.full((8, 1), 0.7))
    noise = np.random.default_rng(2).normal(0, 0.01, (8, *inside.shape))
    surface = solve(LitPlates(list((shoot(normals, lit, 0.9) + noise).astype(np.float32)), lit))
    assert surface.residual is not None
    rms = np.sqrt(np.mean(surface.residual[inside] ** 2))
    assert rms == pytest.approx(0.01 * np.sqrt(5 / 8), rel=0.03)  # three of eight degrees of freedom are fitted


def test_lights_nearly_in_one_plane_are_refused_with_their_condition_number() -> None:
    line = [Light(name=f"L{n}", direction=(np.sin(a), 0.01 * n, np.cos(a))) for n, a in enumerate((-0.6, 0.0, 0.7))]
    with pytest.raises(PsvideoError, match=r"L0, L1, L2.*one plane.*condition\s+number is \d+.*singular values"):
        illumination(line, channels=1)
    good = [Light(name=f"L{n}", direction=tuple(d)) for n, d in enumerate(ring(3, 5.0))]
    assert 10 < illumination(good, channels=3).condition < MAX_CONDITION


@pytest.mark.parametrize(
    ("lights", "message"),
    [
        ([Light(name="key", direction=(0.0, 0.0, 1.0))], "at least three lights, and here are 1 \\(key\\)"),
        (
            [
                Light(name="key", direction=(0.6, 0.0, 0.8)),
                Light(name="left", direction=(0.0, 0.6, 0.8), intensity=(0.0,)),
                Light(name="right", direction=(-0.6, 0.0, 0.8)),
            ],
            "'left' has the intensity 0",
        ),
        (
            [Light(name="key", position_m=(0.6, 0.0, 0.8))] * 3,
            "'key' has a position",
        ),
    ],
    ids=["one light", "no intensity", "near light"],
)
def test_lights_that_give_no_normals_are_refused(lights: list[Light], message: str) -> None:
    with pytest.raises(PsvideoError, match=message):
        illumination(lights, channels=1)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), lights=st.integers(3, 9), coloured=st.booleans(), rows_only=st.booleans())
def test_every_pixel_is_the_least_squares_solution_of_its_usable_measurements(
    seed: int, lights: int, coloured: bool, rows_only: bool
) -> None:
    rng = np.random.default_rng(seed)
    channels = 3 if coloured else 1
    directions = rng.normal(size=(lights, 3)) * [1, 1, 0.3] + [0, 0, 1]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lit = lit_by(directions, rng.uniform(0.3, 1.5, (lights, channels)))
    assume(lit.condition < MAX_CONDITION)
    plates = rng.uniform(0.1, 0.8, (lights, 3, 5, channels)).astype(np.float32)
    plates[rng.random(plates.shape) < 0.1] = 1.0
    plates[rng.random(plates.shape[:3]) < 0.15] = 0.001
    plates[rng.random(plates.shape) < 0.02] = rng.choice([np.nan, np.inf, -np.inf])
    seen = rng.random((lights, 3) if rows_only else (lights, 3, 5)) < 0.95
    found = solve(LitPlates(list(plates if coloured else plates[..., 0]), lit, seen=seen))
    for row, col in np.ndindex(3, 5):
        here = seen[:, row] if rows_only else seen[:, row, col]
        expected = _reference(plates[:, row, col].astype(np.float64), lit, here)
        if expected is None:  # a decision hangs on rounding
            continue
        normal, albedo, residual = expected
        assert bool(normal.any()) == bool(found.valid[row, col])
        np.testing.assert_allclose(found.normals[row, col], normal, atol=3e-4)
        np.testing.assert_allclose(np.ravel(found.albedo[row, col]), albedo, rtol=2e-3, atol=1e-3)
        assert found.residual is not None
        assert found.residual[row, col] == pytest.approx(residual, rel=2e-3, abs=1e-4)


def _reference(samples: Array, lit: Illumination, seen: NDArray[np.bool_]) -> tuple[Array, Array, float] | None:
    """One pixel, light by light and without haste: normal, albedo per channel, residual; None on a knife's edge."""
    lights, channels = samples.shape
    strength = lit.intensities.mean(axis=1)
    with np.errstate(invalid="ignore"):
        here = seen & (np.abs(samples) < DEFAULT.saturation).all(axis=1)
    values = np.where(here[:, None], samples, 0.0) * strength[:, None] / lit.intensities
    weights = _channel_weights(np.maximum(values, 0).sum(axis=0), lit)
    nothing = np.zeros(3), np.zeros(channels), 0.0
    if not weights.sum():
        return nothing
    together = values @ (weights / weights.sum())
    shares = together * strength.mean() / strength
    limit = np.full(lights, DEFAULT.shadow_ratio * shares[here].mean())
    dark = DEFAULT.dark_level * _noisiness(lit)
    if min(np.abs(shares - limit)[here].min(), np.abs(together - dark)[here].min()) < 1e-5:
        return None
    used = here & (shares > limit) & (together > dark)
    if used.sum() < 3:
        return nothing
    matrix = lit.directions * (strength / strength.mean())[:, None]
    allowed = max(PIXEL_CONDITION, _frobenius_condition(matrix))
    condition = _frobenius_condition(matrix[used])
    if abs(condition / allowed - 1) < 0.01 and used.sum() < lights:
        return None
    if condition > allowed * 1.001:
        return nothing
    scaled, *_ = np.linalg.lstsq(matrix[used], together[used])
    normal = scaled / np.linalg.norm(scaled)
    if abs(normal[2] + 0.342) < 1e-3:
        return None
    if normal[2] < -0.342:
        return nothing
    shade = matrix[used] @ normal
    albedo = np.maximum(shade @ values[used] / (shade @ shade), 0)
    errors = together[used] - matrix[used] @ scaled
    return normal, albedo / strength.mean(), float(np.sqrt(np.mean(errors**2)))


def _channel_weights(colour: Array, lit: Illumination) -> Array:
    """By how much channels count: by colour, and by one over what dividing by the lights makes of their noise."""
    noise = np.mean((lit.intensities.mean(axis=1, keepdims=True) / lit.intensities) ** 2, axis=0)
    alike = colour / noise @ np.ones_like(colour) / (1 / noise).sum()
    own = np.sqrt(noise.min() / noise)
    return np.asarray((own * colour + (1 - own) * alike) / noise)


def _noisiness(lit: Illumination) -> Array:
    """How noisy every light's measurement of a grey surface is, over their root mean square."""
    times = lit.intensities.mean(axis=1, keepdims=True) / lit.intensities
    variances = (times**2 / (times**2).mean(axis=0) ** 2).sum(axis=1)
    return np.asarray(np.sqrt(variances / variances.mean()))


def _frobenius_condition(matrix: Array) -> float:
    values = np.linalg.svd(matrix, compute_uv=False)
    return float("inf") if values[-1] < 1e-9 else float(np.sqrt((values**2).sum() * (1 / values**2).sum()))


@pytest.mark.parametrize("channels", [1, 3])
def test_neither_threads_nor_neighbours_change_a_pixel(channels: int) -> None:
    rng = np.random.default_rng(7)
    lit = lit_by(ring(5, 40), channels=channels)
    plates = rng.uniform(0.1, 0.8, (5, 150, 1001, channels)).astype(np.float32)  # rows of blocks, and a rest
    if channels == 1:
        plates = plates[..., 0]
    one = solve(LitPlates(list(plates), lit), threads=1)
    for threads in (2, 3):
        several = solve(LitPlates(list(plates), lit), threads=threads)
        for name in ("normals", "albedo", "valid", "residual"):
            np.testing.assert_array_equal(getattr(several, name), getattr(one, name))
    shadowed = plates.copy()
    shadowed[0, :, ::97] = 0  # sends every block down the path for pixels with unusable measurements
    other = solve(LitPlates(list(shadowed), lit))
    untouched = np.arange(1001) % 97 != 0
    np.testing.assert_allclose(other.normals[:, untouched], one.normals[:, untouched], atol=2e-6)


def test_pixels_whose_measurements_are_all_usable_come_out_as_the_general_rule_solves_them() -> None:
    """One pixel of every row that a light did not show has the row solved by the rule for single pixels."""
    rng = np.random.default_rng(8)
    for lights in (3, 4, 7):
        lit = lit_by(ring(lights, 30), rng.uniform(0.5, 1.5, (lights, 3)))
        plates = rng.uniform(0.3, 0.7, (lights, 6, 100, 3)).astype(np.float32)
        seen = np.ones((lights, 6, 100), np.bool_)
        seen[0, :, 0] = False
        quick, general = (solve(LitPlates(list(plates), lit, seen=one)) for one in (None, seen))
        assert (quick.valid == general.valid)[:, 1:].all()
        assert np.abs(quick.normals - general.normals)[:, 1:].max() < 1e-5
        for name in ("albedo", "residual"):
            assert np.abs(getattr(quick, name) - getattr(general, name))[:, 1:].max() < 1e-5


@pytest.mark.parametrize(
    ("kind", "off"),
    # no run hands over codes: their loop is compiled for this test alone, for 20 s
    [pytest.param("codes", 1e-5, marks=pytest.mark.campaign), ("halves", 6e-4)],
)
def test_codes_with_a_black_level_and_half_floats_give_the_same_surface(kind: str, off: float) -> None:
    normals, inside = ball(reach_deg=60)
    lit = lit_by(ring(8, 40))
    codes = np.round(shoot(normals, lit, 0.8) * 3839 + 256).astype(np.uint16)
    plates = [((plate - 256.0) / 3839).astype(np.float32) for plate in codes]
    plain = solve(LitPlates(plates, lit))
    if kind == "codes":
        other = solve(LitPlates(list(codes), lit, black_level=256, scale=1 / 3839))
    else:
        other = solve(LitPlates(plates, lit), asked=AskedSurface(half=True))
        assert other.normals.dtype == other.albedo.dtype == np.float16
        assert other.normals[..., 0].flags.c_contiguous
    np.testing.assert_array_equal(other.valid, plain.valid)
    np.testing.assert_allclose(other.normals, plain.normals, atol=off)
    np.testing.assert_allclose(other.albedo, plain.albedo, rtol=off)
    assert error_deg(plain, normals, inside).max() < 0.05  # twelve bits


def test_an_albedo_beyond_half_floats_becomes_the_largest_of_them() -> None:
    lit = lit_by(ring(3, 40), np.full((3, 1), 1e-6))
    surface = solve(LitPlates(list(np.full((3, 2, 2), 0.5, np.float32)), lit), asked=AskedSurface(half=True))
    np.testing.assert_array_equal(surface.albedo, np.float16(65504))


def test_a_saturated_measurement_is_left_out_in_all_channels() -> None:
    normals, inside = ball(reach_deg=40)
    lit = lit_by(ring(4, 30), channels=3)
    plates = shoot(normals, lit, np.array([0.5, 0.4, 0.3]))
    plates[2, ..., 0] = 1.0  # one channel burnt out; the other two are fine but belong to it
    plates[2, ..., 1:] *= 0.5
    surface = solve(LitPlates(list(plates), lit))
    assert surface.valid[inside].all()
    assert error_deg(surface, normals, inside).max() < 1e-3
    three = solve(LitPlates(list(plates[:3]), lit_by(ring(4, 30)[:3], channels=3)))
    assert not three.valid.any()


def test_only_the_masked_pixels_and_the_rows_that_were_seen_are_solved() -> None:
    normals, _ = ball(64, reach_deg=40)
    lit = lit_by(ring(3, 30))
    plates = list(shoot(normals, lit, 0.8))
    mask = np.zeros((64, 64), np.bool_)
    mask[10:50, 20:60] = True
    seen = np.ones((3, 64), np.bool_)
    seen[1, 30:35] = False
    lost = np.zeros((64, 64), np.bool_)
    lost[30:35] = True
    everywhere = solve(LitPlates(plates, lit)).valid
    np.testing.assert_array_equal(solve(LitPlates(plates, lit, mask=mask, seen=seen)).valid, everywhere & mask & ~lost)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_goes_in_and_never_comes_out(value: float) -> None:
    lit = lit_by(ring(4, 40))
    plates = np.full((4, 3, 700), 0.5, np.float32)
    plates[1, 1, 600] = value
    plates[:, 2] = value
    surface = solve(LitPlates(list(plates), lit))
    assert surface.residual is not None
    for array in (surface.normals, surface.albedo, surface.residual):
        assert np.isfinite(array).all()
    assert surface.valid[:2].all()
    assert not surface.valid[2].any()


@pytest.mark.parametrize(
    "change",
    [
        {"plates": [np.zeros((2, 2), np.float32)] * 2},
        {"plates": [np.zeros((2, 2), np.float64)] * 3},
        {"plates": [np.zeros((2, 2), np.float32)] * 2 + [np.zeros((2, 3), np.float32)]},
        {"plates": [np.zeros((2, 2, 3), np.float32)] * 3},
        {"seen": np.ones((2, 2), np.bool_)},
        {"seen": np.ones((3, 2), np.uint8)},
        {"mask": np.ones((3, 2), np.bool_)},
    ],
    ids=["count", "type", "size", "channels", "seen", "seen type", "mask"],
)
def test_arrays_that_do_not_belong_together_are_a_mistake_of_the_program(change: dict[str, object]) -> None:
    arguments = {"plates": [np.zeros((2, 2), np.float32)] * 3} | change
    plates = arguments.pop("plates")
    with pytest.raises(ValueError, match=r"plates|seen|mask"):
        solve(LitPlates(plates, lit_by(ring(3, 40)), **arguments))  # type: ignore[arg-type]


@pytest.mark.parametrize(("tilt_deg", "kept"), [(-80.0, True), (-95.0, True), (-105.0, True), (-120.0, False)])
def test_a_table_top_seen_in_perspective_may_turn_a_little_away_from_the_axis(tilt_deg: float, kept: bool) -> None:
    """Seen from above, a level surface below the camera's axis is visible though its normal has z <= 0."""
    tilt = np.radians(tilt_deg)
    normal = np.array([0.0, -np.sin(tilt), np.cos(tilt)])
    lights = np.array([[0.3, 0.95, 0.1], [-0.3, 0.95, 0.1], [0.0, 0.8, 0.6], [0.0, 0.9, -0.3]])
    lights /= np.linalg.norm(lights, axis=1, keepdims=True)
    lit = Illumination(directions=lights, intensities=np.ones((4, 1)))
    solved = solve(LitPlates([np.full((2, 2), 0.7 * max(normal @ light, 0), np.float32) for light in lights], lit))
    assert solved.valid.all() == kept
    if kept:
        np.testing.assert_allclose(solved.normals[0, 0], normal, atol=1e-5)
