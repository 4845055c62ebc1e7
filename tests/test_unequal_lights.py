"""Lights of very different strength: noise does not shrink with a lamp, and a weak lamp says what it can."""

import numpy as np
import pytest
from bench.accuracy_measure import angles_deg
from bench.predicted import shapes
from numpy.typing import NDArray
from ring_and_ball import ball, ring

import psvideo as ps
from psvideo.model.rig import Light, Rig
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.light_sigmas import light_sigmas
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.robust import huber1981
from psvideo.solve.normals.task import Usable

Array = NDArray[np.float64]
NOISE = 0.002


def framed_ball() -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """A ball in the void: normals (row, col, 3), where it is, and where the void is."""
    normals, inside = ball(70, reach_deg=88)
    normals, inside = np.pad(normals, ((12, 12), (45, 45), (0, 0))), np.pad(inside, ((12, 12), (45, 45)))
    rows, cols = np.indices(inside.shape)
    return normals, inside, np.hypot(rows - 46.5, cols - 79.5) > 40


def shot(strengths: Array, normals: Array, *, noise: float = NOISE) -> tuple[NDArray[np.float32], Array, Array]:
    """Plates (light, row, col), the lights' directions, and n . l."""
    directions = ring(len(strengths), 35)
    shade = np.einsum("rcx,lx->lrc", normals, directions)
    images = 0.5 * np.maximum(shade, 0) * strengths[:, None, None]
    images += np.random.default_rng(1).normal(0, noise, images.shape)
    return images.astype(np.float32), directions, shade


@pytest.mark.parametrize(
    ("noise", "share", "power"),
    [((1e-4, 0.0), 0.0, 0.0), ((0.0, 1e-4), 0.0, 0.5), ((0.0, 0.0), 0.03, 1.0)],
    ids=["noise in the dark", "photon noise", "what is not matte"],
)
def test_what_is_off_grows_with_a_lamp_as_its_cause_does(
    noise: tuple[float, float], share: float, power: float
) -> None:
    strengths = np.array([1, 1, 0.25, 0.04])
    lit = Illumination(directions=ring(4, 35), intensities=strengths[:, None])
    found = light_sigmas(lit, noise, light=0.4, share=share)
    np.testing.assert_allclose(found, (strengths / strengths.mean()) ** power, rtol=1e-12)


@pytest.mark.parametrize("solver", ["robust", "least-squares"])
@pytest.mark.parametrize("strengths", [(1, 1, 1, 0.1, 0.1, 0.1), (1, 1, 1, 0.05, 0.05), (1, 0.1, 0.1, 0.1, 1)], ids=str)
def test_noise_under_weak_lamps_is_no_surface(strengths: tuple[float, ...], solver: str) -> None:
    normals, _, void = framed_ball()
    images, directions, _ = shot(np.array(strengths), normals)
    surface = ps.solve_images(images, directions, intensities=np.array(strengths), solver=solver)  # type: ignore[arg-type]
    assert surface.source is not None
    assert (surface.source[void] > 0).mean() < 0.001


def test_noise_far_from_near_lamps_is_no_surface() -> None:
    """Five lamps above a disc, in a picture that is three metres wide: corners get a tenth of the light."""
    rows, cols, distance_m, focal_px = 90, 160, 0.8, 43.0
    right_m = (np.arange(cols) - (cols - 1) / 2) / focal_px * distance_m
    up_m = -(np.arange(rows) - (rows - 1) / 2) / focal_px * distance_m
    points_m = np.stack([*np.meshgrid(right_m, up_m), np.full((rows, cols), -distance_m)], axis=-1)
    away_m = np.hypot(points_m[..., 0], points_m[..., 1])
    around = np.arange(5) * 2 * np.pi / 5
    lamps_m = np.stack([0.3 * np.cos(around), 0.3 * np.sin(around), np.full(5, -0.3)], axis=-1)
    to_lamps = lamps_m[:, None, None] - points_m
    squared = (to_lamps**2).sum(axis=-1)
    images = (away_m < 0.12) * to_lamps[..., 2] / squared**1.5
    images = 0.5 * images / images.max() + np.random.default_rng(0).normal(0, NOISE, images.shape)
    rig = Rig(
        lights=tuple(Light(name=str(k), position_m=(x, y, z)) for k, (x, y, z) in enumerate(lamps_m.tolist())),
        focal_px=(focal_px, focal_px),
        principal_px=((cols - 1) / 2, (rows - 1) / 2),
        plane=(0, 0, 1, distance_m),
    )
    surface = ps.solve_images(images.astype(np.float32), rig)
    assert surface.source is not None
    assert (surface.source[away_m > 0.2] > 0).mean() < 0.001
    assert surface.valid[away_m < 0.1].all()


