"""The options of ``psvideo capture-plan``, in the groups in which its help shows them."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from psvideo.cli.options.completing import offer_cameras, offer_transfers

CAMERA, LIGHTS, LIMITS = "Camera", "Lights", "What limits the flash"
STROBE, ENCODING = "Strobe", "How the files encode light"


def _option(panel: str, text: str, *, offer: Callable[..., list[str]] | None = None) -> Any:
    return typer.Option(help=text, rich_help_panel=panel, autocompletion=offer)


@dataclass(frozen=True, kw_only=True)
class ShootWords:
    """What to shoot, as typed; None is what was left out."""

    camera: Annotated[
        str | None, _option(CAMERA, "A camera of the table (--list-cameras): 'Sony F65'.", offer=offer_cameras)
    ] = None
    fps: Annotated[str | None, _option(CAMERA, "Frame rate: 120, 119.88 or 120000/1001.")] = None
    size: Annotated[str | None, _option(CAMERA, "Width x height in pixels: 1920x1080.")] = None
    shutter: Annotated[float | None, _option(CAMERA, "Shutter angle in degrees; left out: 360.")] = None
    exposure: Annotated[str | None, _option(CAMERA, "Exposure time instead of --shutter: 8.3ms or 1/120s.")] = None
    readout: Annotated[
        str | None, _option(CAMERA, "Time to read a frame: 8.1ms, global, unknown; -8.1ms: upwards.")
    ] = None
    camera_clock_ppm: Annotated[float, _option(CAMERA, "Tolerance of the camera's clock in ppm.")] = 50.0
    lights: Annotated[str, _option(LIGHTS, "The lights' names, in the order in which they flash.")] = "key,left,right"
    power: Annotated[str, _option(LIGHTS, "Power, above 0 and up to 1: 0.5, or key=1,left=0.5,right=0.5.")] = "1"
    flash: Annotated[str | None, _option(LIGHTS, "Flash duration: 0.8ms, or key=0.8ms,left=0.4ms,right=0.4ms.")] = None
    max_blur: Annotated[float | None, _option(LIMITS, "Largest blur in pixels; needs --speed.")] = None
    speed: Annotated[str | None, _option(LIMITS, "How fast the subject moves: 800 (px/s) or 0.5m/s.")] = None
    field_width: Annotated[str | None, _option(LIMITS, "Width of what the camera sees, for m/s: 0.6m.")] = None
    max_duty: Annotated[str | None, _option(LIMITS, "Largest share of the time that an LED may be on: 0.1 or 10%.")] = (
        None
    )
    max_pulse: Annotated[str | None, _option(LIMITS, "Longest pulse that the LEDs can take: 1ms.")] = None
    max_stops: Annotated[
        float | None, _option(LIMITS, "Largest loss of light, in stops, against the same light left on.")
    ] = None
    mode: Annotated[str, _option(STROBE, "rolling, half-rate or synced.")] = "rolling"
    marker: Annotated[
        str | None,
        _option(
            STROBE, "How the footage shows which light is which: dark (slots), coded (for several cameras), long, none."
        ),
    ] = None
    dark_slot: Annotated[str | None, _option(STROBE, "The dark slot's duration; default: the shortest flash's.")] = None
    dark_every: Annotated[
        int | None, _option(STROBE, "A dark slot in every Nth round; default: two a second, or what a board holds.")
    ] = None
    dark: Annotated[str | None, _option(STROBE, "Dark time between flashes; default: exposure and margin.")] = None
    strobe_clock_ppm: Annotated[str, _option(STROBE, "Tolerance of the strobe's clock in ppm, or unknown.")] = "50"
    transfer: Annotated[
        str, _option(ENCODING, "Transfer curve of the files: linear, slog3, logc3, srgb.", offer=offer_transfers)
    ] = "linear"
    black: Annotated[float | None, _option(ENCODING, "Code value of black.")] = None
    white: Annotated[float | None, _option(ENCODING, "Code value of saturation.")] = None
    cfa: Annotated[str | None, _option(ENCODING, "Colour filters of mosaiced files: RGGB, BGGR, GRBG or GBRG.")] = None


LightsRig = Annotated[
    Path | None, _option(LIGHTS, "Rig file of where the lights will stand; warns if they cannot give normals.")
]
PlanOut = Annotated[Path | None, typer.Option("-o", "--out", help="The plan to write; left out: standard output.")]
Diagram = Annotated[str | None, typer.Option("--diagram", help="Timing diagram: FILE.svg, FILE.png, or - for text.")]
ListCameras = Annotated[bool, typer.Option("--list-cameras", help="Print the table of cameras, and stop.")]
