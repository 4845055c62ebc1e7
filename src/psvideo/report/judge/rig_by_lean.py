"""The rig judged by a lean of all normals: whether they would be one surface's if all were tilted alike."""

import numpy as np

from psvideo.report.judge.rig_by_plates import surface_leaves
from psvideo.report.judge.typical_error import AT_REST, LOST_DEG, moves, off_deg, quiet
from psvideo.report.judgement import Judgement
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.yuille1997 import Lean

LEANS_DEG, BY_LEANING = 6.0, 0.1
"""Normals would be one surface's if all were changed by more than the first; that says something of the rig where it
leaves less over by the second, a share of what it leaves."""
MORE_THAN_SHOWN, SURELY_MORE = 2.0, 4.0
"""A lean says something of the rig where it is more than this many times what residuals show: where lights are each
wrong in a way of their own, which accuracy says, normals lean by up to 3.5 times that. (Under a rig that is turned as a
whole: 25 times on virtual subjects, 2 to 4 times on photographs.)"""
SURELY_LEANING = 0.5
"""Photographs gain less, of what is glossy or in each other's light: there the angle is rough."""
STEADY_DEG, QUIET_DEG = 1.0, 2.0
"""Where normals at rest change by more than the first between results, or noise turns a typical one by more than the
second, a smaller gain may be noise: a right rig in H.264 leaned by 9 to 12 degrees at gains of 0.14 to 0.22."""
REST, EXACT_LIGHTS = 1 / 3, 3
"""A rig is turned as a whole, or a lens is shifted, where so little of the change is none; what is wrong of three
lights is one change as well. More lights that are each wrong in a way of their own make normals that no such change
removes."""
SHOWN_BY_PLATES = 0.01
"""Under four lights and more, directions that are wrong, each in a way of its own, leave this share of the light: 0.011
and more where they were 4 and 7 degrees off and normals leaned for it, so that a lean that is no turn of the rig as a
whole is not the rig's where less is left. What bends one way only (a book, a pipe, a box) leans by 20 to 110 degrees
under right rigs, most of it no turn."""
MOST_FLAT = 6.5
"""Lights of a larger condition number lie nearly in a plane: gloss and light from around lean normals under the right
rig as well, on photographs by 9 to 15 degrees."""
LEANS_CLIPPED = 0.1
"""Where more than this share of the samples is clipped, normals lean for that."""
BY_GLOSS = 1.5
"""What shines, or lets light through, leans normals under a right rig as well, at gains up to this: busts and vases of
satin, wax and lustre under three lights 0.02 to 1.25; matte ones under lights that are 10 to 20 degrees off 1.4 to
25."""
OR_GLOSS = (
    " Or the surface shines or lets light through (satin, varnish, skin, wax): these lights do not tell gloss from a "
    "wrong rig."
)
FLAT = (
    "The normals are not quite those of one surface, and would be if all leaned otherwise: the lights lie nearly in a "
    "plane, so that gloss, light from around or a rig that is a little off turn all of them."
)
IF_IT_SHINES = (
    "If the subject is matte, measure the lights again with the camera where it stands. If it shines, use six lights "
    "and more, well spread, or polarising filters."
)
OR_STRENGTHS = " Under three lights other strengths than the rig's, or two lights exchanged, may do the same."
TURNED = ("tilted up or down", "swung to the left or right", "rolled around the line of sight")


def normals_lean(observed: Observed) -> Judgement | None:
    """Judge whether the normals would be one surface's if all were tilted alike; None where not."""
    at_rest = [one for one in observed.closely.leans if one.moving_share <= AT_REST]  # false motion leans normals, too
    if not at_rest or not quiet(observed.facts) or moves(observed.facts) or _clips(observed):
        return None
    usual = sorted(at_rest, key=lambda one: one.lean_deg)[len(at_rest) // 2]
    shown_deg = off_deg(observed) or 0.0
    clearly = BY_LEANING if quiet(observed.facts, change_deg=STEADY_DEG, noise_deg=QUIET_DEG) else SURELY_LEANING
    if usual.lean_deg <= max(LEANS_DEG, MORE_THAN_SHOWN * shown_deg) or usual.gain <= clearly:
        return None
    gloss = _may_be_gloss(observed, usual)
    if usual.off_axis is not None and (usual.least_deg or 0.0) < REST * usual.lean_deg:
        return _off_axis(usual, usual.off_axis, gloss=gloss)
    whole = usual.rest_deg < REST * usual.lean_deg
    flat = _nearly_in_a_plane(observed)
    exact = int(observed.firing.sum()) == EXACT_LIGHTS
    if not (whole or exact or flat) and _plates_fit(observed):
        return None
    if gloss and not flat:
        found = f"{_leaning_words(usual, whole=whole, exact=exact)}{OR_GLOSS}"
        return Judgement(subject="rig", grade="doubtful", found=found, advice=IF_IT_SHINES)
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


def _may_be_gloss(observed: Observed, usual: Lean) -> bool:
    """Return whether the surface may make normals lean as far: three lights show nothing of it, more what no rig
    explains."""
    if usual.gain >= BY_GLOSS:
        return False
    fit = observed.rig_fit
    if fit is None:
        return int(observed.firing.sum()) == EXACT_LIGHTS
    return surface_leaves(fit)


def _plates_fit(observed: Observed) -> bool:
    """Return whether the plates are as this rig makes them: then none of its lights is wrong in a way of its own."""
    fit = observed.rig_fit
    return fit is not None and fit.by_rig < SHOWN_BY_PLATES


def _off_axis(usual: Lean, widths: float, *, gloss: bool) -> Judgement:
    """Say that a lens that is not known may be why: of a right rig as well, so the rig itself is not doubted.
    ``gloss``: the surface may be why, too."""
    return Judgement(
        subject="lens",
        grade="doubtful",
        found="The normals would be those of one surface if the lens's axis met the picture "
        f"{100 * widths:.0f} % of its width off the middle (cropped, or a shifted lens), or if the rig were tilted by "
        f"about {usual.lean_deg:.0f} degrees: without a lens in the rig nothing tells which."
        + (" A surface that shines or lets light through does the same." if gloss else ""),
        advice="Write focal_px and principal_px into the rig's [camera]; if the axis is in the middle, measure the "
        "lights again with the camera where it stands.",
    )


def _lost(usual: Lean, shown_deg: float) -> bool:
    least_deg = usual.lean_deg if usual.least_deg is None else usual.least_deg
    return least_deg > max(LOST_DEG, SURELY_MORE * shown_deg) and usual.gain > SURELY_LEANING


def _clips(observed: Observed) -> bool:
    """Return whether so much is clipped that normals of few lights are left, which lean for that."""
    return float(np.median([one.clipped_share for one in observed.facts])) > LEANS_CLIPPED


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
