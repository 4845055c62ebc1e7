"""What happens before the first frame: the rehearsal, in a thread, so that a page and a console can say how far it is
and Ctrl-C ends it at once."""

from collections.abc import Callable

from psvideo.compute.compile_count import CompileCount
from psvideo.compute.side_threads import run_beside
from psvideo.model.units import counted

USUAL_S = 60
"""Compiling takes at most this long on a machine that is not busy (docs/decisions/first-run.md)."""
RECENT_S = 3.0
"""A loop that was begun less than this ago is likely still being compiled."""


def prepared(prepare: Callable[[], None], *, said: Callable[[], None], every_s: float) -> str:
    """Run ``prepare``, calling ``said`` every ``every_s`` seconds meanwhile; return what went wrong, or "".

    Nothing that goes wrong in a rehearsal keeps the run from beginning: it would only begin more slowly.
    """
    wrong: list[str] = []

    def run() -> None:
        try:
            prepare()
        except Exception as fault:  # said to whoever watches
            wrong.append(f"Getting ready went wrong ({fault}); the first results may come late.")

    thread = run_beside(run, name="psvideo rehearsal")
    while thread.is_alive():
        thread.join(every_s)
        if thread.is_alive():
            said()
    return "".join(wrong)


def compiling_words(compiles: CompileCount, now_s: float, *, preparing: bool) -> str:
    """Return what is said of loops that are being compiled at a time of the monotonic clock, "" where none is."""
    if not compiles.count or (not preparing and now_s - compiles.last_s > RECENT_S):
        return ""
    took = f"{counted(compiles.count, 'loop')} in {now_s - compiles.since_s:.0f} s"
    if preparing:
        return f"Compiling, once: {took} so far; it takes {USUAL_S} s or so, and the source is opened then."
    return f"Compiling, once: {took}; pictures wait for it."
