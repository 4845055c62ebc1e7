"""What is said of rows, frames, times and motion: which were seen, which are missing, and what is to blame."""

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from judged_footage import SIZE, Footage, even, facts_of, graded, looked_at, plan_of, ring, tiles, timing_of

from psvideo.model.rows.recipe import LEAST_SHARE
from psvideo.model.timing import DroppedFrames
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.report.html import _timing
from psvideo.report.judge import of_motion, of_rows, of_steadiness, of_timing
from psvideo.report.judge.of_frames import frame_light
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.motion import glimpse, motion_between
from psvideo.report.observe.observed import Observed

GOOD = Footage()


def timed(**changed: Any) -> str:
    return graded(list(of_timing.timing_and_order(timing_of(**changed), "rolling")), "timing")


def covered(subject: str, footage: Footage = GOOD, *, dark_s: float = 0.01, **changed: Any) -> str:
    """Return what is said of rows under a rolling plan of 5 ms flashes with this dark time, at an exposure of 10 ms."""
    plan = plan_of(["a"], mode="rolling", dark_s=dark_s)
    return graded(list(of_rows.coverage(plan, timing_of(**changed), footage.observed(0))), subject)


def moved(px_per_flash: float, **how: bool) -> str:
    """Return what is said of paint that moves by so much from flash to flash of one light, a flash a second."""
    one = Footage(shape="waves", lights=1, rounds=4, shift_px=px_per_flash).observed(0)
    return graded(of_motion.motion(plan_of(one.lights, fps=1), timing_of(frame_period_s=1.0), one, **how), "motion")


def test_times_rows_and_motion_on_both_sides_of_a_threshold_are_told_apart() -> None:
    assert [timed(phase_error_rows=rows) for rows in (0.28, 0.32, 1.9, 2.1)] == ["good", "doubtful", "doubtful", "bad"]
    assert [covered("rows", dark_s=dark_s) for dark_s in (0.00985, 0.0097, 0.0077, 0.0073)] == [
        "good", "doubtful", "doubtful", "bad"
    ]  # fmt: skip
    unseen = [covered("rows", Footage(unseen=share)) for share in (0.01, 0.04, 0.28, 0.33)]
    assert unseen == ["good", "doubtful", "doubtful", "bad"]
    borrowed = [covered("rows", Footage(borrowed=share), exposure_s=open_s) for share, open_s in
                ((0.01, 0.005), (0.2, 0.00975), (0.2, 0.0096))]  # fmt: skip
    assert borrowed == ["good", "good", "doubtful"]
    assert covered("frames", dropped_frames=(DroppedFrames(after=3, count=1),)) == "doubtful"
    assert [moved(px) for px in (0, 1, 2, 4, 5)] == ["good", "good", "doubtful", "doubtful", "bad"]
    assert moved(5, aligned=True) == moved(5, foretold=True) == "doubtful"


def test_a_look_at_motion_says_of_a_take_what_a_run_of_it_will_which_aligns_plates() -> None:
    """A subject left the picture by 9 px from flash to flash: 3 % of it was lost, and check called it not usable."""
    found = []
    for px in (15.0, 17.0):
        rounds = [facts_of(moving_share=0.2, speed_px_s=px) for _ in range(6)]
        one = Observed(lights=("a",), facts=KeptFacts(rounds))
        line = of_motion.motion(plan_of(("a",), fps=1), timing_of(frame_period_s=1.0), one, foretold=True)
        assert f"up to {px:.1f} px from flash to flash" in line.found
        found.append(line.grade)
    assert found == ["doubtful", "bad"]


@pytest.mark.parametrize(("lost", "grade"), [(0, "doubtful"), (5, "doubtful"), (8, "bad")])
def test_rounds_at_the_ends_of_a_take_below_360_degrees_do_not_make_the_others_useless(lost: int, grade: str) -> None:
    """At 90 degrees five rounds of 61 lacked up to half of their rows, and 50 had all: the take was not usable."""
    facts = [facts_of(number=n, unseen_share=0.5 if n < lost else 0.0, borrowed_share=0.5) for n in range(61)]
    one = Observed(lights=("a",), facts=KeptFacts(facts))
    (line,) = of_rows.coverage(plan_of(["a"], mode="rolling", dark_s=0.01), timing_of(exposure_s=0.0025), one)
    assert line.grade == grade
    assert ("In 5 of 61 rounds" in line.found) == (lost == 5)


