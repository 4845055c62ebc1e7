"""Work shared between threads, whose results come in order and are the same for any number of threads.

Python threads are used: compiled functions, decoders and encoders work without the interpreter's lock. What is shared
is cut by the size of the work, never by the number of threads: sums of floating-point numbers depend on the cut.
"""

import contextlib
import functools
import os
import sys
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, Generic, TypeVar

from psvideo.errors import UsageError

RANGES = "psvideo ranges"
"""How threads are called that work on ranges."""
WRITING_THREADS = 2
MOST_WAITING = 2
"""Files that may wait to be written: what bounds memory."""

Item = TypeVar("Item")
Submit = Callable[[Callable[[], None]], None]

THREADS = "PSVIDEO_THREADS"
"""The environment variable that sets how many threads compute; without it, as many as cores may be used."""


def usable_cores() -> int:
    """Return how many cores this process may use: a farm may bind it to some of the machine's."""
    return len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1


def thread_count() -> int:
    """Return how many threads compute at a time. Raises UsageError where PSVIDEO_THREADS is no whole number above 0."""
    text = os.environ.get(THREADS, "")
    if not text:
        return usable_cores()
    if not (text.isascii() and text.isdecimal() and int(text) > 0):
        raise UsageError(
            f"{THREADS}={text}: expected a whole number of threads, 1 or more. Correct the environment variable, or "
            "remove it to use all cores."
        )
    return int(text)


def over_ranges(run: Callable[[int, int], Item], count: int, *, each: int, threads: int | None = None) -> list[Item]:
    """Call ``run(first, last)`` for ranges of ``each`` out of ``count``, side by side, and return its results in order.

    The calling thread works too, and every thread takes the next range when it has done one: to hand over each by
    itself would cost as much as solving some rows. Of several errors the first range's is raised. A ``run`` that itself
    calls this does so in its own thread.

    >>> over_ranges(lambda first, last: last - first, 5, each=2)
    [2, 2, 1]
    """
    firsts = range(0, count, max(each, 1))
    helpers = min(threads or thread_count(), len(firsts)) - 1
    if helpers < 1 or getattr(_inside, "ranges", False):
        return [run(first, min(first + firsts.step, count)) for first in firsts]
    shared = _Ranges(run, firsts, count)
    at_hand = [shared]
    waiting = [_pool(helpers).submit(_help, at_hand) for _ in range(helpers)]
    shared.work()
    at_hand.clear()  # a helper that comes late finds nothing, and until then holds nothing that the ranges are of
    for one in waiting:
        if not one.cancel():
            one.result()
    return shared.results()


def _help(at_hand: "list[_Ranges[Any]]") -> None:
    for shared in at_hand[:]:
        shared.work()


_inside = threading.local()
"""Whether a thread works on ranges."""


class _Ranges(Generic[Item]):
    """Ranges that several threads take one after the other."""

    def __init__(self, run: Callable[[int, int], Item], firsts: range, count: int) -> None:
        self._run, self._count, self._firsts = run, count, firsts
        self._next = iter(firsts)
        self._lock = threading.Lock()
        self._done: dict[int, Item] = {}
        self._faults: dict[int, BaseException] = {}

    def work(self) -> None:
        """Work on ranges until none is left, or one has failed."""
        _inside.ranges = True
        try:
            while (first := self._taken()) is not None:
                try:
                    self._done[first] = self._run(first, min(first + self._firsts.step, self._count))
                except BaseException as fault:
                    self._faults[first] = fault
        finally:
            _inside.ranges = False

    def _taken(self) -> int | None:
        with self._lock:
            return None if self._faults else next(self._next, None)

    def results(self) -> list[Item]:
        """Return what every range gave, once all threads are done."""
        if self._faults:
            raise self._faults[min(self._faults)]
        return [self._done[first] for first in self._firsts]


@functools.cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix=RANGES)


os.register_at_fork(after_in_child=_pool.cache_clear)  # a child process has none of its parent's threads


def in_order(
    jobs: Iterator[Callable[[], Item]], *, ahead: int, threads: int | None = None, name: str
) -> Generator[Item]:
    """Run jobs in threads, up to ``ahead`` of them before they are asked for, and give their results in order.

    The threads, which are called ``name``, end when the iterator is used up, closed, or ends in an error.
    """
    most = max(ahead, 1)
    pool = ThreadPoolExecutor(min(threads or thread_count(), most), thread_name_prefix=name)
    waiting: deque[Future[Item]] = deque()
    try:
        for job in jobs:
            waiting.append(pool.submit(job))
            if len(waiting) > most:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextlib.contextmanager
def writing(*, most_waiting: int = MOST_WAITING) -> Iterator[Submit]:
    """Give a function that takes jobs (functions without arguments) and runs them in up to this many threads.

    It blocks while ``most_waiting`` jobs are under way, and raises what a job before raised; so does the end of the
    block, which waits for all jobs. A block that fails waits for them too: what was computed is kept for resuming.
    """
    pool = ThreadPoolExecutor(min(WRITING_THREADS, thread_count()), thread_name_prefix="write")
    waiting: deque[Future[None]] = deque()

    def submit(job: Callable[[], None]) -> None:
        while len(waiting) >= most_waiting or (waiting and waiting[0].done()):
            waiting.popleft().result()
        waiting.append(pool.submit(job))

    try:
        yield submit
        while waiting:
            waiting.popleft().result()
    finally:
        pool.shutdown(wait=True)
