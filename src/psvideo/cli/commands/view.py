"""psvideo view: a page to look at a result and to relight it."""

import contextlib
import sys
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import Force, PlanPath
from psvideo.cli.options.records import spread


@spread
def view(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="PATH...",
            help="A folder of results (out/) or plates, or a clip; several folders of results are shown side by side.",
        ),
    ],
    *,
    clip: Annotated[
        Path | None,
        typer.Option(help="The clip that results or plates came from; left out: looked for beside them."),
    ] = None,
    plan: PlanPath = None,
    port: Annotated[int | None, typer.Option(help="The port to listen on; left out: a free one.")] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open the page in a browser.")] = False,
    export: Annotated[
        Path | None, typer.Option(help="Write the page and some pictures into one file, and serve nothing.")
    ] = None,
    export_width: Annotated[
        int, typer.Option(min=64, max=8192, help="Largest width of the exported pictures, in pixels.")
    ] = 480,
    export_count: Annotated[int, typer.Option(min=1, help="Most pictures of each sequence to export.")] = 24,
    force: Force = False,
    voice: Voice,
) -> None:
    """Show a result in the browser: scrub, compare, and relight it; only this machine can open the page."""
    from psvideo.runs.view import export_view
    from psvideo.runs.view import view as serve

    if export is not None:
        held = export_view(
            paths,
            out=export,
            clip=clip,
            plan=plan,
            width_px=export_width,
            count=export_count,
            force=force,
            watch=voice.track,
            caller=voice.caller(),
        )
        voice.result({"page": str(export), **held.record})
        voice.say(f"{export}: {held.words}")
        return
    with serve(paths, clip=clip, plan=plan, port=port, caller=voice.caller()) as server:
        voice.say(f"{', '.join(map(str, paths))}: {server.url} (this machine only; Ctrl-C ends it)")
        voice.result({"url": server.url, "port": server.server_port})
        sys.stdout.flush()  # a program that reads a pipe wants the address now
        if not no_browser:
            webbrowser.open(server.url)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()
