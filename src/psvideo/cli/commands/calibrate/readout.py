"""psvideo calibrate readout: how long a camera takes to read a frame."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import Frames, PlanPath
from psvideo.cli.options.panels import CLIP
from psvideo.cli.options.records import spread
from psvideo.model.units import counted

if TYPE_CHECKING:
    from psvideo.calibrate.stripes.readout import Led, Readout
    from psvideo.calibrate.strobed_readout import StrobedReadout
    from psvideo.runs.calibrate.readout import MeasuredReadout


@dataclasses.dataclass(frozen=True, kw_only=True)
class StripeWords:
    """How the stripes of an LED are read, as typed."""

    rows: Annotated[
        int | None, typer.Option(help="Rows of the whole frame, where the pictures are cropped.", min=2)
    ] = None
    zoom: Annotated[
        float, typer.Option(help="Rows of the picture that show one row of the sensor.", min=0.01, max=100)
    ] = 1.0
    columns: Annotated[
        str | None, typer.Option(help="Use only these columns, from the first to one past the last: 0-80.")
    ] = None
    near: Annotated[
        str | None, typer.Option(help="Roughly the readout time (16ms), where stripes can be read in two ways.")
    ] = None
    fps: Annotated[
        str | None,
        typer.Option(
            help="Frame rate at which it was filmed: 120, 119.88; left out: the movie's own.", rich_help_panel=CLIP
        ),
    ] = None

    def parameters(self) -> dict[str, Any]:
        """Return them as the library takes them."""
        from psvideo.cli.options.typed import parse_columns, parse_positive_seconds, parse_rate

        return {
            "rows": self.rows,
            "zoom": self.zoom,
            "columns": None if self.columns is None else parse_columns(self.columns),
            "near_s": None if self.near is None else parse_positive_seconds(self.near, option="--near"),
            "fps": None if self.fps is None else parse_rate(self.fps),
        }


@dataclasses.dataclass(frozen=True, kw_only=True)
class CameraLineWords:
    """What the table of cameras calls the camera, as typed."""

    make: Annotated[str, typer.Option(help="The camera's maker, for the table's line.")] = "MAKE"
    model: Annotated[str, typer.Option(help="The camera's model, for the table's line.")] = "MODEL"
    mode: Annotated[str, typer.Option(help="The camera's mode ('4K UHD 60p'), for the table's line.")] = "MODE"


@spread
def readout(
    pictures: Annotated[
        list[Path],
        typer.Argument(help="A movie, a folder of numbered frames, or image files; or one strobed clip."),
    ],
    *,
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
    stripes: StripeWords,
    frames: Frames = None,
    plan: PlanPath = None,
    camera: CameraLineWords,
    voice: Voice,
) -> None:
    """Measure a camera's readout time from the stripes of an LED of known rate, or from a strobed clip."""
    from psvideo.runs.calibrate.readout import readout as measure

    found = measure(
        pictures,
        led_hz=led_hz,
        led_tolerance_ppm=led_tolerance_ppm,
        **stripes.parameters(),
        frames=frames,
        plan=plan,
        **vars(camera),
        watch=voice.track,
        caller=voice.caller(),
    )
    voice.say(describe(found))
    voice.say(f"\nFor the table of cameras (fill in what stands in capitals):\n{found.camera_line}")
    voice.say(f"For calibration/records/readout.csv:\n{found.record_line}")
    lines = {"camera_line": found.camera_line, "record_line": found.record_line}
    voice.result({**dataclasses.asdict(found.measured), **lines})


def describe(found: MeasuredReadout) -> str:
    """Return what was measured and how certain it is, for people."""
    from psvideo.calibrate.strobed_readout import StrobedReadout

    measured = found.measured
    if isinstance(measured, StrobedReadout):
        return describe_strobed_readout(measured)
    return describe_readout(measured, found.led) if found.led is not None else ""


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
            f"{found.rows_per_period_error:.4f} rows of the picture, {found.periods:.1f} periods, "
            f"{counted(found.frames, 'frame')}, contrast {found.contrast:.0%}{spread}",
            f"  from the LED      +- {found.clock_error_s * ms:.4f} ms: {led.rate_hz:g} Hz within "
            f"{led.tolerance_ppm:g} ppm",
            f"{direction} ({found.direction_reason}).",
        ]
    )
