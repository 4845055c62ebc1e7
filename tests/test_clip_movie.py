"""Movies: depth, matrix and range against BT.709's own arithmetic; timestamps, holes, seeking, damage."""

import dataclasses
import gc
import struct
from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from numpy.typing import NDArray

from psvideo.clip import Take, keeping_near, open_clip, read_frames
from psvideo.clip.decode.movies import ffmpeg_planes, movie, movie_frames, yuv
from psvideo.clip.decode.movies.yuv import CODES, HIGHEST, LOWEST, to_rgb
from psvideo.clip.record import CodedPicture
from psvideo.errors import PsvideoError, UsageError
from psvideo.export.preview_movie import write_movie as write_preview
from psvideo.formats.plan_toml import format_plan
from psvideo.inspect.describe import describe
from psvideo.model.camera import Encoding
from psvideo.model.plan import Plan
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.gather import scheduled
from psvideo.runs.steps.output import tags_of, take_rate
from psvideo.sync.take_timing import find_timing
from psvideo.synth import TrueClock, expose

PlanMaker = Callable[..., Plan]
RATE = Fraction(120000, 1001)
ONE = 1 << 16
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


def make_frame(planes: Iterable[NDArray[Any]], pix_fmt: str) -> av.VideoFrame:
    planes = list(planes)
    frame = av.VideoFrame(planes[0].shape[1], planes[0].shape[0], pix_fmt)
    target: Any
    for target, plane in zip(frame.planes, planes, strict=True):
        padded = np.zeros((target.height, target.line_size // plane.itemsize), plane.dtype)
        padded[: plane.shape[0], : plane.shape[1]] = plane
        target.update(padded)
    return frame


def write_movie(
    path: Path,
    frames: Iterable[av.VideoFrame],
    *,
    codec: str = "ffv1",
    places: Iterable[int] | None = None,
    matrix: int = 2,
    color_range: int = 0,
    transfer: int = 2,
    options: dict[str, str] | None = None,
    movflags: str = "",
    aspect: Fraction = Fraction(1),
) -> None:
    frames = list(frames)
    with av.open(str(path), "w", options={"movflags": movflags} if movflags else {}) as container:
        stream: Any = container.add_stream(codec, rate=RATE, options={"threads": "1"} | (options or {}))
        stream.width, stream.height, stream.pix_fmt = frames[0].width, frames[0].height, frames[0].format.name
        stream.codec_context.colorspace, stream.codec_context.color_range = matrix, color_range
        stream.codec_context.color_trc = transfer
        stream.codec_context.sample_aspect_ratio = aspect
        stream.codec_context.time_base = 1 / RATE
        for place, frame in zip(places or range(len(frames)), frames, strict=True):
            frame.pts, frame.time_base = place, 1 / RATE
            frame.colorspace, frame.color_range, frame.color_trc = matrix, color_range, transfer
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


@pytest.fixture
def plan_for(tmp_path: Path, make_plan: Callable[..., Plan]) -> Callable[..., Path]:
    def write(*, rows: int, cols: int, fps: Fraction = RATE, **encoding: Any) -> Path:
        plan = make_plan(width_px=cols, height_px=rows, fps=fps)
        camera = dataclasses.replace(plan.camera, encoding=Encoding(**encoding))
        (tmp_path / "plan.toml").write_text(format_plan(dataclasses.replace(plan, camera=camera)))
        return tmp_path / "plan.toml"

    return write


def grey_ramp(count: int, *, rows: int = 32, cols: int = 48) -> list[av.VideoFrame]:
    """Frames whose luma shows their place: code 40 + 8 * place in all pixels."""
    chroma = np.full((rows // 2, cols // 2), 128, np.uint8)
    return [
        make_frame([np.full((rows, cols), 40 + 8 * place, np.uint8), chroma, chroma], "yuv420p")
        for place in range(count)
    ]


def in_10_bits(frames: Iterable[av.VideoFrame]) -> list[av.VideoFrame]:
    return [frame.reformat(format="yuv422p10le") for frame in frames]


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
    tmp_path: Path, plan_for: Callable[..., Path], pix_fmt: str, bits: int, down: int, across: int
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
    clip = open_clip(tmp_path / "x.mkv", plan=plan_for(rows=32, cols=48))
    frame = next(iter(read_frames(clip)))
    assert ["8 bits leave few steps" in warning for warning in clip.warnings] == [True] * (bits == 8)
    assert np.abs(frame.image - colour).max() < 1.5 / 2**bits + 3e-5


@pytest.mark.parametrize(("pix_fmt", "bits"), [("gray", 8), ("gray10le", 10), ("gray12le", 12), ("gray16le", 16)])
def test_grey_movies_come_out_with_every_bit(
    tmp_path: Path, plan_for: Callable[..., Path], pix_fmt: str, bits: int
) -> None:
    codes = np.random.default_rng(2).integers(0, 2**bits, (32, 48)).astype(np.uint8 if bits == 8 else np.uint16)
    write_movie(tmp_path / "x.mkv", [make_frame([codes], pix_fmt)])
    clip = open_clip(tmp_path / "x.mkv", plan=plan_for(rows=32, cols=48))
    (frame,) = read_frames(clip)
    assert np.array_equal(np.rint(frame.image * (2**bits - 1)), codes)


@pytest.mark.parametrize(("pix_fmt", "bits"), [("gbrp10le", 10), ("gbrp12le", 12), ("gbrp16le", 16)])
def test_rgb_movies_come_out_with_every_bit_in_the_right_channel(
    tmp_path: Path, plan_for: Callable[..., Path], pix_fmt: str, bits: int
) -> None:
    codes = np.random.default_rng(2).integers(0, 2**bits, (32, 48, 3)).astype(np.uint8 if bits == 8 else np.uint16)
    write_movie(tmp_path / "x.mkv", [make_frame([codes[..., 1], codes[..., 2], codes[..., 0]], pix_fmt)])
    clip = open_clip(tmp_path / "x.mkv", plan=plan_for(rows=32, cols=48))
    (frame,) = read_frames(clip)
    assert np.array_equal(np.rint(frame.image * (2**bits - 1)), codes)


@pytest.mark.parametrize(
    ("name", "codec", "options"),
    [
        ("x.mp4", "libx264", {"bf": "3", "qp": "0"}),
        ("x.mov", "libx264", {"bf": "0", "qp": "0"}),
        ("x.mkv", "libx264", {"bf": "2", "qp": "0"}),
        ("x.mkv", "ffv1", {}),
        ("x.AVI", "ffv1", {}),
        ("x.m4v", "libx264", {"bf": "2", "qp": "0"}),
        ("x.webm", "libvpx-vp9", {"lossless": "1"}),
        ("x.mts", "libx264", {"bf": "2", "qp": "0"}),
        ("x.ts", "libx264", {"bf": "2", "qp": "0"}),
        ("x.flv", "libx264", {"bf": "2", "qp": "0"}),
        ("x.nut", "ffv1", {}),
        ("x.y4m", "wrapped_avframe", {}),
    ],
)
def test_frames_come_in_the_order_of_time_and_are_found_by_number(
    tmp_path: Path, plan_for: Callable[..., Path], name: str, codec: str, options: dict[str, str]
) -> None:
    write_movie(tmp_path / name, grey_ramp(24), codec=codec, options=options | {"g": "6"})
    clip = open_clip(tmp_path / name, plan=plan_for(rows=32, cols=48))
    assert clip.numbers == tuple(range(24))
    for wanted in (clip.numbers, (0,), (7, 13), (22, 23)):
        frames = list(read_frames(clip, wanted))
        assert [frame.index for frame in frames] == list(wanted)
        places = [round((float(frame.image[16, 24, 1]) * 219 + 16 - 40) / 8, 1) for frame in frames]
        assert places == pytest.approx(list(wanted), abs=0.2)


def test_frames_of_a_movie_that_are_kept_are_not_decoded_again(
    tmp_path: Path, plan_for: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_movie(tmp_path / "x.mp4", grey_ramp(24), codec="libx264", options={"g": "6"})
    clip = open_clip(tmp_path / "x.mp4", plan=plan_for(rows=32, cols=48))
    asked: list[int] = []
    read = movie_frames.read_movie

    def watched(path: Path, stamps: Sequence[int]) -> Iterator[CodedPicture]:
        asked.extend(stamps)
        return read(path, stamps)

    monkeypatch.setattr(movie_frames, "read_movie", watched)
    with keeping_near(tmp_path / "out") as kept:
        early = list(read_frames(clip, range(3, 8), kept=kept, keep=True))
        frames = list(read_frames(clip, kept=kept))
    assert sorted(asked) == list(clip.timestamps)
    assert [frame.index for frame in frames] == list(range(24))
    assert all(np.array_equal(one.image, again.image) for one, again in zip(early, frames[3:8], strict=True))


@pytest.mark.parametrize("matrix", [1, 2], ids=["tagged", "untagged"])
def test_a_decoded_frame_is_gone_once_its_codes_are_made(tmp_path: Path, matrix: int) -> None:
    """By itself: until Python looks for circles, dozens of frames would be held."""
    write_movie(tmp_path / "x.mkv", grey_ramp(8), matrix=matrix)
    stamps = movie.index_movie(tmp_path / "x.mkv").timestamps
    gc.collect()
    gc.disable()
    try:
        assert len(list(movie_frames.read_movie(tmp_path / "x.mkv", stamps))) == 8
        assert not any(isinstance(one, av.VideoFrame) for one in gc.get_objects())
    finally:
        gc.enable()


@pytest.mark.parametrize("name", ["x.mp4", "x.mkv", "x.mov"])
def test_gaps_in_the_timestamps_are_dropped_frames(tmp_path: Path, plan_for: Callable[..., Path], name: str) -> None:
    places = [0, 1, 2, 3, 5, 6, 9, 10, 11, 12]
    codec = "ffv1" if name.endswith("mkv") else "libx264"
    write_movie(tmp_path / name, grey_ramp(10), codec=codec, places=places)
    clip = open_clip(tmp_path / name, plan=plan_for(rows=32, cols=48))
    assert clip.numbers == tuple(places)
    assert [frame.index for frame in read_frames(clip)] == places


def shot_before_time_zero(path: Path, *, reordered: str, hidden: int = 4) -> None:
    """Write twelve frames; those before time zero are hidden by an edit list, as where a phone's movie was cut."""
    with av.open(str(path), "w", options={"avoid_negative_ts": "disabled"}) as container:
        stream: Any = container.add_stream("libx264", rate=RATE, options={"bf": reordered, "qp": "0", "threads": "1"})
        stream.width, stream.height, stream.pix_fmt = 48, 32, "yuv420p"
        stream.codec_context.time_base = 1 / RATE
        for place, frame in enumerate(grey_ramp(12)):
            frame.pts, frame.time_base = place - hidden, 1 / RATE
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def with_edits(path: Path, edits: Sequence[tuple[float, int]]) -> None:
    """Write another edit list into a movie of one stream: seconds and the first frame (-1: nothing) of every edit.

    The boxes are those of ISO/IEC 14496-12; what follows the first one in ``edts`` becomes free space.
    """
    data = path.read_bytes()
    at = data.index(b"elst") - 4
    (movie_hz,) = struct.unpack_from(">I", data, data.index(b"mvhd") + 16)
    (media_hz,) = struct.unpack_from(">I", data, data.index(b"mdhd") + 16)
    rows = b"".join(
        struct.pack(">IiI", round(long_s * movie_hz), round(first / float(RATE) * media_hz) if first >= 0 else -1, ONE)
        for long_s, first in edits
    )
    box = struct.pack(">I4sII", 16 + len(rows), b"elst", 0, len(edits)) + rows
    more = len(box) - struct.unpack_from(">I", data, at)[0]
    data = data[:at] + box + data[at + len(box) - more :]
    for parent in (b"edts", b"trak", b"moov"):
        place = data.index(parent) - 4
        data = data[:place] + struct.pack(">I", struct.unpack_from(">I", data, place)[0] + more) + data[place + 4 :]
    path.write_bytes(data)


@pytest.mark.parametrize("reordered", ["0", "2"])
def test_frames_that_an_edit_list_hides_are_left_out_and_said(
    tmp_path: Path, plan_for: Callable[..., Path], reordered: str
) -> None:
    shot_before_time_zero(tmp_path / "x.mp4", reordered=reordered)
    clip = open_clip(tmp_path / "x.mp4", plan=plan_for(rows=32, cols=48))
    frames = list(read_frames(clip))
    assert [frame.index for frame in frames] == list(range(8)), "zero is the first frame that is shown"
    assert frames[0].image[0, 0, 1] == pytest.approx((40 + 8 * 4 - 16) / 219, abs=2e-3)
    assert any("its edit list hides 4 of the 12 frames" in warning for warning in clip.warnings)


@pytest.mark.parametrize(
    ("edits", "places"),
    [
        ([(12, 0)], range(12)),
        ([(0, 0)], range(12)),
        ([(1, -1), (12, 0)], range(12)),
        ([(5, 3)], range(3, 8)),
        ([(5, 3)] * 3, range(3, 8)),
        ([(3, 0), (4, 6)], [0, 1, 2, 6, 7, 8, 9]),
        ([(4, 6), (3, 0), (3, 0)], [0, 1, 2, 6, 7, 8, 9]),
    ],
    ids=["whole", "no length", "late", "middle", "three times", "cut", "turned round"],
)
def test_every_edit_shows_its_frames_once_at_the_times_at_which_they_were_taken(
    tmp_path: Path, plan_for: Callable[..., Path], edits: list[tuple[float, int]], places: Sequence[int]
) -> None:
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(12)), codec="prores", matrix=1)
    with_edits(tmp_path / "x.mov", [(frames / float(RATE), first) for frames, first in edits])
    clip = open_clip(tmp_path / "x.mov", plan=plan_for(rows=32, cols=48))
    assert clip.numbers == tuple(place - places[0] for place in places)
    shown = [round((float(frame.image[16, 24, 1]) * 219 + 16 - 40) / 8) for frame in read_frames(clip)]
    assert shown == list(places)
    assert ["hides" in warning for warning in clip.warnings] == [True] * (len(places) < 12)


def test_an_edit_that_shows_a_moment_of_a_frame_shows_that_frame(tmp_path: Path, plan_for: Callable[..., Path]) -> None:
    """As players do and FFmpeg; a movie's clock rounds by a tenth of a frame here, and a little is added for that."""
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(12)), codec="prores", matrix=1)
    with_edits(tmp_path / "x.mov", [(5.3 / float(RATE), 2)])
    assert len(open_clip(tmp_path / "x.mov", plan=plan_for(rows=32, cols=48)).numbers) == 6
    with av.open(str(tmp_path / "x.mov")) as container:
        assert len(list(container.decode(video=0))) == 6


def test_a_movie_whose_edits_show_nothing_is_refused(tmp_path: Path, plan_for: Callable[..., Path]) -> None:
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(12)), codec="prores", matrix=1)
    with_edits(tmp_path / "x.mov", [(0.02, 40)])
    with pytest.raises(PsvideoError, match="edit list shows none of its 12 frames"):
        open_clip(tmp_path / "x.mov", plan=plan_for(rows=32, cols=48))


