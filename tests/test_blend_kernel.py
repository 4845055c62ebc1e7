"""Plates between two others in one compiled pass, against single pixels in plain Python; and packed ones."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.compute.eight_lanes import EIGHT
from psvideo.model.coded import Coded, Tone
from psvideo.plates.align.between import columns_in
from psvideo.plates.align.blend_kernel import ROOM, blend_rows
from psvideo.plates.align.packed import BAND_ROWS, packed
from psvideo.plates.align.side_kernel import BESIDE, CLIPPED, JUST_BELOW, SideArrays
from psvideo.plates.align.velocity.moving_kernel import AFTER, AT_REST, BEFORE, BOTH, NOWHERE
from psvideo.plates.mixing.mixture import Mixture, mixture_of
from psvideo.plates.mixing.several_pictures import combined

ROWS, COLS = 22, 31
COARSE = 11, 16
FIRST, BAND, LEFT, RIGHT = 6, 16, 2, 31
SPANS_S, COUNTS, FULL = (0.4, -0.6), (0.6, 0.4), (0.9, 0.95, 1.0)
Array = NDArray[np.float64]


def _weight(away: float) -> float:
    """Keys' weight of a sample so far away, by its two pieces, with a slope of -0.75."""
    away, slope = abs(away), -0.75
    if away <= 1:
        return (slope + 2) * away**3 - (slope + 3) * away**2 + 1
    return slope * (away**3 - 5 * away**2 + 8 * away - 4) if away < 2 else 0.0


def _within(place: int, count: int) -> int:
    return min(max(place, 0), count - 1)


def _interpolated(light: Array, x: float, y: float) -> Array:
    total = np.zeros(light.shape[2])
    for row in range(math.floor(y) - 1, math.floor(y) + 3):
        for col in range(math.floor(x) - 1, math.floor(x) + 3):
            sample = light[_within(row, len(light)), _within(col, light.shape[1])]
            total += _weight(y - row) * _weight(x - col) * sample
    return total


def _linear(plane: Array, x: float, y: float) -> float:
    x, y = min(max(x, 0), plane.shape[1] - 1), min(max(y, 0), plane.shape[0] - 1)
    near = [(row, col) for row in (math.floor(y), math.ceil(y)) for col in (math.floor(x), math.ceil(x))]
    shares = {place: (1 - abs(place[0] - y)) * (1 - abs(place[1] - x)) for place in near}
    return float(sum(share * plane[place] for place, share in shares.items()))


def _shown(light: Array, marks: NDArray[np.uint8], full: float, x: float, y: float) -> Array:
    row, col = _within(round(y), len(light)), _within(round(x), light.shape[1])
    mark = marks[row, col] if marks.size > 1 else 0
    if mark == CLIPPED:
        return np.full(light.shape[2], full)
    return light[row, col] if mark == BESIDE else np.minimum(_interpolated(light, x, y), full * JUST_BELOW)


