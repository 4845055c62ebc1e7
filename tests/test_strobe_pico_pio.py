"""The Pico's PIO program, assembled and emulated, makes every edge in the clock cycle that the plan says."""

import random
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from types import FunctionType
from typing import Any

import adafruit_pioasm
import pytest
from pico import PROGRAM, random_slot
from pioemu import State, emulate  # type: ignore[attr-defined]
from rp2040 import MOV_PINS_NULL, Chip, board_of

from psvideo.strobe.link.requests import Lit, Slot
from psvideo.strobe.stand_ins.playing import Trimming, moments

LEAD = 1_250_000
ROUNDS = 3


def assembled(play: FunctionType) -> adafruit_pioasm.Program:
    """Return the PIO program that stands in main.py in MicroPython's words."""
    text = [".program play"]
    words: dict[str, Any] = {name: name for name in ("pins", "x")} | {"x_dec": "x--"}
    words["out"] = lambda where, bits: text.append(f"out {where}, {bits}")
    words["jmp"] = lambda when, where: text.append(f"jmp {when} {where}")
    words["label"] = lambda name: text.append(f"{name}:")
    words["wrap_target"] = lambda: text.append(".wrap_target")
    words["wrap"] = lambda: text.append(".wrap")
    FunctionType(play.__code__, words)()
    return adafruit_pioasm.Program("\n".join(text))


def words_of(cycle: Sequence[Slot], rounds: int, trims: Sequence[tuple[int, int]] = ()) -> list[list[int]]:
    """Return what the DMA brings to each state machine behind the lead, as the table makes it.

    A trim (ppm, the step from which it counts) is written while the first group has read up to the step before that
    one, and the other group hardly anything.
    """
    chip = Chip()
    board = board_of(PROGRAM, chip)
    slots = [(slot.duration, slot.dark, slot.period, [(lit.line, lit.on) for lit in slot.lit]) for slot in cycle]
    pace = PROGRAM.Pace(board.pace)
    ending = pace.lay_out([slot.duration + slot.dark for slot in cycle], min(slot.dark for slot in cycle))
    pace.wind(rounds)
    tables = [PROGRAM.Table(group, link) for group, link in enumerate(board.links)]
    for table in tables:
        table.lay_out(slots, range(len(slots)), ending)
        table.wind(rounds)
    board.start([table.lead_address for table in tables])
    pace.begin(0)
    words: list[list[Any]] = [[], []]
    for ppm, since in trims:
        while board.read_places()[0] < since - 1:
            words[0].append(chip.take_word(0))
        pace.trim(ppm, since)
        pace.write()
    for group in (0, 1):
        words[group] += iter(partial(chip.take_word, group), None)
    assert all(of_group[:2] == [0, LEAD - 10] for of_group in words)
    return [of_group[2:] for of_group in words]


def play(opcodes: Sequence[int], words: Sequence[int], until: int) -> list[tuple[int, int]]:
    """Return (cycle, pins) of every change that the state machine makes, from its first output on."""
    start = State(transmit_fifo=deque(words), pin_directions=0xF)
    changes, first, pins = [], None, 0
    run = emulate(
        list(opcodes),
        stop_when=lambda _, state: state.clock > until or (not state.transmit_fifo and state.x_register == 0),
        initial_state=start,
        auto_pull=True,
        out_base=0,
        out_count=4,
    )
    for before, after in run:
        if first is None and after.program_counter == 1:
            first = before.clock
        if after.pin_values != pins and first is not None:
            pins = after.pin_values
            changes.append((before.clock - first, pins))
    return changes


def extras(cycle: Sequence[Slot], rounds: int, trims: Sequence[tuple[int, int]]) -> list[int]:
    """Return by how many ticks the controller in Python makes each step longer."""
    trimming, longer = Trimming(steps=cycle), list[int]()
    for ppm, since in [*trims, (0, len(cycle) * rounds)]:
        longer += [trimming.extra(step) for step in range(len(longer), since)]
        trimming.trim(ppm, step=since - 2, not_before=0)
    return longer


def expected(
    cycle: Sequence[Slot], rounds: int, group: int, trims: Sequence[tuple[int, int]] = ()
) -> list[tuple[int, int]]:
    """Return the same from the cycle's edges."""
    pins, changes = 0, {}
    longer = extras(cycle, rounds, trims)
    for moment in moments(cycle, start=0, cycles=rounds, extra=lambda step: longer[step]):
        if moment.edge is not None and moment.edge.line // 4 == group:
            pins ^= 1 << moment.edge.line % 4
            changes[moment.tick] = pins
    levels = [(0, 0), *sorted(changes.items())]
    return [after for before, after in pairwise(levels) if before[1] != after[1]]


