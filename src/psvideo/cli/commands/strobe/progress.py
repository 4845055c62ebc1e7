"""How a strobe run is shown while it lasts: a line that is written over on a terminal, plain lines elsewhere."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from rich.live import Live
from rich.text import Text

from psvideo.cli.console import PLAIN_PROGRESS_EVERY_S, Voice

if TYPE_CHECKING:
    from psvideo.strobe.session import RunProgress


@contextmanager
def watching(voice: Voice) -> Iterator[Callable[[RunProgress], None]]:
    """Give what shows each beat of a run; until the first beat the terminal is free, for a question."""
    from rich.console import Console

    if voice.quiet:
        yield lambda beat: None
    elif sys.stderr.isatty() and os.environ.get("TERM") != "dumb":
        with ExitStack() as stack:
            yield _written_over(Live(console=Console(stderr=True), transient=True, auto_refresh=False), stack)
    else:
        yield _plain()


def _written_over(live: Live, stack: ExitStack) -> Callable[[RunProgress], None]:
    def show(beat: RunProgress) -> None:
        if not live.is_started:
            stack.enter_context(live)
        live.update(Text(beat_words(beat)), refresh=True)

    return show


def _plain() -> Callable[[RunProgress], None]:
    said_s = 0.0

    def show(beat: RunProgress) -> None:
        nonlocal said_s
        if beat.elapsed_s - said_s >= PLAIN_PROGRESS_EVERY_S:
            print(beat_words(beat), file=sys.stderr)
            said_s = beat.elapsed_s

    return show


def beat_words(beat: RunProgress) -> str:
    """Return how a run goes in one line: rate, cycles, time left."""
    left = "Ctrl-C stops" if beat.left_s is None else f"{beat.left_s:.0f} s left"
    return f"flashing: {beat.flash_rate_hz:.1f} flashes/s, {beat.cycles} cycles, {beat.elapsed_s:.0f} s, {left}"
