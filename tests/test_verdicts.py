"""Every threshold of a verdict separates footage that is just good from footage that is just not."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from judged_footage import (
    ONE_QUICKLY,
    Footage,
    accuracy,
    exposure,
    graded,
    lamps,
    rig_but_leaning,
    rig_of,
    validity,
)

from psvideo.model.surface import Misfit
from psvideo.report.judge import of_steadiness, of_validity, typical_error
from psvideo.report.judge.of_ambient import ambient
from psvideo.report.judgement import Judgement
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.steadiness import Change


def flickering(share: float) -> list[list[float]]:
    """Return gains by which the second light's level jumps by a share of it from round to round."""
    return [[1.0, 1.0 + share * (n % 2), 1.0, 1.0, 1.0] for n in range(6)]


def missing(count: int, left: float) -> list[list[float]]:
    """Return gains by which the second light gives only a part in some of twelve rounds."""
    return [[1.0, left if n < count else 1.0, 1.0, 1.0, 1.0] for n in range(12)]


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """What is judged, of which subject, and footage on both sides of the border with its grades."""

    name: str
    judge: Callable[[Observed], Any]
    subject: str
    good: Footage
    grade: str = "good"
    worse: Footage
    worse_grade: str = "doubtful"


def _by(name: str, judge: Callable[[Observed], Any], subject: str, good: dict[str, Any], worse: dict[str, Any],
        grades: str = "good doubtful", **both: Any) -> Threshold:  # fmt: skip
    grade, worse_grade = grades.split()
    return Threshold(
        name=name,
        judge=judge,
        subject=subject,
        good=Footage(**both, **good),
        grade=grade,
        worse=Footage(**both, **worse),
        worse_grade=worse_grade,
    )


LIT = [
    _by("dim", exposure, "exposure", {"stops": -3.4}, {"stops": -3.7}),
    _by("dark", exposure, "exposure", {"stops": -5.8}, {"stops": -6.3}, "doubtful bad"),
    _by("clips", exposure, "clipping", {"clip": 0.016}, {"clip": 0.025}, "nothing doubtful", noise=0),
    _by("clips much", exposure, "clipping", {"clip": 0.26}, {"clip": 0.32}, "doubtful bad", noise=0, lights=4,
        clipping=2),
    _by("enough are spared", exposure, "clipping", {"clipping": 1}, {"clipping": 4}, "doubtful bad", noise=0, clip=0.4),
    _by("clips much of three", exposure, "clipping", {"clip": 0.07}, {"clip": 0.11}, "doubtful bad", noise=0, lights=3,
        clipping=3),
    _by("all clip", exposure, "clipping", {"clip": 0.29}, {"clip": 0.34}, "doubtful bad", noise=0, clipping=5),
    _by("weak", lamps, "lights", {"gains": [1, 0.15, 1, 1, 1]}, {"gains": [1, 0.1, 1, 1, 1]}),
    _by("dead", lamps, "lights", {"gains": [1, 0.012, 1]}, {"gains": [1, 0.008, 1]}, "doubtful bad", lights=3),
    _by("missed", lamps, "lights", {"gains": missing(1, 0.55)}, {"gains": missing(1, 0.45)}, rounds=12),
    _by("missed often", lamps, "lights", {"gains": missing(1, 0.3)}, {"gains": missing(2, 0.3)}, "doubtful bad",
        rounds=12),
    _by("unsteady", lamps, "lights", {"gains": flickering(0.016)}, {"gains": flickering(0.025)}, rounds=6),
    _by("ambient", ambient, "ambient", {"ambient": [0.09]}, {"ambient": [0.11]}),
    _by("ambient lost", ambient, "ambient", {"ambient": [0.48]}, {"ambient": [0.52]}, "doubtful bad"),
    _by("ambient swings", ambient, "ambient", {"ambient": [0.074, 0.087]}, {"ambient": [0.07, 0.09]}, rounds=6),
    _by("ambient noticed", ambient, "ambient", {"ambient": [0.03, 0.06]}, {"ambient": [0.04, 0.08]}, rounds=6),
    _by("ambient measured", ambient, "ambient", {"measured": 0.82}, {"measured": 0.78}, ambient=[0.03]),
    _by("ambient faint", ambient, "ambient", {"ambient": [0.018]}, {"ambient": [0.023]}, measured=0.7),
    _by("focus", of_steadiness.focus, "focus", {"blur_px": 2.5}, {"blur_px": 3.2}, shape="tiles"),
]  # fmt: skip


