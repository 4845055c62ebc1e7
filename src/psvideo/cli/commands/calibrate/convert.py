"""psvideo calibrate convert: a rig in the kind of file that another program reads."""

from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import Force
from psvideo.cli.options.records import spread
from psvideo.model.units import counted


@spread
def convert(
    rig: Annotated[Path, typer.Argument(help="A rig: rig.toml, .lp, or a DiLiGenT or UW list.")],
    out: Annotated[
        Path,
        typer.Option(
            "-o", "--out", help="The file to write; its name sets the kind: *.toml, *.lp or light_directions.txt."
        ),
    ],
    *,
    name: Annotated[
        list[str] | None,
        typer.Option("--name", help="The lights' names, in order, where the list has none; one each."),
    ] = None,
    force: Force = False,
    voice: Voice,
) -> None:
    """Write a rig as rig.toml, as an .lp file (RTI), or as DiLiGenT's two lists of directions and intensities."""
    from psvideo.runs.calibrate.convert import convert as convert_rig

    made = convert_rig(rig, out=out, name=name or (), force=force, caller=voice.caller())
    names = made.rig.names
    voice.say(f"{out}: {counted(len(names), 'light')} written ({', '.join(names)}).")
    voice.result({"files": [str(file) for file in made.files], "lights": list(names)})
