"""Whether the curve that a plan names can be the one by which the files say that they were coded."""

import numpy as np

from psvideo.clip.transfer import DISPLAYED, LOGARITHMIC, find_curve, to_light

FAR_APART = 0.1
"""Curves of pictures for display lie up to 0.05 of white apart; light, HLG, PQ and logarithms 0.15 or more."""


def disagreement(named: str, *, tagged: str | None, kind: str) -> str | None:
    """Say where the curve that a plan names cannot be the one that the files were coded with; None where it may be.

    A curve for recording (logarithms and the like) has no tag of its own, and cameras tag its movies in any way, but
    not as HLG or PQ. JPEG never holds linear light.
    """
    curve = find_curve(named)
    if tagged is None:
        wrong = kind == "jpeg" and not curve.source
        return (
            f"JPEG pictures do not hold linear light, and the plan says transfer = {named!r}: most are srgb"
            if wrong
            else None
        )
    if tagged == LOGARITHMIC:
        return (
            None
            if curve.name not in DISPLAYED
            else f"the files say that they hold a logarithm of light, and the plan says {curve.name!r}, by which they "
            "are read: write the camera's own curve into the plan, such as transfer = 'slog3' or 'logc3'"
        )
    told = find_curve(tagged)
    broadcast = told.name in ("hlg", "st2084")
    if curve.name == told.name or (not broadcast and curve.name not in DISPLAYED):
        return None
    return (
        f"the files are tagged with the transfer {told.name!r}, and the plan says {curve.name!r}, by which they are "
        f"read: where the camera did not record so, write transfer = {told.name!r} into the plan"
    )


def is_another_curve(named: str, tagged: str | None) -> bool:
    """Return whether light read by the curve named would be far from what the files' tag says, by FAR_APART of white or
    more; files without a tag are taken for sRGB.

    >>> is_another_curve("rec709", "hlg"), is_another_curve("rec709", "srgb")
    (True, False)
    """
    if tagged == LOGARITHMIC:
        return find_curve(named).name in DISPLAYED
    signal = np.linspace(0, 1, 65)
    read, told = (to_light(find_curve(name), signal) for name in (named, tagged or "srgb"))
    return float(np.abs(read / read[-1] - told / told[-1]).max()) >= FAR_APART
