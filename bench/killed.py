"""Runs that something stops at a random moment, and that go on by ``--resume``: are the files the same?

A warm process forks one for every run, so that a moment costs a run and no more. Whatever happens, no folder that is
not whole may lie under its final name, and a run that can still speak ends with one paragraph; after the next run
nothing else may be left. ``python -m bench.killed --moments 100`` tries every fault so often on every command.
"""

import argparse
import hashlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench.faults import FAULTS, HANGS_S, PAGE_BYTES, Fault, Scene, forked, small_disk
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
    "sync": ("sync", "{clip}"),
    "split": ("split", "{clip}", "--flashes", "--beauty"),
    "normals": ("normals", "{clip}", "--rig", "{clip}/rig.toml", "--plates"),
    "normals, all": ("normals", "{clip}", "--rig", "{clip}/rig.toml", "--multipart", *ALL),
    "page": ("view", "{clip}/../results", "--export"),
}
"""What is stopped; ``-o`` and the output follow, and of a page the output alone."""
AGAIN = {"sync": "--force", "page": "--force"}
"""How commands that write one file go on; the others by --resume."""
NOT_TRIED = {("page", "clip vanishes")}
"""A page shows the clip beside results where it is there; without it it is another page."""
PER_RUN = ("report.json", "report.html")
"""They hold the command, and with it the output's name and --resume."""
EVERY_PAGE = "disk full at every page"
"""Disks of every size in turn, so that each page that is written is once the one for which there is no room."""
MOMENTS = 10


class Survival(NamedTuple):
    """One command: how often it was stopped, and what was wrong afterwards."""

    command: str
    how: str
    stopped: int
    ended_before: int
    same_bytes: int
    faults: str


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One stop: whether the run was still going, and what was wrong."""

    was_stopped: bool
    faults: tuple[str, ...]


def digest(out: Path) -> dict[str, str]:
    """Return a checksum of every file of a run but what depends on its name."""
    if out.is_file():
        return {"": hashlib.sha256(out.read_bytes()).hexdigest()}
    files = [path for path in sorted(out.rglob("*")) if path.is_file() and path.name not in PER_RUN]
    return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def trials(name: str, clip: Path, folder: Path, *, how: str, moments: int, seed: int) -> Iterator[Trial]:
    """Stop a command at so many random moments of its length, or in so many random ways, and go on with it.

    ``how`` is one of FAULTS, or EVERY_PAGE, which is tried as often as the output has pages, whatever ``moments``.
    """
    words = [word.format(clip=clip) for word in COMMANDS[name]]
    results = clip.with_name("results")
    if name == "page" and not results.exists():
        forked([*(word.format(clip=clip) for word in COMMANDS["normals"]), "-o", str(results)])
    rng = np.random.default_rng(seed)
    for once in ("compiled", "whole"):
        began_s = time.monotonic()
        status, said = forked(_into(name, words, folder / once / "out"))
        if status != 0:
            raise RuntimeError(f"{name}: the run that nobody stops fails: {said}")
    length_s, whole = time.monotonic() - began_s, digest(folder / "whole" / "out")
    sizes = [path.stat().st_size for path in (folder / "whole").rglob("*")]
    if how == EVERY_PAGE:
        moments = sum(-(-size // PAGE_BYTES) for size in sizes)
    for number in range(moments):
        out = folder / f"place{number}" / "out"
        out.parent.mkdir()
        scene = Scene(
            clip=clip,
            out=out,
            length_s=length_s,
            largest_bytes=max(sizes),
            total_bytes=sum(sizes),
            peak_bytes=resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss << 10,
        )
        fault = small_disk(1 + number, scene) if how == EVERY_PAGE else FAULTS[how](rng, scene)
        try:
            yield _stopped(_into(name, words, out), out, whole, fault, AGAIN.get(name, "--resume"))
        finally:
            if out.parent.is_mount():
                subprocess.run(["umount", str(out.parent)], check=True)


def _into(name: str, words: Sequence[str], out: Path) -> list[str]:
    return [*words, str(out)] if name == "page" else [*words, "-o", str(out)]


def _stopped(command: Sequence[str], out: Path, whole: dict[str, str], fault: Fault, again: str) -> Trial:
    """Run a command into a fault, go on with it, and return what was wrong."""
    began_s = time.monotonic()
    status, said = forked(command, fault)
    wrong = []
    if time.monotonic() - began_s > HANGS_S:
        wrong.append("hangs")
    ends = (0, 1, -signal.SIGABRT) if fault.may_abort else (0, 1)
    if "Traceback" in said or (status not in ends and not fault.silent):
        wrong.append(f"ends with {status}: {said[-4000:]}")
    elif status == 1 and not said.strip() and not fault.silent:
        wrong.append("ends without a word")
    if out.exists() and digest(out) != whole:
        wrong.append("what is not whole lies under its final name")
    was_stopped = not out.exists()
    status, said = forked([*command, *([] if was_stopped and again == "--force" else [again])])
    if status != 0:
        wrong.append(f"{again} ends with {status}: {said[-4000:]}")
    elif digest(out) != whole:
        wrong.append(f"{again} gives other bytes")
    if left := [path.name for path in out.parent.iterdir() if path != out]:
        wrong.append(f"{', '.join(left)} is left in the end")
    return Trial(was_stopped=was_stopped, faults=tuple(f"{fault.when}: {one}" for one in wrong))


def filmed(folder: Path) -> Path:
    """Film the clip that all runs work on."""
    (folder / "killed.toml").write_text(SCENE, encoding="utf-8")
    return shoot(folder / "killed.toml", folder / "clip").path


def survivals(
    moments: int, *, seed: int = 1, commands: Sequence[str] = (*COMMANDS,), hows: Sequence[str] = (*FAULTS,)
) -> Iterator[Survival]:
    """Stop every command so often in every way."""
    with tempfile.TemporaryDirectory() as place:
        clip = filmed(Path(place))
        for name, how in product(commands, hows):
            if (name, how) in NOT_TRIED:
                continue
            folder = Path(place) / "trials"
            found = list(trials(name, clip, folder, how=how, moments=moments, seed=seed))
            shutil.rmtree(folder)
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
    parser.add_argument("--command", choices=COMMANDS, action="append")
    parser.add_argument("--fault", choices=[*FAULTS, EVERY_PAGE], action="append")
    asked = parser.parse_args()
    wrong = False
    for one in survivals(
        asked.moments, seed=asked.seed, commands=asked.command or [*COMMANDS], hows=asked.fault or [*FAULTS]
    ):
        wrong = wrong or bool(one.faults)
        print(
            f"{one.command}, {one.how}: stopped {one.stopped}, ended before {one.ended_before}, same bytes "
            f"{one.same_bytes}. {one.faults}",
            flush=True,
        )
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
