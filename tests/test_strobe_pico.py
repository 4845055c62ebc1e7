"""The Pico's program keeps the page and the table of the link, and lights as the controller in Python does."""

import random
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pico import ARM, LOADED, MS, PROGRAM, US, Pico, in_order, same_answer, upload
from rp2040 import Chip, board_of

from psvideo.strobe.limits import cycle_check
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.lines import LONGEST_REPLY, LONGEST_REQUEST, Error, LineReader, seal
from psvideo.strobe.link.protocol import format_reply
from psvideo.strobe.link.requests import Lit, Slot
from psvideo.strobe.stand_ins.playing import Edge
from psvideo.strobe.stand_ins.python_board import PythonBoard

LIGHTS = Path(__file__).resolve().parents[1] / "lights"
BUSY = [HealthCheck.too_slow]


def running(cycles: int = 0) -> Pico:
    """Return a Pico that was asked to run at tick 0; its first flash starts at 10 ms."""
    pico = Pico()
    assert pico.feed(LOADED + ARM, 0).splitlines()[-1].startswith(b"OK check=")
    assert pico.feed(b"RUN %d\n" % cycles, 0) == b"OK start=1250000\n"
    return pico


def test_it_has_the_commands_errors_and_limits_of_the_table() -> None:
    table = tomllib.loads((LIGHTS / "protocol.toml").read_text(encoding="utf-8"))
    board, limits = table["board"]["rp2040"], table["limits"]
    assert table["error"] == PROGRAM.ERRORS
    assert set(PROGRAM.COMMANDS) == {command["name"] for command in table["command"]}
    for command in table["command"]:
        fewest, most, states, keys = PROGRAM.COMMANDS[command["name"]]
        many = [word for word in command["words"] if word[0] in "*+"]
        optional = [word for word in command["words"] if word[0] == "*"]
        assert (fewest, list(states), keys.split()) == (
            len(command["words"]) - len(optional),
            command["states"],
            command["reply"],
        )
        assert most == (PROGRAM.ANY if many else fewest)
    assert LONGEST_REQUEST == PROGRAM.LONGEST_REQUEST == table["line"]["longest_request"]
    assert table["line"]["longest_nonce"] == PROGRAM.LONGEST_NONCE
    assert table["checksum"]["example"][1] == PROGRAM.crc16(table["checksum"]["example"][0].encode())
    assert tuple(limits["keep_ms"]) == PROGRAM.KEEP_MS
    assert limits["max_cycle_s"] * 10**12 // board["tick_ps"] == PROGRAM.MAX_CYCLE
    assert limits["max_trim_ppm"] == PROGRAM.MAX_TRIM_PPM
    assert board["trim_lead_ms"] * MS == PROGRAM.LEAD
    caps = capabilities(BOARDS["rp2040"], "direct")
    assert Pico().feed(b"CAPS\n", 0) == format_reply(caps, sealed=False)


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (b"\x07\n", Error.BYTES),
        (b"ID\r \n", Error.BYTES),
        (b"x" * 97 + b"\n", Error.LONG),
        (b"ID*0000\n", Error.CRC),
        (b"ID*a21b\n", Error.CRC),
        (b"PLAY\n", Error.COMMAND),
        (b"id\n", Error.COMMAND),
        (b"SLOT 0 1\n", Error.WORDS),
        (b"SLOT 0 1 2 x\n", Error.NUMBER),
        (b"CLK abcdefghi\n", Error.NUMBER),
        (b"CLK a-b\n", Error.NUMBER),
        (b"WIRING both\n", Error.NUMBER),
        (b"WIRING gated\n", Error.RANGE),
        (b"WIRING direct\n", None),
        (b"SLOT 32 100000 1000000 100000\n", Error.RANGE),
        (b"SLOT 31 100000 1000000 100000\n", None),
        (b"SLOT 0 0 1000000 0\n", Error.RANGE),
        (b"SLOT 0 6250001 1000000 1600\n", Error.LIMIT),
        (b"SLOT 0 6250000 1000000 6250000\n", None),
        (b"SLOT 0 1600 12499 1600\n", Error.LIMIT),
        (b"SLOT 0 1600 12500 1600\n", None),
        (b"SLOT 0 1600 2147483647 1600\n", None),
        (b"SLOT 0 1600 2147483648 1600\n", Error.RANGE),
        (b"SLOT 0 1600 16000 1601\n", Error.RANGE),
        (b"SLOT 0 1000 16000 250 0:125\n", None),
        (b"SLOT 0 1000 16000 250 0:124\n", Error.LIMIT),
        (b"SLOT 0 1000 16000 250 0:126\n", Error.LIMIT),
        (b"SLOT 0 1000 16000 250 0:250\n", None),
        (b"SLOT 0 1000 16000 250 0:251\n", Error.RANGE),
        (b"SLOT 0 1124 16000 250 0:125\n", Error.LIMIT),
        (b"SLOT 0 1125 16000 250 0:125\n", None),
        (b"SLOT 0 1000 16000 250 0:125 0:125\n", Error.RANGE),
        (b"SLOT 0 1000 16000 250 8:125\n", Error.RANGE),
        (b"SLOT 0 1000 16000 500 0:125 1:126 2:127 3:128 4:129 5:130 6:131 7:132\n", None),
        (b"STEPS 1 0\n", Error.RANGE),
        (b"STEPS 0 32\n", Error.RANGE),
        (b"ARM 0\n", Error.INCOMPLETE),
        (b"RUN 1\n", Error.STATE),
        (b"KEEP 99\n", Error.RANGE),
        (b"KEEP 2001\n", Error.RANGE),
        (b"CLEAR\n", None),
    ],
)
def test_each_limit_has_its_number(line: bytes, code: Error | None) -> None:
    answer = Pico().feed(line, 0)
    assert answer.startswith(b"OK" if code is None else b"E %d " % code), answer
    assert answer.endswith(b"\n")


