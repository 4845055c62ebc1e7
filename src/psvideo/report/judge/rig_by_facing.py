"""The rig judged by how normals face: outwards where a body ends, and none away from the camera."""

import numpy as np

from psvideo.report.judge.typical_error import quiet
from psvideo.report.judgement import Judgement
from psvideo.report.observe.observed import Observed

MOST_AWAY = 0.05
"""Of measured normals, the share that may face away from the camera: what a camera sees faces it."""
OUTWARD, SURELY_OUTWARD = 0.55, 0.7
"""At outlines normals of right rigs face outwards by a cosine of 0.69 to 1 in the mean: 205 sets of 3 to 12 lights of
seven photographed and rendered subjects. Where two of three lights are exchanged, or all three go round, it was below
the first in 205 of 210, 0.72 at most; in 21 of these slopes agreed as a surface's do."""
HARDLY, INSIDE_OUT = 0.4, -0.7
"""Below the first nothing but the rig explains it; below the second normals face inwards everywhere."""
BOTH_WAYS = 0.6
"""Where hollows lie beside what stands free, normals at outlines that run alike face outwards or inwards: the variance
of their cosines is more than this share of that of 1 and -1 with the same mean (a bowl and a ball: 0.69 to 1). A wrong
rig turns alike normals alike: of a ball, a cone, a cushion and a ring 0 to 0.47, of bowl and ball 0.4 to 0.5, on
photographs of a cat, a horse and a ball 0.01 to 0.3."""


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
            f"is hollow, as a bowl is.{as_it_is_seen(observed)}",
            advice="If it is not hollow, turn the rig, or the footage: x is right and y up in the upright picture.",
        )
    return Judgement(
        subject="rig",
        grade="doubtful" if facing > HARDLY else "bad",
        found=f"{inwards} (mean cosine {facing:.2f}; 0.7 and more is right): two lights are exchanged, directions are "
        f"mirrored or turned, or strengths are far off.{as_it_is_seen(observed)}",
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
        f"{as_it_is_seen(observed)}",
        advice="If nothing in the picture is hollow, check that the rig file is in camera axes (x right, y up), and "
        "names the lights as the plan does."
        if not guessed
        else "If nothing in the picture is hollow, try the other lights as `first_light`, one after the other.",
    )


def faces_outwards(observed: Observed) -> bool:
    """Return whether normals are known to face outwards where the subject ends."""
    facing = _facing(observed)
    return facing is not None and facing >= SURELY_OUTWARD


def facing_away(observed: Observed) -> Judgement | None:
    """Judge whether normals face away from the camera; None where few do."""
    share = float(np.median(observed.closely.away)) if observed.closely.away else 0.0
    if share <= MOST_AWAY or not quiet(observed.facts):
        return None
    return Judgement(
        subject="rig",
        grade="bad",
        found=f"{100 * share:.0f} % of the normals face away from the camera, which sees none of such a surface: "
        f"directions or strengths of the lights are wrong.{as_it_is_seen(observed)}",
        advice="Use the rig file of this set-up; check that lights have the same names in plan and rig, and that each "
        "gives what the rig says.",
    )


def as_it_is_seen(observed: Observed) -> str:
    """Return what is to be thought of where a clip's pictures were turned: a rig may be in the sensor's axes."""
    if observed.turn.is_none:
        return ""
    return (
        f" The file wants its pictures {observed.turn}, and so they are: a rig that was measured on pictures as the "
        "sensor lies has its axes turned."
    )


def _facing(observed: Observed) -> float | None:
    cosines = [one.cosine for one in observed.closely.outward]
    return float(np.median(cosines)) if cosines else None


def _both_ways(observed: Observed) -> bool:
    """Return whether normals face outwards and inwards at outlines that run alike."""
    shares = [one.apart**2 / max(1 - one.cosine**2, 1e-9) for one in observed.closely.outward]
    return bool(np.median(shares) > BOTH_WAYS)
