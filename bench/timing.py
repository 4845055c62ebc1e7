"""Flash times found from virtual shoots, and the plates rebuilt with them: each disturbance alone, several at once."""

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from bench.table import table
from bench.timing_cases import Case, Filmed, groups
from bench.timing_plates import HeldFrame, PlateErrors, plate_errors
from psvideo.errors import PsvideoError
from psvideo.model.rows.row_profiles import collect_with_doubt
from psvideo.model.timing import Timing, places_in_time
from psvideo.sync.find import timing_from_rows

MOST_OVER_ORACLE = 1.05


class Line(NamedTuple):
    """One kind of shoot, the worst of its seeds: phase and its claim in rows, plates as shares of their RMS."""

    disturbance: str
    phase_error_in_rows: str
    bar: str
    claimed: str
    clock: str
    readout: str
    order: str
    plates: str
    over_oracle: str
    by_algorithm_1: str
    fit: str
    met: str


class Short(NamedTuple):
    """A group of disturbances, from its best shoot to its worst."""

    disturbances: str
    shoots_within_all_bars: str
    phase_error_in_rows: str
    plates_over_oracle: str
    plates_by_algorithm_1: str


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How well one clip was timed, and its plates. ``clock_ppm`` and ``readout`` are errors, the latter in frames."""

    rms_rows: float
    claimed_rows: float
    clock_ppm: float
    readout: float
    order: str
    names_right: bool
    cpu_s: float
    plates: PlateErrors


def rows(only: str = "") -> Iterator[Line]:
    """Time every case whose name contains ``only``; groups stand above their cases."""
    for group, cases in groups().items():
        chosen = {name: case for name, case in cases.items() if only in name}
        if chosen:
            yield Line(f"**{group}**", "", "", "", "", "", "", "", "", "", "", "")
        for name, case in chosen.items():
            yield _line(name, case)


def _line(name: str, case: Case) -> Line:
    try:
        found = [outcome(case, seed) for seed in range(case.seeds)]
    except PsvideoError as fault:
        met = "yes" if case.or_refused else "NO"
        return Line(name, f"refused: {str(fault)[:90]}", "", "", "", "", "", "", "", "", "", met)
    named = all(one.names_right if one.order == "marker" else not case.marker for one in found)
    worst = max(one.rms_rows for one in found)
    over = max(one.plates.ours / one.plates.oracle for one in found)
    left_out = max(one.plates.left_out for one in found)
    return Line(
        name,
        f"{worst:.4f}",
        f"{case.bar_rows:g}",
        f"{np.mean([one.claimed_rows for one in found]):.4f}",
        f"{max(abs(one.clock_ppm) for one in found):.2f} ppm",
        f"{1e6 * max(abs(one.readout) for one in found):.0f} ppm",
        "/".join(sorted({one.order for one in found})) + ("" if named else " WRONG"),
        _percent(max(one.plates.ours for one in found)) + (f", {_percent(left_out)} unseen" if left_out > 1e-3 else ""),
        f"{over:.3f}",
        _percent(max(one.plates.algorithm1 for one in found)),
        f"{np.mean([one.cpu_s for one in found]):.1f} s",
        _verdict(worst <= case.bar_rows, named, over <= MOST_OVER_ORACLE),
    )


def _verdict(timed: bool, named: bool, rebuilt: bool) -> str:
    missed = [word for word, met in (("times", timed), ("order", named), ("plates", rebuilt)) if not met]
    return "NO: " + ", ".join(missed) if missed else "yes"


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %" if share < 0.995 else f"{100 * share:.0f} %"


def summary(lines: list[Line]) -> Iterator[Short]:
    """Return every group's span from its best case to its worst."""
    starts = [n for n, line in enumerate(lines) if line.disturbance.startswith("**")] + [len(lines)]
    for start, stop in pairwise(starts):
        measured = [line for line in lines[start + 1 : stop] if line.over_oracle]
        met = sum(line.met == "yes" for line in lines[start + 1 : stop])
        yield Short(
            lines[start].disturbance.strip("*"),
            f"{met} of {stop - start - 1}",
            _span([line.phase_error_in_rows for line in measured]),
            _span([line.over_oracle for line in measured]),
            _span([line.by_algorithm_1 for line in measured]),
        )


def _span(figures: list[str]) -> str:
    ordered = sorted(figures, key=lambda figure: float(figure.split()[0]))
    low, high = ordered[0], ordered[-1]
    return high if low == high else f"{low.removesuffix(' %')} to {high}"


def outcome(case: Case, seed: int) -> Outcome:
    """Film a case, find its timing, rebuild its plates, and hold all of it against the truth."""
    filmed = case.film(seed)
    index, profiles, doubt = collect_with_doubt(filmed.frames)
    began = time.process_time()
    timing = timing_from_rows(case.claimed or case.plan, index, profiles, doubt=doubt)
    cpu_s = time.process_time() - began
    error_s, right = against_truth(timing, filmed, _scale(case))
    camera = case.plan.camera
    row_time_s = abs(camera.row_time_s) or camera.frame_period_s / camera.height_px
    return Outcome(
        rms_rows=float(np.sqrt(np.mean(error_s**2))) / row_time_s,
        claimed_rows=timing.phase_error_rows,
        clock_ppm=timing.clock_offset_ppm - 1e6 * (_mean_rate(case) - 1),
        readout=(timing.row_time_s / _scale(case) - camera.row_time_s) * camera.height_px / camera.frame_period_s,
        order=timing.order,
        names_right=right,
        cpu_s=cpu_s,
        plates=_plates(case, filmed, timing),
    )


def _plates(case: Case, filmed: Filmed, timing: Timing) -> PlateErrors:
    numbers = [frame.index for frame in filmed.frames]
    places = places_in_time(timing, numbers)
    placed = [HeldFrame(places[frame.index], frame.image) for frame in filmed.frames if frame.index in places]
    true = {int(n): frame.image for n, frame in zip(filmed.true_index, filmed.frames, strict=True) if n >= 0}
    return plate_errors(
        case.plan,
        timing,
        placed,
        claimed=(case.claimed or case.plan).camera,
        true_frames=true,
        flashes=filmed.exposure.flashes,
        plate_of=filmed.plate_of,
        ambient=case.ambient,
        scale=_scale(case),
    )


def _mean_rate(case: Case) -> float:
    """Return the strobe's mean rate over the clip on the clock that the claimed frame rate makes."""
    middle_s = 0.5 * case.frames * case.plan.camera.frame_period_s
    return (1 + 1e-6 * (case.clock.offset_ppm + case.clock.drift_ppm_per_s * middle_s)) * _scale(case)


def _scale(case: Case) -> float:
    """Return how much longer the plan's frame period is than the true one."""
    return (case.claimed or case.plan).camera.frame_period_s / case.plan.camera.frame_period_s


def against_truth(timing: Timing, filmed: Filmed, scale: float) -> tuple[np.ndarray, bool]:
    """Return by how much every found flash is off the true one nearest to it, and whether all names are right."""
    true = filmed.exposure.flashes
    true_s = np.array([flash.start_s for flash in true]) * scale
    nearest = np.abs(true_s[:, None] - timing.start_s).argmin(axis=0)
    right = all(dict(f.lights) == dict(true[n].lights) for f, n in zip(timing.flashes, nearest, strict=True))
    return timing.start_s - true_s[nearest], right


if __name__ == "__main__":
    lines = list(rows(sys.argv[1] if len(sys.argv) > 1 else ""))
    print(f"{table(lines)}\n\n{table(summary(lines))}")
