"""Timing found from clips, each disturbance alone and several at once: RMS phase error over the flashes, in rows."""

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bench.table import Row, table
from bench.timing_scenes import Case, cases
from psvideo.errors import PsvideoError
from psvideo.profiles import collect_with_doubt
from psvideo.sync import find_timing
from psvideo.synth import Exposure
from psvideo.timing import Timing

SEEDS = 3


@dataclass(frozen=True)
class HeldFrame:
    """A frame in memory."""

    index: int
    image: np.ndarray


@dataclass(frozen=True)
class Outcome:
    """How well one clip was timed."""

    rms_rows: float
    claimed_rows: float
    ppm: float
    readout: float
    order: str
    names_right: bool
    cpu_s: float


def rows(only: str = "", seeds: int = SEEDS) -> Iterator[Row]:
    """Time every case whose name contains ``only``."""
    for name, case in cases().items():
        if only in name:
            yield _row(name, case, seeds)


def _row(name: str, case: Case, seeds: int) -> Row:
    try:
        found = [outcome(case, seed) for seed in range(seeds)]
    except PsvideoError as fault:
        return Row(name, f"refused: {str(fault)[:90]}", f"<= {case.bar_rows}", False)
    worst = max(one.rms_rows for one in found)
    named = all(one.names_right if one.order == "marker" else not case.marker for one in found)
    orders = "/".join(sorted({one.order for one in found}))
    figure = (
        f"{worst:.4f} row (claimed {np.mean([one.claimed_rows for one in found]):.4f}), "
        f"{max(abs(one.ppm) for one in found):.2f} ppm, readout {max(abs(one.readout) for one in found):.1e}, "
        f"{orders}{'' if named else ' WRONG'}, {np.mean([one.cpu_s for one in found]):.1f} s"
    )
    return Row(name, figure, f"<= {case.bar_rows}", bool(worst <= case.bar_rows and named))


def outcome(case: Case, seed: int) -> Outcome:
    """Shoot a case, find its timing, and hold it against the truth."""
    shot, indices, frames = case.shoot(seed)
    held = (HeldFrame(int(n), image) for n, image in zip(indices, frames, strict=True))
    index, profiles, doubt = collect_with_doubt(held)
    began = time.process_time()
    timing = find_timing(case.claimed or case.plan, index, profiles, doubt=doubt)
    cpu_s = time.process_time() - began
    error_s, right = against_truth(timing, shot, scale=_scale(case))
    row_time_s = (case.plan.camera.readout_s or case.plan.camera.frame_period_s) / case.plan.camera.height_px
    true_rate = _mean_rate(case, shot)
    return Outcome(
        rms_rows=float(np.sqrt(np.mean(error_s**2))) / abs(row_time_s),
        claimed_rows=timing.phase_error_rows,
        ppm=timing.clock_offset_ppm - 1e6 * (true_rate - 1),
        readout=timing.row_time_s * case.plan.camera.height_px / (case.plan.camera.readout_s or np.inf) - 1
        if case.plan.camera.readout_s
        else timing.row_time_s,
        order=timing.order,
        names_right=right,
        cpu_s=cpu_s,
    )


def _mean_rate(case: Case, shot: Exposure) -> float:
    """Return the strobe's mean rate over the clip on the clock that the claimed frame rate makes."""
    middle_s = 0.5 * case.frames * case.plan.camera.frame_period_s
    rate = 1 + 1e-6 * (case.clock.offset_ppm + case.clock.drift_ppm_per_s * middle_s)
    return rate * _scale(case)


def _scale(case: Case) -> float:
    return (case.claimed or case.plan).camera.frame_period_s / case.plan.camera.frame_period_s


def against_truth(timing: Timing, shot: Exposure, *, scale: float = 1.0) -> tuple[np.ndarray, bool]:
    """Return by how much every found flash is off the true one nearest to it, and whether all names are right.

    ``scale`` is how much longer the plan's frame period is than the true one.
    """
    true_s = np.array([flash.start_s for flash in shot.flashes]) * scale
    nearest = np.abs(true_s[:, None] - timing.start_s).argmin(axis=0)
    right = all(dict(f.lights) == dict(shot.flashes[n].lights) for f, n in zip(timing.flashes, nearest, strict=True))
    return timing.start_s - true_s[nearest], right


if __name__ == "__main__":
    print(table(rows(sys.argv[1] if len(sys.argv) > 1 else "", int(sys.argv[2]) if len(sys.argv) > 2 else SEEDS)))
