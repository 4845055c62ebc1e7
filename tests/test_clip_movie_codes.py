"""What a movie's codes mean: matrix and range, depth, chroma, channels and curve."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from written_movies import grey_ramp, in_10_bits, make_frame, write_movie

from psvideo.clip import open_clip, read_frames
from psvideo.clip.decode.movies import ffmpeg_planes, movie, yuv
from psvideo.clip.decode.movies.movie_tags import compression_warning
from psvideo.clip.decode.movies.yuv import CODES, HIGHEST, LOWEST, to_rgb
from psvideo.export.preview_movie import write_movie as write_preview

BT709, BT601, BT2020 = (0.2126, 0.0722), (0.299, 0.114), (0.2627, 0.0593)
MATRIX_TAGS = {BT709: 1, BT601: 6, BT2020: 9}


def codes_of(rgb: NDArray[np.float64], weights: tuple[float, float], bits: int, video: bool) -> NDArray[np.float64]:
    """Return Y', Cb, Cr codes of R'G'B' signals, from the definitions in BT.709, sections 3 and 4."""
    red, green, blue = np.moveaxis(np.asarray(rgb, np.float64), -1, 0)
    luma = weights[0] * red + (1 - sum(weights)) * green + weights[1] * blue
    difference = [(blue - luma) / (2 - 2 * weights[1]), (red - luma) / (2 - 2 * weights[0])]
    scale = 2.0 ** (bits - 8)
    if video:
        return np.stack([(219 * luma + 16) * scale, *((224 * part + 128) * scale for part in difference)], axis=-1)
    largest = 2.0**bits - 1
    return np.stack([luma * largest, *(part * largest + 2.0 ** (bits - 1) for part in difference)], axis=-1)


@pytest.mark.parametrize("weights", [BT709, BT601, BT2020], ids=["709", "601", "2020"])
@pytest.mark.parametrize("video", [True, False])
@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_matrix_and_range_invert_the_standards_definitions(
    weights: tuple[float, float], video: bool, bits: int
) -> None:
    rgb = np.random.default_rng(1).uniform(0, 1, (20, 30, 3))
    dtype = np.uint8 if bits == 8 else np.uint16
    luma, blue, red = np.moveaxis(np.rint(codes_of(rgb, weights, bits, video)), -1, 0).astype(dtype)
    codes = to_rgb(luma, blue, red, bits=bits, matrix=MATRIX_TAGS[weights], video_range=video)
    signal = LOWEST + codes.astype(np.float64) * (HIGHEST - LOWEST) / CODES
    assert np.abs(signal - rgb).max() < 2.5 / 2**bits + 2e-5


def test_noise_below_black_and_highlights_above_white_are_kept() -> None:
    luma = np.array([[4, 16, 235, 254]], np.uint8)
    chroma = np.full((1, 4), 128, np.uint8)
    codes = to_rgb(luma, chroma, chroma, bits=8, matrix=1, video_range=True)[..., 1]
    signal = LOWEST + codes[0] * (HIGHEST - LOWEST) / CODES
    assert signal.tolist() == pytest.approx([-12 / 219, 0, 1, 238 / 219], abs=3e-5)


@pytest.mark.parametrize("halved", [(1, 1), (1, 2), (2, 2)], ids=["4:4:4", "4:2:2", "4:2:0"])
def test_rows_are_converted_alike_however_many_at_a_time(
    halved: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Chroma is interpolated across the bands' edges. OpenCV may round half a code of 65,535 either way at the end of
    what it is given."""
    rows, cols = 37, 23
    sizes = [(rows, cols), *[(-(-rows // halved[0]), -(-cols // halved[1]))] * 2]
    planes = [np.random.default_rng(1).integers(0, 1024, size).astype(np.uint16) for size in sizes]
    found = []
    for band_rows in (2, 8, 64):
        monkeypatch.setattr(yuv, "BAND_ROWS", band_rows)
        found.append(to_rgb(*planes, bits=10, matrix=1, video_range=True))
    assert np.abs(np.diff(np.stack(found).astype(int), axis=0)).max() <= 1


def test_chroma_is_interpolated_where_it_stands() -> None:
    """A colour difference that grows evenly over the picture does so after interpolation, to the inner pixels."""
    rows, cols = 16, 24
    luma = np.full((rows, cols), 500, np.uint16)
    ramp = 400 + 4 * np.arange(cols)[None, :] + 6 * np.arange(rows)[:, None]
    flat = np.full((rows // 2, cols // 2), 512, np.uint16)
    halved = ramp[:, ::2].reshape(rows // 2, 2, cols // 2).mean(axis=1).astype(np.uint16)
    subsampled = to_rgb(luma, halved, flat, bits=10, matrix=1, video_range=False)
    full = to_rgb(
        luma, ramp.astype(np.uint16), np.full((rows, cols), 512, np.uint16), bits=10, matrix=1, video_range=False
    )
    difference = np.abs(subsampled.astype(int) - full)[1:-1, :-1]
    assert difference.max() <= 3


@pytest.mark.parametrize(
    ("pix_fmt", "bits", "down", "across"),
    [
        ("yuv444p", 8, 1, 1),
        ("yuv420p10le", 10, 2, 2),
        ("yuv422p10le", 10, 1, 2),
        ("yuv444p12le", 12, 1, 1),
        ("yuv444p16le", 16, 1, 1),
    ],
)
def test_yuv_movies_keep_their_depth(
    tmp_path: Path, written_plan: Callable[..., Path], pix_fmt: str, bits: int, down: int, across: int
) -> None:
    """One saturated colour, coded by the standard's arithmetic, comes back to the precision of its depth."""
    colour = np.array([0.7, 0.3, 0.15])
    y, cb, cr = np.rint(codes_of(colour, BT709, bits, True)).astype(np.uint8 if bits == 8 else np.uint16)
    chroma_size = (32 // down, 48 // across)
    write_movie(
        tmp_path / "x.mkv",
        [make_frame([np.full((32, 48), y), np.full(chroma_size, cb), np.full(chroma_size, cr)], pix_fmt)] * 2,
        matrix=1,
        color_range=1,
    )
    clip = open_clip(tmp_path / "x.mkv", plan=written_plan(rows=32, cols=48))
    frame = next(iter(read_frames(clip)))
    assert ["8 bits leave few steps" in warning for warning in clip.warnings] == [True] * (bits == 8)
    assert np.abs(frame.image - colour).max() < 1.5 / 2**bits + 3e-5


@pytest.mark.parametrize(("pix_fmt", "bits"), [("gray", 8), ("gray10le", 10), ("gray12le", 12), ("gray16le", 16)])
def test_grey_movies_come_out_with_every_bit(
    tmp_path: Path, written_plan: Callable[..., Path], pix_fmt: str, bits: int
) -> None:
    codes = np.random.default_rng(2).integers(0, 2**bits, (32, 48)).astype(np.uint8 if bits == 8 else np.uint16)
    write_movie(tmp_path / "x.mkv", [make_frame([codes], pix_fmt)])
    clip = open_clip(tmp_path / "x.mkv", plan=written_plan(rows=32, cols=48))
    (frame,) = read_frames(clip)
    assert np.array_equal(np.rint(frame.image * (2**bits - 1)), codes)


@pytest.mark.parametrize(("pix_fmt", "bits"), [("gbrp10le", 10), ("gbrp12le", 12), ("gbrp16le", 16)])
def test_rgb_movies_come_out_with_every_bit_in_the_right_channel(
    tmp_path: Path, written_plan: Callable[..., Path], pix_fmt: str, bits: int
) -> None:
    codes = np.random.default_rng(2).integers(0, 2**bits, (32, 48, 3)).astype(np.uint8 if bits == 8 else np.uint16)
    write_movie(tmp_path / "x.mkv", [make_frame([codes[..., 1], codes[..., 2], codes[..., 0]], pix_fmt)])
    clip = open_clip(tmp_path / "x.mkv", plan=written_plan(rows=32, cols=48))
    (frame,) = read_frames(clip)
    assert np.array_equal(np.rint(frame.image * (2**bits - 1)), codes)


def test_untagged_matrix_is_guessed_from_the_height_and_said(tmp_path: Path, written_plan: Callable[..., Path]) -> None:
    colour = np.array([0.7, 0.3, 0.15])
    for rows, weights, name in ((32, BT601, "BT.601"), (720, BT709, "BT.709")):
        y, cb, cr = np.rint(codes_of(colour, weights, 8, True)).astype(np.uint8)
        write_movie(tmp_path / "x.mkv", [make_frame([np.full((rows, 48), c) for c in (y, cb, cr)], "yuv444p")] * 2)
        clip = open_clip(tmp_path / "x.mkv", plan=written_plan(rows=rows, cols=48))
        assert any(name in note for note in clip.warnings)
        assert np.abs(next(iter(read_frames(clip))).image - colour).max() < 1.5 / 256


def test_changes_of_other_frames_cost_nothing_where_no_frame_loses_a_bit(
    tmp_path: Path, written_plan: Callable[..., Path]
) -> None:
    write_movie(tmp_path / "x.mkv", in_10_bits(grey_ramp(24)), options={"g": "12"})
    assert not any(
        "costs accuracy" in one for one in open_clip(tmp_path / "x.mkv", plan=written_plan(rows=32, cols=48)).warnings
    )


def test_coding_that_costs_accuracy_is_said(tmp_path: Path, written_plan: Callable[..., Path]) -> None:
    write_movie(tmp_path / "x.mp4", grey_ramp(6), codec="libx264", matrix=1)
    (found,) = open_clip(tmp_path / "x.mp4", plan=written_plan(rows=32, cols=48)).warnings
    assert "H.264 costs accuracy: 8 bits" in found
    assert "of 6 frames only 1 is a whole one" in found


@pytest.mark.parametrize(
    ("tag", "transfer", "said", "doubted"),
    [
        (18, "rec709", "tagged with the transfer 'hlg', and the plan says 'rec709'", True),
        (18, "hlg", None, False),
        (16, "slog3", "tagged with the transfer 'st2084', and the plan says 'slog3'", False),
        (16, "srgb", "tagged with the transfer 'st2084', and the plan says 'srgb'", True),
        (1, "slog3", None, False),
        (1, "rec709", None, False),
        (1, "srgb", "tagged with the transfer 'rec709', and the plan says 'srgb'", False),
        (1, "linear", "tagged with the transfer 'rec709', and the plan says 'linear'", True),
        (2, "linear", None, False),
    ],
)
def test_the_streams_transfer_is_held_against_the_plans(
    tmp_path: Path, written_plan: Callable[..., Path], tag: int, transfer: str, said: str | None, doubted: bool
) -> None:
    """Cameras tag logarithmic footage as BT.709 or not at all; HLG and PQ are tagged only where they are meant. What is
    far off is doubted, which a report judges; PQ and S-Log3 differ by little but their exposure."""
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(2)), codec="prores", matrix=1, transfer=tag)
    clip = open_clip(tmp_path / "x.mov", plan=written_plan(rows=32, cols=48, transfer=transfer))
    assert [said is not None and said in warning for warning in clip.warnings] == [True] * (said is not None)
    assert bool(clip.curve_doubt) == doubted


@pytest.mark.parametrize(("name", "shift"), [("y210le", 6), ("p010le", 6)])
def test_interleaved_codes_come_out_at_their_places_every_time(name: str, shift: int) -> None:
    """FFmpeg's threads write over each other's rows where a width is no multiple of 16 pixels."""
    rows, cols = 1080, 1928
    frame = av.VideoFrame(cols, rows, name)
    codes = [np.random.default_rng(1).integers(0, 1024, p.buffer_size // 2, dtype=np.uint16) for p in frame.planes]
    for plane, held in zip(frame.planes, codes, strict=True):
        plane.update((held << shift).tobytes())
    first = codes[0].reshape(rows, -1)
    luma = first[:, : 2 * cols : 2] if name == "y210le" else first[:, :cols]
    for _ in range(12):
        assert np.array_equal(ffmpeg_planes.planes(Path("x.mov"), frame)[0], luma)


def test_what_only_the_container_says_of_the_curve_is_read(tmp_path: Path) -> None:
    """One ProRes encoder writes sRGB into the container, and nothing into the frames."""
    pictures = [np.full((48, 64, 3), 100, np.uint8)] * 3
    write_preview(tmp_path / "x.mov", pictures, fps=Fraction(25), codec="prores")
    assert movie.index_movie(tmp_path / "x.mov").header.transfer == "srgb"


@pytest.mark.parametrize(("black", "white"), [(None, None), (16, 235)])
def test_levels_at_the_ends_of_video_range_mean_what_leaving_them_out_means(
    tmp_path: Path, written_plan: Callable[..., Path], black: float | None, white: float | None
) -> None:
    write_movie(tmp_path / "x.mkv", grey_ramp(2), matrix=1, color_range=1)
    clip = open_clip(tmp_path / "x.mkv", plan=written_plan(rows=32, cols=48, black_level=black, white_level=white))
    assert next(iter(read_frames(clip))).image[0, 0, 0] == pytest.approx((40 - 16) / 219, abs=5e-5)


def test_ten_bits_are_not_asked_for_of_a_movie_that_has_them() -> None:
    ten, eight = (compression_warning("hevc", bits, frames=24, whole_frames=1) for bits in (10, 8))
    assert ten is not None
    assert eight is not None
    assert "record only whole frames" in ten
    assert "record 10 bits and only whole frames" in eight
