"""The coarse search: every place in the cycle, every clock ratio in reach, and every readout where it is unknown.

A row's loss depends on its own opening time only. So each row is scored alone against phase and clock ratio, and any
readout's loss is a sum over rows, each read at the phase at which that readout opens it: a readout costs a sum, not a
search.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.sync.rowfit import row_model
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.coarse.readout_kernel import least_over_readouts
from psvideo.sync.rowfit.coarse.search_kernel import losses_of_any, losses_of_square
from psvideo.sync.rowfit.coarse.seen_shares import LANES
from psvideo.sync.rowfit.compiled_profiles import compiled_rows, rows_of_a_part, slot_unknowns
from psvideo.sync.rowfit.profiles import Profiles

ROBUST_STEEPNESS = 20.0
"""Of the coarse loss ``log(1 + 20 r^2)``, r being a residual over its row's own spread (physics.md)."""

FEWER, LEAST_ROWS = 4, 6
"""One of this many rows is looked at first, but no fewer rows than these;"""
LOW = 0.15
"""the others only for this share of the clocks, the lowest."""
PHASES_EACH = 1024
"""Phases whose sums over readouts one thread takes at a time."""


class TriedClocks(NamedTuple):
    """Clocks to try: what ``FoundClock`` holds of each, (clock,). A grid has a hundred thousand."""

    phase_s: Doubles
    offset_ppm: Doubles

    def at(self, n: int) -> FoundClock:
        """Return one of them."""
        return FoundClock(phase_s=float(self.phase_s[n]), offset_ppm=float(self.offset_ppm[n]))

    def only(self, among: NDArray[np.int64]) -> "TriedClocks":
        """Return some of them."""
        return TriedClocks(self.phase_s[among], self.offset_ppm[among])


def turned_clocks(phases_s: Doubles, ppm: Doubles, pivot_s: float) -> TriedClocks:
    """Return a clock of each phase turned about a time by each of some ppm, the phases of the first ppm first."""
    phase_s = phases_s[None, :] + (phases_s[None, :] - pivot_s) * ppm[:, None] * 1e-6
    return TriedClocks(phase_s.ravel(), np.repeat(ppm, len(phases_s)))


@dataclass(frozen=True, kw_only=True)
class GridPlace:
    """A place on the grid and its mean loss per sample."""

    beat: Beat
    loss: float


def search(
    plan: Plan, rows: Profiles, *, range_ppm: float, start: Beat, readout_known: bool, keep: int = 1
) -> list[GridPlace]:
    """Return the best places of a grid (a third of a flash in phase, half a flash's slip in ratio), best first.

    ``start`` gives exposure, tails and, where it is known, row time and direction.
    """
    phases_s, ppm = _grid(plan, rows, range_ppm)
    clocks = turned_clocks(phases_s, ppm, float(rows.frame_start_s.mean()))
    if readout_known:
        loss = _least(plan, rows, clocks, start).reshape(len(ppm), len(phases_s)) / len(rows.value)
        ratio, phase = loss.argmin(axis=0), np.arange(len(phases_s))
        best = _lowest(loss.min(axis=0), np.zeros_like(phase), ratio, keep)
        at = ratio * len(phases_s) + phase
        return [GridPlace(beat=_placed(start, clocks.at(int(at[b]))), loss=value) for b, value in best]
    loss = losses(plan, rows, clocks, start, place=np.zeros_like(rows.place))
    loss = loss.reshape(len(ppm), len(phases_s), -1) / len(rows.value)
    return _over_readouts(rows, loss, clocks, phases_s, start, keep)


