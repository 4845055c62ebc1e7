"""Genlock through the picture: the strobe is trimmed until the dark row stands where it is wanted, and stays there."""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from firmware_board import TICK_CYCLES, firmware_board
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pico import Pico
from strobed_loop import StrobedLoop

from psvideo.errors import UsageError
from psvideo.formats.plan_toml import format_plan
from psvideo.live.chain import Chain
from psvideo.live.following.genlock import (
    STEP_PPM,
    DarkRow,
    WantedRow,
    check_holds,
    next_trim_ppm,
    rows_around,
    target_of,
)
from psvideo.live.following.holding import Holding, trim_by
from psvideo.live.following.phase_filter import Measured, started
from psvideo.live.following.trims import Trims
from psvideo.model.plan import Plan
from psvideo.runs.on_set.live_strobe import AskedLock, held_strobe
from psvideo.runs.steps.caller import PYTHON
from psvideo.strobe.as_played import as_played
from psvideo.strobe.link.boards import BOARDS, MAX_TRIM_PPM
from psvideo.strobe.link.exchange import RefusedError
from psvideo.strobe.link.lines import Error
from psvideo.strobe.link.requests import Trim
from psvideo.strobe.runlog import RunLog, format_log
from psvideo.strobe.stand_ins.python_board_port import PythonBoardPort
from psvideo.sync.rowfit.beat import FoundClock, train_between

PlanMaker = Callable[..., Plan]
HOLDS_ROWS = 2.0
UNO = BOARDS["atmega328p"]

EMULATED_AT_EDGE = AskedLock(where="edge", port="emulated", warned=True)


def held_plan(make_plan: PlanMaker, *, height_px: int = 72, readout: float = 0.9, fps: int = 50) -> Plan:
    """A plan whose flashes come every other frame."""
    plan = make_plan(
        width_px=4,
        height_px=height_px,
        fps=Fraction(fps),
        duration_s=0.002,
        readout=readout,
        clock_tolerance_ppm=3000.0,
        mode="half-rate",
    )
    return replace(plan, dark_s=2 * plan.camera.frame_period_s - 0.002)


def holding_of(loop: StrobedLoop, wanted: str) -> Holding:
    lead_s = 1e-3 * loop.board.board.trim_lead_ms
    return Holding(chain=loop.chain, target=target_of(loop.plan.camera, wanted), ask=loop.ask, lead_s=lead_s)


def off_rows(loop: StrobedLoop, holding: Holding) -> float:
    return loop.true_row().short_of(holding.target, rows_around(loop.plan.camera))


def lock(loop: StrobedLoop) -> None:
    for _ in loop.film(4.0):
        if loop.chain.state == "locked":
            return
    raise AssertionError(loop.chain.why)


@pytest.mark.parametrize(("wanted", "seconds"), [("20", 12.0), ("edge", 3.0), ("50-70", 3.0)])
def test_the_dark_row_is_where_it_is_wanted_after_three_seconds_and_stays(
    make_plan: PlanMaker, wanted: str, seconds: float
) -> None:
    def drifting(at_s: float) -> float:
        return 900 + 30 * math.sin(at_s / 7)

    loop = StrobedLoop(plan=held_plan(make_plan), offset_ppm=drifting, jitter_s=2e-6, seed=len(wanted))
    lock(loop)
    holding = holding_of(loop, wanted)
    assert abs(off_rows(loop, holding)) > 5, "it was elsewhere before"
    began_s = loop.host_s
    off = [(at_s, off_rows(loop, holding)) for at_s in loop.film(3.0 + seconds, holding)]
    late = np.array([rows for at_s, rows in off if at_s > began_s + 3.0])
    assert np.abs(late).max() < HOLDS_ROWS
    assert len(loop.chain.followed) == 1, "the lock is kept through every trim"
    assert -1000 < holding.ppm < -800


def errors_and_claims(loop: StrobedLoop) -> tuple[float, float]:
    """How far, in rows, the newest flash truly is from where the follower has it, and what it claims."""
    follower, at_s = loop.chain.follower, loop.starts_s[-1]
    assert follower is not None
    train = train_between(loop.plan, follower.clock, at_s, at_s)
    apart_s = train.start_s + 0.5 * train.duration_s - at_s
    return float(np.abs(apart_s).min()) / loop.plan.camera.row_time_s, follower.error_rows


