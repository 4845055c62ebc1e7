"""A plan in ticks: what is played is the plan to half a tick for ever; what cannot be played is refused by number."""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from psvideo.errors import PsvideoError, UsageError
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.strobe.bursts import POWER_TOLERANCE, find_bursts
from psvideo.strobe.limits import cycle_refusal, slot_refusal
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.lines import LONGEST_REQUEST
from psvideo.strobe.link.protocol import format_request, parse_reply
from psvideo.strobe.link.replies import Armed, Started
from psvideo.strobe.link.requests import Run, Wiring
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.program import Program, make_program, to_ticks
from psvideo.strobe.stand_ins.playing import Edge
from psvideo.strobe.stand_ins.python_board import PythonBoard

MakePlan = Callable[..., Plan]
UNO = capabilities(BOARDS["atmega328p"], "gated")
DIRECT = capabilities(BOARDS["atmega2560"], "direct")
PICO = capabilities(BOARDS["rp2040"], "direct")
BUSY = [HealthCheck.too_slow]
"""A machine that is busy is no reason to fail."""
WIRED: list[tuple[str, WiringName]] = [(name, wiring) for name, board in BOARDS.items() for wiring in board.lines]


def play(program: Program, board: str, wiring: WiringName, *, cycles: int) -> tuple[list[Edge], int]:
    """Upload a program to the emulation, run it, and return its edges and the tick at which the run starts."""
    controller = PythonBoard(BOARDS[board])
    replies = [controller.feed(format_request(Wiring(wiring=wiring)), 0)]
    replies += [controller.feed(format_request(request), 10) for request in program.upload()]
    assert all(reply.startswith(b"OK") for reply in replies), replies
    armed, _ = parse_reply(replies[-1].decode().strip(), Armed)
    assert isinstance(armed, Armed)
    assert armed.cycle == program.cycle_ticks
    started, _ = parse_reply(controller.feed(format_request(Run(cycles=cycles)), 20).decode().strip(), Started)
    assert isinstance(started, Started)
    now, end = 20, started.start + cycles * program.cycle_ticks
    while now < end:
        now += 10**11 // program.tick_ps
        controller.feed(b"STAT\n", now)
    assert controller.state == "idle"
    assert not controller.lit
    return controller.edges, started.start


@st.composite
def plans(draw: st.DrawFn, *, most_lights: int = 8) -> Plan:
    """Draw plans that every board can play: no light on for longer than the dark time, full power."""
    lights = [f"l{n}" for n in range(draw(st.integers(1, most_lights)))]
    dark_s = draw(st.floats(1e-3, 20e-3))
    durations = st.floats(30e-6, 1e-3)
    flashes = [PlannedFlash(lights={light: 1.0}, duration_s=draw(durations)) for light in lights]
    if draw(st.booleans()):
        flashes.append(PlannedFlash(lights={}, duration_s=draw(durations)))
    if draw(st.booleans()):
        flashes.append(PlannedFlash(lights=dict.fromkeys(lights[:2], 1.0), duration_s=draw(durations)))
    camera = Camera(width_px=8, height_px=8, fps=Fraction(100), exposure_s=0.01, readout_s=0.01)
    return Plan(
        camera=camera,
        flashes=tuple(draw(st.permutations(flashes))),
        dark_s=dark_s,
        dark_every=draw(st.integers(1, 5)),
    )


@settings(deadline=None, suppress_health_check=BUSY)
@given(plan=plans(most_lights=2), wired=st.sampled_from(WIRED), cycles=st.integers(1, 3))
def test_the_edges_are_those_of_the_plan_in_ticks(plan: Plan, wired: tuple[str, WiringName], cycles: int) -> None:
    board, wiring = wired
    program = make_program(plan, capabilities(BOARDS[board], wiring))
    edges, start = play(program, board, wiring, cycles=cycles)
    tick_s = program.tick_ps * 1e-12
    train = program.played.train(0, cycles * len(plan.cycle_slots))
    begins = np.round(train.start_s / tick_s).astype(int) + start
    expected = [
        edge
        for begin, slot in zip(begins, train.slot, strict=True)
        for light in plan.flashes[slot].lights
        for edge in _on_and_off(int(begin), to_ticks(plan.flashes[slot].duration_s, program.tick_ps), light, program)
    ]
    assert sorted(edges) == sorted(expected)
    for asked, played in zip(plan.flashes, program.played.flashes, strict=True):
        assert abs(asked.duration_s - played.duration_s) <= tick_s * (0.5 + 1e-6)
    assert abs(plan.dark_s - program.played.dark_s) <= tick_s * (0.5 + 1e-6)


def _on_and_off(begin: int, duration: int, light: str, program: Program) -> tuple[Edge, Edge]:
    line = program.lines[light]
    return Edge(tick=begin, line=line, level=1), Edge(tick=begin + duration, line=line, level=0)


