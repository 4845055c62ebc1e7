"""Judgement on files that hold too few levels of light: what a step costs, noise or none."""

from psvideo.report.judgement import Judgement

DEG_PER_STEP = 13.5
"""A normal's error in degrees for steps of all of its light: a level is off by a step's root of a twelfth in the square
mean, and half-round subjects under three lights 38 degrees from the axis turned by 0.8 of it, in radians (2.0 degrees
at steps of 14 %, 3.8 at 30 %, beyond noise)."""
COARSE_DEG = 1.0
"""From here on it is worth a word: it adds to all that noise does, and does not fall where noise does."""


def coarse_steps(step: float | None) -> Judgement | None:
    """Judge levels that lie ``step`` of the subject's light apart (``code_step``); None where they are fine enough."""
    if step is None or step * DEG_PER_STEP < COARSE_DEG:
        return None
    return Judgement(
        subject="levels",
        grade="doubtful",
        found=f"The files hold few levels of light: where the subject is, they lie {100 * step:.0f} % apart. That "
        f"alone turns normals by about {step * DEG_PER_STEP:.0f} degrees, in bands.",
        advice="Record and export with 10 bits and more, and nothing in between that cuts levels (8 bits, posterised "
        "or compressed files); or expose brighter.",
    )
