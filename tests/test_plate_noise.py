"""How noisy plates are said to be, beside what they were made with: sensor noise, and a file's rounding."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.solve.normals import noise_samples, plate_noise
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.noise_samples import Differences
from psvideo.solve.normals.plate_noise import noise_of

Array = NDArray[np.float64]


def encoded_srgb(light: Array) -> Array:
    return np.where(light < 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055)


def light_of_srgb(code: Array) -> Array:
    return np.where(code < 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def linear(light: Array) -> Array:
    return light


CURVES: dict[str, tuple[Callable[[Array], Array], Callable[[Array], Array]]] = {
    "linear": (linear, linear),
    "srgb": (encoded_srgb, light_of_srgb),
}


LIGHTS = np.array([[0.5, 0, 0.8], [-0.5, 0.1, 0.8], [0, 0.55, 0.8], [0.1, -0.5, 0.8]])
LIT = Illumination(directions=LIGHTS, intensities=np.ones((4, 1)))


def waves(brightest: float) -> Array:
    """Return a surface's shading under four lights, (light, row, col)."""
    row, col = np.mgrid[:128, :128] / 128
    slopes = np.stack([0.6 * np.cos(5 * row + 3 * col), 0.6 * np.sin(4 * col - 2 * row), np.ones_like(row)], axis=-1)
    slopes /= np.linalg.norm(slopes, axis=-1, keepdims=True)
    shade = np.moveaxis(np.maximum(slopes @ LIGHTS.T, 0), -1, 0)
    return np.asarray(brightest * shade / shade.max())


@pytest.mark.parametrize("curve", CURVES)
@pytest.mark.parametrize("sensor", [0.0, 0.0005, 0.002])
@pytest.mark.parametrize("brightest", [0.8, 0.1])
def test_rounding_to_eight_bits_is_noise_too(curve: str, sensor: float, brightest: float) -> None:
    encode, decode = CURVES[curve]
    true = waves(brightest)
    noisy = np.clip(true + np.random.default_rng(3).normal(0, sensor, true.shape), 0, 1)
    plates = decode(np.round(255 * encode(noisy)) / 255).astype(np.float32)
    noise = noise_of(list(plates))
    level = true > 0.5 * brightest
    off = float(np.sqrt(np.mean((plates - true)[level] ** 2)))
    assert 0.7 < noise.at(float(true[level].mean())) / off < 1.55


@pytest.mark.parametrize("sensor", [0.0, 0.002])
def test_what_no_file_rounded_is_as_noisy_as_it_is(sensor: float) -> None:
    true = waves(0.8)
    plates = (true + np.random.default_rng(3).normal(0, sensor, true.shape)).astype(np.float32)
    assert noise_of(list(plates)).at(0.4) == pytest.approx(max(sensor, 0.0003), rel=0.2)


def test_the_few_values_of_flat_faces_are_no_codes() -> None:
    faces = np.array([0.02, 0.031, 0.05, 0.0525, 0.07, 0.1, 0.11, 0.16, 0.3])
    plate = np.repeat(np.repeat(faces.reshape(3, 3), 40, axis=0), 40, axis=1).astype(np.float32)
    assert noise_of([plate] * 3).at(0.1) < 0.001


def grain(seed: int) -> Array:
    """Return paint whose every pixel has an albedo of its own, (row, col)."""
    return np.random.default_rng(seed).uniform(0.7, 1, (128, 128))


@pytest.mark.parametrize("sensor", [0.001, 0.004])
def test_grain_of_the_paint_is_no_noise_where_lights_are_known(sensor: float) -> None:
    true = waves(0.8) * grain(1)
    plates = list((true + np.random.default_rng(3).normal(0, sensor, true.shape)).astype(np.float32))
    assert noise_of(plates).at(0.4) > 3 * sensor
    assert noise_of(plates, LIT).at(0.4) == pytest.approx(sensor, rel=0.25)


def test_noise_that_grows_with_light_is_found_under_paint() -> None:
    true = waves(0.8) * grain(1)
    sigma = np.sqrt(0.001**2 + 2e-5 * true)
    plates = list((true + sigma * np.random.default_rng(3).normal(size=true.shape)).astype(np.float32))
    for level in (0.3, 0.6):
        assert noise_of(plates, LIT).at(level) == pytest.approx(np.sqrt(0.001**2 + 2e-5 * level), rel=0.25)


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_noise_that_all_plates_share_is_noise_in_the_dark(seed: int) -> None:
    """A normal and an albedo explain what an ambient picture took off all plates; what counts as lit may not."""
    rng = np.random.default_rng(seed)
    true = np.pad(waves(0.8)[:, 32:96, 32:96], ((0, 0), (32, 32), (32, 32)))
    plates = true + rng.normal(0, 0.002, true.shape) + rng.normal(0, 0.002, true.shape[1:])
    alike = list(plates.astype(np.float32))
    assert noise_of(alike, LIT).dark == pytest.approx(np.hypot(0.002, 0.002), rel=0.08)


