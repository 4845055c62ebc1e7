"""The boards that are known, as lights/protocol.toml lists them, and what they can play in ticks."""

from collections.abc import Mapping
from dataclasses import dataclass

from psvideo.errors import UsageError, nearest
from psvideo.strobe.link.replies import Capabilities
from psvideo.strobe.link.words import WiringName

MAX_FLASH_US = 50_000
MIN_DARK_US = 100
MAX_LINE_PPM = 500_000
MAX_TOTAL_PPM = 2_000_000
MAX_TRIM_PPM = 20_000
KEEP_MS = (100, 2000)
KEEP_AFTER_RESET_MS = 1000
"""Limits that every controller enforces."""
FIRMWARE_WITHOUT_TRIMS = ("pico-1.0",)
"""What boards answer to ID whose program refuses every trim: the Pico's before it took them."""


@dataclass(frozen=True, kw_only=True)
class Board:
    """One kind of board: its tick, what it holds, and for each wiring how many lines and how many powers a flash.

    ``trim_lead_ms``: a trim counts this long after it was asked for, or later.
    """

    name: str
    tick_ps: int
    lines: Mapping[WiringName, int]
    powers: Mapping[WiringName, int]
    slots: int
    steps: int
    min_on_us: int
    min_off_us: int
    tolerance_ppm: int
    trim_lead_ms: int

    @property
    def first_wiring(self) -> WiringName:
        """The wiring after a reset: gated where the board has it."""
        return "gated" if "gated" in self.lines else "direct"

    def ticks_at_least(self, time_us: int) -> int:
        """Return a time in ticks, rounded up."""
        return -(-time_us * 1_000_000 // self.tick_ps)

    def ticks_at_most(self, time_us: int) -> int:
        """Return a time in ticks, rounded down."""
        return time_us * 1_000_000 // self.tick_ps


BOARDS: Mapping[str, Board] = {
    board.name: board
    for board in (
        Board(
            name="atmega328p",
            tick_ps=500_000,
            lines={"gated": 8, "direct": 2},
            powers={"gated": 1, "direct": 2},
            slots=16,
            steps=240,
            min_on_us=20,
            min_off_us=20,
            tolerance_ppm=5000,
            trim_lead_ms=0,
        ),
        Board(
            name="atmega2560",
            tick_ps=500_000,
            lines={"gated": 8, "direct": 3},
            powers={"gated": 1, "direct": 3},
            slots=32,
            steps=240,
            min_on_us=20,
            min_off_us=20,
            tolerance_ppm=5000,
            trim_lead_ms=0,
        ),
        Board(
            name="rp2040",
            tick_ps=8000,
            lines={"direct": 8},
            powers={"direct": 8},
            slots=32,
            steps=240,
            min_on_us=1,
            min_off_us=1,
            tolerance_ppm=100,
            trim_lead_ms=20,
        ),
    )
}


def board_called(name: str | None) -> Board | None:
    """Return the board of the table by its name; None for None. Raises UsageError where there is none of that name."""
    if name is None or name in BOARDS:
        return None if name is None else BOARDS[name]
    usual = "An Uno or Nano has an atmega328p, a Mega an atmega2560, a Pico an rp2040."
    raise UsageError(f"`board` {name}: {nearest(name, BOARDS)} {usual}")


def capabilities(board: Board, wiring: WiringName, *, keep_ms: int = KEEP_AFTER_RESET_MS) -> Capabilities:
    """Return what a board answers to CAPS with a wiring that it has; limits are rounded to the safe side."""
    return Capabilities(
        tick_ps=board.tick_ps,
        wiring=wiring,
        lines=board.lines[wiring],
        powers=board.powers[wiring],
        slots=board.slots,
        steps=board.steps,
        min_on=board.ticks_at_least(board.min_on_us),
        min_off=board.ticks_at_least(board.min_off_us),
        min_dark=board.ticks_at_least(MIN_DARK_US),
        max_flash=board.ticks_at_most(MAX_FLASH_US),
        max_period=board.ticks_at_most(MAX_FLASH_US),
        max_line_ppm=MAX_LINE_PPM,
        max_total_ppm=MAX_TOTAL_PPM,
        tolerance_ppm=board.tolerance_ppm,
        keep_ms=keep_ms,
    )
