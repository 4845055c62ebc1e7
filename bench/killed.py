"""Runs that are killed at random moments, or find the disk full, and go on by ``--resume``: are the files the same?

A warm process forks one for every run, so that a moment costs a run and no more. After a kill no folder that is not
whole may lie under its final name; after the next run nothing else may be left. A full disk is one on which no file can
grow beyond a random size: the run ends with one paragraph. ``python -m bench.killed --moments 100`` tries so many.
"""

import argparse
import hashlib
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Literal, NamedTuple, NoReturn, get_args

import numpy as np

from psvideo.cli.app import main as psvideo
from psvideo.synth.shoot import shoot

SCENE = """
schema = "psvideo-scene/1"
name = "killed"
frames = 36
camera = { width_px = 96, height_px = 64, fps = 100, shutter_deg = 360, readout_s = 0.0097, width_m = 1.0 }
ambient = { level = 0.02 }
object = [{ mesh = "sphere", motion = { velocity_m_per_s = [0.2, 0.0, 0.0] } }]
light = [
  { name = "a", direction = [0.5, 0.0, 0.8] },
  { name = "b", direction = [-0.5, 0.1, 0.8] },
  { name = "c", direction = [0.1, 0.5, 0.8] },
]
"""
ALL = (
    "--aov",
    "depth",
    "--aov",
    "error",
    "--aov",
    "alpha",
    "--mesh",
    "ply",
    "--encode",
    "png16",
    "--preview",
    "beauty",
)
COMMANDS: dict[str, tuple[str, ...]] = {
    "split": ("split", "{clip}", "--flashes", "--beauty"),
    "normals": ("normals", "{clip}", "--rig", "{clip}/rig.toml", "--plates"),
    "normals, all": ("normals", "{clip}", "--rig", "{clip}/rig.toml", "--multipart", *ALL),
}
PER_RUN = ("report.json", "report.html")
"""They hold the command, and with it the output's name and --resume."""
MOMENTS = 40
CRASHED = 70
"""The exit status where an error came out of the program."""
How = Literal["killed", "disk full"]


class Survival(NamedTuple):
    """One command: how often it was stopped, and what was wrong afterwards."""

    command: str
    how: How
    stopped: int
    ended_before: int
    same_bytes: int
    faults: str


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One stop: whether the run was still going, and what was wrong."""

    was_stopped: bool
    faults: tuple[str, ...]


def forked(words: Sequence[str], *, kill_after_s: float | None = None, most_bytes: int = -1) -> tuple[int, str]:
    """Run a command in a fork of this process; return its exit status, negative for a signal, and what it said.

    It is killed after ``kill_after_s``, or cannot write files longer than ``most_bytes``.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(writing, 2)
        sys.stdout = sys.stderr = os.fdopen(2, "w", buffering=1)
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # writing fails instead
        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, -1))
        _end_with(words)
    os.close(writing)
    if kill_after_s is not None:
        time.sleep(kill_after_s)
        os.kill(child, signal.SIGKILL)
    with os.fdopen(reading, "rb") as said:
        text = said.read().decode()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), text


def _end_with(words: Sequence[str]) -> NoReturn:
    """Run a command and end this process, whatever comes: nothing of the process that was forked may go on here."""
    status = CRASHED
    try:
        status = psvideo([*words, "-q"])
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(status)


def digest(out: Path) -> dict[str, str]:
    """Return a checksum of every file of a run but what depends on its name."""
    files = [path for path in sorted(out.rglob("*")) if path.is_file() and path.name not in PER_RUN]
    return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def trials(name: str, folder: Path, *, how: How, moments: int, seed: int) -> Iterator[Trial]:
    """Stop a command at so many random moments of its length, or sizes of a file, and go on with it each time."""
    words = [word.format(clip=folder / "clip") for word in COMMANDS[name]]
    rng = np.random.default_rng(seed)
    for once in ("compiled", "whole"):
        began_s = time.monotonic()
        status, said = forked([*words, "-o", str(folder / once / "out")])
        if status != 0:
            raise RuntimeError(f"{name}: the run that nobody stops fails: {said}")
    length_s, whole = time.monotonic() - began_s, digest(folder / "whole" / "out")
    largest = max(path.stat().st_size for path in (folder / "whole" / "out").rglob("*"))
    for number in range(moments):
        out = folder / f"place{number}" / "out"
        out.parent.mkdir()
        command = [*words, "-o", str(out)]
        if how == "killed":
            after_s = float(rng.uniform(0, length_s))
            stopped = forked(command, kill_after_s=after_s)[0] == -signal.SIGKILL
            faults, when = [], f"killed after {after_s:.2f} s"
        else:
            most_bytes = int(largest ** rng.uniform(0, 1))
            status, said = forked(command, most_bytes=most_bytes)
            stopped, when = status != 0, f"with files of {most_bytes} bytes at most"
            faults = (
                [] if status in (0, 1) and "Traceback" not in said else [f"{when}, ends with {status}: {said[-300:]}"]
            )
        yield Trial(was_stopped=stopped, faults=(*faults, *_afterwards(command, out, whole, when)))


def _afterwards(command: Sequence[str], out: Path, whole: dict[str, str], when: str) -> Iterator[str]:
    """Go on with a run that was stopped, and give what is wrong."""
    if out.exists() and digest(out) != whole:
        yield f"{when}, a folder that is not whole lies under its final name"
    status, said = forked([*command, "--resume"])
    if status != 0:
        yield f"{when}, --resume ends with {status}: {said[-300:]}"
    elif digest(out) != whole:
        yield f"{when}, --resume gives other bytes"
    if left := [path.name for path in out.parent.iterdir() if path != out]:
        yield f"{when} and resumed, {', '.join(left)} is left"


def filmed(folder: Path) -> None:
    """Film the clip that all runs work on, and make everything compile that they need."""
    (folder / "killed.toml").write_text(SCENE, encoding="utf-8")
    shoot(folder / "killed.toml", folder / "clip")


def survivals(moments: int, *, seed: int = 1) -> Iterator[Survival]:
    """Stop every command so often in either way."""
    for name, how in product(COMMANDS, get_args(How)):
        with tempfile.TemporaryDirectory() as place:
            filmed(Path(place))
            found = list(trials(name, Path(place), how=how, moments=moments, seed=seed))
        stopped = sum(one.was_stopped for one in found)
        yield Survival(
            command=name,
            how=how,
            stopped=stopped,
            ended_before=len(found) - stopped,
            same_bytes=sum(not one.faults for one in found),
            faults="; ".join(fault for one in found for fault in one.faults),
        )


def rows() -> Iterator[Survival]:
    """Stop every command at so many moments."""
    yield from survivals(MOMENTS)


def main() -> int:
    """Stop every command at as many moments as are asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--moments", type=int, default=MOMENTS)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    wrong = False
    for one in survivals(asked.moments, seed=asked.seed):
        wrong = wrong or bool(one.faults)
        print(
            f"{one.command}, {one.how}: stopped {one.stopped}, ended before {one.ended_before}, same bytes "
            f"{one.same_bytes}. {one.faults}",
            flush=True,
        )
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