def test_covers_are_no_footage_and_of_several_streams_the_first_counts(
    tmp_path: Path, plan_for: Callable[..., Path]
) -> None:
    """A movie may hold a picture for its shelf and a second camera's stream."""
    with av.open(str(tmp_path / "x.mp4"), "w") as container:
        cover: Any = container.add_stream("mjpeg", rate=RATE)
        cover.width, cover.height, cover.pix_fmt = 16, 16, "yuvj420p"
        cover.disposition = av.stream.Disposition.attached_pic
        streams: list[Any] = [container.add_stream("libx264", rate=RATE, options={"qp": "0"}) for _ in range(2)]
        for stream, (rows, cols) in zip(streams, ((32, 48), (16, 16)), strict=True):
            stream.width, stream.height, stream.pix_fmt = cols, rows, "yuv420p"
        (still,) = grey_ramp(1, rows=16, cols=16)
        still.pts = 0
        container.mux(cover.encode(still.reformat(format="yuvj420p")))
        for stream, size in zip(streams, ((32, 48), (16, 16)), strict=True):
            for place, frame in enumerate(grey_ramp(4, rows=size[0], cols=size[1])):
                frame.pts, frame.time_base = place, 1 / RATE
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
        container.mux(cover.encode(None))
    clip = open_clip(tmp_path / "x.mp4", plan=plan_for(rows=32, cols=48))
    assert clip.numbers == tuple(range(4))
    assert any("holds 2 video streams; the first one counts" in warning for warning in clip.warnings)


