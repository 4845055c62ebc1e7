"""Judgements on ambient light: how much of what is recorded is always there, and whether it changes."""

import numpy as np

from psvideo.report.judgement import Judgement
from psvideo.report.observe.observed import Observed

MEASURED, FAINT_AMBIENT = 0.8, 0.02
"""Without a dark slot: the share of the picture that must stand still, unless there is less ambient light than this."""
MOST_AMBIENT, LOST_AMBIENT = 0.1, 0.5
IN_SHADOW = 0.03
"""Of a lamp's light, what may be left in attached shadow: up to 0.016 on photographs in a dark room; ambient light of
5 % leaves 0.02 to 0.06, and 10 % 0.03 to 0.1."""
EVEN = 0.85
"""Of the dark slot's light where it is brightest, what is there where it is dimmest: ambient light falls on things that
are brighter and darker, a black level that was not taken off is everywhere."""
NOTICED, MOST_SWING = 0.05, 0.1
"""Ambient light of more than the first share that changes from dark slot to dark slot by more than the second."""


def ambient(observed: Observed) -> Judgement:
    """Judge how much of what is recorded is light that is always there."""
    shares = [one.ambient for one in observed.facts if one.ambient is not None]
    swing = float(np.std(shares)) / max(float(np.mean(shares)), 1e-9) if len(shares) > 2 else 0.0
    if not shares:
        return _without_dark(observed)
    share = float(np.median(shares))
    found = f"Ambient light is {100 * share:.0f} % of the signal."
    if observed.ambient_measured:
        measured = min(observed.ambient_measured.values())
        found = (
            f"{found[:-1]}, found without a dark slot in the {100 * measured:.0f} % of the picture that stood still."
        )
        if measured < MEASURED and share > FAINT_AMBIENT:
            return Judgement(
                subject="ambient",
                grade="doubtful",
                found=f"{found} Elsewhere it is a guess from what is around.",
                advice="Add a dark slot to the plan, which measures it everywhere.",
            )
    if share > NOTICED and swing > MOST_SWING:
        found = f"{found[:-1]} and flickers or changes by {100 * swing:.0f} % (mains light, a screen, the sun)."
    elif share <= MOST_AMBIENT:
        left = _left_in_shadow(observed)
        return _veiled(found, left) if left > IN_SHADOW else Judgement(subject="ambient", grade="good", found=found)
    elif observed.dark_evenness and float(np.median(observed.dark_evenness)) > EVEN:
        return Judgement(
            subject="ambient",
            grade="bad" if share > LOST_AMBIENT else "doubtful",
            found=f"{found[:-1]}, and as strong all over the picture: black_level in the plan is likely to be too low. "
            "It is taken off, but the levels above are not what they seem.",
            advice="Film a frame with the cap on, and write its code as black_level into the plan's [camera].",
        )
    return Judgement(
        subject="ambient",
        grade="bad" if share > LOST_AMBIENT else "doubtful",
        found=f"{found} It is taken off, but its noise stays, and less room is left below saturation.",
        advice="Cover windows and switch room light and screens off, or flash stronger with a smaller aperture.",
    )


def _left_in_shadow(observed: Observed) -> float:
    return float(np.median(observed.closely.in_shadow)) if observed.closely.in_shadow else 0.0


def _veiled(found: str, left: float) -> Judgement:
    """Say that light comes and goes with the lamps where they cannot reach: the dark slots hold none of it."""
    return Judgement(
        subject="ambient",
        grade="doubtful",
        found=f"{found} But where a light cannot reach, {100 * left:.0f} % of what it gives elsewhere is left, and "
        "only while it flashes: haze, flare in the lens, or light thrown back by walls and by the subject itself. This "
        "tilts normals towards the camera.",
        advice="Clean the lens and shade it from the lights, clear the air, and hang black cloth behind and beside the "
        "subject.",
    )


def _without_dark(observed: Observed) -> Judgement:
    """Judge ambient light by what is left in attached shadow, where no dark slot shows it."""
    left = _left_in_shadow(observed)
    if left > IN_SHADOW:
        return Judgement(
            subject="ambient",
            grade="doubtful",
            found=f"Where a light cannot reach, {100 * left:.0f} % of what it gives elsewhere is left: ambient light "
            "that nothing took off, or light by way of other surfaces. This tilts normals towards the camera.",
            advice="Add a dark slot to the plan, or a picture with all lights off; darken the room, and keep bright "
            "things away from the subject.",
        )
    return Judgement(
        subject="ambient",
        grade="unknown",
        found="Ambient light is not known: the plan has no dark slot, or none was complete."
        + (" Where a light cannot reach, it is dark." if observed.closely.in_shadow else ""),
    )
