"""psvideo view: a page to look at a result and to light it anew."""

import contextlib
import sys
import webbrowser
from pathlib import Path
from typing import Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options import Json, Quiet, Verbose


def view(
    path: Annotated[Path, typer.Argument(help="Results, plates, or a clip.")],
    port: Annotated[int | None, typer.Option(help="The port to listen on; left out: a free one.")] = None,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open the page in a browser.")] = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Show a result in the browser: scrub, compare, and light it anew; only this machine can open the page."""
    from psvideo.page import page_server, show_of

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    with page_server(show_of(path), port=port) as server:
        voice.say(f"{path}: {server.url} (this machine only; Ctrl-C ends it)")
        voice.result({"url": server.url, "port": server.server_port})
        sys.stdout.flush()  # whoever reads a pipe wants the address now
        if not no_browser:
            webbrowser.open(server.url)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()
