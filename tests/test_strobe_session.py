"""A run over a pseudo-terminal: found or refused by what answers, watched, and dark afterwards whatever happens."""

import contextlib
import os
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from psvideo.errors import PsvideoError, UsageError
from psvideo.model.plan import Plan
from psvideo.strobe.clock import ClockQuery, fit_clock
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.controller import OpenPort
from psvideo.strobe.link.exchange import Link, NoReplyError, RefusedError
from psvideo.strobe.link.greeting import greet
from psvideo.strobe.link.lines import seal
from psvideo.strobe.link.ports import SerialPort, choose_port
from psvideo.strobe.link.replies import Capabilities, Cleared, KeepSet, Started, Trimmed
from psvideo.strobe.link.requests import Caps, Clear, Keep, Run, Slot, Trim
from psvideo.strobe.program import Program, make_program
from psvideo.strobe.session import Outcome, RunProgress, cycles_for, prepare, run_program
from psvideo.strobe.stand_ins.python_board import PythonBoard
from psvideo.strobe.stand_ins.python_board_port import PythonBoardPort

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs pseudo-terminals")
Answer = Callable[[bytes], bytes]
UNO = BOARDS["atmega328p"]


class Device:
    """Something at the other end of a pseudo-terminal: ``answer`` takes what comes and gives what is sent back."""

    def __init__(self, answer: Answer, *, unasked: bytes = b"") -> None:
        self._answer, self._unasked = answer, unasked
        self._host, guest = os.openpty()
        tty.setraw(guest)
        self.name = os.ttyname(guest)
        self._guest: int | None = guest
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        os.set_blocking(self._host, False)
        while not self._end.is_set():
            time.sleep(0.002)
            with contextlib.suppress(OSError):
                data = b""
                with contextlib.suppress(BlockingIOError):
                    data = os.read(self._host, 4096)
                back = self._answer(data) + self._unasked
                if back:
                    os.write(self._host, back)

    def unplug(self) -> None:
        """Vanish, as a board does whose plug is pulled."""
        if not self._end.is_set():
            self._end.set()
            self._thread.join()
            os.close(self._host)
            os.close(self._guest or 0)


class Board:
    """An emulated controller in real time behind a pseudo-terminal; ``spoil`` may damage what it sends."""

    def __init__(self, *, spoil: Answer | None = None, silent_first: int = 0) -> None:
        self.controller = PythonBoard(UNO)
        self.spoil, self._deaf = spoil or (lambda data: data), silent_first
        self._began_s = time.monotonic()
        self.device = Device(self._answer)

    @property
    def now(self) -> int:
        return int((time.monotonic() - self._began_s) * 1e12 / UNO.tick_ps)

    def _answer(self, data: bytes) -> bytes:
        if data and self._deaf > 0:
            self._deaf -= 1
            return b""
        return self.spoil(self.controller.feed(data, self.now))


@contextlib.contextmanager
def plugged(device: Device) -> Iterator[Device]:
    try:
        yield device
    finally:
        device.unplug()


@pytest.fixture
def board() -> Iterator[Board]:
    made = Board()
    with plugged(made.device):
        yield made


@pytest.fixture
def program(make_plan: Callable[..., Plan]) -> Program:
    return make_program(make_plan(), capabilities(UNO, "gated"))


def opened(device: Device) -> Link:
    return Link(OpenPort(device.name))


def play(link: Link, program: Program, **how: Any) -> tuple[Outcome, list[RunProgress]]:
    beats: list[RunProgress] = []
    settings = {"cycles": None, "seconds": None, "watch": beats.append} | how
    return run_program(link, program, **settings), beats


def test_a_run_of_some_cycles_plays_them_and_ends_dark(board: Board, program: Program) -> None:
    link = opened(board.device)
    ready = prepare(link)
    assert (ready.identity.board, ready.caps.lines, ready.notes) == ("atmega328p", 8, ())
    outcome, beats = play(link, program, cycles=20)
    assert (outcome.ended, outcome.cycles, outcome.message) == ("done", 20, None)
    assert len(board.controller.edges) == 20 * 3 * 2
    assert board.controller.edges[0].tick == outcome.start_tick
    assert not board.controller.lit
    assert [beat.cycles for beat in beats] == sorted(beat.cycles for beat in beats)
    assert outcome.clock is not None
    assert abs(outcome.clock.offset_ppm) <= outcome.clock.gain_error_ppm + 50


def test_a_run_of_some_seconds_ends_in_time(board: Board, program: Program) -> None:
    link = opened(board.device)
    prepare(link)
    outcome, beats = play(link, program, seconds=0.5)
    assert outcome.ended == "done"
    *before, last = [beat.elapsed_s for beat in beats]
    assert before
    assert max(before) < 0.5 <= last, "the first look after its time ends it, however late a busy machine looks"
    assert beats[-1].left_s == 0
    assert board.controller.state == "idle"