def _least(plan: Plan, rows: Profiles, clocks: TriedClocks, start: Beat) -> Doubles:
    """Return every clock's mean loss over the rows (clock,); infinite where a few of the rows show it to be high."""
    height = len(rows.place)
    few = np.zeros(height, np.bool_)
    few[:: max(min(FEWER, height // LEAST_ROWS), 1)] = True
    total = _sum_over(plan, rows, few, clocks, start)
    if few.all():
        return total / height
    low = np.argsort(total, kind="stable")[: max(int(LOW * len(total)), 1)]
    loss = np.full(len(total), np.inf)
    loss[low] = (total[low] + _sum_over(plan, rows, ~few, clocks.only(low), start)) / height
    return loss


def _sum_over(plan: Plan, rows: Profiles, among: NDArray[np.bool_], clocks: TriedClocks, start: Beat) -> Doubles:
    """Return every clock's loss (clock,), summed over some of the rows."""
    part = rows.only_rows(among)
    total: Doubles = losses(plan, part, clocks, start, place=part.place).sum(axis=1)
    return total


def _grid(plan: Plan, rows: Profiles, range_ppm: float) -> tuple[Doubles, Doubles]:
    shortest_s = plan.shortest_flash_s
    steps = int(np.ceil(plan.cycle_s / (shortest_s / 3)))
    phases_s: Doubles = np.arange(steps, dtype=np.float64) * (plan.cycle_s / steps)
    return phases_s, clock_ratios_ppm(plan, rows, range_ppm)


def clock_ratios_ppm(plan: Plan, rows: Profiles, range_ppm: float) -> Doubles:
    """Return the clock ratios of the grid: half a flash's slip over the frames apart, up to ``range_ppm``."""
    span_s = float(rows.frame_start_s[-1] - rows.frame_start_s[0]) + rows.period_s
    slips = int(np.ceil(range_ppm * 1e-6 * span_s / (0.5 * plan.shortest_flash_s)))
    ppm: Doubles = np.linspace(-1.0, 1.0, 2 * slips + 1) * range_ppm if slips else np.zeros(1)
    return ppm


def losses(plan: Plan, rows: Profiles, clocks: TriedClocks, start: Beat, *, place: Doubles) -> Doubles:
    """Return the loss of every clock in every row, shape (clock, row)."""
    first_s, last_s = float(rows.frame_start_s[0]), float(rows.frame_start_s[-1])
    latest_s, earliest_s = float(clocks.phase_s.max()), float(clocks.phase_s.min())
    cycle = len(plan.cycle_slots)
    begin = int(np.floor((first_s - latest_s) / plan.cycle_s)) - 1
    end = int(np.ceil((last_s + 3 * rows.period_s - earliest_s) / plan.cycle_s)) + 1
    train = plan.train(begin * cycle, (end - begin) * cycle)
    unknown = slot_unknowns(plan)
    square = row_model.Flashes(train.start_s, train.duration_s, unknown[train.slot], int(unknown.max()) + 1)
    flashes = square._replace(rise_s=start.rise_s, fall_s=start.fall_s)
    seen = compiled_rows(rows, start)._replace(row_place=place)
    found = np.empty((len(clocks.phase_s), rows.value.shape[1]))
    _fill_losses(seen, flashes, clocks, rows.spread, found)
    return found


def _fill_losses(
    rows: row_model.Rows, flashes: row_model.Flashes, clocks: TriedClocks, spread: Doubles, found: Doubles
) -> None:
    phase_s, rate = clocks.phase_s, 1.0 + clocks.offset_ppm * 1e-6
    count, each = len(phase_s), rows_of_a_part(rows.value.size)
    if flashes.rise_s == flashes.fall_s == 0.0 and len(rows.beat_hz) == 0 and not rows.restless.any():
        # clocks that are worked on together are those under which flashes come at nearly the same times
        order = np.argsort(phase_s + rate * float(rows.frame_start_s.mean()), kind="stable")
        over_ranges(
            lambda a, b: losses_of_square(rows, flashes, phase_s, rate, order, spread, ROBUST_STEEPNESS, a, b, found),
            count,
            each=-(-each // LANES) * LANES,
        )
    else:
        over_ranges(
            lambda a, b: losses_of_any(rows, flashes, phase_s, rate, spread, ROBUST_STEEPNESS, a, b, found),
            count,
            each=each,
        )


def _over_readouts(
    rows: Profiles,
    loss: Doubles,
    clocks: TriedClocks,
    phases_s: Doubles,
    start: Beat,
    keep: int,
) -> list[GridPlace]:
    """Sum the rows' losses along every readout from the whole frame upward to the whole frame downward."""
    height = rows.place.max() + rows.place.min() + 1
    step_s = phases_s[1] - phases_s[0]
    count = int(np.ceil(rows.period_s / step_s))
    readouts_s = np.arange(-count, count + 1) * rows.period_s / count
    places = np.where(readouts_s[:, None] >= 0, rows.place, height - 1 - rows.place)
    below, part = np.divmod(places / height * np.abs(readouts_s)[:, None] / step_s, 1.0)
    # twice around the cycle: a place in it is a slice
    by_row = np.ascontiguousarray(np.concatenate([np.moveaxis(loss, 2, 0)] * 2, axis=2))  # else compiled once more
    least, readout, ratio = np.empty(len(phases_s)), *np.zeros((2, len(phases_s)), np.int64)
    over_ranges(
        lambda a, b: least_over_readouts(by_row, below.astype(np.int64), part, a, b, least, readout, ratio),
        len(phases_s),
        each=PHASES_EACH,
    )
    found = []
    for b, value in _lowest(least, readout, ratio, keep):
        readout_s = float(readouts_s[readout[b]])
        beat = Beat(
            clock=clocks.at(int(ratio[b]) * len(phases_s) + b),
            row_time_s=abs(readout_s) / height,
            exposure_s=start.exposure_s,
            upward=readout_s < 0,
            rise_s=start.rise_s,
            fall_s=start.fall_s,
            beat_hz=start.beat_hz,
        )
        found.append(GridPlace(beat=beat, loss=value))
    return found


def _lowest(least: Doubles, readout: Integers, ratio: Integers, keep: int) -> Iterator[tuple[int, float]]:
    """Yield the phases with the lowest losses ``least`` (phase,), and these, no two of them neighbours; of equal ones
    first that of the first ``readout`` (phase,) and ``ratio`` (phase,) on the grid."""
    near = np.zeros(len(least), np.bool_)
    for b in np.lexsort((ratio, readout, least)).tolist():
        if keep == 0 or (near.any() and not np.isfinite(least[b])):
            break
        if not near[b]:
            yield b, float(least[b])
            near[np.arange(b - 2, b + 3) % len(least)] = True
            keep -= 1


def _placed(start: Beat, clock: FoundClock) -> Beat:
    return Beat(
        clock=clock,
        row_time_s=start.row_time_s,
        exposure_s=start.exposure_s,
        upward=start.upward,
        rise_s=start.rise_s,
        fall_s=start.fall_s,
        beat_hz=start.beat_hz,
    )
