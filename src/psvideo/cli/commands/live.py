"""psvideo live: normals and relit light while the camera runs."""

import json as texts
import webbrowser
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice, print_json
from psvideo.cli.ending import stoppable
from psvideo.cli.live_lines import LiveLines
from psvideo.cli.options.clip_and_run import FirstLight, Force, PlanPath
from psvideo.cli.options.live import HoldingWords, IncomingWords, LivePageWords, PaceWords
from psvideo.cli.options.records import spread
from psvideo.errors import UsageError

STOPS = 2
"""The first Ctrl-C is how a live run ends; a second one leaves out what still waits for the disk."""


@spread
def live(
    *,
    source: Annotated[
        str,
        typer.Argument(
            help="What to watch: a clip, played at its pace; a URL (udp, rtsp, srt); a device; genicam; - for a pipe.",
            show_default=False,
        ),
    ] = "",
    plan: PlanPath = None,
    rig: Annotated[
        Path | None, typer.Option("--rig", help="Where the lights are; left out: rig.toml beside the footage.")
    ] = None,
    rig_out: Annotated[
        Path | None, typer.Option("--rig-out", help="Rig file for the lights that a click on the page finds on a ball.")
    ] = None,
    first_light: FirstLight = None,
    timing_out: Annotated[
        Path | None, typer.Option("--timing-out", help="timing.json to write at the end, of the whole run.")
    ] = None,
    list_all: Annotated[
        bool, typer.Option("--list", help="List cameras, video devices and strobe boards, and stop.")
    ] = False,
    incoming: IncomingWords,
    holding: HoldingWords,
    playing: PaceWords,
    served: LivePageWords,
    force: Force = False,
    voice: Voice,
) -> None:
    """Show normals and relit light while the camera runs: follow the strobe, solve the newest round."""
    from psvideo.runs.live import live as watch

    if list_all:
        _list(voice)
        return
    if not source:
        raise UsageError("Name what to watch: a clip, a URL, a device; psvideo live --list shows what there is.")
    lines = LiveLines(voice=voice)
    with stoppable(stops=STOPS):
        summary = watch(
            source,
            plan=plan,
            rig=rig,
            rig_out=rig_out,
            first_light=first_light,
            timing_out=timing_out,
            **vars(incoming),
            **vars(holding),
            **vars(playing),
            **served.parameters(),
            force=force,
            opened=lambda url: _open(voice, url, browser=not served.no_browser),
            said=lines.say,
            caller=voice.caller(),
        )
    lines.end()
    lines.warn(summary.notes)
    voice.say(summary.words)
    if voice.json:
        print_json(texts.dumps(summary.record))


def _list(voice: Voice) -> None:
    """Show what there is to watch, and to flash."""
    from psvideo.runs.on_set.live_sources import on_set

    found = on_set()
    voice.result({"found": [asdict(one) for one in found]})
    for one in found:
        voice.say(f"{one.kind}: {one.name}  {one.label}".rstrip())
    if not found:
        voice.say("No camera, video device or board found. GenICam cameras need psvideo[genicam].")


def _open(voice: Voice, url: str, *, browser: bool) -> None:
    """Say where the page is, and open it."""
    if voice.json:
        print_json(texts.dumps({"url": url}))
    voice.say(f"{url} (Ctrl-C ends it)")
    if browser:
        webbrowser.open(url)