def steadiness(one: Observed) -> list[Judgement]:
    return list(of_steadiness.steadiness(one.facts))


SOLVED = [
    _by("rig", rig_but_leaning, "rig", {"claimed_deg": 15}, {"claimed_deg": 26}, "nothing doubtful", shape="waves",
        lights=8),
    _by("rig lost", rig_but_leaning, "rig", {"claimed_deg": 26}, {"claimed_deg": 40}, "doubtful bad", shape="waves",
        lights=8),
    _by("strength", rig_of, "rig", {"claimed_gain": 1.15}, {"claimed_gain": 1.4}, "nothing doubtful", shape="waves"),
    _by("turned", rig_but_leaning, "rig", {"turned_deg": 24}, {"turned_deg": 27}, "nothing doubtful", shape="waves",
        lights=3),
    _by("turned around", rig_but_leaning, "rig", {"turned_deg": 31}, {"turned_deg": 35}, "doubtful bad", shape="waves",
        lights=3),
    _by("accuracy", accuracy, "accuracy", {"claimed_deg": 1}, {"claimed_deg": 5}, shape="waves", lights=8),
    _by("noise alone", validity, "validity", {"noise": 0.025}, {"noise": 0.032}, "doubtful bad"),
    _by("weak beside the rig", lamps, "lights", {"gains": [1, 0.15, 1]}, {"gains": [1, 0.1, 1]}, "good bad", lights=3),
    _by("tilted", rig_of, "rig", {"claimed_tilt_deg": 5}, {"claimed_tilt_deg": 9}, "nothing doubtful", lights=3),
    _by("tilted much", rig_of, "rig", {"claimed_tilt_deg": 14}, {"claimed_tilt_deg": 19}, "doubtful bad", lights=8),
    _by("rolled", rig_of, "rig", {"turned_deg": 8}, {"turned_deg": 10}, lights=4),
    _by("away", rig_but_leaning, "rig", {"claimed_tilt_deg": 40}, {"claimed_tilt_deg": 50}, "good bad"),
    _by("sRGB as light", rig_of, "rig", {"recorded": "linear"}, {"recorded": "srgb"}, noise=0.0005),
    _by("light as sRGB", rig_of, "rig", {"recorded": "linear"}, {"recorded": "undone"}),
    _by("near", rig_of, "rig", {"near": 18}, {"near": 14}, shape="waves"),
    _by("near lost", rig_of, "rig", {"near": 4.2}, {"near": 3.3}, "doubtful bad", shape="waves"),
    _by("validity", validity, "validity", {"dark": 0.35}, {"dark": 0.45}),
    _by("validity lost", validity, "validity", {"dark": 0.75}, {"dark": 0.85}, "doubtful bad"),
    _by("noise", steadiness, "noise", {"noise": 0.015}, {"noise": 0.022}, "nothing doubtful",
        shape="waves", stops=-0.1, rounds=2, lights=3),
    _by("noise lost", steadiness, "noise", {"noise": 0.042}, {"noise": 0.06}, "doubtful bad",
        shape="waves", stops=-0.1, rounds=2, lights=3),
    _by("flicker", steadiness, "flicker", {"gains": [[1.0] * 3, [1.008] * 3]}, {"gains": [[1.0] * 3, [1.013] * 3]},
        rounds=2, lights=3),
]  # fmt: skip


@pytest.mark.parametrize("case", LIT, ids=lambda case: case.name)
@pytest.mark.parametrize("seed", ONE_QUICKLY)
def test_light_on_both_sides_of_a_threshold_is_told_apart(case: Threshold, seed: int) -> None:
    assert graded(case.judge(case.good.observed(seed)), case.subject) == case.grade
    assert graded(case.judge(case.worse.observed(seed)), case.subject) == case.worse_grade


