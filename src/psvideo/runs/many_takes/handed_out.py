"""Work handed to a cluster's workers: takes in pieces, or one call for each; what dies or hangs is done again.

Where the scheduler dies, everything that was solved stays for ``resume``.
"""

import asyncio
import contextlib
import threading
import time
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError
from psvideo.runs.many_takes.cluster import ANSWERS_S

if TYPE_CHECKING:
    from distributed import Client, Future

Value = TypeVar("Value")
Result = TypeVar("Result")

RETRIES = 2
"""A piece is tried this many times more where a worker fails at it for other reasons than its footage."""
HANGS_S, HANGS_TIMES = 600.0, 10.0
"""A piece that takes longer than this, and than this many times the longest done so far, hangs: a disk that is gone
holds a process for ever. (The first pieces may have to find a take's timing.)"""
LOOKS_EVERY_S = 10.0
GONE = (
    "The cluster's scheduler is gone. Run the command again, here or on a cluster; what was written is kept beside the "
    "outputs for `resume`."
)


class Shared(Protocol):
    """A take to be done by workers: piece 0, and after it, in any order, pieces 1 to ``pieces``."""

    @property
    def pieces(self) -> int:
        """Return how many pieces there are beside the first."""

    def do(self, number: int) -> None:
        """Do one piece, in a worker, whose results are the folder that it writes."""


def done_apart(client: "Client", takes: Sequence[Shared], *, watch: Watch = unwatched) -> Iterator[tuple[int, str]]:
    """Have takes done in pieces, and give the place of each, and what is wrong with it or nothing, as it is done.

    Raises PsvideoError where the scheduler is gone.
    """
    from distributed import as_completed

    left: dict[int, int] = {}
    place_of: dict[str, int] = {}
    faults: dict[int, str] = {}
    futures: list[Future] = []
    for place, take in enumerate(takes):
        timed = client.submit(do_piece, take, 0, after="", pure=False, retries=RETRIES)
        pieces = [
            client.submit(do_piece, take, number, after=timed, pure=False, retries=RETRIES)
            for number in range(1, take.pieces + 1)
        ]
        left[place] = 1 + len(pieces)
        place_of |= {future.key: place for future in (timed, *pieces)}
        futures += [timed, *pieces]
    done = as_completed(futures, loop=client.loop, raise_errors=False)
    with _hanging_replaced(client, place_of):
        for future in watch(done, total=len(futures), what="solving", unit="pieces"):
            place = place_of[future.key]
            left[place] -= 1
            fault = result_of_future(future)
            if fault:
                faults.setdefault(place, fault)
            if left[place] == 0:
                yield place, faults.get(place, "")


@dataclass
class Hanging:
    """Which of our pieces hang, from looks at what every worker has to do. since_s: when it was seen first."""

    ours: Container[str]
    since_s: dict[tuple[str, str], float] = field(default_factory=dict)
    longest_s: float = 0.0

    def workers(self, processing: Mapping[str, Sequence[str]], now_s: float) -> list[str]:
        """Return the workers whose pieces take too long, by what each has now; they count as replaced afterwards."""
        now = {(worker, key) for worker, keys in processing.items() for key in keys if key in self.ours}
        done = [self.since_s.pop(one) for one in {*self.since_s} - now]
        self.longest_s = max([self.longest_s, *(now_s - since for since in done)])
        for one in now:
            self.since_s.setdefault(one, now_s)
        most_s = max(HANGS_S, HANGS_TIMES * self.longest_s)
        hanging = sorted({worker for (worker, _), since in self.since_s.items() if now_s - since > most_s})
        self.since_s = {one: since for one, since in self.since_s.items() if one[0] not in hanging}
        return hanging


@contextlib.contextmanager
def _hanging_replaced(client: "Client", ours: Container[str]) -> Iterator[None]:
    """In this block, workers on which a piece hangs are started again, and the scheduler gives it to another."""
    ended = threading.Event()

    def look() -> None:
        hanging = Hanging(ours=ours)
        while not ended.wait(LOOKS_EVERY_S):
            with contextlib.suppress(OSError, TimeoutError, ValueError):  # none answers; or a worker without a nanny
                workers = hanging.workers(client.processing(), time.monotonic())
                if workers:
                    client.restart_workers(workers, timeout=ANSWERS_S, raise_for_error=False)

    looking = threading.Thread(target=look, name="psvideo workers", daemon=True)
    looking.start()
    try:
        yield
    finally:
        ended.set()


def called_apart(
    client: "Client",
    call: Callable[[Value], Result],
    values: Sequence[Value],
    *,
    watch: Watch = unwatched,
    what: str = "checking",
) -> Iterator[tuple[Value, Result | str]]:
    """Have a function called with each value by a worker, and give the value with the result, or with what is wrong.

    Values and results are small, and no result is a str; ``what`` is done to takes, in a word. Raises PsvideoError
    where the scheduler is gone.
    """
    from distributed import as_completed

    futures = [client.submit(_called, call, value, pure=False, retries=RETRIES) for value in values]
    value_of = {future.key: value for future, value in zip(futures, values, strict=True)}
    done = as_completed(futures, loop=client.loop, raise_errors=False)
    with _hanging_replaced(client, value_of):
        for future in watch(done, total=len(futures), what=what, unit="takes"):
            yield value_of[future.key], result_of_future(future)


def do_piece(take: Shared, number: int, *, after: str) -> str:
    """Do one piece of a take, in a worker, and return what is wrong with its footage, or nothing: another try would
    find the same. ``after`` is what was wrong with the piece that it waited for."""
    if after:
        return after
    fault = _called(take.do, number)
    return fault if isinstance(fault, str) else ""


def _called(call: Callable[[Value], Result], value: Value) -> Result | str:
    """Return what a function gives, or what PsvideoError says of the footage."""
    try:
        return call(value)
    except PsvideoError as fault:
        return str(fault)


def result_of_future(future: "Future") -> Any:
    """Return what a worker gave, or what is wrong. Raises PsvideoError where the scheduler is gone, by which the answer
    comes."""
    if future.status != "finished":
        return _fault(future)
    try:
        return future.result()
    except (OSError, CancelledError, asyncio.CancelledError):
        raise PsvideoError(GONE) from None


def _fault(future: "Future") -> str:
    if future.status in ("cancelled", "lost"):
        raise PsvideoError(GONE)
    fault = future.exception()
    return str(fault) if isinstance(fault, PsvideoError) else f"{type(fault).__name__}: {fault}"
