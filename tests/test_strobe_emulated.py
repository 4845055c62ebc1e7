"""The controller in Python keeps the rules of lights/protocol.md: never a light unasked, and dark whatever happens."""

from collections.abc import Callable
from itertools import pairwise

import pytest
from bench.strobe_faults import darkness
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from psvideo.strobe.limits import cycle_check
from psvideo.strobe.link.boards import BOARDS
from psvideo.strobe.link.lines import LONGEST_REPLY, Error, LineReader, seal
from psvideo.strobe.link.requests import Lit, Slot
from psvideo.strobe.link.words import Reset
from psvideo.strobe.stand_ins.playing import Edge
from psvideo.strobe.stand_ins.python_board import PythonBoard

MS = 2000
"""Ticks of an AVR board in a millisecond."""
BUSY = [HealthCheck.too_slow]
"""A machine that is busy is no reason to fail."""
FLASH = Slot(slot=0, duration=1600, dark=16_000, period=1600, lit=(Lit(line=2, on=1600),))
LOADED = [b"SLOT 0 1600 16000 1600 2:1600\n", b"STEPS 0 0 0\n"]
ARM = f"ARM {cycle_check([FLASH, FLASH])}\n".encode()


def tell(controller: PythonBoard, *lines: bytes, now: int) -> bytes:
    """Send lines one after the other and return the last answer."""
    answers = [controller.feed(line, now) for line in lines]
    return answers[-1]


def armed() -> PythonBoard:
    """Return a controller that is armed at tick 0 with two flashes of line 2."""
    controller = PythonBoard(BOARDS["atmega328p"])
    assert tell(controller, *LOADED, ARM, now=0).startswith(b"OK check=")
    return controller


def running(cycles: int = 0) -> PythonBoard:
    """Return a controller that was asked to run at tick 0; its first flash starts at 10 ms."""
    controller = armed()
    assert tell(controller, b"RUN %d\n" % cycles, now=0) == b"OK start=20000\n"
    return controller


def test_it_plays_what_it_was_sent_and_is_idle_afterwards() -> None:
    controller = running(2)
    controller.feed(b"ID\n", 50 * MS)
    controller.advance(100 * MS)
    assert controller.edges == [
        Edge(tick=20_000 + 17_600 * n + after, line=2, level=level)
        for n in range(4)
        for after, level in ((0, 1), (1600, 0))
    ]
    said = b"OK state=idle fault=none reset=power interlock=closed cycle=2 step=0 cycles=2\n"
    assert controller.feed(b"STAT\n", 100 * MS) == said
    assert tell(controller, ARM, now=101 * MS).startswith(b"OK")


def test_stop_darkens_in_the_middle_of_a_flash() -> None:
    controller = running()
    assert controller.feed(b"STOP\n", 20_800) == b"OK state=idle cycles=0\n"
    controller.advance(10**6)
    assert controller.edges == [Edge(tick=20_000, line=2, level=1), Edge(tick=20_800, line=2, level=0)]


@pytest.mark.parametrize("keep_ms", [100, 1000, 2000])
def test_a_silent_host_means_dark_within_the_keep_alive(keep_ms: int) -> None:
    controller = running()
    controller.feed(b"KEEP %d\n" % keep_ms, 5)
    controller.feed(b"garbage\nSTAT*0000\n\xff\xff\n", 50 * MS)
    controller.advance(10_000 * MS)
    assert controller.fault == "silent"
    assert controller.edges[-1].level == 0
    assert controller.edges[-1].tick <= 5 + keep_ms * MS
    assert controller.edges[-1].tick >= 5 + keep_ms * MS - 17_600
    assert controller.feed(b"RUN 0\n", 10_001 * MS) == b"E 12 silent\n"
    assert controller.feed(b"CLEAR\n", 10_002 * MS) == b"OK state=idle\n"


def test_an_armed_controller_whose_host_is_silent_faults_too() -> None:
    controller = armed()
    controller.advance(1000 * MS - 1)
    assert controller.state == "armed"
    controller.advance(1000 * MS)
    assert (controller.state, controller.fault) == ("fault", "silent")


