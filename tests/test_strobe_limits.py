"""Every limit that keeps lights and people safe: what just keeps it is played, and a tick more is refused."""

from dataclasses import replace

import pytest

from psvideo.strobe.limits import cycle_refusal, slot_refusal, trim_refusal
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.requests import Lit, Slot

UNO = capabilities(BOARDS["atmega328p"], "gated")
MINUTE = 120_000_000
"""In ticks of half a microsecond."""


def flash(on: int, dark: int, *lines: int) -> Slot:
    """A flash of some lines for so many ticks."""
    lit = tuple(Lit(line=line, on=on) for line in lines or (0,))
    return Slot(slot=0, duration=on, dark=dark, period=on, lit=lit)


BURST = Slot(slot=0, duration=400, dark=400, period=200, lit=(Lit(line=0, on=160),))


@pytest.mark.parametrize(
    ("good", "bad", "words"),
    [
        (flash(UNO.max_flash, 200_000), flash(UNO.max_flash + 1, 200_000), "duration 100001 > max_flash"),
        (flash(UNO.min_on, 1000), flash(UNO.min_on - 1, 1000), "on 39 < min_on"),
        (flash(100, UNO.min_dark), flash(100, UNO.min_dark - 1), "dark 199 < min_dark"),
        (BURST, replace(BURST, lit=(Lit(line=0, on=161),)), "off 39 < min_off"),
        (replace(BURST, duration=440), replace(BURST, duration=439), "on 39 < min_on"),
        (BURST, replace(BURST, lit=(*BURST.lit, Lit(line=1, on=100))), "powers 2"),
        (replace(BURST, slot=15), replace(BURST, slot=16), "slot 16"),
    ],
)
def test_a_flash_is_refused_from_one_tick_beyond_its_limit_on(good: Slot, bad: Slot, words: str) -> None:
    assert slot_refusal(good, UNO) is None
    refused = slot_refusal(bad, UNO)
    assert refused is not None
    assert words in refused.text


@pytest.mark.parametrize(
    ("good", "bad", "words"),
    [
        ([flash(1000, 1000)], [flash(1001, 999)], "line 0 on for 500500 ppm"),
        ([flash(600, 1000), flash(400, 0)], [flash(600, 1000), flash(401, 0)], "line 0 on for 500249 ppm"),
        ([flash(1000, 1000, 0, 1, 2, 3)], [flash(1000, 1000, 0, 1, 2, 3, 4)], "total 2500000 ppm"),
        ([flash(40, MINUTE - 40)], [flash(40, MINUTE - 39)], "cycle 120000001 > 120000000"),
    ],
)
def test_a_cycle_is_refused_where_lines_are_on_for_too_long_or_it_is_too_long(
    good: list[Slot], bad: list[Slot], words: str
) -> None:
    assert cycle_refusal(good, UNO) is None
    refused = cycle_refusal(bad, UNO)
    assert refused is not None
    assert words in refused.text


@pytest.mark.parametrize(
    ("steps", "good_ppm", "bad_ppm", "words"),
    [
        ([flash(9600, 10_400)], -39_900, -40_000, "line 0 on for"),
        ([flash(100, 500)], -166_666, -170_000, "dark < 2 min_dark 400"),
        ([flash(100, 2000), flash(100, 500)], -74_000, -75_000, "dark < 2 min_dark 400"),
        ([flash(40, MINUTE - 1040)], 8, 9, "cycle"),
    ],
)
def test_a_trim_is_refused_where_the_trimmed_cycle_would_be(
    steps: list[Slot], good_ppm: int, bad_ppm: int, words: str
) -> None:
    assert cycle_refusal(steps, UNO) is None
    assert trim_refusal(steps, UNO, good_ppm) is None
    refused = trim_refusal(steps, UNO, bad_ppm)
    assert refused is not None
    assert words in refused.text
