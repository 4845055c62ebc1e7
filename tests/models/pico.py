"""The Pico's program on the model of its chip, and cycles to play on it."""

import random
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from rp2040 import Chip, board_of, load_program

from psvideo.strobe.limits import cycle_check
from psvideo.strobe.link.boards import BOARDS
from psvideo.strobe.link.protocol import format_request
from psvideo.strobe.link.requests import Arm, Lit, Slot, Steps
from psvideo.strobe.stand_ins.playing import Edge

MAIN = Path(__file__).resolve().parents[2] / "lights" / "pico" / "main.py"
MS = 125_000
"""Ticks in a millisecond."""
US = 125
PROGRAM = load_program(MAIN)


FLASH = Slot(slot=0, duration=100_000, dark=1_000_000, period=100_000, lit=(Lit(line=2, on=100_000),))
LOADED = b"SLOT 0 100000 1000000 100000 2:100000\nSTEPS 0 0 0\n"
ARM = f"ARM {cycle_check([FLASH, FLASH])}\n".encode()


class Pico:
    """The program on a chip, under the same handle as PythonBoard."""

    def __init__(self, reset: str = "power") -> None:
        self.board = BOARDS["rp2040"]
        self.chip = Chip()
        self.controller = PROGRAM.Controller(board_of(PROGRAM, self.chip), "emulated", reset)

    def advance(self, now: int) -> None:
        """Let time pass, polling when something is due and at least every 20 ms."""
        while self.chip.cycle < now:
            self.chip.advance(min(now, *self._due()))
            self.controller.poll()

    def _due(self) -> Iterator[int]:
        control, at = self.controller, self.chip.cycle
        due = [at + 20 * MS, control.heard + control.keep_ms * MS]
        if control.state == "running":
            due.append(control.start + control.cycles * control.cycle_ticks)
        return (tick for tick in due if tick > at)

    def feed(self, data: bytes, now: int) -> bytes:
        """Let bytes arrive."""
        self.advance(now)
        answer: bytes = self.controller.feed(data)
        return answer

    def take_edges(self) -> list[Edge]:
        """Return the edges since this was last called, and forget them."""
        taken = self.edges
        self.chip.edges.clear()
        return taken

    @property
    def edges(self) -> list[Edge]:
        """All edges so far."""
        return [Edge(tick=tick, line=line, level=level) for tick, line, level in sorted(self.chip.edges)]


def random_slot(dice: random.Random, place: int) -> Slot:
    """Return a flash that the board plays, full power or bursts, with edges a tick apart now and then."""
    if dice.random() < 0.15:
        return Slot(slot=place, duration=dice.randint(1, 5000), dark=12_500 + dice.randint(0, 900), period=1)
    period = dice.choice([250, 251, 300, dice.randint(250, 2000)])
    rest = dice.choice([0, 125, dice.randint(125, period - 1)])
    base = dice.randint(125, period - 125)
    near = [base, base, min(base + dice.randint(0, 12), period - 125), dice.randint(125, period - 125), period]
    lit = tuple(Lit(line=line, on=dice.choice(near)) for line in sorted(dice.sample(range(8), dice.randint(1, 8))))
    duration = period * dice.randint(1, 9) + rest
    return Slot(
        slot=place, duration=duration, dark=12_500 + dice.randint(0, 20_000) + 9 * duration, period=period, lit=lit
    )


def upload(dice: random.Random, *, darker: int = 0) -> list[str]:
    """Return requests that upload and arm some cycle, whose dark times are longer by some ticks."""
    slots = [random_slot(dice, place) for place in range(dice.randint(1, 6))]
    slots = [replace(slot, dark=slot.dark + darker) for slot in slots]
    steps = [dice.randrange(len(slots)) for _ in range(dice.randint(1, 12))]
    requests = [*slots, Steps(first=0, slots=tuple(steps)), Arm(check=cycle_check([slots[step] for step in steps]))]
    return [format_request(request, sealed=False).decode().strip() for request in requests]


def in_order(edges: list[Edge]) -> list[Edge]:
    """Return edges by time and line; edges of a line that are in the same tick stay as they are."""
    return sorted(edges, key=lambda edge: (edge.tick, edge.line))


def same_answer(pico: bytes, python: bytes) -> bool:
    """Compare replies, of refusals the code only."""
    if python.startswith(b"E "):
        return pico.split()[:2] == python.split()[:2]
    return pico == python.replace(b"python-1", b"pico-1.1")
