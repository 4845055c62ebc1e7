"""The rig judged by what it leaves unexplained of the plates: wrong strengths, near lights, another curve."""

from collections.abc import Sequence

import numpy as np

from psvideo.model.units import listed
from psvideo.report.judge.of_strengths import other_strengths
from psvideo.report.judge.typical_error import COMMON_DEG
from psvideo.report.judgement import NAMED, Grade, Judgement
from psvideo.report.observe.rig_and_curve.rigfit import RigFit

MISFIT, LOST_MISFIT = 0.135, 0.25
"""Shares of the light that another rig would explain and this one cannot. A rig that was off by 1 to 5 degrees left
0.11 to 0.13 on photographs, two lights exchanged among five 0.18, a list in another order 0.19."""
LEFT_OVER = 0.1
"""Where more is left over under a rig that is right, the report says what it may come from."""
FEW_LIGHTS, OF_FOUR, OF_MORE = 4, 0.02, 0.03
"""What another rig would explain of the light may be directions that are 10 degrees off from the second on under so
many lights, from the third on under more. (Waves and balls under four directions off by 5 degrees: 0.01 to 0.03, by 10:
0.02 to 0.06; under right ones: below 0.005. Matte to satin busts and vases under five and six off by 10: from 0.033 on;
under right ones 0.022 at most. Photographs under lists that are right to a few degrees: 0.01 to 0.1.)"""
MATTE = 0.005
"""A surface that leaves more of a usual point's light under any rig is not matte, or noisy."""
HIDES = 0.1
"""A surface that leaves more under any rig hides such directions: a bust of lustre 0.11 and 0.14, of satin 0.07."""
MANY_LIGHTS, NAMED_OF_MANY = 12, 24
"""From so many lights on those that are off are mended one by one in the rig, and so many are named. A bear, 19 of
whose 96 photographs are a quarter brighter than their list says: off by 4.66 degrees as listed, 4.59 with the 18 that
are named mended, 4.78 where all strengths are measured on the bear, which is not quite matte. A cat under 48 lights,
nine of them off by 30 %: 4.76, 4.49 and 4.61; the bear under 24, four of them: 4.69, 4.62 and 4.52. Of the bear under 8
and 10, measuring is better."""
NEARER = 0.7
"""Lamps stand near where that leaves less than this share of what is left over. (Photographs: 0.88 and more; lamps ten
widths away that a rig takes for distant: 0.2 to 0.5.) A surface that is not matte, as skin, explains a face's light
better than lamps at 1.4 widths would, which were none."""
LOST_LEAN_DEG = 12.0
"""Near lights that tilt normals by more than this make the rig bad, not only doubtful."""
IN_PICTURE = 0.5
"""Lamps nearer than this, in widths of the picture, would be seen in it. (Linear codes read as S-Log3 do.)"""
UNDONE, REDONE, MOST_BENT = 0.7, 0.18, 0.25
"""Plates were read by another curve where that leaves less than these shares of what is left over. (sRGB read as light:
0.3 to 0.8; photographs in light: 1.7 and more. Light read as sRGB: 0.05 to 0.15; photographs in sRGB: 0.6 and more.)
A wrong curve leaves the third at most, and the right one explains the light: metal leaves 0.25 to 0.45 under the right
one, and is no matte surface under any."""

BY_SHEEN = 0.55
"""Light was read as sRGB where that leaves less than this share of what a surface of broad sheen would. (Satin balls
and waves: 0.65 and more, and they were called sRGB; light read as sRGB 0.14 to 0.4, on photographs of a ball and a
rendered bunny too: of 125 that were found there none is lost.)"""


def surface_leaves(fit: RigFit) -> bool:
    """Return whether what the rig leaves over is the surface's or noise: no other rig would explain much of it."""
    return fit.typical_own > MATTE and fit.by_rig <= OF_MORE


