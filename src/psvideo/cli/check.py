"""psvideo check: on the set, in seconds: can this take be used, and if not, what to change?"""

import json as json_text
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options import FirstLight, Json, OrderRig, PlanPath, Quiet, Verbose
from psvideo.errors import PsvideoError, UsageError

if TYPE_CHECKING:
    from psvideo.runs.checking import Check

INTERVAL_S = 2.0
COLOURS = {"good": "32", "doubtful": "33", "bad": "31", "unknown": "2"}
"""Of the words, by their numbers on a terminal (ECMA-48); the words say the same."""


def check(
    clip: Annotated[
        Path | None, typer.Argument(help="A clip: a folder of numbered frames with plan.toml, or a movie file.")
    ] = None,
    watch: Annotated[
        Path | None,
        typer.Option("--watch", metavar="FOLDER", help="Check every new take that appears below this folder."),
    ] = None,
    interval: Annotated[
        float, typer.Option(help="Seconds between two looks at the watched folder.", min=0.1, max=3600)
    ] = INTERVAL_S,
    existing: Annotated[bool, typer.Option("--existing", help="Check the takes that are there already, too.")] = False,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE", help="Keep a page (HTML) of all checks, outside of the footage."),
    ] = None,
    plan: PlanPath = None,
    rig: OrderRig = None,
    first_light: FirstLight = None,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Judge a take in seconds, one line for each thing: exit status 0 where it can be used, 1 where not."""
    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    if (clip is None) == (watch is None):
        raise UsageError("Name either a clip to check, or a folder of takes with --watch FOLDER.")
    from psvideo.runs.checking import check_take

    if clip is not None:
        _refuse_inside(report, clip)
        found = check_take(clip, plan=plan, rig=rig, first_light=first_light, watch=voice.track)
        _tell(voice, found)
        _keep(report, [found])
        if not found.usable:
            raise typer.Exit(1)
    elif watch is not None:
        if not watch.is_dir():
            raise UsageError(f"{watch}: is no folder. Name the folder into which takes are copied.")
        _refuse_inside(report, watch)
        _watch(voice, watch, interval=interval, existing=existing, report=report, given=(plan, rig, first_light))


def _watch(
    voice: Voice,
    folder: Path,
    *,
    interval: float,
    existing: bool,
    report: Path | None,
    given: tuple[Path | None, Path | None, str | None],
) -> None:
    """Check take after take until Ctrl-C, and end with a line that sums up."""
    from psvideo.runs.checking import check_take
    from psvideo.runs.takes import whole_takes

    plan, rig, first_light = given
    checks: dict[Path, Check] = {}
    failed: dict[Path, str] = {}
    _note(voice, f"Watching {folder} for new takes; Ctrl-C ends.")
    there = True
    try:
        for path in whole_takes(folder, interval_s=interval, existing=existing):
            if path is None:
                if there != folder.is_dir():
                    there = not there
                    _note(voice, f"{folder}: {'is there again.' if there else 'cannot be reached; waiting for it.'}")
                continue
            checks.pop(path, None)
            failed.pop(path, None)
            try:
                checks[path] = check_take(path, plan=plan, rig=rig, first_light=first_light)
            except (PsvideoError, OSError) as fault:
                gone = not path.exists()
                failed[path] = f"{path}: was removed before it could be checked." if gone else str(fault)
                _tell_fault(voice, path, failed[path])
            else:
                _tell(voice, checks[path])
            _keep(report, list(checks.values()), failed)
    except KeyboardInterrupt:
        usable = sum(one.usable for one in checks.values())
        _note(
            voice,
            f"{len(checks) + len(failed)} take(s) checked: {usable} usable, {len(checks) - usable} not, {len(failed)} "
            "could not be read.",
        )


def _note(voice: Voice, text: str) -> None:
    """Say something that is no take's: on stderr where machines read stdout."""
    if voice.json:
        print(text, file=sys.stderr, flush=True)
    elif not voice.quiet:
        print(text, flush=True)


def _tell(voice: Voice, check: "Check") -> None:
    if voice.json:
        from psvideo.runs.checking import check_record

        print(json_text.dumps(check_record(check)), flush=True)
        return
    looked = f"{check.looked_at} of {check.frames} frames looked at, {check.seconds:.1f} s"
    voice.say(f"{check.path}: {check.verdict} ({looked})")
    for one in check.judgements:
        voice.say(f"  {_word(one.grade)} {one.subject:9} {one.sentence}")
    for note in check.notes:
        voice.say(f"  {'':8} note      {note}")
    sys.stdout.flush()


def _tell_fault(voice: Voice, path: Path, fault: str) -> None:
    if voice.json:
        print(json_text.dumps({"schema": "psvideo-check/1", "path": str(path), "usable": False, "error": fault}))
    else:
        voice.say(f"{path}: cannot be checked yet.\n  {_word('bad')} footage   {fault}")
    sys.stdout.flush()


def _word(grade: str) -> str:
    word = f"{grade:8}"
    coloured = sys.stdout.isatty() and "NO_COLOR" not in os.environ
    return f"\x1b[{COLOURS[grade]}m{word}\x1b[0m" if coloured else word


def _refuse_inside(report: Path | None, footage: Path) -> None:
    """Nothing is ever written among footage."""
    folder = footage if footage.is_dir() else footage.parent
    if report is not None and report.resolve().is_relative_to(folder.resolve()):
        raise UsageError(f"--report {report}: lies among the footage of {folder}. Name a file somewhere else.")


def _keep(report: Path | None, checks: "list[Check]", failed: dict[Path, str] | None = None) -> None:
    """Write the page of all checks anew."""
    if report is None:
        return
    from psvideo.formats.whole_files import write_text
    from psvideo.runs.check_page import check_page

    write_text(report, check_page(checks, failed or {}))
