"""psvideo stills: normal maps and albedo from photographs, one per light, without a plan."""

from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice, print_report
from psvideo.cli.options.calibrate import SphereWords
from psvideo.cli.options.clip_and_run import Force
from psvideo.cli.options.records import spread
from psvideo.cli.options.solving import Fill, SolverOption
from psvideo.cli.options.stills import LightsWords, PhotographWords, StillDeliveryWords


@spread
def stills(
    context: typer.Context,
    folder: Annotated[Path, typer.Argument(help="The folder of photographs, one per light, of any names.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="The folder to write.")],
    *,
    known: LightsWords,
    seen: SphereWords,
    photographs: PhotographWords,
    solver: SolverOption = "auto",
    fill: Fill = True,
    delivery: StillDeliveryWords,
    force: Force = False,
    voice: Voice,
) -> None:
    """Write normals, albedo and validity of photographs of a still scene, one per light; no plan is needed."""
    from psvideo.report.run_report import report_record
    from psvideo.runs.stills import stills as solve

    report = solve(
        folder,
        out=out,
        **known.parameters(),
        **vars(photographs),
        **seen.parameters(),
        solver=solver,
        fill=fill,
        **delivery.parameters(),
        force=force,
        watch=voice.track,
        caller=voice.caller(context),
    )
    voice.result(report_record(report))
    print_report(voice, report)
    voice.say(f"{out}: written; see {out / 'report.html'}.")
