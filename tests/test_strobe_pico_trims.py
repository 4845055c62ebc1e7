"""A Pico's steps are trimmed while its DMA plays them, to the tick, and its two groups of lines stay in step."""

import random
from array import array
from itertools import pairwise
from typing import Any

import pytest
from pico import ARM, LOADED, MS, PROGRAM, US, Pico, in_order, same_answer, upload

from psvideo.strobe.limits import cycle_check
from psvideo.strobe.link.boards import BOARDS
from psvideo.strobe.link.requests import Lit, Slot
from psvideo.strobe.stand_ins.playing import Edge
from psvideo.strobe.stand_ins.python_board import PythonBoard

BOTH = tuple(Lit(line=line, on=125) for line in (0, 7))
SHORT = Slot(slot=0, duration=125, dark=25_600, period=125, lit=BOTH)
"""Nearly as short as a step may be that is trimmed; lit in both groups."""
UNLIKE = Slot(slot=1, duration=10_000, dark=30_000, period=500, lit=(Lit(line=0, on=500), Lit(line=7, on=125)))
"""One group plays this flash as a whole, the other as bursts."""
HALF = Slot(slot=0, duration=30_000, dark=30_000, period=30_000, lit=(Lit(line=1, on=30_000),))
"""On for as large a share as may be."""


def uploaded(slots: list[Slot], steps: list[int]) -> list[str]:
    said = ["KEEP 2000"]
    for place, slot in enumerate(slots):
        lit = " ".join(f"{one.line}:{one.on}" for one in slot.lit)
        said.append(f"SLOT {place} {slot.duration} {slot.dark} {slot.period} {lit}")
    said += [f"STEPS {first} {' '.join(map(str, steps[first : first + 20]))}" for first in range(0, len(steps), 20)]
    return [*said, f"ARM {cycle_check([slots[step] for step in steps])}"]


class Both:
    """The Pico and the controller in Python, asked the same at the same ticks."""

    def __init__(self, lines: list[str]) -> None:
        self.pico, self.python = Pico(), PythonBoard(BOARDS["rp2040"])
        self.edges: list[Edge] = []
        self.now = 0
        for line in lines:
            assert self.ask(line).startswith(b"OK"), line

    def ask(self, line: str, wait: int = 0) -> bytes:
        """Ask after a wait of so many ticks, and hold the answers and the edges until then against each other.

        The Pico's clock steps by microseconds.
        """
        self.now = (self.now + wait) // US * US
        data = f"{line}\n".encode()
        said, expected = self.pico.feed(data, self.now), self.python.feed(data, self.now)
        assert same_answer(said, expected), (line, said, expected)
        edges = in_order(self.pico.take_edges())
        assert edges == in_order(self.python.take_edges()), (line, self.now)
        self.edges += edges
        return said


LONG_RUNS = {8, 15, 19, 21}
"""Seeds of runs without end, as that of 0 is: a second and more each."""


@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=pytest.mark.campaign) if seed in LONG_RUNS else seed for seed in range(25)]
)
def test_random_trims_at_random_moments_are_played_to_the_tick(seed: int) -> None:
    dice = random.Random(seed)
    both = Both([*upload(dice, darker=dice.choice([12_500, 40_000])), f"RUN {dice.choice([0, 0, 7, 30])}"])
    for _ in range(18):
        line = dice.choice(["STAT", "CLK a", *["TRIM {} {}".format(*trim(dice))] * 5])
        both.ask(line, dice.choice([0, US, dice.randint(0, 9 * MS), dice.randint(0, 60 * MS)]))
    both.ask(dice.choice(["STOP", "STAT"]), dice.randint(0, 20 * MS))
    both.ask("STAT", 1010 * MS)


def trim(dice: random.Random) -> tuple[str, int]:
    return dice.choice(["later", "sooner"]), dice.choice([0, 1, 20_000, 20_001, dice.randint(0, 20_000)])


@pytest.mark.parametrize("after", [*range(-3 * US, 3 * US + 1, US), 100 * US, 200 * US])
def test_a_trim_near_a_steps_begin_counts_as_in_the_controller_in_python(after: int) -> None:
    """The DMA reads ahead there; the step that is played decides, by the clock's tick."""
    both = Both([*uploaded([SHORT], [0]), "RUN 0"])
    begin = both.pico.controller.start + 4 * (SHORT.duration + SHORT.dark)
    assert both.ask("TRIM sooner 20000", begin + after) == b"OK way=sooner ppm=20000\n"
    for _ in range(8):
        both.ask("STAT", 4 * MS)
    both.ask("TRIM later 3", 1)
    both.ask("STAT", 60 * MS)


def test_a_trimmed_cycle_lasts_as_long_as_asked_for_to_the_tick() -> None:
    """A ppm of a step of 25,725 ticks is a fortieth of a tick."""
    both = Both([*uploaded([SHORT], [0]), "RUN 0", "TRIM later 1"])
    both.ask("STAT", 700 * MS)
    ticks = [edge.tick for edge in both.edges if (edge.line, edge.level) == (0, 1)]
    steps = len(ticks) - 1
    since = next(step for step, tick in enumerate(ticks) if tick >= 20 * MS)
    longer = (steps - since) * 25_725 // 10**6
    assert longer > 80
    assert ticks[-1] - ticks[0] == steps * 25_725 + longer


