"""psvideo stills: normal maps and albedo from photographs, one per light, without a plan."""

from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice, plain, print_report
from psvideo.cli.options.calibrate import SphereWords, Transfer
from psvideo.cli.options.clip_and_run import Force
from psvideo.cli.options.delivery import AovOption, EncodeOption, MeshOption, Plates, ProgramOption
from psvideo.cli.options.records import spread
from psvideo.cli.options.solving import Fill, SolverOption


@spread
def stills(
    context: typer.Context,
    folder: Annotated[Path, typer.Argument(help="The folder of photographs, one per light, of any names.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder to write.")],
    *,
    lights: Annotated[
        Path | None,
        typer.Option(help="Where the lights are: rig.toml, .lp, a DiLiGenT or UW list, or a table with names."),
    ] = None,
    sphere: Annotated[
        list[Path] | None,
        typer.Option(
            help="Instead of --lights: a chrome ball under the same lights, as a folder, a pattern ('ball/*.jpg') or "
            "picture by picture; again for a ball at another place."
        ),
    ] = None,
    seen: SphereWords,
    dark: Annotated[
        Path | None, typer.Option(help="A picture with every light off; left out: one named dark or ambient.")
    ] = None,
    mask: Annotated[
        Path | None, typer.Option("--mask", help="A picture, white where to solve; left out: one named mask.")
    ] = None,
    transfer: Transfer = None,
    white_level: Annotated[
        float | None,
        typer.Option(
            help="The code at which the pictures saturate: 4095 of 12 bits in files of 16; left out: the largest one."
        ),
    ] = None,
    solver: SolverOption = "auto",
    fill: Fill = True,
    preset: ProgramOption = None,
    aov: AovOption = None,
    mesh: MeshOption = None,
    encode: EncodeOption = None,
    plates: Plates = False,
    rti: Annotated[
        bool,
        typer.Option(
            "--rti/--no-rti", help="Write rti/ too: relighting for web pages (OpenLIME), and a .ptm for RTIViewer."
        ),
    ] = True,
    force: Force = False,
    voice: Voice,
) -> None:
    """Write normals, albedo and validity of photographs of a still scene, one per light; no plan is needed."""
    from psvideo.report.run_report import report_record
    from psvideo.runs.stills import stills as solve

    report = solve(
        folder,
        out=out,
        lights=lights,
        sphere=sphere or (),
        dark=dark,
        mask=mask,
        transfer=transfer,
        white_level=white_level,
        **seen.parameters(),
        solver=solver,
        fill=fill,
        preset=preset,
        aov=plain(aov),
        mesh=plain(mesh),
        encode=encode,
        plates=plates,
        rti=rti,
        force=force,
        watch=voice.track,
        caller=voice.caller(context),
    )
    voice.result(report_record(report))
    print_report(voice, report)
    voice.say(f"{out}: written; see {out / 'report.html'}.")
