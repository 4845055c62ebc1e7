"""The real firmware and the Python board answer alike and switch alike, and nothing lights that must not.

The firmware runs on emulated chips (lights/emulator), as fast as it goes; both play the same scripts. Where the tools
to build it are missing these tests fail and name the packages: they are never skipped.
"""

import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.formats.trace_csv import Trace, TraceWriter, read_trace
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.protocol import format_request
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.program import Program, make_program
from psvideo.strobe.stand_ins import toolchain
from psvideo.strobe.stand_ins.emulated import play_script
from psvideo.strobe.stand_ins.python_board import PythonBoard
from psvideo.strobe.stand_ins.toolchain import AVR_BOARDS, AvrBoard

TICKS_PER_MS = 2000
CYCLES_PER_TICK = 8
TICKS_PER_BYTE = 170

Play = Callable[..., tuple[list[str], Trace]]


class PythonPlayer:
    """Plays scripts of lights/emulator/script.h on the controller in Python, in virtual time."""

    def __init__(self, board: str) -> None:
        self.controller = PythonBoard(BOARDS[board])
        self.now = 0
        self.said: list[str] = []

    def play(self, script: str) -> list[str]:
        for line in script.splitlines():
            word, _, rest = line.partition(" ")
            if word:
                getattr(self, word)(rest)
        return self.said

    def _feed(self, data: bytes) -> list[str]:
        self.now += TICKS_PER_BYTE * len(data)
        replies = self.controller.feed(data, self.now).decode("ascii").splitlines()
        self.now += TICKS_PER_BYTE * sum(len(reply) + 1 for reply in replies)
        return replies

    def send(self, text: str) -> None:
        self.said += self._feed(text.encode("latin-1") + b"\n") or ["no reply"]

    def bytes(self, digits: str) -> None:
        self.said += self._feed(bytes.fromhex(digits))

    def wait(self, milliseconds: str) -> None:
        self.now += int(float(milliseconds) * TICKS_PER_MS)
        self.controller.advance(self.now)

    def poll(self, rest: str) -> None:
        milliseconds, _, text = rest.partition(" ")
        end = self.now + int(milliseconds) * TICKS_PER_MS
        while self.now < end:
            self._feed(text.encode() + b"\n")

    def open(self, _: str) -> None:
        self.controller.set_interlock("open", self.now)

    def close(self, _: str) -> None:
        self.controller.set_interlock("closed", self.now)

    def hang(self, _: str) -> None:
        self.controller.restart("watchdog", self.now)

    def reset(self, _: str) -> None:
        self.controller.restart("external", self.now)


@pytest.fixture(params=[*AVR_BOARDS, *(f"python as {board}" for board in AVR_BOARDS)])
def play(request: pytest.FixtureRequest, tmp_path: Path) -> Play:
    """Play a script on one of the contenders; give what was answered (without cycles) and the trace of its lights."""
    board = request.param.removeprefix("python as ")

    def on_chip(script: str, *, wiring: WiringName = "gated") -> tuple[list[str], Trace]:
        said = play_script(f"wait 20\n{script}", board=board, wiring=wiring, trace=tmp_path / "trace.csv")
        replies = [line.partition(" ")[2] for line in said]
        return [reply.removeprefix("< ") for reply in replies if reply[0] == "<"], read_trace(tmp_path / "trace.csv")

    def in_python(script: str, *, wiring: WiringName = "gated") -> tuple[list[str], Trace]:
        python = PythonPlayer(board)
        said = python.play(f"wait 20\n{script}")
        with (tmp_path / "trace.csv").open("w") as file:
            TraceWriter(file, board=board, hz=16_000_000, wiring=wiring).write(
                (CYCLES_PER_TICK * edge.tick, edge.line, edge.level) for edge in python.controller.edges
            )
        return said, read_trace(tmp_path / "trace.csv")

    return in_python if request.param.startswith("python") else on_chip


