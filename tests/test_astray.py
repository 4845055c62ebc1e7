"""Photographs that are not aligned: told, with how far, and never where the camera stood."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import cv2
import numpy as np
import pytest

from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash, assemble_plan
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Misfit
from psvideo.model.timing import Timing
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.report.judge.of_accuracy import accuracy
from psvideo.report.judge.of_motion import motion
from psvideo.report.judgement import Judgement
from psvideo.report.observe.alignment.astray import Astray, astray
from psvideo.report.observe.alignment.part_places import PartPlaces, places_of_parts
from psvideo.report.observe.close_looks import CloseLooks
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import rig_points

ROWS, COLS = 150, 180


def soft(seed: int, width_px: float, size: tuple[int, int] = (ROWS, COLS)) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(size=size).astype(np.float32)
    blurred = np.asarray(cv2.GaussianBlur(noise, (0, 0), width_px))
    return np.asarray(blurred / blurred.std())


def directions(lights: int) -> np.ndarray:
    around, steep = np.arange(lights) * 2.4, 0.35 + 0.25 * np.arange(lights) / lights
    return np.stack([steep * np.cos(around), steep * np.sin(around), np.sqrt(1 - steep**2)], axis=-1)


def pictures(lights: int, *, shine: float = 0.0, seed: int = 0, size: tuple[int, int] = (ROWS, COLS)) -> np.ndarray:
    """Return a relief of mottled stone under some lights, (light, row, col); ``shine`` is what it mirrors."""
    height = 1.2 * soft(seed, 5.0, size) + 0.15 * soft(seed + 1, 1.5, size)
    normals = np.stack([-np.gradient(height, axis=1), np.gradient(height, axis=0), np.ones_like(height)])
    normals /= np.linalg.norm(normals, axis=0)
    ways = directions(lights)
    halves = ways + np.array([0.0, 0.0, 1.0])
    halves /= np.linalg.norm(halves, axis=1, keepdims=True)
    matte = np.maximum(np.tensordot(ways, normals, 1), 0) * (0.5 + 0.08 * soft(seed + 2, 1.2, size))
    return np.asarray(matte + shine * np.maximum(np.tensordot(halves, normals, 1), 0) ** 30)


def warped(plates: np.ndarray, hows: list[np.ndarray]) -> np.ndarray:
    rows, cols = plates.shape[1:]
    moved = [
        cv2.warpAffine(plate, how, (cols, rows), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT_101)
        for plate, how in zip(plates, hows, strict=True)
    ]
    noise = np.random.default_rng(7).normal(size=plates.shape)
    return np.asarray(np.array(moved) + 0.002 * noise, np.float32)


def shifted(plates: np.ndarray, places_px: np.ndarray) -> np.ndarray:
    return warped(plates, [np.array([[1, 0, across], [0, 1, down]], np.float32) for across, down in places_px])


def turned(plates: np.ndarray, *, turn_deg: np.ndarray | float = 0.0, zoom: np.ndarray | float = 0.0) -> np.ndarray:
    """Return pictures that are turned and enlarged about their middle."""
    rows, cols = plates.shape[1:]
    turns, zooms = np.broadcast_to(turn_deg, len(plates)), np.broadcast_to(zoom, len(plates))
    middle = ((cols - 1) / 2, (rows - 1) / 2)
    ways = zip(turns.tolist(), zooms.tolist(), strict=True)
    return warped(plates, [cv2.getRotationMatrix2D(middle, turn, 1 + zoom) for turn, zoom in ways])


def spread_px(plates: np.ndarray) -> float:
    """Return how far a typical pixel is from the middle."""
    return float(np.hypot(*plates.shape[1:]) / np.sqrt(12))


def plan_of(lights: int, rows: int = ROWS, cols: int = COLS) -> Plan:
    camera = Camera(width_px=cols, height_px=rows, fps=Fraction(1), exposure_s=1.0, readout_s=0.0)
    flashes = [PlannedFlash(lights={f"L{n}": 1.0}, duration_s=0.5) for n in range(lights)]
    return assemble_plan(camera=camera, flashes=flashes, dark_s=None, mode="synced")


def found_in(images: np.ndarray, ways: np.ndarray | None = None) -> Astray | None:
    lights, rows, cols = images.shape
    ways = directions(lights) if ways is None else ways
    rig = Rig(
        lights=tuple(Light(name=f"L{n}", direction=(float(x), float(y), float(z))) for n, (x, y, z) in enumerate(ways))
    )
    plates = [
        LightPlate(light=f"L{n}", number=1001, time_s=float(n), picture=mixture_of(image), seen=np.ones(rows, np.bool_))
        for n, image in enumerate(images)
    ]
    points = rig_points(plan_of(lights, rows, cols), rig, height_px=rows, width_px=cols, channels=1)
    return astray(plates, points, (slice(0, rows), slice(0, cols)))


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


@pytest.mark.parametrize("lights", [6, 12])
@pytest.mark.parametrize("how", ["turn", "zoom"])
def test_a_knocked_tripod_and_a_breathing_lens_are_told_by_how_far_they_turn_and_enlarge(lights: int, how: str) -> None:
    images = pictures(lights)
    off_px = np.random.default_rng(lights).normal(size=lights)  # a typical part moves by so much, and the middle rests
    off_px *= 0.9 / off_px.std()
    zoom = off_px / spread_px(images)
    found = found_in(turned(images, **({"turn_deg": np.degrees(zoom)} if how == "turn" else {"zoom": zoom})))
    assert found is not None
    assert found.shows
    told = (np.radians(found.turn_deg), found.zoom)
    right, other = told if how == "turn" else told[::-1]
    assert right == pytest.approx(zoom.std(), rel=0.25)
    assert other < 0.25 * zoom.std()
    assert found.shift_px < 0.3


def test_one_picture_that_is_turned_is_named() -> None:
    images = pictures(12)
    turn_deg = np.zeros(12)
    turn_deg[7] = np.degrees(1.4 / spread_px(images))
    found = found_in(turned(images, turn_deg=turn_deg))
    assert found is not None
    assert found.shows
    assert found.light == "L7"
    assert found.most_px == pytest.approx(1.4 * 11 / 12, rel=0.25)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("off_px", "shows"), [(0.0, False), (0.3, False), (0.7, True)])
def test_half_a_pixel_of_turn_is_the_border(off_px: float, shows: bool, seed: int) -> None:
    images = pictures(8, seed=10 * seed)
    turn_deg = np.random.default_rng(seed).normal(size=8)
    turn_deg *= np.degrees(off_px / spread_px(images)) / turn_deg.std()
    found = found_in(turned(images, turn_deg=turn_deg))
    assert found is not None
    assert found.shows == shows
    assert shows or found.fits


@pytest.mark.parametrize("off_px", [2.0, 4.0, 10.0])
def test_pictures_that_lie_far_apart_do_not_pass_as_aligned(off_px: float) -> None:
    """Fine detail sees about a pixel: what lies farther off looked as if it lay still."""
    places_px = np.random.default_rng(3).normal(size=(8, 2))
    places_px -= places_px.mean(axis=0)
    places_px *= off_px / np.sqrt((places_px**2).sum(axis=1).mean())
    found = found_in(shifted(pictures(8, size=(600, 700)), places_px))
    assert found is not None
    assert found.shows or not found.fits
    if off_px < 5:
        assert found.shows
        assert 0.6 * off_px < found.typical_px < 1.5 * off_px


def test_what_does_not_fit_together_is_not_called_aligned() -> None:
    """One picture lies so far off that nothing of it is where it should be."""
    places_px = np.zeros((12, 2))
    places_px[4] = 30, -20
    found = found_in(shifted(pictures(12), places_px))
    assert found is not None
    assert not found.fits
    assert found.light_that_fits_least == "L4"


def test_places_that_explain_nothing_are_no_motion(monkeypatch: pytest.MonkeyPatch) -> None:
    """Smooth shapes can feign places that all parts share, and what is left over grows where pictures go there."""
    images = shifted(pictures(8), np.random.default_rng(8).uniform(-1.5, 1.5, (8, 2)))

    def contradicted(*arguments: Any, **options: Any) -> list[PartPlaces]:
        return [replace(one, right=-one.right) for one in places_of_parts(*arguments, **options)]

    found = found_in(images)
    assert found is not None
    assert found.shows
    monkeypatch.setattr("psvideo.report.observe.alignment.astray.places_of_parts", contradicted)
    found = found_in(images)
    assert found is not None
    assert not found.shows


def test_a_turn_shows_where_parts_are_too_unsure_for_a_shift_beside_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two unknowns of four are half as unsure."""
    rng = np.random.default_rng(1)
    away = np.stack(np.meshgrid(np.arange(4), np.arange(4)), axis=-1).reshape(-1, 2) - 1.5
    turns = rng.normal(size=8)
    turns *= 0.7 / np.hypot(*away.T).mean() / turns.std()

    def said(*arguments: object, **options: object) -> list[PartPlaces]:
        found = [
            np.outer(turns, [-y, x]) + noise
            for (x, y), noise in zip(away, 0.7 * rng.normal(size=(16, 8, 2)), strict=True)
        ]
        return [
            PartPlaces(
                middle=middle, found=one, square=np.eye(16), right=one.T.ravel(), left=32.0, agreement=np.ones(8)
            )
            for middle, one in zip(away, found, strict=True)
        ]

    monkeypatch.setattr("psvideo.report.observe.alignment.astray.places_of_parts", said)
    found = found_in(pictures(8))
    assert found is not None
    assert found.typical_px < 2.5 * found.error_px
    assert found.shows


