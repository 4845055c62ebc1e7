"""psvideo doctor: what is installed, what the machine can do, and what to do about the rest."""

from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.records import spread
from psvideo.model.units import counted

if TYPE_CHECKING:
    from psvideo.inspect.findings import Finding

SHOWN = {"ok": "ok", "note": "--", "missing": "MISSING"}


@spread
def doctor(
    *,
    folder: Annotated[
        Path, typer.Option("--folder", help="Measure the speed of this folder's disk, in MB/s.")
    ] = Path(),
    ahead: Annotated[
        bool, typer.Option("--compile", help="Compile now what usual runs need, so that none waits for it.")
    ] = False,
    voice: Voice,
) -> None:
    """Report what is installed, how fast the machine is, and how to fix the rest: exit status 1 if work stops."""
    from psvideo.runs.doctor import doctor as examine

    if ahead:
        from psvideo.runs.steps.compiling import compile_ahead

        compile_ahead(watch=voice.track)
    found = examine(folder, show=partial(_print_finding, voice))
    voice.result({"well": found.well, "findings": [asdict(finding) for finding in found.findings]})
    missing = sum(finding.level == "missing" for finding in found.findings)
    notes = sum(finding.level == "note" for finding in found.findings)
    voice.say("")
    voice.say(
        "All that psvideo needs is here."
        if found.well
        else f"{counted(missing, 'thing')} {'is' if missing == 1 else 'are'} missing: see above."
    )
    if notes:
        voice.say(f"{counted(notes, 'thing')} marked -- {'is' if notes == 1 else 'are'} needed for some work only.")
    if not found.well:
        raise typer.Exit(1)


def _print_finding(voice: Voice, finding: "Finding") -> None:
    voice.say(f"{SHOWN[finding.level]:8}{finding.name:32}{finding.text}")
    if finding.next_step:
        voice.say(f"{'':8}{'':32}-> {finding.next_step}")