def codes(replies: Sequence[str]) -> list[str]:
    """Return replies without what may differ: errors' texts, moments, and who answers."""
    alike = [re.sub(r"^(E \d+)[^*]*.*", r"\1", reply) for reply in replies]
    return [re.sub(r"\b(ticks|start|board|firmware|unit)=[^ *]+(\*.*)?", r"\1=", reply) for reply in alike]


def both(script: str, *, board: AvrBoard) -> tuple[list[str], list[str]]:
    """Return what firmware and Python board answer to the same script."""
    said = play_script(f"wait 20\n{script}", board=board)
    chip = [line.partition(" < ")[2] for line in said if " < " in line]
    return codes(chip), codes(PythonPlayer(board).play(f"wait 20\n{script}"))


def plan_of(*flashes: tuple[dict[str, float], float], dark_s: float = 0.002) -> Plan:
    camera = Camera(width_px=8, height_px=8, fps=Fraction(100), exposure_s=0.001, readout_s=0.001)
    listed = tuple(PlannedFlash(lights=lights, duration_s=duration_s) for lights, duration_s in flashes)
    return Plan(camera=camera, flashes=listed, dark_s=dark_s)


THREE = plan_of(({"a": 1.0}, 0.0008), ({"b": 1.0}, 0.0008), ({"a": 1.0, "c": 1.0}, 0.0004), ({}, 0.0008))
BURSTS = plan_of(({"a": 0.5, "b": 0.25}, 0.0008), ({"b": 1.0}, 0.0003), ({"a": 0.3, "b": 1.0}, 0.0017))
GATED_BURSTS = plan_of(({"a": 0.5, "b": 0.5}, 0.0008), ({"c": 0.2}, 0.0013), ({"h": 1.0}, 0.00002), dark_s=0.0001)


def upload(program: Program, wiring: WiringName = "gated") -> str:
    lines = [format_request(request, sealed=False).decode().strip() for request in program.upload()]
    return "\n".join(f"send {line}" for line in (f"WIRING {wiring}", "KEEP 2000", *lines))


def program_of(plan: Plan, wiring: WiringName = "gated", board: str = "atmega328p") -> Program:
    return make_program(plan, capabilities(BOARDS[board], wiring))


def wanted_edges(program: Program, cycles: int) -> dict[int, NDArray[np.int64]]:
    """Return each line's edges in CPU cycles after the run's start, straight from the meaning of a slot."""
    found: dict[int, list[int]] = {}
    tick = 0
    for slot in program.cycle * cycles:
        for lit in slot.lit:
            for begin in range(tick, tick + slot.duration, slot.period):
                edges = found.setdefault(lit.line, [])
                if edges and edges[-1] == begin:
                    edges.pop()
                else:
                    edges.append(begin)
                edges.append(min(begin + lit.on, tick + slot.duration))
        tick += slot.duration + slot.dark
    return {line: CYCLES_PER_TICK * np.array(edges) for line, edges in found.items()}


def test_the_tools_to_run_the_real_firmware_are_here() -> None:
    assert toolchain.lights_folder() is not None
    assert not toolchain.missing_packages(), f"sudo apt-get install {' '.join(toolchain.PACKAGES)}"


@pytest.mark.parametrize(
    ("plan", "wiring"),
    [(THREE, "gated"), (BURSTS, "direct"), (GATED_BURSTS, "gated")],
    ids=["three", "bursts", "short"],
)
@pytest.mark.parametrize("load", ["wait {ms}", "poll {ms} STAT"])
def test_every_edge_is_where_the_program_has_it(play: Play, plan: Plan, wiring: WiringName, load: str) -> None:
    program = program_of(plan, wiring)
    cycles = 50
    ms = cycles * program.cycle_ticks // TICKS_PER_MS + 50
    replies, trace = play(
        f"{upload(program, wiring)}\nsend RUN {cycles}\n{load.format(ms=ms)}\nsend STAT\n", wiring=wiring
    )
    assert replies[-1] == (
        f"OK state=idle fault=none reset=power interlock=closed cycle={cycles} step=0 cycles={cycles}"
    ), replies
    wanted = wanted_edges(program, cycles)
    assert {str(line) for line in wanted} == {name for name in trace.edges if name.isdigit()}
    begin = min(int(trace.edges[str(line)][0]) for line in wanted)
    for line, edges in wanted.items():
        np.testing.assert_array_equal(trace.edges[str(line)] - begin, edges)


