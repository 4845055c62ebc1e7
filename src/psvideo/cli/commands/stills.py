"""psvideo stills: normal maps and albedo from photographs, one per light, without a plan."""

from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice, plain, print_report
from psvideo.cli.options.calibrate import Circles, FocalMm, FocalPx, RadiusMm, SensorMm, Spheres, Transfer
from psvideo.cli.options.clip_and_run import Force
from psvideo.cli.options.delivery import AovOption, EncodeOption, MeshOption, Plates, ProgramOption
from psvideo.cli.options.records import spread
from psvideo.cli.options.solving import Fill, SolverOption
from psvideo.cli.options.typed import parse_circle, parse_radius_mm


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
    spheres: Spheres = 1,
    dark: Annotated[
        Path | None, typer.Option(help="A picture with every light off. [default: one named dark or ambient]")
    ] = None,
    mask: Annotated[
        Path | None, typer.Option("--mask", help="A picture, white where to solve. [default: one named mask]")
    ] = None,
    transfer: Transfer = None,
    focal_px: FocalPx = None,
    focal_mm: FocalMm = None,
    sensor_mm: SensorMm = None,
    radius_mm: RadiusMm = None,
    circle: Circles = None,
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
        spheres=spheres,
        dark=dark,
        mask=mask,
        transfer=transfer,
        focal_px=focal_px,
        focal_mm=focal_mm,
        sensor_mm=sensor_mm,
        radius_mm=None if radius_mm is None else parse_radius_mm(radius_mm),
        circle=[parse_circle(text) for text in circle or ()],
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
