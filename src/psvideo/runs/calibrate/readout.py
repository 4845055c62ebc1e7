"""The whole of ``psvideo calibrate readout``: from an LED's stripes, or from a strobed clip."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from fractions import Fraction
from pathlib import Path

from psvideo.calibrate.stripes.led_pictures import exact_rate, read_led_pictures
from psvideo.calibrate.stripes.readout import Led, Readout, measure_readout
from psvideo.calibrate.stripes.records import (
    MeasuredMode,
    camera_line,
    record_line,
    strobed_camera_line,
    strobed_record_line,
)
from psvideo.calibrate.strobed_readout import StrobedReadout, measure_take_readout
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError, UsageError, check_within
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.sync.open_take import open_take

CRYSTAL_PPM = 100.0
MEANT = {
    "led_hz": (0.1, 1e7, "Hz"),
    "led_tolerance_ppm": (0, 1e6, "ppm"),
    "rows": (2, 1e5, "rows"),
    "zoom": (0.01, 100, ""),
    "near_s": (1e-7, 10, "seconds"),
}
"""The least and the most of each number that can be meant: no row of a sensor opens in less than 0.1 microseconds."""


@dataclass(frozen=True, kw_only=True)
class MeasuredReadout:
    """A camera's readout, as measured, and its lines for the table of cameras and for the record of measurements.

    ``led`` is the LED whose stripes showed it, None where a strobed clip did.
    """

    measured: Readout | StrobedReadout
    camera_line: str
    record_line: str
    led: Led | None = None


def readout(
    pictures: Sequence[Path | str],
    *,
    led_hz: float | None = None,
    led_tolerance_ppm: float | None = None,
    rows: int | None = None,
    zoom: float = 1.0,
    columns: tuple[int, int] | None = None,
    near_s: float | None = None,
    fps: Fraction | None = None,
    frames: str | None = None,
    plan: Path | str | None = None,
    make: str = "MAKE",
    model: str = "MODEL",
    mode: str = "MODE",
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> MeasuredReadout:
    """Measure a camera's readout time from the stripes of an LED of known rate, or from a strobed clip.

    - ``pictures``: a movie, a folder of numbered frames, or image files; or one strobed clip. ``frames``: file numbers
      to use, such as ``"1-100"``.
    - ``led_hz``: how often the LED blinks a second; left out: a strobed clip with its plan (``plan``, where it does not
      lie beside the footage). ``led_tolerance_ppm``: tolerance of the LED's or the strobe's clock (left out: 100, or
      the plan's).
    - Of stripes only: ``rows`` of the whole frame, where pictures are cropped; ``zoom``: rows of the picture that show
      one row of the sensor; ``columns``: the first and one past the last that count; ``near_s``: roughly which readout
      is expected, in seconds; ``fps``: the frame rate (left out: the movie's own).
    - ``make``, ``model``, ``mode``: the camera, for the table's line.

    Raises UsageError where parameters do not fit together, and PsvideoError where nothing can be measured.
    """
    _check_numbers(led_hz=led_hz, led_tolerance_ppm=led_tolerance_ppm, rows=rows, zoom=zoom, near_s=near_s)
    made = MeasuredMode(make=make, model=model, mode=mode)
    paths = [Path(path) for path in pictures]
    if led_hz is None:
        _refuse_of_stripes(rows=rows, zoom=zoom, columns=columns, near_s=near_s, fps=fps)
        plan_path = None if plan is None else Path(plan)
        return _strobed(paths, made, led_tolerance_ppm, frames, plan_path, watch, caller)
    if plan is not None:
        raise UsageError("`plan`: belongs to a strobed clip, which is measured without `led_hz`. Leave one out.")
    led = Led(rate_hz=led_hz, tolerance_ppm=CRYSTAL_PPM if led_tolerance_ppm is None else led_tolerance_ppm)
    found = read_led_pictures(paths, columns=columns, frames=frames)
    rate = fps or (exact_rate(found.rate_hz) if found.rate_hz else None)
    measured = measure_readout(found, led, rows=rows, zoom=zoom, near_s=near_s, fps=rate)
    is_whole = measured.rows == found.height_px
    camera = dataclasses.replace(made, width_px=found.width_px if is_whole else None, fps=rate)
    for warning in measured.warnings:
        caller.warn(warning)
    return MeasuredReadout(
        measured=measured,
        led=led,
        camera_line=camera_line(measured, camera, led),
        record_line=record_line(measured, camera, led, date=date.today().isoformat()),
    )


def _check_numbers(**given: float | None) -> None:
    """Raise UsageError where a number cannot be meant."""
    for name, number in given.items():
        if number is not None:
            least, most, unit = MEANT[name]
            check_within(name, number, least, most, unit=unit)


def _refuse_of_stripes(**given: object) -> None:
    """Raise UsageError where something was given that only an LED's stripes have."""
    named = [name for name, value in given.items() if value is not None and (name, value) != ("zoom", 1.0)]
    if named:
        raise UsageError(
            f"`{named[0]}`: belongs to the stripes of a blinking LED. Give its rate with `led_hz`, or, where the "
            "pictures are a strobed clip with plan.toml, leave it out."
        )


def _strobed(
    pictures: Sequence[Path],
    made: MeasuredMode,
    tolerance_ppm: float | None,
    frames: str | None,
    plan: Path | None,
    watch: Watch,
    caller: Caller,
) -> MeasuredReadout:
    if len(pictures) > 1:
        raise UsageError(
            f"{len(pictures)} files without `led_hz`: for an LED's stripes give its rate with `led_hz`, for a strobed "
            "clip name one clip, a folder of numbered frames with plan.toml or a movie."
        )
    try:
        take = open_take(pictures[0], plan=plan, frames=frames)
    except PsvideoError as fault:
        raise type(fault)(f"{fault} (Without `led_hz` a strobed clip is expected.)") from None
    for warning in take.clip.warnings:
        caller.warn(warning)
    measured = measure_take_readout(take, tolerance_ppm=tolerance_ppm, watch=watch)
    camera = dataclasses.replace(made, width_px=take.plan.camera.width_px, fps=take.plan.camera.fps)
    for warning in measured.warnings:
        caller.warn(warning)
    return MeasuredReadout(
        measured=measured,
        camera_line=strobed_camera_line(measured, camera),
        record_line=strobed_record_line(measured, camera, date=date.today().isoformat()),
    )