def test_nothing_lights_without_being_asked(play: Play) -> None:
    program = program_of(THREE)
    _, trace = play(f"wait 500\n{upload(program)}\nwait 500\nsend STOP\nsend STAT\n")
    assert not trace.lights


ENDS = {
    "the host is silent": ("wait 2500", "silent", 0.01),
    "the interlock opens": ("poll 40 STAT\nopen\nwait 200\nclose", "interlock", 0.01),
    "the program hangs": ("poll 40 STAT\nhang\nwait 2000", "watchdog", 0.15),
}
"""What happens during a run with flashes of 10 ms, the fault that follows, and how long light may last at most: a chip
whose program hangs in a flash stays as it is until its watchdog bites."""


@pytest.mark.parametrize("end", ENDS)
def test_a_fault_makes_it_dark_and_latches(play: Play, end: str) -> None:
    script, fault, longest_s = ENDS[end]
    program = program_of(plan_of(({"a": 1.0}, 0.01), dark_s=0.011))
    replies, trace = play(
        f"{upload(program)}\nsend RUN 0\n{script}\nsend STAT\nsend RUN 1\nwait 100\nsend CLEAR\nsend STAT\n"
    )
    assert re.match(rf"OK state=fault fault={fault} ", replies[-4]), replies
    assert replies[-3].startswith("E 12")
    assert replies[-2] == "OK state=idle"
    assert "state=idle fault=none" in replies[-1]
    edges = trace.edges["0"]
    assert edges.size % 2 == 0, "the light was left on"
    assert np.diff(edges)[::2].max() <= longest_s * trace.hz


def test_the_keep_alive_ends_the_light_in_time(play: Play) -> None:
    program = program_of(plan_of(({"a": 1.0}, 0.01), dark_s=0.011))
    _, trace = play(f"{upload(program)}\nsend KEEP 100\nsend RUN 0\nwait 1000\n")
    lasted_s = (trace.edges["0"][-1] - trace.edges["0"][0]) / trace.hz
    assert 0.06 <= lasted_s <= 0.1


def test_stop_darkens_in_the_middle_of_a_flash(play: Play) -> None:
    program = program_of(plan_of(({"a": 1.0}, 0.05), dark_s=0.06))
    replies, trace = play(f"{upload(program)}\nsend RUN 0\nwait 30\nsend STOP\nwait 300\nsend STAT\n")
    assert replies[-2] == "OK state=idle cycles=0"
    assert trace.edges["0"].size == 2
    assert np.diff(trace.edges["0"])[0] / trace.hz < 0.03


def test_a_run_after_a_stopped_one_is_whole(play: Play) -> None:
    program = program_of(BURSTS, "direct")
    again = f"send ARM {program.check}\nsend RUN 3\nwait 100\nsend STAT\n"
    replies, trace = play(f"{upload(program, 'direct')}\nsend RUN 0\nwait 21.3\nsend STOP\n{again}", wiring="direct")
    assert " cycles=3" in replies[-1], replies
    for line, edges in wanted_edges(program, 3).items():
        found = trace.edges[str(line)][-edges.size :]
        np.testing.assert_array_equal(np.diff(found), np.diff(edges))


def test_a_reset_forgets_everything_and_says_so(play: Play) -> None:
    program = program_of(THREE)
    replies, trace = play(
        f"{upload(program)}\nsend RUN 0\nwait 40\nreset\nwait 100\nsend STAT\nsend ARM {program.check}\n"
    )
    assert replies[-2].startswith("OK state=idle fault=none reset=external ")
    assert replies[-1].startswith("E 10")
    assert all(edges.size % 2 == 0 for edges in trace.edges.values() if edges is not trace.edges.get("X0"))


