"""The judgement on how much of the subject has a normal to be trusted, and on what the rest lacks."""

from collections.abc import Iterator, Sequence

import numpy as np

from psvideo.report.judge.of_accuracy import GOES_WITH_SLOPE, accuracy, distance, off_by_albedo
from psvideo.report.judge.typical_error import (
    COMMON_DEG,
    LOST_DEG,
    NOISY_DEG,
    by_noise_deg,
    by_slope_deg,
    moves,
    off_deg,
    steady_beyond_noise,
    three_fire,
)
from psvideo.report.judgement import Grade, Judgement
from psvideo.report.observe.observed import Observed

LITTLE_NOISE_DEG = 1.0
"""Where noise turns normals by less, more light makes none of them trusted."""
LEAST_VALID, HARDLY_VALID = 0.6, 0.2
"""Shares of the subject: three lights that stand well reach more of most subjects than the first."""
NONE_VALID = 0.05
"""With less, what is good for a look is all that is left: no take to be used where no line says how far normals are
off. (A cat under twelve directions that are a few degrees off: as little, and accuracy says by how much.)"""
NONE_SAID = 0.005
"""With less, the share is said as 0 %, and there is nothing elsewhere."""
REACH_MORE = (
    " Beyond that, place the lights nearer to the camera's axis, or use more of them, so that three reach every part."
)
CLIPPING_FIRST = f"See the line on clipping first: what clips is no measurement, and more light clips more.{REACH_MORE}"
ALL_REACHED = 0.995
"""From this share on all of the subject is said to be reached, and nothing of how to reach more."""
EXPOSURE_FIRST = "See the line on exposure first: noise alone may turn normals that far."
RIG_FIRST = "See the line on the rig first: normals that are off for the lights' sake are no better for more light."
LIGHTS_FIRST = "See the line on lights first: what it names costs normals."
NEAR_ONES = (
    "The lights are near, and few of them do not show well how far away each part is: give a depth that is known "
    '(`depth`), use more lights, or measure these again. Normals with `aov=["error"]` say how far off each pixel may '
    "be."
)
CURVE_FIRST = "First read the files by their own curve: a wrong one looks like motion and like an uneven surface."


def first_of_all(lines: Sequence[Judgement], *, curve_doubted: bool = False) -> str:
    """Return which of the lines said so far to mend before validity is looked at, empty where none; ``curve_doubted``:
    the files are likely read by another curve than their own."""
    doubted = {one.subject for one in lines if one.grade in ("doubtful", "bad")}
    if curve_doubted:
        return CURVE_FIRST
    if any(one.subject == "lights" and one.grade == "bad" for one in lines):
        return LIGHTS_FIRST
    if "exposure" in doubted:
        return EXPOSURE_FIRST
    if "clipping" in doubted:
        return CLIPPING_FIRST
    return RIG_FIRST if "rig" in doubted else ""


def validity(observed: Observed, *, first: str = "") -> Iterator[Judgement]:
    """Judge how much of the subject has a normal to be trusted, and what the rest lacks; ``first`` is what to do before
    anything else, as ``first_of_all`` says it."""
    known = [one for one in observed.facts if one.valid_share is not None]
    if not known:
        return
    shares = [one.valid_share or 0.0 for one in known]
    usual, least, most = float(np.median(shares)), min(shares), max(shares)
    found = f"{100 * usual:.0f} % of the subject has a normal to be trusted"
    if usual >= LEAST_VALID:
        worst = f" ({100 * least:.0f} % in the worst round)" if len(known) > 1 else ""
        yield Judgement(subject="validity", grade="good", found=f"{found}{worst}.")
        return
    reached = [one.measured_share for one in known if one.measured_share is not None]
    reach = float(np.median(reached)) if reached else 0.0
    enough = reach >= LEAST_VALID
    said = enough and _said_by_accuracy(observed, most)
    grade: Grade = "bad" if most < HARDLY_VALID and not said else "doubtful"
    if enough:
        rest = "its predicted error is too large everywhere"
        if usual >= NONE_SAID:
            rest = "elsewhere its predicted error is too large"
        yield Judgement(
            subject="validity",
            grade=grade,
            found=f"Three lights reach {100 * reach:.0f} % of the subject, and {found}: "
            f"{rest}." + (" These normals serve a look, and no measurement." if usual < NONE_VALID else ""),
            advice=(first.removesuffix(REACH_MORE) if reach >= ALL_REACHED else first) or _trusting(observed),
        )
        return
    yield Judgement(
        subject="validity",
        grade=grade,
        found=f"Only {found}.",
        advice=first
        or "Give the subject more light, place the lights nearer to the camera's axis, or use more of them, so "
        "that three reach every part.",
    )


def _said_by_accuracy(observed: Observed, most: float) -> bool:
    """Return whether it is the surface that makes few normals trusted, of ``most`` of the subject at best: accuracy has
    its own line for that, and its own measure."""
    beyond_deg = off_deg(observed)
    if beyond_deg is None and off_by_albedo(observed):
        beyond_deg = by_slope_deg(observed.facts)
    if beyond_deg is None:
        return steady_beyond_noise(observed) and most >= NONE_VALID
    return max(COMMON_DEG, by_noise_deg(observed.facts)) < beyond_deg <= LOST_DEG


def _trusting(observed: Observed) -> str:
    """Say what would make more normals to be trusted: what accuracy says is to blame, or more light where noise is."""
    said = any(one.grade in ("doubtful", "bad") for one in accuracy(observed))
    if three_fire(observed) and by_slope_deg(observed.facts) > COMMON_DEG:
        return (
            f"Albedo {GOES_WITH_SLOPE}; or paint does so here. Three lights cannot tell. Use a fourth light, which "
            "shows how far normals are off, or six or more at different angles to the lens, which take most of it off. "
            'Normals with `aov=["error"]` say how far off each pixel may be.'
        )
    if off_deg(observed) is None and steady_beyond_noise(observed) and not (said or moves(observed.facts)):
        if observed.points is not None and observed.points.near:
            return NEAR_ONES
        return (
            "Measure the lights again, clear the air and darken the room, or use more lights; brighter ones do not "
            'help. Normals with `aov=["error"]` say how far off each pixel may be.'
        )
    noise_deg = by_noise_deg(observed.facts)
    if moves(observed.facts) and noise_deg > NOISY_DEG:
        return (
            f"Noise alone turns a typical normal by {noise_deg:.0f} degrees: give more light, or use more lights. What "
            'moves must move slower besides, if it is lost then. Normals with `aov=["error"]` say how far off each '
            "pixel may be."
        )
    if moves(observed.facts):
        return (
            "Move slower, raise the frame rate or flash fewer lights, and give fine detail to follow: plates of what "
            "moves must be brought together. If nothing moved, light flickers, or the movie's coding changes the "
            'pictures. Normals with `aov=["error"]` say how far off each pixel may be.'
        )
    if said and noise_deg < LITTLE_NOISE_DEG:
        return "More light does not help; the line on the typical error says what does."
    if next(distance(observed), None) is not None:
        return "More lights help, and a depth that is known; the line on distance says why."
    return "Give more light, or use more lights" + (
        "." if said else '; normals with `aov=["error"]` say how far off each pixel may be.'
    )
