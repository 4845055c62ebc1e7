"""A whole `normals` run at 1080p: what each further frame costs, beside its files alone.

``python -m bench.whole_run [WORDS ...] [--against FOLDER] [--cache FOLDER] [--turns N]``: words choose rows ("tiff",
"3", "moving"; one of several words of a kind), FOLDER is a checkout of an earlier state, which is run in the same
turns. A row takes minutes. Figures are differences between a long and a short run of whole processes, over the frames
between them: starting up, compiling and the report do not count. Processor seconds are the user's and the system's
together, the least of so many turns.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, get_args

import numpy as np

from bench.table import table
from bench.whole_run_clips import COLS, ROWS, ClipOf, Kind, filmed

SHORT_ROUNDS = 2
FURTHER_FRAMES = 40
"""A long clip has about so many frames more than a short one, in whole rounds."""
TURNS = 4
"""With two, the same state gave 33 and 51 ms beyond its files, minutes apart."""
LIGHTS = (3, 4, 8)
HERE = Path(__file__).resolve().parents[1]
Job = tuple[Path, list[object], list[object]]
"""A checkout whose package is used, and what Python is called with for a short and for a long run."""
CACHE = Path(tempfile.gettempdir()) / "psvideo-bench-clips"

DECODE = """
import sys
from pathlib import Path
from psvideo.clip import open_clip, read_frames
clip = open_clip(Path(sys.argv[1]))
print(sum(1 for _ in read_frames(clip, clip.numbers[: int(sys.argv[2])])))
"""
ENCODE = """
import sys
from fractions import Fraction
from functools import partial
from pathlib import Path
import OpenEXR
from psvideo.formats.exr_files import write_exr
from psvideo.compute.threads import writing
sample, out, count = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
planes = {}
for name in ("normals", "albedo", "valid"):
    file = next((sample / name).iterdir())
    planes[name] = {key: c.pixels for key, c in OpenEXR.File(str(file), separate_channels=True).channels().items()}
with writing() as write:
    for number in range(count):
        for name, channels in planes.items():
            write(partial(write_exr, out / f"{name}.{number}.exr", channels, fps=Fraction(30)))
"""


class Cost(NamedTuple):
    """What a process took: processor seconds, wall seconds, and its most memory in MB."""

    processor_s: float
    wall_s: float
    peak_mb: float


class Whole(NamedTuple):
    """One clip and one state of the program; processor and wall times are in milliseconds per further frame."""

    clip: str
    state: str
    normals: str
    decoding: str
    encoding: str
    beyond_both: str
    in_copies: str
    wall_over_larger: str
    peak_memory: str


@dataclass(frozen=True, kw_only=True)
class Further:
    """A short and a long run: each further frame's processor and wall time in seconds, and the long one's peak."""

    processor_s: float
    wall_s: float
    peak_mb: float

    def __str__(self) -> str:
        return f"{1e3 * self.processor_s:.0f} / {1e3 * self.wall_s:.0f}"


def rows(
    words: Sequence[str] = (), *, against: Path | None = None, cache: Path = CACHE, turns: int = TURNS
) -> Iterator[Whole]:
    """Measure the clips that words choose, all where there are none; ``against`` as in the module's sentence."""
    for lights in LIGHTS:
        for kind in get_args(Kind):
            for moving in (False, True):
                clip = ClipOf(kind=kind, lights=lights, moving=moving)
                if chosen(clip, words):
                    yield from _rows_of(clip, against, cache, turns)


def chosen(clip: ClipOf, words: Sequence[str]) -> bool:
    """Tell whether a clip is meant: of the words for kinds, lights and motion that are given, one of each fits."""
    of_a_kind = (get_args(Kind), tuple(map(str, LIGHTS)), ("still", "moving"))
    named = clip.name.split()
    return all(own in words or not set(every) & set(words) for own, every in zip(named, of_a_kind, strict=True))