@pytest.mark.parametrize("module", [woodham1980, huber1981], ids=["least squares", "robust"])
def test_a_measurement_counts_from_one_level_on_whatever_its_light(module: object) -> None:
    """Three lights reach a patch, the third of them a weak one: the patch has a normal where that shows its level."""
    directions, strengths = ring(4, 40), np.array([1.0, 1.0, 0.3, 1.0])
    lit = Illumination(directions=directions, intensities=strengths[:, None])
    levels = np.linspace(0.001, 0.02, 39, dtype=np.float32)
    plates = [np.full((1, 39), 0.2, np.float32) for _ in range(4)]
    plates[2], plates[3] = levels[None], np.zeros((1, 39), np.float32)
    usable = Usable(dark_level=0.01, shadow_ratio=0.0)
    surface = module.solve(LitPlates(plates, lit), usable=usable)  # type: ignore[attr-defined]
    np.testing.assert_array_equal(surface.normals.any(axis=-1)[0], levels > 0.01)


@pytest.mark.parametrize("noise", [0.001, 0.004])
@pytest.mark.parametrize(
    "strengths", [(1, 0.1, 1, 0.1, 1), (1, 1, 1, 0.1, 0.1), (1, 0.1, 1, 0.1, 1, 0.1, 1, 0.1)], ids=str
)
def test_what_weak_lamps_hold_of_noise_is_claimed_once(strengths: tuple[float, ...], noise: float) -> None:
    """Residuals of a weak lamp are noise: they say nothing of normals that strong lamps show."""
    normals = shapes()[1][1]
    images, directions, _ = shot(np.array(strengths), normals, noise=noise)
    surface = ps.solve_images(images, directions, intensities=np.array(strengths))
    assert surface.error_deg is not None
    off_deg = angles_deg(surface.normals, normals)
    assert (off_deg <= surface.error_deg).mean() >= 0.65
    assert np.median(surface.error_deg) < 2 * np.median(off_deg)
    fitted = np.linalg.lstsq(directions * np.array(strengths)[:, None], images.reshape(len(images), -1), rcond=None)[0]
    best_deg = angles_deg(fitted.T.reshape(normals.shape), normals)
    assert off_deg.mean() < 1.15 * best_deg.mean(), "noise is alike under all lamps: plain least squares is best"


@pytest.mark.parametrize("strengths", [(1, 1, 0.1, 1), (1, 1, 0.3, 1), (1, 1, 1, 1)], ids=str)
def test_a_weak_lamp_among_four_shows_a_wrong_rig_by_little_light(strengths: tuple[float, ...]) -> None:
    """What three strong lamps and a weak one leave over is the weak one's, and as small as that is."""
    normals = shapes()[1][1]
    images, directions, _ = shot(np.array(strengths), normals)
    across = np.random.default_rng(2).normal(size=directions.shape)
    across -= np.sum(across * directions, axis=1, keepdims=True) * directions
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    claimed = np.cos(np.radians(2)) * directions + np.sin(np.radians(2)) * across
    surface = ps.solve_images(images, claimed, intensities=np.array(strengths))
    assert surface.error_deg is not None
    off_deg = angles_deg(surface.normals, normals)
    assert (off_deg <= 2 * surface.error_deg).mean() >= 0.9
    assert np.median(surface.error_deg) < 2.5 * np.median(off_deg)
