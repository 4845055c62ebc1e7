"""Options that say how normals are solved and which instants are shown, each written once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from psvideo.cli.options.typed import parse_instants
from psvideo.model.choices import MOST_ITERATIONS, NEAR_ITERATIONS, Align, Solver

SolverOption = Annotated[
    Solver, typer.Option("--solver", help="auto: robust against highlights and shadows from five lights on.")
]
Fill = Annotated[
    bool,
    typer.Option(
        "--fill/--no-fill",
        help="Estimate normals where fewer than three lights reach (valid is 0 there), or leave zeros.",
    ),
]
MaskPath = Annotated[
    Path | None,
    typer.Option(
        "--mask",
        help="A picture, white where to solve (or cut out in its alpha); or a folder or a numbered pattern "
        "(mask.####.png), one per result.",
    ),
]
FlatPath = Annotated[
    Path | None,
    typer.Option("--flat", help="Fall-off of light over the picture: the file of psvideo calibrate flat-field --flat."),
]
NearIterations = Annotated[
    int | None,
    typer.Option(
        help="Near lights only: how often their distances are corrected by the depth that the normals give; "
        f"left out: {NEAR_ITERATIONS}, and 0 with --depth.",
        min=0,
        max=MOST_ITERATIONS,
    ),
]
DepthPath = Annotated[
    Path | None,
    typer.Option(
        "--depth",
        help="Known depth: an EXR in metres along the optical axis or a 16-bit PNG in millimetres, or a folder "
        "with one per result. It places the surface for near lights, and sets the scale of depth.",
    ),
]
DepthScale = Annotated[
    float | None,
    typer.Option("--depth-scale", help="Metres per unit of --depth; left out: 1 for floats, 0.001 for integers."),
]
AlignOption = Annotated[
    Align,
    typer.Option(
        "--align",
        help="Bring the plates of a round, which show different instants, to one. auto: where something moves; "
        "flow: look for motion everywhere; none: leave them as they are.",
    ),
]
FpsOption = Annotated[
    str,
    typer.Option(
        "--fps",
        help="One result per round, per flash (N times as many with N lights), per camera frame, or at a rate: 24, "
        "23.976, 24000/1001.",
        metavar="round|flash|frame|RATE",
    ),
]
ShutterOption = Annotated[
    float | None,
    typer.Option("--shutter", help="Motion blur of this shutter angle in beauty and plates, at a rate: 180."),
]
ResyncOption = Annotated[
    Path | None,
    typer.Option(
        "--resync",
        help="clocks.json of several cameras: at a rate, the same number is then the same instant in all of them.",
    ),
]
Denoise = Annotated[int, typer.Option(min=1, max=64, help="Average up to N results where nothing moves.")]


@dataclass(frozen=True, kw_only=True)
class SolvingWords:
    """How normals are solved, as typed."""

    mask: MaskPath = None
    flat: FlatPath = None
    solver: SolverOption = "auto"
    fill: Fill = True
    near_iterations: NearIterations = None
    depth: DepthPath = None
    depth_scale: DepthScale = None


@dataclass(frozen=True, kw_only=True)
class InstantWords:
    """Which instants are shown, as typed."""

    fps: FpsOption = "round"
    shutter: ShutterOption = None
    resync: ResyncOption = None

    def parameters(self) -> dict[str, Any]:
        """Return them as the library takes them."""
        return vars(self) | {"fps": parse_instants(self.fps)}
