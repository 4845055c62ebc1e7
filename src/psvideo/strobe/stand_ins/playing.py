"""A cycle of slots as edges, lazily: what the outputs of the Python board do from the start of a run on."""

import heapq
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate

from psvideo.strobe.limits import PPM
from psvideo.strobe.link.requests import Slot


@dataclass(frozen=True, kw_only=True, order=True)
class Edge:
    """A light goes on (``level`` 1) or off (0) at a tick, counted from the controller's reset."""

    tick: int
    line: int
    level: int


@dataclass(frozen=True, kw_only=True)
class Moment:
    """What happens at a tick of a run: an edge, or (``edge`` None) the begin of step ``step`` of cycle ``cycle``."""

    tick: int
    cycle: int
    step: int
    edge: Edge | None = None


@dataclass(kw_only=True)
class Trimming:
    """When the steps of a run begin, and how much longer than uploaded they are, in whole ticks.

    ``ppm`` holds from the step ``since`` on, counted from the run's start, and ``before`` until then. A share of a tick
    is carried on from step to step.
    """

    steps: Sequence[Slot]
    start: int = 0
    ppm: int = 0
    before: int = 0
    since: int = 0
    _parts_since: int = 0
    _offsets: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self._offsets = list(accumulate((slot.duration + slot.dark for slot in self.steps), initial=0))

    def trim(self, ppm: int, *, step: int, not_before: int) -> None:
        """Make the steps behind the next one that begin at a tick or later longer by this many ppm, in ``step``."""
        since = step + 2
        while self.begin(since) < not_before:
            since += 1
        self._parts_since = self._parts(since)
        self.before, self.ppm, self.since = self.ppm, ppm, since

    def begin(self, step: int) -> int:
        """Return the tick in which a step begins that is not before the one in which it was trimmed last."""
        cycles, place = divmod(step, len(self.steps))
        return self.start + cycles * self._offsets[-1] + self._offsets[place] + self._late(step)

    def extra(self, step: int) -> int:
        """Return by how many ticks a step is longer than uploaded."""
        return self._late(step + 1) - self._late(step)

    def _late(self, step: int) -> int:
        return self._parts(step) // (PPM * len(self.steps))

    def _parts(self, step: int) -> int:
        """Return by how many of a tick's parts, a step's number times a million, all steps before one are longer."""
        ppm = self.ppm if step >= self.since else self.before
        return self._parts_since + self._offsets[-1] * ppm * (step - self.since)


def moments(
    steps: Sequence[Slot], *, start: int, cycles: int, extra: Callable[[int], int] = lambda step: 0
) -> Iterator[Moment]:
    """Yield a run's moments in order of time; 0 cycles never end. The last is the begin of the cycle after the last.

    Every time is counted in whole ticks from the run's start, so nothing accumulates. ``extra`` says by how many ticks
    a step, counted from the run's start, is longer; asked when its last edge was taken.
    """
    tick, cycle = start, 0
    while cycles == 0 or cycle < cycles:
        for step, slot in enumerate(steps):
            yield Moment(tick=tick, cycle=cycle, step=step)
            for edge in slot_edges(slot, tick):
                yield Moment(tick=edge.tick, cycle=cycle, step=step, edge=edge)
            tick += slot.duration + slot.dark + extra(cycle * len(steps) + step)
        cycle += 1
    yield Moment(tick=tick, cycle=cycle, step=0)


def slot_edges(slot: Slot, start: int) -> Iterator[Edge]:
    """Yield one flash's edges in order of time; bursts that touch are one."""
    return heapq.merge(*(_line_edges(slot, lit.line, lit.on, start) for lit in slot.lit))


def _line_edges(slot: Slot, line: int, on: int, start: int) -> Iterator[Edge]:
    end = start + slot.duration
    if on == slot.period:
        yield Edge(tick=start, line=line, level=1)
        yield Edge(tick=end, line=line, level=0)
        return
    for begin in range(start, end, slot.period):
        yield Edge(tick=begin, line=line, level=1)
        yield Edge(tick=min(begin + on, end), line=line, level=0)
