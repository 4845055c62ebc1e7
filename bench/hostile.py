"""Hostile files: good ones of every format that is read, changed in many ways, and whole folders of damaged ones.

``python -m bench.hostile --seed 1 --minutes 60`` goes on with ever new changes and prints what went wrong, with the
files kept. A reader may read a file or refuse it with one paragraph that names it; it may not crash, hang, raise
anything else, or take a gigabyte.
"""

import argparse
import json
import select
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bench.hostile_files import good_files

LIMIT_S = 10.0
"""Processor time that one file may take. A process that gives no answer for three times as long hangs."""
LIMIT_MB = 1000.0
PER_KIND = 40
"""Changes of every good file that the table tries."""
EXTREMES = (0x00, 0x01, 0x7F, 0x80, 0xFE, 0xFF)
HEAD_BYTES = 1024
"""Where most formats have their headers."""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of one file; ``fault`` is empty where all is well."""

    path: Path
    said: str
    fault: str
    cpu_s: float
    peak_mb: float


class Summary(NamedTuple):
    """One kind of file: how many changed ones were read, refused, and how many were faults."""

    kind: str
    tried: int
    read: int
    refused: int
    faults: int
    most_seconds: str
    most_memory: str


def outcomes(paths: Iterable[Path]) -> Iterator[Outcome]:
    """Give the outcome of every file; a process that dies or hangs is replaced by a new one."""
    reader = _start()
    try:
        for path in paths:
            print(path, file=reader.stdin, flush=True)
            stream: Any = reader.stdout
            ready = select.select([stream], [], [], 3 * LIMIT_S)[0]
            line = stream.readline() if ready else ""
            if line:
                yield _judged(path, json.loads(line))
                continue
            reader.kill()
            fault = f"the reader died with status {reader.wait()}" if ready else f"no answer for {3 * LIMIT_S:g} s"
            yield Outcome(path=path, said="", fault=fault, cpu_s=0.0, peak_mb=0.0)
            reader = _start()
    finally:
        reader.kill()
        reader.communicate()


def _start() -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", "bench.hostile_reader"]
    root = Path(__file__).resolve().parents[1]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True, cwd=root)


def _judged(path: Path, found: dict[str, object]) -> Outcome:
    cpu_s, peak_mb, fault = float(str(found["cpu_s"])), float(str(found["peak_mb"])), str(found["fault"])
    if cpu_s > LIMIT_S:
        fault = fault or f"took {cpu_s:.0f} s"
    if peak_mb > LIMIT_MB:
        fault = fault or f"took {peak_mb:.0f} MB"
    return Outcome(path=path, said=str(found["said"]), fault=fault, cpu_s=cpu_s, peak_mb=peak_mb)


def _cut(data: bytearray, rng: np.random.Generator) -> bytearray:
    return data[: int(rng.integers(0, len(data)))]


def _flipped(data: bytearray, rng: np.random.Generator) -> bytearray:
    for _ in range(int(rng.integers(1, 9))):
        data[int(rng.integers(0, len(data)))] ^= 1 << int(rng.integers(0, 8))
    return data


def _extreme(data: bytearray, rng: np.random.Generator) -> bytearray:
    """Set a number of one to eight bytes in the header to its smallest or largest value."""
    size = int(rng.choice([1, 2, 4, 8]))
    place = int(rng.integers(0, min(len(data), HEAD_BYTES)))
    value = int(rng.choice(EXTREMES))
    data[place : place + size] = bytes([value] * size)[: len(data) - place]
    return data


def _doubled(data: bytearray, rng: np.random.Generator) -> bytearray:
    first, last = sorted(int(place) for place in rng.integers(0, len(data), 2))
    return data[:last] + data[first:]


def _left_out(data: bytearray, rng: np.random.Generator) -> bytearray:
    first, last = sorted(int(place) for place in rng.integers(0, len(data), 2))
    return data[:first] + data[last:]


def _noise(data: bytearray, rng: np.random.Generator) -> bytearray:
    place = int(rng.integers(0, len(data)))
    part = rng.bytes(int(rng.integers(1, 64)))
    data[place : place + len(part)] = part
    return data


CHANGES: tuple[Callable[[bytearray, np.random.Generator], bytearray], ...] = (
    _cut, _flipped, _extreme, _extreme, _doubled, _left_out, _noise,
)  # fmt: skip


def changed(good: Sequence[Path], folder: Path, *, seed: int) -> Iterator[Path]:
    """Give changed copies of good files for ever, in turn; a copy is gone when the next one comes."""
    rng = np.random.default_rng(seed)
    number = 0
    while True:
        for path in good:
            data = bytearray(path.read_bytes())
            for _ in range(int(rng.integers(1, 4))):
                if data:
                    data = CHANGES[int(rng.integers(0, len(CHANGES)))](data, rng)
            copy = folder / f"{path.stem}_{number:06d}{path.suffix}"
            copy.write_bytes(data)
            yield copy
            copy.unlink(missing_ok=True)
            number += 1


def rows() -> Iterator[Summary]:
    """Change every good file so many times."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        good = good_files(folder)
        paths = changed(good, folder, seed=1)
        found = list(outcomes(path for path, _ in zip(paths, range(PER_KIND * len(good)), strict=False)))
    for path in good:
        yield _summary(path.name, [one for one in found if one.path.name.startswith(f"{path.stem}_")])


def _summary(kind: str, found: Sequence[Outcome]) -> Summary:
    faults = sum(bool(one.fault) for one in found)
    refused = sum(one.said.startswith("refused") for one in found if not one.fault)
    return Summary(
        kind=kind,
        tried=len(found),
        read=len(found) - faults - refused,
        refused=refused,
        faults=faults,
        most_seconds=f"{max(one.cpu_s for one in found):.2f} s",
        most_memory=f"{max(one.peak_mb for one in found):.0f} MB",
    )


def main() -> None:
    """Go on for so many minutes; keep what made a fault."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--keep", type=Path, default=Path("hostile_faults"), help="folder for files that made a fault")
    asked = parser.parse_args()
    end_s = time.monotonic() + 60 * asked.minutes
    tried = faults = 0
    with tempfile.TemporaryDirectory() as place:
        for one in outcomes(changed(good_files(Path(place)), Path(place), seed=asked.seed)):
            tried += 1
            if one.fault:
                faults += 1
                asked.keep.mkdir(exist_ok=True)
                (asked.keep / one.path.name).write_bytes(one.path.read_bytes())
                print(f"{one.path.name}: {one.fault}", flush=True)
            if time.monotonic() > end_s:
                break
    print(f"{tried} files, {faults} faults")


if __name__ == "__main__":
    main()
