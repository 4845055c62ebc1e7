"""Judgements on codes that the plan misreads: a sensor that saturates below the largest code, or above it by a white
level of other files, and light below black."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.linear import DEPTHS, RIGHT_WHITE, white_of_others
from psvideo.clip.record import Clip
from psvideo.clip.transfer import find_curve, to_light
from psvideo.report.judgement import Judgement
from psvideo.report.observe.hidden_level import hidden_level

BRIGHTEST = 0.999
"""Of a frame's samples, this share is darker than its brightest parts."""


def hidden_saturation(thin: Sequence[NDArray[np.float32]], clip: Clip) -> Judgement | None:
    """Judge whether frames, of each its ``rising_samples``, end at one level below the plan's saturation; None where
    not."""
    if not (level := hidden_level(thin, clip)):
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


def unreachable_white(clip: Clip) -> Judgement | None:
    """Judge whether the plan's white level was meant for other files, so that light counts as darker than it is; None
    where not."""
    found = white_of_others(clip.header, clip.plan.camera.encoding)
    if not found:
        return None
    return Judgement(
        subject="exposure",
        grade="bad",
        found=f"How bright the picture is cannot be said: {found}.",
        advice=f"{RIGHT_WHITE}, and look again.",
    )


def brightest(frame: NDArray[np.float32]) -> float:
    """Return how bright the brightest parts of a frame are, linear light by the clip's plan."""
    return float(np.nanquantile(frame, BRIGHTEST))


def below_black(top: float, clip: Clip) -> Judgement | None:
    """Judge whether frames, the ``brightest`` parts of which reach ``top``, lie below the curve's black, also where
    they are lit; None where not. Noise of a black picture lies on both sides of it."""
    if top >= 0:
        return None
    encoding, bits = clip.plan.camera.encoding, clip.header.bits or 0
    return Judgement(
        subject="exposure",
        grade="bad",
        found=f"Light lies below black, also in the brightest parts: by transfer = {encoding.transfer!r} hardly any "
        f"code of these {bits}-bit files stands for light at all, and normals of them mean nothing.",
        advice="Write into the plan's [camera] table how the files were coded: white_level is not counted in the "
        f"files' codes{_fewer_bits(top, clip)}, or the curve is another.",
    )


def _fewer_bits(top: float, clip: Clip) -> str:
    """Say which white level the codes seem to be counted against; nothing where the plan gives another."""
    encoding, bits = clip.plan.camera.encoding, clip.header.bits or 0
    code = _signal(encoding.transfer, top) * (2**bits - 1)
    depth = next((depth for depth in DEPTHS if depth < bits and code < 2**depth), None)
    if depth is None or encoding.white_level is not None:
        return ""
    return f" (where they hold {depth} bits in {bits}, write white_level = {2**depth - 1})"


def _signal(transfer: str, light: float) -> float:
    """Return the signal, as a share of the largest code, that stands for light where the largest code is 1.0."""
    signals = np.linspace(0, 1, 4097)
    lights = to_light(find_curve(transfer), signals)
    return float(np.interp(light * lights[-1], lights, signals))