def test_a_flash_of_more_lines_than_one_request_names_is_refused_before_anything_is_sent(make_plan: MakePlan) -> None:
    names = tuple("abcdefgh")
    flashes = (
        PlannedFlash(lights=dict.fromkeys(names, 1.0), duration_s=0.0008),
        PlannedFlash(lights=dict.fromkeys(names, 0.0), duration_s=0.0008),
    )
    plan = replace(make_plan(), flashes=flashes)
    caps = capabilities(BOARDS["rp2040"], "direct")
    with pytest.raises(PsvideoError, match=r"a flash of 8 lines takes a request of \d+ bytes, and the board reads 96"):
        make_program(plan, caps)
    program = make_program(plan, caps, lines=dict.fromkeys(names, 0))
    assert max(len(format_request(request).rstrip()) for request in program.upload()) <= LONGEST_REQUEST


def test_a_plan_in_whole_ticks_is_played_exactly_and_nothing_accumulates(make_plan: MakePlan) -> None:
    plan = replace(make_plan(), dark_s=0.0083425)
    program = make_program(plan, UNO)
    cycles = 2500
    edges, start = play(program, "atmega328p", "gated", cycles=cycles)
    train = plan.train(0, 4 * cycles)
    lit = np.array([not plan.flashes[slot].is_dark for slot in train.slot])
    begins_s = np.array([edge.tick - start for edge in edges if edge.level]) * 0.5e-6
    ends_s = np.array([edge.tick - start for edge in edges if not edge.level]) * 0.5e-6
    assert len(train.slot) == 10_000
    assert np.abs(begins_s - train.start_s[lit]).max() < 0.25e-6
    assert np.abs(ends_s - (train.start_s + train.duration_s)[lit]).max() < 0.25e-6


@settings(deadline=None, suppress_health_check=BUSY)
@given(plan=plans(), wired=st.sampled_from(WIRED))
def test_what_the_host_lets_pass_the_limits_let_pass(plan: Plan, wired: tuple[str, WiringName]) -> None:
    caps = capabilities(BOARDS[wired[0]], wired[1])
    try:
        program = make_program(plan, caps)
    except PsvideoError:
        return
    assert all(slot_refusal(slot, caps) is None for slot in program.slots)
    assert cycle_refusal(program.cycle, caps) is None
    assert all(len(format_request(request)) <= LONGEST_REQUEST + 1 for request in program.upload())


@settings(deadline=None, suppress_health_check=BUSY)
@given(power=st.floats(0.01, 1), other=st.floats(0.01, 1), duration=st.integers(40, 20_000))
def test_bursts_give_the_light_that_was_asked_for(power: float, other: float, duration: int) -> None:
    bursts = find_bursts((power, other), duration, UNO)
    if bursts is None:
        return
    for asked, on, given_power in zip((power, other), bursts.on, bursts.power, strict=True):
        lit = sum(min(on, duration - begin) for begin in range(0, duration, bursts.period))
        assert lit / duration == pytest.approx(given_power)
        assert abs(given_power - asked) <= POWER_TOLERANCE * asked
        assert on >= UNO.min_on
        assert on == bursts.period or bursts.period - on >= UNO.min_off


def test_usual_powers_divide_the_flash_evenly() -> None:
    for percent in (10, 20, 25, 40, 50, 60, 75, 80, 90):
        bursts = find_bursts((percent / 100,), 1600, UNO)
        assert bursts is not None
        assert bursts.power == (percent / 100,)
        assert 1600 % bursts.period == 0


def test_two_powers_in_one_flash_need_direct_wiring(make_plan: MakePlan) -> None:
    plan = make_plan(lights=("key", "left"))
    mixed = replace(plan, flashes=(PlannedFlash(lights={"key": 1.0, "left": 0.25}, duration_s=0.0008), *plan.flashes))
    program = make_program(mixed, DIRECT)
    assert {lit.line: lit.on / program.slots[0].period for lit in program.slots[0].lit} == {0: 1.0, 1: 0.25}
    edges, start = play(program, "atmega2560", "direct", cycles=1)
    first = [edge for edge in edges if edge.tick <= start + 1600]
    lit_ticks = {line: sum(e.tick * (1 - 2 * e.level) for e in first if e.line == line) for line in (0, 1)}
    assert lit_ticks == {0: 1600, 1: 400}
    with pytest.raises(PsvideoError, match=r"2 different powers .*gated wiring plays 1"):
        make_program(mixed, UNO)