def test_ctrl_c_stops_the_lights(board: Board, program: Program) -> None:
    def interrupt(beat: RunProgress) -> None:
        raise KeyboardInterrupt

    link = opened(board.device)
    prepare(link)
    outcome, _ = play(link, program, watch=interrupt)
    assert outcome.ended == "stopped"
    assert board.controller.state == "idle"
    assert not board.controller.lit


def test_a_fault_of_ours_while_lights_run_stops_them_too(board: Board, program: Program) -> None:
    def fail(beat: RunProgress) -> None:
        raise ZeroDivisionError

    link = opened(board.device)
    prepare(link)
    with pytest.raises(ZeroDivisionError):
        play(link, program, watch=fail)
    assert board.controller.state == "idle"


def test_unplugged_in_the_middle_is_one_paragraph_and_is_logged(board: Board, program: Program) -> None:
    link = opened(board.device)
    prepare(link)
    beats = 0

    def unplug(beat: RunProgress) -> None:
        nonlocal beats
        beats += 1
        if beats == 3:
            board.device.unplug()

    began_s = time.monotonic()
    outcome, _ = play(link, program, watch=unplug)
    assert time.monotonic() - began_s < 10
    assert outcome.ended == "lost"
    assert outcome.message is not None
    assert "connection to the controller broke" in outcome.message
    assert "\n" not in outcome.message
    assert "/dev" not in (outcome.fault or "")
    board.controller.advance(board.now + 1000 * 2000)
    assert (board.controller.state, board.controller.fault) == ("fault", "silent")
    assert not board.controller.lit


def test_a_request_that_is_refused_in_the_middle_is_no_broken_link(board: Board, program: Program) -> None:
    def refused(progress: RunProgress) -> None:
        raise RefusedError("the controller refused TRIM: no (E 7).", code=7)

    link = opened(board.device)
    prepare(link)
    outcome, _ = play(link, program, seconds=5, watch=refused)
    assert (outcome.ended, outcome.fault) == ("refused", "the board refused a request (E 7)")
    assert outcome.message == "the controller refused TRIM: no (E 7)."


def test_an_interlock_that_opens_ends_the_run_and_forbids_the_next(board: Board, program: Program) -> None:
    link = opened(board.device)
    prepare(link)
    outcome, _ = play(link, program, watch=lambda beat: board.controller.set_interlock("open", board.now))
    assert outcome.ended == "fault"
    assert outcome.fault is not None
    assert outcome.fault.startswith("interlock")
    with pytest.raises(PsvideoError, match="interlock is open"):
        prepare(link)
    board.controller.set_interlock("closed", board.now)
    assert "interlock" in prepare(link).notes[0]
    assert board.controller.fault == "none"


def test_a_board_that_restarts_in_the_middle_is_noticed(board: Board, program: Program) -> None:
    link = opened(board.device)
    prepare(link)
    outcome, _ = play(link, program, watch=lambda beat: board.controller.restart("brownout", board.now))
    assert outcome.ended == "fault"
    assert "reset: brownout" in (outcome.fault or "")


def test_a_board_that_counts_from_0_again_leaves_no_nonsense_clock(board: Board, program: Program) -> None:
    link = opened(board.device)
    prepare(link)
    beats: list[RunProgress] = []

    def restart_late(beat: RunProgress) -> None:
        beats.append(beat)
        if len(beats) == 5:
            board.controller.restart("watchdog", board.now)

    outcome, _ = play(link, program, watch=restart_late)
    assert outcome.ended == "fault"
    assert outcome.clock is not None
    assert outcome.clock.readings == 5
    assert abs(outcome.clock.offset_ppm) <= outcome.clock.gain_error_ppm + 1e3


def test_readings_after_a_fall_of_the_ticks_are_left_out() -> None:
    before = [ClockQuery(ticks=2 * 10**6 * n, asked_s=n - 1e-4, answered_s=n + 1e-4) for n in range(5)]
    after = [ClockQuery(ticks=2 * 10**6 * n, asked_s=5 + n - 1e-4, answered_s=5 + n + 1e-4) for n in range(5)]
    fit = fit_clock([*before, *after], tick_ps=500_000)
    assert fit == fit_clock(before, tick_ps=500_000)


def test_a_refused_trim_does_not_say_that_the_lights_are_dark(board: Board, program: Program) -> None:
    link = opened(board.device)
    prepare(link)
    said: list[str] = []

    def trim(beat: RunProgress) -> None:
        with pytest.raises(RefusedError) as caught:
            link.ask(Trim(way="later", ppm=10**6), Trimmed)
        said.append(str(caught.value))

    play(link, program, cycles=20, watch=trim)
    assert said
    assert all("dark" not in words and "The trim before it counts on" in words for words in said)


