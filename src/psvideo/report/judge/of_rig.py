"""Judgements on the rig: whether its directions and strengths can have made the plates."""

from collections.abc import Iterator, Sequence

import numpy as np

from psvideo.report.judge.of_exposure import LOST_CLIPPED
from psvideo.report.judge.of_lamps import NAMED
from psvideo.report.judge.result import AT_REST, COMMON_DEG, LOST_DEG, NOISY_DEG, by_noise_deg, moves, off_deg
from psvideo.report.judgement import Grade, Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigfit import RigFit
from psvideo.report.observe.rig_and_curve.yuille1997 import Lean

MISFIT, LOST_MISFIT = 0.135, 0.25
"""Shares of the light that another rig would explain and this one cannot. A rig that was off by 1 to 5 degrees left
0.11 to 0.13 on photographs, two lights exchanged among five 0.18, a list in another order 0.19."""
ONE_SURFACE, BY_SHINING = 0.8, 0.2
"""Slopes that agree by the first, and that no lean mends by more than the second, are one surface's. So the rig's
directions are right, and what shines explains the rest (a coin of metal under 6 to 24 lights: 0.83 to 0.97 and 0.01 to
0.05; the same lights off by 10 degrees each: 0.91 and 0.24, by 20 degrees: 0.77 and 0.31)."""
LEFT_OVER = 0.1
STRENGTH_MISFIT, BY_STRENGTH, OTHER_STRENGTH = 0.05, 0.5, 1.25
"""Less is enough where other strengths of some lights, half of them at most, take half of it away."""
AGREE, DISAGREE = 0.3, -0.1
MOST_AWAY = 0.05
"""Of measured normals, the share that may face away from the camera: what a camera sees faces it."""
NEARER = 0.7
"""Lamps stand near where that leaves less than this share of what is left over. (Photographs: 0.88 and more; lamps ten
widths away that a rig takes for distant: 0.2 to 0.5.) A surface that is not matte, as skin, explains a face's light
better than lamps at 1.4 widths would, which were none."""
LOST_LEAN_DEG = 12.0
IN_PICTURE = 0.5
"""Lamps nearer than this, in widths of the picture, would be seen in it. (Linear codes read as S-Log3 do.)"""
UNDONE, REDONE, MOST_BENT = 0.7, 0.18, 0.25
"""Plates were read by another curve where that leaves less than these shares of what is left over. (sRGB read as light:
0.3 to 0.8; photographs in light: 1.7 and more. Light read as sRGB: 0.05 to 0.15; photographs in sRGB: 0.6 and more.)
A wrong curve leaves the third at most, and the right one explains the light: metal leaves 0.25 to 0.45 under the right
one, and is no matte surface under any."""
LEANS_DEG, BY_LEANING = 6.0, 0.1
"""Normals would be one surface's if all were changed by more than the first; that says something of the rig where it
leaves less over by the second, a share of what it leaves."""
MORE_THAN_SHOWN, SURELY_MORE = 2.0, 4.0
"""... and where it is more than this many times what residuals show: where lights are each wrong in a way of
their own, which accuracy says, normals lean by up to 3.5 times that. (Under a rig that is turned as a whole: 25
times on virtual subjects, 2 to 4 times on photographs.)"""
SURELY_LEANING = 0.5
"""Photographs gain less, of what is glossy or in each other's light: there the angle is rough."""
REST, EXACT_LIGHTS = 1 / 3, 3
"""A rig is turned as a whole, or a lens is shifted, where so little of the change is none; what is wrong of three
lights is one change as well. More lights that are each wrong in a way of their own make normals that no such change
mends."""
MOST_FLAT = 6.5
"""Lights of a larger condition number lie nearly in a plane: gloss and light from around lean normals under the right
rig as well, on photographs by 9 to 15 degrees."""
FLAT = (
    "The normals are not quite those of one surface, and would be if all leaned otherwise: the lights lie nearly in a "
    "plane, so that gloss, light from around or a rig that is a little off turn all of them."
)
TURNED = ("tilted up or down", "swung to the left or right", "rolled around the line of sight")
TOO_FAR_DEG, AGREE_FAR = 8.0, 0.15
"""Slopes of normals that are so far off agree badly under the right rig too: then they must agree by the second. (A
bear's under eight lights in one plane: 0.21; five lights of which each is taken for the next: 0.11.)"""