def test_uneven_timestamps_are_refused(tmp_path: Path, plan_for: Callable[..., Path]) -> None:
    with av.open(str(tmp_path / "x.mp4"), "w") as container:
        stream: Any = container.add_stream("libx264", rate=120, options={"threads": "1"})
        stream.width, stream.height, stream.pix_fmt = 48, 32, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1200)
        for place, frame in enumerate(grey_ramp(12)):
            frame.pts, frame.time_base = 10 * place + (4 if place % 3 == 1 else 0), Fraction(1, 1200)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    with pytest.raises(PsvideoError, match=r"x\.mp4: its frames do not come at an even rate"):
        open_clip(tmp_path / "x.mp4", plan=plan_for(rows=32, cols=48))


SLOWER = [4] * 10 + [5] * 10 + [4] * 9
"""A phone in dim light: 30 frames a second, then 24, then 30 again, as places of 1/120 s."""


def movie_of_varying_rate(path: Path, plan: Plan, steps: list[int], phase_s: float) -> None:
    """Film a wall under the plan's strobe at the places of 1/120 s that the steps lead to, and write these as times."""
    places = np.concatenate([[0], np.cumsum(steps)])
    camera = dataclasses.replace(plan.camera, fps=RATE)
    plates = [None if flash.is_dark else np.full((160, 8), 0.3 + 0.1 * n) for n, flash in enumerate(plan.flashes)]
    dropped = sorted(set(range(places[-1] + 1)) - set(places.tolist()))
    shot = expose(
        plates,
        dataclasses.replace(plan, camera=camera),
        frames=int(places[-1]) + 1,
        clock=TrueClock(phase_s=phase_s, offset_ppm=40.0),
        dropped=dropped,
    )
    frames = [make_frame([(65535 * frame).astype(np.uint16)], "gray16le") for frame in np.clip(shot.frames, 0, 1)]
    write_movie(path, frames, places=places.tolist())


