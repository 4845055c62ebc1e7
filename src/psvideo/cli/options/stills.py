"""The options of psvideo stills, as records of what belongs together."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from psvideo.cli.console import plain
from psvideo.cli.options.calibrate import Transfer
from psvideo.cli.options.delivery import AovOption, EncodeOption, MeshOption, Plates, ProgramOption


@dataclass(frozen=True, kw_only=True)
class LightsWords:
    """What shows where the lights are, as typed."""

    lights: Annotated[
        Path | None,
        typer.Option(help="Where the lights are: rig.toml, .lp, a DiLiGenT or UW list, or a table with names."),
    ] = None
    sphere: Annotated[
        list[Path] | None,
        typer.Option(
            help="Instead of --lights: a chrome ball under the same lights, as a folder, a pattern ('ball/*.jpg') or "
            "picture by picture; again for a ball at another place."
        ),
    ] = None

    def parameters(self) -> dict[str, Any]:
        """Return them as the library takes them."""
        return {"lights": self.lights, "sphere": self.sphere or ()}


@dataclass(frozen=True, kw_only=True)
class PhotographWords:
    """What photographs are read with, as typed."""

    dark: Annotated[
        Path | None, typer.Option(help="A picture with every light off; left out: one named dark or ambient.")
    ] = None
    mask: Annotated[
        Path | None, typer.Option("--mask", help="A picture, white where to solve; left out: one named mask.")
    ] = None
    transfer: Transfer = None
    white_level: Annotated[
        float | None,
        typer.Option(
            help="The code at which the pictures saturate: 4095 of 12 bits in files of 16; left out: the largest one."
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class StillDeliveryWords:
    """What is written of photographs, as typed: there is less to choose than of a clip."""

    preset: ProgramOption = None
    aov: AovOption = None
    mesh: MeshOption = None
    encode: EncodeOption = None
    plates: Plates = False
    rti: Annotated[
        bool,
        typer.Option(
            "--rti/--no-rti", help="Write rti/ too: relighting for web pages (OpenLIME), and a .ptm for RTIViewer."
        ),
    ] = True

    def parameters(self) -> dict[str, Any]:
        """Return them as the library takes them."""
        return vars(self) | {"aov": plain(self.aov), "mesh": plain(self.mesh)}
