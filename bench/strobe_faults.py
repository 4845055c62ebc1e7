"""A strobe under random faults, in emulation: is it dark within the time that it promises, and never lit for too long?

``python -m bench.strobe_faults --schedules 10000`` plays so many runs. In each a host asks for the clock five times a
second over a line on which several faults happen: a cable is pulled or put back, the host is killed, bytes are lost,
bits flip, garbage comes, the interlock opens, an edge is missed, the power dips, the watchdog or the USB port resets.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, get_args

import numpy as np

from psvideo.strobe.limits import cycle_check
from psvideo.strobe.link.boards import BOARDS, Board
from psvideo.strobe.link.lines import seal
from psvideo.strobe.link.requests import Lit, Slot
from psvideo.strobe.link.words import Reset
from psvideo.strobe.stand_ins.playing import Edge
from psvideo.strobe.stand_ins.python_board import PythonBoard

SCHEDULES = 300
MOST_FAULTS = 4
RUNS_S, ASKS_EVERY_S, SETTLES_S = 3.0, 0.2, 3.0
PS_PER_S, PS_PER_MS = 10**12, 10**9
What = Literal[
    "cable pulled", "cable put back", "host killed", "bytes lost", "bits flipped", "garbage", "interlock opened",
    "edge missed", "power dip", "brown-out", "watchdog", "USB reset",
]  # fmt: skip
RESETS: dict[What, Reset] = {
    "power dip": "power",
    "brown-out": "brownout",
    "watchdog": "watchdog",
    "USB reset": "external",
}
AT_ONCE = ("interlock opened", "edge missed", *RESETS)
"""After these it is dark at the same tick, and stays so: nobody arms it again."""


class Darkness(NamedTuple):
    """Schedules in which a fault came: how many, in how many the board was dark in time, and the longest it was lit
    after the last sign of life, of the keep-alive time at most."""

    fault: str
    schedules: int
    dark_in_time: int
    longest_ms: str
    promised_ms: str


@dataclass
class Line:
    """What a host's bytes go through."""

    rng: np.random.Generator
    connected: bool = True
    alive: bool = True
    lost: float = 0.0
    flipped: float = 0.0

    def carried(self, data: bytes) -> bytes:
        """Return what arrives."""
        if not (self.connected and self.alive):
            return b""
        kept = [byte for byte in data if self.rng.random() >= self.lost]
        return bytes(byte ^ (1 << int(self.rng.integers(8))) * (self.rng.random() < self.flipped) for byte in kept)


@dataclass
class Played:
    """One schedule: what happened, and what was wrong."""

    faults: list[What]
    keep_ms: int
    wrong: list[str] = field(default_factory=list)
    lit_on_ms: float = 0.0


def played(rng: np.random.Generator) -> Played:
    """Play one schedule of faults, and say what was wrong."""
    board = BOARDS[str(rng.choice([*BOARDS]))]
    keep_ms = int(rng.integers(100, 2001))
    controller, pulse = _running(board, keep_ms)
    whats = [str(one) for one in rng.choice(get_args(What), int(rng.integers(1, MOST_FAULTS + 1)))]
    faults: list[What] = [one for one in get_args(What) for _ in range(whats.count(one))]
    times = sorted((_ticks(board, float(rng.uniform(0.02, RUNS_S))), what) for what in faults)
    asks = [(_ticks(board, ASKS_EVERY_S * n), "ask") for n in range(1, int(RUNS_S / ASKS_EVERY_S))]
    line, found = Line(rng), Played(faults=faults, keep_ms=keep_ms)
    heard = 0
    dark_from: int | None = None
    for tick, what in sorted([*times, *asks]):
        if what == "ask":
            answer = controller.feed(line.carried(f"{seal('CLK a1')}\n".encode()), tick)
            heard = tick if answer.startswith(b"OK") else heard
            continue
        answer = _happen(controller, line, what, tick)
        heard = tick if b"OK" in answer else heard
        if what in AT_ONCE and dark_from is None:
            dark_from = tick
            if controller.lit:
                found.wrong.append(f"lit after {what}")
    controller.advance(_ticks(board, RUNS_S + SETTLES_S))
    _judge(found, board, controller.edges, pulse, heard=heard, dark_from=dark_from)
    if controller.lit:
        found.wrong.append("lit in the end")
    return found


