"""What can stop a run: signals, disks, folders, memory, readers; each is done to a process that was forked."""

import contextlib
import ctypes
import os
import resource
import shutil
import signal
import struct
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np

from psvideo.cli import ending
from psvideo.cli.app import main as psvideo

CRASHED = 70
"""The exit status where an error came out of the program."""
HANGS_S = 300.0
CAPABILITIES_V3 = 0x20080522
OVERRIDES = 0b110
"""CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH: what lets root write where nobody may (capabilities(7))."""
FILE_CALLS = "%file,read,write,pread64,pwrite64,lseek,fsync,close,getdents64"
"""What a program asks of a disk, by strace's names."""
SMALLEST_BYTES = 64
PAGE_BYTES = 4096


def nothing() -> None:
    """Do nothing."""


@dataclass(frozen=True, kw_only=True)
class Fault:
    """One fault: ``when`` names it for people. ``inside`` is called in the process before the command; ``outside``,
    with that process's number, in the one that looks on, ``after_s`` after the beginning; ``mended`` at the end.
    ``may_abort``: LLVM, which loads compiled loops, ends a process by itself where it gets no memory for them."""

    when: str
    after_s: float | None = None
    inside: Callable[[], None] = nothing
    outside: Callable[[int], None] = field(default=lambda _: None)
    mended: Callable[[], None] = nothing
    silent: bool = False
    may_abort: bool = False


@dataclass(frozen=True, kw_only=True)
class Scene:
    """What a fault may strike: the clip, the output, and what the run does when nobody stops it."""

    clip: Path
    out: Path
    length_s: float
    largest_bytes: int
    total_bytes: int
    peak_bytes: int

    @property
    def beside(self) -> Path:
        """The folder that is written before it gets its name."""
        return self.out.with_name(f".{self.out.name}.partial")


def _signalled(name: str, *numbers: int) -> Callable[[np.random.Generator, Scene], Fault]:
    def made(rng: np.random.Generator, scene: Scene) -> Fault:
        after_s, pause_s = float(rng.uniform(0, scene.length_s)), float(rng.uniform(0.0, 0.3))

        def outside(child: int) -> None:
            for place, number in enumerate(numbers):
                time.sleep(pause_s if place else 0.0)
                with contextlib.suppress(ProcessLookupError):
                    os.kill(child, number)

        silent = signal.SIGKILL in numbers or len(numbers) > 1
        return Fault(when=f"{name} after {after_s:.2f} s", after_s=after_s, outside=outside, silent=silent)

    return made


def _no_large_files(rng: np.random.Generator, scene: Scene) -> Fault:
    most_bytes = int(SMALLEST_BYTES * (scene.largest_bytes / SMALLEST_BYTES) ** rng.uniform(0, 1))

    def inside() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # writing fails instead
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, -1))

    return Fault(when=f"with files of {most_bytes} bytes at most", inside=inside)


