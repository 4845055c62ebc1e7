"""What is done with some of the results in a thread of its own, so that none of them waits for it."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from psvideo.live.chain import NewestRound

LEAVES_S = 5.0
"""What is being done when the run ends is waited for no longer than this."""


@contextmanager
def beside(do: Callable[[NewestRound], None]) -> Iterator[Callable[[NewestRound], None]]:
    """Give a function that hands a result to ``do`` in another thread, and returns at once.

    What comes while ``do`` is busy takes the place of what waited for it: it always gets the newest. What ``do`` raises
    is raised by the next call.
    """
    waits: list[NewestRound] = []
    faults: list[BaseException] = []
    came, over = threading.Condition(), threading.Event()

    def take(newest: NewestRound) -> None:
        if faults:
            raise faults[0]
        with came:
            waits[:] = [newest]
            came.notify()

    def run() -> None:
        while True:
            with came:
                came.wait_for(lambda: waits or over.is_set())
                if over.is_set():
                    return
                newest = waits.pop()
            try:
                do(newest)
            except BaseException as fault:  # raised where results are made
                faults.append(fault)
                return

    thread = threading.Thread(target=run, name="psvideo looking", daemon=True)
    thread.start()
    try:
        yield take
    finally:
        over.set()
        with came:
            came.notify()
        thread.join(LEAVES_S)