def _running(board: Board, keep_ms: int) -> tuple[PythonBoard, int]:
    """Return a board that plays a flash of a millisecond every ten, without end, and the flash's ticks."""
    pulse, dark = _ticks(board, 0.001), _ticks(board, 0.009)
    flash = Slot(slot=0, duration=pulse, dark=dark, period=pulse, lit=(Lit(line=1, on=pulse),))
    controller = PythonBoard(board)
    lines = [f"KEEP {keep_ms}", f"SLOT 0 {pulse} {dark} {pulse} 1:{pulse}", "STEPS 0 0", f"ARM {cycle_check([flash])}"]
    for text in (*lines, "RUN 0"):
        answer = controller.feed(f"{seal(text)}\n".encode(), 0)
        if not answer.startswith(b"OK"):
            raise RuntimeError(f"{text}: {answer!r}")
    return controller, pulse


def _happen(controller: PythonBoard, line: Line, what: str, tick: int) -> bytes:
    """Let one fault happen; return what the board answers."""
    if what in RESETS:
        controller.restart(RESETS[what], tick)
    elif what == "interlock opened":
        controller.set_interlock("open", tick)
    elif what == "edge missed":
        controller.miss_an_edge(tick)
    elif what in ("cable pulled", "cable put back"):
        line.connected = what == "cable put back"
    elif what == "host killed":
        line.alive = False
    elif what == "bytes lost":
        line.lost = float(line.rng.uniform(0, 0.3))
    elif what == "bits flipped":
        line.flipped = float(line.rng.uniform(0, 0.1))
    else:
        return controller.feed(line.rng.bytes(int(line.rng.integers(1, 200))) + b"\n", tick)
    controller.advance(tick)
    return b""


def _judge(
    found: Played, board: Board, edges: Sequence[Edge], pulse: int, *, heard: int, dark_from: int | None
) -> None:
    """Hold the edges against what is promised."""
    on: int | None = None
    for edge in edges:
        if edge.level:
            on = edge.tick
        elif on is not None:
            if edge.tick - on > pulse:
                found.wrong.append(f"a flash of {edge.tick - on} ticks, of {pulse}")
            on = None
    last = edges[-1].tick if edges else 0
    found.lit_on_ms = max(last - heard, 0) * board.tick_ps / PS_PER_S * 1e3
    if (last - heard) * board.tick_ps > found.keep_ms * PS_PER_MS:
        found.wrong.append(f"lit for {found.lit_on_ms:.1f} ms after the last sign of life, of {found.keep_ms} ms")
    if dark_from is not None and last > dark_from:
        found.wrong.append("lit again after a fault that latches")


def _ticks(board: Board, time_s: float) -> int:
    return int(time_s * PS_PER_S / board.tick_ps)


def darkness(count: int, *, seed: int = 1) -> Iterator[Darkness]:
    """Play so many schedules and give, for each fault, those in which it came; the last row is all of them."""
    rng = np.random.default_rng(seed)
    found = [played(rng) for _ in range(count)]
    for what in (*get_args(What), "any"):
        among = [one for one in found if what == "any" or what in one.faults]
        yield Darkness(
            fault=what,
            schedules=len(among),
            dark_in_time=sum(not one.wrong for one in among),
            longest_ms=f"{max((one.lit_on_ms for one in among), default=0):.0f}",
            promised_ms=f"{max((one.keep_ms for one in among), default=0)}",
        )
    for one in found:
        if one.wrong:
            print(one, file=sys.stderr)


def rows() -> Iterator[Darkness]:
    """Play some schedules."""
    yield from darkness(SCHEDULES)


def main() -> int:
    """Play as many schedules as are asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--schedules", type=int, default=SCHEDULES)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    wrong = False
    for row in darkness(asked.schedules, seed=asked.seed):
        wrong = wrong or row.schedules != row.dark_in_time
        print(*row, flush=True)
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
