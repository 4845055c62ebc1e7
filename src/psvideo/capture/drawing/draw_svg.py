"""A picture as SVG text."""

from xml.sax.saxutils import escape

from psvideo.capture.drawing.shapes import Drawing, Label, Polygon

FONT = "DejaVu Sans, Helvetica, Arial, sans-serif"


def svg(picture: Drawing, *, unit: str = "") -> str:
    """Return the picture as an SVG file's text; ``unit`` is what one unit of the picture is on paper, such as mm."""
    width, height = f"{picture.width:g}", f"{picture.height:g}"
    size = f'width="{width}{unit}" height="{height}{unit}" viewBox="0 0 {width} {height}"'
    shapes = "\n".join(_text(shape) if isinstance(shape, Label) else _path(shape) for shape in picture.shapes)
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="{FONT}">\n{shapes}\n</svg>\n'


def _path(shape: Polygon) -> str:
    kind = "polygon" if shape.closed else "polyline"
    points = " ".join(f"{x:.2f},{y:.2f}" for x, y in shape.points)
    stroke = f' stroke="{shape.stroke}" stroke-width="{shape.width:g}"' if shape.stroke else ""
    return f'<{kind} points="{points}" fill="{shape.fill or "none"}"{stroke}/>'


def _text(label: Label) -> str:
    x, y = label.at
    turned = f' transform="rotate(-90 {x:.2f} {y:.2f})"' if label.upright else ""
    style = f'font-size="{label.size:g}" text-anchor="{label.anchor}" fill="{label.colour}"'
    return f'<text x="{x:.2f}" y="{y:.2f}" {style}{turned}>{escape(label.text)}</text>'
