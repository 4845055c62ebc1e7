"""The compiled loops of the reflectance fit against numpy, which says the same in a line or two each."""

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.solve.normals.robust.point_sums import add_squares, descend_within, take_off_own
from psvideo.solve.normals.robust.reflectance_kernel import (
    LEAST_SHARE,
    LONGEST_STEP,
    MOST_BRIGHT,
    WIDTH,
    fill_parts,
    fill_roughness_in_the_fit,
    solve_again,
)
from psvideo.solve.normals.robust.subject_points import ShownPoints
from psvideo.solve.normals.task import FEW

Array = NDArray[np.float64]
LIGHTS, POINTS, TYPICAL = 7, 60, 0.4
UP = np.array([0.0, 0.0, 1.0])
POWERS = np.array([8.0, 32.0, 128.0])[:, None, None]
MODEL = np.array([0.2, 0.4, 0.15, 0.3, 0.2, 0.1])


def unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(11)


@pytest.fixture
def towards(rng: np.random.Generator) -> Array:
    """To every light from every point, some from behind."""
    return unit(rng.normal(size=(LIGHTS, POINTS, 3)) * (1, 1, 0.6) + UP)


@pytest.fixture
def to_camera(rng: np.random.Generator) -> Array:
    """To the camera from every point, as through a wide lens."""
    return unit(rng.normal(size=(POINTS, 3)) * (0.3, 0.3, 0) + UP)


@pytest.fixture
def half(towards: Array, to_camera: Array) -> Array:
    return unit(towards + to_camera)


@pytest.fixture
def g(rng: np.random.Generator) -> Array:
    """Normals times albedo, of which some are dark enough for their highlights to be bounded."""
    return unit(rng.normal(size=(POINTS, 3)) * (0.6, 0.6, 0.2) + UP) * rng.uniform(0.03, 0.9, (POINTS, 1))


@pytest.fixture
def counts(rng: np.random.Generator) -> Array:
    """Which measurements count: of some points two, one or none."""
    counts = (rng.random((LIGHTS, POINTS)) < 0.8).astype(float)
    counts[2:, 0], counts[1:, 1], counts[:, 2] = 0, 0, 0
    return counts


SOFTNESS = (0.0, False)


def parts_of(
    measured: Array, towards: Array, half: Array, to_camera: Array, g: Array, in_place: tuple[float, bool] = SOFTNESS
) -> Array:
    """In softness' place may stand a lobe of some power, in shares of the albedo or not."""
    size, normals = np.linalg.norm(g, axis=1), unit(g)
    c, h = (towards * normals).sum(axis=-1), np.maximum((half * normals).sum(axis=-1), 0)
    bright = (c > 0) * np.minimum(TYPICAL / size, MOST_BRIGHT)
    power, on_paint = in_place
    soft = h**power * ((c > 0) if on_paint else bright) if power else 1 - c
    return np.concatenate(
        [[measured / size, c * c * (c > 0), rough(normals, towards, to_camera, c)[0], soft], bright * h**POWERS]
    )


def rough(normals: Array, towards: Array, to_camera: Array, c: Array) -> Array:
    facing, back = (normals * to_camera).sum(axis=-1), (towards * to_camera).sum(axis=-1)
    angles = np.stack([c, np.broadcast_to(facing, c.shape), back]).reshape(3, -1)
    found = np.empty_like(angles)
    fill_roughness_in_the_fit(angles, found)
    return found.reshape(3, *c.shape)


def shown(
    rng: np.random.Generator, towards: Array, half: Array, to_camera: Array, g: Array, in_place: tuple[float, bool]
) -> Array:
    """What is measured of such points under the model, with noise."""
    parts = parts_of(np.zeros(towards.shape[:2]), towards, half, to_camera, g, in_place)[1:]
    c = (towards * unit(g)).sum(axis=-1)
    shade = np.maximum(c, 0) + np.tensordot(MODEL, parts, axes=1)
    return np.asarray(np.linalg.norm(g, axis=1) * shade + rng.normal(0, 0.003, c.shape))


@pytest.mark.parametrize("in_place", [SOFTNESS, (2.0, False), (1.5, True)])
def test_parts_are_what_each_number_of_the_model_adds(
    rng: np.random.Generator, towards: Array, half: Array, to_camera: Array, g: Array, in_place: tuple[float, bool]
) -> None:
    measured, found = rng.random((LIGHTS, POINTS)), np.empty((7, LIGHTS, POINTS))
    points = ShownPoints(measured, np.ones_like(measured), towards, half, to_camera)
    fill_parts(points, g, TYPICAL, *in_place, found)
    np.testing.assert_allclose(found, parts_of(measured, towards, half, to_camera, g, in_place), rtol=1e-12, atol=1e-15)


def test_what_no_vector_of_a_points_own_explains_is_left(
    rng: np.random.Generator, towards: Array, counts: Array
) -> None:
    parts, left = rng.normal(size=(7, LIGHTS, POINTS)), np.empty((7, LIGHTS, POINTS))
    weights = counts * rng.uniform(0.2, 1, counts.shape)
    take_off_own(towards, weights, parts, left)
    for point in range(POINTS):
        root, ways = np.sqrt(weights[:, point, None]), towards[:, point]
        own, *_ = np.linalg.lstsq(root * ways, root * parts[:, :, point].T, rcond=1e-6)
        np.testing.assert_allclose(left[:, :, point], parts[:, :, point] - (ways @ own).T, atol=1e-5)


