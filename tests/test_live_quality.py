"""How large the live picture is: by measured times alone, on machines that are simulated second by second."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from psvideo.live.incoming.behind import Behind
from psvideo.live.showing.quality import (
    CALM,
    LONGEST_CALM,
    MOST_AGE_S,
    MOST_RATE,
    LiveSecond,
    Quality,
    first_quality,
)
from psvideo.live.showing.smaller import Smaller
from psvideo.model.coded import Coded, Tone

ROUNDS_PER_S = 22.0
CAMERA_PX = 1280 * 720


def machine(result_s: float, each_s: float, *, load: float = 1.0) -> Callable[[int], LiveSecond]:
    """What is measured where a result takes so long, and each megapixel of it so much longer, times ``load``."""

    def second(step: int) -> LiveSecond:
        made_s = load * (result_s + each_s * 1e-6 * CAMERA_PX / step**2)
        made_age_s = made_s + 0.01
        return LiveSecond(
            age_s=made_age_s + 0.3 * made_s + 0.016,
            made_age_s=made_age_s,
            made_s=made_s,
            rate=min(MOST_RATE, ROUNDS_PER_S, 1 / made_s),
            rounds_per_s=ROUNDS_PER_S,
        )

    return second


def steps_over(quality: Quality, seconds: int, on: Callable[[int], LiveSecond]) -> tuple[Quality, list[int]]:
    """The quality after so many seconds on a machine, and the steps on the way."""
    steps = [quality.step]
    for _ in range(seconds):
        quality = quality.after_second(on(quality.step))
        steps.append(quality.step)
    return quality, steps


def changes(steps: list[int]) -> int:
    return sum(one != other for one, other in pairwise(steps))


def test_a_picture_made_small_while_things_were_loaded_is_large_again_once_there_is_time() -> None:
    at_first = first_quality(1280, 720, mosaic=True)
    assert at_first.step == 2
    small, _ = steps_over(at_first, 8, machine(0.002, 0.1, load=20))
    assert small.step >= 4
    large, steps = steps_over(small, 25, machine(0.002, 0.1))
    assert large.step == 2, "25 ms for a result leave time to spare"
    assert steps == sorted(steps, reverse=True), "and no size is left again"
    assert changes(steps_over(large, 600, machine(0.002, 0.1))[1]) == 0


@pytest.mark.parametrize("each_s", np.geomspace(0.02, 3, 25))
@pytest.mark.parametrize("result_s", [0.0, 0.01, 0.03])
@pytest.mark.parametrize("first", [1, 8])
def test_a_machine_that_does_not_change_sees_one_size_that_leaves_time(
    result_s: float, each_s: float, first: int
) -> None:
    on = machine(result_s, each_s)
    settled, _ = steps_over(Quality(step=first), 120, on)
    later, steps = steps_over(settled, 600, on)
    assert changes(steps) == 0
    assert not on(later.step).is_late or later.step == 8
    if later.step > 1:
        finer = later.steps[later.steps.index(later.step) - 1]
        assert on(finer).busy > 0.4 or on(finer).age_s > 0.5 * MOST_AGE_S, "it is not smaller than it has to be"


def test_a_growth_that_never_holds_is_tried_more_and_more_seldom() -> None:
    def on(step: int) -> LiveSecond:
        """Costs that the smaller sizes do not show: the larger one does not fit into some cache."""
        return machine(0.01, 0.05, load=4.0 if step < 4 else 1.0)(step)

    _, steps = steps_over(Quality(step=4), 1200, on)
    doubled = int(np.log2(LONGEST_CALM / CALM)) + 1
    assert 2 < changes(steps) < 2 * (doubled + 1200 / LONGEST_CALM)
    ten = steps[600:]
    assert np.mean(np.array(ten) == 4) > 0.95


def test_a_minute_of_other_work_costs_size_for_that_minute() -> None:
    before, _ = steps_over(Quality(step=2), 60, machine(0.002, 0.1))
    busy, steps = steps_over(before, 60, machine(0.002, 0.1, load=5))
    assert busy.step > 2
    assert changes(steps) <= 3
    after, steps = steps_over(busy, 30, machine(0.002, 0.1))
    assert after.step == 2


def test_viewers_who_are_late_whatever_they_are_sent_do_not_make_the_picture_small() -> None:
    """A browser without a graphics card beside other work: what takes it long is its own window."""

    def on(step: int) -> LiveSecond:
        made = machine(0.002, 0.1)(step)
        return replace(made, age_s=made.made_age_s + 0.25)

    _, steps = steps_over(first_quality(1280, 720, mosaic=True), 600, on)
    assert max(steps) == 3
    assert np.mean(np.array(steps) == 2) > 0.9


def test_viewers_who_draw_small_pictures_sooner_get_small_ones() -> None:
    def on(step: int) -> LiveSecond:
        made = machine(0.002, 0.1)(step)
        return replace(made, age_s=made.made_age_s + 1.2 / step**2)

    small, _ = steps_over(first_quality(1280, 720, mosaic=True), 60, on)
    assert on(small.step).age_s < MOST_AGE_S
    assert changes(steps_over(small, 600, on)[1]) <= 2 * 600 / LONGEST_CALM + 2


def test_one_bad_second_changes_nothing() -> None:
    calm, _ = steps_over(Quality(step=2), 10, machine(0.002, 0.1))
    assert calm.after_second(machine(0.002, 0.1, load=30)(2)).after_second(machine(0.002, 0.1)(2)).step == 2


def test_frames_that_wait_make_the_picture_smaller_before_the_camera_drops_any() -> None:
    quick = machine(0.001, 0.05)
    slow = first_quality(1280, 720, mosaic=True)
    behind = Behind(period_s=1 / 120)
    at_s, index = 0.0, 0
    for second in range(12):
        late = 1.0 if second < 6 else 1.2  # frames take a fifth longer than they may
        for _ in range(int(120 / late)):
            at_s += late / 120
            behind.take(index, at_s)
            index += 1
        measured = quick(slow.step)
        slow = slow.after_second(replace(measured, behind_s=behind.second_s()))
        if slow.step > 2:
            break
    assert 6 <= second <= 8, "a camera holds half a second of frames, and 0.2 s more wait after each"


def test_a_source_that_stood_still_is_not_behind() -> None:
    behind = Behind(period_s=0.01)
    for index in range(100):
        behind.take(index, 0.01 * index)
    assert behind.second_s() == 0
    for index in range(100, 200):
        behind.take(index, 5 + 0.01 * index)
    assert behind.second_s() == 0
    assert behind.second_s() == 0, "no frame came"


def test_few_results_because_rounds_had_holes_do_not_make_the_picture_smaller() -> None:
    few = LiveSecond(age_s=0.05, made_age_s=0.03, made_s=0.02, rate=4.0, rounds_per_s=ROUNDS_PER_S)
    assert not few.is_late
    assert LiveSecond(age_s=0.19, made_age_s=0.15, made_s=0.14, rate=7.0, rounds_per_s=ROUNDS_PER_S).is_late


def test_a_picture_begins_at_a_quarter_of_a_megapixel_and_a_mosaics_cells_hold_every_colour() -> None:
    assert first_quality(1920, 1080, mosaic=True).step == 3
    assert first_quality(640, 480, mosaic=False).step == 2
    assert first_quality(320, 240, mosaic=True).step == 2, "no finer than the mosaic's cells"
    assert first_quality(320, 240, mosaic=False).step == 1
    assert first_quality(14_000, 9_000, mosaic=False).step == 8


@pytest.mark.parametrize("cfa", ["RGGB", "GBRG"])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("step", [2, 3, 6])
def test_a_cell_of_a_mosaic_is_the_mean_of_each_colours_samples_wherever_it_begins(
    step: int, kind: type[np.uint8 | np.uint16], cfa: str
) -> None:
    codes = np.random.default_rng(step).integers(5, 200, (20, 22), dtype=kind)
    tone = Tone(zero=np.zeros((1, 1)), gain=np.full((1, 1), 1 / 255))
    small = Smaller(step=step, cfa=cfa).of(Coded(codes=codes, tone=tone)).light() * 255
    colour = np.tile(np.array(list(cfa)).reshape(2, 2), (10, 11))
    for row, col in np.ndindex(small.shape[:2]):
        cell = np.s_[row * step : (row + 1) * step, col * step : (col + 1) * step]
        means = [codes[cell][colour[cell] == name].mean() for name in "RGB"]
        assert np.abs(small[row, col] - means).max() < (0.07 if kind is np.uint8 else 1.0), "cut to what codes hold"


def test_a_colour_picture_stays_colour_whatever_filters_the_plan_names() -> None:
    codes = np.arange(8 * 8 * 3, dtype=np.uint16).reshape(8, 8, 3)
    plain, named = (Smaller(step=2, cfa=cfa).of(Coded(codes=codes, tone=Tone())).codes for cfa in (None, "RGGB"))
    assert np.array_equal(named, plain)