@pytest.mark.parametrize(
    ("wanted", "offset_ppm", "wander_ppm"),
    [
        ("20", -2900, 0),
        ("edge", -900, 30),
        *(pytest.param(*case, marks=pytest.mark.campaign) for case in (("20", 900, 30), ("edge", 900, 0))),
    ],
)
def test_the_error_of_a_strobe_that_is_held_is_what_is_claimed_of_it(
    make_plan: PlanMaker, wanted: str, offset_ppm: float, wander_ppm: float
) -> None:
    """At the edge no row shows the flashes, which may lie anywhere between two frames."""

    def clock_ppm(at_s: float) -> float:
        return offset_ppm + wander_ppm * math.sin(at_s / 7)

    loop = StrobedLoop(plan=held_plan(make_plan), offset_ppm=clock_ppm, jitter_s=1e-6, seed=3)
    lock(loop)
    holding = holding_of(loop, wanted)
    began_s = loop.host_s
    both = np.array([errors_and_claims(loop) for at_s in loop.film(12.0, holding) if at_s > began_s + 3.0])
    assert np.sqrt(((both[:, 0] / both[:, 1]) ** 2).mean()) < 2.0
    assert np.median(both[:, 1]) < (0.02 if wanted == "20" else 1.0), "and what is claimed is little"


@pytest.mark.parametrize("trimmed_s", [0.0, 3.24, -3.24])
def test_a_clock_turns_about_the_moment_that_was_measured_however_far_it_was_trimmed(trimmed_s: float) -> None:
    """An hour of 900 ppm is three seconds, and a rate that is put right by 5 ppm about another moment 16 us."""
    at_s, late_s = 3600.0, 1e-5
    clock = FoundClock(phase_s=0.0, offset_ppm=0.0, knot_s=(0.0, at_s), bend_s=(0.0, trimmed_s))
    shift = started(clock, at_s, 1e-5, 50.0).corrected(Measured(at_s=at_s + 1.0, late_s=late_s, error_s=1e-7))

    def comes_s(one: FoundClock, unbent_s: float) -> float:
        strobe_s = (unbent_s - one.phase_s) / one.rate
        return one.phase_s + strobe_s * one.rate + float(one.bend(np.array([unbent_s]))[0])

    unbent_s = clock.unbent_s(at_s + 1.0)
    strobe_s = (unbent_s - clock.phase_s) / clock.rate
    later_s = comes_s(shift.clock, shift.clock.phase_s + strobe_s * shift.clock.rate) - (at_s + 1.0)
    assert later_s == pytest.approx(late_s, rel=0.05)


def test_the_boards_firmware_is_filmed_followed_trimmed_and_dark_once_its_host_is_silent(
    make_plan: PlanMaker, tmp_path: Path
) -> None:
    """The whole loop: its own edges light what the camera sees, and its serial line and steps take their time."""
    with firmware_board(tmp_path) as board:
        loop = StrobedLoop(plan=held_plan(make_plan), offset_ppm=lambda at_s: 900.0, jitter_s=2e-6, board=board)
        lock(loop)
        holding = holding_of(loop, "60")
        assert abs(off_rows(loop, holding)) > 5, "it was elsewhere before"
        began_s = loop.host_s
        off = [(at_s, off_rows(loop, holding)) for at_s in loop.film(3.8, holding)]
        late = np.array([rows for at_s, rows in off if at_s > began_s + 3.0])
        assert np.abs(late).max() < HOLDS_ROWS
        assert len(loop.chain.followed) == 1, "the lock is kept through every trim"
        assert -1000 < holding.ppm < -800
        silent = board.cycle // TICK_CYCLES
        board.take_edges()
        board.advance(silent + 4 * 10**6)
        edges = board.take_edges()
        assert edges[-1].level == 0
        assert edges[-1].tick < silent + 2.2 * 10**6, "a second of the keep-alive, and the flash in which it ends"


@pytest.mark.parametrize(("wanted", "fps"), [("20", 50), ("edge", 50), ("20", 120)])
def test_a_pico_whose_dma_plays_its_cycle_is_held_as_well(make_plan: PlanMaker, wanted: str, fps: int) -> None:
    """Its own program on its chip's model; at 120 frames a second a trim counts later than the step after the next."""
    plan = held_plan(make_plan, fps=fps)
    loop = StrobedLoop(plan=plan, offset_ppm=lambda at_s: 900 + 30 * math.sin(at_s / 7), jitter_s=1e-6, board=Pico())
    lock(loop)
    holding = holding_of(loop, wanted)
    assert abs(off_rows(loop, holding)) > 5, "it was elsewhere before"
    began_s = loop.host_s
    held = [(at_s, off_rows(loop, holding), holding.ppm) for at_s in loop.film(4.5, holding)]
    _, rows, ppm = np.array([one for one in held if one[0] > began_s + 3.0]).T
    assert np.abs(rows).max() < HOLDS_ROWS
    assert len(loop.chain.followed) == 1, "the lock is kept through every trim"
    assert (-1000 < ppm.mean() < -800, holding.note) == (True, ""), ppm
    assert loop.board.feed(b"STAT\n", round(loop.board_s / 8e-9)).startswith(b"OK state=running fault=none ")


