"""Where lights that are off explain what is left over, it is known by how much they turn normals."""

from typing import NamedTuple

import numpy as np
import pytest
from angles import angles_deg
from bench.predicted import shapes, shot
from numpy.typing import NDArray
from ring_and_ball import ring

from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.robust.subject_points import SubjectPoints
from psvideo.solve.normals.solving import Solving
from psvideo.solve.normals.trust import few_checked
from psvideo.solve.normals.trust.by_other_rig import other_rig
from psvideo.solve.normals.trust.judging import looked_at
from psvideo.solve.normals.trust.rig_spread import _squares_turned, turned_by_rig_deg
from psvideo.solve.normals.trust.usual_errors import UsualErrors

Array = NDArray[np.float64]
UP = np.array([0.0, 0.0, 1.0])
NOISE = 0.001
SHAPES = {name: (normals, inside) for name, normals, inside in shapes()}


class Seen(NamedTuple):
    """Points of a matte subject, as lights of a rig show them: normals times albedo, and how far these are off."""

    points: SubjectPoints
    g: Array
    off_deg: Array


def seen(true: Array, claimed: Array, rng: np.random.Generator, gloss: float = 0.0) -> Seen:
    """Solve normals of a cap of 35 degrees with ``claimed`` vectors to the lights where others are ``true``."""
    z = rng.uniform(np.cos(np.radians(35)), 1, 200)
    around = rng.uniform(0, 2 * np.pi, 200)
    side = np.sqrt(1 - z**2)
    normals = np.stack([side * np.cos(around), side * np.sin(around), z], axis=-1)
    half = true + UP
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    measured = 0.5 * true @ normals.T + gloss * np.maximum(half @ normals.T, 0) ** 40
    measured += rng.normal(0, NOISE, measured.shape)
    g: Array = np.linalg.lstsq(claimed, measured, rcond=None)[0].T.astype(np.float64)
    solved = g / np.linalg.norm(g, axis=1, keepdims=True)
    towards = np.repeat(claimed[:, None], len(normals), axis=1)
    points = SubjectPoints(
        measured=measured,
        counts=np.ones_like(measured),
        seen=np.ones_like(measured),
        towards=towards,
        half=np.repeat(half[:, None], len(normals), axis=1),
        to_camera=np.broadcast_to(UP, normals.shape),
        normals=solved,
    )
    return Seen(points, g, angles_deg(solved, normals))


def claims(one: Seen) -> Array:
    return turned_by_rig_deg(one.points, one.points.normals, other_rig(one.points, one.g))


@pytest.mark.parametrize("off_deg", [0.5, 3.0])
@pytest.mark.parametrize("lights", [4, 5, 8])
def test_two_thirds_of_errors_are_within_what_is_claimed_whatever_the_lights_are_off_by(
    lights: int, off_deg: float
) -> None:
    rng, within, twice = np.random.default_rng([5, lights]), [], []
    for _ in range(24):
        true = ring(lights, 40)
        claimed = true + np.radians(off_deg) * rng.normal(size=true.shape)
        claimed /= np.linalg.norm(claimed, axis=1, keepdims=True)
        one = seen(true, claimed, rng)
        within.append(float(np.mean(one.off_deg <= claims(one))))
        twice.append(float(np.mean(one.off_deg <= 2 * claims(one))))
    assert 0.55 < np.mean(within) < 0.8
    assert np.mean(twice) > 0.9


def test_strengths_that_are_off_turn_normals_less_than_as_many_directions() -> None:
    rng, ratios = np.random.default_rng(8), []
    for _ in range(20):
        true = ring(5, 40) * np.exp(0.04 * rng.normal(size=(5, 1)))
        one = seen(true, ring(5, 40), rng)
        ratios.append(float(np.median(claims(one)) / np.median(one.off_deg)))
    assert 0.5 < np.exp(np.mean(np.log(ratios))) < 1.6


def test_a_right_rig_turns_normals_by_no_more_than_noise_lets_it_be_off() -> None:
    one = seen(ring(6, 40), ring(6, 40), np.random.default_rng(2))
    assert claims(one).max() < 0.2