def test_every_valid_line_is_a_sign_of_life() -> None:
    controller = running()
    for ms in range(0, 10_000, 900):
        controller.feed(b"CLK a\n", ms * MS)
    assert controller.state == "running"


def test_an_open_interlock_darkens_and_latches() -> None:
    controller = running()
    controller.set_interlock("open", 20_100)
    assert not controller.lit
    assert controller.edges[-1] == Edge(tick=20_100, line=2, level=0)
    assert controller.feed(b"CLEAR\n", 20_200) == b"E 13 interlock open\n"
    controller.set_interlock("closed", 20_300)
    assert controller.fault == "interlock"
    assert controller.feed(b"CLEAR\n", 20_400) == b"OK state=idle\n"


def test_an_open_interlock_forbids_arming() -> None:
    controller = PythonBoard(BOARDS["atmega328p"])
    controller.set_interlock("open", 0)
    assert tell(controller, *LOADED, ARM, now=0) == b"E 13 interlock open\n"


@pytest.mark.parametrize("cause", ["power", "external", "brownout", "watchdog", "other"])
def test_a_reset_is_dark_forgets_everything_and_shows_its_cause(cause: Reset) -> None:
    controller = running()
    controller.restart(cause, 20_100)
    assert not controller.lit
    state, fault = ("fault", "watchdog") if cause == "watchdog" else ("idle", "none")
    said = f"OK state={state} fault={fault} reset={cause} interlock=closed cycle=0 step=0 cycles=0\n"
    assert controller.feed(b"STAT\n", 20_200) == said.encode()
    assert controller.feed(b"CLK a\n", 20_200) == b"OK nonce=a cycle=0 ticks=100\n"
    assert controller.feed(ARM, 20_300).startswith(b"E 12 watchdog\n" if cause == "watchdog" else b"E 10 ")


def test_a_missed_edge_is_a_fault() -> None:
    controller = running()
    controller.miss_an_edge(20_100)
    assert (controller.fault, controller.lit) == ("late", frozenset())


@pytest.mark.parametrize(
    ("line", "code"),
    [
        (b"\x07\n", Error.BYTES),
        (b"x" * 97 + b"\n", Error.LONG),
        (b"ID*0000\n", Error.CRC),
        (b"PLAY\n", Error.COMMAND),
        (b"SLOT 0 1\n", Error.WORDS),
        (b"SLOT 0 1 2 x\n", Error.NUMBER),
        (b"SLOT 16 1600 16000 1600\n", Error.RANGE),
        (b"SLOT 0 0 16000 0\n", Error.RANGE),
        (b"SLOT 0 100001 16000 1600\n", Error.LIMIT),
        (b"SLOT 0 100000 16000 100000\n", None),
        (b"SLOT 0 1600 199 1600\n", Error.LIMIT),
        (b"SLOT 0 1600 200 1600\n", None),
        (b"SLOT 0 1600 2147483647 1600\n", None),
        (b"SLOT 0 1600 2147483648 1600\n", Error.RANGE),
        (b"SLOT 0 1600 16000 1601\n", Error.RANGE),
        (b"SLOT 0 1600 16000 0\n", Error.RANGE),
        (b"SLOT 0 1600 16000 80 0:40\n", None),
        (b"SLOT 0 1600 16000 80 0:39\n", Error.LIMIT),
        (b"SLOT 0 1600 16000 80 0:41\n", Error.LIMIT),
        (b"SLOT 0 1600 16000 80 0:80\n", None),
        (b"SLOT 0 1600 16000 80 0:81\n", Error.RANGE),
        (b"SLOT 0 1600 16000 80 0:0\n", Error.RANGE),
        (b"SLOT 0 1639 16000 80 0:40\n", Error.LIMIT),
        (b"SLOT 0 1640 16000 80 0:40\n", None),
        (b"SLOT 0 1600 16000 80 0:40 0:40\n", Error.RANGE),
        (b"SLOT 0 1600 16000 80 8:40\n", Error.RANGE),
        (b"SLOT 0 1600 16000 160 0:40 1:80\n", Error.POWERS),
        (b"SLOT 0 1600 16000 160 0:80 1:80\n", None),
        (b"STEPS 1 0\n", Error.RANGE),
        (b"STEPS 0 16\n", Error.RANGE),
        (b"ARM 0\n", Error.INCOMPLETE),
        (b"RUN 1\n", Error.STATE),
        (b"KEEP 99\n", Error.RANGE),
        (b"KEEP 2001\n", Error.RANGE),
        (b"CLEAR\n", None),
    ],
)
def test_each_limit_has_its_number(line: bytes, code: Error | None) -> None:
    answer = PythonBoard(BOARDS["atmega328p"]).feed(line, 0)
    assert answer.startswith(b"OK" if code is None else b"E %d " % code), answer
    assert answer.endswith(b"\n")


