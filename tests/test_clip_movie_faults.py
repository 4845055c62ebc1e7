"""Movies that are damaged, cut short, or hold no movie that can be read."""

from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pytest
from written_movies import RATE, grey_ramp, make_frame, write_movie

from psvideo.clip import open_clip, read_frames
from psvideo.errors import PsvideoError


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
    tmp_path: Path, written_plan: Callable[..., Path], name: str, codec: str, movflags: str, share: float
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
    plan = written_plan(rows=32, cols=48)
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: int(len(data) * share)])
    with pytest.raises(PsvideoError, match=rf"{name}.*(truncated|holds|is empty)"):
        list(read_frames(open_clip(tmp_path / name, plan=plan)))


@pytest.mark.parametrize("name", ["x.mp4", "x.mov"])
def test_a_movie_that_breaks_off_is_said_to_lack_what_cameras_write_last(
    name: str, tmp_path: Path, written_plan: Callable[..., Path]
) -> None:
    """FFmpeg calls such files invalid, and one whose index is cut a file without video."""
    write_movie(tmp_path / name, grey_ramp(24), codec="libx264")
    plan, data = written_plan(rows=32, cols=48), (tmp_path / name).read_bytes()
    index = data.index(b"moov") - 4
    pictures = data.index(b"mdat") - 4
    for end, said in (
        (index - 9, rf"of the {index - pictures} bytes of its last part \(mdat\) {index - 9 - pictures} are there"),
        (index, r"lacks its index \(moov\)"),
        (index + 200, rf"of the {len(data) - index} bytes of its last part \(moov\)"),
    ):
        (tmp_path / name).write_bytes(data[:end])
        with pytest.raises(PsvideoError, match=rf"{name}: is truncated: .*{said}"):
            open_clip(tmp_path / name, plan=plan)