def test_the_trim_is_released_when_the_strobe_is_lost_and_it_is_held_again_when_found(make_plan: PlanMaker) -> None:
    loop = StrobedLoop(plan=held_plan(make_plan), offset_ppm=lambda at_s: -400.0)
    lock(loop)
    holding = holding_of(loop, "30")
    for _ in loop.film(2.5, holding):
        pass
    assert holding.ppm != 0
    loop.blind = True
    for _ in loop.film(1.5, holding):
        pass
    assert (loop.chain.state, holding.ppm, holding.short_rows) == ("lost", 0, None)
    loop.blind = False
    for _ in loop.film(5.5, holding):
        pass
    assert loop.chain.state == "locked"
    assert abs(off_rows(loop, holding)) < HOLDS_ROWS


def test_a_trim_that_the_board_refuses_leaves_the_one_before_and_says_why(make_plan: PlanMaker) -> None:
    def refuse(request: object) -> object:
        raise RefusedError("dark < 2 min_dark", code=9)

    loop = StrobedLoop(plan=held_plan(make_plan), offset_ppm=lambda at_s: 900.0)
    lock(loop)
    holding = replace(holding_of(loop, "30"), ask=refuse)
    for _ in loop.film(0.5, holding):
        pass
    assert (holding.ppm, holding.note) == (0, "dark < 2 min_dark")
    assert loop.chain.follower is not None
    assert loop.chain.follower.trims.ppm == []


@pytest.mark.parametrize("code", [Error.RANGE, Error.COMMAND, Error.FAULT])
def test_whatever_a_board_refuses_a_trim_for_it_plays_on(make_plan: PlanMaker, code: Error) -> None:
    def refuse(request: object) -> object:
        raise RefusedError("no", code=code)

    loop = StrobedLoop(plan=held_plan(make_plan), offset_ppm=lambda at_s: 900.0)
    holding = replace(holding_of(loop, "30"), ask=refuse)
    assert not holding._trimmed(100)
    assert (holding.ppm, holding.most_ppm, holding.note) == (0, 0, "no")


def test_a_trim_whose_answer_was_lost_is_counted_and_asked_for_again(make_plan: PlanMaker) -> None:
    """The board has it, and refuses to take it a second time before it counts."""
    loop = StrobedLoop(plan=held_plan(make_plan), offset_ppm=lambda at_s: 0.0)
    holding = holding_of(loop, "30")
    asked: list[Trim] = []

    def lost_once(trim: Trim) -> object:
        asked.append(trim)
        if len(asked) == 1:
            raise RefusedError("running", code=Error.STATE)
        return trim

    holding = replace(holding, ask=lost_once)
    assert not holding._trimmed(-700)
    assert (holding.ppm, holding.most_ppm) == (0, 700)
    holding.beat(10.0)
    assert asked == [trim_by(-700), trim_by(0)], "nothing is followed, so none is wanted, and the board may have one"
    holding.beat(20.0)
    assert len(asked) == 2
    assert (holding.ppm, holding.most_ppm, holding.note) == (0, 700, "")


