"""A camera's readout time from the stripes that a blinking LED leaves in its pictures.

While the rows of a rolling shutter open one after the other, an LED of known rate goes through its blinks: one period
of the stripes is as many rows as open during one blink. So ``row time = 1 / (LED rate * rows per period)``, and the
readout time is the row time times the sensor's rows. See ``calibration/README.md`` for how to film it.
"""

from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from psvideo.calibrate.stripes.detection import check_stripes, find_stripes
from psvideo.calibrate.stripes.led_pictures import LedPictures
from psvideo.calibrate.stripes.spectrum import find_fainter
from psvideo.calibrate.stripes.steps import Direction, find_direction
from psvideo.calibrate.stripes.waveform import StripeFit, fit_stripes
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.arrays import Doubles

FEWEST_MOVING = 3
PERIODS_PER_HALF = 3
UNEVEN_ERRORS = 4.0
UNEVEN_SHARE = 0.002


@dataclass(frozen=True, kw_only=True)
class Led:
    """A blinking LED: its rate, and how far its clock may be off."""

    rate_hz: float
    tolerance_ppm: float


@dataclass(frozen=True, kw_only=True)
class Readout:
    """A measured readout time; all errors are standard errors.

    ``stripes_error_s`` comes from the pictures, ``clock_error_s`` from the LED's clock, taken as uniform within its
    tolerance; ``error_s`` is both. ``spread_s`` is the standard deviation over the frames, None of a single one. Rows
    per period are counted in rows of the picture; ``rows`` are those of the whole frame. ``contrast`` is half the swing
    of the stripes over the picture's mean code value.
    """

    readout_s: float
    error_s: float
    stripes_error_s: float
    clock_error_s: float
    rows: int
    rows_per_period: float
    rows_per_period_error: float
    periods: float
    frames: int
    spread_s: float | None
    contrast: float
    direction: Direction
    direction_reason: str
    warnings: tuple[str, ...]


def measure_readout(
    pictures: LedPictures,
    led: Led,
    *,
    rows: int | None = None,
    zoom: float = 1.0,
    near_s: float | None = None,
    fps: Fraction | None = None,
) -> Readout:
    """Measure the readout time of a frame of ``rows`` rows (left out: those of the picture, over ``zoom``).

    ``zoom`` is how many rows of the picture show one row of the sensor; ``near_s`` is roughly what is expected; ``fps``
    is the rate at which the frames were filmed, which gives the direction. Raises PsvideoError that names the pictures
    where they hold no stripes, fewer than two periods, or stripes that can be read in two ways, and UsageError where
    they show more rows than a whole frame is said to have.
    """
    shown = round(pictures.height_px / zoom)
    if rows is not None and rows < shown:
        raise UsageError(
            f"`rows` {rows}: {pictures.name} shows {shown} rows of the sensor already. Expected the rows of the whole "
            "frame that it is a part of; leave it out where it is the whole frame."
        )
    full = rows or shown
    row_hz = led.rate_hz / zoom  # rows of the picture, as if each were opened by itself
    expected = None if near_s is None else near_s * row_hz / full
    try:
        profiles, fit, fainter = _find(pictures.profiles, expected)
    except PsvideoError as fault:
        raise PsvideoError(f"{pictures.name}: {fault}") from None
    to_s = full / row_hz
    stripes_error, warnings = _over_halves(profiles, fit)
    warnings += _about_fainter(fainter, to_s)
    readout_s = to_s * fit.frequency
    clock_error_s = readout_s * led.tolerance_ppm * 1e-6 / np.sqrt(3)
    _refuse_impossible(pictures, readout_s, fps)
    direction, reason = find_direction(
        fit.fundamental, pictures.places, fps=fps, led_hz=led.rate_hz, tolerance_ppm=led.tolerance_ppm
    )
    return Readout(
        readout_s=readout_s,
        error_s=float(np.hypot(to_s * stripes_error, clock_error_s)),
        stripes_error_s=to_s * stripes_error,
        clock_error_s=float(clock_error_s),
        rows=full,
        rows_per_period=1 / fit.frequency,
        rows_per_period_error=stripes_error / fit.frequency**2,
        periods=pictures.height_px * fit.frequency,
        frames=len(profiles),
        spread_s=to_s * float(fit.frame_frequencies.std(ddof=1)) if len(profiles) > 1 else None,
        contrast=float(fit.swing.sum() / max(2 * pictures.profiles.mean() * fit.swing.size, 1e-12)),
        direction=direction,
        direction_reason=reason,
        warnings=warnings,
    )


def _find(profiles: Doubles, expected: float | None) -> tuple[Doubles, StripeFit, float | None]:
    """Return the profiles (frame, block, row) in which stripes were found, their fit, and fainter ones' frequency.

    What stands still from frame to frame is the scene: where the stripes move, they are found in what is left without
    it. Where they stand still too, or there are too few frames, in the frames as they are.
    """
    if len(profiles) >= FEWEST_MOVING:
        try:
            return _fit(profiles - profiles.mean(axis=0), expected)
        except PsvideoError:
            pass  # the stripes stand still, or there are none: the frames as they are decide
    return _fit(profiles, expected)


def _fit(profiles: Doubles, expected: float | None) -> tuple[Doubles, StripeFit, float | None]:
    reading = find_stripes(profiles, expected=expected)
    coloured = profiles[:, reading.channel]
    fit = fit_stripes(coloured, reading.frequency)
    check_stripes(fit, reading, profiles.shape[3])
    return coloured, fit, find_fainter(coloured.mean(axis=1, keepdims=True), reading.frequency)


def _over_halves(profiles: Doubles, fit: StripeFit) -> tuple[float, tuple[str, ...]]:
    """Return the frequency's error, enlarged where the picture's halves contradict each other, and the warning."""
    rows = profiles.shape[2]
    if rows * fit.frequency < 2 * PERIODS_PER_HALF:
        return fit.frequency_error, ()
    upper, lower = (fit_stripes(half, fit.frequency) for half in np.array_split(profiles, 2, axis=2))
    apart = abs(upper.frequency - lower.frequency)
    unsure = UNEVEN_ERRORS * np.hypot(upper.frequency_error, lower.frequency_error)
    if apart < max(unsure, UNEVEN_SHARE * fit.frequency):
        return fit.frequency_error, ()
    return max(fit.frequency_error, apart / 2), (
        f"one period takes {1 / upper.frequency:.3f} rows in the upper half of the picture and "
        f"{1 / lower.frequency:.3f} in the lower one, so the rows do not open evenly in this picture (lens correction, "
        "stabilisation or scaling moved them, or the LED's rate drifted); the error allows for that",
    )


def _about_fainter(frequency: float | None, to_s: float) -> tuple[str, ...]:
    if frequency is None:
        return ()
    return (
        f"fainter stripes lie over those that were measured, one period in {1 / frequency:.2f} rows: a second light "
        f"flickers, or the LED itself. If it is these that blink at the LED's rate, the readout is about "
        f"{to_s * frequency * 1e3:.1f} ms: film again with the LED alone",
    )


def _refuse_impossible(pictures: LedPictures, readout_s: float, fps: Fraction | None) -> None:
    """Refuse a readout that takes longer than the frame."""
    if fps is not None and readout_s * float(fps) > 1.01:
        raise PsvideoError(
            f"{pictures.name}: its stripes mean a readout of {readout_s * 1e3:.3f} ms, longer than the "
            f"{1e3 / float(fps):.3f} ms of a frame. Either the LED blinks faster than `led_hz` says, or the frame rate "
            "(`fps`), `rows` or `zoom` is another."
        )
