"""The trace of an emulated run: every edge of a strobe controller's lights and pins (lights/protocol.md, "Pins").

    # psvideo-trace/1 board=atmega328p hz=16000000 wiring=gated
    cycle,line,level
    160000,0,1

``cycle`` counts the controller's clock (``hz``) from power-on; ``line`` is a light's number or a pin's name.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.formats.contract import read_text
from psvideo.model.arrays import Integers

SCHEMA = "psvideo-trace/1"
COLUMNS = "cycle,line,level"
HEAD = re.compile(r"# psvideo-trace/(\d+) board=(\S+) hz=([1-9]\d*) wiring=(gated|direct)\Z")
ROW = re.compile(r"(\d{1,18}),(\d{1,3}|[A-Z]\d{1,2}),([01])\Z")


@dataclass(frozen=True, kw_only=True)
class Trace:
    """What the outputs did. ``edges`` holds for each light's number or pin's name the cycles at which it changed.

    Everything is dark at first, so the even edges of an output (0, 2, …) switch it on and the odd ones off.
    """

    board: str
    hz: int
    wiring: str
    edges: Mapping[str, Integers]

    def pulses(self, line: int) -> NDArray[np.int64]:
        """Return a light's pulses as cycles (pulse, 2): on from the first to the second; one still on is left out."""
        edges = self.edges.get(str(line), np.zeros(0, np.int64))
        return edges[: edges.size // 2 * 2].reshape(-1, 2)

    @property
    def lights(self) -> tuple[int, ...]:
        """The numbers of the lights that were ever on."""
        return tuple(sorted(int(name) for name in self.edges if name.isdecimal()))


def read_trace(path: Path) -> Trace:
    """Read a trace. Raises PsvideoError that names file and line, what was found and what was expected."""
    lines = read_text(path).splitlines()
    head = HEAD.match(lines[0]) if lines else None
    if head is None or lines[1:2] != [COLUMNS]:
        raise PsvideoError(
            f"{path}: is not the trace of an emulated run: expected '# {SCHEMA} board=… hz=… wiring=…' and a line "
            f"{COLUMNS!r} at its top. Make one with psvideo strobe emulate and its `trace`."
        )
    if head[1] != "1":
        raise PsvideoError(f"{path}: was written as psvideo-trace/{head[1]}; this psvideo reads {SCHEMA}. Update it.")
    edges = {name: np.array(cycles, np.int64) for name, cycles in _edges(path, lines[2:]).items()}
    return Trace(board=head[2], hz=int(head[3]), wiring=head[4], edges=edges)


def _edges(path: Path, rows: Iterable[str]) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    latest = 0
    for number, row in enumerate(rows, start=3):
        match = ROW.match(row)
        if match is None:
            raise _broken(path, number, f"found {row[:40]!r}, expected cycle,line,level such as 160000,0,1")
        cycles = found.setdefault(match[2], [])
        if int(match[1]) < latest:
            raise _broken(path, number, f"cycle {match[1]} comes after {latest}")
        if len(cycles) % 2 != 1 - int(match[3]):
            raise _broken(path, number, f"{match[2]} goes to {match[3]} and is {match[3]} already")
        latest = int(match[1])
        cycles.append(latest)
    return found


def _broken(path: Path, number: int, found: str) -> PsvideoError:
    return PsvideoError(f"{path}, line {number}: {found}. The trace is damaged or was cut: emulate the run again.")


class TraceWriter:
    """Writes a trace edge by edge."""

    def __init__(self, file: TextIO, *, board: str, hz: int, wiring: str) -> None:
        self._file = file
        file.write(f"# {SCHEMA} board={board} hz={hz} wiring={wiring}\n{COLUMNS}\n")

    def write(self, edges: Iterable[tuple[int, int | str, int]]) -> None:
        """Append edges (cycle, line, level) in order of time."""
        self._file.writelines(f"{cycle},{line},{level}\n" for cycle, line, level in edges)


def merged_pulses(trace: Trace, lines: Iterable[int]) -> Iterator[tuple[int, int, int]]:
    """Yield (on, off, line) of several lights' pulses in order of time."""
    pulses = [(int(on), int(off), line) for line in lines for on, off in trace.pulses(line)]
    yield from sorted(pulses)
