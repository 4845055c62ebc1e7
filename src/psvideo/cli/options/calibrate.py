"""The options of psvideo calibrate that several of its commands share, each written once."""

from pathlib import Path
from typing import Annotated

import typer

Pictures = Annotated[Path, typer.Argument(help="A folder of stills (one per light), of plates, or a clip.")]
RigOut = Annotated[Path, typer.Option("-o", "--out", help="The rig file to write.")]
RigIn = Annotated[Path, typer.Option("--rig", help="The rig whose directions or positions are known.")]
FocalPx = Annotated[float | None, typer.Option(help="Focal length in pixels.", min=1)]
Transfer = Annotated[str | None, typer.Option(help="How stills code light: linear, srgb, slog3, ...")]
