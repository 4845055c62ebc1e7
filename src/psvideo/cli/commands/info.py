"""psvideo info: say what a file or folder is and whether it fits together."""

from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import PlanPath
from psvideo.cli.options.records import spread


@spread
def info(
    path: Annotated[Path, typer.Argument(help="A clip, a movie, an output folder, an image, or a psvideo file.")],
    *,
    plan: PlanPath = None,
    voice: Voice,
) -> None:
    """Say what a file or folder is, and whether it fits together: exit status 1 where it does not."""
    from psvideo.inspect.describe import describe

    found = describe(path, plan=plan)
    voice.say(f"{path}: {found.kind}")
    for finding in found.findings:
        voice.say(f"  {finding.level:5} {finding.text}")
    for name, value in found.facts.items():
        voice.detail(f"  {name} = {value}")
    findings = [{"level": finding.level, "text": finding.text} for finding in found.findings]
    voice.result(
        {"path": str(path), "kind": found.kind, "fits": found.fits, "facts": found.facts, "findings": findings}
    )
    if not found.fits:
        raise typer.Exit(1)
