"""The options of psvideo live, as records of what belongs together."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from psvideo.cli.options.strobe import Yes
from psvideo.model.choices import Pace
from psvideo.strobe.link.ports import AUTO


@dataclass(frozen=True, kw_only=True)
class IncomingWords:
    """What the source is where it does not say so itself, and whether its frames are recorded, as typed."""

    growing: Annotated[
        bool, typer.Option("--growing", help="The source is a folder that a recorder is still writing.")
    ] = False
    raw: Annotated[
        str | None,
        typer.Option("--raw", help="Pixel format of a raw stream, in FFmpeg's words: gray, gray16le, rgb24."),
    ] = None
    record: Annotated[
        Path | None, typer.Option("--record", help="A clip folder to record the frames into, whole or not at all.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class HoldingWords:
    """Which board plays the plan, and where it holds the dark row, as typed."""

    lock: Annotated[
        str | None,
        typer.Option(
            "--lock",
            help="Play the plan on a board and hold the dark row: edge, a row (300), or away from rows (200-500).",
        ),
    ] = None
    strobe: Annotated[str, typer.Option("--strobe", help="The board's port for --lock.")] = AUTO
    yes: Yes = False


@dataclass(frozen=True, kw_only=True)
class PaceWords:
    """How fast a clip is played, and how much of it, as typed."""

    pace: Annotated[
        Pace,
        typer.Option("--pace", help="A clip's own pace, or fastest: once the strobe is found, every round is solved."),
    ] = "own"
    seconds: Annotated[
        float | None, typer.Option("--seconds", min=0.0, help="End after this many seconds of footage.")
    ] = None


@dataclass(frozen=True, kw_only=True)
class LivePageWords:
    """Whether the live page is served, to whom, and who opens it, as typed."""

    no_page: Annotated[bool, typer.Option("--no-page", help="Serve no page.")] = False
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Do not open the page in a browser.")] = False
    port: Annotated[int | None, typer.Option(help="The page's port; left out: a free one.")] = None
    host: Annotated[
        str, typer.Option(help="Address to serve the page at; at any but 127.0.0.1 the token is needed.")
    ] = "127.0.0.1"
    token: Annotated[
        str | None, typer.Option(help="Secret word in the page's address for other machines; left out: generated.")
    ] = None

    def parameters(self) -> dict[str, Any]:
        """Return them as the library takes them, which opens no browser."""
        return {"page": not self.no_page, "host": self.host, "port": self.port, "token": self.token}
