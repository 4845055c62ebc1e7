"""Outlines that a person marked, held against what the pictures show there."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.sphere.outline import GIVEN_ERROR_PX, Outline, apart, find_outlines, outline_near
from psvideo.calibrate.sphere.rim_model import Surface
from psvideo.model.arrays import Floats

CLEARLY = 3.0
"""A marked outline contradicts the picture's own where they lie apart by this many times both standard errors."""
WORTH_SAYING = 0.03
"""Share of the radius from which on that is said: 3.4 degrees on a mirror. (Circles that authors marked by hand lie 0.3
to 2.6 % from the outlines that are found on the same pictures: psbox, uw_psm, harvard_ps. 20 balls marked wrongly by 5
and 10 %: found within 1.3 % of where they are, or no contradiction is known.)"""
TURNS = {"mirror": 2.0, "matte": 1.0}
"""By how many times the turn of the normal a light's direction is off."""


def held_against_picture(
    pictures: LightPictures,
    marked: Outline,
    *,
    room: Floats | None = None,
    surface: Surface = "mirror",
    others: Sequence[Outline] = (),
) -> tuple[Outline, str]:
    """Return a marked outline with the error that the pictures show it to have, and what is to be said of it, or "".

    ``room`` is a picture of the same scene under room light, ``others`` are outlines marked in the same pictures. Where
    the pictures show no outline the marked one stands as it is: that is what it is for.
    """
    shown = outline_near(pictures, marked.view, marked.place, room=room, surface=surface)
    if shown is None or _off_px(marked, shown) > WORTH_SAYING * marked.radius_px:
        # far from the rim something else may pass for it: the whole picture's roundest thing goes before
        found = find_outlines(pictures, marked.view, room=room, surface=surface)
        shown = max([*found, *([shown] if shown else [])], key=lambda one: one.coverage, default=None)
    if shown is None:
        return marked, ""
    if apart(marked.place, shown.place):
        if any(not apart(other.place, shown.place) for other in others):
            return marked, ""
        return marked, (
            f"no round outline shows at the `circle` {_told(marked)}, but one at {_told(shown)}. Look at the picture "
            "beside the rig: the green line must lie on the sphere's rim. `circle` counts from the top left"
        )
    off_px = _off_px(marked, shown)
    if off_px <= CLEARLY * float(np.hypot(shown.error_px, GIVEN_ERROR_PX)):
        return marked, ""
    wider = marked.covariance + np.diag([*(shown.place - marked.place)[:3] ** 2, 0.0, 0.0])
    doubted = replace(marked, covariance=wider, points=shown.points)
    if off_px <= WORTH_SAYING * marked.radius_px:
        return doubted, ""
    turned_deg = float(np.degrees(TURNS[surface] * off_px / marked.radius_px))
    return doubted, (
        f"the `circle` {_told(marked)} lies {off_px:.0f} pixels from the outline that the pictures show, "
        f"{_told(shown)}: directions are off by up to {turned_deg:.0f} degrees, which the standard errors count. Leave "
        "`circle` out or correct it; it counts from the top left"
    )


def _off_px(marked: Outline, shown: Outline) -> float:
    """Return how far one outline lies from another: its centre or its radius, whichever is more."""
    away = (shown.place - marked.place)[:3]
    return max(float(np.hypot(*away[:2])), abs(float(away[2])))


def _told(outline: Outline) -> str:
    return ",".join(f"{number:.0f}" for number in outline.place[:3])