REQUESTS = """
ID
ID*9E5C
CAPS
CAPS now
WIRING sideways
WIRING direct
CAPS
SLOT 0 1600 16685 1600 0:1600 1:800
SLOT 0 1600 16685 100 0:50 1:60
SLOT 0 1600 16685 100 0:50 0:60
SLOT 0 1600 16685 100 5:50
WIRING gated
SLOT 0 1600 16685 100 0:50 1:60
SLOT 0 1600 16685 100 0:50 1:50
SLOT 0 0 16685 100
SLOT 0 1600 16685 1600
SLOT 1 100001 16685 1600 0:40
SLOT 1 1600 199 1600 0:40
SLOT 1 1600 2147483648 1600 0:40
SLOT 1 1600 2147483647 1600 0:40
SLOT 1 1600 16685 1601 0:40
SLOT 1 1600 16685 0 0:40
SLOT 1 1600 16685 1600 0:39
SLOT 1 1600 16685 1600 0:1601
SLOT 1 1600 16685 1600 0:0
SLOT 1 1600 16685 79 0:40
SLOT 1 1600 16685 80 0:40
SLOT 1 1630 16685 100 0:50
SLOT 1 1640 16685 100 0:50
SLOT 16 1600 16685 1600 0:40
SLOT 32 1600 16685 1600 0:40
SLOT 1 1600 16685 1600 8:40
SLOT 1 4294967296 16685 1600 0:40
SLOT 1 4294967295 16685 1600 0:40
SLOT 1 -1 16685 1600 0:40
SLOT 1 +1 16685 1600 0:40
SLOT 01 0001600 16685 1600 0:40
SLOT 1 1600 16685 1600 0:
SLOT 1 1600 16685 1600 :40
SLOT 1 1600 16685 1600 0:40:1
SLOT 1 1600 16685
SLOT 1 1600 16685 1600 0:40 1:40 2:40 3:40 4:40 5:40 6:40 7:40
STEPS 0
STEPS 1 0
STEPS 0 0 1 3
STEPS 0 0 1 99
ARM 0
STEPS 0 0 1
STEPS 3 1
ARM 1
ARM 65536
RUN 1
KEEP 99
KEEP 100
KEEP 2000
KEEP 2001
CLK
CLK abcdefgh
CLK abcdefghi
CLK ab-c
CLEAR
STAT
NEW
STOP
stat
STAT
 STAT
STAT\x20
STAT  x
FOO
STAT*FFFF
STAT*
STAT*12
STAT*12345
*
"""


@pytest.mark.parametrize("board", AVR_BOARDS)
def test_firmware_and_python_board_answer_alike(board: AvrBoard) -> None:
    lines = REQUESTS.strip("\n").splitlines()
    chip, python = both("\n".join(f"send {line}" for line in lines), board=board)
    assert [*zip(lines, chip, strict=True)] == [*zip(lines, python, strict=True)]


WORDS = (
    *(
        "ID",
        "CAPS",
        "WIRING",
        "KEEP",
        "NEW",
        "SLOT",
        "STEPS",
        "ARM",
        "RUN",
        "STOP",
        "STAT",
        "CLK",
        "CLEAR",
        "FOO",
        "slot",
    ),
    *(
        "0",
        "1",
        "2",
        "7",
        "39",
        "40",
        "80",
        "100",
        "199",
        "200",
        "1600",
        "16685",
        "100000",
        "4294967295",
        "99999999999",
    ),
    *("0:40", "1:40", "1:1600", "7:100", "8:40", "gated", "direct", "abc", "*", "*0000", "", "-1", ":", "x:y"),
)


@pytest.mark.parametrize("board", AVR_BOARDS)
def test_they_answer_alike_to_what_nobody_should_send(board: AvrBoard) -> None:
    rng = np.random.default_rng(7)
    lines = [" ".join(rng.choice(WORDS, rng.integers(1, 9))) for _ in range(400)]
    lines += [f"SLOT {' '.join(rng.choice(WORDS[15:30], 4))} {rng.choice(WORDS[30:35])}" for _ in range(400)]
    sendable = [line for line in lines if line.strip("\r") and not line.startswith("RUN")]
    chip, python = both("\n".join(f"send {line}" for line in sendable), board=board)
    assert [*zip(sendable, chip, strict=True)] == [*zip(sendable, python, strict=True)]


