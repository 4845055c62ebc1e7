"""How a strobe run is shown while it lasts: a line that is written over on a terminal, plain lines elsewhere."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.live import Live
from rich.text import Text

from psvideo.cli.console import PLAIN_PROGRESS_EVERY_S, Voice

if TYPE_CHECKING:
    from psvideo.strobe.program import Program
    from psvideo.strobe.session import RunProgress


@contextmanager
def watching(voice: Voice, program: Program, *, lasts_s: float | None) -> Iterator[Callable[[RunProgress], None]]:
    """Give what shows each beat of a run; ``lasts_s`` is how long the run is meant to be, None: until Ctrl-C."""
    from rich.console import Console

    if voice.quiet:
        yield lambda beat: None
    elif sys.stderr.isatty() and os.environ.get("TERM") != "dumb":
        with Live(console=Console(stderr=True), transient=True, auto_refresh=False) as live:
            yield lambda beat: live.update(Text(beat_words(beat, program, lasts_s=lasts_s)), refresh=True)
    else:
        yield _plain(program, lasts_s)


def _plain(program: Program, lasts_s: float | None) -> Callable[[RunProgress], None]:
    said_s = 0.0

    def show(beat: RunProgress) -> None:
        nonlocal said_s
        if beat.elapsed_s - said_s >= PLAIN_PROGRESS_EVERY_S:
            print(beat_words(beat, program, lasts_s=lasts_s), file=sys.stderr)
            said_s = beat.elapsed_s

    return show


def beat_words(beat: RunProgress, program: Program, *, lasts_s: float | None) -> str:
    """Return how a run goes in one line: rate, cycles, time left."""
    plan = program.played
    lit = sum(not plan.flashes[slot].is_dark for slot in plan.cycle_slots)
    left = "Ctrl-C stops" if lasts_s is None else f"{max(lasts_s - beat.elapsed_s, 0.0):.0f} s left"
    return f"flashing: {lit / plan.cycle_s:.1f} flashes/s, {beat.cycles} cycles, {beat.elapsed_s:.0f} s, {left}"
