"""psvideo calibrate convert: a rig in the kind of file that another program reads."""

from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice, counted
from psvideo.cli.options.common import Force, Json, Quiet, Verbose


def convert(
    rig: Annotated[Path, typer.Argument(help="A rig: rig.toml, .lp, or a DiLiGenT or UW list.")],
    out: Annotated[
        Path,
        typer.Option(
            "-o", "--out", help="The file to write; its name sets the kind: *.toml, *.lp or light_directions.txt."
        ),
    ],
    name: Annotated[
        list[str] | None,
        typer.Option("--name", help="For a list without names: the lights' names in order, one each."),
    ] = None,
    force: Force = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Write a rig as rig.toml, as an .lp file (RTI), or as DiLiGenT's two lists of directions and intensities."""
    from psvideo.formats.light_lists import files_of, write_rig
    from psvideo.formats.rig_toml import read_rig
    from psvideo.formats.whole_files import refuse_existing

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    for file in files_of(out):
        refuse_existing(file, force=force)
    found = read_rig(rig, plan_lights=tuple(name or ()))
    for sentence in write_rig(out, found):
        voice.warn(sentence)
    voice.say(f"{out}: {counted(len(found.lights), 'light')} written ({', '.join(found.names)}).")
    voice.result({"files": [str(file) for file in files_of(out)], "lights": list(found.names)})