@pytest.mark.parametrize("case", SOLVED, ids=lambda case: case.name)
@pytest.mark.parametrize("seed", ONE_QUICKLY)
def test_results_on_both_sides_of_a_threshold_are_told_apart(case: Threshold, seed: int) -> None:
    assert graded(case.judge(replace(case.good, solved=True).observed(seed)), case.subject) == case.grade
    assert graded(case.judge(replace(case.worse, solved=True).observed(seed)), case.subject) == case.worse_grade


def test_what_is_left_beyond_noise_makes_a_take_doubtful_and_then_bad_whatever_is_to_blame() -> None:
    one = Footage().observed(0)

    def said(off_deg: float) -> tuple[str, str]:
        misfit = Misfit(share=0.1, error_deg=off_deg / typical_error.MEAN_OF_HELD)
        one.facts = KeptFacts(replace(facts, misfit=misfit, valid_share=0.1, measured_share=1.0) for facts in one.facts)
        return graded(accuracy(one), "accuracy"), graded(validity(one), "validity")

    assert [said(off_deg) for off_deg in (2.9, 3.1, 14.9, 15.1)] == [
        ("good", "bad"), ("doubtful", "doubtful"), ("doubtful", "doubtful"), ("bad", "bad")
    ]  # fmt: skip


@pytest.mark.parametrize(("noise_deg", "blamed"), [(3.9, "Move slower, raise"), (4.1, "Noise alone turns")])
def test_where_noise_alone_spoils_normals_motion_is_not_blamed(noise_deg: float, blamed: str) -> None:
    one = Footage().observed(0)
    misfit = Misfit(share=0.01, error_deg=6.0, noise_deg=noise_deg / typical_error.MEAN_OF_HELD)
    one.facts = KeptFacts(
        replace(facts, misfit=misfit, valid_share=0.16, measured_share=0.98, moving_share=0.14) for facts in one.facts
    )
    (lacking,) = of_validity.validity(one)
    assert blamed in lacking.advice


@pytest.mark.parametrize(
    ("noise", "near", "advised"),
    [
        (0.04, False, "Give more light"),
        (0.004, False, "brighter ones do not help"),
        (0.004, True, "depth that is known"),
    ],
)
@pytest.mark.parametrize("seed", ONE_QUICKLY)
def test_more_light_is_advised_where_plates_are_noisy_though_means_over_rounds_are_steady(
    noise: float, near: bool, advised: str, seed: int
) -> None:
    """What is not trusted shows the mean of several rounds. It changed by 0.6 degrees, and "brighter ones do not help"
    was said, where four times the light left half a per cent untrusted instead of 13."""
    one = Footage(shape="waves", lights=4, rounds=2, solved=True, noise=noise).observed(seed)
    steady = Change(normals_deg=0.6, albedo_percent=0.4, level_percent=0.0)
    one.facts = KeptFacts(
        replace(facts, valid_share=0.3, measured_share=0.9, change=steady, misfit=None) for facts in one.facts
    )
    if near:
        assert one.points is not None
        one.points = replace(one.points, vectors=np.repeat(one.points.vectors, len(one.points.rows), axis=0))
    (lacking,) = of_validity.validity(one)
    assert advised in lacking.advice
    assert ("brighter" in advised) == ("brighter" in lacking.advice)


@pytest.mark.parametrize(("share", "said"), [(0.004, "0 % of the subject"), (0.006, "1 % of the subject")])
def test_where_nothing_is_trusted_there_is_no_elsewhere(share: float, said: str) -> None:
    one = Footage().observed(0)
    one.facts = KeptFacts(replace(facts, valid_share=share, measured_share=0.98) for facts in one.facts)
    (lacking,) = of_validity.validity(one)
    assert said in lacking.found
    assert ("everywhere" in lacking.found) == (share < 0.005)
    assert ("elsewhere" in lacking.found) == (share > 0.005)


@pytest.mark.parametrize("fill", [True, False])
def test_validity_is_counted_over_the_subject_filled_or_not_before_a_dim_backdrop(fill: bool) -> None:
    one = Footage(dark=0.45, solved=True, fill=fill)
    for backdrop in (0.0, 0.02):
        (facts,) = replace(one, backdrop=backdrop).observed(0).facts
        assert facts.valid_share is not None
        assert 0.48 < facts.valid_share < 0.58, "of the ball; what is behind it counts neither way"
