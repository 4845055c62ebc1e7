"""The rig judged by slopes: whether normals are those of one surface, as they are."""

import numpy as np

from psvideo.report.judge.rig_by_facing import as_it_is_seen, faces_outwards
from psvideo.report.judge.rig_by_lean import EXACT_LIGHTS, LEANS_DEG
from psvideo.report.judge.rig_by_plates import surface_leaves
from psvideo.report.judge.typical_error import distance_unknown_share, moves, quiet
from psvideo.report.judgement import Grade, Judgement
from psvideo.report.observe.observed import Observed

ONE_SURFACE, BY_SHINING = 0.8, 0.2
"""Slopes that agree by the first, and that no lean removes by more than the second, are one surface's. So the rig's
directions are right, and what shines explains the rest (a coin of metal under 6 to 24 lights: 0.83 to 0.97 and 0.01 to
0.05; the same lights off by 10 degrees each: 0.91 and 0.24, by 20 degrees: 0.77 and 0.31)."""
AGREE, DISAGREE = 0.3, -0.1
"""Slopes that agree by less than the first are hardly those of one surface; by less than the second, surely not."""
ELSEWHERE = 0.5
"""Where near lights' distance is not known in more of the subject than this, normals are first turned by that: under a
right rig, slopes of a ball before a wall agreed by 0.03 to 0.09 under 5 and 8 lights at half to one of its widths."""
OR_SHINES = "much of the surface shines, for no other rig would explain what is left over, or "
TOO_FAR_DEG, AGREE_FAR = 8.0, 0.15
"""Slopes of normals that are so far off agree badly under the right rig too: then they must agree by the second. (A
bear's under eight lights in one plane: 0.21; five lights of which each is taken for the next: 0.11.)"""


def surface_shines(observed: Observed) -> bool:
    """Return whether normals are those of one surface as they are: then it is the surface that is not matte."""
    agreement = float(np.median(observed.closely.slopes)) if observed.closely.slopes else 0.0
    leans = [one for one in observed.closely.leans if one.lean_deg > LEANS_DEG and one.gain > BY_SHINING]
    return agreement >= ONE_SURFACE and len(leans) <= len(observed.closely.leans) / 2


def lights_crossed(observed: Observed, *, guessed: bool) -> Judgement | None:
    """Judge whether directions are mirrored or lights exchanged; ``guessed``: which light is which is a guess."""
    agreement = float(np.median(observed.closely.slopes)) if observed.closely.slopes else 1.0
    far = max((one.misfit.error_deg for one in observed.facts if one.misfit is not None), default=0.0) > TOO_FAR_DEG
    if agreement > (AGREE_FAR if far else AGREE) or not quiet(observed.facts):
        return None
    if agreement > DISAGREE and moves(observed.facts):
        return None
    cannot = f"The normals cannot be those of one surface (agreement of slopes {agreement:.2f}, 1 at best)"
    grade: Grade = "bad" if agreement < DISAGREE else "doubtful"
    if guessed:
        return Judgement(
            subject="rig",
            grade=grade,
            found=f"{cannot}: the order of the lights is a guess, and hardly the true one.",
            advice="Try the other lights as `first_light`, one after the other: with the right one this line is gone.",
        )
    if int(observed.firing.sum()) == EXACT_LIGHTS:
        return Judgement(
            subject="rig",
            grade=grade,
            found=f"{cannot}: {_why_of_three(observed)}{as_it_is_seen(observed)}",
            advice="Check that the rig file is in camera axes (x right, y up), belongs to this set-up, and names the "
            "lights as the plan does. If it does, add lights.",
        )
    elsewhere = distance_unknown_share(observed) > ELSEWHERE
    fit = observed.rig_fit
    gloss = agreement > DISAGREE and fit is not None and surface_leaves(fit)
    of_distance = "most of it may be nearer or farther away than assumed (see the line on distance), or "
    return Judgement(
        subject="rig",
        grade="doubtful" if elsewhere else grade,
        found=f"{cannot}: {of_distance if elsewhere else ''}{OR_SHINES if gloss else ''}directions are mirrored or "
        "turned, or lights exchanged."
        f"{as_it_is_seen(observed)}",
        advice=("If the line stays once the distance is known, check" if elsewhere else "Check") + " that the rig file "
        "is in camera axes (x right, y up), belongs to this set-up, and names the lights as the plan does; calibrate "
        "again if anything was moved.",
    )


def _why_of_three(observed: Observed) -> str:
    apart = "much of the surface shines or lies in shadow, which three lights do not tell apart."
    if faces_outwards(observed):
        return f"directions are off, or {apart} Lights are hardly exchanged: normals face outwards at the outline."
    return f"directions are mirrored or turned, lights exchanged, or {apart}"
