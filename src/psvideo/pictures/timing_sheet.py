"""How well the flashes were found, as a picture: row profiles over time, fitted edges, what is left, and drift."""

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Pixels
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.pictures.contact import BACKGROUND, FAINT_INK, GAP_PX, INK, Strip, Tile, sheet, write_line
from psvideo.sync.rowfit.compiled_profiles import residuals_of

MOST_FRAMES = 120
SHEET_PX, SIDE_PX, BELOW_PX = 1440, 62, 24
"""The sheet's width, and what an axis takes at the left of a plot and below it."""
TALL_PX, WIDE_PX = 320, SHEET_PX - 2 * GAP_PX - SIDE_PX
TEXT = 0.44
COLOURS = ((255, 120, 90), (110, 220, 120), (110, 160, 255), (255, 210, 90), (220, 120, 255), (90, 220, 230))
DARK = (140, 140, 140)
RESIDUAL_GAIN = 10.0
LEFT_OVER = {"brighter than the fit": (255, 60, 60), "darker than the fit": (60, 60, 255)}


def timing_picture(plan: Plan, timing: Timing, indices: NDArray[np.int64], profiles: Doubles) -> Pixels:
    """Return 8-bit pixels (row, col, 3): four strips for eyes, with axes and a legend.

    ``indices`` (frame,) are the frames' true places in time, ``profiles`` (frame, row) their row means.
    """
    first = slice(0, min(MOST_FRAMES, len(indices)))
    values, places = profiles[first], indices[first]
    white = float(np.percentile(values, 99.5)) + 1e-9
    rest = residuals_of(plan, timing, places, values)
    rows = values.shape[1]
    shown = _edges(timing, places, _grey(values, white), rows)
    plots = {
        f"How bright every row of every frame is ({len(places)} frames). {timing.how_sure}": _in_axes(
            _grey(values, white), places, rows
        ),
        "The same with the rows at which a flash starts and ends, as fitted": np.concatenate(
            [_in_axes(shown, places, rows), _legend(_colours(timing))]
        ),
        f"What the fit leaves, {RESIDUAL_GAIN:.0f} times as bright; grey: nothing": np.concatenate(
            [_in_axes(_signed(rest, white), places, rows), _legend(LEFT_OVER)]
        ),
        _drift_title(timing): _drift_in_axes(timing),
    }
    return sheet([Strip(title, [Tile("", plot)]) for title, plot in plots.items()], width_px=SHEET_PX)


def _ticks(first: float, last: float, count: int) -> list[float]:
    """Return round numbers between two, about as many as asked for."""
    step = max((last - first) / count, 1e-12)
    size = 10.0 ** np.floor(np.log10(step))
    step = next(float(size * times) for times in (1, 2, 5, 10) if size * times >= step)
    return [float(value) for value in np.arange(np.ceil(first / step) * step, last + step / 1000, step)]


def _framed(plot: Pixels, across: Mapping[float, str], down: Mapping[float, str]) -> Pixels:
    """Return a plot with numbers below and at its left, each at its share of the width or height."""
    tall, wide = plot.shape[:2]
    canvas = np.full((tall + BELOW_PX, wide + SIDE_PX, 3), BACKGROUND, np.uint8)
    canvas[:tall, SIDE_PX:] = plot
    for share, text in across.items():
        x = SIDE_PX + round(share * (wide - 1))
        canvas[tall : tall + 5, x] = FAINT_INK
        write_line(canvas, text, min(max(x - 4 * len(text), 0), SIDE_PX + wide - 9 * len(text)), tall + 20, TEXT, INK)
    for share, text in down.items():
        y = round(share * (tall - 1))
        canvas[y, SIDE_PX - 5 : SIDE_PX] = FAINT_INK
        write_line(canvas, text, max(SIDE_PX - 10 - 8 * len(text), 0), min(max(y + 5, 12), tall), TEXT, INK)
    return canvas


def _in_axes(plot: Pixels, places: NDArray[np.int64], rows: int) -> Pixels:
    """Return a picture of rows over frames with both numbered: frames from the clip's first on, rows from the top."""
    counts = [int(value) for value in _ticks(0, len(places) - 1, 12) if value == int(value)]
    across = {(count + 0.5) / len(places): str(int(places[count])) for count in counts}
    across[min(across)] = f"frame {across[min(across)]}"
    down = {value / rows: str(int(value)) for value in _ticks(0, rows - 1, 4)}
    down[0.0] = "row 0"
    return _framed(plot, across, down)


def _colours(timing: Timing) -> dict[str, tuple[int, int, int]]:
    """Return the colour of every set of lights that flashes together, by its name, and the dark slot's."""
    names = list(dict.fromkeys("+".join(flash.lit) for flash in timing.flashes))
    return {name or "dark slot": COLOURS[place % len(COLOURS)] if name else DARK for place, name in enumerate(names)}


