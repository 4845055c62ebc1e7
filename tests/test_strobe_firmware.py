"""The firmware keeps the page and the table of the strobe link, and goes dark whatever happens; all in emulation."""

import importlib.util
import random
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from psvideo.formats.trace_csv import read_trace
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.lines import LONGEST_REPLY, LONGEST_REQUEST, Error, seal
from psvideo.strobe.link.protocol import format_reply
from psvideo.strobe.link.requests import Caps, Lit, Slot
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.stand_ins.python_board import PythonBoard
from psvideo.strobe.stand_ins.toolchain import AvrBoard

LIGHTS = Path(__file__).resolve().parents[1] / "lights"
BOTH: tuple[AvrBoard, ...] = ("atmega328p", "atmega2560")
MS = 16_000
"""CPU cycles in a millisecond."""
AT_ONCE_MS = 3
WATCHDOG_MS = 250

Emulate = Callable[..., list[str]]
FLASH = [Slot(slot=0, duration=60_000, dark=70_000, period=60_000, lit=(Lit(line=1, on=60_000),))]
"""30 ms of light, 35 ms dark."""
BURSTS = [Slot(slot=0, duration=99_990, dark=110_000, period=90, lit=(Lit(line=0, on=50), Lit(line=1, on=50)))]


def replies(printed: Sequence[str]) -> list[str]:
    """Return the replies' texts."""
    return [line.split(" < ")[1] for line in printed if " < " in line]


def cycle_of(printed: Sequence[str], text: str) -> int:
    """Return when a line was printed, in CPU cycles."""
    return next(int(line.split()[0]) for line in printed if text in line)


def last_edge(trace: Path, line: str = "1") -> tuple[int, bool]:
    """Return when a light changed for the last time, and whether it is on since."""
    edges = read_trace(trace).edges[line]
    return int(edges[-1]), len(edges) % 2 == 1


def hang_request(how: str) -> str:
    """Return the script's line that breaks the firmware on purpose (lights/firmware/hang.h); waits for no reply."""
    return "bytes " + f"HANG {how}\n".encode().hex()