def test_a_wrong_check_and_too_much_light_are_refused_when_arming() -> None:
    controller = PythonBoard(BOARDS["atmega328p"])
    bright = Slot(slot=0, duration=1600, dark=1599, period=1600, lit=(Lit(line=0, on=1600),))
    tell(controller, b"SLOT 0 1600 1599 1600 0:1600\n", b"STEPS 0 0\n", now=0)
    assert controller.feed(b"ARM 1\n", 0).startswith(b"E 11 ")
    assert (
        controller.feed(b"ARM %d\n" % cycle_check([bright]), 0)
        == b"E 9 line 0 on for 500156 ppm > max_line_ppm 500000\n"
    )
    tell(controller, b"SLOT 1 1600 16000 1600\n", b"STEPS 0 0 2\n", now=0)
    assert controller.feed(b"ARM 1\n", 0).startswith(b"E 10 ")


def test_the_pico_has_direct_wiring_only_and_the_uno_both() -> None:
    assert PythonBoard(BOARDS["rp2040"]).feed(b"WIRING gated\n", 0).startswith(b"E 7 ")
    uno = PythonBoard(BOARDS["atmega328p"])
    assert b"wiring=gated lines=8 powers=1" in uno.feed(b"CAPS\n", 0)
    assert uno.feed(b"WIRING direct\n", 0) == b"OK wiring=direct\n"
    assert b"wiring=direct lines=2 powers=2" in uno.feed(b"CAPS\n", 0)