def test_frames_of_a_rate_that_changes_are_taken_at_their_own_times(tmp_path: Path, make_plan: PlanMaker) -> None:
    plan = make_plan(width_px=8, height_px=160, fps=RATE / 4, duration_s=0.003)
    movie_of_varying_rate(tmp_path / "x.mkv", plan, SLOWER, phase_s=0.0123)
    (tmp_path / "plan.toml").write_text(format_plan(plan))
    clip = open_clip(tmp_path / "x.mkv", plan=tmp_path / "plan.toml")
    assert np.diff(clip.numbers).tolist() == SLOWER, "to the millisecond, as Matroska counts"
    assert clip.plan.camera.fps == RATE
    assert clip.filmed_plan.camera.fps == tags_of(clip).camera_fps == plan.camera.fps
    assert any("varies from 23.9" in warning and "29.9" in warning for warning in clip.warnings)
    timing = find_timing(Take(clip=clip, numbers=clip.numbers))
    assert timing.dropped_frames == ()
    assert timing.clock_offset_ppm == pytest.approx(40.0, abs=20.0)
    truth_s = 0.0123 + np.arange(200) * (plan.flashes[0].duration_s + plan.dark_s) * (1 + 40e-6)
    off_s = [np.abs(truth_s - flash.start_s).min() for flash in timing.flashes if flash.complete]
    assert len(off_s) > 10
    assert max(off_s) < 1e-4
    take = Take(clip=clip, numbers=clip.numbers)
    due = scheduled(take, timing, Aligning(rate=take_rate("frame", take)), start_number=1001)
    assert due is not None
    shown = {number: time_s for round_ in due.by_round.values() for number, time_s in round_}
    assert set(shown) < {1001 + number for number in clip.numbers}, "every result is a frame's, none between"
    assert len(shown) + sum(due.left_out) == len(clip.numbers)
    middle_s = clip.plan.camera.middle_s
    assert all(at_s == pytest.approx(middle_s + (n - 1001) / float(RATE), abs=1e-9) for n, at_s in shown.items())
    with pytest.raises(UsageError, match="vary in rate"):
        take_rate("frame", take, shutter=180)