def test_a_pico_whose_program_takes_no_trims_yet_is_refused_before_it_flashes(
    make_plan: PlanMaker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("psvideo.strobe.stand_ins.rules.FIRMWARE", "pico-1.0")
    port, path = PythonBoardPort(BOARDS["rp2040"]), tmp_path / "plan.toml"
    monkeypatch.setattr("psvideo.runs.strobe.port._open", lambda *_: port)
    path.write_text(format_plan(held_plan(make_plan)))
    held = held_strobe(Chain(plan=held_plan(make_plan)), path, EMULATED_AT_EDGE, noted=print, caller=PYTHON)
    with pytest.raises(UsageError, match=r"pico-1.0, takes no trims yet. Copy the newer lights/pico/main.py"), held:
        pass
    assert port._controller.state == "idle"
    assert port._controller.feed(b"STAT\n", port._now()).split()[-1] == b"cycles=0"


def test_what_cannot_be_held_is_refused_in_one_paragraph(make_plan: PlanMaker) -> None:
    plan = held_plan(make_plan)
    check_holds(plan)
    with pytest.raises(UsageError, match="rolls through the picture"):
        check_holds(make_plan())
    with pytest.raises(UsageError, match="shutter"):
        check_holds(replace(plan, camera=replace(plan.camera, exposure_s=0.01)))
    for wanted in ("72", "30-20", "top", "-4", "3-80", "\u00b2", "3-\u00b2"):
        with pytest.raises(UsageError, match="rows are 0 to 71"):
            target_of(plan.camera, wanted)


def test_the_rows_to_keep_free_have_the_dark_row_farthest_from_them(make_plan: PlanMaker) -> None:
    camera = held_plan(make_plan).camera
    assert rows_around(camera) == pytest.approx(80)
    assert target_of(camera, "20-40").row == pytest.approx(70)
    assert target_of(camera, "edge").row == pytest.approx(76)
    upward = replace(camera, readout_s=-0.018)
    assert target_of(upward, "10").row == 61


def test_a_board_is_played_and_held_while_the_live_view_runs_and_dark_afterwards(
    make_plan: PlanMaker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    port, path = PythonBoardPort(UNO), tmp_path / "plan.toml"
    notes: list[str] = []
    monkeypatch.setattr("psvideo.runs.strobe.port._open", lambda *_: port)
    path.write_text(format_plan(held_plan(make_plan)))
    chain = Chain(plan=held_plan(make_plan))
    logs: list[RunLog] = []
    with held_strobe(chain, path, EMULATED_AT_EDGE, noted=notes.append, caller=PYTHON, logged=logs.append) as holding:
        assert wait_until(lambda: port._controller.state == "running")
        assert (holding.ppm, holding.short_rows) == (0, None)
        assert holding._trimmed(-900)
    assert (port._controller.state, notes) == ("idle", [])
    assert (logs[0].ended, logs[0].most_trim_ppm, logs[0].plan) == ("done", 900, "plan.toml")
    (tmp_path / "strobe.json").write_text(format_log(logs[0]))
    played = as_played(chain.plan, path)
    assert played.warning is None
    assert played.plan.clock_range_ppm == logs[0].tolerance_ppm + 100 + 900, "the search reaches what it was trimmed to"


def test_a_board_that_is_lost_is_a_sentence_and_not_the_end(
    make_plan: PlanMaker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = PythonBoardPort(UNO)
    notes: list[str] = []
    monkeypatch.setattr("psvideo.runs.strobe.port._open", lambda *_: port)
    path = tmp_path / "plan.toml"
    path.write_text(format_plan(held_plan(make_plan)))
    chain = Chain(plan=held_plan(make_plan))
    with held_strobe(chain, path, EMULATED_AT_EDGE, noted=notes.append, caller=PYTHON) as holding:
        assert wait_until(lambda: port._controller.state == "running")
        port._controller.restart("power", port._now())
        assert wait_until(lambda: holding.ended)
    assert "restarted" in notes[0]
    with (
        pytest.raises(UsageError, match="name `plan`"),
        held_strobe(chain, None, EMULATED_AT_EDGE, noted=notes.append, caller=PYTHON),
    ):
        pass


def test_a_trim_counts_from_its_moment_though_minutes_of_another_lie_before_it() -> None:
    trims = Trims()
    trims.add(10.0, -900.0)
    trims.add(600.0, 1000.0)
    clock = trims.bent(FoundClock(phase_s=0.0, offset_ppm=0.0), since_s=599.0)
    strobe_s = np.linspace(600.4, 600.7, 30_001)
    comes_s = strobe_s + clock.bend(strobe_s)
    assert (comes_s[0], comes_s[-1]) < (600.0, 600.2), "half a second sooner than without trims"
    slope_ppm = 1e6 * np.diff(clock.bend(strobe_s)) / np.diff(strobe_s)
    np.testing.assert_allclose(slope_ppm[comes_s[1:] < 600.0], -900, atol=0.1)
    np.testing.assert_allclose(slope_ppm[comes_s[:-1] > 600.0], 1000, atol=0.1)


def test_trims_come_late_by_the_sum_of_what_each_adds_however_many_there_are() -> None:
    rng = np.random.default_rng(1)
    trims, asked_s = Trims(), np.linspace(-1.0, 41.0, 501)
    for at_s in [0.0, *np.sort(rng.uniform(0, 40, 300)).tolist(), 40.0]:
        trims.add(at_s, float(rng.integers(-MAX_TRIM_PPM, MAX_TRIM_PPM)))
    steps_ppm = np.diff(trims.ppm, prepend=0.0)
    since_s = np.maximum(asked_s[:, None] - np.array(trims.at_s), 0.0)
    np.testing.assert_allclose(trims.late_s(asked_s), 1e-6 * since_s @ steps_ppm, atol=1e-12)


def test_a_trim_costs_the_same_after_an_hour_as_in_the_first_minute() -> None:
    trims, clock = Trims(), FoundClock(phase_s=0.0, offset_ppm=30.0)

    def least_cost_s(first: int) -> float:
        costs = []
        for number in range(first, first + 50):
            began_s = time.process_time()
            trims.add(0.1 * number, float(number * 37 % 2000 - 1000))
            trims.bent(clock, since_s=0.1 * number - 1.0)
            costs.append(time.process_time() - began_s)
        return min(costs)

    early_s = least_cost_s(100)
    for number in range(150, 3000):
        trims.add(0.1 * number, float(number * 37 % 2000 - 1000))
    assert least_cost_s(3000) < 5 * early_s


def test_the_flashes_of_a_moment_are_as_few_after_hours_of_trims_as_before(make_plan: PlanMaker) -> None:
    """Hours of trims have it flash many cycles sooner or later, and no more flashes lie between two frames for that."""
    plan, trims = held_plan(make_plan), Trims()
    rng = np.random.default_rng(2)
    for at_s in np.arange(0, 7200, 5.0).tolist():
        trims.add(at_s, float(rng.normal(-900, 300)))
    clock = trims.bent(FoundClock(phase_s=0.01, offset_ppm=1300.0), since_s=7190.0)
    cycle = len(plan.cycle_slots)
    every = plan.train(0, cycle * int(7220 / plan.cycle_s))
    straight_s = clock.phase_s + every.start_s * clock.rate
    true_s = straight_s + clock.bend(straight_s)
    assert abs(true_s[-1] - straight_s[-1]) > 10 * plan.cycle_s
    train = train_between(plan, clock, 7195.0, 7195.1)
    within = true_s[(true_s > 7195.0) & (true_s < 7195.1)]
    assert len(train.start_s) <= 4 * cycle, "the one or two around the moment, and one more at either end"
    assert all(np.abs(train.start_s - one).min() < 1e-9 for one in within)
    assert train.start_s[0] < 7195.0 - 0.5 * plan.cycle_s
    assert train.start_s[-1] > 7195.1 + 0.5 * plan.cycle_s


def test_frames_do_not_wait_for_the_boards_answer_to_a_trim(make_plan: PlanMaker) -> None:
    loop = StrobedLoop(plan=held_plan(make_plan), offset_ppm=lambda at_s: 900.0)
    lock(loop)
    taken = []

    def slow(request: object) -> object:
        def take() -> None:
            with loop.chain.at_rest():
                taken.append(request)

        frame = threading.Thread(target=take, daemon=True)
        frame.start()
        frame.join(5.0)
        return len(taken)

    holding = replace(holding_of(loop, "30"), ask=slow)
    holding.beat(loop.host_s)
    assert taken == [trim_by(holding.ppm)]
    assert loop.chain.follower is not None
    assert loop.chain.follower.trims.ppm == [holding.ppm]


def wait_until(true: Callable[[], bool]) -> bool:
    end_s = time.monotonic() + 20
    while not true() and time.monotonic() < end_s:
        time.sleep(0.01)
    return true()


@given(
    now_ppm=st.integers(-MAX_TRIM_PPM, MAX_TRIM_PPM),
    row=st.floats(0, 79),
    wanted=st.floats(0, 79),
    slip_ppm=st.floats(-50_000, 50_000),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_trim_leaves_a_boards_range_or_jumps(
    make_plan: PlanMaker, now_ppm: int, row: float, wanted: float, slip_ppm: float
) -> None:
    camera = held_plan(make_plan).camera
    trim = next_trim_ppm(now_ppm, DarkRow(row=row, slip_ppm=slip_ppm), WantedRow(row=wanted), camera)
    assert abs(trim) <= MAX_TRIM_PPM
    assert abs(trim - now_ppm) <= STEP_PPM


def test_a_trim_takes_off_what_slips_and_pulls_the_shorter_way(make_plan: PlanMaker) -> None:
    camera = held_plan(make_plan).camera
    assert next_trim_ppm(0, DarkRow(row=20, slip_ppm=300.0), WantedRow(row=20), camera) == -300
    assert next_trim_ppm(0, DarkRow(row=2, slip_ppm=0.0), WantedRow(row=78), camera) < 0
    assert next_trim_ppm(0, DarkRow(row=78, slip_ppm=0.0), WantedRow(row=2), camera) > 0
