"""psvideo calibrate, of several takes: a rig for each, the worst first."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from psvideo.cli.console import Voice

if TYPE_CHECKING:
    from psvideo.runs.calibrate.of_takes import Calibration


def calibrate_all(voice: Voice, calibration: Calibration, pictures: Sequence[Path], *, out: Path, **given: Any) -> None:
    """Calibrate on each of several takes, and say what became of them; end with a fault where one failed."""
    from psvideo.report.of_rigs import rigs_record
    from psvideo.runs.calibrate.of_takes import calibrate_takes

    results = calibrate_takes(calibration, pictures, out=out, **given)
    voice.result(rigs_record(results))
    for one in results:
        voice.say(f"{one.rig}: {one.fault or one.verdict}")
        for words in one.findings:
            voice.say(f"  {words}")
    voice.say(f"See {out / 'report.html'}.")
    if any(one.fault for one in results):
        raise typer.Exit(1)
