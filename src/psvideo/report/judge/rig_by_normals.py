"""The rig judged by normals: whether they can be those of one surface, as they are or all tilted alike."""

from collections.abc import Sequence

import numpy as np

from psvideo.report.judge.of_exposure import LOST_CLIPPED
from psvideo.report.judge.typical_error import (
    AT_REST,
    LOST_DEG,
    NOISY_DEG,
    by_noise_deg,
    distance_unknown_share,
    moves,
    off_deg,
)
from psvideo.report.judgement import Grade, Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.yuille1997 import Lean

ONE_SURFACE, BY_SHINING = 0.8, 0.2
"""Slopes that agree by the first, and that no lean removes by more than the second, are one surface's. So the rig's
directions are right, and what shines explains the rest (a coin of metal under 6 to 24 lights: 0.83 to 0.97 and 0.01 to
0.05; the same lights off by 10 degrees each: 0.91 and 0.24, by 20 degrees: 0.77 and 0.31)."""
AGREE, DISAGREE = 0.3, -0.1
"""Slopes that agree by less than the first are hardly those of one surface; by less than the second, surely not."""
ELSEWHERE = 0.5
"""Where near lights' distance is not known in more of the subject than this, normals are first turned by that: under a
right rig, slopes of a ball before a wall agreed by 0.03 to 0.09 under 5 and 8 lights at half to one of its widths."""
MOST_AWAY = 0.05
"""Of measured normals, the share that may face away from the camera: what a camera sees faces it."""
OUTWARD, SURELY_OUTWARD = 0.55, 0.7
"""At outlines normals of right rigs face outwards by a cosine of 0.69 to 1 in the mean: 205 sets of 3 to 12 lights of
seven photographed and rendered subjects. Where two of three lights are exchanged, or all three go round, it was below
the first in 205 of 210, 0.72 at most; in 21 of these slopes agreed as a surface's do."""
HARDLY, INSIDE_OUT = 0.4, -0.7
"""Below the first nothing but the rig explains it; below the second normals face inwards everywhere."""
LEANS_DEG, BY_LEANING = 6.0, 0.1
"""Normals would be one surface's if all were changed by more than the first; that says something of the rig where it
leaves less over by the second, a share of what it leaves."""
MORE_THAN_SHOWN, SURELY_MORE = 2.0, 4.0
"""A lean says something of the rig where it is more than this many times what residuals show: where lights are each
wrong in a way of their own, which accuracy says, normals lean by up to 3.5 times that. (Under a rig that is turned as a
whole: 25 times on virtual subjects, 2 to 4 times on photographs.)"""
SURELY_LEANING = 0.5
"""Photographs gain less, of what is glossy or in each other's light: there the angle is rough."""
REST, EXACT_LIGHTS = 1 / 3, 3
"""A rig is turned as a whole, or a lens is shifted, where so little of the change is none; what is wrong of three
lights is one change as well. More lights that are each wrong in a way of their own make normals that no such change
removes."""
MOST_FLAT = 6.5
"""Lights of a larger condition number lie nearly in a plane: gloss and light from around lean normals under the right
rig as well, on photographs by 9 to 15 degrees."""
FLAT = (
    "The normals are not quite those of one surface, and would be if all leaned otherwise: the lights lie nearly in a "
    "plane, so that gloss, light from around or a rig that is a little off turn all of them."
)
OR_STRENGTHS = " Under three lights other strengths than the rig's, or two lights exchanged, may do the same."
TURNED = ("tilted up or down", "swung to the left or right", "rolled around the line of sight")
BOTH_WAYS = 0.6
"""Where hollows lie beside what stands free, normals at outlines that run alike face outwards or inwards: the variance
of their cosines is more than this share of that of 1 and -1 with the same mean (a bowl and a ball: 0.69 to 1). A wrong
rig turns alike normals alike: of a ball, a cone, a cushion and a ring 0 to 0.47, of bowl and ball 0.4 to 0.5, on
photographs of a cat, a horse and a ball 0.01 to 0.3."""
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
            found=f"{cannot}: {_why_of_three(observed)}{_as_it_is_seen(observed)}",
            advice="Check that the rig file is in camera axes (x right, y up), belongs to this set-up, and names the "
            "lights as the plan does. If it does, add lights.",
        )
    elsewhere = distance_unknown_share(observed) > ELSEWHERE
    of_distance = "most of it may be nearer or farther away than assumed (see the line on distance), or "
    return Judgement(
        subject="rig",
        grade="doubtful" if elsewhere else grade,
        found=f"{cannot}: {of_distance if elsewhere else ''}directions are mirrored or turned, or lights exchanged."
        f"{_as_it_is_seen(observed)}",
        advice=("If the line stays once the distance is known, check" if elsewhere else "Check") + " that the rig file "
        "is in camera axes (x right, y up), belongs to this set-up, and names the lights as the plan does; calibrate "
        "again if anything was moved.",
    )


