"""psvideo calibrate: measure cameras and lights before a shoot."""

from __future__ import annotations

import dataclasses
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.convert import convert
from psvideo.cli.lights import flat_field, guess, intensities, matte_sphere
from psvideo.cli.mirror_sphere import mirror_sphere
from psvideo.cli.options import Frames, Json, PlanPath, Quiet, Verbose
from psvideo.errors import PsvideoError, UsageError

if TYPE_CHECKING:
    from psvideo.calibrate.stripes.readout import Led, Readout
    from psvideo.calibrate.stripes.records import MeasuredMode
    from psvideo.calibrate.strobed_readout import StrobedReadout

CRYSTAL_PPM = 100.0
calibrate = typer.Typer(help="Measure cameras and lights before a shoot.", no_args_is_help=True)


calibrate.command("mirror-sphere")(mirror_sphere)
calibrate.command("matte-sphere")(matte_sphere)
calibrate.command("flat-field")(flat_field)
calibrate.command("intensities")(intensities)
calibrate.command("guess")(guess)
calibrate.command("convert")(convert)


@calibrate.callback()
def _calibrate() -> None:
    """Measure cameras and lights before a shoot."""


@calibrate.command()
def readout(
    pictures: Annotated[
        list[Path],
        typer.Argument(help="A movie, a folder of numbered frames, or image files; or one strobed clip."),
    ],
    led_hz: Annotated[
        float | None,
        typer.Option(help="How often the LED blinks a second; left out: a strobed clip with its plan.", min=0.1),
    ] = None,
    led_tolerance_ppm: Annotated[
        float | None,
        typer.Option(
            help="Tolerance of the LED's or the strobe's clock in ppm: a crystal 100, a ceramic resonator 5000. "
            "Left out: 100, or the plan's where the pictures are a strobed clip.",
            min=0,
        ),
    ] = None,
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
    plan: PlanPath = None,
    make: Annotated[str, typer.Option(help="The camera's maker, for the table's line.")] = "MAKE",
    model: Annotated[str, typer.Option(help="The camera's model, for the table's line.")] = "MODEL",
    mode: Annotated[str, typer.Option(help="The camera's mode ('4K UHD 60p'), for the table's line.")] = "MODE",
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure a camera's readout time from the stripes of an LED of known rate, or from a strobed clip."""
    from psvideo.calibrate.stripes.led_pictures import exact_rate, parse_columns, read_led_pictures
    from psvideo.calibrate.stripes.readout import Led, measure_readout
    from psvideo.calibrate.stripes.records import MeasuredMode, camera_line, record_line
    from psvideo.cli.typed import parse_positive_seconds, parse_rate

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    made = MeasuredMode(make=make, model=model, mode=mode)
    if led_hz is None:
        _refuse_led_options(rows=rows, zoom=zoom, columns=columns, near=near, fps=fps)
        _strobed(pictures, made, tolerance_ppm=led_tolerance_ppm, frames=frames, plan=plan, voice=voice)
        return
    if plan is not None:
        raise UsageError("--plan: belongs to a strobed clip, which is measured without --led-hz. Leave one out.")
    led = Led(rate_hz=led_hz, tolerance_ppm=CRYSTAL_PPM if led_tolerance_ppm is None else led_tolerance_ppm)
    near_s = None if near is None else parse_positive_seconds(near, option="--near")
    given = None if fps is None else parse_rate(fps)
    span = None if columns is None else parse_columns(columns)
    found = read_led_pictures(pictures, columns=span, frames=frames)
    rate = given or (exact_rate(found.rate_hz) if found.rate_hz else None)
    measured = measure_readout(found, led, rows=rows, zoom=zoom, near_s=near_s, fps=rate)
    is_whole = measured.rows == found.height_px
    camera = dataclasses.replace(made, width_px=found.width_px if is_whole else None, fps=rate)
    lines = {
        "camera_line": camera_line(measured, camera, led),
        "record_line": record_line(measured, camera, led, date=date.today().isoformat()),
    }
    _print_readout(voice, measured, describe_readout(measured, led), lines)


def _refuse_led_options(**options: object) -> None:
    """Raise UsageError where options were given that only an LED's stripes have."""
    given = [name for name, value in options.items() if value is not None and (name, value) != ("zoom", 1.0)]
    if given:
        raise UsageError(
            f"--{given[0]}: belongs to the stripes of a blinking LED. Give its rate with --led-hz, or, where the "
            "pictures are a strobed clip with plan.toml, leave the option out."
        )


def _strobed(
    pictures: list[Path],
    made: MeasuredMode,
    *,
    tolerance_ppm: float | None,
    frames: str | None,
    plan: Path | None,
    voice: Voice,
) -> None:
    from psvideo.calibrate.stripes.records import strobed_camera_line, strobed_record_line
    from psvideo.calibrate.strobed_readout import measure_take_readout
    from psvideo.sync.open_take import open_take

    if len(pictures) > 1:
        raise UsageError(
            f"{len(pictures)} files without --led-hz: for an LED's stripes give its rate with --led-hz, for a strobed "
            "clip name one clip, a folder of numbered frames with plan.toml or a movie."
        )
    try:
        take = open_take(pictures[0], plan=plan, frames=frames)
    except PsvideoError as fault:
        raise type(fault)(f"{fault} (Without --led-hz a strobed clip is expected.)") from None
    for warning in take.clip.warnings:
        voice.warn(warning)
    measured = measure_take_readout(take, tolerance_ppm=tolerance_ppm, watch=voice.track)
    camera = dataclasses.replace(made, width_px=take.plan.camera.width_px, fps=take.plan.camera.fps)
    lines = {
        "camera_line": strobed_camera_line(measured, camera),
        "record_line": strobed_record_line(measured, camera, date=date.today().isoformat()),
    }
    _print_readout(voice, measured, describe_strobed_readout(measured), lines)


def _print_readout(voice: Voice, measured: Readout | StrobedReadout, words: str, lines: dict[str, str]) -> None:
    for warning in measured.warnings:
        voice.warn(warning)
    voice.say(words)
    voice.say(f"\nFor the table of cameras (fill in what stands in capitals):\n{lines['camera_line']}")
    voice.say(f"For calibration/records/readout.csv:\n{lines['record_line']}")
    voice.result({**dataclasses.asdict(measured), **lines})


def describe_strobed_readout(found: StrobedReadout) -> str:
    """Return what a strobed clip showed and how certain it is, for people."""
    ms, ppm = 1e3, found.tolerance_ppm
    direction = {
        "top-down": "The top row is read first.",
        "bottom-up": "The bottom row is read first: the readout has a minus sign.",
        "unknown": "Which end is read first is not known: the readout is too short beside its error.",
    }[found.direction]
    return "\n".join(
        [
            f"readout {found.readout_s * ms:.4f} ms +- {found.error_s * ms:.4f} ms for {found.rows} rows "
            f"(standard error; {found.error_s / max(abs(found.readout_s), 1e-12):.3%})",
            f"  from the picture  +- {found.rows_error_s * ms:.5f} ms: {found.frame_share:.3%} +- "
            f"{100 * found.frame_share_error:.2g}% of the frame; {found.frames} frames, {found.flashes} flashes",
            f"  from the strobe   +- {found.clock_error_s * ms:.5f} ms: its clock, within {ppm:g} ppm, vouches for the "
            f"frame rate; it ran {found.clock_offset_ppm:+.1f} ppm beside the camera's",
            direction,
        ]
    )


def describe_readout(found: Readout, led: Led) -> str:
    """Return what was measured and how certain it is, for people."""
    ms = 1e3
    spread = "" if found.spread_s is None else f"; single frames scatter by {found.spread_s * ms:.4f} ms"
    direction = {"unknown": "Which end is read first is not known", "top-down": "The top row is read first"}.get(
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