def _legend(colours: Mapping[str, tuple[int, int, int]]) -> Pixels:
    """Return a line of colours with what they mean; where they do not all fit, the first."""
    canvas = np.full((BELOW_PX, WIDE_PX + SIDE_PX, 3), BACKGROUND, np.uint8)
    x = SIDE_PX
    for name, colour in colours.items():
        if x + 30 + 9 * len(name) > canvas.shape[1]:
            write_line(canvas, "...", x, 16, TEXT, INK)
            break
        canvas[6:18, x : x + 12] = colour
        write_line(canvas, name, x + 16, 17, TEXT, INK)
        x += 36 + 8 * len(name)
    return canvas


def _scaled(picture: NDArray[np.uint8]) -> Pixels:
    return np.asarray(cv2.resize(picture, (WIDE_PX, TALL_PX), interpolation=cv2.INTER_NEAREST), np.uint8)


def _grey(values: Doubles, white: float) -> Pixels:
    """Return the profiles (frame, row) as a picture, time to the right, rows downwards."""
    level = np.clip(values.T / white, 0, 1) ** (1 / 2.2)
    return _scaled(np.repeat((255 * level).astype(np.uint8)[..., None], 3, axis=2))


def _signed(rest: Doubles, white: float) -> Pixels:
    """Return residuals as red (too bright) and blue (too dark) on grey."""
    level = np.clip(RESIDUAL_GAIN * rest.T / white, -1, 1)
    red, blue = np.clip(level, 0, 1), np.clip(-level, 0, 1)
    picture = 60 + 195 * np.stack([red, np.zeros_like(red), blue], axis=-1)
    return _scaled(picture.astype(np.uint8))


def _edges(timing: Timing, places: NDArray[np.int64], picture: Pixels, height: int) -> Pixels:
    """Draw where each flash starts and ends while a row opens or closes."""
    colours = _colours(timing)
    drawn, per_frame = picture.copy(), WIDE_PX / len(places)
    for column, place in enumerate(places.tolist()):
        for flash in timing.flashes:
            colour = colours["+".join(flash.lit) or "dark slot"]
            for moment_s in (flash.start_s, flash.start_s + flash.duration_s):
                row = _row_at(timing, moment_s - place * timing.frame_period_s, height)
                if row is not None:
                    y = round(row / height * (TALL_PX - 1))
                    cv2.line(drawn, (round(column * per_frame), y), (round((column + 1) * per_frame) - 1, y), colour, 2)
    return drawn


def _row_at(timing: Timing, since_s: float, height: int) -> float | None:
    """Return the row that opens at a moment after its frame's start, where there is one."""
    if not timing.row_time_s:
        return None
    row = since_s / abs(timing.row_time_s)
    if not 0 <= row < height:
        return None
    return row if timing.row_time_s > 0 else height - 1 - row


def _drift_title(timing: Timing) -> str:
    return f"By how many us flashes stray from a clock that runs straight ({timing.clock_offset_ppm:+.1f} ppm)"


def _unit_s(timing: Timing) -> float:
    stray_s = _stray_s(timing)
    return float(10.0 ** np.ceil(np.log10(max(float(np.abs(stray_s).max()), 1e-8))) / 2)


def _stray_s(timing: Timing) -> Doubles:
    """Return every flash's distance from the straight line through all that share its slot, shape (flash,)."""
    stray_s = np.zeros(len(timing.flashes))
    slots = np.array([flash.slot for flash in timing.flashes])
    for slot in np.unique(slots):
        at = np.flatnonzero(slots == slot)
        if len(at) > 2:
            stray_s[at] = timing.start_s[at] - np.polyval(np.polyfit(at, timing.start_s[at], 1), at)
    return stray_s


def _drift(timing: Timing) -> Pixels:
    canvas = np.full((TALL_PX // 2, WIDE_PX, 3), 36, np.uint8)
    middle, unit_s = TALL_PX // 4, _unit_s(timing)
    for line in (-1, 0, 1):
        y = round(middle - line * 0.4 * middle)
        cv2.line(canvas, (0, y), (WIDE_PX - 1, y), (80, 80, 80), 1)
    stray_s = _stray_s(timing)
    x = np.linspace(4, WIDE_PX - 5, max(len(stray_s), 2))[: len(stray_s)]
    for place, late_s in zip(x, stray_s, strict=True):
        y = round(float(middle - np.clip(late_s / unit_s, -2.2, 2.2) * 0.4 * middle))
        cv2.circle(canvas, (round(float(place)), y), 2, (120, 200, 255), -1)
    return canvas


def _drift_in_axes(timing: Timing) -> Pixels:
    unit, count = _unit_s(timing) * 1e6, len(timing.flashes)
    down = {0.5 - line * 0.2: f"{line * unit:+.3g}" if line else "0" for line in (-1, 0, 1)}
    numbers = [int(value) for value in _ticks(0, max(count - 1, 1), 12) if value == int(value) and value < count]
    across = {number / max(count - 1, 1): str(number) for number in numbers}
    across[0.0] = "flash 0"
    return _framed(_drift(timing), across, down)
