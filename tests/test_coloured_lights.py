"""Lights whose colour is not white: every channel counts by what it says of the surface, and not by its noise."""

from typing import Literal, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray
from ring_and_ball import ball, ring

import psvideo as ps
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Surface
from psvideo.plates.several_lights.surface_colour import contradicted

Array = NDArray[np.float64]
NOISE, GREY = 0.004, np.array([0.5, 0.5, 0.5])
LEDS = [(1, 0.07, 0.01), (0.08, 1, 0.1), (0.01, 0.12, 1), (1, 0.07, 0.01), (0.08, 1, 0.1)]


class Shot(NamedTuple):
    """A ball under coloured lights, (light, row, col, channel)."""

    images: NDArray[np.float32]
    directions: Array
    colours: Array
    normals: Array
    lit: NDArray[np.bool_]  # where all lights reach it well
    void: NDArray[np.bool_]


def shot(colours: Array, albedo: Array, *, noise: float = NOISE, size: int = 96) -> Shot:
    normals, inside = ball(size, reach_deg=82)
    directions = ring(len(colours), 35)
    shade = np.einsum("rcx,lx->lrc", normals, directions) * inside
    images = np.maximum(shade, 0)[..., None] * albedo * colours[:, None, None]
    images += np.random.default_rng(1).normal(0, noise, images.shape)
    lit = inside & (shade > 0.15).all(axis=0)
    rows, cols = np.indices(inside.shape) - (size - 1) / 2
    void = np.hypot(rows, cols) > 0.53 * size
    return Shot(images.astype(np.float32), directions, colours, normals, lit, void)


def off_deg(normals: Array, one: Shot) -> Array:
    found = normals / np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-9)
    return np.asarray(np.degrees(np.arccos(np.clip((found * one.normals).sum(axis=-1), -1, 1)))[one.lit])


def best_deg(one: Shot, albedo: Array) -> float:
    """How far off least squares over all samples is that knows the surface's colour: no estimate is better."""
    rows = one.directions[:, None] * (albedo * one.colours)[..., None]
    found = np.einsum("xs,src->rcx", np.linalg.pinv(rows.reshape(-1, 3)), _samples(one.images))
    return float(np.median(off_deg(found, one)))


def _samples(images: NDArray[np.float32]) -> Array:
    return np.moveaxis(images, -1, 1).reshape(-1, *images.shape[1:3]).astype(np.float64)


def solved(one: Shot, solver: Literal["robust", "least-squares"]) -> Surface:
    return ps.solve_images(one.images, one.directions, intensities=one.colours, solver=solver)


@pytest.mark.parametrize("solver", ["robust", "least-squares"])
@pytest.mark.parametrize(
    ("colour", "albedo"),
    [((1, 0.5, 0.2), GREY), ((1, 0.7, 0.1), GREY), ((0.5, 1, 0.6), GREY), ((1, 0.6, 0.2), np.array([0.3, 0.3, 0.6]))],
    ids=str,
)
def test_a_channel_that_lights_hardly_send_adds_no_noise(
    colour: tuple[float, ...], albedo: Array, solver: Literal["robust", "least-squares"]
) -> None:
    one = shot(np.array([colour] * 6), albedo)
    surface = solved(one, solver)
    errors = off_deg(surface.normals.astype(np.float64), one)
    assert np.median(errors) < 1.05 * best_deg(one, albedo)
    assert not surface.normals[one.void].any()
    np.testing.assert_allclose(np.median(surface.albedo[one.lit], axis=0), albedo, rtol=0.01)
    assert surface.error_deg is not None
    claimed = np.sqrt(np.mean(surface.error_deg[one.lit].astype(np.float64) ** 2) / np.mean(errors**2))
    assert 0.9 < claimed < 1.5  # what holds 68 % of errors in two directions is 1.07 times their root mean square


def test_lights_of_several_colours_compare_on_a_surface_of_any() -> None:
    colours = np.array([(1, 0.5, 0.2), (0.6, 0.8, 1)] * 3)
    for albedo in (GREY, np.array([0.7, 0.2, 0.1]), np.array([0.05, 0.2, 0.6])):
        one = shot(colours, albedo, noise=0.0)
        surface = solved(one, "least-squares")
        assert off_deg(surface.normals.astype(np.float64), one).max() < 0.05
        np.testing.assert_allclose(np.median(surface.albedo[one.lit], axis=0), albedo, rtol=1e-4)
    one = shot(colours, GREY)
    assert np.median(off_deg(solved(one, "robust").normals.astype(np.float64), one)) < 1.5 * best_deg(one, GREY)


@pytest.mark.parametrize("solver", ["robust", "least-squares"])
def test_flashes_of_single_leds_give_normals_by_the_channel_that_sees_all_of_them(
    solver: Literal["robust", "least-squares"],
) -> None:
    one = shot(np.array(LEDS), GREY, noise=0.002)
    lights = [
        Light(name=str(k), direction=(x, y, z), colour=LEDS[k]) for k, (x, y, z) in enumerate(one.directions.tolist())
    ]
    surface = ps.solve_images(one.images, Rig(lights=tuple(lights)), solver=solver)
    assert np.median(off_deg(surface.normals.astype(np.float64), one)) < 3
    assert surface.valid[one.lit].mean() > 0.9
    assert not surface.valid[one.void].any()
    assert surface.source is not None
    assert (surface.source[one.void] > 0).mean() < 0.01


def test_codes_half_floats_clipped_and_unseen_samples_follow_the_same_weights() -> None:
    one = shot(np.array([(1, 0.5, 0.2)] * 6), GREY)
    images = one.images.copy()
    images[0, 30:60, :, 0] = 1.0  # clipped in one channel
    images[1, :, 40:60, 2] = np.inf
    surface = ps.solve_images(np.minimum(images, 1), one.directions, intensities=one.colours, solver="least-squares")
    assert np.median(off_deg(surface.normals.astype(np.float64), one)) < 1.3 * best_deg(one, GREY)
    codes = np.round(np.clip(images, 0, 1) * 50000 + 4000).astype(np.uint16)
    other = ps.solve_images(
        codes, one.directions, intensities=one.colours, solver="least-squares", black_level=4000, white_level=54000
    )
    assert np.median(off_deg(other.normals.astype(np.float64), one)) < 1.3 * best_deg(one, GREY)


def test_dark_that_shows_noise_alone_contradicts_nothing_and_what_moved_does() -> None:
    """Such pixels once took a first round's light from one flash each, and its noise for that of every pixel."""
    random, shading, colour = np.random.default_rng(1), np.array([0.3, 0.2, 0.25]), np.array([0.9, 0.6, 0.5])
    products = np.zeros((3, 40, 60, 3), np.float32)
    products[:, :, :30] = shading[:, None, None, None] * colour
    products[1, 10:20, 5:15] = 0.3 * colour[::-1]  # another surface, under one of the lamps
    products += random.normal(0, 0.001, products.shape).astype(np.float32)
    found = contradicted(products)
    assert found[12:18, 7:13].all()
    assert not found[:, 34:].any()
