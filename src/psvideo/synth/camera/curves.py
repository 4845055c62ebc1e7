"""Transfer curves as their makers publish them: light to code and back, both 0 to 1 for the code's whole range.

Written from the formulas, so that reading a clip (which uses OpenColorIO) is tested against something else.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles


@dataclass(frozen=True, kw_only=True)
class CameraCurve:
    """``encode`` maps linear light to the code value, ``decode`` back; ``zero`` is the code of no light."""

    encode: Callable[[Doubles], Doubles]
    decode: Callable[[Doubles], Doubles]

    @property
    def zero(self) -> float:
        """The code value of no light, 0 to 1."""
        return float(self.encode(np.array(0.0)))


def _power_curve(slope: float, knee: float, offset: float, power: float) -> CameraCurve:
    """Return a power curve with a straight foot, whose codes end at 1 for light 1."""

    def encode(light: Doubles) -> Doubles:
        bright = (1 + offset) * np.maximum(light, knee) ** (1 / power) - offset
        return np.where(light < knee, slope * light, bright)

    def decode(code: Doubles) -> Doubles:
        bright = ((np.maximum(code, slope * knee) + offset) / (1 + offset)) ** power
        return np.where(code < slope * knee, code / slope, bright)

    return CameraCurve(encode=encode, decode=decode)


def _slog3_encode(light: Doubles) -> Doubles:
    """Sony, Technical Summary for S-Gamut3.Cine/S-Log3 and S-Gamut3/S-Log3."""
    bright = (420.0 + np.log10((np.maximum(light, 0.0) + 0.01) / 0.19) * 261.5) / 1023.0
    return np.where(light >= 0.01125, bright, (light * (171.2102946929 - 95.0) / 0.01125 + 95.0) / 1023.0)


def _slog3_decode(code: Doubles) -> Doubles:
    bright = 10.0 ** ((code * 1023.0 - 420.0) / 261.5) * 0.19 - 0.01
    dark = (code * 1023.0 - 95.0) * 0.01125 / (171.2102946929 - 95.0)
    return np.where(code >= 171.2102946929 / 1023.0, bright, dark)


CUT, A, B, C, D, E, F = 0.010591, 5.555556, 0.052272, 0.247190, 0.385537, 5.367655, 0.092809
"""ARRI, ALEXA Log C Curve: usage in VFX, exposure index 800, linear scene exposure."""


def _logc3_encode(light: Doubles) -> Doubles:
    bright = C * np.log10(A * np.maximum(light, CUT) + B) + D
    return np.where(light > CUT, bright, E * light + F)


def _logc3_decode(code: Doubles) -> Doubles:
    bright = (10.0 ** ((code - D) / C) - B) / A
    return np.where(code > E * CUT + F, bright, (code - F) / E)


def _same(values: Doubles) -> Doubles:
    return values


CURVES = {
    "linear": CameraCurve(encode=_same, decode=_same),
    "srgb": _power_curve(12.92, 0.0031308, 0.055, 2.4),  # IEC 61966-2-1
    "rec709": _power_curve(4.5, 0.018, 0.099, 1 / 0.45),  # ITU-R BT.709, camera curve
    "slog3": CameraCurve(encode=_slog3_encode, decode=_slog3_decode),
    "logc3": CameraCurve(encode=_logc3_encode, decode=_logc3_decode),
}