def test_a_board_that_is_silent_while_it_restarts_is_waited_for() -> None:
    with plugged((slow := Board(silent_first=2)).device):
        assert greet(opened(slow.device)).board == "atmega328p"


def damaging(every: int) -> Answer:
    """Flip a bit of every so many answers."""
    count = 0

    def spoil(data: bytes) -> bytes:
        nonlocal count
        if not data:
            return data
        count += 1
        return data if count % every else bytes([data[0] ^ 4]) + data[1:]

    return spoil


def test_damaged_answers_are_asked_for_again() -> None:
    with plugged((bad := Board(spoil=damaging(3))).device):
        link = opened(bad.device)
        greet(link)
        for ms in range(100, 120):
            assert link.ask(Keep(ms=ms), KeepSet).keep_ms == ms
        assert link.repaired > 5


def test_an_answer_that_lost_its_checksum_is_not_believed() -> None:
    count = 0

    def strip(data: bytes) -> bytes:
        nonlocal count
        count += data.startswith(b"OK keep_ms")
        return b"OK keep_ms=2000\n" if data.startswith(b"OK keep_ms") and count % 2 else data

    with plugged((bad := Board(spoil=strip)).device):
        link = opened(bad.device)
        greet(link)
        assert [link.ask(Keep(ms=ms), KeepSet).keep_ms for ms in (100, 200, 300)] == [100, 200, 300]


def test_an_answer_that_comes_late_is_not_taken_for_the_next_one() -> None:
    held = b""

    def delay(data: bytes) -> bytes:
        nonlocal held
        if data.startswith(b"OK keep_ms=100"):
            held += data
            return b""
        back, held = held + data, b"" if data else held
        return back if data else b""

    with plugged((late := Board(spoil=delay)).device):
        link = opened(late.device)
        greet(link)
        with pytest.raises(NoReplyError):
            link.ask(Keep(ms=100), KeepSet)
        assert [link.ask(Keep(ms=ms), KeepSet).keep_ms for ms in (200, 300)] == [200, 300]


def test_a_run_whose_answer_is_lost_is_never_sent_twice(board: Board, program: Program) -> None:
    link = opened(board.device)
    prepare(link)
    for request in program.upload():
        link.ask(request, request.reply)
    said: list[bytes] = []
    write = link.port.write
    link.port.write = lambda data: said.append(data) or write(data)  # type: ignore[method-assign,func-returns-value]
    board.spoil = lambda data: b""
    with pytest.raises(NoReplyError, match="no whole answer to RUN"):
        link.ask(Run(cycles=0), Started)
    assert sum(data.startswith(b"RUN") for data in said) == 1


def test_what_the_board_refuses_is_reported_with_its_number(board: Board) -> None:
    link = opened(board.device)
    greet(link)
    with pytest.raises(RefusedError, match=r"refused SLOT: duration 0 \(E 7\)") as caught:
        link.ask(Slot(slot=0, duration=0, dark=200, period=0), Slot.reply)
    assert caught.value.code == 7
    assert link.ask(Clear(), Cleared).state == "idle"


@pytest.mark.parametrize(
    ("answer", "unasked", "says"),
    [
        (lambda data: b"", b"", "nothing answers there"),
        (lambda data: data, b"", "sends back what it receives"),
        (lambda data: b"", b"$GPGGA,123519,4807.038,N,01131.000,E*47\r\n", "satellite receiver"),
        (lambda data: b"login: " if data else b"", b"", "not a strobe controller .it says 'login:"),
        (lambda data: b"\xff\x80" if data else b"", b"", "bytes that are not text"),
        (lambda data: b"OK\r\n" if data else b"", b"", "not a strobe controller"),
    ],
    ids=["silent", "echo", "gps", "login", "noise", "modem"],
)
def test_something_else_at_the_port_is_named(answer: Answer, unasked: bytes, says: str) -> None:
    with plugged(Device(answer, unasked=unasked)) as device:
        link = opened(device)
        began_s = time.monotonic()
        with pytest.raises(PsvideoError, match=says) as caught:
            greet(link, within_s=0.7)
        assert time.monotonic() - began_s < 4
        assert device.name in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_controller_of_another_protocol_is_refused(board: Board) -> None:
    ours, other = (seal(f"OK proto={n} board=atmega328p firmware=python-1 unit=emulated").encode() for n in (1, 2))
    board.spoil = lambda data: data.replace(ours, other)
    with pytest.raises(PsvideoError, match="speaks protocol 2, and this psvideo 1"):
        greet(opened(board.device))


def test_a_second_host_is_kept_out(board: Board) -> None:
    first = OpenPort(board.device.name)
    with pytest.raises(PsvideoError, match="in use by another program"):
        OpenPort(board.device.name)
    assert greet(Link(first)).unit == "emulated"


