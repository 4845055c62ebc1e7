"""How many loops a run compiles: shown on the page and the console while it takes time."""

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager

COMPILING = logging.getLogger("psvideo.compiling")
"""Where ``compiled`` says that it compiles; got by name, because loading that loads the compiler."""


class CompileCount(logging.Handler):
    """Counts loops that are compiled rather than loaded; ``count`` so far, ``since_s`` and ``last_s`` by this machine's
    monotonic clock, of the first and the latest."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.count, self.since_s, self.last_s = 0, 0.0, float("-inf")

    def emit(self, record: logging.LogRecord) -> None:
        """Count one more."""
        self.last_s = time.monotonic()
        self.since_s = self.since_s if self.count else self.last_s
        self.count += 1


@contextmanager
def compiles_counted() -> Iterator[CompileCount]:
    """In this block, count the loops that are compiled."""
    counting, before = CompileCount(), COMPILING.level
    COMPILING.addHandler(counting)
    COMPILING.setLevel(logging.INFO)
    try:
        yield counting
    finally:
        COMPILING.removeHandler(counting)
        COMPILING.setLevel(before)