def test_plates_that_do_not_fit_each_other_are_no_noisier_than_each_is() -> None:
    moved = np.stack([light * grain(n) for n, light in enumerate(waves(0.8))]).astype(np.float32)
    assert noise_of(list(moved), LIT).at(0.4) <= 1.001 * noise_of(list(moved)).at(0.4)


def test_three_lights_leave_nothing_over_to_know_noise_by() -> None:
    three = Illumination(directions=LIGHTS[:3], intensities=np.ones((3, 1)))
    plates = list((waves(0.8) * grain(1)).astype(np.float32)[:3])
    assert noise_of(plates, three) == noise_of(plates)


def test_plates_of_nothing_have_the_least_noise() -> None:
    dark = [np.full((64, 64), -0.01, np.float32)] * 4
    assert noise_of(dark, LIT).at(0.4) == pytest.approx(0.0003)


@pytest.mark.parametrize("lit", [LIT, None], ids=["lights known", "no lights"])
def test_a_picture_that_is_dark_as_a_whole_may_be_less_noisy_than_cameras_are(lit: Illumination | None) -> None:
    plates = (waves(0.8) + np.random.default_rng(3).normal(0, 0.0015, (4, 128, 128))).astype(np.float32)
    usual, low = noise_of(list(plates), lit), noise_of(list(plates / 16), lit)
    assert low.at(0.4 / 16) == pytest.approx(usual.at(0.4) / 16, rel=0.1)
    assert usual.least == 0.0003 > 2 * low.least


def test_rounding_is_found_in_what_lights_leave_over_as_well() -> None:
    true = waves(0.8) * grain(1)
    plates = (np.round(255 * true) / 255).astype(np.float32)
    assert noise_of(list(plates), LIT).at(0.4) == pytest.approx(float(np.sqrt(np.mean((plates - true) ** 2))), rel=0.3)


@pytest.mark.parametrize("lit", [LIT, None], ids=["lights known", "no lights"])
@pytest.mark.parametrize("side", [160, 260, 420])
@pytest.mark.parametrize("cut_out", [False, True], ids=["black holds noise", "black is black"])
def test_a_small_subject_before_black_is_as_noisy_as_it_is(
    lit: Illumination | None, side: int, *, cut_out: bool
) -> None:
    """It is less than a twelfth of the picture, and files cut noise off at black."""
    true = np.zeros((4, side, side))
    true[:, 60:100, 60:100] = waves(0.8)[:, 40:80, 40:80]
    noise = np.random.default_rng(3).normal(0, 0.002, true.shape)
    plates = list(np.maximum(true + np.where(true > 0, 1.0, not cut_out) * noise, 0).astype(np.float32))
    assert noise_of(plates, lit).at(0.4) == pytest.approx(0.002, rel=0.5)


@pytest.mark.parametrize(("dark_rows", "looks"), [(0, 1), (64, 2)])
def test_plates_are_looked_at_farther_apart_only_where_dark_shows_what_that_says(
    dark_rows: int, looks: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows_of, asked = noise_samples.rows_of, []

    def noted(plate: NDArray[np.float32], rows: NDArray[np.intp]) -> NDArray[np.floating]:
        asked.append(rows)
        return rows_of(plate, rows)

    monkeypatch.setattr(noise_samples, "rows_of", noted)
    plates = 0.3 + 0.5 * waves(1.0)
    plates[:, :dark_rows] = 0.0
    plates += np.random.default_rng(5).normal(0, 0.002, plates.shape)
    noise_of(list(plates.astype(np.float32)))
    assert len(asked) == looks * len(plates)


@pytest.mark.parametrize(("steps", "told"), [(3.0, True), (1e4, False)])
def test_steps_between_a_codec_s_blocks_in_the_dark_are_no_noise_that_a_filter_spread(steps: float, told: bool) -> None:
    """A whole round of an H.264 clip was lost: its noise was found to be 43 times saturation."""
    rng = np.random.default_rng(3)
    level = np.repeat([[0.0, 0.5]], 4096, axis=1)

    def differences(size: float) -> Differences:
        return Differences(detail=rng.normal(0, size, level.shape), level=level, rounding=0 * level)

    at, variances = np.array([0.0, 0.5]), np.array([1e-6, 1e-6])
    spread = plate_noise._Spread.of(differences(1e-6), lambda: differences(steps * 1e-6), 1, at, variances)
    assert (spread.in_dark > 1) == told