def flash(duration: int, period: int, on: dict[int, int]) -> Slot:
    """Return a flash with 400 ticks dark behind it: less than the board allows, to have less to emulate."""
    lit = tuple(Lit(line=line, on=ticks) for line, ticks in on.items())
    return Slot(slot=0, duration=duration, dark=400, period=period, lit=lit)


CYCLES = {
    "one flash": [flash(1000, 1000, {0: 1000, 5: 1000})],
    "the shortest flash": [flash(125, 125, dict.fromkeys(range(8), 125))],
    "one line after the other": [flash(500, 500, {0: 500}), flash(501, 501, {3: 501}), flash(502, 502, {7: 502})],
    "bursts as dense as they may be": [flash(5000, 250, dict.fromkeys(range(8), 125))],
    "ends a tick apart": [flash(2000, 400, {0: 125, 1: 126, 2: 127, 3: 128, 4: 200, 5: 201, 6: 203, 7: 275})],
    "ends as far apart as an entry": [
        flash(2000, 400, {0: 130, 1: 138, 2: 148, 3: 158, 4: 130, 5: 139, 6: 149, 7: 150})
    ],
    "full power beside bursts": [flash(1500, 500, {0: 500, 1: 200, 4: 500})],
    "a last burst that is cut": [flash(1130, 500, {0: 130, 1: 129, 2: 125, 3: 375, 6: 300})],
    "a dark slot": [flash(300, 300, {2: 300}), flash(1, 1, {}), flash(301, 301, {2: 301})],
}


@pytest.mark.parametrize("name", CYCLES)
def test_every_edge_is_in_its_clock_cycle_over_back_to_back_cycles(name: str) -> None:
    made = assembled(PROGRAM.play)
    for group, words in enumerate(words_of(CYCLES[name], ROUNDS)):
        length = ROUNDS * sum(slot.duration + slot.dark for slot in CYCLES[name])
        assert play(made.assembled, words, length) == expected(CYCLES[name], ROUNDS, group)


@pytest.mark.parametrize("seed", range(12))
@pytest.mark.campaign
def test_edges_of_random_cycles_are_too(seed: int) -> None:
    dice = random.Random(seed)
    cycle = [replace(random_slot(dice, 0), dark=400) for _ in range(3)]
    length = ROUNDS * sum(slot.duration + slot.dark for slot in cycle)
    for group, words in enumerate(words_of(cycle, ROUNDS)):
        assert play(assembled(PROGRAM.play).assembled, words, length) == expected(cycle, ROUNDS, group)


@pytest.mark.parametrize("trims", [[(20_000, 2)], [(-20_000, 3)], [(777, 2), (-12_345, 5), (0, 9)]])
@pytest.mark.parametrize("name", ["one line after the other", "a last burst that is cut", "full power beside bursts"])
@pytest.mark.campaign
def test_both_groups_make_every_edge_in_its_clock_cycle_over_trims(name: str, trims: list[tuple[int, int]]) -> None:
    cycle, rounds = CYCLES[name] * 2, 8
    assert any(extras(cycle, rounds, trims))
    length = rounds * sum(slot.duration + slot.dark for slot in cycle) + sum(extras(cycle, rounds, trims))
    for group, words in enumerate(words_of(cycle, rounds, trims)):
        assert play(assembled(PROGRAM.play).assembled, words, length) == expected(cycle, rounds, group, trims)


def test_the_program_wraps_around_and_fits() -> None:
    made = assembled(PROGRAM.play)
    assert made.pio_kwargs["wrap_target"] == 0
    assert made.pio_kwargs.get("wrap", len(made.assembled) - 1) == len(made.assembled) - 1 == PROGRAM.STATES + 1
    assert len(made.assembled) == PROGRAM.SHORTEST


def test_what_darkens_is_one_instruction() -> None:
    assert adafruit_pioasm.assemble("mov pins, null")[0] == MOV_PINS_NULL


@pytest.mark.parametrize("delay", [0, 1, 1000])
def test_an_entry_lasts_ten_cycles_and_its_wait(delay: int) -> None:
    words = [0x0000_0F0F, delay, 0x1111_1111, 0]
    changes = play(assembled(PROGRAM.play).assembled, words, delay + 100)
    assert changes == [(0, 15), (1, 0), (2, 15), (3, 0), (10 + delay, 1)]
