"""Errors that `sync` makes over the standard errors that it claims, over many seeds: the ratio's RMS should be 1."""

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bench.table import Row, table
from bench.timing import against_truth
from bench.timing_cases import Case
from bench.timing_scenes import banded, plan_of, rolling_stripes, tumbling, void
from psvideo.errors import PsvideoError
from psvideo.model.rows.row_profiles import collect_with_doubt
from psvideo.sync.find import timing_from_rows
from psvideo.synth import TrueClock

SEEDS = 100
BAR = (0.7, 1.4)


@dataclass(frozen=True)
class Ratios:
    """What was made and what was claimed, shape (seed,) each, in rows; ``refused`` clips were not timed at all."""

    made_rows: np.ndarray
    claimed_rows: np.ndarray
    refused: int

    @property
    def rms(self) -> float:
        """The root mean square of error over claim."""
        return float(np.sqrt(np.mean((self.made_rows / self.claimed_rows) ** 2)))


def cases() -> dict[str, Case]:
    """Return the shoots whose errors are counted."""
    plain = plan_of()
    unknown = replace(plain, camera=replace(plain.camera, readout_s=None))
    half = plan_of(shutter=0.5, readout=0.6)
    wide = plan_of(tolerance_ppm=None)
    hundred = TrueClock(phase_s=0.0, offset_ppm=100.0)
    return {
        "clean": Case(plan=plain, frames=60),
        "clean, shutter 180": Case(plan=half, frames=60),
        "readout unknown": Case(plan=plain, claimed=unknown, frames=60),
        "drift 5 ppm/s": Case(plan=wide, clock=replace(hundred, drift_ppm_per_s=5.0), frames=300),
        "bands": Case(plan=plain, scene=banded, frames=60),
        "void": Case(plan=plain, scene=void, frames=60),
        "rolling stripes": Case(plan=plain, scene=rolling_stripes()),
        "jitter 3 us": Case(plan=plain, clock=replace(hundred, jitter_s=3e-6)),
        "tumbling": Case(plan=plain, scene=tumbling),
        "global shutter": Case(plan=plan_of(readout=0.0)),
    }


def rows(only: str = "", seeds: int = SEEDS) -> Iterator[Row]:
    """Count the errors of every case whose name contains ``only``."""
    for name, case in cases().items():
        if only in name:
            yield _row(name, ratios(case, range(seeds)))


def ratios(case: Case, seeds: range) -> Ratios:
    """Shoot a case with every seed and hold its errors against the claims."""
    camera = case.plan.camera
    row_time_s = abs(camera.row_time_s) or camera.frame_period_s / camera.height_px
    made, claimed, refused = [], [], 0
    for seed in seeds:
        try:
            made_s, claimed_s = _errors_s(case, seed)
        except PsvideoError:
            refused += 1
            continue
        made.append(made_s / row_time_s)
        claimed.append(claimed_s / row_time_s)
    return Ratios(np.array(made), np.array(claimed), refused)


def _errors_s(case: Case, seed: int) -> tuple[float, float]:
    """Return the RMS error over a clip's flashes, and the standard error that was claimed, in seconds."""
    filmed = case.film(seed)
    index, profiles, doubt = collect_with_doubt(filmed.frames)
    timing = timing_from_rows(case.claimed or case.plan, index, profiles, doubt=doubt)
    off_s, _ = against_truth(timing, filmed, scale=1.0)
    return float(np.sqrt(np.mean(off_s**2))), timing.phase_error_s or 0.0


def _row(name: str, found: Ratios) -> Row:
    each = found.made_rows / found.claimed_rows
    figure = (
        f"{found.rms:.2f} (one in ten below {np.percentile(each, 10):.2f}, above {np.percentile(each, 90):.2f}); "
        f"made {np.sqrt(np.mean(found.made_rows**2)):.5f}, claimed {np.sqrt(np.mean(found.claimed_rows**2)):.5f} row"
        f"{f'; {found.refused} refused' if found.refused else ''}"
    )
    met = BAR[0] <= found.rms <= BAR[1] and not found.refused
    return Row(f"{name}, {len(each)} seeds", figure, f"{BAR[0]}-{BAR[1]}", met)


if __name__ == "__main__":
    print(table(rows(sys.argv[1] if len(sys.argv) > 1 else "", int(sys.argv[2]) if len(sys.argv) > 2 else SEEDS)))
