"""The timing diagram of a plan as shapes, like the paper's figure 4: rows downwards, time to the right."""

import math
from collections.abc import Iterator, Sequence

from psvideo.capture.drawing.shapes import GREY, INK, PALE, Drawing, Label, Point, Polygon
from psvideo.capture.drawing.timeline import FrameSpans, Span, Timeline, timeline
from psvideo.model.plan import Plan
from psvideo.model.units import show_rate, show_seconds

WIDTH, HEIGHT = 980.0, 492.0
LEFT, RIGHT, TOP, BOTTOM = 78.0, 958.0, 140.0, 420.0
LIGHT_COLOURS = ("#d1495b", "#00798c", "#edae49", "#5b5f97", "#66a182", "#b07aa1", "#2e86ab", "#8d6a4f")
FADE_STRIPS = 24
TINT = 0.55


def timing_diagram(plan: Plan) -> Drawing:
    """Return the timing diagram of a plan, like the paper's figure 4: rows downwards, time to the right."""
    line = timeline(plan)
    shapes: list[Polygon | Label] = [Polygon(points=_box(0, 0, WIDTH, HEIGHT), fill="#ffffff")]
    for frame in line.frames:
        shapes += _frame_fill(line, frame)
    shapes += _bands(line)
    for frame in line.frames:
        shapes += _frame_outline(line, frame)
    shapes += _axes(line)
    shapes += _legend(line)
    shapes += _title(plan)
    return Drawing(width=WIDTH, height=HEIGHT, shapes=tuple(shapes))


def kind_colour(place: int) -> str:
    """Return the colour of a kind of flash."""
    return LIGHT_COLOURS[place % len(LIGHT_COLOURS)]


def _x(line: Timeline, time_s: float) -> float:
    return LEFT + (time_s - line.start_s) / (line.end_s - line.start_s) * (RIGHT - LEFT)


def _y(line: Timeline, row: float) -> float:
    return TOP + row / line.camera.height_px * (BOTTOM - TOP)


def _box(left: float, top: float, right: float, bottom: float) -> tuple[Point, ...]:
    return ((left, top), (right, top), (right, bottom), (left, bottom))


def _rows_of(line: Timeline, frame: FrameSpans, top: float, bottom: float) -> tuple[Point, ...]:
    """Return the part of a frame's parallelogram between two rows, cut at the diagram's left edge."""
    rows, exposure_s = line.camera.height_px, line.camera.exposure_s
    corners = [(frame.opens_s(row, rows) + late_s, row) for row, late_s in ((top, 0.0), (top, exposure_s))]
    corners += [(frame.opens_s(row, rows) + late_s, row) for row, late_s in ((bottom, exposure_s), (bottom, 0.0))]
    return _right_of_edge([(_x(line, time_s), _y(line, row)) for time_s, row in corners])


def _right_of_edge(points: Sequence[Point]) -> tuple[Point, ...]:
    """Return a convex shape without what lies left of the diagram (Sutherland and Hodgman 1974, one edge)."""
    kept: list[Point] = []
    for (x0, y0), (x1, y1) in zip(points, [*points[1:], points[0]], strict=True):
        if x0 >= LEFT:
            kept.append((x0, y0))
        if (x0 < LEFT) != (x1 < LEFT):
            kept.append((LEFT, y0 + (y1 - y0) * (LEFT - x0) / (x1 - x0)))
    return tuple(kept)


def _frame_fill(line: Timeline, frame: FrameSpans) -> Iterator[Polygon]:
    yield Polygon(points=_rows_of(line, frame, 0, line.camera.height_px), fill=PALE)
    for span in frame.spans:
        colour = kind_colour(line.flashes[span.flash].place)
        for top, bottom, share in _strips(span):
            yield Polygon(points=_rows_of(line, frame, top, bottom), fill=_mixed(colour, TINT * share))


def _strips(span: Span) -> Iterator[tuple[float, float, float]]:
    count = 1 if span.from_share == span.to_share else FADE_STRIPS
    step = (span.to_row - span.from_row) / count
    for index in range(count):
        share = span.from_share + (span.to_share - span.from_share) * (index + 0.5) / count
        yield span.from_row + index * step, span.from_row + (index + 1) * step, share


def _mixed(colour: str, strength: float) -> str:
    """Return a colour laid thinly over the pale ground."""
    ground, top = (tuple(int(code[at : at + 2], 16) for at in (1, 3, 5)) for code in (PALE, colour))
    return "#" + "".join(f"{round(g + (t - g) * strength):02x}" for g, t in zip(ground, top, strict=True))


def _frame_outline(line: Timeline, frame: FrameSpans) -> Iterator[Polygon | Label]:
    rows = line.camera.height_px
    yield Polygon(points=_rows_of(line, frame, 0, rows), stroke=GREY, width=1.2)
    for row in frame.dark_rows:
        opens_s = frame.opens_s(row, rows)
        ends = [max(_x(line, time_s), LEFT) for time_s in (opens_s, opens_s + line.camera.exposure_s)]
        yield Polygon(points=tuple((x, _y(line, row)) for x in ends), stroke=INK, width=2.4, closed=False)
    if frame.index >= 0:
        at = (_x(line, frame.top_s + line.camera.exposure_s / 2), TOP - 25)
        yield Label(at=at, text=f"frame {frame.index}", size=12, colour=GREY)