@pytest.mark.parametrize("name", ["x.mkv", "x.ts", "x.mp4"])
def test_a_movie_that_begins_late_is_whole_and_one_that_breaks_off_is_not(
    tmp_path: Path, written_plan: Callable[..., Path], name: str
) -> None:
    """Matroska says when the video ends, and that is counted from the clock's 0, not from the first frame."""
    write_movie(tmp_path / name, grey_ramp(24), codec="libx264", places=range(37, 61))
    plan = written_plan(rows=32, cols=48)
    assert open_clip(tmp_path / name, plan=plan).numbers == tuple(range(24))
    if name == "x.mkv":
        data = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(data[: len(data) * 3 // 4])
        with pytest.raises(PsvideoError, match=r"holds .* frames, and its header promises"):
            open_clip(tmp_path / name, plan=plan)


def test_a_movie_whose_container_does_not_say_the_order_of_its_frames_says_so(
    tmp_path: Path, written_plan: Callable[..., Path]
) -> None:
    write_movie(tmp_path / "x.avi", grey_ramp(12), codec="libx264", options={"bf": "2", "qp": "0"})
    with pytest.raises(PsvideoError, match=r"or .*AVI does not say.* \.mkv"):
        list(read_frames(open_clip(tmp_path / "x.avi", plan=written_plan(rows=32, cols=48))))


def test_damage_in_the_middle_of_a_movie_stops_there(tmp_path: Path, written_plan: Callable[..., Path]) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (12, 32, 48)).astype(np.uint8)
    frames = [make_frame([luma, luma[::2, ::2], luma[::2, ::2]], "yuv420p") for luma in noise]
    write_movie(tmp_path / "x.mp4", frames, codec="libx264", options={"qp": "5", "g": "1"})
    data = bytearray((tmp_path / "x.mp4").read_bytes())
    middle = len(data) // 2
    data[middle : middle + 300] = bytes(byte ^ 0x5A for byte in data[middle : middle + 300])
    (tmp_path / "x.mp4").write_bytes(data)
    clip = open_clip(tmp_path / "x.mp4", plan=written_plan(rows=32, cols=48))
    seen: list[int] = []
    with pytest.raises(PsvideoError, match=r"x\.mp4: .*truncated or damaged there\. Copy it again") as fault:
        seen.extend(frame.index for frame in read_frames(clip))
    assert len(seen) < 12
    assert f"frame {len(seen)}, {len(seen) / float(RATE):.3f} s from the start, cannot" in str(fault.value)
    assert f"which are whole (`frames` 0-{len(seen) - 1})." in str(fault.value)
    with pytest.raises(PsvideoError, match=r"frame 6, .* choose other frames with `frames`\."):
        list(read_frames(clip, [len(seen)]))


@pytest.mark.parametrize("first", [0, 6])
def test_damage_that_ffv1_s_checksums_show_is_not_painted_over(
    tmp_path: Path, written_plan: Callable[..., Path], first: int
) -> None:
    """FFmpeg shows the picture before instead, and says nothing."""
    noise = np.random.default_rng(0).integers(0, 255, (12, 32, 48)).astype(np.uint8)
    frames = [make_frame([luma, luma[::2, ::2], luma[::2, ::2]], "yuv420p") for luma in noise]
    write_movie(tmp_path / "x.mkv", frames, codec="ffv1", options={"level": "3", "slicecrc": "1", "slices": "4"})
    plan = written_plan(rows=32, cols=48)
    assert len(list(read_frames(open_clip(tmp_path / "x.mkv", plan=plan)))) == 12
    with av.open(str(tmp_path / "x.mkv")) as movie:
        place = next(one.pos or 0 for n, one in enumerate(movie.demux(video=0)) if n == 7)
    data = bytearray((tmp_path / "x.mkv").read_bytes())
    data[place + 700] ^= 0x10
    (tmp_path / "x.mkv").write_bytes(data)
    seen: list[int] = []
    with pytest.raises(PsvideoError, match=r"x\.mkv: frame 7, .* s from the start, cannot be decoded"):
        seen.extend(frame.index for frame in read_frames(open_clip(tmp_path / "x.mkv", plan=plan), range(first, 12)))
    assert seen == list(range(first, 7))


def test_what_is_left_of_a_truncated_movie_is_read_once_it_is_repacked(
    tmp_path: Path, written_plan: Callable[..., Path]
) -> None:
    write_movie(tmp_path / "x.mkv", grey_ramp(24), codec="libx264", options={"g": "1"})
    plan, data = written_plan(rows=32, cols=48), (tmp_path / "x.mkv").read_bytes()
    (tmp_path / "x.mkv").write_bytes(data[: len(data) * 3 // 4])
    with pytest.raises(
        PsvideoError, match=r"the last of these, 0\.\d+ s from .*ffmpeg -i x\.mkv -c copy repacked"
    ) as told:
        open_clip(tmp_path / "x.mkv", plan=plan)
    held = int(str(told.value).split(" holds ")[1].split()[0])
    with av.open(str(tmp_path / "x.mkv")) as source, av.open(str(tmp_path / "repacked.mkv"), "w") as repacked:
        copied = repacked.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(video=0):
            if packet.dts is not None:
                packet.stream = copied
                repacked.mux(packet)
    assert 0 < len(list(read_frames(open_clip(tmp_path / "repacked.mkv", plan=plan)))) == held < 24


def test_a_pixel_format_that_is_not_read_is_named_with_its_file(
    tmp_path: Path, written_plan: Callable[..., Path]
) -> None:
    frame = av.VideoFrame(48, 32, "rgb565le")
    write_movie(tmp_path / "x.mov", [frame, frame], codec="rawvideo")
    with pytest.raises(PsvideoError, match=r"x\.mov: its pixel format, rgb5\w+, is not read"):
        open_clip(tmp_path / "x.mov", plan=written_plan(rows=32, cols=48))


def test_a_file_that_holds_no_movie_says_so(tmp_path: Path, written_plan: Callable[..., Path]) -> None:
    (tmp_path / "x.mp4").write_bytes(b"x" * 5000)
    with pytest.raises(PsvideoError, match=r"x\.mp4: cannot be decoded"):
        open_clip(tmp_path / "x.mp4", plan=written_plan(rows=32, cols=48))
