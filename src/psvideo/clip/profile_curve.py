"""The curve that a picture's file names: by an ICC profile (ICC.1, the red or grey channel's ``TRC``), or in PNG's own
chunks (``cICP``, ``sRGB``, ``gAMA``)."""

import contextlib
import io
import struct
from pathlib import Path
from typing import Any

import numpy as np

from psvideo.clip.transfer import BY_H273, DISPLAYED, find_curve, to_light
from psvideo.model.arrays import Doubles

LIKE = 0.02
"""A profile's curve is one of those that have a name where it is nowhere further from it than this share of white."""
SIGNALS = np.linspace(0, 1, 65)


def coded_curve(path: Path) -> tuple[str, str] | None:
    """Return the curve that a PNG's ``cICP`` chunk names, which goes before all else (PNG 3, 11.3.2.6)."""
    with path.open("rb") as file:
        if file.read(8) != b"\x89PNG\r\n\x1a\n":
            return None
        while len(head := file.read(8)) == 8:
            size, name = struct.unpack(">I4s", head)
            if name == b"cICP" and size == 4:
                return BY_H273.get(file.read(4)[1], "unknown"), "its cICP chunk"
            if name in (b"IDAT", b"IEND"):
                return None
            file.seek(size + 4, 1)
    return None


def curve_named_in(info: dict[Any, Any]) -> tuple[str | None, str]:
    """Return the name of the curve that a file names, and what names it."""
    profile = info.get("icc_profile")
    if profile:
        light = _profile_light(bytes(profile))
        return (None, "") if light is None else (_named(light), "its ICC profile")
    if "srgb" in info:
        return "srgb", "its sRGB chunk"
    if gamma := above_0(info.get("gamma")):
        return _named(SIGNALS ** (1 / gamma)), f"its gAMA chunk ({gamma:.4g})"
    return None, ""


def above_0(value: Any, factor: float = 1.0) -> float | None:
    """Return a number of a file times a factor; None where it is none, or not above 0."""
    with contextlib.suppress(TypeError, ValueError, ZeroDivisionError):
        number = float(value) * factor
        return number if 0 < number < np.inf else None
    return None


def _named(light: Doubles) -> str:
    """Return the known curve that makes this light of SIGNALS, or "unknown"."""
    away = {name: float(np.abs(to_light(find_curve(name), SIGNALS) - light).max()) for name in DISPLAYED[:6]}
    best = min(away, key=lambda name: away[name])
    return best if away[best] < LIKE else "unknown"


def _profile_light(profile: bytes) -> Doubles | None:
    """Return the light that an ICC profile's curve makes of SIGNALS; None where it has no single curve."""
    with contextlib.suppress(struct.error, ValueError, IndexError):
        tags = io.BytesIO(profile[128:])
        (count,) = struct.unpack(">I", tags.read(4))
        for _ in range(min(count, 100)):
            name, offset, size = struct.unpack(">4sII", tags.read(12))
            if name in (b"rTRC", b"kTRC"):
                return _tone(profile[offset : offset + size])
    return None


def _tone(tag: bytes) -> Doubles | None:
    """Return the light of a ``curv`` or ``para`` tag (ICC.1:2010, 10.5 and 10.15)."""
    kind = tag[:4]
    if kind == b"curv":
        (count,) = struct.unpack(">I", tag[8:12])
        if count == 0:
            return SIGNALS.copy()
        entries = np.frombuffer(tag[12 : 12 + 2 * count], ">u2").astype(np.float64)
        if count == 1:
            return np.asarray(SIGNALS ** (entries[0] / 256))
        return np.asarray(np.interp(SIGNALS, np.linspace(0, 1, count), entries / 65535))
    if kind != b"para":
        return None
    (function,) = struct.unpack(">H", tag[8:10])
    count = (1, 3, 4, 5, 7)[function]
    g, *rest = (value / 65536 for value in struct.unpack(f">{count}i", tag[12 : 12 + 4 * count]))
    a, b, c, d, e, f = (rest + [0.0] * 6)[:6] if rest else (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    power = np.maximum(a * SIGNALS + b, 0) ** g
    if function == 0:
        return np.asarray(power)
    if function in (1, 2):
        return np.asarray(np.where(-b / a <= SIGNALS, power + c, c))
    return np.asarray(np.where(d <= SIGNALS, power + e, c * SIGNALS + f))
