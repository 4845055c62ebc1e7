"""How a live run is told of while it lasts: a line that is written over on a terminal, one line of JSON a second for
machines, and lines that stay elsewhere."""

from __future__ import annotations

import json as texts
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING

from psvideo.cli.console import Voice, print_json

if TYPE_CHECKING:
    from psvideo.live.status import LiveStatus

STAYS_S = 10.0
"""Where lines are not written over, one comes this often as long as nothing changes."""


@dataclass(kw_only=True)
class LiveLines:
    """Says how things stand: a line that is written over on a terminal, one line of JSON a second for machines; and
    what there is to say of the run when it comes up, each sentence once. Elsewhere lines stay, and say what is new."""

    voice: Voice
    warned: set[str] = field(default_factory=set)
    waited: str = ""
    stood: tuple[str, bool] = ("", False)
    written_s: float = -inf

    def say(self, status: LiveStatus) -> None:
        """Say what the last second was."""
        over = "\r\x1b[K" if sys.stderr.isatty() and not self.voice.json else ""
        words = status.all_words
        if over and not self.warned.issuperset(words):
            print(over, end="", file=sys.stderr)
        self.warn(words)
        if not status.waits_for:
            self.warned.discard(self.waited)
        self.waited = status.waits_for
        if self.voice.json:
            print_json(texts.dumps(status.record))
        elif not self.voice.quiet and (over or self._is_news(status)):
            print(f"{over}{status.line}", end="" if over else "\n", file=sys.stderr, flush=True)

    def _is_news(self, status: LiveStatus) -> bool:
        """Return whether things stand otherwise than in the last line that stays, or that line is old."""
        stands = (status.state, status.fps > 0)
        news = stands != self.stood or status.at_s - self.written_s >= STAYS_S
        if news:
            self.stood, self.written_s = stands, status.at_s
        return news

    def warn(self, words: Sequence[str]) -> None:
        """Warn of what was not yet said."""
        for sentence in words:
            if sentence not in self.warned:
                self.voice.warn(sentence)
                self.warned.add(sentence)

    def end(self) -> None:
        """Leave the line that was written over, for what is said after the run."""
        if sys.stderr.isatty() and not (self.voice.json or self.voice.quiet):
            print(file=sys.stderr)