def test_four_lights_do_not_say_where_pictures_lie() -> None:
    assert found_in(shifted(pictures(4), np.zeros((4, 2)))) is None


def judged(found: Astray | None) -> tuple[Judgement, list[Judgement]]:
    observed = Observed(lights=("a", "b"), closely=CloseLooks(astray=[] if found is None else [found]))
    facts = InstantFacts(number=1001, time_s=0.0, valid_share=0.5, clipped_share=0.0, unseen_share=0.0)
    observed.facts.append(replace(facts, misfit=Misfit(share=0.05, error_deg=8.0)))
    timing = Timing(
        clip="c", frame_period_s=1.0, exposure_s=1.0, row_time_s=0.0, clock_offset_ppm=0.0, phase_error_rows=0.0,
        order="given", flashes=(),
    )  # fmt: skip
    return motion(plan_of(2), timing, observed), list(accuracy(observed))


def apart(**what: Any) -> Astray:
    usual = Astray(
        typical_px=0.9, error_px=0.1, shift_px=0.9, turn_deg=0.0, zoom=0.0, radius_px=600.0, light="b", most_px=1.6,
        agreement=0.9, light_that_fits_least="a", shows=True,
    )  # fmt: skip
    return replace(usual, **what)


def test_what_moved_is_a_reservation_with_its_size_and_blamed_for_what_normals_are_off() -> None:
    moved, (off,) = judged(apart())
    assert moved.grade == "doubtful"
    assert "they lie about 0.9 px apart, that of 'b' 1.6 px off" in moved.found
    assert "the pictures are not aligned" in off.found


def test_turns_and_scales_are_told_where_they_make_it() -> None:
    moved, _ = judged(apart(typical_px=1.5, shift_px=0.1, turn_deg=0.14, at_least=True))
    assert "they lie about 1.5 px or more apart, turned by 0.14 degrees, that of 'b'" in moved.found
    moved, _ = judged(apart(typical_px=1.5, shift_px=0.9, zoom=0.002))
    assert "about 1.5 px apart, 0.20 % larger or smaller and shifted by 0.9 px, that of 'b'" in moved.found


def test_what_stood_is_said_where_it_can_be_told() -> None:
    stood, (off,) = judged(apart(typical_px=0.04, error_px=0.02, shows=False))
    assert (stood.grade, stood.found) == ("good", "The pictures are aligned to within 0.1 px.")
    assert "not quite matte" in off.found
    for unsure in (None, apart(error_px=0.6, shows=False)):
        assert judged(unsure)[0].grade == "unknown"
    unlike, _ = judged(apart(typical_px=0.1, agreement=0.4, shows=False))
    assert unlike.grade == "unknown"
    assert "their fine detail does not fit together, that of 'a' least" in unlike.found
