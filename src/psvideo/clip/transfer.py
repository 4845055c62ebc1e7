"""Transfer curves: from a file's code, as a fraction of its largest code, to linear light.

The curves are OpenColorIO's, from its built-in studio config; only the curve is used, never a matrix between gamuts,
because each channel of a picture is measured by itself. Names are OpenColorIO's own or the short ones of ``CURVES``.
"""

import functools
import re
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError, UsageError, nearest
from psvideo.model.arrays import Doubles

STUDIO_CONFIG = "studio-config-v2.2.0_aces-v1.3_ocio-v2.4"
UNKNOWN_COLOUR = "unknown"


@dataclass(frozen=True, kw_only=True)
class TransferCurve:
    """One curve: its short name, OpenColorIO's name of it, and the colour interop id of its camera's linear gamut.

    ``colour`` is ``unknown`` where the curve is used with several gamuts. ``on_codes``: its maker defines the curve
    on recorded code values, and so for movies on codes before video range is expanded.
    """

    name: str
    source: str
    colour: str = UNKNOWN_COLOUR
    on_codes: bool = False
    also: tuple[str, ...] = ()


CURVES = (
    TransferCurve(name="linear", source="", colour="lin_rec709_scene", also=("lin", "raw", "Linear Rec.709 (sRGB)")),
    TransferCurve(
        name="srgb",
        source="sRGB - Curve",
        colour="lin_rec709_scene",
        also=("sRGB Encoded Rec.709 (sRGB)", "sRGB - Texture", "sRGB - Display"),
    ),
    TransferCurve(
        name="rec709",
        source="Rec.709 - Curve",
        colour="lin_rec709_scene",
        also=("bt709", "bt1886-oetf", "rec2020", "bt2020", "Camera Rec.709"),
    ),
    TransferCurve(
        name="gamma24",
        source="Rec.1886 - Curve",
        colour="lin_rec709_scene",
        also=("rec1886", "bt1886", "Gamma 2.4 Encoded Rec.709", "Rec.1886 Rec.709 - Display"),
    ),
    TransferCurve(name="gamma22", source="gamma 2.2", colour="lin_rec709_scene", also=("Gamma 2.2 Encoded Rec.709",)),
    TransferCurve(name="gamma18", source="gamma 1.8", colour="lin_rec709_scene", also=("Gamma 1.8 Encoded Rec.709",)),
    TransferCurve(name="slog3", source="S-Log3 - Curve", on_codes=True),
    TransferCurve(
        name="slog3-sgamut3",
        source="S-Log3 - Curve",
        colour="ocio:lin_sgamut3_scene",
        on_codes=True,
        also=("S-Log3 S-Gamut3",),
    ),
    TransferCurve(
        name="slog3-sgamut3cine",
        source="S-Log3 - Curve",
        colour="ocio:lin_sgamut3cine_scene",
        on_codes=True,
        also=("S-Log3 S-Gamut3.Cine",),
    ),
    TransferCurve(
        name="logc3",
        source="ARRI LogC3 - Curve (EI800)",
        colour="ocio:lin_awg3_scene",
        also=("logc", "logc3ei800", "arrilogc3", "ARRI LogC3 (EI800)"),
    ),
    TransferCurve(name="logc4", source="ARRI LogC4 - Curve", colour="ocio:lin_awg4_scene", also=("ARRI LogC4",)),
    TransferCurve(
        name="vlog", source="V-Log - Curve", colour="ocio:lin_vgamut_scene", on_codes=True, also=("V-Log V-Gamut",)
    ),
    TransferCurve(
        name="clog2", source="C-Log2 - Curve", on_codes=True, also=("canonlog2", "CanonLog2 CinemaGamut D55")
    ),
    TransferCurve(
        name="clog3", source="C-Log3 - Curve", on_codes=True, also=("canonlog3", "CanonLog3 CinemaGamut D55")
    ),
    TransferCurve(
        name="log3g10",
        source="Log3G10 - Curve",
        colour="ocio:lin_rwg_scene",
        also=("redlog3g10", "Log3G10 REDWideGamutRGB"),
    ),
    TransferCurve(
        name="bmdfilm5",
        source="BMDFilm Gen5 Log - Curve",
        colour="ocio:lin_bmdwg5_scene",
        also=("bmdfilmgen5", "bmdfilmgen5log", "BMDFilm WideGamut Gen5"),
    ),
    TransferCurve(
        name="davinci",
        source="DaVinci Intermediate Log - Curve",
        colour="ocio:lin_dwg_scene",
        also=("davinciintermediate", "davinciintermediatelog", "DaVinci Intermediate WideGamut"),
    ),
    TransferCurve(name="applelog", source="Apple Log - Curve", colour="lin_rec2020_scene"),
    TransferCurve(name="acescct", source="CURVE - ACEScct-LOG_to_LINEAR", colour="lin_ap1_scene"),
    TransferCurve(name="st2084", source="ST-2084 - Curve", colour="lin_rec2020_scene", also=("pq", "smpte2084")),
    TransferCurve(name="hlg", source="CURVE - HLG-OETF-INVERSE", colour="lin_rec2020_scene", also=("aribstdb67",)),
)


