"""The transfer curves against their makers' published points, and the way from codes to light."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from psvideo.clip.decoded import CodedPicture, Header
from psvideo.clip.linear import linear_light
from psvideo.clip.tagged_curve import disagreement
from psvideo.clip.transfer import CURVES, TransferCurve, find_curve, to_light
from psvideo.errors import PsvideoError
from psvideo.model.camera import Encoding

# Signal (share of the largest code) and linear light, as each curve's maker publishes them.
PUBLISHED = [
    ("linear", 0.3, 0.3),
    ("srgb", 0.04045, 0.04045 / 12.92),  # IEC 61966-2-1: where its two parts meet
    ("srgb", 0.5, 0.2140411),
    ("rec709", 0.081, 0.018),  # BT.709-6: where its two parts meet
    ("rec709", 1.099 * 0.18**0.45 - 0.099, 0.18),
    ("gamma24", 0.5, 0.5**2.4),  # BT.1886, black 0
    ("gamma22", 0.5, 0.5**2.2),
    ("slog3", 95 / 1023, 0.0),  # Sony, Technical Summary for S-Gamut3.Cine/S-Log3: 10-bit codes 95, 420, 598
    ("slog3", 420 / 1023, 0.18),
    ("slog3", 598 / 1023, 0.90),
    ("logc3", 0.391007, 0.18),  # ARRI, ALEXA Log C Curve, EI 800
    ("logc3", 0.0928, 0.0),
    ("logc4", 0.2783958, 0.18),  # ARRI, LogC4 Logarithmic Color Space Specification
    ("vlog", 128 / 1023, 0.0),  # Panasonic, V-Log/V-Gamut Reference Manual: 10-bit codes 128, 433, 602
    ("vlog", 433 / 1023, 0.18),
    ("vlog", 602 / 1023, 0.90),
    ("clog2", 0.092864125, 0.0),  # Canon, Canon Log Gamma Curves
    ("clog3", 0.12512219, 0.0),
    ("clog3", 351 / 1023, 0.18),
    ("log3g10", 0.091551, 0.0),  # RED, REDWideGamutRGB and Log3G10
    ("log3g10", 1 / 3, 0.18),
    ("bmdfilm5", 0.3835616, 0.18),  # Blackmagic Design, Generation 5 Color Science
    ("davinci", 0.336043, 0.18),  # Blackmagic Design, DaVinci Wide Gamut Intermediate
    ("davinci", 0.513837, 1.0),
    ("applelog", 0.488272, 0.18),  # Apple Log Profile White Paper
    ("acescct", 0.4135884, 0.18),  # AMPAS S-2016-001
    ("st2084", 0.508078, 1.0),  # SMPTE ST 2084: 100 nits, which OpenColorIO calls 1
]


@pytest.mark.parametrize(("name", "signal", "light"), PUBLISHED)
def test_curve_goes_through_its_published_points(name: str, signal: float, light: float) -> None:
    assert to_light(find_curve(name), np.array([signal]))[0] == pytest.approx(light, rel=5e-3, abs=5e-5)


@pytest.mark.parametrize("curve", CURVES, ids=lambda curve: curve.name)
def test_every_curve_rises_from_black_to_white_without_a_step(curve: TransferCurve) -> None:
    light = to_light(curve, np.linspace(0, 1, 4096))
    assert np.all(np.diff(light.astype(np.float64)) >= -1e-7)
    assert light[-1] > light[0]
    assert np.max(np.diff(light)) < 0.02 * (light[-1] - light[0])


@pytest.mark.parametrize(
    ("spelling", "name"),
    [("S-Log3", "slog3"), ("sRGB - Curve", "srgb"), ("ARRI LogC3 (EI800)", "logc3"), ("Rec.709", "rec709")],
)
def test_curve_names_are_read_as_people_and_opencolorio_write_them(spelling: str, name: str) -> None:
    assert find_curve(spelling).name == name


def test_unknown_curve_names_the_nearest_and_all_others() -> None:
    with pytest.raises(PsvideoError, match=r"'slogg3'.*did you mean 'slog3'.*logc4"):
        find_curve("slogg3")


def test_colour_is_named_only_where_the_curve_shows_the_gamut() -> None:
    assert find_curve("srgb").colour == "lin_rec709_scene"
    assert find_curve("S-Log3 S-Gamut3.Cine").colour == "ocio:lin_sgamut3cine_scene"
    assert find_curve("slog3").colour == "unknown"


def picture(codes: list[int] | np.ndarray, *, bits: int = 16, **header: Any) -> CodedPicture:
    values = np.array([codes], np.uint8 if bits == 8 else np.uint16)
    return CodedPicture(
        header=Header(width_px=values.shape[1], height_px=1, channels=1, bits=bits, **header), codes=values
    )


@given(black=st.integers(0, 5000), white=st.integers(6000, 65535), code=st.integers(0, 65535))
def test_linear_codes_are_scaled_between_the_plans_levels(black: int, white: int, code: int) -> None:
    light = linear_light(picture([code]), Encoding(black_level=black, white_level=white))
    assert light.dtype == np.float32
    assert light[0, 0] == pytest.approx((code - black) / (white - black), rel=1e-6)


@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_levels_left_out_are_code_0_and_the_largest_code(bits: int) -> None:
    largest = 2**bits - 1
    light = linear_light(picture([0, largest // 2, largest], bits=bits), Encoding())
    assert light[0].tolist() == pytest.approx([0.0, (largest // 2) / largest, 1.0])


def test_light_under_a_log_curve_is_counted_from_black_to_white_after_the_curve() -> None:
    light = linear_light(picture([95, 420, 598], bits=10), Encoding(transfer="slog3", black_level=95, white_level=598))
    assert light[0].tolist() == pytest.approx([0.0, 0.18 / 0.9008, 1.0], abs=1e-4)
    left_out = linear_light(picture([95, 420, 1023], bits=10), Encoding(transfer="slog3"))
    assert left_out[0].tolist() == pytest.approx([0.0, 0.18 / 38.421, 1.0], abs=1e-5)


def test_levels_that_the_curve_turns_round_are_refused() -> None:
    with pytest.raises(PsvideoError, match="white_level 20 is not brighter than black_level 0 under the curve 'logc3'"):
        linear_light(picture([0], bits=8), Encoding(transfer="logc3", white_level=20))


@pytest.mark.parametrize(("curve", "bits", "white"), [("srgb", 10, 1023), ("slog3", 10, 940), ("logc3", 12, 3700)])
def test_codes_of_fewer_bits_in_a_file_of_16_are_those_of_the_curve(curve: str, bits: int, white: int) -> None:
    codes = np.linspace(0.1 * white, white, 7).astype(int)
    held = linear_light(picture(codes, bits=16), Encoding(transfer=curve, black_level=4, white_level=white))
    plain = linear_light(picture(codes, bits=bits), Encoding(transfer=curve, black_level=4, white_level=white))
    assert np.array_equal(held, plain)


def test_black_levels_by_position_are_taken_off_by_position() -> None:
    codes = np.full((4, 6), 1000, np.uint16)
    head = Header(width_px=6, height_px=4, channels=1, bits=14, black=((100.0, 200.0), (300.0, 400.0)), white=1400.0)
    light = linear_light(CodedPicture(header=head, codes=codes), Encoding())
    expected = [[900 / 1300, 800 / 1200], [700 / 1100, 600 / 1000]]
    assert np.allclose(light, np.tile(expected, (2, 3)))
    assert np.allclose(linear_light(CodedPicture(header=head, codes=codes), Encoding(black_level=0)), 1000 / 1400)


def test_floating_point_stays_as_it_is_unless_the_plan_gives_levels() -> None:
    codes = np.array([[-0.01, 0.5, 3.0]], np.float32)
    floats = CodedPicture(header=Header(width_px=3, height_px=1, channels=1, bits=None), codes=codes)
    assert np.array_equal(linear_light(floats, Encoding()), codes)
    assert linear_light(floats, Encoding(black_level=0.5, white_level=3.0))[0].tolist() == pytest.approx([-0.204, 0, 1])


def test_video_range_is_not_expanded_for_curves_that_are_defined_on_recorded_codes() -> None:
    zero, one = 64, 940
    scale = {"signal_at_0": -zero / (one - zero), "signal_per_code": 1 / (one - zero), "video_range": True}
    grey = picture([420], bits=10, **scale)
    assert linear_light(grey, Encoding(transfer="slog3", white_level=598))[0, 0] == pytest.approx(
        0.18 / 0.9008, abs=1e-4
    )
    assert linear_light(picture([64, 502, 940], bits=10, **scale), Encoding())[0].tolist() == pytest.approx([0, 0.5, 1])


@pytest.mark.parametrize(
    ("plan", "tag", "kind", "words"),
    [
        ("srgb", None, "jpeg", None),
        ("linear", None, "jpeg", "do not hold linear light"),
        ("linear", None, "png", None),
        ("hlg", None, "png", None),
        ("rec709", "rec709", "movie", None),
        ("srgb", "rec709", "movie", "tagged with the transfer 'rec709'"),
        ("slog3", "rec709", "movie", None),
        ("slog3", "hlg", "movie", "write transfer = 'hlg'"),
        ("hlg", "hlg", "movie", None),
        ("linear", "st2084", "movie", "tagged with the transfer 'st2084'"),
    ],
)
def test_a_plan_is_held_against_the_files_own_word(plan: str, tag: str | None, kind: str, words: str | None) -> None:
    said = disagreement(plan, tagged=tag, kind=kind)
    assert (said is None) == (words is None)
    assert words is None or words in (said or "")