def _why_of_three(observed: Observed) -> str:
    apart = "much of the surface shines or lies in shadow, which three lights do not tell apart."
    if faces_outwards(observed):
        return f"directions are off, or {apart} Lights are hardly exchanged: normals face outwards at the outline."
    return f"directions are mirrored or turned, lights exchanged, or {apart}"


def _as_it_is_seen(observed: Observed) -> str:
    """Return what is to be thought of where a clip's pictures were turned: a rig may be in the sensor's axes."""
    if observed.turn.is_none:
        return ""
    return (
        f" The file wants its pictures {observed.turn}, and so they are: a rig that was measured on pictures as the "
        "sensor lies has its axes turned."
    )


def facing_inwards(observed: Observed, *, guessed: bool) -> Judgement | None:
    """Judge whether normals face outwards where the subject ends; None where they do, or too little of that shows.
    ``guessed``: which light is which is a guess."""
    facing = _facing(observed)
    if facing is None or facing >= OUTWARD or not quiet(observed.facts):
        return None
    inwards = "Normals do not face outwards where the subject ends, as those of a body that stands free do"
    hollow = facing < INSIDE_OUT
    if not hollow and _both_ways(observed):
        return _partly_hollow(observed, guessed=guessed)
    if guessed:
        return Judgement(
            subject="rig",
            grade="doubtful" if hollow or facing > HARDLY else "bad",
            found=f"{inwards}: the order of the lights is a guess, and hardly the true one"
            + (", or the subject is hollow, as a bowl is." if hollow else "."),
            advice="Try the other lights as `first_light`, one after the other: with the right one this line is gone"
            + (", or nothing is wrong where it is hollow." if hollow else "."),
        )
    if hollow:
        return Judgement(
            subject="rig",
            grade="doubtful",
            found=f"{inwards}, but inwards: the rig is turned by 180 degrees around the line of sight, or the subject "
            f"is hollow, as a bowl is.{_as_it_is_seen(observed)}",
            advice="If it is not hollow, turn the rig, or the footage: x is right and y up in the upright picture.",
        )
    return Judgement(
        subject="rig",
        grade="doubtful" if facing > HARDLY else "bad",
        found=f"{inwards} (mean cosine {facing:.2f}; 0.7 and more is right): two lights are exchanged, directions are "
        f"mirrored or turned, or strengths are far off.{_as_it_is_seen(observed)}",
        advice="Check that the rig file is in camera axes (x right, y up), belongs to this set-up, names the lights as "
        "the plan does, and says how strong they are.",
    )


def _partly_hollow(observed: Observed, *, guessed: bool) -> Judgement:
    """Say that outlines which run alike have normals of both kinds: no rig makes those of one kind of body."""
    unsure = "whether the order of the lights, a guess, is right" if guessed else "whether the rig is right"
    return Judgement(
        subject="rig",
        grade="doubtful",
        found="Along the subject's outline some normals face outwards and others inwards, on stretches that run in the "
        f"same direction: a part of it is hollow, as a bowl is, or has holes. So the outline does not tell {unsure}."
        f"{_as_it_is_seen(observed)}",
        advice="If nothing in the picture is hollow, check that the rig file is in camera axes (x right, y up), and "
        "names the lights as the plan does."
        if not guessed
        else "If nothing in the picture is hollow, try the other lights as `first_light`, one after the other.",
    )


def faces_outwards(observed: Observed) -> bool:
    """Return whether normals are known to face outwards where the subject ends."""
    facing = _facing(observed)
    return facing is not None and facing >= SURELY_OUTWARD


def _facing(observed: Observed) -> float | None:
    cosines = [one.cosine for one in observed.closely.outward]
    return float(np.median(cosines)) if cosines else None


def _both_ways(observed: Observed) -> bool:
    """Return whether normals face outwards and inwards at outlines that run alike."""
    shares = [one.apart**2 / max(1 - one.cosine**2, 1e-9) for one in observed.closely.outward]
    return bool(np.median(shares) > BOTH_WAYS)


