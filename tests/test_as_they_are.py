"""Where plates as they are show one surface and plates brought to the instant do not, nothing is moved."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from bench.accuracy_measure import angles_deg
from bench.accuracy_motion import ASLANT, BOX, UNALIGNED, filmed, turn

from psvideo.model.rig import Light, Rig
from psvideo.plates.align import rounds
from psvideo.plates.align.as_they_are import BothWays, fits_as_it_is, stands_under
from psvideo.plates.align.as_they_are_kernel import CLIPPED, leave_rows
from psvideo.plates.align.doubt.lone_edges import InstantSketch
from psvideo.plates.align.plate_lamps import Lamps
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.align.velocity.brightness import EVERY_CODE, light_of
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.runs.instants.job import Job, OverTime
from psvideo.runs.steps.lighting import Lighting
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving

FIVE = np.array([[0, 0.6, 0.8], [-0.5706, 0.1854, 0.8], [-0.3527, -0.4854, 0.8], [0.3527, -0.4854, 0.8], [0, 0, 1.0]])
NAMES = tuple("abcde")
LIGHTS = tuple(
    Light(name=name, direction=(float(x), float(y), float(z)), intensity=(0.9,))
    for name, (x, y, z) in zip(NAMES, FIVE, strict=True)
)
LIT = Illumination(directions=FIVE, intensities=np.full((5, 1), 0.9), names=NAMES)
MATRIX = 0.9 * FIVE


def codes_of(light: np.ndarray) -> np.ndarray:
    """The sketch's codes of light, 1 = white."""
    return np.searchsorted(light_of(EVERY_CODE), light).clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize("shape", [(5, 1, 1), (5, 12, 16)], ids=["distant lights", "near lights"])