def rig(observed: Observed, *, guessed: bool = False, curve_doubt: str = "") -> Iterator[Judgement]:
    """Judge whether the rig's directions and strengths can have made these plates. ``guessed``: which light is which
    is a guess; ``curve_doubt``: why pictures were likely coded by another curve, where that is known."""
    fit = observed.rig_fit
    firing = [light for light, fires in zip(observed.lights, observed.firing, strict=True) if fires]
    said = Judgement(subject="rig", grade="doubtful", found=curve_doubt) if curve_doubt else None
    curve = said or (None if fit is None else _curve(fit))
    wrong = None if fit is None or curve else _misfit(firing, fit)
    crossed, away = _crossed(observed, guessed=guessed), _away(observed)
    leaning = None if curve or wrong or crossed or away else _leaning(observed)
    shines = wrong is not None and not crossed and not away and _shines(observed)
    near = None if fit is None or curve or shines else _near(fit)
    if fit is not None and shines:
        yield _shining(fit)
        return
    doubted = [one for one in (curve, wrong, crossed, away, near, None if near else leaning) if one]
    yield from doubted
    if any(one.subject == "rig" for one in doubted):
        return
    if fit is not None:
        yield _explained(fit)
    elif observed.slopes:
        yield Judgement(
            subject="rig",
            grade="good",
            found="The normals fit together as one surface's; three lights show no more of the rig.",
        )


def _explained(fit: RigFit) -> Judgement:
    found = f"The rig explains the plates: {100 * fit.misfit:.1f} % of the light is left over"
    if fit.misfit > LEFT_OVER:
        found += (
            f" ({100 * fit.own_misfit:.0f} % under any rig), by gloss, soft shadows, or directions a few degrees off"
        )
    return Judgement(subject="rig", grade="good", found=f"{found}.")


def _misfit(lights: Sequence[str], fit: RigFit) -> Judgement | None:
    off = [
        (light, strength)
        for light, strength in zip(lights, fit.strengths, strict=True)
        if not 1 / OTHER_STRENGTH < strength < OTHER_STRENGTH
    ]
    some = 0 < len(off) <= len(lights) / 2
    by_strength = some and fit.excess > STRENGTH_MISFIT and fit.scaled_misfit < BY_STRENGTH * fit.misfit
    if fit.excess <= MISFIT and not by_strength:
        return None
    grade: Grade = "bad" if fit.excess > LOST_MISFIT else "doubtful"
    found = f"The rig does not fit the plates: {100 * fit.misfit:.0f} % of the light cannot come from its lights"
    if by_strength:
        off.sort(key=lambda one: -abs(float(np.log(max(one[1], 1e-6)))))
        named = ", ".join(f"{light!r} {100 * strength:.0f} %" for light, strength in off[:NAMED])
        named += f" and {len(off) - NAMED} more," if len(off) > NAMED else ""
        return Judgement(
            subject="rig",
            grade=grade,
            found=f"{found}; with other strengths it would: {named} of what the rig says.",
            advice="Check the power and the driver of these lights, or calibrate the rig again.",
        )
    return Judgement(
        subject="rig",
        grade=grade,
        found=f"{found}.",
        advice="Use the rig file of this set-up; calibrate again if a light or the camera was moved; check that lights "
        "have the same names in plan and rig.",
    )


def _shines(observed: Observed) -> bool:
    """Return whether normals are those of one surface as they are: then it is the surface that is not matte."""
    agreement = float(np.median(observed.slopes)) if observed.slopes else 0.0
    leans = [one for one in observed.leans if one.lean_deg > LEANS_DEG and one.gain > BY_SHINING]
    return agreement >= ONE_SURFACE and len(leans) <= len(observed.leans) / 2


def _shining(fit: RigFit) -> Judgement:
    return Judgement(
        subject="surface",
        grade="doubtful",
        found=f"The surface shines: {100 * fit.misfit:.0f} % of the light is no matte surface's under these lights, "
        "and yet the normals are those of one surface, so the rig is hardly to blame.",
        advice="Metal, glaze and lacquer need many lights, well spread, or polarising filters. If the subject is "
        "matte, check the strengths of the lights.",
    )


def _near(fit: RigFit) -> Judgement | None:
    near = fit.near
    if near is None or near.misfit > min(NEARER * fit.misfit, near.by_surface) or near.lean_deg <= COMMON_DEG:
        return None
    if near.widths < IN_PICTURE:
        return Judgement(
            subject="rig",
            grade="bad",
            found="The plates fit no rig: bright and dim parts differ as if the lights stood within the picture. The "
            "plan's transfer curve or black level is likely to be another than the footage's.",
            advice="Check transfer, black_level and white_level in the plan's [camera].",
        )
    return Judgement(
        subject="rig",
        grade="bad" if near.lean_deg > LOST_LEAN_DEG else "doubtful",
        found=f"The lights stand near: they fall off over the picture as if {near.widths:.0f} of its widths away, and "
        f"the rig takes them for distant. This tilts normals by about {near.lean_deg:.0f} degrees.",
        advice="Write where the lights stand into the rig (position_m), or move them farther away.",
    )