def test_the_worst_round_is_not_called_what_rounds_are_about() -> None:
    """A pause of 0.5 ms hides no whole flash of 5 ms: what rows lack is not the shutter's mean, but one round's own."""
    facts = KeptFacts([facts_of(number=n, unseen_share=0.0, borrowed_share=0.3 if n == 3 else 0.0) for n in range(9)])
    plan, one = plan_of(["a"], mode="rolling", dark_s=0.01), Observed(lights=("a",), facts=facts)
    (line,) = of_rows.coverage(plan, timing_of(exposure_s=0.0095), one)
    assert "degrees only: up to 30 % of a round's rows come from other rounds" in line.found


def test_check_and_the_whole_run_say_the_same_of_rows_that_come_from_other_rounds() -> None:
    """The worst round of a part was 93 %, of the whole 51 %, and the shutter hides 45 %."""
    plan = plan_of(["a"], mode="rolling", dark_s=0.01)
    plan = replace(plan, flashes=tuple(replace(flash, duration_s=0.0007) for flash in plan.flashes))
    said = []
    for footage, take_s in ((Footage(borrowed=0.5), None), (Footage(borrowed=0.4, unseen=0.4), 60.0)):
        lines = of_rows.coverage(plan, timing_of(exposure_s=0.005), footage.observed(0), take_s=take_s)
        (line,) = (one for one in lines if one.subject == "rows")
        said.append(line.found)
    assert said[0] == said[1]
    seen, places = 0, np.linspace(0, 0.01, 20001)[:-1]
    for start_s in places:  # where in the frame of 10 ms, open for its first 5, a flash of 0.7 ms falls
        open_s = max(min(start_s + 0.0007, 0.005) - start_s, 0) + max(start_s + 0.0007 - 0.01, 0)
        seen += open_s >= LEAST_SHARE * 0.0007
    assert f"about {100 * (1 - seen / len(places)):.0f} % of a round's rows" in said[0]


def test_a_take_too_short_to_show_all_rows_below_360_degrees_is_told_so_and_a_longer_one_is_not() -> None:
    """A check said that nothing was lost where normals then lacked a third of the rows: rounds lasted 4.005 frames."""
    plan = plan_of(["a"], mode="rolling", dark_s=0.01)
    plan = replace(plan, dark_s=0.01005 - plan.flashes[0].duration_s)
    said = []
    for take_s in (0.2, 20.0):
        lines = of_rows.coverage(
            plan, timing_of(exposure_s=0.005), Footage(borrowed=0.4, unseen=0.4).observed(0), take_s=take_s
        )
        said.append(next(one for one in lines if one.subject == "rows"))
    assert "see a light in no round of so short a take" in said[0].found
    assert said[0].advice == "Shoot at 360 degrees, or film longer."
    assert "so short a take" not in said[1].found
    assert said[1].advice == "Shoot at 360 degrees."


def test_what_to_do_about_missing_frames_fits_movies_too() -> None:
    """A phone's movie of a variable frame rate was to be copied again from a faster card."""
    timing = timing_of(dropped_frames=(DroppedFrames(after=3, count=1),))
    lines = of_rows.coverage(plan_of(["a"], mode="rolling", dark_s=0.01), timing, GOOD.observed(0))
    (line,) = (one for one in lines if one.subject == "frames")
    assert "constant frame rate" in line.advice
    assert line.advice.startswith("Of numbered files, copy")


def test_rows_whose_ambient_light_no_part_of_a_flash_tells_are_not_laid_to_the_shutter() -> None:
    plan, one = plan_of(["a"], mode="rolling", dark_s=0.01), Footage(unseen=0.1).observed(0)
    (said,) = of_rows.coverage(plan, timing_of(), one)
    assert said.grade == "doubtful"
    assert "dark slot" in said.advice
    assert "360" not in said.advice
    assert graded(list(of_rows.coverage(plan, timing_of(), one, take_s=5.0)), "rows") == "good"
    dark = replace(plan, flashes=(*plan.flashes, replace(plan.flashes[0], lights={})))
    assert "360" in next(of_rows.coverage(dark, timing_of(), one)).advice


