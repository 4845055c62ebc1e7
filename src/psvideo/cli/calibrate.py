"""psvideo calibrate: measure cameras and lights before a shoot."""

import dataclasses
from datetime import date
from pathlib import Path
from typing import Annotated

import typer

from psvideo.calibrate.led_pictures import exact_rate, parse_columns, read_led_pictures
from psvideo.calibrate.readout import Led, Readout, measure_readout
from psvideo.calibrate.readout_lines import MeasuredMode, camera_line, record_line
from psvideo.capture.quantities import parse_positive_seconds, parse_rate
from psvideo.cli.console import Voice
from psvideo.cli.options import Frames, Json, Quiet, Verbose

calibrate = typer.Typer(help="Measure cameras and lights before a shoot.", no_args_is_help=True)


@calibrate.callback()
def _calibrate() -> None:
    """Measure cameras and lights before a shoot."""


@calibrate.command()
def readout(
    pictures: Annotated[list[Path], typer.Argument(help="A movie, a folder of numbered frames, or image files.")],
    led_hz: Annotated[float, typer.Option(help="How often the LED blinks a second.", min=0.1)],
    led_tolerance_ppm: Annotated[
        float, typer.Option(help="Tolerance of the LED's clock: a crystal 100, a ceramic resonator 5000.", min=0)
    ] = 100.0,
    rows: Annotated[
        int | None, typer.Option(help="Rows of the whole frame, where the pictures are cropped.", min=2)
    ] = None,
    zoom: Annotated[
        float, typer.Option(help="Rows of the picture that show one row of the sensor.", min=0.01, max=100)
    ] = 1.0,
    columns: Annotated[
        str | None, typer.Option(help="Only these columns: the first and one past the last, as 0-80.")
    ] = None,
    near: Annotated[
        str | None, typer.Option(help="Roughly what is expected (16ms), where stripes can be read in two ways.")
    ] = None,
    fps: Annotated[
        str | None, typer.Option(help="Frame rate at which it was filmed: 120, 119.88; left out: the movie's own.")
    ] = None,
    frames: Frames = None,
    make: Annotated[str, typer.Option(help="The camera's maker, for the table's line.")] = "MAKE",
    model: Annotated[str, typer.Option(help="The camera's model, for the table's line.")] = "MODEL",
    mode: Annotated[str, typer.Option(help="The camera's mode ('4K UHD 60p'), for the table's line.")] = "MODE",
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure a camera's readout time from the stripes that an LED of known rate leaves in its pictures."""
    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    led = Led(rate_hz=led_hz, tolerance_ppm=led_tolerance_ppm)
    near_s = None if near is None else parse_positive_seconds(near, option="--near")
    given = None if fps is None else parse_rate(fps)
    span = None if columns is None else parse_columns(columns)
    found = read_led_pictures(pictures, columns=span, frames=frames)
    rate = given or (exact_rate(found.rate_hz) if found.rate_hz else None)
    measured = measure_readout(found, led, rows=rows, zoom=zoom, near_s=near_s, fps=rate)
    for warning in measured.warnings:
        voice.warn(warning)
    is_whole = measured.rows == found.height_px
    camera = MeasuredMode(make=make, model=model, mode=mode, width_px=found.width_px if is_whole else None, fps=rate)
    lines = {
        "camera_line": camera_line(measured, camera, led),
        "record_line": record_line(measured, camera, led, date=date.today().isoformat()),
    }
    voice.say(describe_readout(measured, led))
    voice.say(f"\nFor the table of cameras (fill in what stands in capitals):\n{lines['camera_line']}")
    voice.say(f"For calibration/records/readout.csv:\n{lines['record_line']}")
    voice.result({**dataclasses.asdict(measured), **lines})


def describe_readout(found: Readout, led: Led) -> str:
    """Return what was measured and how sure it is, for people."""
    ms = 1e3
    spread = "" if found.spread_s is None else f"; single frames scatter by {found.spread_s * ms:.4f} ms"
    direction = {"unknown": "Which end is read first cannot be told", "top-down": "The top row is read first"}.get(
        found.direction, "The bottom row is read first: write the readout with a minus sign"
    )
    return "\n".join(
        [
            f"readout {found.readout_s * ms:.4f} ms +- {found.error_s * ms:.4f} ms for {found.rows} rows "
            f"(standard error; {found.error_s / found.readout_s:.3%})",
            f"  from the stripes  +- {found.stripes_error_s * ms:.4f} ms: one period in {found.rows_per_period:.4f} +- "
            f"{found.rows_per_period_error:.4f} rows of the picture, {found.periods:.1f} periods, {found.frames} "
            f"frame(s), contrast {found.contrast:.0%}{spread}",
            f"  from the LED      +- {found.clock_error_s * ms:.4f} ms: {led.rate_hz:g} Hz within "
            f"{led.tolerance_ppm:g} ppm",
            f"{direction} ({found.direction_reason}).",
        ]
    )