@pytest.mark.parametrize(
    ("name", "says"), [("/dev/ttyNOT0", "no such port"), ("socket://", "cannot"), ("gopher://x", "cannot be opened")]
)
def test_a_port_that_cannot_be_opened_is_one_paragraph(name: str, says: str) -> None:
    with pytest.raises(PsvideoError, match=says) as caught:
        OpenPort(name)
    assert "\n" not in str(caught.value)


def test_pyserial_urls_are_ports_too() -> None:
    server = socket.create_server(("127.0.0.1", 0))
    controller = PythonBoard(UNO)

    def serve() -> None:
        connection, _ = server.accept()
        with connection:
            while data := connection.recv(4096):
                connection.sendall(controller.feed(data, 0))

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    port = OpenPort(f"socket://127.0.0.1:{server.getsockname()[1]}")
    assert greet(Link(port)).board == "atmega328p"
    port.close()
    thread.join(5)
    server.close()


def test_the_emulated_port_needs_nothing_else(program: Program) -> None:
    link = Link(PythonBoardPort(UNO))
    prepare(link)
    outcome, _ = play(link, program, cycles=3)
    assert (outcome.ended, outcome.cycles) == ("done", 3)
    assert link.ask(Caps(), Capabilities).tick_ps == UNO.tick_ps


UNO_PORT = SerialPort(device="/dev/ttyACM0", vendor=0x2341, product=0x43)
PICO_PORT = SerialPort(device="COM7", vendor=0x2E8A, product=5, serial="E66")
COPY_PORT = SerialPort(device="/dev/ttyUSB0", vendor=0x1A86, product=0x7523)
PHONE_PORT = SerialPort(device="/dev/ttyACM1", vendor=0x05AC, product=1, description="Phone")


@pytest.mark.parametrize("ports", [[UNO_PORT], [PHONE_PORT, UNO_PORT], [COPY_PORT, UNO_PORT], [PICO_PORT, PHONE_PORT]])
def test_a_board_is_found_by_its_identity(ports: list[SerialPort]) -> None:
    assert choose_port(ports).board


def test_what_may_be_a_board_is_taken_where_it_is_the_only_one() -> None:
    assert choose_port([PHONE_PORT, COPY_PORT]) == COPY_PORT
    with pytest.raises(UsageError, match=r"several boards .*ttyUSB0.*ttyUSB1"):
        choose_port([COPY_PORT, replace(COPY_PORT, device="/dev/ttyUSB1")])
    with pytest.raises(PsvideoError, match=r"none that is known.*Phone"):
        choose_port([PHONE_PORT])
    with pytest.raises(PsvideoError, match="no serial port at all"):
        choose_port([])


@dataclass(frozen=True)
class Trip:
    """How long the two ways of a clock query take."""

    there_s: float
    back_s: float


@pytest.mark.parametrize("ppm", [-5000.0, 0.0, 30.0, 3000.0])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_clock_is_found_within_its_bound(ppm: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    tick_s = 0.5e-6 * (1 + ppm * 1e-6)
    readings = []
    for n in range(300):
        trip = Trip(*(0.001 + rng.exponential(0.003, 2)))
        at_s = 100.0 + 0.2 * n
        ticks = int((at_s - 40.0) / tick_s)
        readings.append(ClockQuery(ticks=ticks, asked_s=at_s - trip.there_s, answered_s=at_s + trip.back_s))
    fit = fit_clock(readings, tick_ps=500_000)
    assert fit is not None
    assert abs(fit.offset_ppm - ppm) <= fit.gain_error_ppm < 100
    assert abs(fit.host_s(readings[-1].ticks) - (100 + 0.2 * 299)) < 0.003
    assert fit.readings == 300


def test_a_clock_that_drifts_has_a_wider_bound() -> None:
    readings = []
    for n in range(100):
        at_s = 0.2 * n
        ticks = int((at_s + 1e-4 * at_s**2) / 0.5e-6)
        readings.append(ClockQuery(ticks=ticks, asked_s=at_s - 1e-4, answered_s=at_s + 1e-4))
    fit = fit_clock(readings, tick_ps=500_000)
    assert fit is not None
    assert fit.gain_error_ppm > 1000


def test_one_reading_is_no_clock() -> None:
    assert fit_clock([], tick_ps=1) is None
    assert fit_clock([ClockQuery(ticks=5, asked_s=0, answered_s=1)] * 3, tick_ps=1) is None


def test_rounds_and_seconds_become_whole_cycles(make_plan: Callable[..., Plan]) -> None:
    plan = make_plan(dark_every=4)
    assert cycles_for(plan, seconds=None, rounds=9) == 3
    assert cycles_for(plan, seconds=plan.cycle_s * 1.5, rounds=None) == 2
    assert cycles_for(plan, seconds=None, rounds=None) is None
