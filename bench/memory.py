"""The most memory that whole `normals` processes hold at 1080p colour with eight lights.

``python -m bench.memory [still|moving ...] [--against FOLDER]``: FOLDER is a checkout of an earlier state. A clip of 60
frames (six rounds) at rest, and one of which the middle half moves, as defaults have it and with depth; 16-bit TIFF,
with timing.json given. Longer clips take no more (``tests/test_memory.py``). A process that runs over tiny pictures
holds about 222 MB: Python, libraries and compiled loops.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from bench.table import Row, table
from bench.whole_run import CACHE, HERE
from bench.whole_run_clips import ClipOf, filmed

BAR_MB = 450
FRAMES = 60


def rows(words: Sequence[str] = (), *, root: Path = HERE, cache: Path = CACHE) -> Iterator[Row]:
    """Measure the clips that words choose, both where there are none."""
    for moving in (False, True):
        clip = ClipOf(kind="tiff", lights=8, moving=moving)
        if words and clip.name.split()[-1] not in words:
            continue
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as apart:  # a command counts what we hold, too
            path, rig = apart.submit(filmed, clip, cache, frames=FRAMES).result()
        with tempfile.TemporaryDirectory(prefix="psvideo-bench-", dir=cache) as spare:
            timing = Path(spare) / "timing.json"
            _peak_mb(root, "sync", path, "-o", timing, "-q")
            run = ["--rig", rig, "-o", Path(spare) / "out", "--force", "-q"]
            _peak_mb(root, "normals", path, *run, "--timing", timing)  # compiles
            short_mb = _peak_mb(root, "normals", path, *run, "--timing", timing)
            yield _row(f"{clip.name}: defaults", short_mb)
            yield _row(
                f"{clip.name}: depth too", _peak_mb(root, "normals", path, *run, "--timing", timing, "--aov", "depth")
            )


def _row(what: str, peak_mb: float) -> Row:
    return Row(what, f"{peak_mb:.0f} MB", f"<= {BAR_MB} MB", peak_mb <= BAR_MB)


def _peak_mb(root: Path, command: str, *arguments: object) -> float:
    """Run a command of a checkout's package, and return the most memory that its process held."""
    words = [sys.executable, "-m", "psvideo.cli.app", command, *map(str, arguments)]
    with subprocess.Popen(words, env=os.environ | {"PYTHONPATH": str(root / "src")}) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{' '.join(words)} ended with {process.returncode}")
    return used.ru_maxrss / 1024


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*", metavar="still|moving")
    parser.add_argument("--against", type=Path, default=HERE, metavar="FOLDER")
    parser.add_argument("--cache", type=Path, default=CACHE, metavar="FOLDER")
    asked = parser.parse_args()
    print(table(rows(asked.words, root=asked.against.resolve(), cache=asked.cache)))
