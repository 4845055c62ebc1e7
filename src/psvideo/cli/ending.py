"""How commands end early: by a signal, a closed pipe, or a machine without memory or disk space."""

import contextlib
import errno
import io
import logging
import os
import signal
import sys
import threading
from collections.abc import Iterator
from importlib import import_module
from types import FrameType

from psvideo.cli.spelling import spelled
from psvideo.compute.side_threads import still_at_work
from psvideo.errors import PsvideoError

if sys.platform != "win32":
    import resource

ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Ctrl-C; what systems and farms send to end a program; a terminal that is closed."""
LATER_S = 0.01
"""A stop that Python dropped is raised again after this long: not where it was dropped, and not felt."""
NO_MEMORY = (
    "there is not enough memory{said}. Nothing half-made was left under a final name. Close other programs, compute "
    "with fewer threads (PSVIDEO_THREADS=1), or take a machine with more memory; split and normals go on with `resume`."
)
UNMAPPED = ("failed to map segment", "Cannot allocate memory", "can't start new thread", "libllvmlite")
"""What loaders and systems say where an address space is full, in errors of many kinds."""
STDERR = 2
"""Its number; written to directly where there is no memory for more."""
LEAVES_S = 0.3
"""Threads that are at work when a command is over are waited for this long: what only has to be noticed takes less."""
LEAST_BYTES = 1200 << 20
"""Addresses that a run's libraries take before its first picture (measured: 1,000 MB), with room for small ones."""


@contextlib.contextmanager
def stoppable(*, stops: int = 1) -> Iterator[None]:
    """In this block, what asks a program to end stops it as Ctrl-C does: what it writes is closed, lights become dark.
    One more such signal than ``stops`` ends it at once, which costs no more than a kill. Signals that are ignored stay
    so (nohup).

    Python drops what is raised while it clears something away, or is called back by C (a compiler that keeps what it
    made); a stop that fell there is asked for again, and what goes wrong for its sake until then is the stop.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    heard = _Heard(stops)
    before = {number: signal.getsignal(number) for number in ENDING}
    obeyed = [number for number, handler in before.items() if handler not in (signal.SIG_IGN, None)]
    sys.unraisablehook = heard.dropped
    for number in obeyed:
        signal.signal(number, heard.stop)
    try:
        yield
    except Exception as fault:
        if heard.pending:
            raise KeyboardInterrupt from fault
        raise
    finally:
        heard.is_over = True
        for timer in heard.later:  # one that goes off meanwhile would end the process after its command, in no order
            timer.cancel()
            timer.join()
        for number in obeyed:
            signal.signal(number, before[number])
        sys.unraisablehook = heard.say_dropped


class _Heard:
    """The stops that were heard, of ``left`` that stop; those that Python dropped are to be raised ``later``, and
    ``pending`` until then."""

    def __init__(self, stops: int) -> None:
        self.left, self.pending = stops, False
        self.is_dropping, self.is_over = False, False
        self.later: list[threading.Timer] = []
        self.say_dropped = sys.unraisablehook

    def stop(self, number: int, frame: FrameType | None) -> None:
        """Stop the command while any stop is left, end the process afterwards."""
        if self.is_over:
            return
        if self.is_dropping:
            self._stop_later(number)
            return
        if not self.left:
            os._exit(PsvideoError.exit_status)
        self.left, self.pending = self.left - 1, False
        raise KeyboardInterrupt(number)

    def dropped(self, what: "sys.UnraisableHookArgs") -> None:
        """Ask again for a stop that Python dropped; say what else it dropped as it would have."""
        if not (isinstance(what.exc_value, KeyboardInterrupt) and what.exc_value.args):
            self.say_dropped(what)
            return
        self.left, self.pending, self.is_dropping = self.left + 1, True, True
        self._stop_later(*what.exc_value.args)
        self.is_dropping = False

    def _stop_later(self, number: int) -> None:
        again = threading.Timer(LATER_S, signal.raise_signal, (number,))
        again.start()
        self.later.append(again)


class _Starved(logging.Handler):
    """Ends the process with a sentence where a pool's thread got no memory outside of its job: whoever waits for that
    job would wait without end. Nothing is lost that a kill would not lose."""

    def emit(self, record: logging.LogRecord) -> None:
        if record.exc_info and isinstance(record.exc_info[1], MemoryError):
            os.write(STDERR, b"psvideo: " + spelled(NO_MEMORY.format(said="")).encode() + b"\n")
            os._exit(PsvideoError.exit_status)
        if logging.lastResort is not None:
            logging.lastResort.handle(record)


@contextlib.contextmanager
def starving_said() -> Iterator[None]:
    """In this block, a thread of a pool that gets no memory ends the process with a sentence."""
    handler, pools = _Starved(), logging.getLogger("concurrent.futures")
    pools.addHandler(handler)
    try:
        yield
    finally:
        pools.removeHandler(handler)


def check_addresses() -> None:
    """Raise PsvideoError where a process may use too few addresses; load what would wait for more without end later.

    OpenBLAS, which SciPy loads, asks for its buffers again and again until it gets them.
    """
    if sys.platform == "win32":
        return
    most_bytes = resource.getrlimit(resource.RLIMIT_AS)[0]
    if most_bytes == resource.RLIM_INFINITY:
        return
    if most_bytes < LEAST_BYTES:
        raise PsvideoError(
            f"this process may use {most_bytes >> 20} MB of addresses (ulimit -v), and psvideo needs "
            f"{LEAST_BYTES >> 20} MB at least, most of which are never filled. Nothing was written. Set a higher "
            "limit, or one on memory in use (a cgroup's), then run the command again."
        )
    import_module("scipy.linalg")


def leave_threads(status: int) -> None:
    """End the process at once where a thread is still at work beside it: the interpreter's own end would wait for the
    compiler, whose lock that thread holds, and could crash in others."""
    if still_at_work(LEAVES_S):
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError, ValueError):
                stream.flush()
        os._exit(status)


def say_any_name() -> None:
    """Let names of files be printed that are no text, with their bytes as numbers."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def paragraph_on(fault: BaseException) -> str | None:
    """Return what is to be said of a fault of the machine, empty where nobody is there to read it; None for others."""
    if isinstance(fault, OSError) and fault.errno == errno.EPIPE:
        return ""
    if isinstance(fault, MemoryError) or any(word in str(fault) for word in UNMAPPED):
        return NO_MEMORY.format(said=f" ({fault})" if str(fault) else "")
    if isinstance(fault, OSError):
        where = f"{fault.filename}: " if fault.filename is not None else ""
        return (
            f"{where}cannot be read or written ({fault.strerror or fault}). Check the file, its folder and its disk, "
            "then run the command again."
        )
    return None


def nobody_reads() -> None:
    """Send what is still to be printed nowhere, so that the interpreter does not complain at its end."""
    with contextlib.suppress(OSError, ValueError, io.UnsupportedOperation):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
