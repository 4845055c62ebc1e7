"""Runs shared by two dask workers, of which a random process is killed at a random moment: are the files the same?

The command alone, one of its workers or their keepers, or all of them at once. What the command does not end by itself,
``--resume`` ends. Nothing may be left beside the output, and no process either. ``python -m bench.killed_workers
--moments 30`` tries it so often.
"""

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import psutil

from bench.killed import digest, filmed

WHOM = ("the command", "a worker", "all at once")
MOMENTS = 10
ENDS_S = 300.0
"""A run that lasts longer hangs."""
GONE_S = 30.0
"""Workers whose command is no more end by themselves within so long."""


class Survival(NamedTuple):
    """Who was killed: how often, and what was wrong afterwards."""

    killed: str
    times: int
    ended_by_itself: int
    same_bytes: int
    faults: str


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One kill: whether the command still ended by itself, and what was wrong."""

    whom: str
    ended_by_itself: bool
    faults: tuple[str, ...]


def trials(folder: Path, *, moments: int, seed: int) -> Iterator[Trial]:
    """Film a clip, solve it alone and with two workers, then kill someone so often."""
    clip = filmed(folder)
    command = [sys.executable, "-m", "psvideo.cli.app", "normals", str(clip), "--no-preview", "-q"]
    command += ["--rig", str(clip / "rig.toml"), "-o"]
    subprocess.run([*command, str(folder / "alone" / "clip")], check=True)
    began_s = time.monotonic()
    subprocess.run([*command, str(folder / "shared" / "clip"), "--workers", "2"], check=True)
    length_s, whole = time.monotonic() - began_s, digest(folder / "alone" / "clip")
    if digest(folder / "shared" / "clip") != whole:
        raise RuntimeError("a run shared by workers that nobody kills gives other bytes")
    rng = np.random.default_rng(seed)
    for number in range(moments):
        out = folder / f"place{number}" / "clip"
        yield _killed([*command, str(out), "--workers", "2"], out, whole, WHOM[number % len(WHOM)], length_s, rng)


def _killed(
    command: list[str], out: Path, whole: dict[str, str], whom: str, length_s: float, rng: np.random.Generator
) -> Trial:
    """Run a command, kill someone at a random moment, go on, and return what was wrong."""
    moment_s = length_s * float(rng.random())
    when = f"{whom} killed after {moment_s:.2f} of {length_s:.1f} s"
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    time.sleep(moment_s)
    processes = _alive([psutil.Process(running.pid)])
    family = processes + [one for parent in processes for one in parent.children(recursive=True)]
    _kill(running, [one for one in family[1:] if _works(one)], whom, rng)
    wrong = []
    try:
        _, said = running.communicate(timeout=ENDS_S)
    except subprocess.TimeoutExpired:
        os.killpg(running.pid, signal.SIGKILL)
        _, said = running.communicate()
        wrong.append(f"{when}: hangs")
    if "Traceback" in said:
        wrong.append(f"{when}: {said[-2000:]}")
    if left := _alive(psutil.wait_procs(family, timeout=GONE_S)[1]):
        wrong.append(f"{when}: {len(left)} processes go on")
    by_itself = running.returncode == 0
    if not by_itself and (again := subprocess.run([*command, "--resume"], capture_output=True, text=True)).returncode:
        wrong.append(f"{when}: --resume ends with {again.returncode}: {again.stderr[-2000:]}")
    if not out.exists() or digest(out) != whole:
        wrong.append(f"{when}: other bytes")
    if beside := [path.name for path in out.parent.iterdir() if path != out]:
        wrong.append(f"{when}: {', '.join(beside)} is left in the end")
    return Trial(whom=whom, ended_by_itself=by_itself, faults=tuple(wrong))


def _kill(running: subprocess.Popen[str], children: list[psutil.Process], whom: str, rng: np.random.Generator) -> None:
    """Kill the command, one of its children, or all of them; who is gone already is let be."""
    if running.poll() is not None:
        return
    if whom == "all at once":
        os.killpg(running.pid, signal.SIGKILL)
    elif whom == "the command":
        running.kill()
    elif children:
        children[int(rng.integers(len(children)))].kill()


def _works(process: psutil.Process) -> bool:
    """Return whether a process is a worker, and not one that Python keeps beside them to tidy up."""
    with contextlib.suppress(psutil.NoSuchProcess):
        return any("spawn_main" in word for word in process.cmdline())
    return False


def _alive(processes: list[psutil.Process]) -> list[psutil.Process]:
    return [one for one in processes if one.is_running() and one.status() != psutil.STATUS_ZOMBIE]


def survivals(moments: int, *, seed: int = 1) -> Iterator[Survival]:
    """Kill so often, and return a row for each kind of process."""
    with tempfile.TemporaryDirectory() as place:
        found = list(trials(Path(place), moments=moments, seed=seed))
    for whom in WHOM:
        its = [one for one in found if one.whom == whom]
        yield Survival(
            killed=whom,
            times=len(its),
            ended_by_itself=sum(one.ended_by_itself for one in its),
            same_bytes=sum(not one.faults for one in its),
            faults="; ".join(fault for one in its for fault in one.faults),
        )


def rows() -> Iterator[Survival]:
    """Kill as often as the table does."""
    yield from survivals(MOMENTS)


def main() -> int:
    """Kill as often as is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--moments", type=int, default=MOMENTS)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    found = list(survivals(asked.moments, seed=asked.seed))
    for one in found:
        print(
            f"{one.killed}: {one.times} times, ended by itself {one.ended_by_itself}, same bytes {one.same_bytes}. "
            f"{one.faults}",
            flush=True,
        )
    return int(any(one.faults for one in found))


if __name__ == "__main__":
    sys.exit(main())
