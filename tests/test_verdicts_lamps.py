"""What is said of each light: dead, weak, flickering or as strong as the rig says, and what to set its power to."""

import re
from dataclasses import replace

import numpy as np
import pytest
from judged_footage import (
    ONE_QUICKLY,
    ONE_WEAKER,
    SEEDS,
    Footage,
    even,
    exposure,
    facts_of,
    graded,
    lamps,
    looked_at,
    plan_of,
    rig_but_leaning,
    rig_of,
    timing_of,
    validity,
)

from psvideo.cli.commands.sync import describe_timing
from psvideo.model.camera import Encoding
from psvideo.model.swing import Swing
from psvideo.model.timing import Flash
from psvideo.report.judge import of_accuracy
from psvideo.report.judge.of_exposure import exposure as judge_exposure
from psvideo.report.judge.of_lamps import lamps as judge_lamps
from psvideo.report.judge.of_timing import timing_and_order
from psvideo.report.judge.of_validity import first_of_all
from psvideo.report.judge.powers import power_words
from psvideo.report.judge.rig_by_plates import lights_near, rig_misfits
from psvideo.report.judgement import verdict_of
from psvideo.report.observe.against_noise import AgainstNoise
from psvideo.report.observe.close_looks import CloseLooks
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.levels import count_levels
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigfit import RigFit
from psvideo.report.observe.rig_and_curve.yuille1997 import Lean


def levels(share: float) -> list[float]:
    return [1.0, 1.0 + share]


@pytest.mark.parametrize("seed", ONE_QUICKLY)
@pytest.mark.parametrize(("shape", "sheen"), [("ball", (0.4, 30)), ("waves", (0.8, 6))])
def test_among_many_lights_those_that_are_not_as_strong_as_the_rig_says_are_named(
    shape: str, sheen: tuple[float, float], seed: int
) -> None:
    """Photographs of a bear, of which a few were a quarter brighter, were said to show a surface that is not matte."""
    off, right = (
        Footage(shape=shape, lights=8, gains=gains, sheen=sheen, solved=True).observed(seed)
        for gains in ([1.0, 1.2, 1.0, 1.0, 1.0, 0.82, 1.0, 1.0], [1.04, 0.96] * 4)
    )
    (line,) = (one for one in rig_but_leaning(off) if one.grade != "good")
    assert (line.subject, line.grade) == ("rig", "doubtful")
    assert re.search(r"it would: 'light5' 8[1-4] %, 'light1' 1(1[7-9]|2[01]) % of what the rig says", line.found)
    assert not any("other strengths" in one.found for one in rig_of(right))
    assert "not as strong" in " ".join(one.found for one in of_accuracy.accuracy(off))


