"""What distinguishes the flashes of a cycle by time alone, on paper."""

from fractions import Fraction

import pytest

from psvideo.model.camera import Camera, Encoding
from psvideo.model.marker import SlotKind, alike_turns, has_marker, slot_kinds, turned_slot
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.timing import Flash

CAMERA = Camera(
    name="paper",
    width_px=16,
    height_px=8,
    fps=Fraction(100),
    exposure_s=0.01,
    readout_s=0.008,
    encoding=Encoding(transfer="linear"),
)


def plan_of(flashes: str, dark_every: int = 1) -> Plan:
    """Letters are lights, capitals flash twice as long, a dash is a dark slot, a figure a light at a tenth each."""
    listed = []
    for sign in flashes:
        power = int(sign) / 10 if sign.isdigit() else 1.0
        lights = {} if sign == "-" else {"dimmed" if sign.isdigit() else sign.lower(): power}
        listed.append(PlannedFlash(lights=lights, duration_s=2e-3 if sign.isupper() else 1e-3))
    return Plan(camera=CAMERA, flashes=tuple(listed), dark_s=0.01, dark_every=dark_every)


@pytest.mark.parametrize(
    ("flashes", "dark_every", "turns"),
    [
        pytest.param("abc", 1, (0, 1, 2), id="all alike"),
        pytest.param("a", 1, (0,), id="one light alone"),
        pytest.param("abc-", 1, (0,), id="a dark slot"),
        pytest.param("a-b-", 1, (0, 2), id="a dark slot behind every light"),
        pytest.param("abc0", 1, (0,), id="a light at power 0 is a dark slot"),
        pytest.param("aB", 1, (0,), id="a long flash"),
        pytest.param("abAB", 1, (0,), id="two long flashes on end"),
        pytest.param("aBcB", 1, (0, 2), id="long flashes in every other place"),
        pytest.param("abc-", 5, (0,), id="a dark slot in one round of five"),
        pytest.param("a-b-", 2, (0,), id="rounds that skip their dark slots mark the cycle"),
        pytest.param("ab", 2, (0, 1, 2, 3), id="rounds without a dark slot repeat"),
        pytest.param("aB", 3, (0, 2, 4), id="rounds that repeat, each with a long flash"),
        pytest.param("1357", 1, (0, 1, 2, 3), id="powers alone change nothing in when light comes"),
    ],
)
def test_the_cycle_can_be_turned_where_timing_sees_no_difference(
    flashes: str, dark_every: int, turns: tuple[int, ...]
) -> None:
    plan = plan_of(flashes, dark_every)
    assert alike_turns(plan) == turns
    assert has_marker(plan) is (turns == (0,))


def test_timing_sees_how_long_a_flash_is_and_whether_it_is_dark() -> None:
    lit, long, dark = (SlotKind(duration_s=s, is_dark=d) for s, d in ((1e-3, False), (2e-3, False), (1e-3, True)))
    assert slot_kinds(plan_of("aB-", 2)) == (lit, long, dark, lit, long)


def test_a_turn_goes_round_the_cycle_either_way() -> None:
    plan = plan_of("abc-")
    assert [turned_slot(plan, slot, 1) for slot in range(4)] == [1, 2, 3, 0]
    assert [turned_slot(plan, slot, -1) for slot in range(4)] == [3, 0, 1, 2]
    assert all(
        turned_slot(plan, turned_slot(plan, slot, turn), -turn) == slot for slot in range(4) for turn in range(9)
    )


@pytest.mark.parametrize(
    ("lights", "lit"),
    [
        ({}, ()),
        ({"key": 0.0}, ()),
        ({"key": 1.0}, ("key",)),
        ({"left": 0.5, "key": 0.0, "right": 0.25}, ("left", "right")),
    ],
)
def test_a_flash_is_dark_where_no_light_has_power(lights: dict[str, float], lit: tuple[str, ...]) -> None:
    planned = PlannedFlash(lights=lights, duration_s=1e-3)
    timed = Flash(index=0, slot=0, lights=lights, start_s=0.0, duration_s=1e-3, complete=True)
    assert (planned.lit, planned.is_dark) == (lit, not lit)
    assert (timed.lit, timed.is_dark) == (lit, not lit)
