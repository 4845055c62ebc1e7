"""psvideo doctor: what is installed, what the machine can do, and what to do about the rest."""

from collections.abc import Iterable
from dataclasses import asdict
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.common import Json, Quiet, Verbose

if TYPE_CHECKING:
    from psvideo.inspect.findings import Finding

SHOWN = {"ok": "ok", "note": "--", "missing": "MISSING"}


def doctor(
    folder: Annotated[Path, typer.Option("--folder", help="The folder whose disk is measured, in MB/s.")] = Path(),
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Say what is installed, what the machine can do and what to do about the rest: exit status 1 where work stops."""
    from psvideo.inspect.findings import is_well
    from psvideo.inspect.machine import machine, strobes
    from psvideo.inspect.software import software
    from psvideo.inspect.speed import speed

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    found = list(_one_by_one(chain(software(), machine(), strobes(), speed(folder)), voice))
    well = is_well(found)
    voice.result({"well": well, "findings": [asdict(finding) for finding in found]})
    missing = sum(finding.level == "missing" for finding in found)
    notes = sum(finding.level == "note" for finding in found)
    voice.say("")
    voice.say("All that psvideo needs is here." if well else f"{missing} thing(s) are missing: see above.")
    if notes:
        voice.say(f"{notes} thing(s) marked -- are needed for some work only.")
    if not well:
        raise typer.Exit(1)


def _one_by_one(findings: "Iterable[Finding]", voice: Voice) -> "Iterable[Finding]":
    """Pass findings on, and say each as soon as it is known."""
    for finding in findings:
        voice.say(f"{SHOWN[finding.level]:8}{finding.name:32}{finding.text}")
        if finding.next_step:
            voice.say(f"{'':8}{'':32}-> {finding.next_step}")
        yield finding