def _sources(smooth: bool, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Source and guess: anything everywhere, or areas of one kind, so that pixels beside each other are made alike."""
    sources = rng.integers(0, 5, (2, *COARSE)).astype(np.uint8)
    if smooth:
        sources[:] = np.array([BOTH, BEFORE, AFTER, AT_REST])[np.arange(COARSE[0]) % 4, None]
        sources[0, 4, :4], sources[:, 5, 9:] = NOWHERE, NOWHERE
    return sources


def _velocity(smooth: bool, rng: np.random.Generator) -> NDArray[np.float32]:
    if not smooth:
        return rng.uniform(-12, 12, (2, *COARSE)).astype(np.float32)
    row, col = np.mgrid[: COARSE[0], : COARSE[1]] / 10
    return np.stack([3.1 + 0.9 * col - row, 2.3 - 0.7 * row + 0.8 * col]).astype(np.float32)


def _between_nan(pictures: NDArray[np.float32]) -> list[NDArray[np.float32]]:
    """The same pictures in memory before and behind which nothing may be read."""
    size, around = pictures[0].size, 4 * COLS
    rooms = [np.full(size + 2 * around, np.nan, np.float32) for _ in pictures]
    for room, picture in zip(rooms, pictures, strict=True):
        room[around : around + size] = picture.ravel()
    return [room[around : around + size].reshape(pictures[0].shape) for room in rooms]


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("clips", [False, True])
@pytest.mark.parametrize("all_seen", [False, True])
@pytest.mark.parametrize("smooth", [False, True])
def test_a_band_is_what_single_pixels_make_it(channels: int, clips: bool, all_seen: bool, smooth: bool) -> None:
    rng = np.random.default_rng(8)
    source, guess = _sources(smooth, rng)
    velocities = _velocity(smooth, rng), _velocity(smooth, rng)
    lights = _between_nan(rng.choice([0.02, 0.4, 0.89], (2, ROWS, COLS, channels)).astype(np.float32))
    some = 0.97 if smooth else 0.2
    marks = [rng.choice([0, BESIDE, CLIPPED], (ROWS, COLS), p=[some, *[(1 - some) / 2] * 2]) for _ in lights]
    marks = [one.astype(np.uint8) for one in marks] if clips else [np.zeros((1, 1), np.uint8)] * 2
    seen_in = [np.ones((1, 1), np.bool_), rng.random((ROWS, 1)) < 0.8]
    seen_in = seen_in[:1] * 2 if all_seen else [rng.random((ROWS, COLS)) < (0.98 if smooth else 0.8), seen_in[1]]
    rows_seen, stays = rng.random(BAND) < 0.8, rng.uniform(0, 0.8, (BAND, COLS, channels)).astype(np.float32)
    image, seen = np.full(stays.shape, -1, np.float32), rng.random((BAND, COLS)) < 0.9
    seen_before = seen.copy()
    before, after = (
        SideArrays(lights[n], 0, marks[n], seen_in[n], *(np.float32(own[n]) for own in (SPANS_S, COUNTS, FULL)))
        for n in range(2)
    )
    blend_rows(
        source, guess, *velocities, (ROWS, COLS), FIRST, LEFT, RIGHT, *columns_in(COLS, COARSE[1]),
        np.zeros((ROOM, max(COLS, 3 * EIGHT)), np.float32), before, after, np.float32(FULL[2]), rows_seen, stays,
        image, seen,
    )  # fmt: skip
    assert (image[:, :LEFT] == -1).all()
    assert (image[:, RIGHT:] == -1).all()
    high, wide = ROWS / COARSE[0], COLS / COARSE[1]
    for row in range(BAND):
        for col in range(LEFT, RIGHT):
            coarse_y, coarse_x = (FIRST + row + 0.5) / high, (col + 0.5) / wide
            what, given = (codes[int(coarse_y), int(coarse_x)] for codes in (guess, source))
            counted, known, expected = {}, bool(seen_before[row, col]), stays[row, col].astype(np.float64)
            for n, other in enumerate((AFTER, BEFORE)):
                planes = velocities[n].astype(np.float64)
                go_x, go_y = (_linear(plane, coarse_x - 0.5, coarse_y - 0.5) for plane in planes)
                x, y = col - SPANS_S[n] * go_x * wide, FIRST + row - SPANS_S[n] * go_y * high
                there = seen_in[n][_within(round(y), len(seen_in[n])), _within(round(x), seen_in[n].shape[1])]
                if what not in (other, AT_REST, NOWHERE) and rows_seen[row] and there:
                    counted[n] = _shown(lights[n].astype(np.float64), marks[n], FULL[n], x, y)
            clipped = {n: bool((light >= np.float32(FULL[n])).any()) for n, light in counted.items()}
            if len(counted) == 2 and clipped[0] != clipped[1]:
                counted.pop(1 if COUNTS[0] >= COUNTS[1] else 0)
            if counted:
                total = sum(COUNTS[n] for n in counted)
                expected = np.sum([COUNTS[n] * light / total for n, light in counted.items()], axis=0)
                known = True
                if any(clipped[n] for n in counted):
                    expected = np.full(channels, FULL[2])
            elif what != AT_REST:
                known = False
            np.testing.assert_allclose(image[row, col], expected, atol=3e-5, err_msg=f"{row}, {col}, {what}")
            assert bool(seen[row, col]) == (known and given != NOWHERE), (row, col, what, given)
    assert {AT_REST, BEFORE, AFTER, BOTH, NOWHERE} == {*np.unique(guess)}


def test_nothing_before_or_behind_a_plate_is_read() -> None:
    lights = _between_nan(0.3 * np.random.default_rng(8).random((2, ROWS, COLS, 3), np.float32))
    nothing, everything, one = np.zeros((1, 1), np.uint8), np.ones((1, 1), np.bool_), np.float32(1)
    before, after = (
        SideArrays(light, 0, nothing, everything, np.float32(span_s), np.float32(0.5), one)
        for light, span_s in zip(lights, (1, -1), strict=True)
    )
    source, across = np.full(COARSE, BOTH, np.uint8), np.tile(np.arange(COARSE[1]) / 8, (COARSE[0], 1))
    image, seen = np.full((ROWS, COLS, 3), np.nan, np.float32), np.zeros((ROWS, COLS), np.bool_)
    for down in (-0.1, 0.1):  # of some eight pixels only columns are skipped or come twice
        velocity = np.stack([across, np.full(COARSE, down)]).astype(np.float32)
        blend_rows(
            source, source, velocity, velocity, (ROWS, COLS), 0, 0, COLS, *columns_in(COLS, COARSE[1]),
            np.zeros((ROOM, COLS), np.float32), before, after, one, np.ones(ROWS, np.bool_), image, image, seen,
        )  # fmt: skip
        assert image.max() < 0.45  # what is no number is cut off at 1, of which each plate counts a half
        assert seen.all()


@pytest.mark.parametrize(("least", "most"), [(-0.02, 1.0), (0.0, 0.3), (-3.0, 7.0)])
def test_a_packed_picture_is_good_to_half_a_step_and_black_stays_black(least: float, most: float) -> None:
    image = np.random.default_rng(9).uniform(least, most, (70, 12, 3)).astype(np.float32)
    image[5] = 0
    image[6, 0, 0], image[6, 1, 0] = least, most
    back = packed(mixture_of(image), saturation=100.0).image()
    assert np.abs(back - image).max() <= 0.502 * (most - min(least, 0)) / 65534  # floats round too
    assert (back[5] == 0).all()


def test_a_dark_band_of_a_bright_picture_is_packed_as_finely_as_what_it_shows() -> None:
    image = np.random.default_rng(9).uniform(0, 1, (2 * BAND_ROWS, 12, 3)).astype(np.float32)
    image[BAND_ROWS:] *= 0.01
    small = packed(mixture_of(image), saturation=1.0)
    bright, dark = np.abs(small.image() - image).reshape(2, -1).max(axis=1)
    assert dark < 0.011 * bright
    assert (small.rows(np.array([1, BAND_ROWS + 3])) == small.image()[[1, BAND_ROWS + 3]]).all()
    assert (small.frames[0].light(slice(BAND_ROWS - 1, BAND_ROWS + 2)) == small.image()[BAND_ROWS - 1 :][:3]).all()


def test_pictures_packed_by_bands_are_added_to_those_of_one_level() -> None:
    one, other = np.random.default_rng(9).uniform(0, 0.9, (2, 2 * BAND_ROWS, 12, 3)).astype(np.float32)
    codes = np.asarray(np.rint(other * 1000), np.uint16)
    tone = Tone(zero=np.full((1, 1), 5.0), gain=np.full((1, 1), 1e-3))
    plain = Mixture(frames=(Coded(codes=codes, tone=tone),), coefficients=np.ones((1, len(codes))))
    total = combined([packed(mixture_of(one), saturation=1.0), plain], [0.25, 0.5], ceiling=1.0)
    np.testing.assert_allclose(total.image(), 0.25 * one + 0.5 * plain.image(), atol=2e-5)