def _bands(line: Timeline) -> Iterator[Polygon | Label]:
    for flash in line.flashes:
        left, right = max(_x(line, flash.start_s), LEFT), min(_x(line, flash.end_s), RIGHT)
        if right <= left:
            continue
        if flash.place < 0:
            yield Polygon(points=_box(left, TOP, right, BOTTOM), stroke=INK, width=1.0)
        else:
            yield Polygon(points=_box(left, TOP, right, BOTTOM), fill=kind_colour(flash.place))
        name = "dark" if flash.place < 0 else flash.label if len(flash.label) <= 9 else flash.label[:8] + "…"
        yield Label(at=(min(max((left + right) / 2, LEFT + 10), RIGHT - 14), TOP - 7), text=name, size=12)


def _axes(line: Timeline) -> Iterator[Polygon | Label]:
    yield Polygon(points=((LEFT, TOP), (LEFT, BOTTOM), (RIGHT, BOTTOM)), stroke=INK, width=1.4, closed=False)
    last = line.camera.height_px - 1
    for row in (0, last // 2, last):
        y = _y(line, row + 0.5)
        yield Polygon(points=((LEFT - 5, y), (LEFT, y)), stroke=INK, closed=False)
        yield Label(at=(LEFT - 9, y + 4), text=str(row), size=12, anchor="end")
    yield Label(at=(26, (TOP + BOTTOM) / 2), text="row", upright=True)
    step = _tick_step((line.end_s - line.start_s) * 1e3)
    for tick in range(math.floor((line.end_s - line.start_s) * 1e3 / step) + 1):
        x = _x(line, line.start_s + tick * step / 1e3)
        yield Polygon(points=((x, BOTTOM), (x, BOTTOM + 5)), stroke=INK, closed=False)
        yield Label(at=(x, BOTTOM + 19), text=f"{tick * step:g}", size=12)
    yield Label(at=((LEFT + RIGHT) / 2, BOTTOM + 40), text="time on the camera's clock (ms)")


def _tick_step(length: float) -> float:
    """Return a round step that gives 5 to 12 ticks.

    >>> _tick_step(58.0), _tick_step(1.0)
    (5.0, 0.1)
    """
    rough = length / 12
    power = 10.0 ** math.floor(math.log10(rough))
    return next(round(factor * power, 12) for factor in (1, 2, 5, 10) if factor * power >= rough)


def _legend(line: Timeline) -> Iterator[Polygon | Label]:
    x, y = LEFT, 66.0
    for place, name in enumerate(line.kinds):
        if x + 34 + 7.2 * len(name) > RIGHT - 20:
            yield Label(at=(x, y), text="…", anchor="start")
            break
        yield from _entry(x, y, name, fill=kind_colour(place))
        x += 34 + 7.2 * len(name)
    x, y, colour = LEFT, y + 20, kind_colour(0)
    yield from _entry(x, y, "rows that saw all of a flash", fill=_mixed(colour, TINT))
    x += 206
    if any(span.from_share != span.to_share for frame in line.frames for span in frame.spans):
        for strip in range(7):
            box = _box(x + 2 * strip, y - 10, x + 2 * strip + 2, y + 1)
            yield Polygon(points=box, fill=_mixed(colour, TINT * (1 - strip / 7)))
        yield Label(at=(x + 19, y), text="partial rows", size=12, anchor="start")
        x += 112
    if any(frame.dark_rows for frame in line.frames):
        yield Polygon(points=((x, y - 4), (x + 14, y - 4)), stroke=INK, width=2.4, closed=False)
        yield Label(at=(x + 19, y), text="dark row", size=12, anchor="start")
        x += 92
    if any(flash.place < 0 for flash in line.flashes):
        yield from _entry(x, y, "dark slot", stroke=INK)


def _entry(
    x: float, y: float, text: str, *, fill: str | None = None, stroke: str | None = None
) -> Iterator[Polygon | Label]:
    yield Polygon(points=_box(x, y - 10, x + 14, y + 1), fill=fill, stroke=stroke)
    yield Label(at=(x + 19, y), text=text, size=12, anchor="start")


def _title(plan: Plan) -> Iterator[Label]:
    camera = plan.camera
    readout = "global shutter" if camera.readout_s == 0 else f"readout {show_seconds(abs(camera.readout_s or 0.0))}"
    if camera.readout_s is None:
        readout = "readout unknown, drawn as the whole frame"
    elif camera.readout_s < 0:
        readout += ", bottom row first"
    name = f"{camera.name}, {camera.width_px} × {camera.height_px} at {show_rate(camera.fps)}"
    yield Label(at=(LEFT, 24), text=f"{name}, shutter {camera.shutter_deg:.4g}°, {readout}", size=15, anchor="start")
    durations = sorted({flash.duration_s for flash in plan.flashes if not flash.is_dark})
    flashes = " and ".join(dict.fromkeys(show_seconds(length_s) for length_s in (durations[0], durations[-1])))
    text = f"{plan.mode}: flashes of {flashes}, dark time {show_seconds(plan.dark_s)}"
    yield Label(at=(LEFT, 43), text=text, size=13, anchor="start", colour=GREY)
