"""Options that several commands share, each written once, and those that always come together as records."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.options.completing import offer_lights

ClipPath = Annotated[Path, typer.Argument(help="A clip: a folder of numbered frames with plan.toml, or a movie file.")]
ClipPaths = Annotated[
    list[Path],
    typer.Argument(help="A clip: a folder of numbered frames with plan.toml, or a movie file. Or several."),
]
PlanPath = Annotated[Path | None, typer.Option("--plan", help="The plan, where it does not lie beside the footage.")]
Frames = Annotated[str | None, typer.Option("--frames", help="File numbers to use, such as 1-100 or 1-100x2.")]
FirstLight = Annotated[
    str | None,
    typer.Option(
        "--first-light",
        help="The light of the clip's first complete flash, for plans without a marker.",
        autocompletion=offer_lights,
    ),
]
RigPath = Annotated[
    Path | None,
    typer.Option(
        "--rig",
        help="Where the lights are: rig.toml, .lp, DiLiGenT or UW list; or a folder of rigs, named after the takes; "
        "left out: rig.toml beside the footage.",
    ),
]
OrderRig = Annotated[
    Path | None,
    typer.Option("--rig", help="Where the lights are: shows which light is which where the plan has no marker."),
]
TimingPath = Annotated[
    Path | None, typer.Option("--timing", help="timing.json of this clip; left out: found from the picture.")
]
StartNumber = Annotated[int, typer.Option("--start-number", min=0, help="The number of the first round's files.")]
Force = Annotated[bool, typer.Option("--force", help="Replace outputs that exist.")]
Resume = Annotated[bool, typer.Option("--resume", help="Continue a run that was stopped, where it stopped.")]
PieceOption = Annotated[
    str | None,
    typer.Option("--piece", help="Solve one piece of the run: 3/10; first 0/10, what all share; at the end --resume."),
]
Workers = Annotated[
    int | None, typer.Option("--workers", min=1, help="Use this many processes on this machine (a dask cluster).")
]
Scheduler = Annotated[
    str | None, typer.Option("--scheduler", help="Use the workers of a dask scheduler: tcp://HOST:8786.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON, for machines.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Say more.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Say nothing but errors.")]


@dataclass(frozen=True, kw_only=True)
class ClipWords:
    """What a clip is read with, as typed."""

    plan: PlanPath = None
    frames: Frames = None
    first_light: FirstLight = None


@dataclass(frozen=True, kw_only=True)
class Sharing:
    """Which processes share several takes."""

    workers: Workers = None
    scheduler: Scheduler = None

    @property
    def asked(self) -> bool:
        """Whether takes are to be shared out, even one alone."""
        return self.workers is not None or self.scheduler is not None
