"""Movies: frames in the order of time, found by number, kept and let go; which stream is the footage."""

import gc
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from written_movies import RATE, grey_ramp, write_movie

from psvideo.clip import keeping_near, open_clip, read_frames
from psvideo.clip.decode.movies import movie, movie_frames
from psvideo.clip.decoded import CodedPicture


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
    tmp_path: Path, written_plan: Callable[..., Path], name: str, codec: str, options: dict[str, str]
) -> None:
    write_movie(tmp_path / name, grey_ramp(24), codec=codec, options=options | {"g": "6"})
    clip = open_clip(tmp_path / name, plan=written_plan(rows=32, cols=48))
    assert clip.numbers == tuple(range(24))
    for wanted in (clip.numbers, (0,), (7, 13), (22, 23)):
        frames = list(read_frames(clip, wanted))
        assert [frame.index for frame in frames] == list(wanted)
        places = [round((float(frame.image[16, 24, 1]) * 219 + 16 - 40) / 8, 1) for frame in frames]
        assert places == pytest.approx(list(wanted), abs=0.2)


def test_frames_of_a_movie_that_are_kept_are_not_decoded_again(
    tmp_path: Path, written_plan: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    write_movie(tmp_path / "x.mp4", grey_ramp(24), codec="libx264", options={"g": "6"})
    clip = open_clip(tmp_path / "x.mp4", plan=written_plan(rows=32, cols=48))
    asked: list[int] = []
    read = movie_frames.read_movie

    def watched(path: Path, stamps: Sequence[int], numbers: Sequence[int]) -> Iterator[CodedPicture]:
        asked.extend(stamps)
        return read(path, stamps, numbers)

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


def test_covers_are_no_footage_and_of_several_streams_the_first_counts(
    tmp_path: Path, written_plan: Callable[..., Path]
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
    clip = open_clip(tmp_path / "x.mp4", plan=written_plan(rows=32, cols=48))
    assert clip.numbers == tuple(range(4))
    assert any("holds 2 video streams; the first one counts" in warning for warning in clip.warnings)


@pytest.mark.parametrize(("aspect", "said"), [(Fraction(4, 3), True), (Fraction(1), False)])
def test_pixels_that_are_not_square_are_said(
    aspect: Fraction, said: bool, tmp_path: Path, written_plan: Callable[..., Path]
) -> None:
    write_movie(tmp_path / "x.mov", grey_ramp(4), codec="libx264", aspect=aspect)
    found = " ".join(open_clip(tmp_path / "x.mov", plan=written_plan(rows=32, cols=48)).warnings)
    assert ("its pixels are not square, but 1.333 times as wide as high" in found) == said