def _rows_of(clip: ClipOf, against: Path | None, cache: Path, turns: int) -> Iterator[Whole]:
    rounds = round(FURTHER_FRAMES * clip.plan.camera.frame_period_s / clip.plan.cycle_s)
    short, long = (clip.frames_of(count) for count in (SHORT_ROUNDS, SHORT_ROUNDS + rounds))
    path, rig = filmed(clip, cache, frames=long)
    states = {"before": against, "now": HERE} if against else {"now": HERE}
    with tempfile.TemporaryDirectory(prefix="psvideo-bench-", dir=cache) as folder:
        spare = Path(folder)
        jobs: dict[str, Job] = {}
        for state, root in states.items():
            out, timing = spare / state, spare / f"{state}.json"
            _run(root or HERE, ["-m", "psvideo.cli.app", "sync", path, "-o", timing, "-q"])
            call = ["-m", "psvideo.cli.app", "normals", path, "--rig", rig, "--timing", timing, "-o", out, "-q"]
            ends = [["--force", "--frames", f"0-{count - 1}"] for count in (short, long)]
            _run(root or HERE, [*call, *ends[0]])  # compiles
            jobs[state] = root or HERE, [*call, *ends[0]], [*call, *ends[1]]
        jobs["decoding"] = HERE, ["-c", DECODE, path, short], ["-c", DECODE, path, long]
        encode = ["-c", ENCODE, spare / "now", spare / "encoded"]
        jobs["encoding"] = HERE, [*encode, SHORT_ROUNDS], [*encode, SHORT_ROUNDS + rounds]
        found = all_further(jobs, long - short, turns=turns)
    copy_s = _copy_s(clip)
    for state in states:
        yield _row(clip.name, state, found, copy_s)


def _row(clip: str, state: str, found: dict[str, Further], copy_s: float) -> Whole:
    run, decoding, encoding = found[state], found["decoding"], found["encoding"]
    beyond_s = run.processor_s - decoding.processor_s - encoding.processor_s
    return Whole(
        clip=clip,
        state=state,
        normals=str(run),
        decoding=str(decoding),
        encoding=str(encoding),
        beyond_both=f"{1e3 * beyond_s:.0f}",
        in_copies=f"{beyond_s / copy_s:.1f}",
        wall_over_larger=f"{run.wall_s / max(decoding.wall_s, encoding.wall_s):.2f}",
        peak_memory=f"{run.peak_mb:.0f} MB",
    )


def all_further(jobs: dict[str, Job], frames: int, *, turns: int = TURNS) -> dict[str, Further]:
    """Run every job's short and long process, all in turn, and return what each of the frames between them took."""
    costs: dict[str, list[tuple[Cost, Cost]]] = {name: [] for name in jobs}
    for _ in range(turns):
        for name, (root, short, long) in jobs.items():
            costs[name].append((_run(root, short), _run(root, long)))
    return {name: _further(*zip(*taken, strict=True), frames=frames) for name, taken in costs.items()}


def _further(short: Sequence[Cost], long: Sequence[Cost], *, frames: int) -> Further:
    less, more = (Cost(*(min(values) for values in zip(*one, strict=True))) for one in (short, long))
    return Further(
        processor_s=(more.processor_s - less.processor_s) / frames,
        wall_s=(more.wall_s - less.wall_s) / frames,
        peak_mb=more.peak_mb,
    )


def _run(root: Path, arguments: Sequence[object]) -> Cost:
    """Run Python with a checkout's package, and return what the process took."""
    environment = os.environ | {"PYTHONPATH": str(root / "src")}
    began = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, *map(str, arguments)], stdout=subprocess.DEVNULL, env=environment, cwd=root
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{root}: status {process.returncode} from {json.dumps([*map(str, arguments)])[:300]}")
    return Cost(used.ru_utime + used.ru_stime, time.perf_counter() - began, used.ru_maxrss / 1024)


def _copy_s(clip: ClipOf) -> float:
    """Return the processor time of copying one frame's codes, as they are in memory."""
    channels = () if clip.kind == "dng" else (3,)
    frames = np.ones((8, ROWS, COLS, *channels), np.uint8 if clip.kind == "h264" else np.uint16)
    copies = np.ones_like(frames)
    times_s = []
    for _ in range(5):
        began = time.thread_time()
        np.copyto(copies, frames)
        times_s.append(time.thread_time() - began)
    return min(times_s) / len(frames)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("words", nargs="*")
    parser.add_argument("--against", type=Path)
    parser.add_argument("--cache", type=Path, default=CACHE)
    parser.add_argument("--turns", type=int, default=TURNS)
    given = parser.parse_args()
    print(table(rows(given.words, against=given.against, cache=given.cache, turns=given.turns)))