def test_a_rate_that_changes_is_refused_where_every_frame_is_to_have_its_flash(
    tmp_path: Path, make_plan: PlanMaker
) -> None:
    plan = make_plan(width_px=8, height_px=160, fps=RATE / 4, duration_s=0.003)
    movie_of_varying_rate(tmp_path / "x.mkv", plan, SLOWER, phase_s=0.0)
    synced = dataclasses.replace(plan, mode="synced")
    (tmp_path / "plan.toml").write_text(format_plan(synced))
    with pytest.raises(PsvideoError, match=r"varies from .* constant frame rate"):
        open_clip(tmp_path / "x.mkv", plan=tmp_path / "plan.toml")


def test_untagged_matrix_is_guessed_from_the_height_and_said(tmp_path: Path, plan_for: Callable[..., Path]) -> None:
    colour = np.array([0.7, 0.3, 0.15])
    for rows, weights, name in ((32, BT601, "BT.601"), (720, BT709, "BT.709")):
        y, cb, cr = np.rint(codes_of(colour, weights, 8, True)).astype(np.uint8)
        write_movie(tmp_path / "x.mkv", [make_frame([np.full((rows, 48), c) for c in (y, cb, cr)], "yuv444p")] * 2)
        clip = open_clip(tmp_path / "x.mkv", plan=plan_for(rows=rows, cols=48))
        assert any(name in note for note in clip.warnings)
        assert np.abs(next(iter(read_frames(clip))).image - colour).max() < 1.5 / 256