@pytest.mark.parametrize("cycles", [1, 30, 1024, 1200])
def test_a_trimmed_run_ends_by_itself_and_the_next_one_is_as_uploaded(cycles: int) -> None:
    both = Both([*uploaded([SHORT], [0, 0]), f"RUN {cycles}", "TRIM later 19999"])
    for _ in range(4):
        both.ask("STAT", 150 * MS)
    assert both.ask("STAT") == b"OK state=idle fault=none reset=power interlock=closed cycle=%d step=0 cycles=%d\n" % (
        cycles,
        cycles,
    )
    both.ask(uploaded([SHORT], [0, 0])[-1])
    both.ask("RUN 3")
    both.ask("STAT", 30 * MS)


def test_a_stop_in_the_middle_is_dark_and_takes_the_trim_off() -> None:
    both = Both([*LOADED.decode().splitlines(), ARM.decode().strip(), "RUN 0"])
    both.ask("TRIM sooner 15000", 30 * MS)
    both.ask("STOP", 200 * MS)
    assert not both.pico.chip.lit
    both.ask(ARM.decode().strip(), 1000 * MS)
    both.ask("RUN 20")
    both.ask("STAT", 900 * MS)


def test_long_dark_times_and_cycles_of_every_length_are_trimmed() -> None:
    """A minute's cycle with its dark times as long as they may be, and one of many steps with many bursts."""
    rare = Slot(slot=0, duration=250, dark=2**31 - 1, period=250, lit=(Lit(line=3, on=250),))
    both = Both([*uploaded([rare], [0, 0, 0]), "RUN 0", "TRIM sooner 20000"])
    for _ in range(20):
        both.ask("STAT", 1900 * MS)
    bursts = Slot(slot=1, duration=50_183, dark=160_000, period=333, lit=(Lit(line=0, on=125), Lit(line=5, on=200)))
    both = Both([*uploaded([SHORT, bursts], [0, 1, 1] * 80), "RUN 0", "TRIM later 777"])
    both.ask("STAT", 60 * MS)
    both.ask("TRIM sooner 20000", 60 * MS)
    both.ask("STAT", 60 * MS)


@pytest.mark.parametrize(
    ("slot", "line", "code"),
    [
        (SHORT, "TRIM later 20000", None),
        (SHORT, "TRIM sooner 20001", 7),
        (SHORT, "TRIM less 1", 6),
        (SHORT, "TRIM later x", 6),
        (SHORT, "TRIM later", 5),
        (Slot(slot=0, duration=125, dark=25_000, period=125, lit=BOTH), "TRIM later 0", None),
        (Slot(slot=0, duration=125, dark=25_000, period=125, lit=BOTH), "TRIM sooner 1", 9),
        (Slot(slot=0, duration=125, dark=24_999, period=125, lit=BOTH), "TRIM later 0", 9),
        (HALF, "TRIM later 9", None),
        (HALF, "TRIM sooner 1", 9),
    ],
)
def test_a_trim_is_refused_as_on_the_other_boards(slot: Slot, line: str, code: int | None) -> None:
    both = Both([*uploaded([slot], [0]), "RUN 0"])
    assert both.ask(line, 30 * MS).startswith(b"OK" if code is None else b"E %d " % code)
    both.ask("TRIM later 1", 1)
    both.ask("STAT", 100 * MS)


def test_a_cycle_is_never_made_longer_than_a_minute() -> None:
    slow = Slot(slot=0, duration=250, dark=1_874_990_000, period=250, lit=(Lit(line=3, on=250),))
    both = Both([*uploaded([slow], [0, 0, 0, 0]), "RUN 0"])
    assert both.ask("TRIM later 6", 30 * MS).startswith(b"E 9 ")
    assert both.ask("TRIM later 5", 30 * MS).startswith(b"OK")


@pytest.mark.parametrize("seed", range(12))
def test_no_steps_word_is_read_before_the_step_is_played_and_each_while_it_is(seed: int) -> None:
    """However short its flash and however early the DMA brings data: so words may change until their step begins."""
    both = Both([*upload(random.Random(seed), darker=12_500), "RUN 0", "TRIM later 20000"])
    pico, pace = both.pico, both.pico.controller.pace
    pico.advance(40 * MS)
    for _ in range(40):
        step, at = pace.step, pace.at
        begins = at + pace._length(step)
        pico.chip.advance(begins - 1)
        assert pico.controller.hardware.read_places() == [(step + 1) % PROGRAM.RING] * 2
        pico.chip.advance(begins + US)
        pico.controller.poll()
        assert pace.step == step + 1
    assert pico.controller.state == "running"


# What a program that stands still now and then does ------------------------