@pytest.fixture(scope="module")
def make_table() -> ModuleType:
    """The script that writes the firmware's table."""
    spec = importlib.util.spec_from_file_location("make_protocol_table", LIGHTS / "make_protocol_table.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_firmware_is_built_from_the_table_of_the_link(make_table: ModuleType) -> None:
    table = tomllib.loads((LIGHTS / "protocol.toml").read_text(encoding="utf-8"))
    assert (LIGHTS / "firmware" / "protocol_table.h").read_text(encoding="utf-8") == make_table.header(table)


@pytest.mark.parametrize("board", BOTH)
def test_it_says_who_it_is_and_what_the_table_says_it_can(emulate: Emulate, board: AvrBoard) -> None:
    said = replies(emulate(["send ID", "send CAPS", "send WIRING direct", f"send {seal('CAPS')}"], board=board))
    assert said[0].startswith(f"OK proto=1 board={board} firmware=")
    gated, direct = (capabilities(BOARDS[board], wiring) for wiring in ("gated", "direct"))
    assert said[1].encode() == format_reply(gated, sealed=False).strip()
    assert said[3].encode() == format_reply(direct, sealed=True).strip()
    assert max(map(len, said)) <= LONGEST_REPLY
    assert Caps.reply is type(gated)


EVERY_ERROR = [
    (Error.BYTES, "bytes 49ff440a"),
    (Error.LONG, f"send {'A' * (LONGEST_REQUEST + 1)}"),
    (Error.CRC, "send ID*0000"),
    (Error.COMMAND, "send id"),
    (Error.WORDS, "send RUN"),
    (Error.NUMBER, "send KEEP 4294967296"),
    (Error.RANGE, "send SLOT 99 1600 2000 1600"),
    (Error.STATE, "send STEPS 0 0"),
    (Error.LIMIT, "send SLOT 0 100001 2000 1600"),
    (Error.INCOMPLETE, "send ARM 0"),
    (Error.CHECK, "send ARM 1"),
    (Error.FAULT, "send NEW"),
    (Error.INTERLOCK, "send CLEAR"),
    (Error.POWERS, "send SLOT 0 1600 2000 1600 0:400 1:500"),
]
FIRST = {
    Error.WORDS: "armed",
    Error.STATE: "armed",
    Error.CHECK: "uploaded",
    Error.FAULT: "faulty",
    Error.INTERLOCK: "faulty",
}


@pytest.mark.parametrize("board", BOTH)
def test_every_error_of_the_table_is_answered(
    emulate: Emulate, upload: Callable[..., list[str]], board: AvrBoard
) -> None:
    armed = upload(FLASH)
    before = {None: [], "uploaded": armed[:-1], "armed": armed, "faulty": [*armed, "open", "wait 1"]}
    assert {code for code, _ in EVERY_ERROR} == set(Error)
    for code, line in EVERY_ERROR:
        said = replies(emulate([*before[FIRST.get(code)], line, "wait 20"], board=board))
        assert said[-1].startswith(f"E {code.value} "), (code, said)


def requests(seed: int, count: int) -> list[str]:
    """Return requests of every kind, right ones, wrong ones and nonsense."""
    dice = random.Random(seed)
    numbers = ["0", "1", "2", "7", "8", "39", "40", "41", "80", "100", "200", "199", "1600", "100000", "100001",
               "2147483647", "2147483648", "4294967295", "4294967296", "99999999999", "007", "-1", "x", ""]  # fmt: skip
    slot = [["0", "1", "15", "16", "31", "32"], ["80", "100", "1600", "1640", "100000", "100001", "0"],
            ["200", "199", "2000", "2147483647", "2147483648"], ["80", "100", "1600", "0", "1640"]]  # fmt: skip
    lits = ["0:40", "1:40", "2:40", "7:40", "8:40", "1:39", "0:80", "1:100", "2:1600", "0:0", "1", "1:", ":5", "1:2:3"]
    names = (
        ["SLOT"] * 6
        + ["STEPS"] * 3
        + ["KEEP", "WIRING", "ARM", "NEW", "STAT", "STOP", "CLEAR", "CLK", "CAPS", "WHAT", ""]
    )
    made = []
    for _ in range(count):
        name = dice.choice(names)
        words = [dice.choice(numbers) for _ in range(dice.choice([0, 1, 1, 1, 2, 5]))]
        if name == "SLOT" and dice.random() < 0.9:
            words = [dice.choice(choices) for choices in slot] + dice.sample(lits, dice.choice([0, 1, 1, 2, 3, 9]))
        if name == "WIRING":
            words = [dice.choice(["gated", "direct", "Direct", "gate", "gatedx"])]
        if name in ("NEW", "STAT", "STOP", "CLEAR", "CAPS") and dice.random() < 0.8:
            words = []
        line = " ".join([name, *words])
        line = seal(line) if dice.random() < 0.2 else line
        made.append(line if dice.random() < 0.95 else line[:-1] + dice.choice(" *!AZ"))
    return [line for line in made if line.strip("\r")]


@pytest.mark.parametrize("board", BOTH)
def test_it_answers_as_the_controller_in_python_does(emulate: Emulate, board: AvrBoard) -> None:
    asked = requests(seed=7, count=900)
    said = replies(emulate([f"send {line}" for line in asked], board=board))
    python = PythonBoard(BOARDS[board])
    assert len(said) == len(asked)
    for now, (line, answer) in enumerate(zip(asked, said, strict=True)):
        expected = python.feed(f"{line}\n".encode(), now).decode().strip()
        if expected.startswith("E "):
            assert answer.split()[:2] == expected.split()[:2], line
        elif not line.startswith("CLK"):
            assert answer == expected, line
    assert len({answer.split()[1] for answer in said if answer.startswith("E ")}) >= 7


@pytest.mark.parametrize(
    ("slots", "wiring", "code"),
    [
        ([(1600, 1600, 1600, {0: 1600})], "gated", None),  # 500,000 ppm
        ([(1601, 1600, 1601, {0: 1601})], "gated", Error.LIMIT),
        ([(1600, 1600, 1600, dict.fromkeys(range(4), 1600))], "gated", None),  # 2,000,000 ppm together
        ([(1600, 1600, 1600, dict.fromkeys(range(5), 1600))], "gated", Error.LIMIT),
        ([(1600, 200, 80, {0: 40}), (1600, 200, 80, {0: 40})], "direct", None),  # bursts count as they are lit
        ([(1600, 120_000_000 - 1600, 1600, {0: 1600})], "gated", None),  # a minute
        ([(1600, 120_000_001 - 1600, 1600, {0: 1600})], "gated", Error.LIMIT),
        ([(1600, 2**31 - 1, 1600, {0: 1600})] * 3, "gated", Error.LIMIT),  # more than 32 bits
    ],
)
def test_a_cycle_over_the_limits_is_not_armed(
    emulate: Emulate,
    upload: Callable[..., list[str]],
    slots: list[tuple[int, int, int, dict[int, int]]],
    wiring: WiringName,
    code: Error | None,
) -> None:
    cycle = [
        Slot(slot=n, duration=d, dark=o, period=p, lit=tuple(Lit(line=line, on=on) for line, on in lit.items()))
        for n, (d, o, p, lit) in enumerate(slots)
    ]
    answer = replies(emulate(upload(cycle, wiring=wiring), board="atmega2560"))[-1]
    if code is None:
        assert f"cycle={sum(d + o for d, o, _, _ in slots)}*" in answer
    else:
        assert answer.startswith(f"E {code.value} ")


@pytest.mark.parametrize("board", BOTH)
@pytest.mark.parametrize("slots", [FLASH, BURSTS], ids=["one long flash", "bursts"])
@pytest.mark.parametrize("after_ms", [20, 25.3])
def test_stop_and_an_open_interlock_darken_in_the_middle_of_a_flash(
    emulate: Emulate,
    upload: Callable[..., list[str]],
    tmp_path: Path,
    board: AvrBoard,
    slots: list[Slot],
    after_ms: float,
) -> None:
    run = [*upload(slots), "send RUN 0", f"wait {after_ms}"]
    out = emulate([*run, "send STOP", "wait 200"], board=board, trace=tmp_path / "t.csv")
    edge, is_on = last_edge(tmp_path / "t.csv")
    assert replies(out)[-1] == "OK state=idle cycles=0"
    assert not is_on
    assert cycle_of(out, "state=idle") - edge < AT_ONCE_MS * MS  # the reply's bytes, mostly

    reported = ["send STAT", "send RUN 0", "send CLEAR", "close", "send CLEAR"]
    out = emulate([*run, "open", "wait 200", *reported], board=board, trace=tmp_path / "t.csv")
    edge, is_on = last_edge(tmp_path / "t.csv")
    started = cycle_of(out, "start=")
    assert not is_on
    assert edge - started < (after_ms + 0.2) * MS
    stat, run_, clear, cleared = replies(out)[-4:]
    assert "state=fault fault=interlock" in stat
    assert "interlock=open" in stat
    assert run_ == "E 12 interlock"
    assert clear.startswith("E 13 ")
    assert cleared == "OK state=idle"


def test_an_open_interlock_arms_nothing(emulate: Emulate, upload: Callable[..., list[str]]) -> None:
    assert replies(emulate(["open", *upload(FLASH)]))[-1].startswith("E 13 ")


@pytest.mark.parametrize("board", BOTH)
def test_a_silent_host_means_dark_within_the_keep_alive(
    emulate: Emulate, upload: Callable[..., list[str]], tmp_path: Path, board: AvrBoard
) -> None:
    nonsense = ["bytes 0a0a", "send WHAT", "wait 40", "send KEEP 1", "wait 40"]  # no sign of life
    script = ["send KEEP 150", *upload(BURSTS), "send RUN 0", "poll 400 STAT", *nonsense, "wait 300", "send STAT"]
    out = emulate(script, board=board, trace=tmp_path / "t.csv")
    assert "fault=silent" in replies(out)[-1]
    edge, is_on = last_edge(tmp_path / "t.csv")
    last_sign = cycle_of(out, " = ") - 20 * MS  # the poll's end and the emulator's rest
    assert not is_on
    assert edge <= last_sign + 151 * MS
    assert edge > cycle_of(out, "start=") + 400 * MS


def test_armed_and_forgotten_is_a_fault_too(emulate: Emulate, upload: Callable[..., list[str]]) -> None:
    assert "state=fault fault=silent" in replies(emulate([*upload(FLASH), "wait 1100", "send STAT"]))[-1]


@pytest.mark.parametrize("board", BOTH)
@pytest.mark.parametrize("how", ["the chip", "loop", "deaf", "blind"])
def test_the_watchdog_darkens_what_hangs_and_says_so(
    emulate: Emulate, upload: Callable[..., list[str]], tmp_path: Path, board: AvrBoard, how: str
) -> None:
    hang = "hang" if how == "the chip" else hang_request(how)
    script = [*upload(FLASH), "send RUN 0", "wait 62", hang, "wait 400"]  # the next flash is armed, its end is not
    after = ["send STAT", "send ARM 1", "send CLEAR", "send STAT", "send STEPS 0 0", "send ARM 0"]
    out = emulate([*script, *after], board=board, trace=tmp_path / "t.csv", breakable=how != "the chip")
    hung = cycle_of(out, "start=") + 62 * MS
    edges = read_trace(tmp_path / "t.csv").edges["1"]
    assert cycle_of(out, "! watchdog reset") - hung < WATCHDOG_MS * MS
    assert len(edges) % 2 == 0
    assert edges[-1] - hung < WATCHDOG_MS * MS
    assert edges[-1] == cycle_of(out, "! watchdog reset") or how == "loop"
    assert replies(out)[-6:] == [
        "OK state=fault fault=watchdog reset=watchdog interlock=closed cycle=0 step=0 cycles=0",
        "E 12 watchdog",
        "OK state=idle",
        "OK state=idle fault=none reset=watchdog interlock=closed cycle=0 step=0 cycles=0",
        "OK steps=1",
        "E 10 a step names an empty slot",
    ]


@pytest.mark.parametrize("board", BOTH)
def test_an_edge_that_comes_too_late_is_a_fault_and_dark(
    emulate: Emulate, upload: Callable[..., list[str]], tmp_path: Path, board: AvrBoard
) -> None:
    late = hang_request("late")
    script = [*upload(BURSTS), "send RUN 0", "wait 20", late, "wait 100", "send STAT"]
    out = emulate(script, board=board, trace=tmp_path / "t.csv", breakable=True)
    edge, is_on = last_edge(tmp_path / "t.csv")
    assert "state=fault fault=late" in replies(out)[-1]
    assert not is_on
    assert edge < cycle_of(out, "start=") + 24 * MS
    again = [script[3], "send RUN 1", "wait 50", "send STAT"]
    assert (
        "state=running fault=none" in replies(emulate([*script, "send CLEAR", *again], board=board, breakable=True))[-1]
    )


@pytest.mark.parametrize("board", BOTH)
def test_it_starts_dark_and_stays_dark_until_it_is_run(
    emulate: Emulate, upload: Callable[..., list[str]], tmp_path: Path, board: AvrBoard
) -> None:
    noise = [f"bytes {random.Random(3).randbytes(300).hex()}", "wait 60", "bytes 0a"]
    script = ["wait 100", *noise, "reset", "wait 20", *upload(FLASH), "wait 100", "send STOP", "send RUN 1"]
    out = emulate(script, board=board, trace=tmp_path / "t.csv")
    assert not read_trace(tmp_path / "t.csv").edges
    assert replies(out)[-1] == "E 8 idle"


@pytest.mark.parametrize("board", BOTH)
def test_after_a_stop_in_a_flash_the_next_run_begins_dark(
    emulate: Emulate, upload: Callable[..., list[str]], tmp_path: Path, board: AvrBoard
) -> None:
    arm = upload(FLASH)[-1]
    script = [*upload(FLASH), "send RUN 0", "wait 20", "send STOP", arm, "send RUN 1", "wait 120", "send STAT"]
    out = emulate(script, board=board, trace=tmp_path / "t.csv")
    edges = read_trace(tmp_path / "t.csv").edges["1"]
    starts = [8 * int(text.split("start=")[1]) for text in replies(out) if "start=" in text]
    boot = edges[0] - starts[0]
    assert len(edges) == 4
    np.testing.assert_allclose(edges[2:] - boot, [starts[1], starts[1] + 8 * 60_000], atol=4)


@pytest.mark.parametrize("board", BOTH)
def test_the_clock_counts_on_over_every_wrap_of_the_timer(emulate: Emulate, board: AvrBoard) -> None:
    out = emulate([*["send CLK now", "wait 33"] * 40], board=board)
    ticks = [int(text.split("ticks=")[1]) for text in replies(out)]
    printed = [int(line.split()[0]) for line in out if " < " in line]
    delays = [cycle - 8 * tick for cycle, tick in zip(printed, ticks, strict=True)]
    assert max(delays) - min(delays) < 5 * MS  # the reply's own length differs
    assert min(delays) > 0


@pytest.mark.parametrize("board", BOTH)
def test_garbage_does_not_keep_it_from_stopping(
    emulate: Emulate, upload: Callable[..., list[str]], board: AvrBoard
) -> None:
    noise = [f"bytes {random.Random(seed).randbytes(200).hex()}" for seed in range(20)]
    script = [*upload(FLASH), "send RUN 0", *noise, "wait 500", "bytes 0a", "wait 20", "send STOP", "send STAT"]
    out = replies(emulate(script, board=board))
    assert out[-2].startswith("OK state=idle")
    assert "fault=none" in out[-1]