def test_a_movie_that_plays_at_another_rate_is_read_with_a_note(tmp_path: Path, plan_for: Callable[..., Path]) -> None:
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(6)), codec="prores", matrix=1)
    assert open_clip(tmp_path / "x.mov", plan=plan_for(rows=32, cols=48)).warnings == ()
    misnamed = open_clip(tmp_path / "x.mov", plan=plan_for(rows=32, cols=48, fps=Fraction(120)))
    assert "plays at 119.88 frames per second and the plan says 120" in misnamed.warnings[0]


@pytest.mark.parametrize("rate", [60.0, 59.0])
def test_timestamps_that_jitter_say_no_other_rate_than_the_plans(
    rate: float, tmp_path: Path, plan_for: Callable[..., Path]
) -> None:
    """A phone's stamps are off by 3 % of a frame or so, the first and the last too: that is no other rate."""
    plan = plan_for(rows=32, cols=48, fps=Fraction(60))
    for seed in range(8):
        rng = np.random.default_rng(seed)
        with av.open(str(tmp_path / "x.mp4"), "w") as container:
            stream: Any = container.add_stream("libx264", rate=60, options={"threads": "1", "bf": "0"})
            stream.width, stream.height, stream.pix_fmt = 48, 32, "yuv420p"
            stream.codec_context.time_base = Fraction(1, 90_000)
            for place, frame in enumerate(frame for _ in range(5) for frame in grey_ramp(10)):
                late = 0.05 * rng.standard_normal()
                frame.pts, frame.time_base = round(90_000 / rate * (place + 1 + late)), Fraction(1, 90_000)
                container.mux(stream.encode(frame))
            container.mux(stream.encode(None))
        said = [text for text in open_clip(tmp_path / "x.mp4", plan=plan).warnings if "frames per second" in text]
        assert bool(said) == (rate != 60.0)


