"""Judgements on how far off a typical normal is by more than noise, and on near lights' distance."""

from collections.abc import Iterator, Sequence
from math import inf

from psvideo.report.judge.of_strengths import other_strengths
from psvideo.report.judge.rig_by_plates import OF_FOUR, OF_MORE
from psvideo.report.judge.typical_error import (
    COMMON_DEG,
    LOST_DEG,
    by_noise_deg,
    by_slope_deg,
    distance_unknown_share,
    likely_deg,
    moves,
    off_deg,
    rig_explains,
    three_fire,
)
from psvideo.report.judgement import Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed

MOSTLY = 0.7
"""From OF_MORE of the light on that another rig would explain and this one cannot, directions are doubted; or from this
share of what is left over on: of matte subjects a rig that is off leaves little else (0.9 of it, one of five lights 5
degrees off; 0 under haze and of gloss, which no rig explains)."""
UNKNOWN_DISTANCE = 0.1
"""From this share of the subject on, what is not known of near lights' distance is said: it costs as many normals."""
MOVING_FACTOR = 2.0
"""Where the picture moves, this many times more may be left unexplained: no rig explains what moved between flashes."""
HALF = 0.5
"""From this share of what normals are off by on, albedo that goes with the slope is what shows it: more lights at the
same angle to the lens would not."""
GOES_WITH_SLOPE = (
    "goes with the slope, which paint seldom does: light shines through the surface (skin, wax) or comes from "
    "everywhere (haze, flare, a bright room), the surface shines, or lamps are not as strong as the rig says"
)
BESIDE_THE_OTHERS = (
    "These lights cannot tell which, nor take it off: six or more do that stand at different angles to the lens, one "
    "of them close beside it. Or measure strengths on a white card (psvideo calibrate flat-field), clear the air and "
    "darken the room"
)


def accuracy(observed: Observed) -> Iterator[Judgement]:
    """Judge how far off a typical normal is by more than noise, and what makes it so."""
    error_deg = off_deg(observed)
    if error_deg is None and (by_albedo := off_by_albedo(observed)):
        yield by_albedo
        return
    if error_deg is None and three_fire(observed) and _solved(observed.facts):
        yield Judgement(
            subject="accuracy",
            grade="unknown",
            found="How far normals are off beyond noise is not known: three lights explain any surface, also one that "
            "shines or lies in other light, and cannot check each other. On photographs of a ball, a bear, a "
            "cat and a sphere typical normals were off by 3 to 11 degrees under three. Four lights and more show it.",
            advice='Normals with `aov=["error"]` count what such surfaces left, and how far noise spreads.',
        )
    if error_deg is None or error_deg < by_noise_deg(observed.facts):  # what noise hides cannot be told from it
        return
    common_deg = COMMON_DEG * (MOVING_FACTOR if moves(observed.facts) else 1)
    found = f"Beyond noise, a typical normal is off by {_amount(error_deg, observed, common_deg)}"
    if error_deg <= common_deg:
        yield Judgement(subject="accuracy", grade="good", found=f"{found}.")
        return
    cause, advice = _why_off(observed)
    yield Judgement(
        subject="accuracy",
        grade="bad" if error_deg > LOST_DEG else "doubtful",
        found=f"{found}: {cause}.",
        advice=f'{advice}; normals with `aov=["error"]` say how far off each pixel may be.',
    )


def off_by_albedo(observed: Observed) -> Judgement | None:
    """Judge how far off a typical normal is where nothing but albedo that goes with the slope shows it."""
    slope_deg = by_slope_deg(observed.facts)
    if slope_deg <= COMMON_DEG or three_fire(observed) or not rig_explains(observed):
        return None
    return Judgement(
        subject="accuracy",
        grade="bad" if slope_deg > LOST_DEG else "doubtful",
        found=f"A typical normal is off by {_amount(slope_deg, observed, COMMON_DEG)}: albedo {GOES_WITH_SLOPE}"
        f"{_or_directions(observed)}.",
        advice=f'{BESIDE_THE_OTHERS}; normals with `aov=["error"]` say how far off each pixel may be.',
    )


def _amount(error_deg: float, observed: Observed, common_deg: float) -> str:
    """Say how far off a typical normal is likely to be, within the borders of the grade that its error has."""
    borders_deg = (common_deg, LOST_DEG, inf)
    begins_deg = max((border for border in borders_deg if border < error_deg), default=0.0)
    ends_deg = min(border for border in borders_deg if border >= error_deg)
    likely = likely_deg(observed)
    amount_deg = error_deg if likely is None else min(max(likely, begins_deg), ends_deg)
    return f"about {amount_deg:.0f} degrees" if amount_deg > 1.5 else "no more than about a degree"


def _or_directions(observed: Observed) -> str:
    fit = observed.rig_fit
    doubted = fit is not None and fit.by_rig > OF_FOUR
    return "; or directions of the lights are off, which would explain what is left over" if doubted else ""


def _why_off(observed: Observed) -> tuple[str, str]:
    """Return what makes normals wrong beyond noise, and what to do about it."""
    if any(one.shows for one in observed.closely.astray):
        return "the pictures are not aligned", "See the line on motion"
    fit = observed.rig_fit
    if fit is not None and fit.exchanged is not None:
        return "two lights are exchanged", "See the line on the rig"
    if fit is not None and other_strengths(observed.firing_lights, fit):
        return "some lights are not as strong as the rig says", "See the line on the rig"
    if fit is not None and fit.by_rig > min(OF_MORE, MOSTLY * fit.misfit):
        return (
            "other directions of the lights would explain more: they are a few degrees off, or the surface is glossy",
            "Measure the lights on a sphere beside the subject",
        )
    alike = by_slope_deg(observed.facts) > HALF * (off_deg(observed) or 0.0)
    return (
        "the surface is not quite matte, or light comes by way of others (gloss, creases, soft shadows)",
        f"More lights, far apart{' and at other angles to the lens than these' if alike else ''}, average it out",
    )


def distance(observed: Observed) -> Iterator[Judgement]:
    """Judge how much of the subject lies where near lights' distance is not known, which is no fault of its surface."""
    share = distance_unknown_share(observed)
    if share > UNKNOWN_DISTANCE:
        yield Judgement(
            subject="distance",
            grade="doubtful",
            found=f"The lights are near, and in {100 * share:.0f} % of the subject's pixels too little is known of how "
            "far away they are (in shadow beside what stands before them, where few lights reach, or where it is dim): "
            "normals there may be turned too far to be trusted. This counts pixels, one by one: where a whole surface "
            "stands, as depth says it, is found from all of its pixels together.",
            advice="Give a depth that is known (`depth`), place the lights farther away, or use more of them.",
        )


def _solved(facts: Sequence[InstantFacts]) -> bool:
    return any(one.valid_share is not None for one in facts)
