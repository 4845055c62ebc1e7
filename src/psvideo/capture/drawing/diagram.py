"""The timing diagram as a file or for the terminal, by the name that the user gives."""

from pathlib import Path

from rich.text import Text

from psvideo.capture.drawing.diagram_shapes import timing_diagram
from psvideo.capture.drawing.draw_png import png
from psvideo.capture.drawing.draw_svg import svg
from psvideo.capture.drawing.draw_text import timing_text
from psvideo.errors import UsageError
from psvideo.formats.whole_files import PICTURE_MARK, marked_png, whole_file
from psvideo.model.plan import Plan

TERMINAL = "-"
"""The name that asks for the diagram as text."""


def check_diagram_name(name: str | None) -> Path | None:
    """Return the picture file that a name means, None for text or nothing; raises UsageError for other kinds."""
    if name is None or name == TERMINAL:
        return None
    path = Path(name)
    if path.suffix.lower() not in (".svg", ".png"):
        raise UsageError(
            f"`diagram` {name!r} is not a kind of picture that can be drawn. Name a .svg or .png file, or -."
        )
    return path


def write_diagram(plan: Plan, path: Path) -> None:
    """Write the diagram of a plan as SVG or PNG, whole or not at all."""
    picture = timing_diagram(plan)
    if path.suffix.lower() == ".png":
        data = marked_png(png(picture))
    else:
        data = svg(picture).replace("<svg ", f'<svg id="{PICTURE_MARK}" ', 1).encode()
    with whole_file(path) as beside:
        beside.write_bytes(data)


def diagram_text(plan: Plan, *, width: int = 80) -> Text:
    """Return the diagram of a plan for a terminal of that width."""
    return timing_text(plan, width=width)