def test_a_rig_that_is_off_is_a_cause_and_noise_and_edges_are_none() -> None:
    rng, true = np.random.default_rng(3), ring(5, 40)
    claimed = true + np.radians(3) * rng.normal(size=true.shape)
    claimed /= np.linalg.norm(claimed, axis=1, keepdims=True)
    by_rig = seen(true, claimed, rng)
    found = few_checked.causes(by_rig.points, by_rig.g)
    assert found.explained == 1
    assert found.by_rig
    assert found.by_cause_deg == pytest.approx(claims(by_rig))
    right = seen(true, true, rng)
    assert few_checked.causes(right.points, right.g).explained == 0
    spotted = seen(true, true, rng)
    edges = rng.random(spotted.points.measured.shape) < 0.1  # of shadows, say
    spotted.points.measured[edges] += 0.1
    assert few_checked.causes(spotted.points, spotted.g).explained == 0


def test_a_sheen_that_a_model_explains_is_a_cause_and_turns_normals_by_about_what_they_are_off_by() -> None:
    rng, true = np.random.default_rng(4), ring(5, 40)
    one = seen(true, true, rng, gloss=0.1)
    found = few_checked.causes(one.points, one.g)
    assert found.explained > 0.9
    assert not found.by_rig
    assert 0.4 < np.median(found.by_cause_deg) / np.median(one.off_deg) < 1.5


def test_noise_is_not_left_by_a_cause() -> None:
    """Of what a rig that is off by a quarter of a degree leaves over, noise makes a part."""
    rng, true = np.random.default_rng(6), ring(6, 40)
    claimed = true + np.radians(0.25) * rng.normal(size=true.shape)
    one = seen(true, claimed / np.linalg.norm(claimed, axis=1, keepdims=True), rng)
    left = other_rig(one.points, one.g).left.evenly
    assert 0.12 < left < 0.6
    assert few_checked.causes(one.points, one.g, of_noise=0.9 * left).explained > 0.9
    assert few_checked.causes(one.points, one.g).explained < 0.9


def test_lights_that_are_all_stronger_by_a_share_turn_nothing() -> None:
    one = seen(ring(5, 40), ring(5, 40), np.random.default_rng(7))
    stronger = 0.1 * ring(5, 40).reshape(-1)
    assert _squares_turned(one.points, one.points.normals, np.outer(stronger, stronger)[None]).max() < 1e-12


def test_what_is_known_to_be_the_cause_counts_wholly_in_what_is_said_of_a_picture() -> None:
    lit = Illumination(directions=ring(5, 40), intensities=np.ones((5, 1)))
    usual = UsualErrors(whole_deg=4.0, by_noise_deg=0.0, unknown_share=0.0)
    assert usual.likely_deg(lit, plain=False, explained=1.0) == pytest.approx(4)
    assert usual.likely_deg(lit, plain=False, explained=0.0) < 2.5


def test_beside_much_noise_a_rig_that_is_off_by_a_degree_is_still_the_cause() -> None:
    normals, inside = SHAPES["bumps"]
    claimed = ring(5, 40) + np.radians(1.0) * np.random.default_rng(3).normal(size=(5, 3))
    claimed /= np.linalg.norm(claimed, axis=1, keepdims=True)
    case = shot(normals, inside, ring(5, 40), noise=0.01)
    lit = Illumination(directions=claimed, intensities=np.ones((5, 3)))
    surface, one, noise = Solving().measured(LitPlates(case.plates, lit, mask=inside))
    assert looked_at(surface, one, noise)[1].explained > 0.5


def test_of_near_lights_the_rig_is_no_cause() -> None:
    """What a distance that is off leaves over, other lights would explain as well."""
    rng, true = np.random.default_rng(3), ring(5, 40)
    claimed = true + np.radians(3) * rng.normal(size=true.shape)
    one = seen(true, claimed / np.linalg.norm(claimed, axis=1, keepdims=True), rng)
    assert few_checked.causes(one.points, one.g, distant=False).explained == 0
