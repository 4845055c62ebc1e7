"""Below 360 degrees: rows that other flashes lend are moved to the instant of the plate that lacks them."""

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import cv2
import numpy as np
import pytest

from psvideo.model.arrays import Flags, Floats
from psvideo.model.camera import Camera
from psvideo.plates.align.lent.bringing import Bringing
from psvideo.plates.align.lent.brought import LentRows, brought
from psvideo.plates.align.lent.row_sightings import motion_by_rows, row_pair
from psvideo.plates.align.velocity.flow import Sketch, sketch_of
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.nearest_rows import MOST_LATER, waits_for, with_nearest_rows

ROWS, COLS, LIGHTS, SLOTS = 120, 160, ("a", "b", "c", "d"), 5
RIGHT, DOWN = 6.0, 2.0
"""How far the painted thing goes in a round, in pixels."""
PAINT = cv2.GaussianBlur(np.random.default_rng(1).normal(size=(ROWS * 2, COLS * 2)).astype(np.float32), (0, 0), 3)


def _inside(time: float) -> Flags:
    y, x = np.mgrid[:ROWS, :COLS]
    return np.asarray((np.abs(x - 70 - RIGHT * time) < 40) & (np.abs(y - 60 - DOWN * time) < 40))


def _scene(light: int, time: float, speed: float = 1.0) -> Floats:
    """A painted square that slides before an even wall, ``time`` in rounds."""
    y, x = np.mgrid[:ROWS, :COLS].astype(np.float32)
    way = (np.float32(one * time * speed) for one in (RIGHT, DOWN))
    paint = cv2.remap(PAINT, x - next(way) + 60, y - next(way) + 60, cv2.INTER_CUBIC)
    thing = 0.35 + 0.1 * light / len(LIGHTS) + 0.08 * paint / PAINT.std()
    return np.asarray(np.where(_inside(time * speed), thing, 0.15), np.float32)


