"""Judgement on a sensor that saturates below the largest code, where the plan does not say so."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.record import Clip
from psvideo.clip.transfer import find_curve, to_light
from psvideo.report.judgement import Judgement
from psvideo.report.observe.hidden_level import hidden_level


def hidden_saturation(frames: Sequence[NDArray[np.float32]], clip: Clip) -> Judgement | None:
    """Judge whether frames, linear light by the clip's plan, end at one level below its saturation; None where not."""
    if not (level := hidden_level(frames, clip)):
        return None
    largest = 2 ** (clip.header.bits or 0) - 1
    code = int(largest * _signal(clip.plan.camera.encoding.transfer, level.dimmest))
    return Judgement(
        subject="clipping",
        grade="bad",
        found=f"Under several lights the brightest parts end at one level, about code {code} of {largest}, where the "
        f"sensor seems to saturate (up to {100 * level.share:.0f} % of a frame). plan.toml does "
        "not say so, and what is clipped counts as measured.",
        advice=f"Write white_level = {code} into the plan's [camera] table, and look again.",
    )


def _signal(transfer: str, light: float) -> float:
    """Return the signal, as a share of the largest code, that stands for light where the largest code is 1.0."""
    signals = np.linspace(0, 1, 4097)
    lights = to_light(find_curve(transfer), signals)
    return float(np.interp(light * lights[-1], lights, signals))
