"""The light of frames as they were filmed, judged without plates: all that can be said where no strobe was found."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.rows.clipping import SATURATED
from psvideo.report.judgement import Judgement

BRIGHTER, DARKER = 1.25, 0.4
"""Later frames that reach this many times the light of the first ones are of another exposure, or of a strobe that
stopped."""
DARK = 2**-6
"""A picture whose brightest parts stay six stops below saturation holds little but noise."""
MUCH_CLIPPED = 0.1
"""A share of a frame beyond what highlights take."""
STEP = 4
"""Every fourth row and column is looked at."""


@dataclass(frozen=True, kw_only=True)
class FrameLight:
    """How bright a frame is: ``top``, its brightest thousandth, 1 at saturation, and the share that is ``clipped``."""

    top: float
    clipped: float


def frame_light(image: NDArray[np.float32]) -> FrameLight:
    """Return how bright a frame is; ``image`` is linear light, (row, col[, channel])."""
    thin = np.nan_to_num(image[::STEP, ::STEP], nan=0.0)
    return FrameLight(top=float(np.quantile(thin, 0.999)), clipped=float((thin >= SATURATED).mean()))


def exposure_of_frames(frames: Sequence[FrameLight]) -> Judgement:
    """Judge frames of which nothing else is known; at least one."""
    top, share = max(frame.top for frame in frames), max(frame.clipped for frame in frames)
    advice = ""
    if top < DARK:
        advice = "Check that the lights fire and that the lens is open."
    elif share > MUCH_CLIPPED:
        advice = "Close the aperture or lower the powers."
    return Judgement(
        subject="exposure",
        grade="bad" if advice else "good",
        found=f"The brightest parts reach {100 * min(top, 1):.0f} % of saturation; at most {100 * share:.1f} % of a "
        "frame is clipped.",
        advice=advice,
    )


def later_frames(early: Sequence[FrameLight], late: Sequence[FrameLight], *, elsewhere: bool = False) -> Judgement:
    """Judge whether frames from the rest of a take are as bright as those from its start; at least one of each.
    ``elsewhere``: another part than the start was looked at."""
    rest, those = ("Elsewhere", "in the frames looked at") if elsewhere else ("Later", "at its start")
    first, then = (max(1e-6, *(frame.top for frame in frames)) for frames in (early, late))
    ratio = then / first
    if DARKER < ratio < BRIGHTER:
        return Judgement(
            subject="later", grade="good", found=f"{rest} in the take the picture is as bright as {those}."
        )
    change = abs(np.log2(max(ratio, 1e-6)))
    word = "brighter" if ratio > 1 else "darker"
    return Judgement(
        subject="later",
        grade="bad" if ratio < DARKER / 4 else "doubtful",
        found=f"{rest} in the take the picture is {change:.1f} stops {word} than {those}.",
        advice="Check that the strobe ran to the end, and that exposure, gain and aperture are fixed. A subject that "
        "came or went does the same.",
    )