def test_rows_that_the_rest_of_the_take_shows_are_not_lost_unless_the_strobe_keeps_step() -> None:
    """Below 360 degrees a part of a take shows fewer rows than all of it."""

    def said(dark_s: float, take_s: float | None) -> tuple[str, str]:
        plan = plan_of(["a"], mode="rolling", dark_s=dark_s)
        found = list(
            of_rows.coverage(plan, timing_of(exposure_s=0.005), Footage(unseen=0.5).observed(0), take_s=take_s)
        )
        return graded(found, "rows"), " ".join(f"{one.found} {one.advice}" for one in found)

    flash_s = plan_of(["a"], mode="rolling", dark_s=0.01).flashes[0].duration_s
    assert said(0.0105, 5.0)[0] == "doubtful"
    assert said(0.0105, None)[0] == "bad"
    for take_s in (None, 5.0):
        grade, words = said(0.01 - flash_s, take_s)
        assert grade == "bad"
        assert "keeps step" in words
        assert "dark_s" in words


@pytest.mark.parametrize("passing", [False, True])
def test_motion_and_sharpness_are_looked_for_in_plates_that_are_lit_where_the_first_light_is_dead(
    passing: bool,
) -> None:
    dark = Footage(shape="tiles", lights=4, gains=[0, 1, 1, 1], noise=0.001)
    rounds = [dark._round([f"light{n}" for n in range(4)], plates, plates, number)
              for number, plates in enumerate(_tiles_that_move(dark, 3))]  # fmt: skip
    one = Observed(lights=rounds[0].lights)
    for each in rounds:
        for plate in each.plates if passing else ():
            one.look(plate)
        one.add(each)
    assert one.motion.watched == "light1"
    assert one.closely.blurs_px
    assert one.closely.blurs_px[0] < of_steadiness.SOFT_PX
    assert [facts.moving_share is not None and facts.moving_share > 0.05 for facts in one.facts[1:]] == [True, True]


def _tiles_that_move(footage: Footage, rounds: int) -> list[list[np.ndarray]]:
    rng = np.random.default_rng(0)
    each = []
    for number in range(rounds):
        clean = [np.roll(one, 4 * number, axis=1) for one in footage._plates(ring(footage.lights), 0)]
        each.append([(one + rng.normal(0, footage.noise, one.shape)).astype(np.float32) for one in clean])
    return each


def test_what_is_clipped_does_not_seem_to_move_where_the_rows_that_two_frames_share_roll() -> None:
    """Two halves of a flash, each below saturation, add up to more than a whole one that is clipped."""

    def plate(number: int) -> LightPlate:
        light = 2 * tiles(0)[1]
        shared = (np.arange(SIZE) - 24 * number) % SIZE < 24
        clipped = np.where(shared[:, None], light, np.minimum(light, 1)).astype(np.float32)
        return LightPlate(
            light="a", number=number, time_s=float(number), picture=mixture_of(clipped), seen=np.ones(SIZE, np.bool_)
        )

    one = glimpse(plate(0))
    found = motion_between(one, glimpse(plate(1), one.white))
    assert found is not None
    assert (found.speed_px_s, found.share) == (0, 0)


@pytest.mark.parametrize("hole", [(), (DroppedFrames(after=7, count=1),)])
def test_rows_that_nobody_saw_are_judged_beside_a_missing_frame(hole: tuple[DroppedFrames, ...]) -> None:
    timing = replace(timing_of(), dropped_frames=hole, repeated_frames=(9,))
    one = Observed(lights=("a",), facts=KeptFacts([facts_of(unseen_share=0.8)]))
    lines = list(of_rows.coverage(plan_of(("a",)), timing, one))
    assert (lines[0].subject, lines[0].grade) == ("rows", "bad")
    assert {line.subject for line in lines} == {"rows", "frames"}


