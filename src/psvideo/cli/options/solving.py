"""Options that say how normals are solved, each written once."""

from pathlib import Path
from typing import Annotated

import typer

from psvideo.model.choices import MOST_ITERATIONS, NEAR_ITERATIONS, Align, Solver

SolverOption = Annotated[
    Solver, typer.Option("--solver", help="auto: robust against highlights and shadows from five lights on.")
]
Fill = Annotated[
    bool,
    typer.Option(
        "--fill/--no-fill",
        help="Give what fewer than three lights reach a best estimate (valid is 0 there), or leave zeros.",
    ),
]
MaskPath = Annotated[
    Path | None,
    typer.Option(
        "--mask",
        help="A picture, white where to solve; or a folder or a numbered pattern (mask.####.png), one per result.",
    ),
]
FlatPath = Annotated[
    Path | None,
    typer.Option("--flat", help="How light falls off over the picture, from psvideo calibrate flat-field."),
]
NearIterations = Annotated[
    int | None,
    typer.Option(
        help="Near lights only: how often their distances are taken again from the depth of the normals found. "
        f"[default: {NEAR_ITERATIONS}; 0 with --depth]",
        min=0,
        max=MOST_ITERATIONS,
    ),
]
DepthPath = Annotated[
    Path | None,
    typer.Option(
        "--depth",
        help="Known depth: an EXR in metres along the optical axis or a 16-bit PNG in millimetres, or a folder "
        "with one per result. Near lights find the surface there, and depth its scale.",
    ),
]
DepthScale = Annotated[
    float | None,
    typer.Option("--depth-scale", help="Metres per unit of --depth. [default: 1 for floats, 0.001 for integers]"),
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
        help="Results per round, per flash (as many times more as there are lights), per camera frame, or a rate: 24, "
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
        help="The clocks.json of several cameras: all of them show the same instants of a rate under the same numbers.",
    ),
]
Denoise = Annotated[int, typer.Option(min=1, max=64, help="Average up to N results where nothing moves.")]
