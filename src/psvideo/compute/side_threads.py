"""Threads that run beside everything else, and are waited for when the process ends."""

import atexit
import threading
import time
import weakref
from collections.abc import Callable

ENDS_S = 3.0
"""The process waits for such a thread no longer than this: a picture is solved, or a ball is found, in a second or two;
what searches for minutes is given up."""

_running: "weakref.WeakSet[threading.Thread]" = weakref.WeakSet()


def run_beside(run: Callable[[], None], *, name: str) -> threading.Thread:
    """Start a thread that keeps nobody from ending, and that the end of the process waits for, ``ENDS_S`` at most.

    A thread that is left in the midst of a call takes the process down: when it comes back from C++ (OpenCV, OpenEXR)
    while the interpreter ends, Python unwinds it through a destructor, which C++ answers with "terminate called without
    an active exception" (pybind11 issue 2215).
    """
    thread = threading.Thread(target=run, name=name, daemon=True)
    _running.add(thread)
    thread.start()
    return thread


def still_at_work(most_s: float) -> bool:
    """Return whether any such thread is at work yet, after waiting for them for ``most_s`` altogether."""
    until_s = time.monotonic() + most_s
    for thread in list(_running):
        thread.join(max(until_s - time.monotonic(), 0.0))
    return any(thread.is_alive() for thread in list(_running))


@atexit.register
def _wait() -> None:
    for thread in list(_running):
        thread.join(ENDS_S)