def test_every_row_is_said_to_be_seen_only_where_every_row_was() -> None:
    found = []
    for share in (0.0, 0.015):
        one = Observed(lights=("a",), facts=KeptFacts([facts_of(unseen_share=share)]))
        (line,) = of_rows.coverage(plan_of(("a",)), timing_of(), one)
        found.append((line.grade, line.found.split(" seen")[0]))
    assert found == [("good", "Every row of every round was"), ("good", "All but 1.5 % of the rows were")]


def test_motion_in_a_few_rounds_is_said() -> None:
    speeds = [0.0] * 19 + [900.0]
    rounds = [facts_of(moving_share=0.1 if speed else 0.0, speed_px_s=speed) for speed in speeds]
    one = Observed(lights=("a",), facts=KeptFacts(rounds))
    line = of_motion.motion(plan_of(("a",)), timing_of(), one)
    assert "Nothing moves" not in line.found
    assert "In nine of ten rounds" in line.found


@pytest.mark.parametrize(
    ("trusted", "aligned", "foretold"), [(0.2, True, False), (None, True, True), (0.2, False, True)]
)
def test_what_motion_costs_is_foretold_only_where_the_take_does_not_show_it(
    trusted: float | None, aligned: bool, foretold: bool
) -> None:
    """It said that 9 % were lost beside a line that 17 % are trusted."""
    rounds = [facts_of(moving_share=0.3, speed_px_s=400.0, moving_valid_share=trusted) for _ in range(6)]
    one = Observed(lights=("a",), facts=KeptFacts(rounds))
    line = of_motion.motion(plan_of(("a",)), timing_of(), one, aligned=aligned)
    assert "px from flash to flash" in line.found
    assert ("of the normals there are lost" in line.found) is foretold


def test_frames_with_values_that_are_no_numbers_are_judged_by_the_others() -> None:
    image = np.full((40, 40), 0.5, np.float32)
    image[0, 0] = np.nan
    assert frame_light(image).top == pytest.approx(0.5)


def test_rows_that_nobody_saw_are_not_borrowed() -> None:
    shown_s = np.zeros(SIZE)
    shown_s[24:36] = 1.0
    plate = replace(even("a", 0.5, unseen=slice(24)), shown_s=shown_s)
    assert looked_at([plate]).facts[0].borrowed_share == pytest.approx(12 / SIZE)


@pytest.mark.parametrize(("opened", "mode", "said"), [(0.9, "rolling", False), (1.0, "synced", True)])
def test_rows_that_a_closed_shutter_costs_are_not_laid_to_a_missing_frame(opened: float, mode: str, said: bool) -> None:
    timing = timing_of(exposure_s=0.01 * opened, dropped_frames=(DroppedFrames(after=3, count=1),))
    one = Observed(lights=("a",), facts=KeptFacts([facts_of(unseen_share=0.1)] * 12))
    lines = list(of_rows.coverage(plan_of(("a",), mode=mode, dark_s=0.01), timing, one))
    assert ("spoils 12 of 12 rounds" in next(line.found for line in lines if line.subject == "frames")) == said


@pytest.mark.parametrize(
    ("known", "words"),
    [
        ({"row_time_s": 0.0, "phase_error_rows": 0.05, "phase_error_s": 2e-6}, "2 us"),
        ({"phase_error_rows": 0.05, "phase_error_s": 5e-6}, "5 us, 0.05 row"),
        ({"phase_error_rows": 0.05}, "0.05 row"),
        ({"phase_error_rows": 0.0}, "not fitted"),
    ],
)
def test_the_report_says_how_sure_flash_times_are_as_the_timing_does(known: dict[str, float], words: str) -> None:
    timing = timing_of(**known)
    report: Any = SimpleNamespace(timing=timing)
    assert f"<td>{words}</td>" in _timing(report)
    assert timing.how_sure == ("" if words == "not fitted" else f"Flash times are known to {words}.")


