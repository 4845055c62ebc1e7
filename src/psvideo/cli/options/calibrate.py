"""The options of psvideo calibrate that several commands share (stills, too, measures lights), each written once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from psvideo.cli.options.typed import parse_circle, parse_radius_mm

Pictures = Annotated[Path, typer.Argument(help="A folder of stills (one per light), of plates, or a clip.")]
PicturesOfTakes = Annotated[
    list[Path],
    typer.Argument(help="A folder of stills (one per light), of plates, or a clip. Or several, with a folder as -o."),
]
RigOut = Annotated[Path, typer.Option("-o", "--out", help="The rig file to write.")]
RigIn = Annotated[Path, typer.Option("--rig", help="The rig whose directions or positions are known.")]
FocalPx = Annotated[float | None, typer.Option(help="Focal length in pixels.", min=1)]
TargetAlbedo = Annotated[
    float, typer.Option("--albedo", help="The target's albedo: white paper 0.85, a white card 0.9.")
]
TargetBox = Annotated[
    str | None, typer.Option(help="The target's part of the picture: left,top,right,bottom in pixels.")
]
Transfer = Annotated[str | None, typer.Option(help="Transfer curve of the stills: linear, srgb, slog3, ...")]
FocalMm = Annotated[float | None, typer.Option(help="Focal length in mm; needs --sensor-mm.", min=0.1)]
SensorMm = Annotated[
    float | None, typer.Option(help="Width in mm of the sensor's part that the picture shows.", min=0.1)
]
RadiusMm = Annotated[
    str | None,
    typer.Option(
        metavar="LENGTH",
        help="The spheres' radius in mm, or with its unit (4cm, 1.5in): with two or more, near lights get positions.",
    ),
]
Circles = Annotated[
    list[str] | None,
    typer.Option(
        "--circle", help="A sphere's outline found by hand: x,y,radius in pixels from the top left. Repeatable."
    ),
]
Spheres = Annotated[int, typer.Option(help="How many spheres each picture shows.", min=1, max=8)]


@dataclass(frozen=True, kw_only=True)
class SphereWords:
    """How mirror spheres and the lens that saw them are described, as typed."""

    circle: Circles = None
    spheres: Spheres = 1
    focal_px: FocalPx = None
    focal_mm: FocalMm = None
    sensor_mm: SensorMm = None
    radius_mm: RadiusMm = None

    def parameters(self) -> dict[str, Any]:
        """Return them as the library takes them."""
        circles = [parse_circle(text) for text in self.circle or ()]
        radius_mm = None if self.radius_mm is None else parse_radius_mm(self.radius_mm)
        return vars(self) | {"circle": circles, "radius_mm": radius_mm}