def _seen(number: int, light: int) -> Flags:
    """Half of the rows, which roll from flash to flash."""
    first = int((number * 0.21 + light * 0.55) % 1 * ROWS)
    return np.isin(np.arange(ROWS), (first + np.arange(ROWS // 2)) % ROWS)


def _plate(number: int, light: int, speed: float = 1.0) -> LightPlate:
    time, seen = number + light / SLOTS, _seen(number, light)
    image = _scene(light, time, speed) * seen[:, None]
    return LightPlate(light=LIGHTS[light], number=number, time_s=time, picture=mixture_of(image), seen=seen)


def _film(speed: float, rounds: int = 8) -> list[LightPlate]:
    return [_plate(number, light, speed) for number in range(rounds) for light in range(len(LIGHTS))]


def _sketches(plates: Sequence[LightPlate]) -> dict[str, list[Sketch]]:
    return {light: [sketch_of(one, white=0.8) for one in plates if one.light == light] for light in LIGHTS}


def test_every_row_knows_when_it_was_seen_last_and_next() -> None:
    shots = _sketches(_film(1.0))["a"]
    found = row_pair(shots, 4.1)
    assert found is not None
    for row in range(0, ROWS, 7):
        seen = np.array([number for number in range(8) if _seen(number, 0)[row]])
        before, after = seen[seen <= 4.1], seen[seen > 4.1]
        two = (before[-1], after[0]) if len(before) and len(after) else (before[-2:] if len(before) else after[:2])
        assert found.spans_s[:, row] == pytest.approx([4.1 - two[0], two[1] - 4.1], abs=1e-5), row
        np.testing.assert_array_equal(found.pair.before.codes[row], shots[two[0]].codes[row])


def test_rows_that_no_two_flashes_showed_say_nothing() -> None:
    shots = [one for one in _sketches(_film(1.0))["a"] if one.number in (3, 4)]
    found = row_pair(shots, 3.5)
    assert found is not None
    twice = _seen(3, 0) & _seen(4, 0)
    assert (found.spans_s.any(axis=0) == twice).all()
    assert (found.pair.before.codes == found.pair.after.codes)[~twice].all()
    assert row_pair(shots[:1], 3.5) is None


def test_motion_is_found_between_rows_of_different_flashes() -> None:
    motion = motion_by_rows(_sketches(_film(1.0)), 3.9, None)
    assert motion is not None
    inner = cv2.erode(_inside(3.9).astype(np.uint8), np.ones((25, 25))) > 0
    assert motion.moves[inner].mean() > 0.9
    right, down = (np.median(plane[inner & motion.moves]) for plane in motion.velocity)
    assert (right, down) == pytest.approx((RIGHT, DOWN), abs=0.3)


def test_nothing_moves_in_a_scene_that_stands() -> None:
    assert motion_by_rows(_sketches(_film(0.0)), 3.9, None) is None


def _true_motion(time: float) -> Followed:
    moves = _inside(time)
    velocity = np.stack([moves * np.float32(RIGHT), moves * np.float32(DOWN)])
    return Followed(time_s=time, velocity=velocity.astype(np.float32), moves=moves, rests=~moves)


def _whole_round(number: int, light: int) -> tuple[LightPlate, list[LentRows]]:
    """A plate, with the rows that it lacks as they are of the round before, and what the rounds beside it lend."""
    own, before, after = (_plate(one, light) for one in (number, number - 1, number + 1))
    image = np.where(own.seen[:, None], own.image, _scene(light, before.time_s))
    shown_s = np.where(own.seen, own.time_s, before.time_s)
    lent = [LentRows(image=_scene(light, one.time_s), first=0, time_s=one.time_s) for one in (before, after)]
    return replace(own, picture=mixture_of(image), seen=np.ones(ROWS, np.bool_), shown_s=shown_s), lent


def test_lent_rows_show_the_instant_of_the_plate_that_lacks_them() -> None:
    plate, lent = _whole_round(3, 1)
    as_it_was = plate.image.copy()
    own = _seen(3, 1)
    made = brought(plate, own, lent, _true_motion(3.4), reach_s=5.0)
    truth, sure = _scene(1, plate.time_s), cv2.erode(_inside(plate.time_s).astype(np.uint8), np.ones((9, 9))) > 0
    np.testing.assert_array_equal(made.image[own], as_it_was[own])
    assert np.abs(made.image - truth)[sure].max() < 0.01 < np.abs(as_it_was - truth)[sure].max()
    wall = ~cv2.dilate(_inside(plate.time_s).astype(np.uint8), np.ones((5, 5))).astype(bool)
    assert np.abs(made.image - truth)[wall & made.pixels_seen].max() < 0.01  # no ghost of what went on
    assert made.brought
    assert made.own.mean() > 0.95


def test_what_no_flash_shows_is_not_seen() -> None:
    plate, lent = _whole_round(3, 1)
    made = brought(plate, _seen(3, 1), [replace(one, time_s=one.time_s + 50) for one in lent], _true_motion(3.2), 5.0)
    lacks = ~_seen(3, 1)[:, None] & cv2.erode(_inside(plate.time_s).astype(np.uint8), np.ones((9, 9))).astype(bool)
    assert not made.pixels_seen[lacks].any()
    assert made.rows_seen.all()


@pytest.mark.parametrize("waits", [2, 4])
def test_where_nothing_moves_rows_are_lent_as_they_are(waits: int) -> None:
    plates = _film(0.0, rounds=12)
    bringing = Bringing(lights=LIGHTS, waits=waits)
    found, expected = list(with_nearest_rows(plates, bringing)), list(with_nearest_rows(plates))
    assert [(one.light, one.number) for one in found] == [(one.light, one.number) for one in expected]
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one.image, other.image)
        np.testing.assert_array_equal(one.flashed_s, other.flashed_s)
        assert not one.brought


def test_plates_of_what_moves_come_out_at_their_own_instants() -> None:
    found = list(with_nearest_rows(_film(1.0, rounds=9), Bringing(lights=LIGHTS, waits=2)))
    off, off_as_they_are = [], []
    for one, other in zip(found, with_nearest_rows(_film(1.0, rounds=9)), strict=True):
        if one.number in (4, 5):
            truth = _scene(LIGHTS.index(one.light), one.time_s)
            sure = (cv2.erode(_inside(one.time_s).astype(np.uint8), np.ones((9, 9))) > 0) & one.pixels_seen
            off.append(np.abs(one.image - truth)[sure].mean())
            off_as_they_are.append(np.abs(other.image - truth)[sure].mean())
    assert np.mean(off) < 0.25 * np.mean(off_as_they_are)


def test_a_flash_that_no_row_saw_lends_nothing_and_gets_all() -> None:
    plates = _film(1.0)
    none = np.zeros(ROWS, np.bool_)
    plates[13] = replace(plates[13], seen=none, picture=mixture_of(np.zeros((ROWS, COLS), np.float32)))
    found = list(with_nearest_rows(plates, Bringing(lights=LIGHTS, waits=2)))
    assert len(found) == len(plates)
    assert found[13].rows_seen.all()
    assert found[13].brought


@pytest.mark.parametrize(("shutter", "waits"), [(0.9, 2), (0.5, 2), (0.25, 4), (0.02, MOST_LATER)])
def test_a_plate_waits_until_every_row_saw_its_light(shutter: float, waits: int) -> None:
    camera = Camera(width_px=1, height_px=1, fps=Fraction(100), exposure_s=shutter * 0.01, readout_s=0.0)
    assert waits_for(camera) == waits
