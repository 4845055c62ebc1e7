"""A dask cluster, on this computer or on others: named, checked, and connected to."""

import contextlib
import logging
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from psvideo.compute.threads import THREADS, thread_count
from psvideo.errors import PsvideoError, UsageError

if TYPE_CHECKING:
    from distributed import Client, LocalCluster

EXTRA = (
    "`workers` and `scheduler` need dask, an extra: python -m pip install 'psvideo[dask]'. Without it one process "
    "solves everything, with all cores."
)
SILENT_S = 60
"""A worker that is not heard of for this long is started again, and its work is given to another."""
SETTINGS = {"distributed.nanny.pre-spawn-environ": {}, "distributed.scheduler.worker-ttl": f"{SILENT_S}s"}
"""dask's own environment for workers sets MALLOC_TRIM_THRESHOLD_, which halves the speed of numpy."""
ADDRESS = re.compile(r"([a-z]+://)?[^/]+:\d+/?|inproc://.+|[a-z]+://.+:\d+/.*")
"""What a scheduler's address looks like: a host and its port, behind a protocol or not."""
ANSWERS_S = 10
"""Within this a scheduler answers."""
LOGGERS = ("distributed", "tornado", "tornado.application", "asyncio")


@dataclass(frozen=True, kw_only=True)
class Cluster:
    """Where work goes: to this many processes here, or to the workers of the scheduler at an address."""

    workers: int | None = None
    scheduler: str | None = None

    @property
    def named(self) -> bool:
        """Whether work is to be shared out at all."""
        return self.workers is not None or self.scheduler is not None

    def check(self) -> None:
        """Raise UsageError where the extra is not installed, or both or neither are named."""
        if (self.workers is None) == (self.scheduler is None):
            raise UsageError("`workers` starts processes here and `scheduler` uses others': expected one of the two.")
        if self.workers is not None and self.workers < 1:
            raise UsageError(f"`workers` {self.workers}: expected how many processes to start, 1 or more.")
        if self.scheduler is not None and not ADDRESS.fullmatch(self.scheduler):
            raise UsageError(
                f"`scheduler` {self.scheduler}: expected its address as it says it itself, such as tcp://192.0.2.7:8786."
            )
        require_dask()


def require_dask() -> None:
    """Raise UsageError where dask is not installed."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise UsageError(EXTRA) from None


@contextlib.contextmanager
def connected(cluster: Cluster) -> "Iterator[Client]":
    """Give a client of the cluster, which is ended with the block where it was started here.

    Raises PsvideoError where no scheduler answers, or no workers can be started here.
    """
    import dask
    from distributed import Client

    if cluster.scheduler is not None:
        with _unlogged(), _joined(cluster.scheduler) as client:
            yield client
        return
    with (
        _unlogged(),
        dask.config.set(SETTINGS),
        _started(cluster.workers or 1) as local,
        Client(local, set_as_default=False) as client,
    ):
        yield client


def _started(count: int) -> "LocalCluster":
    """Return so many workers, each a process here; raises PsvideoError where they die twice before they answer."""
    with contextlib.suppress(RuntimeError):
        return _local(count)
    try:
        return _local(count)
    except RuntimeError as fault:
        raise PsvideoError(
            f"`workers` {count}: the processes end as soon as they are started ({fault}). Perhaps memory or processes "
            "run out: start fewer, or leave `workers` out. What was solved before is kept for `resume`."
        ) from fault


def _local(count: int) -> "LocalCluster":
    from distributed import LocalCluster

    return LocalCluster(
        n_workers=count,
        threads_per_worker=1,
        memory_limit=0,
        dashboard_address="127.0.0.1:0",  # else a port that others may have
        env={THREADS: str(max(thread_count() // count, 1))},
        silence_logs=50,
    )


def _joined(address: str) -> "Client":
    """Return a client of the scheduler at an address; raises PsvideoError where none answers."""
    from distributed import Client

    try:
        return Client(address, timeout=ANSWERS_S, set_as_default=False)
    except (OSError, ValueError) as fault:
        raise PsvideoError(
            f"{address}: no scheduler answers there ({fault}). Start one with: dask scheduler, and on each computer: "
            "dask worker tcp://HOST:8786; all need psvideo, and the same paths."
        ) from fault


@contextlib.contextmanager
def _unlogged() -> Iterator[None]:
    """In this block, keep what dask logs of a lost scheduler or worker from the terminal: it is said in a sentence."""
    with contextlib.ExitStack() as stack:
        for name in LOGGERS:
            logger = logging.getLogger(name)
            logger.addFilter(_nothing)
            stack.callback(logger.removeFilter, _nothing)
            for handler in logger.handlers:
                handler.addFilter(_nothing)
                stack.callback(handler.removeFilter, _nothing)
        yield


def _nothing(_: logging.LogRecord) -> bool:
    return False
