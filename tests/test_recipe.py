"""Recipes on paper: what of which frame's rows makes up a plate, for any shutter, readout and pulse."""

import time
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from psvideo.model.arrays import Doubles
from psvideo.model.camera import Camera
from psvideo.model.rows.recipe import FlashRecipe, flash_recipe, frames_of
from psvideo.model.timing import Flash, Timing
from psvideo.synth.lamps.emission import Emission

PERIOD_S, ROWS, FRAMES = 0.01, 37, 14


def camera_of(*, shutter: float = 1.0, readout: float = 0.97) -> Camera:
    return Camera(
        width_px=1, height_px=ROWS, fps=Fraction(100), exposure_s=shutter * PERIOD_S, readout_s=readout * PERIOD_S
    )


def timing_of(
    camera: Camera,
    *,
    gap: float = 1.0,
    first_s: float = 0.004,
    rise_s: float = 0.0,
    fall_s: float = 0.0,
    dark: int = 3,
    count: int = 8,
) -> Timing:
    """Eight flashes of 0.8 ms, or ``count``, of which every fourth is dark."""
    every_s = gap * camera.exposure_s + 0.0008
    flashes = tuple(
        Flash(
            index=n, slot=n % 4, lights={} if n % 4 == dark else {f"light{n % 4}": 1.0},
            start_s=first_s + n * every_s, duration_s=0.0008, complete=True,
        )
        for n in range(count)
    )  # fmt: skip
    return Timing(
        clip="", frame_period_s=PERIOD_S, exposure_s=camera.exposure_s, row_time_s=camera.row_time_s,
        clock_offset_ppm=0, phase_error_rows=0, order="given", flashes=flashes, rise_s=rise_s, fall_s=fall_s,
    )  # fmt: skip


def frames_seen(camera: Camera, timing: Timing, plates: Doubles, ambient: Doubles) -> Doubles:
    """What a camera records (frame, row), from the virtual lights' own emission and no code that is under test."""
    emission = Emission(rise_s=timing.rise_s, fall_s=timing.fall_s)
    opens_s = np.arange(FRAMES)[:, None] * PERIOD_S + camera.row_offsets_s()
    seen = np.tile(ambient, (FRAMES, 1))
    for flash, plate in zip(timing.flashes, plates, strict=True):
        closed = emission.share(opens_s + camera.exposure_s - flash.start_s, flash.duration_s)
        seen = seen + (closed - emission.share(opens_s - flash.start_s, flash.duration_s)) * plate
    return seen


def made(recipe: FlashRecipe, frames: Doubles) -> Doubles:
    total: Doubles = np.sum([c * frames[n] for n, c in zip(recipe.frames, recipe.coefficients, strict=True)], axis=0)
    return total


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    first=st.floats(0.012, 0.04),
    readout=st.floats(-1.0, 1.0),
    rise=st.sampled_from([0.0, 2e-5, 8e-5]),
    fall=st.sampled_from([0.0, 2.5e-5, 6e-5, 2e-4]),
    gap=st.floats(1.0, 1.05),
)
def test_a_plate_is_its_flash_alone_and_the_ambient_light_of_its_exposures(
    first: float, readout: float, rise: float, fall: float, gap: float
) -> None:
    camera = camera_of(readout=readout)
    timing = timing_of(camera, gap=gap, first_s=first, rise_s=rise, fall_s=fall)
    random = np.random.default_rng(1)
    plates, ambient = random.uniform(0.2, 1.0, (8, ROWS)), random.uniform(0.0, 0.3, ROWS)
    plates[[3, 7]] = 0.0
    frames = frames_seen(camera, timing, plates, ambient)
    for flash in timing.flashes[1:6]:
        recipe = flash_recipe(camera, timing, flash, range(FRAMES))
        assert recipe.seen.all()
        wanted = plates[flash.index] + recipe.exposures * ambient
        # what a tail gives off after nine fall times, and in a neighbour's neighbour, is left
        np.testing.assert_allclose(made(recipe, frames), wanted, atol=1e-9 if fall == 0 else 3e-5)


def test_one_frame_alone_where_it_holds_the_whole_row_and_the_plain_sum_where_two_share_it() -> None:
    camera, timing = camera_of(), timing_of(camera_of())
    recipe = flash_recipe(camera, timing, timing.flashes[1], range(FRAMES))
    used = (recipe.coefficients > 0).sum(axis=0)
    assert set(used) == {1, 2}
    np.testing.assert_allclose(recipe.coefficients[recipe.coefficients > 0], 1.0, atol=1e-9)
    np.testing.assert_allclose(recipe.exposures, used)


def test_black_level_cancels_with_the_ambient_light_of_as_many_exposures() -> None:
    camera, timing = camera_of(), timing_of(camera_of(), fall_s=6e-5, rise_s=2e-5)
    lit, dark = (flash_recipe(camera, timing, timing.flashes[n], range(FRAMES)) for n in (2, 3))
    frames = np.full((FRAMES, ROWS), 0.37)
    np.testing.assert_allclose(made(lit, frames) - lit.exposures * made(dark, frames) / dark.exposures, 0, atol=1e-12)


def test_tails_take_small_negative_shares_of_the_neighbours_frames() -> None:
    camera, timing = camera_of(), timing_of(camera_of(), fall_s=6e-5, rise_s=2e-5)
    recipe = flash_recipe(camera, timing, timing.flashes[1], range(FRAMES))
    assert -0.2 < recipe.coefficients.min() < 0
    assert (recipe.coefficients < 0).any(axis=0).mean() < 0.2


