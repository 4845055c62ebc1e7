"""The options of ``psvideo capture-plan``, in the groups in which its help shows them."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from psvideo.cli.options.completing import offer_cameras, offer_transfers

CAMERA, LIGHTS, LIMITS = "Camera", "Lights", "What limits the flash"
STROBE, ENCODING = "Strobe", "How the files encode light"


def _option(panel: str, name: str, text: str, *, offer: Callable[..., list[str]] | None = None) -> Any:
    return typer.Option(name, help=text, rich_help_panel=panel, autocompletion=offer)


CameraName = Annotated[
    str | None,
    _option(CAMERA, "--camera", "A camera of the table (--list-cameras): 'Sony F65'.", offer=offer_cameras),
]
Fps = Annotated[str | None, _option(CAMERA, "--fps", "Frame rate: 120, 119.88 or 120000/1001.")]
Size = Annotated[str | None, _option(CAMERA, "--size", "Width x height in pixels: 1920x1080.")]
Shutter = Annotated[float | None, _option(CAMERA, "--shutter", "Shutter angle in degrees; left out: 360.")]
Exposure = Annotated[str | None, _option(CAMERA, "--exposure", "Exposure time instead of --shutter: 8.3ms or 1/120s.")]
Readout = Annotated[
    str | None,
    _option(CAMERA, "--readout", "Time to read a frame: 8.1ms, global, unknown; -8.1ms: upwards."),
]
CameraClock = Annotated[float, _option(CAMERA, "--camera-clock-ppm", "Tolerance of the camera's clock in ppm.")]
Lights = Annotated[str, _option(LIGHTS, "--lights", "The lights' names, in the order in which they flash.")]
Power = Annotated[str, _option(LIGHTS, "--power", "Power, above 0 and up to 1: 0.5, or key=1,left=0.5,right=0.5.")]
Flash = Annotated[str | None, _option(LIGHTS, "--flash", "Flash duration: 0.8ms, or key=0.8ms,left=0.4ms,right=0.4ms.")]
LightsRig = Annotated[
    Path | None, _option(LIGHTS, "--rig", "Rig file of where the lights will stand; warns if they cannot give normals.")
]
MaxBlur = Annotated[float | None, _option(LIMITS, "--max-blur", "Largest blur in pixels; needs --speed.")]
Speed = Annotated[str | None, _option(LIMITS, "--speed", "How fast the subject moves: 800 (px/s) or 0.5m/s.")]
FieldWidth = Annotated[str | None, _option(LIMITS, "--field-width", "Width of what the camera sees, for m/s: 0.6m.")]
MaxDuty = Annotated[
    str | None, _option(LIMITS, "--max-duty", "Largest share of the time that an LED may be on: 0.1 or 10%.")
]
MaxPulse = Annotated[str | None, _option(LIMITS, "--max-pulse", "Longest pulse that the LEDs can take: 1ms.")]
MaxStops = Annotated[
    float | None, _option(LIMITS, "--max-stops", "Largest loss of light, in stops, against the same light left on.")
]
Mode = Annotated[str, _option(STROBE, "--mode", "rolling, half-rate or synced.")]
Marker = Annotated[
    str | None,
    _option(
        STROBE,
        "--marker",
        "How the footage shows which light is which: dark (slots), coded (for several cameras), long, none.",
    ),
]
DarkSlot = Annotated[
    str | None, _option(STROBE, "--dark-slot", "The dark slot's duration; default: the shortest flash's.")
]
DarkEvery = Annotated[
    int | None, _option(STROBE, "--dark-every", "A dark slot in every Nth round; default: two a second.")
]
Dark = Annotated[str | None, _option(STROBE, "--dark", "Dark time between flashes; default: exposure and margin.")]
StrobeClock = Annotated[
    str, _option(STROBE, "--strobe-clock-ppm", "Tolerance of the strobe's clock in ppm, or unknown.")
]
Transfer = Annotated[
    str,
    _option(ENCODING, "--transfer", "Transfer curve of the files: linear, slog3, logc3, srgb.", offer=offer_transfers),
]
Black = Annotated[float | None, _option(ENCODING, "--black", "Code value of black.")]
White = Annotated[float | None, _option(ENCODING, "--white", "Code value of saturation.")]
Cfa = Annotated[str | None, _option(ENCODING, "--cfa", "Colour filters of mosaiced files: RGGB, BGGR, GRBG or GBRG.")]
PlanOut = Annotated[Path | None, typer.Option("-o", "--out", help="The plan to write; left out: standard output.")]
Diagram = Annotated[str | None, typer.Option("--diagram", help="Timing diagram: FILE.svg, FILE.png, or - for text.")]
ListCameras = Annotated[bool, typer.Option("--list-cameras", help="Print the table of cameras, and stop.")]
