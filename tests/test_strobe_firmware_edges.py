"""The edges that the firmware makes in emulation are the plan's ticks, whatever the host says meanwhile."""

import random
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from psvideo.formats.trace_csv import Trace, read_trace
from psvideo.strobe.limits import cycle_refusal, cycle_ticks, slot_refusal
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.replies import Capabilities
from psvideo.strobe.link.requests import Lit, Slot
from psvideo.strobe.link.words import WIRINGS, WiringName
from psvideo.strobe.stand_ins.playing import moments
from psvideo.strobe.stand_ins.toolchain import AvrBoard

BAR_CYCLES = 4
TICK_CYCLES = 8
FLASHES = 1500
BOTH: tuple[AvrBoard, ...] = ("atmega328p", "atmega2560")
NOISE = "bytes " + bytes(range(1, 256)).hex()


def slot(number: int, duration: int, dark: int, period: int, *on: int) -> Slot:
    """Return a slot whose lines 0, 1, … are on for so many ticks a period; 0 = not lit."""
    lit = tuple(Lit(line=line, on=ticks) for line, ticks in enumerate(on) if ticks)
    return Slot(slot=number, duration=duration, dark=dark, period=period, lit=lit)


ROUND = [slot(n, 600, 400, 600, *[0] * n, 600) for n in range(8)] + [slot(8, 600, 400, 600)]
"""One light after the other at full power, and a dark slot."""
BURSTS = [
    slot(0, 1000, 300, 80, 40),
    slot(1, 1001, 200, 80, 0, 40, 40),
    slot(2, 560, 200, 100, *[0] * 7, 50),
    slot(3, 720, 701, 170, 99),
]
"""The shortest bursts, and last ones that are cut."""
POWERS = [
    slot(0, 1000, 1200, 80, 40, 40),
    slot(1, 1000, 1200, 100, 40, 60),
    slot(2, 990, 900, 100, 0, 100),
    slot(3, 1000, 900, 900, 40, 850),
    slot(4, 1000, 200, 100, 40),
]
"""Two outputs with powers of their own, one of them dark now and then."""
THREE = [
    slot(0, 1000, 1500, 80, 40, 40, 40),
    slot(1, 1000, 2000, 100, 40, 60, 50),
    slot(2, 1040, 200, 80, 40, 40, 40),
    slot(3, 1030, 1800, 90, 90, 50, 40),
]
"""Three outputs at once with the shortest bursts and the shortest dark time: the worst case for interrupts."""
FAR = [
    slot(0, 100_000, 130_000, 40_000, 39_960, 40, 39_900),
    slot(1, 80_030, 90_000, 39_990, 33_000, 40, 39_990),
    slot(2, 78_000, 100_000, 39_000, 38_950, 40, 39_000),
]
"""Bursts longer than the short way to the next edge can count, with gaps and ends as short as may be."""


def ideal(slots: Sequence[Slot], cycles: int) -> dict[str, np.ndarray]:
    """Return each light's edges in CPU cycles after the start."""
    edges: dict[str, list[int]] = {}
    for moment in moments(slots, start=0, cycles=cycles):
        if moment.edge is not None:
            edges.setdefault(str(moment.edge.line), []).append(TICK_CYCLES * moment.edge.tick)
    return {line: np.array(cycles) for line, cycles in edges.items()}


def pin_levels_where(trace: Trace, name: str, cycles: np.ndarray) -> np.ndarray:
    """Return what an output was at some moments."""
    return np.searchsorted(trace.edges.get(name, np.zeros(0)), cycles, side="right") % 2


POLL, FLOOD = "poll {ms} CLK a1", "flood {ms} STAT"
PLAYED: list[tuple[AvrBoard, WiringName, list[Slot]]] = [
    *((board, "gated", plan) for board in BOTH for plan in (ROUND, BURSTS)),
    ("atmega328p", "direct", POWERS),
    ("atmega2560", "direct", POWERS),
    ("atmega2560", "direct", THREE),
]