class SlowWords:
    """The ring's words, written by a program that is held up now and then."""

    def __init__(self, words: "array[int]", held_up: Any) -> None:
        self.words, self.held_up = words, held_up

    def __getitem__(self, place: int) -> int:
        return self.words[place]

    def __setitem__(self, place: int, word: int) -> None:
        self.held_up()
        self.words[place] = word
        self.held_up()


def slowed(pico: Pico, dice: random.Random, longest: int) -> None:
    """Hold a program up now and then, wherever it reads the clock or the DMA or writes a step's word."""
    hardware, pace = pico.controller.hardware, pico.controller.pace

    def held_up(rarely: float) -> None:
        if dice.random() < rarely:
            pico.chip.advance(pico.chip.cycle + dice.randint(0, longest))

    def after(read: Any) -> Any:
        def then() -> Any:
            held_up(0.01)
            value = read()
            held_up(0.01)
            return value

        return then

    hardware.ticks, hardware.read_places = after(hardware.ticks), after(hardware.read_places)
    pace.words = SlowWords(pace.words, lambda: held_up(0.0003))


def rises(pico: Pico, line: int) -> list[int]:
    return [tick for tick, one, level in pico.chip.edges if (one, level) == (line, 1)]


def apart(pico: Pico) -> list[int]:
    """Return the ticks in which line 0 went on and line 7, of the other group, did not."""
    return sorted({*rises(pico, 0)} - {*rises(pico, 7)})


def trimmed(slot: Slot) -> Pico:
    """Return a Pico whose only step was trimmed, some steps ago."""
    pico = Pico()
    for line in [*uploaded([slot], [0]), "RUN 0", "TRIM later 20000"]:
        assert pico.feed(f"{line}\n".encode(), 0).startswith(b"OK")
    pico.advance(100 * MS)
    return pico


class OnceLate:
    """The ring's words; the first of a new trim is written when the run is in the middle of its step."""

    def __init__(self, pico: Pico) -> None:
        self.pico, self.words, self.late = pico, pico.controller.pace.words, True

    def __getitem__(self, place: int) -> int:
        word: int = self.words[place]
        return word

    def __setitem__(self, place: int, word: int) -> None:
        pace, chip = self.pico.controller.pace, self.pico.chip
        if self.late and pace.step < pace.since == pace.written:
            self.late = False
            step, at = pace.step, pace.at
            while step < pace.since:
                at += pace._length(step)
                step += 1
            chip.advance(at + UNLIKE.duration // 2)
        self.words[place] = word


def test_groups_that_read_different_words_of_a_step_are_dark_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """One group reads a step's word behind its flash, the other at its beginning: a word that is late comes between."""
    pico = trimmed(UNLIKE)
    pico.controller.pace.words = OnceLate(pico)
    assert pico.feed(b"TRIM sooner 20000\n", 101 * MS) == b"E 12 late\n"
    assert not pico.chip.lit
    assert not apart(pico), "it was dark before the step after that"
    monkeypatch.setattr(PROGRAM.Pace, "is_unread", lambda *_: True)
    pico = trimmed(UNLIKE)
    pico.controller.pace.words = OnceLate(pico)
    pico.feed(b"TRIM sooner 20000\n", 101 * MS)
    pico.chip.advance(200 * MS)
    assert apart(pico), "and without that look they would have come apart"


@pytest.mark.parametrize("steps", [-3, 1, 3, 500])
@pytest.mark.parametrize("group", [0, 1])
def test_a_group_that_does_not_read_where_the_clock_says_is_dark_at_once(group: int, steps: int) -> None:
    pico = trimmed(SHORT)
    link = pico.controller.hardware.links[group]
    pico.chip.channels[link.pace].read += 4 * steps - (PROGRAM.RING * 4 if steps == 500 else 0)
    pico.controller.poll()
    assert (pico.controller.fault, pico.chip.lit) == ("late" if steps != 1 else "none", set())


@pytest.mark.parametrize("longest_ms", [2, 8, 60, 400])
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.campaign
def test_the_groups_stay_in_step_or_it_is_dark_wherever_the_program_is_held_up(seed: int, longest_ms: int) -> None:
    dice = random.Random(seed)
    pico = Pico()
    for line in [*uploaded([SHORT, UNLIKE], [0, 1, 1]), "RUN 0"]:
        assert pico.feed(f"{line}\n".encode(), 0).startswith(b"OK")
    slowed(pico, dice, longest_ms * MS)
    taken = 0
    while pico.controller.state == "running" and pico.chip.cycle < 400 * MS:
        now = pico.chip.cycle + dice.randint(1, 3 * MS)
        taken += pico.feed("TRIM {} {}\n".format(*trim(dice)).encode(), now).startswith(b"OK")
    wrong, fault = apart(pico), pico.controller.fault
    assert fault in ("none", "late")
    assert longest_ms > 8 or (fault == "none" and taken > 5), "memory is collected in some milliseconds"
    assert not wrong or fault == "late"
    assert min(after - before for before, after in pairwise(rises(pico, 0))) >= SHORT.duration + 25_000
    if wrong:
        assert pico.chip.edges[-1][0] - wrong[0] < 2 * longest_ms * MS