BAD_BYTES = {
    "a byte that is not printable": "53 54 07 41 54 0a",
    "a byte beyond ASCII": "53 54 c3 a9 54 0a",
    "CR before LF": "53 54 41 54 0d 0a",
    "CR inside": "53 54 0d 41 54 0a",
    "empty lines": "0a 0a 0d 0a",
    "96 bytes": "20 " * 96 + "0a",
    "97 bytes": "20 " * 97 + "0a",
    "a thousand bytes": "41 " * 1000 + "0a",
    "long and spoilt": "41 " * 50 + "07 " + "41 " * 80 + "0a",
    "half a line, then another": "53 54",
}


@pytest.mark.parametrize("board", AVR_BOARDS)
def test_they_answer_alike_to_bytes_that_are_no_line(board: AvrBoard) -> None:
    script = "\n".join(f"bytes {digits.strip()}\nwait 120\nsend STAT" for digits in BAD_BYTES.values())
    chip, python = both(script, board=board)
    assert chip == python


@pytest.mark.parametrize("board", AVR_BOARDS)
def test_a_line_that_is_never_quiet_moves_no_edge_and_ends_in_the_dark(board: AvrBoard, tmp_path: Path) -> None:
    """A host that does not wait for replies spoils its own lines; it is as good as silent, and it shifts no light."""
    program = program_of(THREE, board=board)
    said = play_script(
        f"wait 20\n{upload(program)}\nsend KEEP 500\nsend RUN 0\nflood 1000 STAT\n"
        "wait 100\nbytes 0a\nwait 20\nsend STAT\n",
        board=board,
        trace=tmp_path / "trace.csv",
    )
    trace = read_trace(tmp_path / "trace.csv")
    wanted = wanted_edges(program, 100)
    begin = min(int(edges[0]) for name, edges in trace.edges.items() if name.isdigit())
    for line, edges in wanted.items():
        found = trace.edges[str(line)] - begin
        assert found.size >= 40
        np.testing.assert_array_equal(found[:-2], edges[: found.size - 2])
    assert re.search(r"state=fault fault=silent", said[-1])
    replies, errors, lost = next(map(int, line.split()[2:]) for line in said if line.split()[1] == "=")
    assert lost > 100, "the receiver holds three bytes, and the firmware reads none while it replies"
    assert errors > replies / 2


@pytest.mark.parametrize("board", AVR_BOARDS)
def test_a_request_that_comes_into_a_reply_is_lost_and_said_to_be(board: AvrBoard) -> None:
    """The receiver holds three bytes, as the silicon's does: here a line feed ends what is left of the second."""
    two = (b"STAT\n" * 2).hex()
    said = play_script(f"wait 20\nbytes {two}\nwait 50\nbytes 0a\nwait 20\nsend STAT\n", board=board)
    assert [line.split()[2] + line.split()[3][:1] for line in said] == ["OKs", "E1", "OKs"]


def test_the_trace_names_pins_and_lights(tmp_path: Path) -> None:
    program = program_of(plan_of(({"a": 1.0, "b": 1.0}, 0.001)))
    play_script(f"wait 20\n{upload(program)}\nsend RUN 1\nwait 50\n", board="atmega328p", trace=tmp_path / "t.csv")
    trace = read_trace(tmp_path / "t.csv")
    assert (trace.board, trace.hz, trace.wiring) == ("atmega328p", 16_000_000, "gated")
    for light, pin in (("0", "S0"), ("1", "S1")):
        assert trace.edges[pin][0] < trace.edges["X0"][0] == trace.edges[light][0], "selected in the dark"
        assert trace.edges[pin][-1] > trace.edges["X0"][-1] == trace.edges[light][-1]


