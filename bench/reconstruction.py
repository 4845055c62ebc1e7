"""Reconstruction against its floor: the time of copying the frames that it reads, in the same run."""

import time
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from bench.table import Row
from bench.timing_plates import HeldFrame
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Flash, Timing
from psvideo.plates.split import split

FRAMES = 24
REPEATS = 9


def rows() -> Iterator[Row]:
    """Time split over 1080p colour frames in memory, and copying as many frames, in turn."""
    plan, timing = _shot()
    rng = np.random.default_rng(0)
    shape = (plan.camera.height_px, plan.camera.width_px, 3)
    pictures = [0.9 * rng.random(shape, dtype=np.float32) for _ in range(4)]
    frames = [HeldFrame(n, pictures[n % 4]) for n in range(FRAMES)]
    ratios, split_ms, copy_ms = [], [], []
    for repeat in range(REPEATS + 1):
        began = time.perf_counter()
        plates = sum(plate.image.size > 0 for plate in split(iter(frames), plan.camera, timing))
        split_s = time.perf_counter() - began
        began = time.perf_counter()
        for n in range(FRAMES):
            pictures[n % 4].copy()
        copy_s = time.perf_counter() - began
        if repeat:  # the first compiles
            ratios.append(split_s / copy_s)
            split_ms.append(1e3 * split_s / plates)
            copy_ms.append(1e3 * copy_s / FRAMES)
    yield Row("rebuild a flash, 1080p colour", f"{np.median(split_ms):.2f} ms", "", None)
    yield Row("copy a frame, 1080p colour", f"{np.median(copy_ms):.2f} ms", "", None)
    ratio = float(np.median(ratios))
    yield Row("rebuilding / copying the frames it reads", f"{ratio:.2f}", "<= 2", ratio <= 2)


def _shot() -> tuple[Plan, Timing]:
    fps = Fraction(120_000, 1001)
    period_s = float(1 / fps)
    camera = Camera(width_px=1920, height_px=1080, fps=fps, exposure_s=period_s, readout_s=period_s)
    flashes = tuple(PlannedFlash(lights={name: 1.0}, duration_s=0.0008) for name in ("key", "left", "right"))
    plan = Plan(camera=camera, flashes=flashes, dark_s=1.0001 * period_s)
    train = plan.train(0, FRAMES - 3)
    start_s = train.start_s + 0.0123
    first, last = frames_touched(camera, start_s, train.duration_s)
    listed = tuple(
        Flash(
            index=n,
            slot=int(slot),
            lights=plan.flashes[slot].lights,
            start_s=float(start_s[n]),
            duration_s=float(train.duration_s[n]),
            complete=bool(first[n] >= 0 and last[n] < FRAMES),
        )
        for n, slot in enumerate(train.slot)
    )
    timing = Timing(
        clip="bench",
        frame_period_s=period_s,
        exposure_s=period_s,
        row_time_s=camera.row_time_s,
        clock_offset_ppm=0.0,
        phase_error_rows=0.0,
        order="given",
        flashes=listed,
    )
    return plan, timing