def facing_away(observed: Observed) -> Judgement | None:
    """Judge whether normals face away from the camera; None where few do."""
    share = float(np.median(observed.closely.away)) if observed.closely.away else 0.0
    if share <= MOST_AWAY or not quiet(observed.facts):
        return None
    return Judgement(
        subject="rig",
        grade="bad",
        found=f"{100 * share:.0f} % of the normals face away from the camera, which sees none of such a surface: "
        f"directions or strengths of the lights are wrong.{_as_it_is_seen(observed)}",
        advice="Use the rig file of this set-up; check that lights have the same names in plan and rig, and that each "
        "gives what the rig says.",
    )


def normals_lean(observed: Observed) -> Judgement | None:
    """Judge whether the normals would be one surface's if all were tilted alike; None where not."""
    at_rest = [one for one in observed.closely.leans if one.moving_share <= AT_REST]  # false motion leans normals, too
    if not at_rest or not quiet(observed.facts) or moves(observed.facts) or _clips(observed):
        return None
    usual = sorted(at_rest, key=lambda one: one.lean_deg)[len(at_rest) // 2]
    shown_deg = off_deg(observed) or 0.0
    if usual.lean_deg <= max(LEANS_DEG, MORE_THAN_SHOWN * shown_deg) or usual.gain <= BY_LEANING:
        return None
    if usual.off_axis is not None and (usual.least_deg or 0.0) < REST * usual.lean_deg:
        return _off_axis(usual, usual.off_axis)
    whole = usual.rest_deg < REST * usual.lean_deg
    flat = _nearly_in_a_plane(observed)
    exact = int(observed.firing.sum()) == EXACT_LIGHTS
    return Judgement(
        subject="rig",
        grade="bad" if (whole or exact) and not flat and _lost(usual, shown_deg) else "doubtful",
        found=FLAT if flat else _leaning_words(usual, whole=whole, exact=exact),
        advice="Add lights from other sides, farther from the plane of these."
        if flat
        else ("Check that lights have the same names in plan and rig; if they do, measure" if exact else "Measure")
        + " the lights again with the camera where it stands. If the picture is cropped at one side, or the lens is "
        "shifted, write focal_px and principal_px into the rig.",
    )


def _off_axis(usual: Lean, widths: float) -> Judgement:
    """Say that a lens that is not known may be why: of a right rig as well, so the rig itself is not doubted."""
    return Judgement(
        subject="lens",
        grade="doubtful",
        found="The normals would be those of one surface if the lens's axis met the picture "
        f"{100 * widths:.0f} % of its width off the middle (cropped, or a shifted lens), or if the rig were tilted by "
        f"about {usual.lean_deg:.0f} degrees: without a lens in the rig nothing tells which.",
        advice="Write focal_px and principal_px into the rig's [camera]; if the axis is in the middle, measure the "
        "lights again with the camera where it stands.",
    )


def _lost(usual: Lean, shown_deg: float) -> bool:
    least_deg = usual.lean_deg if usual.least_deg is None else usual.least_deg
    return least_deg > max(LOST_DEG, SURELY_MORE * shown_deg) and usual.gain > SURELY_LEANING


def _clips(observed: Observed) -> bool:
    """Return whether so much is clipped that normals of few lights are left, which lean for that."""
    return float(np.median([one.clipped_share for one in observed.facts])) > LOST_CLIPPED


def _nearly_in_a_plane(observed: Observed) -> bool:
    if observed.points is None:
        return False
    sizes = np.linalg.svd(observed.points.vectors[:, observed.firing].mean(axis=0), compute_uv=False)
    return bool(sizes[0] > MOST_FLAT * sizes[-1])


def _leaning_words(usual: Lean, *, whole: bool, exact: bool) -> str:
    as_they_are = "as they are, normals are not those of one surface;"
    if whole:
        axis, angle_deg = int(np.abs(usual.turn_deg).argmax()), float(np.linalg.norm(usual.turn_deg))
        return (
            f"The rig seems {TURNED[axis]} as a whole by about {angle_deg:.0f} degrees: {as_they_are} turned back by "
            f"that angle they would be.{OR_STRENGTHS if exact else ''}"
        )
    if exact:
        return (
            f"The rig's directions or strengths are off, or two lights are exchanged: {as_they_are} tilted otherwise "
            f"by about {usual.lean_deg:.0f} degrees they would be. Exchanged lights turn them by far more."
        )
    return f"The rig's directions are off: {as_they_are} tilted otherwise they would be."


def quiet(facts: Sequence[InstantFacts]) -> bool:
    """Return whether normals are steady enough to be compared with each other."""
    known = [one.change.normals_deg for one in facts if one.change is not None and (one.moving_share or 0.0) < AT_REST]
    return by_noise_deg(facts) < NOISY_DEG and (not known or float(np.median(known)) < NOISY_DEG)