@pytest.mark.parametrize(
    ("board", "wiring", "slots", "load"),
    [(*case, FLOOD) for case in PLAYED]
    + [(*PLAYED[1], POLL)]
    + [pytest.param(*case, POLL, marks=pytest.mark.campaign) for case in (PLAYED[0], *PLAYED[2:])],
)
def test_every_edge_is_where_it_belongs(
    emulate: Callable[..., list[str]],
    upload: Callable[..., list[str]],
    tmp_path: Path,
    board: AvrBoard,
    wiring: WiringName,
    slots: list[Slot],
    load: str,
) -> None:
    cycles = -(-FLASHES // len(slots))
    run_ms = cycles * cycle_ticks(slots) / 2000 + 15
    program = [*upload(slots, wiring=wiring), "send KEEP 2000", f"send RUN {cycles}"]
    parts = [load.format(ms=900), NOISE, "wait 20", "send CLK 1", "send CLK 2"] * int(run_ms / 920 + 1)
    out = emulate([*program, *parts, "wait 50", "send STAT"], board=board, wiring=wiring, trace=tmp_path / "t.csv")
    assert f"fault=none reset=power interlock=closed cycle={cycles} step=0 cycles={cycles}" in out[-1]
    start = next(int(line.split("start=")[1]) for line in out if "start=" in line)
    trace = read_trace(tmp_path / "t.csv")
    expected = ideal(slots, cycles)
    assert trace.lights == tuple(sorted(map(int, expected)))
    boot = int(min(edges[0] for line, edges in trace.edges.items() if line.isdigit())) - TICK_CYCLES * start
    assert 0 < boot < 32_000  # the timer starts within 2 ms of power-on: `start` is true
    for line, edges in expected.items():
        assert np.abs(trace.edges[line] - TICK_CYCLES * start - boot - edges).max() <= BAR_CYCLES


@pytest.mark.parametrize("board", BOTH)
def test_waits_longer_than_the_timer_keep_the_level(
    emulate: Callable[..., list[str]], upload: Callable[..., list[str]], tmp_path: Path, board: AvrBoard
) -> None:
    slots = FAR if board == "atmega2560" else [slot(n, s.duration, s.dark, s.period, *[lit.on for lit in s.lit[:2]])
                                               for n, s in enumerate(FAR)]  # fmt: skip
    script = [*upload(slots, wiring="direct"), "send RUN 4", "poll 1250 CLK 1", "send STAT"]
    out = emulate(script, board=board, wiring="direct", trace=tmp_path / "t.csv")
    assert "cycle=4 step=0 cycles=4" in out[-1]
    trace = read_trace(tmp_path / "t.csv")
    for line, edges in ideal(slots, 4).items():
        found = trace.edges[line]
        assert np.abs(found - found[0] - edges).max() <= BAR_CYCLES


@pytest.mark.parametrize("board", BOTH)
def test_selection_lines_change_only_in_the_dark(
    emulate: Callable[..., list[str]], upload: Callable[..., list[str]], tmp_path: Path, board: AvrBoard
) -> None:
    script = [*upload(BURSTS, wiring="gated"), "send RUN 50", "poll 2100 CLK 1", "send STAT"]
    assert "state=idle" in emulate(script, board=board, trace=tmp_path / "t.csv")[-1]
    trace = read_trace(tmp_path / "t.csv")
    changes = [edges for name, edges in trace.edges.items() if name.startswith("S")]
    assert len(changes) == 4
    assert all(len(edges) >= 100 for edges in changes)
    assert not pin_levels_where(trace, "X0", np.concatenate(changes)).any()
    assert not any(len(edges) % 2 for edges in trace.edges.values())  # all off at the end


def test_a_dark_time_of_seconds_is_counted_to_the_tick(
    emulate: Callable[..., list[str]], upload: Callable[..., list[str]], tmp_path: Path
) -> None:
    slots = [slot(0, 1600, 6_000_001, 1600, 1600)]
    script = [*upload(slots, wiring="gated"), "send RUN 2", "poll 3100 CLK 1", "send STAT"]
    assert "state=running" in emulate(script, board="atmega2560", trace=tmp_path / "t.csv")[-1]
    rises = read_trace(tmp_path / "t.csv").edges["0"][::2]
    assert abs(np.diff(rises)[0] - TICK_CYCLES * 6_001_601) <= BAR_CYCLES


def random_slot(dice: random.Random, number: int, caps: Capabilities) -> Slot:
    """Return a slot that the board takes, often with times at the timer's or a limit's edge."""
    while True:
        period = dice.choice([80, 81, 100, 1000, 32_767, 32_768, 40_000, 65_535, 65_536, dice.randint(80, 100_000)])
        rests = [0, 40, period, 2 * period + 41, 4 * period + dice.randint(40, 80), dice.randint(0, 50_000)]
        dark = dice.choice([200, 201, 32_767, 32_768, 65_535, 65_536, 65_537, dice.randint(200, 200_000)])
        powers = [40, 41, period, period - 40, period // 2, 32_767, 32_768, dice.randint(40, period)]
        on = [dice.choice(powers) for _ in range(caps.powers)]
        lines = dice.sample(range(caps.lines), dice.randint(0, min(3, caps.lines)))
        lit = tuple(Lit(line=line, on=on[line % caps.powers]) for line in lines)
        made = Slot(slot=number, duration=period + dice.choice(rests), dark=dark, period=period, lit=lit)
        if slot_refusal(made, caps) is None:
            return made


@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(seed, marks=pytest.mark.campaign) for seed in range(4, 12))]
)
def test_any_cycle_that_is_taken_is_played_to_the_tick(
    emulate: Callable[..., list[str]], upload: Callable[..., list[str]], tmp_path: Path, seed: int
) -> None:
    dice = random.Random(seed)
    board, wiring = dice.choice(BOTH), dice.choice(WIRINGS)
    caps = capabilities(BOARDS[board], wiring)
    slots: list[Slot] = []
    while not slots or cycle_refusal(slots, caps) or not any(each.lit for each in slots):
        slots = [random_slot(dice, number, caps) for number in range(dice.randint(1, 6))]
    cycles = max(1, 600_000 // cycle_ticks(slots))
    script = [
        *upload(slots, wiring=wiring),
        f"send RUN {cycles}",
        "flood 400 STAT",
        "bytes 0a",
        "wait 550",
        "send STAT",
    ]
    assert f"cycles={cycles}" in emulate(script, board=board, wiring=wiring, trace=tmp_path / "t.csv")[-1]
    trace = read_trace(tmp_path / "t.csv")
    expected = ideal(slots, cycles)
    assert trace.lights == tuple(sorted(map(int, expected)))
    begin = min(trace.edges[line][0] - edges[0] for line, edges in expected.items())
    for line, edges in expected.items():
        assert np.abs(trace.edges[line] - begin - edges).max() <= BAR_CYCLES


def test_trimmed_steps_are_never_late_where_bursts_are_shortest(
    emulate: Callable[..., list[str]], upload: Callable[..., list[str]], tmp_path: Path
) -> None:
    lit = ([40, 40, 40], [0, 40, 40], [40, 0, 40], [0, 0, 40])
    slots = [slot(n, 1000, 420, 80, *on) for n, on in enumerate(lit)]
    script = [*upload(slots, wiring="direct"), "send RUN 0", "wait 12", "send TRIM sooner 10000", "flood 150 STAT"]
    script += ["bytes 0a", "wait 40", "send TRIM later 20000", "flood 150 STAT", "bytes 0a", "wait 40", "send STAT"]
    said = emulate(script, board="atmega2560", wiring="direct", trace=tmp_path / "t.csv")
    assert "state=running fault=none" in said[-1]
    trace = read_trace(tmp_path / "t.csv")
    starts = [trace.pulses(line)[:, 0] for line in (0, 1, 2)]
    assert len(starts[2]) > 1000
    assert set(starts[0][:-9]) <= set(starts[2]), "all outputs keep step"
    assert set(starts[1][:-9]) <= set(starts[2])
