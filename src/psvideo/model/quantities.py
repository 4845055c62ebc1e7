"""Everything that is written, shown or asked for by name: one row each, read by export, command line, page and report.

A new quantity is one row here and the function that computes it (for what belongs to an instant, in
export/sequences/planes.py).
"""

from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Literal, get_args

Aov = Literal[
    "depth", "residual", "error", "source", "position", "beauty", "age", "reach", "specular", "alpha", "motion"
]
"""The quantities that are written where they are asked for; the table has a row for each."""
Shown = Literal["normals", "light", "mask", "heat", "position", "never"]
"""How a quantity is shown: as directions, as light, as yes and no, as a measure in false colours, as points; or not at
all, being for programs only."""
Source = Literal["surface", "plates", "depth"]
SOURCES: tuple[Source, ...] = ("surface", "plates", "depth")
"""What a quantity is computed from: the solved surface, the round's plates, or the integrated depth, in this order."""


@dataclass(frozen=True)
class Quantity:
    """What is fixed about one quantity, the same for every clip.

    name: in folders, file names, EXR parts and options.
    label: for people.
    channels: in an EXR file; one channel of plates and ambient light where the camera is grey.
    written: with every result, where it is asked for (an AOV), or in a folder of plates.
    digits: 16 bits (half), 32 bits (float), or as the delivery asks.
    colour: whether it is light or colour, and so has a colour space; everything else is data.
    of: what it is computed from, one of SOURCES.
    unit: of the numbers in the file; empty where they have none, or one that depends on the rig.
    shown: how it is looked at; ``from_zero`` says of a measure in false colours that they begin at 0, ``hatched``
        that the page marks what is not valid of it.
    """

    name: str
    label: str
    channels: tuple[str, ...]
    written: Literal["always", "asked", "plates"]
    of: Source
    shown: Shown
    _: KW_ONLY
    digits: Literal["half", "float", "asked"] = "half"
    colour: bool = False
    unit: str = ""
    from_zero: bool = True
    hatched: bool = False


_RGB, _Y = ("R", "G", "B"), ("Y",)
_UV = ("forward.u", "forward.v", "backward.u", "backward.v")

_ROWS = (
    # name, label, channels, written, of, shown
    Quantity("normals", "Normals", _RGB, "always", "surface", "normals", digits="asked", hatched=True),
    Quantity("albedo", "Albedo", _RGB, "always", "surface", "light", colour=True, hatched=True),
    Quantity("valid", "Validity", _Y, "always", "surface", "mask"),
    Quantity("depth", "Depth", _Y, "asked", "depth", "heat", digits="float", from_zero=False, hatched=True),
    Quantity("residual", "Residual", _Y, "asked", "surface", "heat", hatched=True),
    Quantity("error", "Predicted error", _Y, "asked", "surface", "heat", unit="°", hatched=True),
    Quantity("source", "Source", _Y, "asked", "surface", "heat"),
    Quantity("position", "Position", _RGB, "asked", "depth", "position", digits="float", hatched=True),
    Quantity("beauty", "Beauty", _RGB, "asked", "plates", "light", colour=True),
    Quantity("age", "Age", _Y, "asked", "plates", "heat", digits="float", unit="s"),
    Quantity("reach", "Lights that reach it", _Y, "asked", "plates", "heat"),
    Quantity("specular", "Beyond diffuse", _RGB, "asked", "plates", "light", colour=True),
    Quantity("alpha", "Matte", _Y, "asked", "plates", "mask"),
    Quantity("motion", "Motion vectors", _UV, "asked", "plates", "never", digits="float", unit="px"),
    Quantity("plate", "Plate", _RGB, "plates", "plates", "light", colour=True),
    Quantity("ambient", "Ambient", _RGB, "plates", "plates", "light", colour=True),
)
QUANTITIES: Mapping[str, Quantity] = {row.name: row for row in _ROWS}
"""All quantities by name, in the order in which they are listed and shown. Depth and positions are in metres
where the rig says how large the scene is; 11 binary digits are too few for a place in space."""

ALWAYS: tuple[str, ...] = tuple(name for name, row in QUANTITIES.items() if row.written == "always")
"""What every result holds."""
AOVS: tuple[Aov, ...] = get_args(Aov)
"""What may be asked for as well, in the table's order."""


def is_half(name: str, *, asked: bool) -> bool:
    """Return whether a quantity is stored in 16 bits; ``asked`` counts where it is the delivery's choice.

    >>> is_half("normals", asked=False), is_half("albedo", asked=False), is_half("depth", asked=True)
    (False, True, False)
    """
    digits = QUANTITIES[name].digits
    return asked if digits == "asked" else digits == "half"