SLOW = plan_of(({"a": 1.0}, 0.014), ({"b": 1.0}, 0.014), ({}, 0.014), dark_s=0.05)
"""64 ms a step, so that a request falls into the same step on every board."""
TRIMS = ((100, "later 700"), (320, "sooner 20000"), (320, "later 0"), (295, "later 3"))


@pytest.mark.parametrize(("board", "wiring"), [("atmega328p", "gated"), ("atmega2560", "direct")])
def test_a_trim_moves_flashes_as_the_python_board_does(board: AvrBoard, wiring: WiringName, tmp_path: Path) -> None:
    program = program_of(SLOW, wiring, board=board)
    script = f"wait 20\n{upload(program, wiring)}\nsend RUN 0\n"
    script += (
        "".join(f"wait {ms}\nsend TRIM {trim}\nsend TRIM later 9\n" for ms, trim in TRIMS)
        + "wait 1700\nsend STAT\nsend STOP\n"
    )
    printed = play_script(script, board=board, wiring=wiring, trace=tmp_path / "trace.csv")
    said = [line.partition(" < ")[2] for line in printed]
    python = PythonPlayer(board)
    assert codes(said) == codes(python.play(script))
    trace, edges = read_trace(tmp_path / "trace.csv"), python.controller.edges
    first_cycle = min(int(trace.edges[str(line)][0]) for line in trace.lights)
    for line in (0, 1):
        wanted = np.array([edge.tick for edge in edges if edge.line == line]) - edges[0].tick
        got = trace.edges[str(line)] - first_cycle
        assert len(wanted) > 20
        np.testing.assert_array_equal(got, CYCLES_PER_TICK * wanted)
        assert (np.diff(wanted)[::2] == 28_000).all(), "a flash is as long as it was"
    apart = np.diff([edge.tick for edge in edges if edge.line == 0 and edge.level])
    cycle = program.cycle_ticks
    assert apart.min() == cycle * 0.98, "20,000 ppm less"
    assert abs(apart[-6:].sum() - 6 * cycle * (1 + 3e-6)) <= 1, "a share of a tick is not lost"


@pytest.mark.parametrize(
    ("trim", "code"),
    [
        ("later 20000", "OK"),
        ("later 20001", "E 7"),
        ("sooner 10000", "OK"),
        ("sooner 20000", "E 9"),
        ("slower 1", "E 6"),
        ("later -1", "E 6"),
        ("later", "E 5"),
    ],
)
def test_a_trim_never_passes_a_limit(trim: str, code: str) -> None:
    program = program_of(plan_of(({"a": 1.0}, 0.002), ({}, 0.002), dark_s=0.000_23))
    script = f"{upload(program)}\nsend TRIM {trim}\nsend RUN 0\nsend TRIM {trim}\n"
    chip, python = both(script, board="atmega328p")
    assert chip == python
    assert chip[-1].startswith(code)
    assert chip[-3].startswith("E 8"), "before the run there is nothing to trim"


def test_a_trim_that_makes_a_light_shine_too_long_is_refused() -> None:
    program = program_of(plan_of(({"a": 1.0}, 0.002), dark_s=0.002_01))
    script = f"{upload(program)}\nsend RUN 0\nwait 40\nsend TRIM sooner 2000\nwait 30\nsend TRIM sooner 3000\n"
    chip, python = both(script, board="atmega328p")
    assert chip == python
    assert [reply[:3] for reply in chip[-2:]] == ["OK ", "E 9"]


def test_a_run_that_is_trimmed_ends_behind_its_last_cycle() -> None:
    program = program_of(SLOW)
    script = f"{upload(program)}\nsend RUN 4\n"
    script += "wait 20\nsend TRIM sooner 20000\nwait 710\nsend STAT\nwait 60\nsend STAT\n"
    chip, python = both(script, board="atmega328p")
    assert chip == python
    assert "state=running" in chip[-2]
    assert "state=idle" in chip[-1]
    assert "cycles=4" in chip[-1]
