"""What plates disagree about along the motion becomes degrees, as least squares spreads it; by hand on three lights."""

import math
from dataclasses import replace

import numpy as np
import pytest

from psvideo.model.surface import Surface
from psvideo.solve.normals.evidence import Evidence, Left
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.trust.indirect import not_of_motion
from psvideo.solve.normals.trust.judging import Judging
from psvideo.solve.normals.trust.moving_doubt import (
    MOST_DEG,
    MovingDoubt,
    moved_deg,
    moving_doubt_deg,
)
from psvideo.solve.normals.trust.thin_surface import ThinSurface
from psvideo.solve.normals.trust.witness import Checked, checked

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


@pytest.mark.parametrize("angle_deg", [40.0, 1e6])
def test_however_far_plates_disagree_a_normal_lies_no_farther_off_than_one_of_them_shows(angle_deg: float) -> None:
    turned, known = np.full((SIDE, SIDE), angle_deg, np.float32), np.ones((SIDE, SIDE), np.float32)
    doubt = moving_doubt_deg(turned, np.zeros_like(turned), known)
    np.testing.assert_allclose(doubt, HOW.most_deg)
    assert HOW.most_deg > 4 * Judging().most_error_deg, "none of it is trusted"


def puzzled_by(left: float) -> Checked:
    check = checked(facing(1.0), under_five(0.3, left))
    assert check is not None
    return check


def test_one_normal_that_explains_more_than_three_plates_is_a_witness_and_of_three_lights_there_is_none() -> None:
    assert puzzled_by(0.0).beyond == LIGHTS - 3
    assert puzzled_by(0.0).puzzling.max() == 0
    assert puzzled_by(0.005).puzzling.max() < 0.1
    assert puzzled_by(0.2).puzzling.min() > 0.95
    assert checked(facing(1.0), under_axes(np.full((3, SIDE, SIDE), 0.3, np.float32))) is None


def test_what_plates_leave_puzzles_less_where_repeats_show_noise_that_leaves_as_much() -> None:
    plain = replace(facing(1.0), noise_deg=np.full((SIDE, SIDE), 1.0, np.float32))
    noisy = replace(plain, noisier=np.full((SIDE, SIDE), 9.0, np.float32))
    checks = [checked(points, under_five(0.3, 0.05)) for points in (plain, noisy)]
    before, after = (check.puzzling.mean() for check in checks if check is not None)
    assert before > 0.9
    assert after < 0.75


def test_what_looks_torn_is_a_crease_where_one_normal_explains_the_plates_of_five_lights() -> None:
    """A crease is narrow; throughout, nothing speaks for what is torn."""
    known, turned, torn = (np.full((SIDE, SIDE), value, np.float32) for value in (1.0, 0.6, 0.0))
    torn[:, 46:50] = 9.0

    def doubt(check: Checked | None) -> float:
        return float(moving_doubt_deg(turned, torn, known, check=check)[48, 48])

    none_torn = float(moving_doubt_deg(turned, np.zeros_like(torn), known)[48, 48])
    assert doubt(puzzled_by(0.0)) < doubt(None) - 5
    assert doubt(puzzled_by(0.2)) == pytest.approx(doubt(None), abs=0.5)
    assert doubt(puzzled_by(0.0)) >= none_torn - 0.2
    torn[:] = 9.0
    assert doubt(puzzled_by(0.0)) > 10


def test_what_is_torn_around_a_narrow_thing_says_little_of_it_where_one_normal_explains_its_plates() -> None:
    known, turned, torn = (np.full((SIDE, SIDE), value, np.float32) for value in (1.0, 0.6, 9.0))
    torn[:, 47:50] = 1.0

    def doubt(check: Checked | None) -> float:
        return float(moving_doubt_deg(turned, torn, known, check=check)[48, 48])

    none_torn = float(moving_doubt_deg(turned, np.zeros_like(torn), known)[48, 48])
    assert doubt(None) > none_torn + 5, "three lights fit by chance"
    assert doubt(puzzled_by(0.2)) == pytest.approx(doubt(None), abs=0.5)
    assert doubt(puzzled_by(0.0)) == pytest.approx(none_torn, abs=0.2)


def turned_to_the_right() -> tuple[ThinSurface, Evidence]:
    """A wall that two of five lamps pass by."""
    points, one = facing(1.0), under_five(0.0, 0.0)
    points.surface.normals[:] = (0.9, 0, math.sqrt(1 - 0.9**2))
    return points, one


def test_light_from_lamps_that_pass_a_face_by_is_of_motion_as_far_as_their_plates_are_unsure() -> None:
    points, one = turned_to_the_right()
    passing = one.lit.directions @ points.surface.normals[0, 0] < 0.05
    assert passing.sum() == 2
    sums = np.full((SIDE, SIDE), 0.2, np.float32)

    def left(lamps: np.ndarray, unsure: float) -> np.ndarray:
        plates = np.zeros((LIGHTS, SIDE // 2, SIDE // 2), np.float32)
        plates[lamps] = unsure
        return np.asarray(not_of_motion(points, replace(one, unsure=plates), sums), np.float32)

    for unsure, rest in ((0.0, 0.2), (0.02, 0.12), (1e4, 0.0)):
        np.testing.assert_allclose(left(passing, unsure), rest, atol=1e-6)
    np.testing.assert_array_equal(left(~passing, 1e4), sums, "plates of lamps that light it")
    np.testing.assert_array_equal(not_of_motion(points, one, sums), sums, "nothing moves")
    sums = -sums
    np.testing.assert_array_equal(left(passing, 1.0), sums, "noise")


def test_normals_on_either_side_of_what_moves_are_torn_and_say_little_where_plates_agree() -> None:
    known, torn = (np.full((SIDE, SIDE), value, np.float32) for value in (1.0, 0.0))
    torn[:, 46:50] = 9.0
    beside, within, elsewhere = np.zeros((3, SIDE, SIDE), np.bool_)
    beside[:, 48:] = within[:, 41:] = elsewhere[:, 56:] = True

    def torn_doubt(turned_deg: float, moves: np.ndarray) -> np.ndarray:
        turned = np.full((SIDE, SIDE), turned_deg, np.float32)
        plain = moving_doubt_deg(turned, np.zeros_like(torn), known, moves)
        return np.asarray((moving_doubt_deg(turned, torn, known, moves) - plain)[48], np.float32)

    most = 9 - HOW.least_torn_deg
    for turned_deg, moves in ((0.1, beside), (0.9, beside), (0.1, within)):
        assert torn_doubt(turned_deg, moves)[48] < torn_doubt(turned_deg, elsewhere)[48] - 0.7 * most
    assert torn_doubt(2.0, beside)[48] == pytest.approx(torn_doubt(2.0, elsewhere)[48], abs=0.1)
    assert torn_doubt(0.1, beside)[47] >= most, "what it comes from behind"


@pytest.mark.parametrize(("beyond", "times"), [(1, 2), (2, 3), (5, 3)])
def test_lights_that_check_each_other_are_less_likely_to_fit_by_chance(beyond: int, times: int) -> None:
    turned, known = np.full((SIDE, SIDE), 6, np.float32), np.ones((SIDE, SIDE), np.float32)
    check = Checked(beyond=beyond, puzzling=np.zeros_like(turned))
    doubt = moving_doubt_deg(turned, np.zeros_like(turned), known, check=check)
    np.testing.assert_allclose(doubt, HOW.own * 6 + 6 * 6 / (times * HOW.around_deg), rtol=1e-4)
