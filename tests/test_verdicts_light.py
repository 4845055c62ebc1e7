"""What is said of exposure, curve and ambient light, on footage on either side of a border."""

import re
from array import array
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from judged_footage import (
    ALL_WEAKER,
    ONE_QUICKLY,
    SEEDS,
    SIZE,
    Footage,
    ball,
    even,
    exposure,
    facts_of,
    graded,
    lamps,
    looked_at,
    plan_of,
    rig_of,
    ring,
    timing_of,
)

from psvideo.clip import Masks
from psvideo.model.camera import Encoding
from psvideo.model.surface import Misfit, Surface
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import AMBIENT, Round
from psvideo.report.judge import of_motion, of_validity, typical_error
from psvideo.report.judge.every_line import judgements
from psvideo.report.judge.of_ambient import ambient
from psvideo.report.judge.of_exposure import exposure as judge_exposure
from psvideo.report.judge.of_rig import rig as judge_rig
from psvideo.report.judge.of_steps import COARSE_DEG, DEG_PER_STEP, coarse_steps
from psvideo.report.observe.against_noise import AgainstNoise
from psvideo.report.observe.close_looks import CloseLooks
from psvideo.report.observe.code_steps import code_step
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.shadow import shadow_light
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving


@pytest.mark.parametrize("seed", ONE_QUICKLY)
@pytest.mark.parametrize(
    ("times_noise", "grade"), [(80, "good"), (24, "good"), (13, "doubtful"), (7, "doubtful"), (3, "bad"), (1, "bad")]
)
@pytest.mark.parametrize(
    ("transfer", "stops"), [("logc3", -6.4), ("slog3", -5.9), ("logc4", -11.0), ("st2084", -7.0), ("hlg", -4.5)]
)
def test_a_scene_far_below_its_curves_end_is_judged_by_its_noise(
    transfer: str, stops: float, times_noise: float, grade: str, seed: int
) -> None:
    """LogC3 with diffuse white where it belongs was "not usable": 6.4 stops below the largest code, and 25 times its
    noise."""
    one = Footage(stops=stops, noise=2.0**stops / times_noise).observed(seed)
    plan = plan_of(one.lights)
    for white in (None, 50000.0):  # the plan may say where the sensor saturates
        encoding = Encoding(transfer=transfer, white_level=white)
        lines = judgements(replace(plan, camera=replace(plan.camera, encoding=encoding)), timing_of(), one)
        assert graded(lines, "exposure") == grade
        said = next(line.found for line in lines if line.subject == "exposure")
        assert ("saturation" in said) == (white is not None)


def test_a_bright_scene_is_not_dark_for_its_grain() -> None:
    one = Footage(stops=-2, noise=0.05).observed(0)
    assert graded(list(judge_exposure(one, under="the largest code")), "exposure") == "good"


@pytest.mark.parametrize(("read", "photon"), [(1e-6, 0.0), (1e-7, 1e-4), (0.0, 1e-3)])
def test_so_many_stops_more_light_is_as_many_times_its_noise(read: float, photon: float) -> None:
    dim = AgainstNoise(level=0.003, read=read, photon=photon)
    lit = replace(dim, level=dim.level * 2 ** dim.stops_to(25))
    assert lit.ratio == pytest.approx(25)


def test_a_subject_that_clips_everywhere_is_called_so_and_is_told_to_look_again() -> None:
    lines = exposure(Footage(shape="waves", stops=3, noise=0).observed(0))
    assert graded(lines, "clipping") == "bad"
    assert "10 %" in next(line.advice for line in lines if line.subject == "clipping")


def test_files_read_by_another_curve_than_they_say_are_doubtful_and_motion_is_not_blamed() -> None:
    one = Footage().observed(0)
    misfit = Misfit(share=0.1, error_deg=3.1 / typical_error.MEAN_OF_HELD)
    one.facts = KeptFacts(
        replace(facts, misfit=misfit, valid_share=0.1, measured_share=1.0, moving_share=1.0) for facts in one.facts
    )
    (lacking,) = of_validity.validity(one)
    assert "Move slower" in lacking.advice
    (lacking,) = of_validity.validity(one, first=of_validity.first_of_all((), curve_doubted=True))
    assert lacking.advice == of_validity.CURVE_FIRST
    said = list(judge_rig(one, curve_doubt="the files are tagged 'hlg'"))
    assert [(line.grade, line.found) for line in said] == [("doubtful", "The files are tagged 'hlg'.")]