def _small_disk(rng: np.random.Generator, scene: Scene) -> Fault:
    return small_disk(int(rng.integers(2, max(scene.total_bytes // PAGE_BYTES, 3))), scene)


def small_disk(pages: int, scene: Scene) -> Fault:
    """Put a disk of so many pages under the output; the run that goes on finds a larger one."""
    place = scene.out.parent
    size = ("mount", "-t", "tmpfs", "-o", f"size={pages * PAGE_BYTES}", "tmpfs", str(place))
    subprocess.run(size, check=True)

    def mended() -> None:
        subprocess.run(["mount", "-o", "remount,size=1g", str(place)], check=True)

    return Fault(when=f"on a disk of {pages} pages", mended=mended)


def _no_memory(rng: np.random.Generator, scene: Scene) -> Fault:
    more_bytes = int(rng.uniform(0, scene.peak_bytes))

    def inside() -> None:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        ending.LEAST_BYTES = 0  # so that memory ends in the middle
        resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + more_bytes, -1))

    return Fault(when=f"with {more_bytes >> 20} MB more memory at most", inside=inside, may_abort=True)


def _vanishing(rng: np.random.Generator, scene: Scene) -> Fault:
    after_s = float(rng.uniform(0, scene.length_s))

    def outside(_: int) -> None:
        shutil.rmtree(scene.beside, ignore_errors=True)

    return Fault(when=f"its folder removed after {after_s:.2f} s", after_s=after_s, outside=outside)


def _clip_gone(rng: np.random.Generator, scene: Scene) -> Fault:
    after_s, away = float(rng.uniform(0, scene.length_s)), scene.clip.with_name("away")

    def mended() -> None:
        if away.exists():
            away.rename(scene.clip)

    def outside(_: int) -> None:
        scene.clip.rename(away)

    return Fault(when=f"its clip gone after {after_s:.2f} s", after_s=after_s, outside=outside, mended=mended)


def _read_only(rng: np.random.Generator, scene: Scene) -> Fault:
    after_s, place = float(rng.uniform(0, scene.length_s)), scene.out.parent

    def folders() -> list[Path]:
        return [place, *(path for path in place.rglob("*") if path.is_dir())]

    def outside(_: int) -> None:
        for folder in folders():
            with contextlib.suppress(FileNotFoundError):
                folder.chmod(0o555)

    def mended() -> None:
        for folder in folders():
            folder.chmod(0o755)

    return Fault(
        when=f"its folders read-only after {after_s:.2f} s",
        after_s=after_s,
        inside=as_anybody,
        outside=outside,
        mended=mended,
    )


def as_anybody() -> None:
    """Let the permissions of files hold for this process too, where it is root's."""
    if os.getuid() != 0:
        return
    libc = ctypes.CDLL(None, use_errno=True)
    head, data = struct.pack("Ii", CAPABILITIES_V3, 0), ctypes.create_string_buffer(24)
    libc.capget(head, data)
    sets = list(struct.unpack("6I", data.raw))
    sets[0] &= ~OVERRIDES
    if libc.capset(head, struct.pack("6I", *sets)) != 0:
        raise OSError(ctypes.get_errno(), "this process cannot give up its rights")


def _nobody_reads(rng: np.random.Generator, scene: Scene) -> Fault:
    after_s = float(rng.uniform(0, scene.length_s))
    return Fault(when=f"nobody reads after {after_s:.2f} s", after_s=after_s, silent=True)


def _clock_jumps(rng: np.random.Generator, scene: Scene) -> Fault:
    jump_s = float(rng.choice([-1e9, -3600.0, 3600.0, 1e9]))
    at_s = time.monotonic() + float(rng.uniform(0, scene.length_s))

    def inside() -> None:
        true_time = time.time
        time.time = lambda: true_time() + (jump_s if time.monotonic() > at_s else 0.0)

    return Fault(when=f"the clock {jump_s:+g} s", inside=inside)


def _slow_disk(rng: np.random.Generator, scene: Scene) -> Fault:
    later_us = int(rng.uniform(500, 10_000))
    tracing: list[subprocess.Popen[bytes]] = []

    def outside(child: int) -> None:
        injected = f"inject={FILE_CALLS}:delay_exit={later_us}"
        call = ["strace", "-f", "-qq", "-o", os.devnull, "-p", str(child), "-e", f"trace={FILE_CALLS}", "-e", injected]
        tracing.append(subprocess.Popen(call))

    def mended() -> None:
        for one in tracing:  # it ends with what it traces
            one.wait(HANGS_S)

    return Fault(when=f"on a disk slower by {later_us} us a call", after_s=0.0, outside=outside, mended=mended)


FAULTS: dict[str, Callable[[np.random.Generator, Scene], Fault]] = {
    "killed": _signalled("killed", signal.SIGKILL),
    "SIGTERM": _signalled("SIGTERM", signal.SIGTERM),
    "SIGHUP": _signalled("SIGHUP", signal.SIGHUP),
    "Ctrl-C": _signalled("Ctrl-C", signal.SIGINT),
    "Ctrl-C twice": _signalled("Ctrl-C twice", signal.SIGINT, signal.SIGINT),
    "large files fail": _no_large_files,
    "disk full": _small_disk,
    "no memory": _no_memory,
    "output vanishes": _vanishing,
    "clip vanishes": _clip_gone,
    "read-only": _read_only,
    "pipe closed": _nobody_reads,
    "clock jumps": _clock_jumps,
    "slow disk": _slow_disk,
}
"""By name, what makes one at a random moment or of a random size."""


def forked(words: Sequence[str], fault: Fault | None = None) -> tuple[int, str]:
    """Run a command in a fork of this process while a fault happens; return its exit status, negative for a signal, and
    what it said."""
    fault = fault or Fault(when="")
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        _end_with(words, writing, fault)
    os.close(writing)
    heard: list[bytes] = []
    listening = threading.Thread(target=lambda: heard.extend(_heard(reading, fault)))
    listening.start()
    if fault.after_s is not None:
        time.sleep(fault.after_s)
        fault.outside(child)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    listening.join()
    fault.mended()
    return status, b"".join(heard).decode()


def _heard(reading: int, fault: Fault) -> Iterator[bytes]:
    """Give what a process says; nobody listens any more after the moment of a fault that is nobody's reading."""
    until_s = time.monotonic() + fault.after_s if fault.when.startswith("nobody") and fault.after_s else None
    while part := (b"" if until_s is not None and time.monotonic() > until_s else os.read(reading, 1 << 12)):
        yield part
    os.close(reading)


def _end_with(words: Sequence[str], writing: int, fault: Fault) -> NoReturn:
    """Run a command and end this process, whatever comes: nothing of the process that was forked may go on here."""
    status = CRASHED
    try:
        os.dup2(writing, 2)
        os.close(writing)
        sys.stdout = sys.stderr = os.fdopen(2, "w", buffering=1)
        for number in ending.ENDING:  # what comes before the program listens, or after its end, strikes nothing
            signal.signal(number, lambda *_: None)
        fault.inside()
        status = psvideo([*words, *(("-v",) if fault.when.startswith("nobody") else ("-q",))])
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(OSError):
            sys.stderr.flush()
        os._exit(status)
