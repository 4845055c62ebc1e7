"""psvideo check: on the set, in seconds: can this take be used, and if not, what to change?"""

import contextlib
import json as json_text
import os
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from psvideo.cli.console import Voice, print_json
from psvideo.cli.options.clip_and_run import FirstLight, PlanPath, RigPath, Sharing
from psvideo.cli.options.records import spread
from psvideo.errors import UsageError
from psvideo.model.units import counted

if TYPE_CHECKING:
    from collections.abc import Iterator

    from psvideo.runs.many_takes.check_folder import Unread
    from psvideo.runs.steps.checked import Check

INTERVAL_S = 2.0
COLOURS = {"good": "32", "doubtful": "33", "bad": "31", "unknown": "2"}
"""Of the words, by their numbers on a terminal (ECMA-48); the words say the same."""


@spread
def check(
    *,
    clips: Annotated[
        list[Path] | None,
        typer.Argument(help="A clip: a folder of numbered frames with plan.toml, or a movie file. Or several."),
    ] = None,
    watch: Annotated[
        Path | None,
        typer.Option("--watch", metavar="FOLDER", help="Check every new take that appears below this folder."),
    ] = None,
    interval: Annotated[
        float, typer.Option(help="How many seconds to wait between looks at the watched folder.", min=0.1, max=3600)
    ] = INTERVAL_S,
    existing: Annotated[bool, typer.Option("--existing", help="Check the takes that are there already, too.")] = False,
    report: Annotated[
        Path | None,
        typer.Option("--report", metavar="FILE", help="Keep a page (HTML) of all checks, outside of the footage."),
    ] = None,
    plan: PlanPath = None,
    rig: RigPath = None,
    first_light: FirstLight = None,
    sharing: Sharing,
    voice: Voice,
) -> None:
    """Judge a take in seconds, one line for each thing: exit status 0 where it can be used, 1 where not."""
    if (not clips) == (watch is None):
        raise UsageError("Name either a clip to check, or a folder of takes with --watch FOLDER.")
    if watch is not None and sharing.asked:
        raise UsageError("--watch checks takes as they come, in this process: leave out --workers and --scheduler.")
    common: dict[str, Any] = {"plan": plan, "rig": rig, "first_light": first_light, "report": report}
    if watch is not None:
        _check_as_they_come(voice, watch, interval_s=interval, existing=existing, **common)
    elif len(clips or ()) > 1 or sharing.asked:
        _check_several(voice, clips or [], **vars(sharing), **common)
    elif clips:
        _check_one(voice, clips[0], **common)


def _check_one(voice: Voice, clip: Path, **options: Any) -> None:
    from psvideo.runs.check import check as judge

    found = judge(clip, watch=voice.track, caller=voice.caller(), **options)
    _print_check(voice, found)
    if not found.usable:
        raise typer.Exit(1)


def _check_several(voice: Voice, clips: list[Path], **options: Any) -> None:
    from psvideo.runs.many_takes.check_folder import check_takes

    if not _follow(voice, check_takes(clips, watch=voice.track, caller=voice.caller(), **options)):
        raise typer.Exit(1)


def _check_as_they_come(voice: Voice, folder: Path, **options: Any) -> None:
    from psvideo.runs.many_takes.check_folder import check_folder

    checks = check_folder(folder, caller=replace(voice.caller(), say=partial(_note, voice)), **options)
    _note(voice, f"Watching {folder} for new takes; Ctrl-C ends.")
    _follow(voice, checks, until_stopped=True)


def _follow(voice: Voice, checks: "Iterator[Check | Unread]", *, until_stopped: bool = False) -> bool:
    """Say of take after take what was found, and end with a line that sums up; return whether all can be used.
    ``until_stopped``: Ctrl-C is the usual end, as of a folder that is watched."""
    from psvideo.runs.steps.checked import Check

    last: dict[Path, bool | None] = {}
    with contextlib.suppress(KeyboardInterrupt) if until_stopped else contextlib.nullcontext():
        for found in checks:
            if isinstance(found, Check):
                last[found.path] = found.usable
                _print_check(voice, found)
            else:
                last[found.path] = None
                _print_fault(voice, found.path, found.fault)
    read = [usable for usable in last.values() if usable is not None]
    _note(
        voice,
        f"{counted(len(last), 'take')} checked: {sum(read)} usable, {len(read) - sum(read)} not, "
        f"{len(last) - len(read)} could not be read.",
    )
    return all(last.values())


def _note(voice: Voice, text: str) -> None:
    """Say something that is no take's: on stderr where machines read stdout."""
    if voice.json:
        print(text, file=sys.stderr, flush=True)
    elif not voice.quiet:
        print(text, flush=True)


def _print_check(voice: Voice, check: "Check") -> None:
    if voice.json:
        from psvideo.runs.steps.checked import check_record

        print_json(json_text.dumps(check_record(check)))
        return
    voice.say(f"{check.path}: {check.verdict} ({check.looked}, {check.seconds:.1f} s)")
    for one in check.judgements:
        voice.say(f"  {_word(one.grade)} {one.subject:9} {one.sentence}")
    for warning in check.warnings:
        voice.say(f"  {'':8} warning   {warning}")
    for note in check.notes:
        voice.say(f"  {'':8} note      {note}")
    sys.stdout.flush()


def _print_fault(voice: Voice, path: Path, fault: str) -> None:
    from psvideo.runs.steps.checked import SCHEMA

    if voice.json:
        print_json(json_text.dumps({"schema": SCHEMA, "path": str(path), "usable": False, "error": fault}))
    else:
        voice.say(f"{path}: cannot be checked yet.\n  {_word('bad')} footage   {fault}")
    sys.stdout.flush()


def _word(grade: str) -> str:
    word = f"{grade:8}"
    coloured = sys.stdout.isatty() and "NO_COLOR" not in os.environ
    return f"\x1b[{COLOURS[grade]}m{word}\x1b[0m" if coloured else word
