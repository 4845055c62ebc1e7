"""Times, speeds and lists mean what people mean by them, and nonsense is refused with advice."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from psvideo.cli.options.per_light import parse_lights, parse_per_light, parse_powers
from psvideo.cli.options.typed import (
    parse_fraction,
    parse_metres,
    parse_rate,
    parse_seconds,
    parse_size_px,
    parse_speed_px_s,
)
from psvideo.errors import UsageError
from psvideo.model.units import show_seconds


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("0.8ms", 8e-4),
        ("800us", 8e-4),
        ("800 µs", 8e-4),
        ("800μs", 8e-4),
        ("1/1250s", 8e-4),
        ("8e-4 s", 8e-4),
        (".8MS", 8e-4),
        ("-8.1ms", -8.1e-3),
        ("0", 0.0),
    ],
)
def test_a_time_is_read_with_its_unit(text: str, seconds: float) -> None:
    assert parse_seconds(text, option="--flash") == pytest.approx(seconds, rel=1e-14)


@pytest.mark.parametrize("text", ["0.8", "", "fast", "8 fortnights", "ms", "1/0s", "1,5ms", "0.8 ms ms", "nan", "infs"])
def test_what_is_no_time_is_refused_by_option_and_value(text: str) -> None:
    with pytest.raises(UsageError, match="--flash") as refusal:
        parse_seconds(text, option="--flash")
    assert repr(text) in str(refusal.value)
    assert "0.8ms" in str(refusal.value)


@given(st.floats(1e-6, 10))
def test_a_time_that_is_shown_can_be_typed_again(seconds: float) -> None:
    assert parse_seconds(show_seconds(seconds), option="--flash") == pytest.approx(seconds, rel=6e-4)


@pytest.mark.parametrize(
    ("text", "rate"),
    [
        ("120", Fraction(120)),
        ("119.88", Fraction(120_000, 1001)),
        ("59.94", Fraction(60_000, 1001)),
        ("29.97", Fraction(30_000, 1001)),
        ("23.976", Fraction(24_000, 1001)),
        ("23.98", Fraction(24_000, 1001)),
        ("120000/1001", Fraction(120_000, 1001)),
        ("100.5", Fraction(201, 2)),
    ],
)
def test_roundings_of_broadcast_rates_become_the_exact_ratio_and_others_stay(text: str, rate: Fraction) -> None:
    assert parse_rate(text) == rate


@pytest.mark.parametrize("text", ["0", "-24", "fast", "1/0", ""])
def test_what_is_no_frame_rate_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="--fps"):
        parse_rate(text)


def test_a_speed_in_metres_needs_the_width_of_the_field() -> None:
    assert parse_speed_px_s("800", field_width_m=None, width_px=None) == 800
    assert parse_speed_px_s("0.5m/s", field_width_m=0.6, width_px=1920) == pytest.approx(1600)
    with pytest.raises(UsageError, match="--field-width"):
        parse_speed_px_s("0.5m/s", field_width_m=None, width_px=1920)
    with pytest.raises(UsageError, match="--speed"):
        parse_speed_px_s("-3", field_width_m=None, width_px=None)
    assert parse_metres("60cm", option="--field-width") == pytest.approx(0.6)


@pytest.mark.parametrize("text", ["1920", "0x1080", "1920x", "x", "-1x5", "1920x1080x3"])
def test_what_is_no_size_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="--size"):
        parse_size_px(text)


def test_shares_are_numbers_or_percentages_up_to_one() -> None:
    assert parse_fraction("10%", option="--max-duty") == parse_fraction("0.1", option="--max-duty") == 0.1
    for text in ("0", "1.5", "120%", "-0.1", "much"):
        with pytest.raises(UsageError, match="--max-duty"):
            parse_fraction(text, option="--max-duty")


@pytest.mark.parametrize("text", ["", "key,,left", "key,key", "key,le ft", "../x", "ambient", "a/b"])
def test_lights_need_names_of_their_own_that_can_name_a_folder(text: str) -> None:
    with pytest.raises(UsageError, match="--lights"):
        parse_lights(text)


def test_values_for_each_light_must_name_every_light_once() -> None:
    lights = ("key", "left")
    assert parse_per_light("1ms", lights, option="--flash") == {"key": "1ms", "left": "1ms"}
    assert parse_per_light("left=2ms, key=1ms", lights, option="--flash") == {"left": "2ms", "key": "1ms"}
    for text, named in [
        ("key=1ms", "left"),
        ("key=1ms,lef=1ms", "'left'"),
        ("key=1,key=2", "twice"),
        ("key=,left=1", "key"),
    ]:
        with pytest.raises(UsageError, match=named):
            parse_per_light(text, lights, option="--flash")
    with pytest.raises(UsageError, match="--power"):
        parse_powers("key=0,left=1", lights)
