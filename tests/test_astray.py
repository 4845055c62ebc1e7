"""Photographs that are not aligned: told, with how far, and never where the camera stood."""

from dataclasses import replace
from fractions import Fraction

import cv2
import numpy as np
import pytest

from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash, assemble_plan
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Misfit
from psvideo.model.timing import Timing
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import made
from psvideo.report.judge.of_motion import motion
from psvideo.report.judge.result import accuracy
from psvideo.report.judgement import Judgement
from psvideo.report.observe.astray import Astray, astray
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import rig_points

ROWS, COLS = 150, 180
WHOLE = (slice(0, ROWS), slice(0, COLS))


def soft(seed: int, width_px: float) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(size=(ROWS, COLS)).astype(np.float32)
    blurred = np.asarray(cv2.GaussianBlur(noise, (0, 0), width_px))
    return np.asarray(blurred / blurred.std())


def directions(lights: int) -> np.ndarray:
    around, steep = np.arange(lights) * 2.4, 0.35 + 0.25 * np.arange(lights) / lights
    return np.stack([steep * np.cos(around), steep * np.sin(around), np.sqrt(1 - steep**2)], axis=-1)


def pictures(lights: int, *, shine: float = 0.0, seed: int = 0) -> np.ndarray:
    """Return a relief of mottled stone under some lights, (light, row, col); ``shine`` is what it mirrors."""
    height = 1.2 * soft(seed, 5.0) + 0.15 * soft(seed + 1, 1.5)
    normals = np.stack([-np.gradient(height, axis=1), np.gradient(height, axis=0), np.ones_like(height)])
    normals /= np.linalg.norm(normals, axis=0)
    ways = directions(lights)
    halves = ways + np.array([0.0, 0.0, 1.0])
    halves /= np.linalg.norm(halves, axis=1, keepdims=True)
    matte = np.maximum(np.tensordot(ways, normals, 1), 0) * (0.5 + 0.08 * soft(seed + 2, 1.2))
    return np.asarray(matte + shine * np.maximum(np.tensordot(halves, normals, 1), 0) ** 30)


def shifted(plates: np.ndarray, places_px: np.ndarray) -> np.ndarray:
    moved = []
    for plate, (across, down) in zip(plates, places_px, strict=True):
        how = np.array([[1, 0, across], [0, 1, down]], np.float32)
        moved.append(cv2.warpAffine(plate, how, (COLS, ROWS), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101))
    noise = np.random.default_rng(7).normal(size=plates.shape)
    return np.asarray(np.array(moved) + 0.002 * noise, np.float32)


def plan_of(lights: int) -> Plan:
    camera = Camera(width_px=COLS, height_px=ROWS, fps=Fraction(1), exposure_s=1.0, readout_s=0.0)
    flashes = [PlannedFlash(lights={f"L{n}": 1.0}, duration_s=0.5) for n in range(lights)]
    return assemble_plan(camera=camera, flashes=flashes, dark_s=None, mode="synced")


def found_in(images: np.ndarray, ways: np.ndarray | None = None) -> Astray | None:
    lights = len(images)
    ways = directions(lights) if ways is None else ways
    rig = Rig(
        lights=tuple(Light(name=f"L{n}", direction=(float(x), float(y), float(z))) for n, (x, y, z) in enumerate(ways))
    )
    plates = [
        LightPlate(light=f"L{n}", number=1001, time_s=float(n), picture=made(image), seen=np.ones(ROWS, np.bool_))
        for n, image in enumerate(images)
    ]
    points = rig_points(plan_of(lights), rig, height_px=ROWS, width_px=COLS, channels=1)
    return astray(plates, points, WHOLE)


@pytest.mark.parametrize("lights", [6, 12, 30])
def test_a_camera_that_was_touched_is_told_by_how_far_it_moved(lights: int) -> None:
    places_px = np.random.default_rng(lights).uniform(-1.5, 1.5, (lights, 2))
    found = found_in(shifted(pictures(lights), places_px))
    assert found is not None
    true_px = np.hypot(*(places_px - places_px.mean(axis=0)).T)
    assert found.shows
    assert found.typical_px == pytest.approx(np.sqrt((true_px**2).mean()), rel=0.25)


def test_the_picture_that_lies_farthest_off_is_named() -> None:
    places_px = np.zeros((8, 2))
    places_px[5] = 1.2, -0.5
    found = found_in(shifted(pictures(8), places_px))
    assert found is not None
    assert found.light == "L5"
    assert found.most_px == pytest.approx(1.3 * 7 / 8, rel=0.2)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("shine", [0.0, 0.4])
def test_a_camera_that_stood_is_not_accused_whatever_shines_or_is_wrong_of_the_rig(shine: float, seed: int) -> None:
    images = shifted(pictures(8, shine=shine, seed=seed), np.zeros((8, 2)))
    ways = directions(8)
    exchanged = ways[[1, 0, 2, 3, 4, 5, 7, 6]]
    for rig in (ways, ways * [1, -1, 1], exchanged):
        found = found_in(images, rig)
        assert found is None or not found.shows
    found = found_in(np.sqrt(np.maximum(images, 0)))
    assert found is None or not found.shows


def test_four_lights_do_not_say_where_pictures_lie() -> None:
    assert found_in(shifted(pictures(4), np.zeros((4, 2)))) is None


def judged(found: Astray | None) -> tuple[Judgement, list[Judgement]]:
    observed = Observed(lights=("a", "b"), astray=[] if found is None else [found])
    facts = InstantFacts(number=1001, time_s=0.0, valid_share=0.5, clipped_share=0.0, unseen_share=0.0)
    observed.facts.append(replace(facts, misfit=Misfit(share=0.05, error_deg=8.0)))
    timing = Timing(
        clip="c", frame_period_s=1.0, exposure_s=1.0, row_time_s=0.0, clock_offset_ppm=0.0, phase_error_rows=0.0,
        order="given", flashes=(),
    )  # fmt: skip
    return motion(plan_of(2), timing, observed), list(accuracy(observed))


def test_what_moved_is_a_reservation_with_its_size_and_blamed_for_what_normals_are_off() -> None:
    moved, (off,) = judged(Astray(typical_px=0.9, error_px=0.1, light="b", most_px=1.6))
    assert moved.grade == "doubtful"
    assert "lie about 0.9 px apart, that of 'b' 1.6" in moved.found
    assert "the pictures are not aligned" in off.found


def test_what_stood_is_said_where_it_can_be_told() -> None:
    stood, (off,) = judged(Astray(typical_px=0.04, error_px=0.02, light="b", most_px=0.1))
    assert (stood.grade, stood.found) == ("good", "The pictures are aligned to within 0.1 px.")
    assert "not quite matte" in off.found
    for unsure in (None, Astray(typical_px=0.9, error_px=0.5, light="b", most_px=1.6)):
        assert judged(unsure)[0].grade == "unknown"
