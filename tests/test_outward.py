"""Normals face outwards where a body ends: exchanged and turned lights show there, where slopes do not show them."""

import numpy as np
import pytest
from numpy.typing import NDArray
from ring_and_ball import ring

from psvideo.model.surface import Surface
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.report.judge.of_rig import rig as judge_rig
from psvideo.report.judgement import Judgement
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.outward import outward
from psvideo.report.observe.thinned import thin_surface, thinned
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
SIZE = 240
ROWS, COLS = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
X, Y = COLS / (0.45 * SIZE), -ROWS / (0.45 * SIZE)
RADIUS = np.hypot(X, Y)
HALF_TURN = np.diag([-1.0, -1.0, 1.0])


def of_slopes(across: Array, up: Array) -> Array:
    normals = np.stack([-across, -up, np.ones_like(up)], axis=-1)
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def ball() -> tuple[Array, Mask]:
    inside = RADIUS < 0.97
    height = np.sqrt(np.where(inside, 1 - RADIUS**2, 1))
    return of_slopes(-X / height, -Y / height), inside


def cone() -> tuple[Array, Mask]:
    return of_slopes(-1.2 * X / RADIUS, -1.2 * Y / RADIUS), RADIUS < 0.9


def bowl() -> tuple[Array, Mask]:
    normals, inside = ball()
    return normals * [-1, -1, 1], inside


def relief() -> tuple[Array, Mask]:
    """Something that a mask cuts out of a larger thing."""
    return of_slopes(0.8 * np.cos(5 * X) * np.cos(4 * Y), -0.8 * np.sin(5 * X) * np.sin(4 * Y)), RADIUS < 0.9


def box() -> tuple[Array, Mask]:
    return of_slopes(0.2 * np.ones_like(X), 0.1 * np.ones_like(X)), np.maximum(np.abs(X), np.abs(Y)) < 0.8


def solved(shape: tuple[Array, Mask], ways: Array, claimed: Array) -> tuple[list[NDArray[np.float32]], Surface]:
    """Return plates of a shape under lights, and what is solved of it under the lights that are claimed."""
    normals, inside = shape
    rng = np.random.default_rng(4)
    clean = (0.5 * np.maximum(normals @ way, 0) * inside for way in ways)
    plates = [(one + rng.normal(0, 0.001, one.shape)).astype(np.float32) for one in clean]
    lit = Illumination(directions=claimed, intensities=np.ones((len(ways), 1)))
    return plates, Solving(error=True).solve(plates, lit, mask=inside)


def found_of(plates: list[NDArray[np.float32]], surface: Surface, subject: Mask) -> float | None:
    found = outward(thin_surface(surface), thinned(subject), thinned(np.max(plates, axis=0)))
    return None if found is None else found.cosine


def facing(shape: tuple[Array, Mask], ways: Array, claimed: Array) -> float | None:
    plates, surface = solved(shape, ways, claimed)
    return found_of(plates, surface, shape[1])


@pytest.mark.parametrize("lights", [3, 5])
@pytest.mark.parametrize("shape", [ball(), cone()], ids=["ball", "cone"])
def test_normals_of_a_body_that_stands_free_face_outwards(shape: tuple[Array, Mask], lights: int) -> None:
    ways = ring(lights, 30)
    right, turned = facing(shape, ways, ways), facing(shape, ways, ways @ HALF_TURN)
    assert right is not None
    assert right > 0.95
    assert turned is not None
    assert turned < -0.9


@pytest.mark.parametrize("order", [(1, 0, 2), (0, 2, 1), (2, 1, 0), (1, 2, 0)])
def test_under_exchanged_lights_they_do_not(order: tuple[int, ...]) -> None:
    ways = ring(3, 30)
    found = facing(ball(), ways, ways[list(order)])
    assert found is not None
    assert abs(found) < 0.6


@pytest.mark.parametrize("shape", [relief(), box()], ids=["relief", "box"])
def test_what_meets_its_outline_facing_the_camera_says_nothing(shape: tuple[Array, Mask]) -> None:
    ways = ring(3, 30)
    assert facing(shape, ways, ways) is None