DISPLAYED = ("linear", "srgb", "rec709", "gamma24", "gamma22", "gamma18", "st2084", "hlg")
"""The curves that a file's own tag can name."""
LOGARITHMIC = "logarithmic"
"""The tag of files that hold a logarithm of light and do not say which."""
BY_H273 = {
    1: "rec709",
    4: "gamma22",
    6: "rec709",
    8: "linear",
    13: "srgb",
    14: "rec709",
    15: "rec709",
    16: "st2084",
    18: "hlg",
}
"""Curves by their codes in ITU-T H.273, table 3, which movies and PNG (``cICP``) use."""


def find_curve(name: str) -> TransferCurve:
    """Return the curve with this name; case, blanks and punctuation do not matter.

    Raises PsvideoError that names the nearest known one and lists all.

    >>> find_curve("S-Log3").source, find_curve("sRGB - Curve").name
    ('S-Log3 - Curve', 'srgb')
    """
    found = _spellings().get(_letters(name))
    if found is None:
        raise PsvideoError(
            f"transfer is {name!r}, {_unknown(name)} Write the name of the curve with which the camera encoded the "
            "files into the plan's [camera] table."
        )
    return found


def check_transfer(name: str | None) -> None:
    """Raise UsageError where somebody names a curve that is not known; None says nothing.

    >>> check_transfer("S-Log3")
    """
    if name is not None and _letters(name) not in _spellings():
        raise UsageError(
            f"`transfer` is {name!r}, {_unknown(name)} Name the curve with which the camera encoded the files."
        )


def _unknown(name: str) -> str:
    known = [curve.name for curve in CURVES]
    advice = nearest(_letters(name), _spellings())
    listed = "" if advice.startswith("known are") else f" Known are: {', '.join(known)}."
    advice = f"known are: {', '.join(known)}." if not listed else advice
    return f"not a curve that this psvideo knows; {advice}{listed}"


@functools.cache
def _spellings() -> dict[str, TransferCurve]:
    spellings: dict[str, TransferCurve] = {}
    for curve in CURVES:
        for spelling in (curve.name, curve.source, *curve.also):
            spellings.setdefault(_letters(spelling), curve)
    return spellings


def _letters(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower()).removesuffix("curve")


def records_scene(transfer: str) -> bool:
    """Return whether a curve holds a scene far beyond its white, as logarithms, PQ and HLG do: how far light lies below
    the largest code then says little of its exposure.

    >>> records_scene("logc3"), records_scene("hlg"), records_scene("rec709")
    (True, True, False)
    """
    name = find_curve(transfer).name
    return name in ("st2084", "hlg") or name not in DISPLAYED


def to_light(curve: TransferCurve, signal: Doubles | NDArray[np.float32]) -> Doubles:
    """Return the linear light, on the curve's own scale, that a signal (fraction of the largest code) stands for."""
    if not curve.source:
        return np.array(signal, np.float64)
    values = np.resize(np.asarray(signal, np.float32), (-(-np.size(signal) // 3), 3))
    _processor(curve.source).applyRGB(values)
    return values.ravel()[: np.size(signal)].reshape(np.shape(signal)).astype(np.float64)


@functools.cache
def _processor(source: str) -> Any:
    ocio: Any = import_module("PyOpenColorIO")  # only where a curve is needed: it takes 0.1 s and has no types
    config = ocio.Config.CreateFromBuiltinConfig(STUDIO_CONFIG)
    if source.startswith("gamma "):
        exponent = float(source.removeprefix("gamma "))
        transform = ocio.ExponentTransform(value=[exponent] * 3 + [1.0], negativeStyle=ocio.NEGATIVE_MIRROR)
        processor = config.getProcessor(transform)
    elif source in {named.getName() for named in config.getNamedTransforms()}:
        processor = config.getProcessor(config.getNamedTransform(source), ocio.TRANSFORM_DIR_FORWARD)
    else:
        processor = config.getProcessor(ocio.BuiltinTransform(source))
    return processor.getOptimizedCPUProcessor(ocio.OPTIMIZATION_LOSSLESS)