def test_it_plays_what_it_was_sent_and_is_idle_afterwards() -> None:
    pico = running(2)
    pico.feed(b"ID\n", 20 * MS)
    pico.advance(100 * MS)
    assert pico.edges == [
        Edge(tick=1_250_000 + 1_100_000 * n + after, line=2, level=level)
        for n in range(4)
        for after, level in ((0, 1), (100_000, 0))
    ]
    said = b"OK state=idle fault=none reset=power interlock=closed cycle=2 step=0 cycles=2\n"
    assert pico.feed(b"STAT\n", 100 * MS) == said
    assert pico.feed(ARM, 101 * MS).startswith(b"OK")


@pytest.mark.parametrize("cycles", [1, 1023, 1024, 1025, 3000])
def test_the_dma_stops_behind_the_last_cycle_by_itself(cycles: int) -> None:
    pico = Pico()
    slot = Slot(slot=0, duration=125, dark=12_500, period=125, lit=(Lit(line=0, on=125), Lit(line=7, on=125)))
    pico.feed(b"KEEP 2000\nSLOT 0 125 12500 125 0:125 7:125\nSTEPS 0 0\n", 0)
    pico.feed(f"ARM {cycle_check([slot])}\nRUN {cycles}\n".encode(), 0)
    pico.advance(1_250_000 + 12_625 * cycles - 125)
    assert pico.controller.state == "running"
    pico.chip.advance(10**9)  # and nobody polls
    assert len(pico.chip.edges) == 4 * cycles
    pico.controller.poll()
    assert pico.feed(b"STAT\n", 10**9).split()[-1] == b"cycles=%d" % cycles


def test_stop_darkens_in_the_middle_of_a_flash() -> None:
    pico = running()
    assert pico.feed(b"STOP\n", 1_300_000) == b"OK state=idle cycles=0\n"
    pico.advance(10**8)
    assert pico.edges == [Edge(tick=1_250_000, line=2, level=1), Edge(tick=1_300_000, line=2, level=0)]
    pico.feed(ARM, 10**8)
    pico.feed(b"RUN 1\n", 10**8)
    pico.advance(2 * 10**8)
    assert [edge.tick for edge in pico.edges[2:]] == [101_250_000, 101_350_000, 102_350_000, 102_450_000]


@pytest.mark.parametrize("keep_ms", [100, 1000, 2000])
def test_a_silent_host_means_dark_within_the_keep_alive(keep_ms: int) -> None:
    pico = running()
    pico.feed(b"KEEP %d\n" % keep_ms, 5 * US)
    pico.feed(b"garbage\nSTAT*0000\n\xff\xff\n", 50 * MS)
    pico.advance(3000 * MS)
    assert pico.controller.fault == "silent"
    assert not pico.chip.lit
    assert 5 * US + (keep_ms - 9) * MS < pico.edges[-1].tick <= 5 * US + keep_ms * MS
    assert pico.feed(b"RUN 0\n", 3001 * MS) == b"E 12 silent\n"
    assert pico.feed(b"CLEAR\n", 3002 * MS) == b"OK state=idle\n"


def test_the_time_that_a_board_takes_to_arm_is_no_silence(monkeypatch: pytest.MonkeyPatch) -> None:
    pico, check_of = Pico(), PROGRAM.check_of

    def slowly(cycle: list[object]) -> int:
        pico.chip.advance(pico.chip.cycle + 150 * MS)
        check: int = check_of(cycle)
        return check

    monkeypatch.setattr(PROGRAM, "check_of", slowly)
    pico.feed(b"KEEP 100\n" + LOADED + ARM, 0)
    pico.advance(249 * MS)
    assert pico.controller.state == "armed"
    pico.advance(250 * MS)
    assert pico.controller.fault == "silent"