def _curve(fit: RigFit) -> Judgement | None:
    curves, by_distance = fit.curves, fit.misfit if fit.near is None else fit.near.misfit
    if curves is None or fit.misfit > MOST_BENT or min(curves.undone, curves.redone) > min(by_distance, MISFIT):
        return None
    undone = curves.undone <= min(UNDONE * fit.misfit, MISFIT)
    if not undone and curves.redone > REDONE * fit.misfit:
        return None
    read, recorded, left = ("light", "sRGB", curves.undone) if undone else ("sRGB", "light", curves.redone)
    recorded_as = "srgb" if undone else "linear"
    return Judgement(
        subject="rig",
        grade="doubtful",
        found=f"The plates were read as {read}, but fit the lights better if they were recorded as {recorded}: "
        f"{100 * left:.1f} % of their light is left over instead of {100 * fit.misfit:.1f} %. This tilts all normals.",
        advice=f'Say how they were recorded: transfer = "{recorded_as}" in the plan\'s [camera], or of photographs '
        f"without a plan `transfer='{recorded_as}'`.",
    )


def _crossed(observed: Observed, *, guessed: bool) -> Judgement | None:
    agreement = float(np.median(observed.slopes)) if observed.slopes else 1.0
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
            found=f"{cannot}: directions are mirrored or turned, lights exchanged, or much of the surface shines or "
            "lies in shadow, which three lights do not tell apart.",
            advice="Check that the rig file is in camera axes (x right, y up), belongs to this set-up, and names the "
            "lights as the plan does. If it does, add lights.",
        )
    return Judgement(
        subject="rig",
        grade=grade,
        found=f"{cannot}: directions are mirrored or turned, or lights exchanged.",
        advice="Check that the rig file is in camera axes (x right, y up), belongs to this set-up, and names the "
        "lights as the plan does; calibrate again if anything was moved.",
    )


def _away(observed: Observed) -> Judgement | None:
    share = float(np.median(observed.away)) if observed.away else 0.0
    if share <= MOST_AWAY or not quiet(observed.facts):
        return None
    return Judgement(
        subject="rig",
        grade="bad",
        found=f"{100 * share:.0f} % of the normals face away from the camera, which sees none of such a surface: "
        "directions or strengths of the lights are wrong.",
        advice="Use the rig file of this set-up; check that lights have the same names in plan and rig, and that each "
        "gives what the rig says.",
    )


def _leaning(observed: Observed) -> Judgement | None:
    if not observed.leans or not quiet(observed.facts) or moves(observed.facts) or _clips(observed):
        return None
    usual = sorted(observed.leans, key=lambda one: one.lean_deg)[len(observed.leans) // 2]
    shown_deg = off_deg(observed) or 0.0
    if usual.lean_deg <= max(LEANS_DEG, MORE_THAN_SHOWN * shown_deg) or usual.gain <= BY_LEANING:
        return None
    if usual.off_axis is not None and (usual.least_deg or 0.0) < REST * usual.lean_deg:
        return _off_axis(usual, usual.off_axis)
    whole = usual.rest_deg < REST * usual.lean_deg
    flat = _nearly_in_a_plane(observed)
    exact = whole or int(observed.firing.sum()) == EXACT_LIGHTS
    return Judgement(
        subject="rig",
        grade="bad" if exact and not flat and _lost(usual, shown_deg) else "doubtful",
        found=FLAT if flat else _leaning_words(usual, whole=whole, exact=exact),
        advice="Add lights from other sides, farther from the plane of these."
        if flat
        else "Measure the lights again with the camera where it stands. If the picture is cropped at one side, or the "
        "lens is shifted, write focal_px and principal_px into the rig.",
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
            "that angle they would be."
        )
    by = f" by about {usual.lean_deg:.0f} degrees" if exact else ""
    return f"The rig's directions are off: {as_they_are} tilted otherwise{by} they would be."


def quiet(facts: Sequence[InstantFacts]) -> bool:
    """Return whether normals are steady enough to be compared with each other."""
    known = [one.change.normals_deg for one in facts if one.change is not None and (one.moving_share or 0.0) < AT_REST]
    return by_noise_deg(facts) < NOISY_DEG and (not known or float(np.median(known)) < NOISY_DEG)