def test_where_the_picture_ends_or_an_outline_faces_one_way_nothing_is_said() -> None:
    ways = ring(3, 30)
    normals, inside = ball()
    assert found_of(*solved((normals, inside), ways, ways), np.ones((SIZE, SIZE), np.bool_)) is None
    cut = slice(SIZE * 3 // 4, None)  # the picture ends within the ball, and its right side is in it
    assert found_of(*solved((normals[:, cut], inside[:, cut]), ways, ways), inside[:, cut]) is None


def test_where_a_mask_cuts_through_a_body_light_goes_on_and_nothing_is_said() -> None:
    ways = ring(3, 30)
    plates, surface = solved(ball(), ways, ways)
    strip = (np.abs(X - 0.7) < 0.2) & (np.abs(Y) < 0.55)
    assert found_of(plates, surface, strip) is None
    assert outward(thin_surface(surface), thinned(strip), thinned(strip).astype(np.float32)) is not None


@pytest.mark.parametrize("unseen", [slice(80, 120), slice(0, 90)])
def test_where_rows_end_that_some_frame_saw_a_subject_does_not(unseen: slice) -> None:
    """A bust was called a rig of exchanged lights at a shutter of 270 degrees: its outline ran along the rows that no
    frame saw, at a mean cosine of 0.37."""
    ways = ring(4, 30)
    normals, inside = ball()
    seen = inside & ~np.isin(np.arange(SIZE), np.arange(SIZE)[unseen])[:, None]
    plates, surface = solved((normals, seen), ways, ways)
    of_all, shown = thinned(np.max(plates, axis=0)), thinned(seen | ~inside)
    cut = outward(thin_surface(surface), thinned(seen), of_all)
    right = outward(thin_surface(surface), thinned(seen), of_all, shown)
    assert cut is not None
    assert cut.cosine < 0.9
    assert right is not None
    assert right.cosine > 0.95


def said_of(shape: tuple[Array, Mask], ways: Array, claimed: Array, *, guessed: bool = False) -> Judgement:
    """Return the line on the rig."""
    plates, surface = solved(shape, ways, claimed)
    observed = Observed(lights=tuple(f"light{n}" for n in range(len(ways))))
    shown = tuple(
        LightPlate(light=name, number=1001, time_s=0.0, picture=mixture_of(one), seen=np.ones(SIZE, np.bool_))
        for name, one in zip(observed.lights, plates, strict=True)
    )
    observed.add(Round(number=1001, plates=shown), surface)
    observed.closely.leans.clear()
    (line,) = judge_rig(observed, guessed=guessed)
    return line


def test_lights_of_a_ball_that_are_exchanged_or_turned_are_named_and_right_ones_are_not() -> None:
    ways = ring(3, 30)
    right, exchanged = said_of(ball(), ways, ways), said_of(ball(), ways, ways[[0, 2, 1]])
    turned = said_of(ball(), ways, ways @ HALF_TURN)
    assert right.grade == "unknown"
    assert "Lights are hardly exchanged" in right.found
    assert exchanged.grade == "bad"
    assert "two lights are exchanged" in exchanged.found
    assert turned.grade == "doubtful"
    assert "turned by 180 degrees" in turned.found


def test_a_bowl_is_not_called_wrong_and_a_guessed_order_is_what_is_blamed() -> None:
    ways = ring(3, 30)
    hollow, guessed = said_of(bowl(), ways, ways), said_of(ball(), ways, ways[[0, 2, 1]], guessed=True)
    assert hollow.grade == "doubtful"
    assert "hollow" in hollow.found
    assert "order of the lights is a guess" in guessed.found


def beside() -> tuple[Array, Mask]:
    """A bowl, and a ball that is as large."""
    across, up, sign = (X - 0.5 * np.sign(X)) / 0.45, Y / 0.45, np.sign(X)
    inside = np.hypot(across, up) < 0.97
    height = np.sqrt(np.where(inside, 1 - across**2 - up**2, 1))
    return of_slopes(-sign * across / height, -sign * up / height), inside


@pytest.mark.parametrize("lights", [3, 5])
def test_a_bowl_beside_a_ball_is_not_called_a_wrong_rig_and_a_wrong_rig_is(lights: int) -> None:
    """Half of the outline faced inwards: two lights were to be exchanged, and the take was not usable."""
    ways = ring(lights, 30)
    right, mirrored = (said_of(beside(), ways, claimed) for claimed in (ways, ways * [-1, 1, 1]))
    assert right.grade == "doubtful"
    assert "a part of it is hollow" in right.found
    assert mirrored.grade == "bad"
    assert "exchanged" in mirrored.found


def test_a_bowl_under_a_guessed_order_that_is_right_is_doubted_and_not_called_wrong() -> None:
    """With every other first light the line stayed, and it said that the order was hardly the true one."""
    ways = ring(4, 30)
    line = said_of(bowl(), ways, ways, guessed=True)
    assert line.grade == "doubtful"
    assert "or the subject is hollow" in line.found
