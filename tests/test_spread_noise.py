"""How noisy plates are said to be whose noise neighbours share: demosaiced, filtered, or unlike in every channel."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.clip import demosaic
from psvideo.model.surface import Surface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.plate_noise import noise_of, spread_of
from psvideo.solve.normals.solving import Solving
from psvideo.solve.passes.asked_passes import AskedPasses, passes_of

Array = NDArray[np.float64]
Camera = Callable[[Array, np.random.Generator], Array]

ROWS, COLS, SENSOR = 144, 224, 0.003
AROUND = np.arange(5) * 2 * np.pi / 5
DIRECTIONS = np.stack([0.56 * np.cos(AROUND), 0.56 * np.sin(AROUND), np.full(5, 0.83)], axis=1)
LIT = Illumination(directions=DIRECTIONS, intensities=np.ones((5, 3)), names=tuple("abcde"))


def away() -> Array:
    """Return how far pixels are from the middle of a ball, over its radius."""
    row, col = np.mgrid[:ROWS, :COLS]
    return np.asarray(np.hypot(col - 112, row - 72) / 56)


def shaded() -> Array:
    """Return a matte ball before nothing under LIT, (light, row, col, channel)."""
    row, col = np.mgrid[:ROWS, :COLS]
    x, y, z = (col - 112) / 56, (72 - row) / 56, np.sqrt(np.clip(1 - away() ** 2, 0, 1))
    shade = np.maximum(np.einsum("irc,li->lrc", np.stack([x, y, z]) * (away() < 0.99), DIRECTIONS), 0)
    return np.asarray(shade[..., None] * np.array([0.25, 0.5, 0.3]))


def through_a_mosaic(true: Array, rng: np.random.Generator) -> Array:
    filters = np.array([[0, 1], [1, 2]])[np.mgrid[:ROWS, :COLS][0] % 2, np.mgrid[:ROWS, :COLS][1] % 2]
    raw = np.take_along_axis(true, filters[..., None], axis=-1)[..., 0] + rng.normal(0, SENSOR, (ROWS, COLS))
    return np.asarray(demosaic(raw.astype(np.float32), "RGGB"), np.float64)


def blurred(sigma_px: float) -> Camera:
    def camera(true: Array, rng: np.random.Generator) -> Array:
        noise = cv2.GaussianBlur(rng.normal(0, 1, true.shape), (0, 0), sigma_px)
        return np.asarray(true + SENSOR * noise / noise.std())

    return camera


def of_channels(*times: float) -> Camera:
    return lambda true, rng: true + SENSOR * np.array(times) * rng.normal(0, 1, true.shape)


CAMERAS: dict[str, Camera] = {
    "white": of_channels(1, 1, 1),
    "mosaic": through_a_mosaic,
    "blurred by 0.7 px": blurred(0.7),
    "blurred by 1 px": blurred(1.0),
    "red and blue amplified": of_channels(5, 1, 5),
}


def plates_of(camera: Camera, true: Array, seed: int = 1) -> list[NDArray[np.float32]]:
    rng = np.random.default_rng(seed)
    return [camera(one, rng).astype(np.float32) for one in true]


def of_mean(plates: list[NDArray[np.float32]], true: Array, where: NDArray[np.bool_]) -> float:
    """Return the standard deviation of the mean of three channels, times the root of their number."""
    off = (np.stack(plates) - true).mean(axis=-1)[:, where]
    return float(np.sqrt(3 * np.mean(off**2)))


@pytest.mark.parametrize("lights", [3, 5])
@pytest.mark.parametrize("camera", CAMERAS)
def test_noise_is_as_large_as_it_is_whatever_spread_it(camera: str, lights: int) -> None:
    true = shaded()[:lights]
    plates = plates_of(CAMERAS[camera], true)
    lit = Illumination(directions=DIRECTIONS[:lights], intensities=np.ones((lights, 3)))
    noise = noise_of(plates, lit)
    assert noise.dark == pytest.approx(of_mean(plates, true, away() > 1.1), rel=0.2)
    assert noise.at(0.2) == pytest.approx(of_mean(plates, true, away() < 0.6), rel=0.25)


@pytest.mark.parametrize("level", [0.002, 0.006, 0.02, 0.1])
@pytest.mark.parametrize("wide_px", [1.0, 2.0, 4.0])
def test_a_dim_backdrop_s_texture_is_no_noise(level: float, wide_px: float) -> None:
    """Cloth whose light varies by 0.3 of itself, from pixel to pixel or over several of them; the noise is white."""
    cloth = cv2.GaussianBlur(np.random.default_rng(7).normal(size=(ROWS, COLS)), (0, 0), wide_px)
    cloth = level * np.clip(1 + 0.3 * cloth / cloth.std(), 0, None)
    true = np.where((away() > 1)[..., None], cloth[..., None], shaded())
    plates = plates_of(CAMERAS["white"], true)
    beside_only = np.hypot(SENSOR, 0.3 * level * np.sqrt(3) if wide_px == 1 else 0)
    assert noise_of(plates).dark < 1.2 * max(beside_only, SENSOR)


@pytest.mark.parametrize("wide_px", [0.0, 1.0, 2.0])
def test_texture_in_light_is_no_noise_that_a_filter_spread(wide_px: float) -> None:
    """Paint is not taken for noise by how it differs over some pixels: the dark around it has white noise."""
    white = np.random.default_rng(7).normal(size=(ROWS, COLS))
    paint = np.asarray(cv2.GaussianBlur(white, (0, 0), wide_px)) if wide_px else white
    true = shaded() * np.clip(1 + 0.1 * paint / paint.std(), 0, 2)[..., None]
    noise = noise_of(plates_of(CAMERAS["white"], true), LIT)
    assert noise.dark == pytest.approx(SENSOR, rel=0.15)
    assert noise.at(0.3) == pytest.approx(SENSOR, rel=0.25)


@pytest.fixture(scope="module", params=["white", "mosaic", "blurred by 0.7 px", "red and blue amplified"])
def solved(request: pytest.FixtureRequest) -> tuple[list[NDArray[np.float32]], Surface]:
    plates = plates_of(CAMERAS[request.param], shaded())
    return plates, Solving(error=True).solve(plates, LIT)


def test_nothing_is_measured_in_a_void(solved: tuple[list[NDArray[np.float32]], Surface]) -> None:
    plates, surface = solved
    void = away() > 1.2
    assert surface.source is not None
    assert np.mean(surface.source[void] > 0) < 1e-3
    passes = passes_of(AskedPasses(reach=True), plates, surface, LIT)
    assert passes.reach is not None
    assert np.mean(passes.reach[void] > 0) < 1e-3


def test_a_matte_ball_has_no_highlights(solved: tuple[list[NDArray[np.float32]], Surface]) -> None:
    plates, surface = solved
    specular = passes_of(AskedPasses(specular=True), plates, surface, LIT).specular
    assert specular is not None
    assert np.mean(specular[away() < 0.85].any(axis=-1)) < 2e-3


def test_two_thirds_of_errors_are_as_claimed(solved: tuple[list[NDArray[np.float32]], Surface]) -> None:
    _, surface = solved
    row, col = np.mgrid[:ROWS, :COLS]
    z = np.sqrt(np.clip(1 - away() ** 2, 0, 1))
    truth = np.stack([(col - 112) / 56, (72 - row) / 56, z], axis=-1)
    off_deg = np.degrees(np.arccos(np.clip((surface.normals * truth).sum(axis=-1), -1, 1)))
    lit = (away() < 0.9) & (shaded()[..., 1] > 0.05).all(axis=0)
    assert surface.error_deg is not None
    assert surface.valid[lit].mean() > 0.99
    assert 0.66 < np.mean((off_deg <= surface.error_deg)[lit]) < 0.95


@pytest.mark.parametrize(
    ("camera", "least", "most"), [("white", 1.0, 1.0), ("mosaic", 2.2, 4.5), ("blurred by 0.7 px", 9, 20)]
)
def test_how_much_of_it_neighbours_show_is_known_of_the_mean_of_channels(
    camera: str, least: float, most: float
) -> None:
    plates = plates_of(CAMERAS[camera], shaded())
    assert least <= spread_of(plates) <= most


def test_a_wall_that_fills_the_picture_shows_no_spread() -> None:
    wall = np.full((5, ROWS, COLS, 3), 0.3)
    assert spread_of(plates_of(through_a_mosaic, wall)) == 1.0
