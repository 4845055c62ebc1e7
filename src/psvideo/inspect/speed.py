"""How fast memory, disk and the compiled solver are here, each in about half a second."""

import os
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from psvideo.inspect.findings import Finding, Level
from psvideo.solve.normals.asked_surface import AskedSurface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares.woodham1980 import solve
from psvideo.solve.normals.lit_plates import LitPlates

ROWS, COLS, LIGHTS = 1080, 1920, 8
BYTES = ROWS * COLS * (4 * LIGHTS + 8)
"""Moved by one solution: a float32 per light and pixel in, half-float normals and albedo out, as in a run: that loop
is compiled ahead."""
MOST_COPIES = 12.0
"""A solver that takes longer than this many copies of as many bytes runs uncompiled, or on a machine that is busy."""
DISK_MB = 64
SLOW_DISK_MB_S = 60.0
MEASURED_S = 0.5


def speed(folder: Path) -> Iterator[Finding]:
    """Give findings for the solver, beside a copy of as many bytes, and for the disk of ``folder``."""
    yield _solver()
    yield _disk(folder)


def _solver() -> Finding:
    plates = list(0.2 + 0.4 * np.random.default_rng(0).random((LIGHTS, ROWS, COLS), dtype=np.float32))
    around, slant = np.arange(LIGHTS) * 2 * np.pi / LIGHTS, np.radians(35)
    across, up = np.sin(slant), np.full(LIGHTS, np.cos(slant))
    ring = np.stack([across * np.cos(around), across * np.sin(around), up], axis=-1)
    lit = Illumination(directions=ring, intensities=np.ones((LIGHTS, 1)))
    source, target = np.ones(BYTES // 2, np.uint8), np.ones(BYTES // 2, np.uint8)
    solved_s = _best_s(lambda: solve(LitPlates(plates, lit), asked=AskedSurface(half=True, residual=False)))
    copied_s = _best_s(lambda: np.copyto(target, source))
    ratio = solved_s / copied_s
    slow = ratio > MOST_COPIES
    step = "Other work may keep the machine busy: look again when it rests." if slow else ""
    text = (
        f"{LIGHTS} lights at 1080p in about {1e3 * solved_s:.0f} ms a result; {ratio:.1f} times a copy of as many "
        f"bytes ({BYTES / copied_s / 1e9:.1f} GB/s)"
    )
    level: Level = "note" if slow else "ok"
    return Finding(name="least squares", level=level, text=text, next_step=step, value=1e3 * solved_s, unit="ms")


def _best_s(work: Callable[[], object]) -> float:
    work()  # compiles, or loads what was compiled before
    took_s: list[float] = []
    end = time.perf_counter() + MEASURED_S
    while not took_s or time.perf_counter() < end:
        began = time.perf_counter()
        work()
        took_s.append(time.perf_counter() - began)
    return min(took_s)


def _disk(folder: Path) -> Finding:
    """Write a file that nobody sees and that is gone afterwards."""
    block = os.urandom(1 << 20)
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            began = time.perf_counter()
            for _ in range(DISK_MB):
                file.write(block)
            file.flush()
            os.fsync(file.fileno())
            rate = DISK_MB * 1.048576 / (time.perf_counter() - began)
    except OSError as fault:
        step = "Run psvideo doctor with `folder` and a folder that you may write to."
        text = f"{folder} cannot be written ({fault.strerror or fault})"
        return Finding(name="disk", level="missing", text=text, next_step=step)
    slow = rate < SLOW_DISK_MB_S
    step = "Results and decoded frames go to the output's disk: name an output on a faster one." if slow else ""
    text = f"{rate:.0f} MB/s written in {folder.resolve()}"
    return Finding(name="disk", level="note" if slow else "ok", text=text, next_step=step, value=rate, unit="MB/s")