@pytest.mark.parametrize(("name", "counts_from"), [("atmega328p", 3), ("rp2040", 4)])
def test_a_trim_counts_behind_the_next_step_and_not_before_the_boards_lead(name: str, counts_from: int) -> None:
    """Steps of 8 ms, of which the second is played: the Pico takes the first that begins 20 ms later."""
    controller, ms = PythonBoard(BOARDS[name]), 10**9 // BOARDS[name].tick_ps
    slot = Slot(slot=0, duration=ms, dark=7 * ms, period=ms, lit=(Lit(line=0, on=ms),))
    said = f"SLOT 0 {ms} {7 * ms} {ms} 0:{ms}\nSTEPS 0 0\nARM {cycle_check([slot])}\nRUN 0\n"
    tell(controller, said.encode(), now=0)
    assert controller.feed(b"TRIM later 20000\n", (10 + 8 + 1) * ms) == b"OK way=later ppm=20000\n"
    controller.advance(100 * ms)
    ticks = [edge.tick for edge in controller.edges if edge.level]
    lasts = [after - before for before, after in pairwise(ticks)]
    assert lasts[:counts_from] == [8 * ms] * counts_from
    assert set(lasts[counts_from:]) == {8 * ms + 8 * ms // 50}


def test_an_answer_has_a_checksum_where_the_request_had_one() -> None:
    controller = PythonBoard(BOARDS["atmega328p"])
    assert (
        controller.feed(b"ID*A21B\n", 0)
        == (seal("OK proto=1 board=atmega328p firmware=python-1 unit=emulated") + "\n").encode()
    )
    assert controller.feed(b"ID*A21C\n", 0) == (seal("E 3 checksum behind ID") + "\n").encode()


@pytest.mark.parametrize("cut", range(len(ARM) + 1))
def test_a_request_cut_anywhere_is_understood_once_the_rest_is_there(cut: int) -> None:
    controller = PythonBoard(BOARDS["atmega328p"])
    tell(controller, *LOADED, now=0)
    assert (controller.feed(ARM[:cut], 0) + controller.feed(ARM[cut:], 1)).startswith(b"OK check=")


def test_no_flipped_bit_of_a_sealed_request_starts_anything_else_than_was_meant() -> None:
    request = (seal("RUN 3") + "\n").encode()
    for bit in range(8 * (len(request) - 1)):
        flipped = bytearray(request)
        flipped[bit // 8] ^= 1 << bit % 8
        controller = armed()
        answer = controller.feed(bytes(flipped), 0)
        meant = bytes(flipped).startswith(b"RUN 3\n")
        assert meant or (answer.startswith(b"E ") and controller.state == "armed"), bytes(flipped)


WORD = st.sampled_from(
    ["0", "1", "2", "40", "80", "1600", "16000", "100000", "4294967295", "0:40", "2:80", "x", "", "gated"]
)
NAME = st.sampled_from(
    ["ID", "CAPS", "WIRING", "KEEP", "NEW", "SLOT", "STEPS", "ARM", "STOP", "STAT", "CLK", "CLEAR", "?"]
)
TALK = st.builds(lambda name, words: " ".join([name, *words]).encode() + b"\n", NAME, st.lists(WORD, max_size=6))
CHUNK = st.one_of(st.binary(max_size=120), TALK, st.sampled_from([*LOADED, ARM, b"RUN 0\n", b"RUN 2\n"]))


@settings(max_examples=200, deadline=None, suppress_health_check=BUSY)
@given(board=st.sampled_from(list(BOARDS)), talk=st.lists(st.tuples(CHUNK, st.integers(0, 10**6)), max_size=20))
def test_after_any_input_it_answers_line_by_line_and_is_dark_in_the_end(
    board: str, talk: list[tuple[bytes, int]]
) -> None:
    controller = PythonBoard(BOARDS[board])
    reader = LineReader(LONGEST_REPLY)
    now, was_armed = 0, False
    for data, pause in talk:
        now += pause
        answers = list(reader.feed(controller.feed(data, now)))
        assert not list(reader.feed(b"\n")), "answers end with their line"
        assert all(answer.text.startswith(("OK", "E ")) for answer in answers)
        was_armed = was_armed or any(answer.text.startswith("OK check=") for answer in answers)
    controller.feed(b"\nSTOP\n", now)
    assert not controller.lit
    assert was_armed or not controller.edges
    controller.advance(now + 10**9)
    assert not controller.lit
    assert all(a.tick <= b.tick for a, b in pairwise(controller.edges))


@settings(max_examples=100, deadline=None, suppress_health_check=BUSY)
@given(talk=st.lists(st.tuples(CHUNK, st.integers(0, 10**6)), max_size=20))
def test_after_any_input_a_host_that_falls_silent_leaves_the_dark(talk: list[tuple[bytes, int]]) -> None:
    controller = running()
    now = 0
    for data, pause in talk:
        now += pause
        controller.feed(data, now)
    controller.advance(now + 2000 * MS)
    assert not controller.lit
    assert all(edge.tick <= now + 2000 * MS for edge in controller.edges)


def test_nothing_lights_before_it_is_run() -> None:
    steps: list[Callable[[], PythonBoard]] = [lambda: PythonBoard(BOARDS["rp2040"]), armed]
    for make in steps:
        controller = make()
        controller.advance(10**9)
        assert controller.edges == []


def test_under_random_faults_it_is_dark_within_the_time_that_it_promises() -> None:
    for row in darkness(60, seed=2):
        assert row.dark_in_time == row.schedules, row


@pytest.mark.campaign
def test_under_many_random_faults_it_is_dark_within_the_time_that_it_promises() -> None:
    assert all(row.dark_in_time == row.schedules > 100 for row in darkness(1000, seed=3))


def test_a_board_that_did_not_go_dark_would_be_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PythonBoard, "_fail", lambda controller, fault: None)
    monkeypatch.setattr(PythonBoard, "_happens", lambda controller, until: False)
    monkeypatch.setattr(PythonBoard, "lit", frozenset({1}))
    *_, all_of_them = darkness(5, seed=2)
    assert all_of_them.dark_in_time == 0