def _changed(plan: Plan, **flash: object) -> Plan:
    return replace(plan, flashes=(replace(plan.flashes[0], **flash), *plan.flashes[1:]))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda plan: _changed(plan, duration_s=0.06), r"flash 1 \(key\) lasts 60 ms \(120000 ticks\).*50 ms"),
        (lambda plan: _changed(plan, duration_s=1e-5), r"flash 1 \(key\): on 20 < min_on 40"),
        (lambda plan: _changed(plan, duration_s=1e-8), r"flash 1 \(key\) lasts 0 ms"),
        (lambda plan: replace(plan, dark_s=5e-5), r"dark time is 0.05 ms \(100 ticks\).*0.1 ms \(200 ticks\)"),
        (lambda plan: replace(plan, dark_every=100), "a cycle is 301 flashes, and the board holds 240"),
        (lambda plan: replace(plan, dark_s=20.0), "cycle lasts 80 s, and the longest is 60 s"),
        (lambda plan: _changed(plan, lights={"key": 0.01}), "key at power 0.01.*nearest that can be played: 0.05"),
        (lambda plan: _changed(plan, lights={"key": 0.99}), "at power 0.99.*nearest that can be played: 0.95 or 1"),
        (
            lambda plan: replace(_changed(plan, duration_s=0.04), dark_s=0.0085),
            "key is on for 52.* % of the time, and the most is 50 %",
        ),
        (lambda plan: replace(plan, mode="synced"), "synced plan.*no wire"),
    ],
)
def test_a_plan_over_a_limit_is_refused_with_the_number(
    make_plan: MakePlan, change: Callable[[Plan], Plan], says: str
) -> None:
    with pytest.raises(PsvideoError, match=says) as caught:
        make_program(change(make_plan()), UNO, source="p.toml")
    assert str(caught.value).startswith("p.toml: ")
    assert "\n" not in str(caught.value)


def test_all_lines_together_have_a_limit(make_plan: MakePlan) -> None:
    names = tuple(f"l{n}" for n in range(8))
    plan = replace(make_plan(), flashes=(PlannedFlash(lights=dict.fromkeys(names, 1.0), duration_s=0.01),), dark_s=0.02)
    with pytest.raises(PsvideoError, match="all lights together are on for 267 %, and the most is 200 %"):
        make_program(plan, PICO)


def test_more_different_flashes_than_slots_are_refused(make_plan: MakePlan) -> None:
    flashes = tuple(PlannedFlash(lights={"key": 1.0}, duration_s=0.0005 + 1e-5 * n) for n in range(17))
    with pytest.raises(PsvideoError, match="17 different flashes, and the board holds 16"):
        make_program(replace(make_plan(), flashes=flashes), UNO)
    assert len(make_program(replace(make_plan(), flashes=flashes[:1] * 17), UNO).slots) == 1


def test_lights_take_the_lines_they_are_given_and_the_others_what_is_free(make_plan: MakePlan) -> None:
    assert dict(make_program(make_plan(), UNO).lines) == {"key": 0, "left": 1, "right": 2}
    assert dict(make_program(make_plan(), UNO, lines={"left": 0, "right": 7}).lines) == {
        "key": 1,
        "left": 0,
        "right": 7,
    }


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ({"kye": 0}, "did you mean 'key'"),
        ({"key": 8}, "8 lines with gated wiring, numbered 0 to 7"),
        ({"key": 1, "left": 1}, "has line 1 already"),
    ],
)
def test_wiring_that_cannot_be_is_refused(make_plan: MakePlan, lines: dict[str, int], says: str) -> None:
    with pytest.raises(UsageError, match=says):
        make_program(make_plan(), UNO, lines=lines)


def test_more_lights_than_lines_are_refused(make_plan: MakePlan) -> None:
    with pytest.raises(PsvideoError, match="4 lights and this board has 3 lines with direct wiring"):
        make_program(make_plan(lights=("a", "b", "c", "d")), DIRECT)


def test_lights_that_always_flash_together_may_share_a_line(make_plan: MakePlan) -> None:
    exchanged = [
        {f"{lamp}_{'rgb'[(n + k) % 3]}": 1.0 for n, lamp in enumerate(("key", "left", "top"))} for k in (0, 1, 2)
    ]
    plan = replace(make_plan(), flashes=tuple(PlannedFlash(lights=lit, duration_s=0.0008) for lit in (*exchanged, {})))
    with pytest.raises(PsvideoError, match="wire 3 lines, and say `line` key_r,left_g,top_b=0, `line` key_g,left_b,"):
        make_program(plan, UNO)
    lines = {light: line for line, lit in enumerate(exchanged) for light in lit}
    program = make_program(plan, UNO, lines=lines)
    assert [[one.line for one in slot.lit] for slot in program.slots] == [[0], [1], [2], []]
    assert [set(flash.lit) for flash in program.played.flashes] == [*map(set, exchanged), set()]
    with pytest.raises(UsageError, match="do not flash together"):
        make_program(plan, UNO, lines=lines | {"key_r": 1})
