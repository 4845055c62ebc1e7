"""How well the flashes were found, as a picture: row profiles over time, fitted edges, what is left, and drift."""

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import marked_png, whole_file
from psvideo.model.camera import FloatArray
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.pictures.contact import Pixels, Strip, Tile, sheet
from psvideo.sync.rowfit.profiles import residuals_of

MOST_FRAMES = 120
TALL_PX, WIDE_PX = 320, 1440
COLOURS = ((255, 120, 90), (110, 220, 120), (110, 160, 255), (255, 210, 90), (220, 120, 255), (90, 220, 230))
DARK = (140, 140, 140)
RESIDUAL_GAIN = 10.0


def timing_picture(plan: Plan, timing: Timing, indices: NDArray[np.int64], profiles: FloatArray) -> Pixels:
    """Return 8-bit pixels (row, col, 3): four strips for eyes.

    ``indices`` (frame,) are the frames' true places in time, ``profiles`` (frame, row) their row means.
    """
    first = slice(0, min(MOST_FRAMES, len(indices)))
    values, places = profiles[first], indices[first]
    white = float(np.percentile(values, 99.5)) + 1e-9
    rest = residuals_of(plan, timing, places, values)
    shown = _edges(timing, places, _grey(values, white), values.shape[1])
    strips = [
        Strip(
            f"Row profiles, frame by frame ({len(places)} frames). {timing.how_sure}", [Tile("", _grey(values, white))]
        ),
        Strip("The same with every flash's end and start as fitted, one colour a light", [Tile("", shown)]),
        Strip(f"What the fit leaves, {RESIDUAL_GAIN:.0f} times as bright", [Tile("", _signed(rest, white))]),
        Strip(_drift_title(timing), [Tile("", _drift(timing))]),
    ]
    return sheet(strips, width_px=WIDE_PX)


def _scaled(picture: NDArray[np.uint8]) -> Pixels:
    return np.asarray(cv2.resize(picture, (WIDE_PX, TALL_PX), interpolation=cv2.INTER_NEAREST), np.uint8)


def _grey(values: FloatArray, white: float) -> Pixels:
    """Return the profiles (frame, row) as a picture, time to the right, rows downwards."""
    level = np.clip(values.T / white, 0, 1) ** (1 / 2.2)
    return _scaled(np.repeat((255 * level).astype(np.uint8)[..., None], 3, axis=2))


def _signed(rest: FloatArray, white: float) -> Pixels:
    """Return residuals as red (too bright) and blue (too dark) on grey."""
    level = np.clip(RESIDUAL_GAIN * rest.T / white, -1, 1)
    red, blue = np.clip(level, 0, 1), np.clip(-level, 0, 1)
    picture = 60 + 195 * np.stack([red, np.zeros_like(red), blue], axis=-1)
    return _scaled(picture.astype(np.uint8))


def _edges(timing: Timing, places: NDArray[np.int64], picture: Pixels, height: int) -> Pixels:
    """Draw where each flash starts and ends while a row opens or closes."""
    names = list(dict.fromkeys("+".join(flash.lit) for flash in timing.flashes))
    drawn, per_frame = picture.copy(), WIDE_PX / len(places)
    for column, place in enumerate(places.tolist()):
        for flash in timing.flashes:
            colour = COLOURS[names.index("+".join(flash.lit)) % len(COLOURS)] if flash.lit else DARK
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
    return row if timing.row_time_s > 0 else height - row


def _drift_title(timing: Timing) -> str:
    return (
        f"By how much flashes stray from a clock that runs straight ({timing.clock_offset_ppm:+.1f} ppm); "
        f"one line is {_unit_s(timing) * 1e6:.3g} us"
    )


def _unit_s(timing: Timing) -> float:
    stray_s = _stray_s(timing)
    return float(10.0 ** np.ceil(np.log10(max(float(np.abs(stray_s).max()), 1e-8))) / 2)


def _stray_s(timing: Timing) -> FloatArray:
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


def write_sheet(path: Path, picture: Pixels) -> None:
    """Write a picture of R, G, B pixels as PNG, whole or not at all."""
    done, data = cv2.imencode(".png", picture[..., ::-1])
    if not done:
        raise PsvideoError(f"{path}: the picture of shape {picture.shape} cannot be encoded as PNG.")
    with whole_file(path) as beside:
        beside.write_bytes(marked_png(data.tobytes()))