@pytest.mark.parametrize("fall_s", [0.0, 6e-5])
def test_rows_that_two_flashes_lit_are_taken_apart_where_the_dark_time_is_a_little_short(fall_s: float) -> None:
    camera, random = camera_of(), np.random.default_rng(2)
    timing = timing_of(camera, gap=0.99, fall_s=fall_s, dark=9)
    plates, ambient = random.uniform(0.2, 1.0, (8, ROWS)), np.zeros(ROWS)
    frames = frames_seen(camera, timing, plates, ambient)
    recipe = flash_recipe(camera, timing, timing.flashes[3], range(FRAMES))
    assert recipe.seen.mean() > 0.9
    np.testing.assert_allclose(made(recipe, frames)[recipe.seen], plates[3][recipe.seen], atol=2e-3)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(shutter=st.floats(0.2, 0.95), first=st.floats(0.0, 0.02))
def test_below_360_degrees_what_is_seen_is_whole_and_what_is_not_is_said_to_be(shutter: float, first: float) -> None:
    camera, random = camera_of(shutter=shutter), np.random.default_rng(3)
    timing = timing_of(camera, first_s=first)
    plates = random.uniform(0.2, 1.0, (8, ROWS))
    frames = frames_seen(camera, timing, plates, np.zeros(ROWS))
    for flash in timing.flashes[1:5]:
        if flash.is_dark:
            continue
        recipe = flash_recipe(camera, timing, flash, range(FRAMES))
        np.testing.assert_allclose(made(recipe, frames)[recipe.seen], plates[flash.index][recipe.seen], atol=1e-9)
        assert not made(recipe, frames)[~recipe.seen].any()


@settings(max_examples=60, deadline=None, derandomize=True)
@given(gap=st.floats(0.5, 1.0), first=st.floats(0.012, 0.04), fall=st.sampled_from([0.0, 6e-5]))
def test_however_short_the_dark_time_what_is_called_seen_is_the_flash_alone(
    gap: float, first: float, fall: float
) -> None:
    camera, random = camera_of(), np.random.default_rng(4)
    timing = timing_of(camera, gap=gap, first_s=first, fall_s=fall, dark=9)
    plates = random.uniform(0.2, 1.0, (8, ROWS))
    frames = frames_seen(camera, timing, plates, np.zeros(ROWS))
    for flash in timing.flashes[2:6]:
        recipe = flash_recipe(camera, timing, flash, range(FRAMES))
        found = made(recipe, frames)
        np.testing.assert_allclose(found[recipe.seen], plates[flash.index][recipe.seen], atol=2e-2)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    first=st.floats(0.012, 0.03),
    shutter=st.sampled_from([1.0, 0.9, 0.5]),
    gap=st.sampled_from([0.95, 1.0, 1.1]),
    fall=st.floats(2.5e-4, 5e-3),
    missing=st.sampled_from([(), (5,), (4, 7)]),
)
def test_however_long_the_tails_what_is_called_seen_is_the_flash_alone(
    first: float, shutter: float, gap: float, fall: float, missing: tuple[int, ...]
) -> None:
    """Frames that saw next to nothing of a flash once brought whole other flashes into its plate."""
    camera, random = camera_of(shutter=shutter), np.random.default_rng(5)
    timing = timing_of(camera, gap=gap, first_s=first, fall_s=fall, dark=9)
    plates = random.uniform(0.2, 1.0, (8, ROWS))
    frames, there = frames_seen(camera, timing, plates, np.zeros(ROWS)), frozenset(range(FRAMES)) - set(missing)
    for flash in timing.flashes[2:6]:
        recipe = flash_recipe(camera, timing, flash, there)
        found = made(recipe, frames) if recipe.frames else np.zeros(ROWS)
        np.testing.assert_allclose(found[recipe.seen], plates[flash.index][recipe.seen], atol=3e-2)


def test_tails_of_most_of_a_flash_hide_no_row_of_a_camera_that_is_always_open() -> None:
    camera = camera_of()
    timing = timing_of(camera, fall_s=7e-4)
    assert all(flash_recipe(camera, timing, flash, range(FRAMES)).seen.all() for flash in timing.flashes[2:6])


def test_frames_that_saw_next_to_nothing_of_a_flash_add_no_noise_to_its_plate() -> None:
    """Two frames share a row's flash; a third, which saw a millionth of it, added as much noise as either."""
    camera = camera_of()
    timing = timing_of(camera, gap=1.3, fall_s=7e-4)
    for flash in timing.flashes[2:6]:
        recipe = flash_recipe(camera, timing, flash, range(FRAMES))
        assert (recipe.coefficients**2).sum(axis=0).max() < 2.1


def test_a_neighbour_whose_frames_are_missing_hides_the_rows_that_it_reaches_into() -> None:
    camera, timing = camera_of(), timing_of(camera_of(), gap=0.97, dark=9)
    flash = timing.flashes[3]
    whole = flash_recipe(camera, timing, flash, range(FRAMES))
    assert min(whole.frames) in frames_of(camera, timing, flash)
    cut = flash_recipe(camera, timing, flash, range(max(whole.frames), FRAMES))
    assert cut.seen.sum() < whole.seen.sum()


def test_a_recipe_of_a_take_of_two_hours_costs_what_one_of_a_second_does() -> None:
    camera, worked_s = camera_of(), {}
    for count in (80, 80_000):
        timing = timing_of(camera, gap=1.01, count=count)
        flash_recipe(camera, timing, timing.flashes[4], range(FRAMES))
        began_s = time.process_time()
        for flash in timing.flashes[4:64]:
            flash_recipe(camera, timing, flash, frames_of(camera, timing, flash))
        worked_s[count] = time.process_time() - began_s
    assert worked_s[80_000] < 5 * worked_s[80]
