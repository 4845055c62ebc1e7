"""What plates disagree about along the motion becomes degrees, as least squares spreads it; by hand on three lights."""

import math
from dataclasses import replace

import numpy as np
import pytest

from psvideo.model.surface import Surface
from psvideo.solve.normals.evidence import Evidence, Left
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.trust.doubting import ThinSurface
from psvideo.solve.normals.trust.moving_doubt import MOST_DEG, MovingDoubt, moved_deg, moving_doubt_deg

SIDE = 96
HOW = MovingDoubt()


def facing(albedo: float) -> ThinSurface:
    """A wall that faces the camera."""
    normals = np.zeros((SIDE, SIDE, 3), np.float32)
    normals[..., 2] = 1
    there, none = np.ones((SIDE, SIDE), np.bool_), np.zeros((SIDE, SIDE), np.float32)
    surface = Surface(normals=normals, albedo=np.full((SIDE, SIDE), albedo, np.float32), residual=none, valid=there)
    return ThinSurface(step=1, surface=surface, noise_deg=none, fit_deg=none, fit_of_noise_deg=none)


def under_axes(unsure: np.ndarray | None) -> Evidence:
    """Three lights of strength 2 along the axes, their plates as unsure as is said."""
    lit = Illumination(directions=np.eye(3), intensities=np.full((3, 1), 2.0))
    return Evidence(plates=(), lit=lit, usable=lambda *_: None, unsure=unsure)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("errors", "across"), [((0.1, 0, 0), 0.05), ((0, 0, 0.1), 0.0), ((0.1, 0.1, 0.1), 0.05 * math.sqrt(2))]
)
def test_what_is_unsure_turns_the_normal_by_what_lies_across_it(errors: tuple[float, ...], across: float) -> None:
    unsure = np.broadcast_to(np.array(errors, np.float32)[:, None, None], (3, SIDE // 2, SIDE // 2)).copy()
    turned = moved_deg(facing(0.5), under_axes(unsure))
    assert turned is not None
    np.testing.assert_allclose(turned, math.degrees(across / 0.5), rtol=1e-5, atol=1e-5)


def test_what_rests_is_not_turned() -> None:
    assert moved_deg(facing(0.5), under_axes(None)) is None
    assert moved_deg(facing(0.5), under_axes(np.zeros((3, SIDE, SIDE), np.float32))) is None


LIGHTS = 5


def under_five(unsure: float, left: float) -> Evidence:
    """Five lights around the camera, whose plates a normal explains but for so much each."""
    around = np.arange(LIGHTS) * 2 * np.pi / LIGHTS
    directions = np.stack([0.5 * np.cos(around), 0.5 * np.sin(around), np.full(LIGHTS, math.sqrt(0.75))], axis=1)
    shape = SIDE, SIDE
    return Evidence(
        plates=[np.zeros(shape, np.float32)] * LIGHTS,
        lit=Illumination(directions=directions, intensities=np.ones((LIGHTS, 1))),
        usable=lambda *_: None,  # type: ignore[arg-type]
        unsure=np.full((LIGHTS, *shape), unsure, np.float32),
        left=Left(np.full(shape, LIGHTS * left**2, np.float32), np.full(shape, LIGHTS, np.float32)),
    )


def turned_by(unsure: float, left: float) -> float:
    turned = moved_deg(facing(1.0), under_five(unsure, left))
    assert turned is not None
    return float(turned.mean())


def test_plates_of_five_lights_that_one_normal_explains_are_hardly_off() -> None:
    unsure = 0.3
    plain = moved_deg(facing(1.0), replace(under_five(unsure, 0.0), left=None))
    assert plain is not None
    assert turned_by(unsure, 0.0) < 0.03 * plain.mean()
    assert turned_by(unsure, 0.0) < turned_by(unsure, 0.05) < turned_by(unsure, 0.1)
    assert turned_by(unsure, unsure) == pytest.approx(plain.mean(), rel=1e-3)


def test_little_that_is_unsure_is_believed_for_what_is_left_may_be_of_the_surface() -> None:
    plain = moved_deg(facing(1.0), replace(under_five(0.01, 0.0), left=None))
    assert plain is not None
    assert turned_by(0.01, 0.0) > 0.4 * plain.mean()


def test_plates_of_which_nothing_is_known_are_known_where_one_normal_explains_them() -> None:
    assert turned_by(1e4, 0.01) < 0.5
    assert turned_by(1e4, 0.2) > MOST_DEG


def test_where_lights_that_show_are_three_nothing_speaks_for_their_plates() -> None:
    one = under_five(0.3, 0.0)
    assert one.left is not None
    few = replace(one, left=one.left._replace(lights=np.full((SIDE, SIDE), 3, np.float32)))
    plain, turned = moved_deg(facing(1.0), replace(one, left=None)), moved_deg(facing(1.0), few)
    assert plain is not None
    assert turned is not None
    np.testing.assert_allclose(turned, plain, rtol=1e-5)


def test_a_pixel_by_itself_counts_its_own_angle_and_hardly_speaks_for_the_rest() -> None:
    turned, known, none = np.zeros((SIDE, SIDE), np.float32), np.ones((SIDE, SIDE), np.float32), np.zeros(1, np.float32)
    turned[48, 48] = 10
    doubt = moving_doubt_deg(turned, np.broadcast_to(none, turned.shape), known)
    assert doubt[48, 48] == pytest.approx(HOW.own * 10, rel=0.01)
    doubt[48, 48] = 0
    assert doubt.max() < 0.01


def test_what_all_around_is_turned_counts_more_than_its_own_angle() -> None:
    turned, known = np.full((SIDE, SIDE), 6, np.float32), np.ones((SIDE, SIDE), np.float32)
    doubt = moving_doubt_deg(turned, np.zeros_like(turned), known)
    np.testing.assert_allclose(doubt, HOW.own * 6 + 6 * 6 / HOW.around_deg, rtol=1e-4)