def test_an_open_interlock_darkens_latches_and_forbids_arming() -> None:
    pico = running()
    pico.advance(1_260_000)
    pico.chip.interlock_open = True
    pico.advance(1_270_000)
    assert (pico.controller.fault, pico.chip.lit, pico.edges[-1].tick) == ("interlock", set(), 1_270_000)
    assert pico.feed(b"CLEAR\n", 1_280_000) == b"E 13 interlock open\n"
    pico.chip.interlock_open = False
    assert pico.feed(b"CLEAR\n", 1_290_000) == b"OK state=idle\n"
    pico.chip.interlock_open = True
    assert pico.feed(ARM, 1_300_000).startswith(b"E 13 ")


@pytest.mark.parametrize("cycles", [0, 9])
def test_a_state_machine_that_runs_dry_is_a_fault(cycles: int) -> None:
    pico = running(cycles)
    pico.advance(1_240_000)
    for channel in pico.chip.channels:
        channel.left = 0  # the DMA is stuck; the FIFO still has a flash and more
        channel.control = 0
    pico.advance(2_000 * MS)
    assert (pico.controller.fault, pico.chip.lit) == ("late", set())
    assert pico.edges[-1].tick < 1_250_000 + 5 * 1_100_000


@pytest.mark.parametrize("before_ms", [1, 3])
def test_a_run_that_ends_while_memory_is_collected_is_done(before_ms: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Behind a run's end the state machines run dry, as they should; the clock may have been read before it."""
    pico = running(10)
    end = 1_250_000 + 10 * 2 * 1_100_000
    pico.advance(end - before_ms * MS)
    ticks = pico.controller.hardware.ticks

    def then_collected() -> int:
        now: int = ticks()
        pico.chip.advance(now + 5 * MS)
        return now

    with monkeypatch.context() as collecting:
        collecting.setattr(pico.controller.hardware, "ticks", then_collected)
        pico.controller.poll()
    pico.advance(end + 20 * MS)
    said = b"OK state=idle fault=none reset=power interlock=closed cycle=10 step=0 cycles=10\n"
    assert pico.feed(b"STAT\n", end + 20 * MS) == said


@pytest.mark.parametrize(
    ("chip", "reason", "scratch", "cause"),
    [
        (1 << 8, 0, 0, "power"),
        (1 << 16, 0, 0, "external"),
        (1 << 8 | 1 << 16, 0, 0, "external"),
        (1 << 8, 1, 0x6AB73121, "watchdog"),
        (1 << 8, 1, 0, "other"),  # the boot ROM's restart after new firmware
        (1 << 8, 2, 0x6AB73121, "other"),  # machine.reset()
        (1 << 20, 0, 0, "other"),
    ],
)
def test_it_says_why_it_was_reset(chip: int, reason: int, scratch: int, cause: str) -> None:
    assert PROGRAM.reset_cause(chip, reason, scratch) == cause


def test_after_a_watchdog_reset_it_is_in_fault() -> None:
    pico = Pico("watchdog")
    said = b"OK state=fault fault=watchdog reset=watchdog interlock=closed cycle=0 step=0 cycles=0\n"
    assert pico.feed(b"STAT\n", 0) == said
    assert pico.feed(LOADED, 0) == b"E 12 watchdog\n" * 2


def test_an_answer_has_a_checksum_where_the_request_had_one() -> None:
    pico = Pico()
    answer = seal("OK proto=1 board=rp2040 firmware=pico-1.1 unit=emulated")
    assert pico.feed(b"ID*A21B\n", 0) == f"{answer}\n".encode()
    assert pico.feed(b"ID*A21C\n", 0) == f"{seal('E 3 checksum')}\n".encode()


WORD = st.sampled_from(
    [
        "0",
        "1",
        "2",
        "125",
        "250",
        "1600",
        "16000",
        "6250001",
        "4294967295",
        "4294967296",
        "0:125",
        "2:250",
        "later",
        "sooner",
        "x",
        "",
        "-1",
    ]
)
NAMES = ["ID", "CAPS", "WIRING", "KEEP", "NEW", "SLOT", "STEPS", "ARM", "STOP", "STAT", "CLK", "CLEAR", "TRIM", "?"]
TALK = st.builds(
    lambda name, words: " ".join([name, *words]).encode() + b"\n", st.sampled_from(NAMES), st.lists(WORD, max_size=6)
)
LINES = [b"RUN 0\n", b"RUN 2\n", b"STAT\n", b"STOP\n", b"TRIM later 125\n", b"TRIM sooner 20000\n"]
CHUNK = st.one_of(st.binary(max_size=120), TALK, st.sampled_from([LOADED, ARM, *LINES]))

RUN = LOADED + ARM + b"RUN 0\n"


@settings(max_examples=100, deadline=None, suppress_health_check=BUSY)
@given(first=st.sampled_from([b"", RUN]), talk=st.lists(st.tuples(CHUNK, st.integers(0, 8000)), max_size=20))
def test_after_any_input_it_answers_and_lights_as_the_controller_in_python(
    first: bytes, talk: list[tuple[bytes, int]]
) -> None:
    pico, python = Pico(), PythonBoard(BOARDS["rp2040"])
    now = 0
    for data, pause_us in [(b"KEEP 100\n" + first, 0), *talk, (b"\nSTAT\n", 0)]:
        now += pause_us * US
        reader = LineReader(LONGEST_REPLY)
        answers, expected = pico.feed(data, now).splitlines(), python.feed(data, now).splitlines()
        assert len(answers) == len(expected)
        assert all(same_answer(*pair) for pair in zip(answers, expected, strict=True)), (data, answers, expected)
        assert all(answer.fault is None for answer in reader.feed(b"".join(line + b"\n" for line in answers)))
    now += 3000 * MS
    pico.advance(now)
    python.advance(now)
    assert pico.feed(b"STAT\n", now) == python.feed(b"STAT\n", now)
    assert in_order(pico.edges) == in_order(python.edges)
    assert not pico.chip.lit


@pytest.mark.parametrize("seed", range(60))
def test_random_cycles_are_played_to_the_tick(seed: int) -> None:
    lines = upload(random.Random(seed))
    lines.append(f"RUN {random.Random(seed).choice([1, 2, 5])}")
    pico, python = Pico(), PythonBoard(BOARDS["rp2040"])
    for line in lines:
        assert pico.feed(f"{line}\n".encode(), 0).startswith(b"OK"), line
        python.feed(f"{line}\n".encode(), 0)
    pico.advance(300 * MS)
    python.advance(300 * MS)
    assert in_order(pico.edges) == in_order(python.edges)
    assert pico.feed(b"STAT\n", 300 * MS) == python.feed(b"STAT\n", 300 * MS)


def test_the_largest_program_fits_into_the_table() -> None:
    pico = Pico()
    lit = " ".join(f"{line}:{on}" for line, on in enumerate([125, 134, 143, 152] * 2))
    said = [f"SLOT {place} 6249951 12500000 277 {lit}" for place in range(32)]
    assert len(said[-1]) < LONGEST_REQUEST
    said += [f"STEPS {first} {' '.join(str((first + n) % 32) for n in range(20))}" for first in range(0, 240, 20)]
    for line in said:
        assert pico.feed(f"{line}\n".encode(), 0).startswith(b"OK"), line
    assert pico.controller.feed(b"ARM 0\n").startswith(b"E 11 ")
    check = PROGRAM.check_of([pico.controller.slots[step] for step in pico.controller.steps])
    assert pico.feed(b"ARM %d\n" % check, 0).startswith(b"OK")
    assert all(PROGRAM.TABLE_WORDS >= table.used > 3800 for table in pico.controller.tables)


def test_an_error_ends_in_the_dark_and_in_the_watchdogs_hands(monkeypatch: pytest.MonkeyPatch) -> None:
    chip = Chip()
    fed: list[int] = []

    def feed() -> None:
        chip.advance(1_260_000 if len(fed) == len(sent) + 1 else 0)
        if len(fed) > len(sent) + 1:
            assert chip.lit == {2}
            raise MemoryError
        fed.append(1)

    sent = LOADED + ARM + b"RUN 0\n"
    port = iter(sent)
    board = board_of(PROGRAM, chip)
    parts: dict[str, Any] = vars(PROGRAM.machine) | {
        "WDT": lambda timeout: SimpleNamespace(feed=feed),
        "unique_id": lambda: bytes(range(8)),
    }
    monkeypatch.setattr(PROGRAM, "machine", SimpleNamespace(**parts))
    monkeypatch.setattr(PROGRAM, "micropython", SimpleNamespace(kbd_intr=lambda key: None), raising=False)
    ready = SimpleNamespace(register=lambda *_: None, poll=lambda ms: len(fed) <= len(sent))
    monkeypatch.setattr(PROGRAM, "select", SimpleNamespace(poll=lambda: ready, POLLIN=1))
    stdin = SimpleNamespace(read=lambda n: bytes([next(port)]))
    stream = SimpleNamespace(buffer=stdin), SimpleNamespace(buffer=SimpleNamespace(write=lambda data: None))
    monkeypatch.setattr(PROGRAM, "sys", SimpleNamespace(stdin=stream[0], stdout=stream[1]))
    monkeypatch.setattr(PROGRAM, "Pico", lambda: board)
    with pytest.raises(MemoryError):
        PROGRAM.main()
    assert not chip.lit