@pytest.mark.parametrize("count", [8, 12])
def test_of_many_lights_those_that_are_off_are_all_named_and_to_be_mended_one_by_one(count: int) -> None:
    """A bear's strengths were to be measured on the bear: its normals got worse. Most of 18 names were left out."""
    off = (1, 3, 4, 6, 7)[: count // 2 - 1]
    found = RigFit(
        misfit=0.3, own_misfit=0.02, typical_own=0.02, scaled_misfit=0.03,
        strengths=tuple(1.5 if light in off else 1.0 for light in range(count)),
    )  # fmt: skip
    line = rig_misfits([f"light{number}" for number in range(count)], found)
    assert line is not None
    named = [number for number in range(count) if f"'light{number}' 150 %" in line.found]
    assert named == list(off)
    assert ("multiply their intensities in the rig by these shares" in line.advice) == (count == 12)
    assert ("psvideo calibrate intensities" in line.advice) == (count == 8)


@pytest.mark.parametrize("seed", SEEDS)
def test_strengths_are_told_beside_a_light_that_is_dead(seed: int) -> None:
    gains = [1.0, 1.3, 1.0, 0.0, 1.0, 0.75, 1.0, 1.0, 1.0]
    dead = Footage(shape="waves", lights=9, gains=gains, sheen=(0.2, 12), solved=True).observed(seed)
    assert any("'light5' 7" in one.found and "'light3'" not in one.found for one in rig_but_leaning(dead))
    assert "not as strong" in " ".join(one.found for one in of_accuracy.accuracy(dead))


@pytest.mark.parametrize("seed", ONE_QUICKLY)
@pytest.mark.parametrize("share", [0.07, 0.3])
def test_strengths_are_told_beside_a_light_that_the_rig_calls_weak(share: float, seed: int) -> None:
    """Under a tenth of the others' it was in shadow everywhere, and of no light was said how strong it is."""
    gains = [share, 1.2, 1.0, 0.8, 1.0, 1.0, 1.0, 1.0]
    off, right = (
        Footage(shape="waves", lights=8, gains=own, claimed_gain=share, sheen=(0.2, 12), solved=True).observed(seed)
        for own in (gains, [share] + [1.0] * 7)
    )
    assert any("'light3' 8" in one.found and "'light0'" not in one.found for one in rig_but_leaning(off))
    assert "not as strong" in " ".join(one.found for one in of_accuracy.accuracy(off))
    assert right.rig_fit is not None
    assert not any("not as strong" in one.found or "other strengths" in one.found for one in rig_of(right))


@pytest.mark.parametrize(("by_surface", "named"), [(0.9, True), (0.5, False)])
def test_lamps_are_said_to_stand_near_where_that_explains_more_than_the_surface_would(
    by_surface: float, named: bool
) -> None:
    fit = Footage(shape="ball", lights=6, sheen=(0.8, 6), solved=True).observed(0).rig_fit
    assert fit is not None
    assert fit.near is not None
    near = replace(fit.near, rise=0.5, misfit=0.6 * fit.misfit, by_surface=by_surface * fit.misfit)
    found = lights_near(replace(fit, near=near))
    assert (found is not None) == named


def test_a_dead_light_among_enough_others_is_named_and_left_out_and_the_rig_is_still_checked() -> None:
    dead = Footage(lights=6, gains=[1, 1, 0, 1, 1, 1], solved=True).observed(0)
    (line,) = lamps(dead)
    assert (line.grade, line.found) == (
        "doubtful", "The light 'light2' gives no light (0.0 % of the strongest); normals come from the other 5."
    )  # fmt: skip
    assert verdict_of([line, *rig_of(dead), *validity(dead)]) == "This take is usable, with reservations."
    wrong = Footage(shape="waves", lights=6, gains=[1, 1, 0, 1, 1, 1], claimed_deg=40, solved=True).observed(0)
    assert graded(rig_but_leaning(wrong), "rig") in ("doubtful", "bad")


def test_where_the_other_lights_lie_in_one_plane_that_is_said_and_not_that_normals_come_from_them() -> None:
    """Of five lights the two above and below were dead: more light was advised, and no normal was trusted."""
    dead = Footage(lights=6, gains=[1, 1, 0, 1, 1, 1], solved=True).observed(0)
    assert dead.points is not None
    dead.points = replace(dead.points, vectors=dead.points.vectors * [1, 0, 1])
    (line,) = lamps(dead)
    assert line.grade == "bad"
    assert "the other 5 lie in one plane" in line.found
    assert "line on lights first" in first_of_all((line,))


def test_a_dead_lights_name_is_a_guess_where_the_order_is() -> None:
    """Check and normals blamed two lamps for the same clip: each had guessed another order."""
    dead = Footage(lights=6, gains=[1, 1, 0, 1, 1, 1], solved=True).observed(0)
    (line,) = judge_lamps(dead, guessed=True)
    assert line.found.endswith("come from the other 5. As the order is a guess, it may be another one.")
    several = Footage(lights=6, gains=[1, 1, 0, 0, 1, 1], solved=True).observed(0)
    assert next(judge_lamps(several, guessed=True)).found.endswith("As the order is a guess, they may be others.")


def test_many_dead_lights_are_one_line() -> None:
    (line,) = lamps(Footage(lights=10, gains=[1, 1, 0, 1, 0, 0, 0, 0, 1, 1], solved=True).observed(0))
    assert line.found == (
        "5 lights give no light ('light2', 'light4', 'light5', 'light6' and 1 more; at most 0.0 % of the strongest); "
        "normals come from the other 5."
    )


@pytest.mark.parametrize(("dimmed", "failed"), [(1.0, False), (0.2, True)])
def test_a_light_does_not_fail_where_only_the_value_changes_at_which_it_clips(dimmed: float, failed: bool) -> None:
    """Lamps of several colours that are separated clip at another value in every round."""
    one = Observed(lights=("a", "b", "c"))
    for number in range(8):
        white = 5.0 if number == 2 else 1.0
        levels = tuple(level * (dimmed if number == 2 else 1.0) / white for level in (0.3, 0.2, 0.25))
        one.facts.append(
            InstantFacts(number=number, time_s=0.0, valid_share=1.0, clipped_share=0.0, unseen_share=0.0,
                         levels=levels, clipped=(0.0,) * 3, white=(white,) * 3, moving_share=0.0)
        )  # fmt: skip
    assert any("Nothing is lit in 1 of 8 rounds" in line.found for line in lamps(one)) == failed
    assert not any("flickers" in line.found for line in lamps(one))


COMES_IN = np.array([0.02, 0.05, 0.12, 0.22, 0.36, 0.55, 0.72, 0.82, 0.92, 0.98, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
"""What a lamp on the other side gives of its usual light while a subject comes into the picture, (round,)."""


@pytest.mark.parametrize(
    ("moving", "breaks", "failed"),
    [
        (0.1, None, 0),  # the subject shows its other side first
        (0.0, None, 5),  # nothing moved: it was the lamp, or a hand before it
        (0.1, (9, 11, 0.2), 2),  # and a lamp that fails meanwhile, or goes out while all others change
        (0.1, (2, 4, 0.05), 2),
    ],
)
def test_a_lamp_does_not_fail_where_a_subject_turns_to_it_by_and_by(
    moving: float, breaks: tuple[int, int, float] | None, failed: int
) -> None:
    levels = np.stack([0.24 * COMES_IN, 0.24 * (2 - COMES_IN), np.full(16, 0.3)], axis=1)
    if breaks is not None:
        first, after, left = breaks
        levels[first:after, 1] *= left
    one = Observed(lights=("a", "b", "c"), facts=KeptFacts(replace(o, moving_share=moving) for o in steady_but(levels)))
    said = [line.found for line in judge_lamps(one) if "failed" in line.found]
    assert len(said) == (failed > 0)
    assert all(
        f"in {failed} of 16 rounds" in line and f"light {'a' if breaks is None else 'b'!r}" in line for line in said
    )


def test_a_light_of_which_no_frame_showed_the_subject_is_not_called_dead() -> None:
    one = Footage(rounds=2).observed(0)
    one.counts[one.lights[0]] = np.zeros_like(one.counts[one.lights[0]])
    one.facts = KeptFacts(replace(fact, levels=(0.0, *fact.levels[1:])) for fact in one.facts)
    assert [line.grade for line in lamps(one)] == ["good"]


def test_a_light_that_was_never_seen_does_not_pass_for_a_bright_one() -> None:
    dim = np.full(1000, 0.005, np.float32)
    one = Observed(lights=("a", "b"))
    one.counts["a"], one.counts["b"] = count_levels(dim, 1.0), np.zeros_like(count_levels(dim, 1.0))
    (line,) = judge_exposure(one)
    assert (line.grade, "The picture is dark" in line.found) == ("bad", True)
    assert list(power_words(plan_of(("a", "b")), one)) == ["a"]


def test_lights_that_were_never_seen_are_not_said_to_fire() -> None:
    one = Observed(lights=("a", "b", "c"))
    bright = count_levels(np.full(100, 0.5, np.float32), 1.0)
    one.counts |= {"a": bright, "b": bright, "c": np.zeros_like(bright)}
    for number in range(4):
        one.facts.append(facts_of(number=number, levels=(0.4, 0.4, 0.4), clipped=(0.0,) * 3, white=(1.0,) * 3,
                                  unseen_share=0.1 if number else 0.0))  # fmt: skip
    (line,) = lamps(one)
    assert line.found == "The 2 of 3 lights that were seen fire; the weakest gives 0.0 stops less than the strongest."


def test_lamps_are_not_said_to_fire_where_nothing_is_lit() -> None:
    one = looked_at([even(name, 0.0) for name in "abc"])
    assert [line.subject for line in (*exposure(one), *lamps(one))] == ["exposure"]


@pytest.mark.parametrize(("moving", "named"), [(0.0, ["a", "b"]), (0.3, []), (None, [])])
def test_lamps_flicker_only_where_it_is_known_that_nothing_moves(moving: float | None, named: list[str]) -> None:
    levels = 0.3 * (1 + 0.1 * np.sin(np.outer(np.arange(10), [1.9, 1.3])))
    facts = [
        facts_of(levels=tuple(level), clipped=(0.0,) * 2, white=(1.0,) * 2, moving_share=moving)
        for level in levels.tolist()
    ]
    said = [
        line.found for line in lamps(Observed(lights=("a", "b"), facts=KeptFacts(facts))) if "flickers" in line.found
    ]
    assert [line.split("'")[1] for line in said] == named


@pytest.mark.parametrize("lights", [2, 3, 6])
def test_of_lights_that_all_change_together_the_camera_is_named_first(lights: int) -> None:
    """Each lamp was said to flicker, and its driver and supply were to be checked, under automatic exposure."""
    gains = 1 + 0.1 * np.sin(1.9 * np.arange(8))[:, None]
    own = 1 + 0.01 * np.random.default_rng(1).standard_normal((8, lights))
    one = Observed(lights=tuple("abcdef"[:lights]), facts=steady_but(0.3 * gains * own))
    (camera, all_fire) = lamps(one)
    assert (camera.subject, camera.grade, all_fire.grade) == ("gain", "doubtful", "good")
    assert camera.found.index("the camera") < camera.found.index("supply")


def steady_but(levels: np.ndarray) -> KeptFacts:
    """Return rounds in which nothing moves, of lights with levels (round, light)."""
    count = levels.shape[1]
    return KeptFacts(
        facts_of(levels=tuple(level), clipped=(0.0,) * count, white=(1.0,) * count, moving_share=0.0)
        for level in levels.tolist()
    )


def test_no_lamp_is_blamed_for_what_whole_frames_do() -> None:
    """As the frames' rows showed, which are known in time where plates are not."""
    levels = 0.3 * (1 + 0.1 * np.sin(np.outer(np.arange(10), [1.9, 1.3, 1.0])))
    one = Observed(lights=("a", "b", "c"), facts=steady_but(levels))
    camera = Swing(share=0.26, cause="camera")
    said = list(judge_lamps(one, swing=camera))
    assert [(line.subject, line.grade) for line in said] == [("gain", "doubtful"), ("lights", "good")]
    assert all("flickers" in line.found for line in judge_lamps(one, swing=replace(camera, cause="lamps")))
    (untimed,) = judge_lamps(one, timed=False, swing=replace(camera, cause="lamps"))
    assert (untimed.subject, untimed.grade) == ("lights", "doubtful")
    timing = timing_of(phase_error_rows=1.0, swing=camera)
    assert "exposure and gain first" in next(timing_and_order(timing, "rolling")).advice


def test_a_dark_slot_is_not_asked_for_where_the_plan_has_one() -> None:
    """A lamp that never fires looks as dark, so that nobody knows which of the two slots it is."""
    lit, dark = (
        Flash(index=n, slot=n, lights=lights, start_s=0.01 * n, duration_s=1e-3, complete=True)
        for n, lights in enumerate(({"a": 1.0}, {}))
    )
    for flashes, word in (((lit,), "Shoot with a dark slot"), ((lit, dark), "every light fires")):
        *_, order = timing_and_order(timing_of(order="guess", flashes=flashes), "rolling")
        assert (order.grade, order.subject) == ("doubtful", "order")
        assert word in order.advice
        assert ("Shoot" in order.advice) is (len(flashes) == 1)
        said = describe_timing(timing_of(order="guess", flashes=flashes))
        assert ("shows no marker" in said) is (len(flashes) == 1)
        assert ("every light fires" in said) is (len(flashes) == 2)


@pytest.mark.parametrize(("by", "word"), [(0.25, "grows by 2"), (-0.2, "fades by 1"), (0.03, "")])
@pytest.mark.parametrize("rounds", [6, 12, 60])
def test_a_lamp_that_warms_up_is_named_and_not_said_to_flicker(by: float, word: str, rounds: int) -> None:
    noise = 1 + 0.002 * np.random.default_rng(3).standard_normal((rounds, 4))
    levels = 0.3 * noise
    levels[:, 1] *= 1 - max(by, 0) + by * np.linspace(0, 1, rounds)
    said = lamps(Observed(lights=tuple("abcd"), facts=steady_but(levels)))
    assert [line.grade for line in said] == (["doubtful"] if word else ["good"])
    assert f"The light 'b' {word}" in said[0].found if word else "fire" in said[0].found


@pytest.mark.parametrize("rounds", [6, 7, 8, 9])
def test_a_lamp_that_flickers_is_not_said_to_drift(rounds: int) -> None:
    """What check looks at is 5 to 8 rounds: of four lamps that flickered by 8 % three were to warm up."""
    rng = np.random.default_rng(4)
    for _ in range(40):
        levels = 0.3 * (1 + 0.04 * rng.standard_normal((rounds, 3)) * [1, 0, 0])
        said = lamps(Observed(lights=("a", "b", "c"), facts=steady_but(levels)))
        assert not any("grows" in line.found or "fades" in line.found for line in said)


@pytest.mark.parametrize("rounds", [6, 12, 60])
@pytest.mark.parametrize("fading", ["a", "ab", "abc"])
@pytest.mark.parametrize("count", [2, 3, 4])
def test_lamps_that_give_what_they_gave_are_not_blamed_for_those_that_fade(
    count: int, fading: str, rounds: int
) -> None:
    """Where two of four faded by 14 %, the other two were said to grow by 6 %."""
    if len(fading) >= count:
        fading = fading[: count - 1]
    levels = 0.3 * (1 + 0.002 * np.random.default_rng(3).standard_normal((rounds, count)))
    levels[:, : len(fading)] *= 1 - 0.14 * np.linspace(0, 1, rounds)[:, None]
    said = [line.found for line in lamps(Observed(lights=tuple("abcd"[:count]), facts=steady_but(levels)))]
    assert len(said) == len(fading)
    for light, found in zip(fading, said, strict=True):
        assert re.search(f"The light '{light}' fades by (9|1[0-4]) %", found)


@pytest.mark.parametrize("rounds", [6, 7, 8, 30])
def test_a_lamp_that_fades_is_named_under_a_gain_that_swings(rounds: int) -> None:
    rng = np.random.default_rng(5)
    levels = 0.3 * (1 + 0.002 * rng.standard_normal((rounds, 4))) * (1 + 0.03 * (-1.0) ** np.arange(rounds))[:, None]
    levels[:, 1] *= 1 - 0.15 * np.linspace(0, 1, rounds)
    fading = [line.found for line in lamps(Observed(lights=tuple("abcd"), facts=steady_but(levels)))]
    assert [found[:19] for found in fading if " fades by 1" in found or " grows by " in found] == [
        "The light 'b' fades"
    ]


def test_one_light_is_not_compared_with_itself() -> None:
    assert [line.found for line in lamps(looked_at([even("a", 0.5)]))] == ["The light fires in every round."]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_light_that_the_plan_itself_sets_weak_is_not_held_against_the_rig(seed: int) -> None:
    gains = [1.0, 0.1, 1.0, 1.0]
    as_planned, weaker = (
        lamps(Footage(lights=4, gains=gains, powers=powers, solved=True).observed(seed))
        for powers in (ONE_WEAKER, (1.0,))
    )
    assert graded(as_planned, "lights") == "doubtful"  # its noise is larger, and no more
    assert graded(weaker, "lights") == "bad"


@pytest.mark.parametrize(("clipping", "words"), [(5, "all powers to"), (1, "its power"), (9, "their powers")])
def test_powers_to_lower_are_said_as_a_share_of_what_they_are(clipping: int, words: str) -> None:
    """Lamps at 40 % that clipped by far were told "lower all powers to 50 %", which is more."""
    lines = exposure(
        Footage(lights=5 if clipping <= 5 else clipping + 1, clip=0.16, clipping=clipping, noise=0).observed(0)
    )
    (line,) = (one for one in lines if one.subject == "clipping")
    assert words in line.advice
    assert re.search(r"\d %( of the| of) what (it is|they are)", line.advice)


@pytest.mark.parametrize(("planned", "said"), [(0.04, "to 0.4 % (now 4 %)"), (0.5, "to 5 % (now 50 %)")])
def test_no_power_is_advised_as_nothing(planned: float, said: str) -> None:
    one = Observed(lights=("a",), counts={"a": count_levels(np.full(100, 2, np.float32), 1.0)})
    plan = plan_of(("a",))
    flashes = tuple(replace(flash, lights={"a": planned}) for flash in plan.flashes)
    assert said in power_words(replace(plan, flashes=flashes), one)["a"]


@pytest.mark.parametrize(
    ("read", "said"),
    [(1e-8, ["enough", "enough"]), (6e-6, ["is right", "aperture by 2.0 stops"]), (1e-4, ["2.0 stops", "4.0 stops"])],
)
def test_powers_of_log_footage_are_judged_by_noise_and_not_by_the_largest_code(read: float, said: list[str]) -> None:
    """The largest code of S-Log3 lies five stops above its white: 'open the aperture by 6.0 stops' would have clipped
    any sensor."""
    one = Observed(lights=("a", "b"), closely=CloseLooks(noises=[AgainstNoise(level=0.0725, read=read, photon=0.0)]))
    for name, level in (("a", 0.0725), ("b", 0.0725 / 4)):
        one.counts[name] = count_levels(np.full(1000, level, np.float32), 1.0)
    plan = plan_of(one.lights)
    log = replace(plan, camera=replace(plan.camera, encoding=Encoding(transfer="slog3")))
    words = power_words(log, one)
    assert [part in words[name] for name, part in zip("ab", said, strict=True)] == [True, True], words
    known = replace(log, camera=replace(log.camera, encoding=Encoding(transfer="slog3", white_level=900)))
    assert "3.5 stops" in power_words(known, one)["a"]
    assert power_words(log, replace(one, closely=CloseLooks())) == {}


@pytest.mark.parametrize(("gain", "weak"), [(0.15, False), (0.1, True)])
def test_where_a_light_is_known_to_be_weaker_than_the_rig_says_no_turned_rig_is_named(gain: float, weak: bool) -> None:
    one = Footage(lights=3, gains=[1.0, gain, 1.0], solved=True).observed(0)
    one.closely.leans[:] = [Lean(lean_deg=20.0, gain=1.0, turn_deg=(0.0, 20.0, 0.0), rest_deg=0.2)]
    one.closely.outward.clear()  # as of what has no outline
    one.closely.slopes[:] = [0.9]
    said = " ".join(line.found for line in rig_of(one))
    one.closely.slopes[:] = [0.2]
    assert any("mirrored" in line.found for line in rig_of(one)) is not weak
    assert ("swung to the left or right" in said) is not weak
    assert ("'light1'" in said) is weak


def test_under_three_lights_strengths_may_be_why_normals_lean() -> None:
    one = Footage(lights=3, claimed_gain=2.0, solved=True).observed(0)
    (line,) = rig_of(one)
    assert line.grade != "good"
    assert "directions or strengths" in line.found or "other strengths" in line.found
    assert "exchanged" in line.found
