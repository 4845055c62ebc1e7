"""A drawing as a list of shapes in picture pixels: what SVG and PNG are both written from."""

from dataclasses import dataclass
from typing import Literal

Point = tuple[float, float]
INK, GREY, PALE = "#222222", "#777777", "#f1f1f1"


@dataclass(frozen=True, kw_only=True)
class Polygon:
    """A filled shape, an outline, or both; an open one is a line."""

    points: tuple[Point, ...]
    fill: str | None = None
    stroke: str | None = None
    width: float = 1.0
    closed: bool = True


@dataclass(frozen=True, kw_only=True)
class Label:
    """A piece of text; ``at`` is on its baseline, at the end that ``anchor`` names; ``upright`` reads upwards."""

    at: Point
    text: str
    size: float = 13.0
    anchor: Literal["start", "middle", "end"] = "middle"
    colour: str = INK
    upright: bool = False


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """Shapes in the order in which they are painted."""

    width: float
    height: float
    shapes: tuple[Polygon | Label, ...]
