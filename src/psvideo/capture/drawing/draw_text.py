"""The timing diagram for a terminal, in Unicode blocks; it reads without colours too."""

from rich.text import Text

from psvideo.capture.drawing.diagram_shapes import kind_colour
from psvideo.capture.drawing.timeline import FrameSpans, Timeline, timeline
from psvideo.model.plan import Plan

LINES = 14
GUTTER = 5
MARKS = "123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ"
PARITY = "░▒"


def timing_text(plan: Plan, *, width: int = 80) -> Text:
    """Return the diagram of a plan for a terminal: rows downwards, time to the right.

    Frames alternate between two shades where a row saw all of a flash; a flash is a band of its light's digit, ``:``
    are rows that saw a part of one, ``·`` none, ``━`` is the dark row, blank the time in which a row is blind.
    """
    line = timeline(plan)
    columns = max(width - GUTTER - 1, 20)
    text = Text()
    for number in range(LINES):
        row = (number + 0.5) * line.camera.height_px / LINES
        label = {0: "0", LINES - 1: str(line.camera.height_px - 1)}.get(number, "row" if number == LINES // 2 else "")
        text.append(f"{label:>{GUTTER - 1}} ")
        for column in range(columns):
            text.append(*_cell(line, row, column, columns))
        text.append("\n")
    text.append(_time_axis(line, columns))
    text.append_text(_legend(line))
    return text


def _cell(line: Timeline, row: float, column: int, columns: int) -> tuple[str, str]:
    step_s = (line.end_s - line.start_s) / columns
    from_s = line.start_s + column * step_s
    for flash in line.flashes:
        first = int((flash.start_s - line.start_s) / step_s)
        last = first + max(round((flash.end_s - flash.start_s) / step_s), 1) - 1
        if flash.start_s >= line.start_s - step_s and first <= column <= last:
            if flash.place < 0:
                return "┊", "dim"
            return MARKS[flash.place % len(MARKS)], f"bold white on {kind_colour(flash.place)}"
    for frame in line.frames:
        opens_s = frame.opens_s(row, line.camera.height_px)
        if opens_s <= from_s + step_s / 2 < opens_s + line.camera.exposure_s:
            return _open_cell(line, frame, row)
    return " ", ""


def _open_cell(line: Timeline, frame: FrameSpans, row: float) -> tuple[str, str]:
    half = line.camera.height_px / LINES / 2
    if any(abs(dark - row) <= half for dark in frame.dark_rows):
        return "━", ""
    for span in frame.spans:
        if span.from_row <= row <= span.to_row:
            is_whole = min(span.from_share, span.to_share) > 1 - 1e-9
            return PARITY[frame.index % 2] if is_whole else ":", kind_colour(line.flashes[span.flash].place)
    return "·", "dim"


def _time_axis(line: Timeline, columns: int) -> str:
    end = f"{line.end_s * 1e3:.4g} ms"
    return " " * GUTTER + "0" + " " * (columns - 1 - len(end)) + end + "\n"


def _legend(line: Timeline) -> Text:
    text = Text(" " * GUTTER)
    for place, name in enumerate(line.kinds):
        text.append(MARKS[place % len(MARKS)], f"bold white on {kind_colour(place)}")
        text.append(f" {name}  ")
    if any(flash.place < 0 for flash in line.flashes):
        text.append("┊ dark slot")
    marks = ["━ dark row"] if any(frame.dark_rows for frame in line.frames) else []
    rows = "  ".join([*marks, "░▒ rows that saw all of a flash", ": part of one", "· none"])
    text.append("\n" + " " * GUTTER + rows + "\n")
    return text