def test_the_rate_at_which_a_phone_shot_slow_motion_counts(shared_data: Path, plan_for: Callable[..., Path]) -> None:
    movie = shared_data / "movies" / "video_phone" / "androidx_sample_sef_slow_motion.mp4"
    if not movie.is_file():
        pytest.skip("the real movies are not there")
    of_itself = " ".join(finding.text for finding in describe(movie).findings)
    assert "64 frames, 30 frames a second, shot at 240: movie, 320 x 240 pixels" in of_itself
    assert "there is no plan.toml" in of_itself
    slow = open_clip(movie, plan=plan_for(rows=240, cols=320, fps=Fraction(240)))
    assert not any("frames per second" in warning for warning in slow.warnings)
    wrong = open_clip(movie, plan=plan_for(rows=240, cols=320, fps=Fraction(120)))
    assert any("was shot at 240 frames per second, and the plan says 120" in warning for warning in wrong.warnings)


def test_changes_of_other_frames_cost_nothing_where_no_frame_loses_a_bit(
    tmp_path: Path, plan_for: Callable[..., Path]
) -> None:
    write_movie(tmp_path / "x.mkv", in_10_bits(grey_ramp(24)), options={"g": "12"})
    assert not any(
        "costs accuracy" in one for one in open_clip(tmp_path / "x.mkv", plan=plan_for(rows=32, cols=48)).warnings
    )


@pytest.mark.parametrize(("aspect", "said"), [(Fraction(4, 3), True), (Fraction(1), False)])
def test_pixels_that_are_not_square_are_said(
    aspect: Fraction, said: bool, tmp_path: Path, plan_for: Callable[..., Path]
) -> None:
    write_movie(tmp_path / "x.mov", grey_ramp(4), codec="libx264", aspect=aspect)
    found = " ".join(open_clip(tmp_path / "x.mov", plan=plan_for(rows=32, cols=48)).warnings)
    assert ("its pixels are not square, but 1.333 times as wide as high" in found) == said


def test_coding_that_costs_accuracy_is_said(tmp_path: Path, plan_for: Callable[..., Path]) -> None:
    write_movie(tmp_path / "x.mp4", grey_ramp(6), codec="libx264", matrix=1)
    (found,) = open_clip(tmp_path / "x.mp4", plan=plan_for(rows=32, cols=48)).warnings
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
    tmp_path: Path, plan_for: Callable[..., Path], tag: int, transfer: str, said: str | None, doubted: bool
) -> None:
    """Cameras tag logarithmic footage as BT.709 or not at all; HLG and PQ are tagged only where they are meant. What is
    far off is doubted, which a report judges; PQ and S-Log3 differ by little but their exposure."""
    write_movie(tmp_path / "x.mov", in_10_bits(grey_ramp(2)), codec="prores", matrix=1, transfer=tag)
    clip = open_clip(tmp_path / "x.mov", plan=plan_for(rows=32, cols=48, transfer=transfer))
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
    tmp_path: Path, plan_for: Callable[..., Path], black: float | None, white: float | None
) -> None:
    write_movie(tmp_path / "x.mkv", grey_ramp(2), matrix=1, color_range=1)
    clip = open_clip(tmp_path / "x.mkv", plan=plan_for(rows=32, cols=48, black_level=black, white_level=white))
    assert next(iter(read_frames(clip))).image[0, 0, 0] == pytest.approx((40 - 16) / 219, abs=5e-5)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 0.95])