def test_what_is_left_is_that_of_a_least_squares_fit_of_the_lights_that_show_both(shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(4)
    rest, moved = rng.integers(70, 256, (2, 5, 12, 16), np.uint8)
    moved[:, :4] = rest[:, :4]  # nothing to choose between
    light, least = light_of(EVERY_CODE).astype(np.float64) * np.full((5, 1), 0.8), np.full(5, 0.1)
    left = np.full((3, 12, 16), np.nan, np.float32)
    evening = rng.uniform(0.5, 2, shape).astype(np.float32)
    leave_rows(rest, moved, light, MATRIX, evening, least, np.array([1e-3, 2e-3, 3e-3, 0.05]), 0, 12, left)
    evening = np.broadcast_to(evening, (5, 12, 16))
    told = 0
    for row, col in np.ndindex(12, 16):
        own, theirs = (light[np.arange(5), each[:, row, col]] for each in (rest, moved))
        lit = (own > 0.1) & (theirs > 0.1) & (rest[:, row, col] < CLIPPED) & (moved[:, row, col] < CLIPPED)
        if row < 4 or lit.sum() <= 3:
            assert not left[:, row, col].any()
            continue
        told += 1
        even = evening[lit, row, col]
        variance = np.square(even) * (2e-3 * own[lit] + 3e-3)
        own, theirs = own[lit] * even, theirs[lit] * even
        fits = [np.linalg.lstsq(MATRIX[lit], each) for each in (own, theirs)]
        squares = [np.square(fit[0]).sum().clip(0.05**2) for fit in fits]
        expected = [min(float(fit[1].sum()) / square, 1.0) for fit, square in zip(fits, squares, strict=True)]
        np.testing.assert_allclose(left[:2, row, col], expected, rtol=1e-4, atol=1e-6)
        noise = variance.mean() / squares[0]
        np.testing.assert_allclose(left[2, row, col], (lit.sum() - 3) * (1e-3 + noise), rtol=1e-4)
    assert told > 50


def shown(normals: np.ndarray, *, noise: float = 0.0) -> list[InstantSketch]:
    """What five lights show of one normal per light everywhere, (light, 3), of albedo 0.8."""
    light = np.maximum((0.8 * MATRIX * normals).sum(axis=1), 0)
    return [InstantSketch(codes=np.full((20, 30), codes_of(one), np.uint8), white=1.0, noise=noise) for one in light]


ONE, OTHER = np.array([0.3, 0.2, 0.933]), np.array([-0.3, 0.1, 0.949])
OF_ONE = np.tile(ONE, (5, 1))
OF_BOTH = np.array([ONE, OTHER, ONE, OTHER, ONE])


@pytest.mark.parametrize(
    ("rest", "moved", "stays"),
    [
        pytest.param(OF_ONE, OF_BOTH, True, id="moved plates are of two surfaces"),
        pytest.param(OF_BOTH, OF_ONE, False, id="plates as they are are of two surfaces"),
        pytest.param(OF_ONE, np.tile(OTHER, (5, 1)), False, id="either are of one surface"),
        pytest.param(OF_BOTH, OF_BOTH[[1, 0, 1, 0, 1]], False, id="either are of two"),
    ],
)
def test_plates_stay_where_these_alone_are_of_one_surface(rest: np.ndarray, moved: np.ndarray, stays: bool) -> None:
    lamps = Lamps.of(LIGHTS, NAMES)
    assert lamps is not None
    both = [BothWays(rest=own, moved=other) for own, other in zip(shown(rest), shown(moved), strict=True)]
    assert (fits_as_it_is(lamps, both) == stays).all()


def test_what_noise_may_have_made_is_no_reason() -> None:
    lamps = Lamps.of(LIGHTS, NAMES)
    assert lamps is not None
    for noise, stays in ((0.5, True), (40.0, False)):
        ways = zip(shown(OF_ONE, noise=noise), shown(OF_BOTH, noise=noise), strict=True)
        assert fits_as_it_is(lamps, [BothWays(rest=own, moved=other) for own, other in ways]).all() == stays


def test_one_point_by_itself_does_not_stay() -> None:
    lamps = Lamps.of(LIGHTS, NAMES)
    assert lamps is not None
    rest, both = shown(OF_ONE), []
    for own, other in zip(rest, shown(OF_BOTH), strict=True):
        codes = own.codes.copy()
        codes[10, 15] = other.codes[10, 15]
        both.append(BothWays(rest=own, moved=replace(own, codes=codes)))
    assert not fits_as_it_is(lamps, both).any()


@pytest.mark.parametrize(("unmixing", "lights"), [(None, LIGHTS), ("by colour", ())])
def test_a_run_says_how_its_lights_shine_where_plates_are_of_single_lights(unmixing: Any, lights: Any) -> None:
    rig, plan = (
        Rig(lights=LIGHTS[::-1]),
        SimpleNamespace(lights=NAMES, flashes=[SimpleNamespace(lit=(name,), duration_s=1e-3) for name in NAMES]),
    )
    given: dict[str, Any] = {"timing": None, "delivery": None, "over_time": OverTime(aligning=Aligning(align="flow"))}
    take: Any = SimpleNamespace(unmixing=unmixing, plan=plan)
    job = Job(take=take, lighting=Lighting(rig_path=Path(), rig=rig, condition=1.0), **given)
    assert job.aligning == Aligning(align="flow", lights=lights)


PITCH_S, SWEPT_PX = 0.01, 7.0
FACES = np.array([ONE, OTHER])


def passing(time_s: float, shape: tuple[int, int] = (96, 192)) -> np.ndarray:
    """Which of two bare faces every pixel shows: the edge between them passes, and leans over as it does."""
    rows, cols = np.mgrid[: shape[0], : shape[1]]
    edge = 96 + SWEPT_PX * time_s / PITCH_S * (0.3 + 1.4 * rows / shape[0])
    return np.asarray((cols > edge).astype(np.intp))


def passed(how: Aligning, *, hidden: slice = slice(0, 0)) -> Round:
    """The second of three rounds of five lights and a dark slot, whose middle is at 0 s; nobody saw the ``hidden`` rows
    of its first plate."""
    rng, plates = np.random.default_rng(2), []
    for number in (1, 2, 3):
        for n, (name, row) in enumerate(zip(NAMES, MATRIX, strict=True)):
            time_s = (6 * (number - 2) + n - 2) * PITCH_S
            light = 0.8 * (FACES @ row)[passing(time_s)]
            picture = mixture_of(np.asarray(light + rng.normal(0, 0.002, light.shape), np.float32))
            seen = np.ones(len(light), np.bool_)
            seen[hidden] = number != 2 or name != NAMES[0]
            plates.append(LightPlate(light=name, number=number, time_s=time_s, picture=picture, seen=seen))
    return list(aligned(plates, NAMES, how, first=1))[1]


@pytest.fixture
def everywhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plates as they are fit everywhere."""

    def fits(lamps: Lamps, lights: list[BothWays]) -> np.ndarray:
        assert lamps.names == NAMES
        return np.ones(lights[0].rest.codes.shape, np.bool_)

    monkeypatch.setattr(rounds, "fits_as_it_is", fits)


@pytest.mark.usefixtures("everywhere")
def test_where_plates_fit_as_they_are_these_are_handed_on_and_nothing_moves() -> None:
    moved, left, nearest = (passed(how) for how in (Aligning(), Aligning(lights=LIGHTS), UNALIGNED))
    differ = [np.abs(one.image - own.image).max() for one, own in zip(moved.plates, nearest.plates, strict=True)]
    assert max(differ) > 0.05
    for one, own in zip(left.plates, nearest.plates, strict=True):
        np.testing.assert_allclose(one.image, own.image, atol=1e-4)  # in 16 bits
        assert one.seen.all()
    assert moved.motion is not None
    assert left.motion is not None
    assert moved.motion.moves.any()
    assert not left.motion.moves.any()
    assert not left.motion.velocity.any()


@pytest.mark.usefixtures("everywhere")
def test_a_plate_stays_as_unsure_as_what_passed_makes_it() -> None:
    """Its two plates differ where the edge passed; elsewhere nothing speaks against it."""
    left = passed(Aligning(lights=LIGHTS))
    plates = [[passing((6 * turn + n - 2) * PITCH_S) for turn in ((0, 1) if n < 2 else (-1, 0))] for n in (0, 1, 3, 4)]
    edge = np.any([one != other for one, other in plates], axis=0)
    far = cv2.dilate(edge.astype(np.uint8), np.ones((9, 9), np.uint8)) == 0
    assert left.unsure is not None
    most = left.unsure.max(axis=0)
    assert np.median(most[edge]) > 0.02
    assert np.median(most[far]) < 0.002


@pytest.mark.usefixtures("everywhere")
def test_rows_that_no_frame_saw_of_a_nearer_plate_are_taken_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    hidden = slice(20, 40)
    left = passed(Aligning(lights=LIGHTS), hidden=hidden)
    monkeypatch.setattr(rounds, "fits_as_it_is", lambda _, lights: np.zeros(lights[0].rest.codes.shape, np.bool_))
    moved = passed(Aligning(lights=LIGHTS), hidden=hidden)
    for one, own in zip(left.plates, moved.plates, strict=True):
        np.testing.assert_allclose(one.image[hidden], own.image[hidden], atol=1e-4)
        np.testing.assert_array_equal(one.pixels_seen[hidden], own.pixels_seen[hidden])
    assert any(np.abs(one.image - own.image).max() > 0.05 for one, own in zip(left.plates, moved.plates, strict=True))


def shadowed(lights: str) -> Round:
    """The second of three rounds before a painted wall: to its right half none of these lights comes in the first."""
    rng, plates = np.random.default_rng(3), []
    paint = cv2.GaussianBlur(rng.uniform(0, 1, (96, 192)), (0, 0), 3)
    paint = 0.3 + 0.5 * (paint - paint.min()) / np.ptp(paint)
    for number in (1, 2, 3):
        for n, (name, row) in enumerate(zip(NAMES, MATRIX, strict=True)):
            light = paint * (ONE @ row)
            light[:, 96:] *= number > 1 or name not in lights
            picture = mixture_of(np.asarray(light + rng.normal(0, 0.002, light.shape), np.float32))
            time_s, seen = (6 * (number - 2) + n - 2) * PITCH_S, np.ones(len(light), np.bool_)
            plates.append(LightPlate(light=name, number=number, time_s=time_s, picture=picture, seen=seen))
    return list(aligned(plates, NAMES, Aligning(lights=LIGHTS), first=1))[1]


def test_what_stands_while_a_shadow_passes_is_as_sure_as_without_motion() -> None:
    """Four of five lights show that nothing moved; the fifth's nearer plate was lit."""
    one = shadowed("e")
    assert one.unsure is not None
    inside = (slice(8, -8), slice(104, 184))
    assert one.unsure[:, inside[0], inside[1]].max() < 0.004
    assert np.ptp(one.plates[4].image[inside]) > 0.1
    assert one.plates[4].image[inside].min() > 0.15


def test_what_changes_under_half_of_the_lights_may_have_moved() -> None:
    one = shadowed("de")
    assert one.unsure is not None
    assert np.median(one.unsure[3:, 8:-8, 104:184]) > 0.02


@pytest.mark.parametrize(("lights", "least"), [(3, 3), (4, 3), (5, 4), (8, 6)])
def test_most_lights_and_three_at_least_must_show_that_nothing_moved(lights: int, least: int) -> None:
    unchanged = np.arange(9, dtype=np.int16)[None]
    still, none = np.zeros((1, 9), np.bool_), np.zeros((2, 1, 9), np.float32)
    motion = Followed(time_s=0.0, velocity=none, moves=still, rests=still, unchanged=unchanged)
    assert np.array_equal(stands_under(motion, lights), unchanged >= least)
    assert not stands_under(replace(motion, moves=~still), lights).any()


@pytest.mark.campaign
def test_a_bare_box_that_tumbles_by_8_px_is_nearer_to_the_truth_and_more_of_it_is_trusted() -> None:
    clip = filmed(5, turn(8, ASLANT), noise=0.003, subject=BOX)
    directions = [(float(x), float(y), float(z)) for x, y, z in clip.lit.directions]
    lights = tuple(
        Light(name=name, direction=direction, intensity=(0.9,))
        for name, direction in zip(clip.lit.names, directions, strict=True)
    )
    found = []
    for how in (Aligning(), Aligning(lights=lights)):
        one = clip.shown(how)[1]
        moves = None if one.motion is None else one.motion.moves
        images = [plate.image for plate in one.plates]
        surface = Solving().solve(images, clip.lit, unsure=one.unsure, moves=moves)
        normals, subject = clip.truth(one.time_s)
        off_deg = angles_deg(surface.normals, normals)
        right, wrong = (
            (subject & surface.valid & which).sum() / subject.sum() for which in (off_deg <= 10, off_deg > 10)
        )
        found.append((off_deg[subject].mean(), right, wrong))
    (before_deg, before, _), (after_deg, after, wrong) = found
    assert after_deg < before_deg - 0.7
    assert after > before + 0.04
    assert wrong < 0.03 * after