def test_the_models_equations_are_sums_over_lights_and_points(rng: np.random.Generator, counts: Array) -> None:
    left, square, right = rng.normal(size=(7, LIGHTS, POINTS)), np.empty((6, 6)), np.empty(6)
    add_squares(counts, left, square, right)
    np.testing.assert_allclose(square, np.einsum("lp,klp,jlp->kj", counts, left[1:], left[1:]), rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(right, np.einsum("lp,klp,lp->k", counts, left[1:], left[0]), rtol=1e-10, atol=1e-9)


def test_numbers_within_bounds_are_the_least_of_the_form(rng: np.random.Generator) -> None:
    """Its slope is 0 at what lies between the bounds, and leads beyond them elsewhere (Karush, Kuhn and Tucker)."""
    least, most = np.array([-0.6, 0, 0, 0, 0, 0]), np.array([0.6, 0, 0.35, 5, 5, 5.0])
    for _ in range(20):
        design, wanted, found = rng.normal(size=(40, 6)), 3 * rng.normal(size=40), np.empty(6)
        descend_within(design.T @ design, design.T @ wanted, least, most, found)
        slope = design.T @ (design @ found - wanted)
        assert ((found >= least) & (found <= most)).all()
        assert np.abs(slope[(found > least) & (found < most)]).max(initial=0) < 1e-9
        assert (slope[(found == least) & (least < most)] > 0).all()
        assert (slope[(found == most) & (least < most)] < 0).all()


@pytest.mark.parametrize("in_place", [SOFTNESS, (2.0, False), (1.5, True)])
def test_a_step_is_that_of_gauss_and_newton_with_cauchys_weights(
    rng: np.random.Generator, towards: Array, half: Array, to_camera: Array, g: Array, counts: Array,
    in_place: tuple[float, bool],
) -> None:  # fmt: skip
    measured = shown(rng, towards, half, to_camera, g, in_place)
    begun = g * rng.uniform(0.9, 1.1, g.shape)
    found = np.empty_like(g)
    points = ShownPoints(measured, counts, towards, half, to_camera)
    solve_again(points, begun, MODEL, TYPICAL, *in_place, found)
    for point in range(POINTS):
        one = measured[:, point], counts[:, point], towards[:, point], half[:, point], to_camera[point]
        np.testing.assert_allclose(found[point], stepped(*one, begun[point], in_place), rtol=1e-6, atol=1e-8)


def stepped(
    measured: Array, counts: Array, towards: Array, half: Array, to_camera: Array, g: Array,
    in_place: tuple[float, bool],
) -> Array:  # fmt: skip
    """Return one point's step; slopes are differences, of the light that its normal times albedo sends."""
    size, (power, on_paint) = float(np.linalg.norm(g)), in_place
    bright = min(TYPICAL / size, MOST_BRIGHT)
    lobes, much = POWERS[..., 0], bright * MODEL[3:, None]
    if power:
        lobes = np.append(lobes, [[power]], axis=0)
        much = np.append(much, [[MODEL[2] * (1 if on_paint else bright)]], axis=0)

    def shine(of: Array) -> Array:
        """Highlights are those of the typical albedo, or of this one: what they add does not grow with g."""
        h = np.maximum(half @ unit(of), 0)
        return np.asarray(size * (towards @ of > 0) * (much * h**lobes).sum(axis=0))

    def shade(of: Array) -> Array:
        """What is matte, curved, rough or soft counts by the albedo."""
        normals = unit(of)[None]
        c = towards @ normals[0]
        added = rough(normals, towards[:, None], to_camera, c[:, None])[0, :, 0]
        soft = 0 if power else MODEL[2] * (1 - c)
        matte = np.linalg.norm(of) * (c + MODEL[0] * (c > 0) * c * c + MODEL[1] * added + soft)
        return np.asarray(matte + shine(of))

    small = 1e-6 * size
    slopes = np.stack([(shade(g + d) - shade(g - d)) / (2 * small) for d in small * np.eye(3)], axis=-1)
    rest = np.abs(measured - shade(g))
    many = int(counts.sum())
    order = np.sort(rest[counts > 0])
    typical = 1.48 * order[min((many + 3) // 2 - 1, many - 1)] if many else 0.0
    width = WIDTH * min(1, np.sqrt(FEW / max(many, FEW)))
    weights = counts / (1 + (rest / (width * max(typical, LEAST_SHARE * size))) ** 2)
    square = (slopes * weights[:, None]).T @ slopes
    square += (1e-6 * np.trace(square) + 1e-12) * np.eye(3)
    step = np.linalg.solve(square, slopes.T @ (weights * (measured - shine(g)))) - g
    return np.asarray(g + step * min(1, LONGEST_STEP * size / max(float(np.linalg.norm(step)), 1e-12)))