@pytest.mark.parametrize(("stops", "first"), [(-5.5, of_validity.EXPOSURE_FIRST), (-0.5, "")])
def test_normals_of_a_dark_picture_lack_light_before_anything_else(stops: float, first: str) -> None:
    """The picture was dark and was to be opened by 5 stops, and more light did not help."""
    assert of_validity.first_of_all(exposure(Footage(shape="waves", stops=stops, noise=0.0002).observed(0))) == first


def test_ambient_light_that_is_the_same_everywhere_is_called_a_black_level() -> None:
    one = Footage().observed(0)
    one.facts = KeptFacts(replace(facts, ambient=0.3) for facts in one.facts)
    for evenness, named in ((0.95, True), (0.5, False)):
        one.dark_evenness = array("d", [evenness])
        assert ("black_level" in ambient(one).advice) == named
        assert ambient(one).grade == "doubtful"


@pytest.mark.parametrize(("shape", "named"), [("ball", True), ("card", False)])
def test_even_ambient_light_over_an_even_card_is_no_black_level(shape: str, named: bool) -> None:
    one = Footage(shape=shape, ambient=(0.3,)).observed(0)
    assert ("black_level" in ambient(one).advice) == named


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("around", "grade"), [(0.0, "unknown"), (0.025, "unknown"), (0.06, "doubtful")])
def test_light_that_is_left_in_attached_shadow_is_said_where_no_dark_slot_shows_it(
    around: float, grade: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    ways = ring(6) * [1.7, 1.7, 0.6]
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    normals, albedo = ball(0)
    shades = [albedo * (np.maximum(normals @ way, 0) + around) for way in ways]
    plates = [(shade + rng.normal(0, 0.001, shade.shape)).astype(np.float32) for shade in shades]
    surface = Solving().solve(plates, Illumination(directions=ways, intensities=np.ones((6, 1))))
    left = shadow_light(np.array(plates), np.ones((6, SIZE, SIZE), np.bool_), surface, ways, step=1)
    assert left is not None
    one = Observed(lights=("a",), closely=CloseLooks(in_shadow=[left]))
    assert ambient(one).grade == grade
    beside_dark = replace(one, facts=KeptFacts([facts_of(ambient=0.01)] * 3))  # which the dark slots hold none of
    assert ambient(beside_dark).grade == grade.replace("unknown", "good")
    assert ("haze, flare" in ambient(beside_dark).found) == (grade == "doubtful")


@pytest.mark.parametrize(("ambient", "said"), [(0.03, False), (0.08, True)])
def test_ambient_light_that_no_flash_freezes_is_said_with_its_blur_and_its_lean(ambient: float, said: bool) -> None:
    plan = replace(plan_of(["a"], fps=1), mode="rolling")
    timing = timing_of(frame_period_s=1.0, exposure_s=0.5, row_time_s=1.0 / SIZE)
    one = Footage(shape="waves", lights=1, rounds=4, shift_px=4).observed(0)
    one.facts = KeptFacts(replace(facts, ambient=ambient) for facts in one.facts)
    found = of_motion.motion(plan, timing, one).found
    assert ("do not freeze the ambient light, 8 % of the signal" in found) == said
    speed_px_s = float(np.median([facts.speed_px_s or 0.0 for facts in one.facts[1:]]))
    assert not said or f"blurs by up to {0.5 * speed_px_s:.0f} px and leans by {speed_px_s:.0f} px" in found


@pytest.mark.parametrize(
    ("unseen", "dark_unseen"), [((0, 0), 0), ((SIZE, SIZE), 0), ((0, 0), SIZE // 2), ((SIZE, 8), SIZE // 4)]
)
def test_ambient_lights_share_is_of_what_was_seen(unseen: tuple[int, int], dark_unseen: int) -> None:
    plates = [even("a", 0.46), *(even(name, 0.46, unseen=slice(rows)) for name, rows in zip("bc", unseen, strict=True))]
    observed = looked_at(plates, even(AMBIENT, 0.04, unseen=slice(dark_unseen)))
    assert observed.facts[0].ambient == pytest.approx(0.08)


@pytest.mark.parametrize("radius_px", [9, 14, 20, 60])
def test_ambient_lights_share_is_that_on_a_subject_however_little_of_a_void_it_fills(radius_px: int) -> None:
    height, width, noise, ambient = 270, 480, 0.002, 0.01
    random = np.random.default_rng(5)
    rows, cols = np.mgrid[:height, :width]
    subject = np.hypot(rows - 120, cols - 200) < radius_px  # 0.2 to 9 % of the picture

    def plate(light: str, level: float) -> LightPlate:
        image = (level * subject + noise * random.normal(size=subject.shape)).astype(np.float32)
        return LightPlate(
            light=light, number=1001, time_s=0.0, picture=mixture_of(image), seen=np.ones(height, np.bool_)
        )

    observed = looked_at([plate(light, 0.3) for light in "abcd"], plate(AMBIENT, ambient))
    by_chance = 3 * noise / np.sqrt(np.count_nonzero(subject[::4, ::4])) / (0.3 + ambient)
    assert observed.facts[0].ambient == pytest.approx(ambient / (0.3 + ambient), abs=by_chance)
    assert observed.facts[0].levels == pytest.approx((0.3,) * 4, rel=0.05)


def test_what_is_dim_where_no_frame_saw_the_dark_slot_does_not_make_it_uneven() -> None:
    lit = LightPlate(
        light="a", number=1001, time_s=0.0, seen=np.ones(SIZE, np.bool_),
        picture=mixture_of(np.tile(np.linspace(0.1, 0.9, SIZE, dtype=np.float32), (SIZE, 1))),
    )  # fmt: skip
    observed = looked_at([lit], even(AMBIENT, 0.04, unseen=slice(SIZE // 2)))
    assert observed.dark_evenness[0] == pytest.approx(1)


def test_the_share_that_clips_is_of_what_was_seen() -> None:
    observed = looked_at([even("a", 0.5, unseen=slice(SIZE // 2), clips=0.25), even("b", 0.5)])
    assert observed.facts[0].clipped == (0.25, 0.0)
    assert observed.levels("a").clipped_share == pytest.approx(0.25)


def test_a_mask_that_slips_between_the_points_looked_at_is_not_called_dark() -> None:
    mask = np.zeros((SIZE, SIZE), np.bool_)
    mask[:, 13:16] = True
    one = looked_at([even(name, 0.5) for name in "abc"], masks=Masks(still=mask))
    assert [(line.subject, line.grade) for line in (*exposure(one), *lamps(one))] == [("mask", "doubtful")]
    solved = Surface(
        normals=np.tile(np.array([0, 0, 1], np.float32), (SIZE, SIZE, 1)),
        albedo=np.ones((SIZE, SIZE), np.float32),
        valid=mask,
    )
    one.add(Round(number=1002, plates=tuple(even(name, 0.5) for name in "abc")), solved)
    assert one.facts[1].valid_share is None


@pytest.mark.parametrize("powers", [ALL_WEAKER, (0.2, 0.5, 1.0, 0.3)])
@pytest.mark.parametrize("shape", ["ball", "waves"])
@pytest.mark.parametrize("seed", ONE_QUICKLY)
def test_a_right_curve_is_not_doubted_where_flashes_are_weaker_than_full(
    shape: str, powers: Sequence[float], seed: int
) -> None:
    """All that lay above 1.0 was bent to one value, which any rig explains."""
    right, wrong = (
        Footage(
            shape=shape, lights=4, noise=0.0002, gains=powers, powers=powers, recorded=recorded, solved=True
        ).observed(seed)
        for recorded in ("linear", "srgb")
    )
    assert graded(rig_of(right), "rig") == "good"
    assert any("recorded as sRGB" in line.found for line in rig_of(wrong))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("powers", [(1.0,), ALL_WEAKER])
def test_ambient_light_is_compared_with_what_the_flash_gave_not_with_a_full_one(
    powers: Sequence[float], seed: int
) -> None:
    just_good, just_bad = (
        ambient(Footage(lights=4, ambient=[share], powers=powers).observed(seed)) for share in (0.09, 0.11)
    )
    assert (just_good.grade, just_bad.grade) == ("good", "doubtful")


@pytest.mark.parametrize("clip", [0.016, 0.2])
def test_a_clipped_take_is_not_told_to_give_more_light(clip: float) -> None:
    one = Footage(lights=3, clip=clip, clipping=3, noise=0, solved=True, dark=0.7).observed(0)
    lines = judgements(plan_of(one.lights), timing_of(), one)
    (lacking,) = (line for line in lines if line.subject == "validity")
    assert lacking.grade != "good"
    assert ("more light," in lacking.advice) == (clip < 0.02)
    assert (lacking.advice == of_validity.CLIPPING_FIRST) == (clip > 0.02)


@pytest.mark.parametrize(("reached", "more"), [(0.9, True), (1.0, False)])
def test_where_three_lights_reach_all_of_a_clipped_subject_none_is_told_to_reach_more(
    reached: float, more: bool
) -> None:
    one = Footage(lights=4, clip=0.2, clipping=4, noise=0, solved=True).observed(0)
    facts = KeptFacts(replace(fact, measured_share=reached, valid_share=0.1) for fact in one.facts)
    lines = judgements(plan_of(one.lights), timing_of(), replace(one, facts=facts))
    (lacking,) = (line for line in lines if line.subject == "validity")
    assert f"reach {100 * reached:.0f} % of the subject" in lacking.found
    assert "See the line on clipping first" in (lacking.advice or "")
    assert ("reach every part" in (lacking.advice or "")) == more


def _quantised(step: int) -> tuple[list[np.ndarray], float]:
    """Return a ball under three lights 38 degrees from the axis, in 8 bits of gamma 2.2 of which only every ``step``-th
    code is used, and by how many degrees that turns the normals that all lights reach."""
    rows, cols = (np.mgrid[:160, :160] - 79.5) / 78
    depth = np.sqrt(np.maximum(1 - rows**2 - cols**2, 0))
    normals = np.stack([cols, -rows, depth], axis=-1)
    turn = np.radians([90, 210, 330])
    lights = np.stack([0.616 * np.cos(turn), 0.616 * np.sin(turn), np.full(3, 0.788)], axis=1)
    true = 0.48 * np.maximum(normals @ lights.T, 0) * (depth > 0)[..., None]
    code = np.round(255 * true ** (1 / 2.2)) // step * step + (step - 1) / 2
    seen = np.where(true > 0, (code / 255) ** 2.2, 0).astype(np.float32)
    lit = (true > 0.02).all(axis=-1)
    solved = seen[lit] @ np.linalg.inv(lights).T
    cosine = (solved * normals[lit]).sum(axis=1) / np.linalg.norm(solved, axis=1)
    return [seen[..., k] for k in range(3)], float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean())


@pytest.mark.parametrize(("step", "said"), [(1, False), (8, True), (16, True)])
def test_files_that_hold_few_levels_are_said_to_and_what_that_costs(step: int, said: bool) -> None:
    """Normals of posterised footage were 2 and 4 degrees off, and the take was usable without a word."""
    frames, off_deg = _quantised(step)
    share = code_step(frames)
    assert share is not None
    found = coarse_steps(share)
    assert (found is not None) == said == (off_deg > COARSE_DEG)
    assert share * DEG_PER_STEP == pytest.approx(off_deg, rel=0.5, abs=0.3)


def test_even_colours_and_fine_codes_are_not_taken_for_few_levels() -> None:
    rng = np.random.default_rng(2)
    colours = np.array([0.2, 0.22, 0.3, 0.34, 0.5, 0.52, 0.55, 0.7], np.float32)
    patches = colours[rng.integers(0, 8, (20, 20))].repeat(8, axis=0).repeat(8, axis=1)
    fine = (np.round(4095 * rng.uniform(0.2, 0.8, (160, 160))) / 4095).astype(np.float32)
    assert code_step([patches]) is None
    assert code_step([fine]) is None or coarse_steps(code_step([fine])) is None
    assert code_step([np.zeros((40, 40), np.float32), np.full((40, 40, 3), np.nan, np.float32)]) is None


def test_of_many_lights_that_clip_the_worst_are_named_and_the_rest_is_counted() -> None:
    one = Footage(lights=8, clip=0.2, clipping=6, noise=0, solved=True).observed(0)
    (clipping,) = (line for line in exposure(one) if line.subject == "clipping")
    named, left = clipping.found.split(". ")
    assert re.fullmatch(r"6 of 8 lights clip parts of the subject: ('\w+' \d+ %(, | and )){4}2 more", named)
    assert re.fullmatch(r"That leaves fewer than three lights on \d+ % of it, where no normal is measured\.", left)
