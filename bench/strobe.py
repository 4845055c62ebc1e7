"""Strobe edges of the real firmware in emulation, against the ticks that the plan asks for."""

import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.table import Row
from psvideo.formats.trace_csv import Trace, read_trace
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.protocol import format_request
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.program import Program, make_program
from psvideo.strobe.stand_ins.emulated import play_script
from psvideo.strobe.stand_ins.playing import moments
from psvideo.strobe.stand_ins.toolchain import AVR_BOARDS, AvrBoard

FLASHES = 10_000
BAR_CYCLES = 4
CYCLES_PER_TICK = 8
LOADS: dict[str, Callable[[int], list[str]]] = {
    "a STAT a second": lambda ms: [line for _ in range(ms // 1000 + 1) for line in ("wait 1000", "send STAT")],
    "requests without a pause": lambda ms: [f"poll {ms} CLK 0123abcd"],
}
"""What the host sends while lights run for some milliseconds, as a script (lights/emulator/script.h)."""


@dataclass(frozen=True, kw_only=True)
class Case:
    """A plan and how its lights hang on the board."""

    what: str
    plan: Plan
    wiring: WiringName


@dataclass(frozen=True, kw_only=True)
class EdgeErrors:
    """How far traced edges lie from where they belong, in CPU cycles, counted from the run's first edge on."""

    flashes: int
    edges: int
    largest: int
    drift: float
    missing: int


def rows() -> Iterator[Row]:
    """Play every case on both chips under every load."""
    for case in cases():
        for board in AVR_BOARDS:
            for load in LOADS:
                found = measure(case, board, load)
                figure = (
                    f"{found.flashes} flashes, {found.edges} edges: error {found.largest}, drift {found.drift:.2g}"
                    + (f", {found.missing} edges MISSING" if found.missing else "")
                )
                met = found.largest <= BAR_CYCLES and not found.missing and found.flashes >= FLASHES
                yield Row(f"{case.what}; {board}; {load}", figure, f"<= {BAR_CYCLES} cycles", met)


def cases() -> tuple[Case, ...]:
    """Return three plans: an ordinary one, S-matrix patterns of eight lights, and bursts of uneven lengths."""
    return (
        Case(
            what="3 lights, 0.8 ms at 119.88 fps, dark slot, gated",
            plan=_plan([{"a": 1.0}, {"b": 1.0}, {"c": 1.0}, {}], [0.0008] * 4, dark_s=1001 / 120_000),
            wiring="gated",
        ),
        Case(
            what="8 lights, S-matrix, 0.3 ms every 1.3 ms, gated",
            plan=_plan(_s_matrix(), [0.0003] * 7, dark_s=0.001),
            wiring="gated",
        ),
        Case(
            what="2 lights in bursts, 0.1 to 1.6 ms (HDR), direct",
            plan=_plan(
                [{"a": 0.5, "b": 0.25}, {"a": 1.0}, {"b": 1.0}, {"a": 0.3}, {"a": 0.4, "b": 1.0}],
                [0.0008, 0.0001, 0.0016, 0.0004, 0.0008],
                dark_s=0.00077,
            ),
            wiring="direct",
        ),
    )


def _s_matrix() -> list[dict[str, float]]:
    """Return seven flashes of the quadratic residues' pattern over seven lights, the eighth with every other one."""
    names, residues = "abcdefg", {0, 1, 2, 4}
    rows = [{name: 1.0 for k, name in enumerate(names) if (k + shift) % 7 in residues} for shift in range(7)]
    return [row | ({"h": 1.0} if number % 2 else {}) for number, row in enumerate(rows)]


def _plan(lights: list[dict[str, float]], durations_s: list[float], *, dark_s: float) -> Plan:
    camera = Camera(width_px=8, height_px=8, fps=Fraction(120_000, 1001), exposure_s=0.0005, readout_s=0.0001)
    flashes = tuple(PlannedFlash(lights=lit, duration_s=d) for lit, d in zip(lights, durations_s, strict=True))
    return Plan(camera=camera, flashes=flashes, dark_s=dark_s)


def measure(case: Case, board: AvrBoard, load: str, *, flashes: int = FLASHES) -> EdgeErrors:
    """Run a case for at least so many lit flashes and hold its edges against the program's ticks."""
    program = make_program(case.plan, capabilities(BOARDS[board], case.wiring))
    lit = sum(bool(slot.lit) for slot in program.cycle)
    cycles = -(-flashes // lit)
    run_ms = int(cycles * program.cycle_ticks * program.tick_ps / 1e9) + 20
    with tempfile.TemporaryDirectory() as folder:
        trace = Path(folder) / "trace.csv"
        play_script(
            _script(program, case.wiring, cycles, LOADS[load](run_ms)), board=board, wiring=case.wiring, trace=trace
        )
        return edge_errors(read_trace(trace), expected_edges(program, cycles), flashes=cycles * lit)


def _script(program: Program, wiring: WiringName, cycles: int, meanwhile: list[str]) -> str:
    upload = [f"send {format_request(request, sealed=False).decode().strip()}" for request in program.upload()]
    return "\n".join(
        [
            "wait 20",
            f"send WIRING {wiring}",
            "send KEEP 2000",
            *upload,
            f"send RUN {cycles}",
            *meanwhile,
            "wait 100",
            "",
        ]
    )


def expected_edges(program: Program, cycles: int) -> dict[int, NDArray[np.int64]]:
    """Return each line's edges in CPU cycles after the run's start."""
    one: dict[int, list[int]] = {}
    for moment in moments(program.cycle, start=0, cycles=1):
        if moment.edge is not None:
            one.setdefault(moment.edge.line, []).append(moment.edge.tick)
    starts = program.cycle_ticks * np.arange(cycles, dtype=np.int64)[:, None]
    return {line: CYCLES_PER_TICK * (starts + np.array(ticks)).ravel() for line, ticks in one.items()}


def edge_errors(trace: Trace, expected: Mapping[int, NDArray[np.int64]], *, flashes: int) -> EdgeErrors:
    """Hold a trace against the edges that belong into it."""
    found = {line: trace.edges.get(str(line), np.zeros(0, np.int64)) for line in expected}
    missing = sum(abs(found[line].size - expected[line].size) for line in expected)
    begin = min(int(edges[0]) for edges in found.values() if edges.size) - min(int(e[0]) for e in expected.values())
    errors = [found[n][: expected[n].size] - expected[n][: found[n].size] - begin for n in expected]
    late = [float(np.mean(error[-100:]) - np.mean(error[:100])) for error in errors if error.size]
    return EdgeErrors(
        flashes=flashes if not missing else 0,
        edges=sum(edges.size for edges in found.values()),
        largest=max(int(np.abs(error).max()) for error in errors if error.size),
        drift=max(late, key=abs),
        missing=missing,
    )