def rig_explains(fit: RigFit, *, lights: int) -> Judgement:
    """Say that the rig of so many lights is right, and how much it leaves over; or that this does not show."""
    left, own = (f"{100 * share:.1f} % of the light" for share in (fit.misfit, fit.typical_own))
    if fit.by_rig > (OF_FOUR if lights == FEW_LIGHTS else OF_MORE):
        return Judgement(
            subject="rig",
            grade="unknown",
            found=f"Whether the rig is right is not known: {left} is left over, and {own} would be under another rig. "
            "Directions that are 10 degrees off leave as much"
            + (" of four lights (2 to 6 %)" if lights == FEW_LIGHTS else "")
            + ", and so do lamps a few per cent brighter or dimmer, near lights that are taken for distant, gloss and "
            "soft shadows.",
            advice="Measure the lights on a sphere beside the subject"
            + (", or use five lights and more." if lights == FEW_LIGHTS else "."),
        )
    if fit.typical_own > HIDES:
        return Judgement(
            subject="rig",
            grade="unknown",
            found=f"Whether the rig is right is not known: the surface shines, so that {own} is left over under any "
            "rig, and directions that are 10 degrees off hide in that.",
            advice="Measure the lights on a sphere beside the subject.",
        )
    found = f"The rig explains the plates: {left} is left over"
    if fit.misfit > LEFT_OVER:
        found += f" ({own} under any rig), by gloss, soft shadows, or directions a few degrees off"
    return Judgement(subject="rig", grade="good", found=f"{found}.")


def rig_misfits(lights: Sequence[str], fit: RigFit) -> Judgement | None:
    """Judge how much of the light cannot come from the rig's lights; None where little."""
    off = other_strengths(lights, fit)
    if fit.excess <= MISFIT and not off:
        return None
    grade: Grade = "bad" if fit.excess > LOST_MISFIT else "doubtful"
    found = f"The rig does not fit the plates: {100 * fit.misfit:.0f} % of the light cannot come from its lights"
    if off:
        off.sort(key=lambda one: -abs(float(np.log(max(one[1], 1e-6)))))
        most = NAMED if len(lights) < MANY_LIGHTS else NAMED_OF_MANY
        named = listed([f"{light!r} {100 * strength:.0f} %" for light, strength in off], most)
        named += "," if len(off) > most else ""
        turned = "" if fit.lamps is None else f" That turns a typical normal by {max(fit.lamps.turned_deg, 1):.0f}°."
        return Judgement(
            subject="rig",
            grade=grade,
            found=f"{found}; with other strengths it would: {named} of what the rig says.{turned}",
            advice="Check the power and the driver of these lights, of photographs their exposures too, or "
            + (
                "measure the strengths in these very pictures: psvideo calibrate intensities."
                if len(lights) < MANY_LIGHTS
                else "multiply their intensities in the rig by these shares: with so many lights the others are right."
            ),
        )
    return Judgement(
        subject="rig",
        grade=grade,
        found=f"{found}.",
        advice="Use the rig file of this set-up; calibrate again if a light or the camera was moved; check that lights "
        "have the same names in plan and rig.",
    )


def lights_exchanged(lights: Sequence[str], fit: RigFit) -> Judgement | None:
    """Judge whether two of the lights are taken for each other; None where not."""
    if fit.exchanged is None:
        return None
    one, other = (lights[light] for light in fit.exchanged)
    return Judgement(
        subject="rig",
        grade="bad" if fit.excess > LOST_MISFIT else "doubtful",
        found=f"{one!r} and {other!r} are exchanged: exchanged back, they explain most of the {100 * fit.misfit:.0f} % "
        "of the light that cannot come from the rig's lights as they are named.",
        advice="Exchange the two in the rig or the list of lights, or exchange their pictures.",
    )


def shining_surface(fit: RigFit) -> Judgement:
    """Say that it is the surface that is not matte, and not the rig that is wrong."""
    return Judgement(
        subject="surface",
        grade="doubtful",
        found=f"The surface shines: {100 * fit.misfit:.0f} % of the light is no matte surface's under these lights, "
        "and yet the normals are those of one surface, so the rig is hardly to blame.",
        advice="Metal, glaze and lacquer need many lights, well spread, or polarising filters. If the subject is "
        "matte, check the strengths of the lights.",
    )


def lights_near(fit: RigFit) -> Judgement | None:
    """Judge whether lights that the rig takes for distant stand near; None where they do not."""
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


def other_curve(fit: RigFit) -> Judgement | None:
    """Judge whether plates were read by another transfer curve than recorded; None where not."""
    curves, by_distance = fit.curves, fit.misfit if fit.near is None else fit.near.misfit
    if curves is None or fit.misfit > MOST_BENT or min(curves.undone, curves.redone) > min(by_distance, MISFIT):
        return None
    undone = curves.undone <= min(UNDONE * fit.misfit, MISFIT)
    by_sheen = np.inf if fit.near is None else BY_SHEEN * fit.near.by_surface
    if not undone and curves.redone > min(REDONE * fit.misfit, by_sheen):
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
