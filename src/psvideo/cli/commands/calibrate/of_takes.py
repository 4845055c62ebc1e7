"""psvideo calibrate, of one take or of several: a rig for each, the worst first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import Sharing

if TYPE_CHECKING:
    from psvideo.runs.calibrate.of_takes import Calibration


Found = TypeVar("Found")


def one_or_all(
    voice: Voice,
    calibration: Calibration,
    measure: Callable[..., Found],
    pictures: Sequence[Path],
    *,
    out: Path,
    force: bool,
    sharing: Sharing,
    **options: Any,
) -> Found | None:
    """Calibrate on one take and return what was found; on several, or with workers, on each, and return None."""
    common: dict[str, Any] = {"force": force, "watch": voice.track, "caller": voice.caller()}
    if len(pictures) == 1 and not sharing.asked:
        return measure(pictures[0], out=out, **common, **options)
    calibrate_all(voice, calibration, pictures, out=out, **vars(sharing), **common, **options)
    return None


def calibrate_all(voice: Voice, calibration: Calibration, pictures: Sequence[Path], *, out: Path, **given: Any) -> None:
    """Calibrate on each of several takes, and say what became of them; end with a fault where one failed."""
    from psvideo.report.rigs_report import rigs_record
    from psvideo.runs.calibrate.of_takes import calibrate_takes

    results = calibrate_takes(calibration, pictures, out=out, **given)
    voice.result(rigs_record(results))
    for one in results:
        voice.say(one.fault or f"{one.rig}: {one.verdict}")
        for words in one.findings:
            voice.say(f"  {words}")
    voice.say(f"See {out / 'report.html'}.")
    if any(one.fault for one in results):
        raise typer.Exit(1)