@pytest.mark.parametrize(
    ("name", "codec", "movflags"),
    [
        ("x.mkv", "ffv1", ""),
        ("x.mp4", "libx264", ""),
        ("x.mp4", "libx264", "faststart"),
        ("x.mov", "prores_ks", "faststart"),
    ],
)
def test_truncated_movies_are_refused_by_name(
    tmp_path: Path, plan_for: Callable[..., Path], name: str, codec: str, movflags: str, share: float
) -> None:
    noise = np.random.default_rng(0).integers(200, 800, (20, 32, 48)).astype(np.uint16)
    depth = "yuv422p10le" if codec == "prores_ks" else "yuv420p"
    frames = [
        make_frame([luma, luma[:, ::2], luma[:, ::2]], depth)
        if depth == "yuv422p10le"
        else make_frame([(p >> 2).astype(np.uint8) for p in (luma, luma[::2, ::2], luma[::2, ::2])], depth)
        for luma in noise
    ]
    write_movie(tmp_path / name, frames, codec=codec, movflags=movflags)
    plan = plan_for(rows=32, cols=48)
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: int(len(data) * share)])
    with pytest.raises(PsvideoError, match=rf"{name}.*(truncated|holds|is empty)"):
        list(read_frames(open_clip(tmp_path / name, plan=plan)))


@pytest.mark.parametrize("name", ["x.mkv", "x.ts", "x.mp4"])
def test_a_movie_that_begins_late_is_whole_and_one_that_breaks_off_is_not(
    tmp_path: Path, plan_for: Callable[..., Path], name: str
) -> None:
    """Matroska says when the video ends, and that is counted from the clock's 0, not from the first frame."""
    write_movie(tmp_path / name, grey_ramp(24), codec="libx264", places=range(37, 61))
    plan = plan_for(rows=32, cols=48)
    assert open_clip(tmp_path / name, plan=plan).numbers == tuple(range(24))
    if name == "x.mkv":
        data = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(data[: len(data) * 3 // 4])
        with pytest.raises(PsvideoError, match=r"holds .* frames, and its header promises"):
            open_clip(tmp_path / name, plan=plan)


def test_a_movie_whose_container_does_not_say_the_order_of_its_frames_says_so(
    tmp_path: Path, plan_for: Callable[..., Path]
) -> None:
    write_movie(tmp_path / "x.avi", grey_ramp(12), codec="libx264", options={"bf": "2", "qp": "0"})
    with pytest.raises(PsvideoError, match=r"or .*AVI does not say.* \.mkv"):
        list(read_frames(open_clip(tmp_path / "x.avi", plan=plan_for(rows=32, cols=48))))


def test_damage_in_the_middle_of_a_movie_stops_there(tmp_path: Path, plan_for: Callable[..., Path]) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (12, 32, 48)).astype(np.uint8)
    frames = [make_frame([luma, luma[::2, ::2], luma[::2, ::2]], "yuv420p") for luma in noise]
    write_movie(tmp_path / "x.mp4", frames, codec="libx264", options={"qp": "5", "g": "1"})
    data = bytearray((tmp_path / "x.mp4").read_bytes())
    middle = len(data) // 2
    data[middle : middle + 300] = bytes(byte ^ 0x5A for byte in data[middle : middle + 300])
    (tmp_path / "x.mp4").write_bytes(data)
    clip = open_clip(tmp_path / "x.mp4", plan=plan_for(rows=32, cols=48))
    seen: list[int] = []
    with pytest.raises(PsvideoError, match=r"x\.mp4: .*(truncated|damaged)"):
        seen.extend(frame.index for frame in read_frames(clip))
    assert len(seen) < 12


def test_a_pixel_format_that_is_not_read_is_named_with_its_file(tmp_path: Path, plan_for: Callable[..., Path]) -> None:
    frame = av.VideoFrame(48, 32, "rgb565le")
    write_movie(tmp_path / "x.mov", [frame, frame], codec="rawvideo")
    with pytest.raises(PsvideoError, match=r"x\.mov: its pixel format, rgb5\w+, is not read"):
        open_clip(tmp_path / "x.mov", plan=plan_for(rows=32, cols=48))


def test_a_file_that_holds_no_movie_says_so(tmp_path: Path, plan_for: Callable[..., Path]) -> None:
    (tmp_path / "x.mp4").write_bytes(b"x" * 5000)
    with pytest.raises(PsvideoError, match=r"x\.mp4: cannot be decoded"):
        open_clip(tmp_path / "x.mp4", plan=plan_for(rows=32, cols=48))