@pytest.mark.parametrize(("spoilt", "rounds", "grade"), [(1, 8, "nothing"), (2, 20, "nothing"), (3, 20, "bad")])
def test_a_missing_frame_costs_its_rounds_and_not_the_take(spoilt: int, rounds: int, grade: str) -> None:
    """One lost frame of 120 took 31 % of one round's rows of 28, and the take was "not usable"."""
    timing = timing_of(dropped_frames=(DroppedFrames(after=50, count=1),))
    facts = [facts_of(number=1001 + n, unseen_share=0.31 if n < spoilt else 0.0) for n in range(rounds)]
    lines = list(of_rows.coverage(plan_of(("a",)), timing, Observed(lights=("a",), facts=KeptFacts(facts))))
    assert graded(lines, "rows") == grade
    assert graded(lines, "frames") == "doubtful"
    assert not any("360" in line.advice for line in lines)


@pytest.mark.parametrize(("radius", "words"), [(15, "All that is lit moves"), (60, "1[0-3] % of the picture moves")])
def test_how_much_moves_is_no_share_of_the_picture_where_only_what_is_lit_shows_it(radius: int, words: str) -> None:
    """A disc of 0.6 % of the picture, before the dark, was "100 % of the picture"; one of 9 % sweeps 11."""
    rng = np.random.default_rng(4)
    paint = rng.uniform(0.2, 0.8, (300, 400)).astype(np.float32)
    y, x = np.mgrid[:300, :400]
    disc = np.where(np.hypot(y - 150, x - 200) < radius, paint, 0)
    one, seen = Observed(lights=("a",)), np.ones(300, np.bool_)
    for number in range(4):
        image = np.roll(disc, 3 * number, 1) + rng.normal(0, 0.001, disc.shape)
        picture = mixture_of(image.astype(np.float32))
        plate = LightPlate(light="a", number=number, time_s=float(number), picture=picture, seen=seen)
        one.add(Round(number=number, plates=(plate,)))
    found = of_motion.motion(plan_of(one.lights, fps=1), timing_of(frame_period_s=1.0), one).found
    assert re.match(words, found)


@pytest.mark.parametrize("px", [0, 2])
@pytest.mark.parametrize("shared", [20, 30, 60])
def test_motion_is_seen_in_the_rows_that_two_plates_share_and_in_no_noise_beside_them(shared: int, px: int) -> None:
    """Rows that saw a sixth of a flash are as many times as noisy. Pieces of 24 to 31 rows ended OpenCV's search."""
    rng = np.random.default_rng(shared)

    def shown(number: int, rows: slice) -> LightPlate:
        wall = np.roll(Footage(shape="waves", lights=1)._plates(ring(1), 0)[0], px * number, axis=1)
        noise = np.full((SIZE, 1), 0.004)
        noise[rows.start : rows.start + 8] *= 6
        noise[rows.stop - 8 : rows.stop] *= 6
        seen = np.zeros(SIZE, np.bool_)
        seen[rows] = True
        light = ((wall + noise * rng.normal(size=wall.shape)) * seen[:, None]).astype(np.float32)
        return LightPlate(light="a", number=number, time_s=float(number), picture=mixture_of(light), seen=seen)

    middle = SIZE // 2
    one = glimpse(shown(0, slice(0, middle + shared // 2 + 8)))
    found = motion_between(one, glimpse(shown(1, slice(middle - shared // 2 - 8, SIZE)), one.white))
    if shared == 20:
        assert found is None
        return
    assert found is not None
    assert found.speed_px_s == pytest.approx(px, abs=0.3)
    assert found.share > 0.5 if px else found.share == 0


@pytest.mark.parametrize(("left", "grade"), [(0.1, "bad"), (0.3, "doubtful"), (None, "doubtful")])
def test_below_360_degrees_a_run_that_leaves_hardly_anything_of_what_moves_is_not_usable(
    left: float | None, grade: str
) -> None:
    one = Footage(shape="waves", lights=1, rounds=4).observed(0)
    one.facts = KeptFacts(
        replace(facts, moving_share=0.2, speed_px_s=8.0, moving_valid_share=left) for facts in one.facts
    )
    plan = plan_of(one.lights, fps=1, mode="rolling", dark_s=0.5)
    found = of_motion.motion(plan, timing_of(frame_period_s=1.0, exposure_s=0.5), one, aligned=True)
    assert "8 px from round to round" in found.found
    assert found.grade == grade
