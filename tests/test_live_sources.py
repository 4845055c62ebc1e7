"""Where live frames come from: a pipe, the network, a folder that grows; and what goes wrong with each."""

import io
import itertools
import json
import shutil
import socket
import threading
import time
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import av
import numpy as np
import pytest
from live_clip import live_clip
from written_movies import RATE, make_frame, write_movie

import psvideo as ps
from psvideo.cli.app import main
from psvideo.clip import read_frames
from psvideo.clip.decoded import Header
from psvideo.clip.filters import check_live_filters
from psvideo.clip.streams.growing_folder import _new_files, read_growing
from psvideo.clip.streams.stream import StreamPlaces, read_stream
from psvideo.clip.streams.stream_rate import StreamRate
from psvideo.live.chain import Chain
from psvideo.live.incoming.sources import opened_source

Pictures = list[np.ndarray]


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return live_clip(tmp_path_factory.mktemp("live"))


@pytest.fixture(scope="module")
def pictures(clip: Path) -> Pictures:
    frames = read_frames(ps.open_take(clip).clip)
    return [np.asarray(frame.coded.codes) for frame in frames]


def grey(pictures: Pictures) -> Pictures:
    return [one if one.ndim == 2 else one[..., 1] for one in pictures]


def piped(monkeypatch: pytest.MonkeyPatch, data: bytes) -> None:
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(data)))


def y4m(pictures: Pictures, *, rate: int = 100) -> bytes:
    rows, cols = pictures[0].shape
    head = f"YUV4MPEG2 W{cols} H{rows} F{rate}:1 Ip A1:1 Cmono16\n".encode()
    return head + b"".join(b"FRAME\n" + one.tobytes() for one in pictures)


def test_a_pipe_of_y4m_is_followed(
    clip: Path, pictures: Pictures, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    piped(monkeypatch, y4m(grey(pictures)))
    plan = str(clip / "plan.toml")
    assert main(["live", "-", "--plan", plan, "--rig", str(clip / "rig.toml"), "--no-page", "--json"]) == 0
    summary = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (summary["frames"], summary["lost"], summary["locks"]) == (len(pictures), 0, 1)
    assert abs(summary["clock_offset_ppm"] - 40) < 2
    assert summary["results"] >= 1


def test_bare_bytes_are_recorded_as_they_came(
    clip: Path, pictures: Pictures, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent = grey(pictures)
    piped(monkeypatch, b"".join(one.tobytes() for one in sent))
    words = ["live", "-", "--raw", "gray16le", "--plan", str(clip / "plan.toml"), "--no-page", "-q"]
    assert main([*words, "--record", str(tmp_path / "rec")]) == 0
    kept = [np.asarray(frame.coded.codes) for frame in read_frames(ps.open_take(tmp_path / "rec").clip)]
    assert len(kept) == len(sent)
    assert all(np.array_equal(one, other) for one, other in zip(kept, sent, strict=True))


def test_a_sender_that_is_cut_off_in_the_middle_of_a_frame_loses_that_frame_alone(
    clip: Path, pictures: Pictures, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    sent = b"".join(one.tobytes() for one in grey(pictures))
    piped(monkeypatch, sent[: -grey(pictures)[0].nbytes // 2])
    words = ["live", "-", "--raw", "gray16le", "--plan", str(clip / "plan.toml"), "--no-page"]
    assert main([*words, "--record", str(tmp_path / "rec")]) == 0
    assert len(ps.open_take(tmp_path / "rec").numbers) == len(pictures) - 1
    said = " ".join(capsys.readouterr().err.split())
    assert "1 frame came damaged or cut short, and was left out" in said
    assert "96 x 72 pixels of gray16le make a frame" in said


def test_frames_that_ffmpeg_paints_over_are_left_out_and_counted(clip: Path, tmp_path: Path) -> None:
    plan, noise = ps.read_plan(clip / "plan.toml"), np.random.default_rng(0).integers(0, 255, (12, 72, 96))
    frames = [make_frame([one, one[:, ::2], one[:, ::2]], "yuv422p") for one in noise.astype(np.uint8)]
    write_movie(tmp_path / "x.mkv", frames, codec="mpeg2video", options={"g": "1", "qscale": "2", "b": "9000000"})
    with av.open(str(tmp_path / "x.mkv")) as movie:
        sizes = [(one.pos or 0, one.size) for one in movie.demux(video=0) if one.size]
    data = bytearray((tmp_path / "x.mkv").read_bytes())
    for n in (4, 7):
        begin = sizes[n][0] + sizes[n][1] // 2
        data[begin : begin + 300] = bytes(300)
    (tmp_path / "x.mkv").write_bytes(data)
    notes: list[str] = []
    came = read_stream(str(tmp_path / "x.mkv"), replace(plan.camera, fps=RATE), noted=notes.append)
    assert [frame.index for frame in came] == [0, 1, 2, 3, 5, 6, 8, 9, 10, 11]
    assert any("2 frames came damaged or cut short, and were left out." in note for note in notes)


def test_a_device_that_is_not_there_is_told_what_to_look_for(clip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["live", "/dev/video73", "--plan", str(clip / "plan.toml"), "--no-page"]) == 1
    assert "cable" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "cannot be read"),
        (b"not a movie" * 100, "cannot be read"),
        ("small", "sends 48 x 36 pixels, and the plan says 96 x 72"),
        ("slow", "its time stamps are 50 frames a second, and the plan says 100"),
    ],
)
def test_what_is_wrong_with_a_pipe_is_one_paragraph(
    clip: Path,
    pictures: Pictures,
    data: bytes | str,
    words: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    if data == "small":
        data = y4m([one[::2, ::2] for one in grey(pictures)[:3]])
    elif data == "slow":
        data = y4m(grey(pictures), rate=50)
    piped(monkeypatch, data)  # type: ignore[arg-type]
    assert main(["live", "-", "--plan", str(clip / "plan.toml"), "--no-page"]) == 1
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said


def test_colour_that_comes_where_the_plan_says_a_mosaic_is_refused_and_read_nowhere_as_one(
    clip: Path, pictures: Pictures, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = (clip / "plan.toml").read_text(encoding="utf-8").replace("[camera]", '[camera]\ncfa = "RGGB"', 1)
    (tmp_path / "mosaic.toml").write_text(plan, encoding="utf-8")
    words = ["live", "-", "--raw", "rgb24", "--plan", str(tmp_path / "mosaic.toml"), "--no-page"]
    piped(monkeypatch, bytes(3 * pictures[0].shape[0] * pictures[0].shape[1] * 4))
    assert main(words) == 1
    assert "is a colour picture, and the plan says cfa = 'RGGB'" in capsys.readouterr().err


def test_a_mosaic_whose_filters_the_plan_does_not_name_is_refused_while_it_comes() -> None:
    mosaic = Header(width_px=4, height_px=4, channels=1, bits=8, cfa="GBRG")
    with pytest.raises(ps.PsvideoError, match="write cfa = 'GBRG'"):
        check_live_filters("genicam", mosaic, None)
    with pytest.raises(ps.PsvideoError, match="says that its colour filters are GBRG"):
        check_live_filters("genicam", mosaic, "RGGB")
    check_live_filters("genicam", mosaic, "GBRG")


def test_frames_as_they_are_taken_need_a_plan_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["live", "-", "--no-page"]) == 2
    assert "--plan" in capsys.readouterr().err


def test_stamps_say_where_frames_are_and_a_restart_is_seen() -> None:
    places = StreamPlaces(rate_hz=100)
    stamps = [5.0, 5.01, 5.02, 5.05, 5.06, 0.0, 0.01, 90.0]
    came = [0.0, 0.01, 0.02, 0.05, 0.06, 0.30, 0.31, 0.32]
    assert [places.place(stamp, at) for stamp, at in zip(stamps, came, strict=True)] == [0, 1, 2, 5, 6, 30, 31, 32]
    assert places.restarts == 2


def test_a_pause_counts_though_the_last_frame_before_it_is_handed_out_after_it() -> None:
    """A decoder that waits for the next frame hands one out when it comes: two seconds late."""
    places = StreamPlaces(rate_hz=100)
    stamps = [*(n / 100 for n in range(10)), 0.10, 0.0, 0.01]
    came = [*(n / 100 for n in range(10)), 2.10, 2.11, 2.12]
    found = [places.place(stamp, at) for stamp, at in zip(stamps, came, strict=True)]
    assert found == [*range(11), 211, 212]


def test_a_pipe_whose_codes_are_not_the_plans_and_that_is_cut_off_says_so_in_plain_words(
    clip: Path, pictures: Pictures, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The plan says that 65535 is white, and bytes come; then the sender begins again, with another head."""
    small = [(one >> 8).astype(np.uint8) for one in grey(pictures)[:40]]
    head = b"YUV4MPEG2 W96 H72 F100:1 Ip A1:1 Cmono\n"
    piped(monkeypatch, head + b"".join(b"FRAME\n" + one.tobytes() for one in small) + head)
    main(["live", "-", "--plan", str(clip / "plan.toml"), "--no-page"])
    said = " ".join(capsys.readouterr().err.split())
    assert "white_level is 65535 in the plan, and the largest code of these 8-bit files is 255" in said
    assert "broke off (Invalid data found when processing input)" in said
    assert "Errno" not in said


def test_a_stream_over_the_network_arrives_frame_by_frame(clip: Path, pictures: Pictures) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    over = threading.Event()

    def send() -> None:
        with av.open(f"udp://127.0.0.1:{port}?pkt_size=1316", "w", format="mpegts") as out:
            stream = out.add_stream("mpeg2video", rate=Fraction(50))
            stream.width, stream.height, stream.pix_fmt = 96, 72, "yuv420p"
            stream.bit_rate, stream.gop_size = 8_000_000, 1
            for number in range(500):
                picture = (grey(pictures)[number % 100] >> 8).astype(np.uint8)
                frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p")
                frame.pts = number
                out.mux(stream.encode(frame))
                if over.wait(0.01):
                    return

    sender = threading.Thread(target=send, daemon=True)
    camera = ps.read_plan(clip / "plan.toml").camera
    camera = type(camera)(**{**vars(camera), "fps": Fraction(50)})
    sender.start()
    places = []
    for frame in read_stream(f"udp://127.0.0.1:{port}?timeout=8000000", camera):
        places.append(frame.index)
        if len(places) == 40:
            break
    over.set()
    sender.join()
    assert places == list(range(40))


def test_a_folder_is_read_while_it_is_written(clip: Path, tmp_path: Path) -> None:
    names = sorted(path.name for path in (clip / "frames").iterdir())[:12]
    folder = tmp_path / "frames"
    folder.mkdir()

    def write() -> None:
        for place, name in enumerate(names):
            if place == 5:
                continue  # a frame that the recorder dropped
            whole = (clip / "frames" / name).read_bytes()
            (folder / name).write_bytes(whole[: len(whole) // 2])
            time.sleep(0.01)
            shutil.copyfile(clip / "frames" / name, folder / name)

    writer = threading.Thread(target=write)
    writer.start()
    take = ps.open_take(clip)
    found = list(read_growing(tmp_path, take.plan.camera, quiet_s=0.4))
    writer.join()
    assert [frame.index for frame in found] == [0, 1, 2, 3, 4, 6, 7, 8, 9, 10, 11]
    known = {frame.index: frame.image for frame in read_frames(take.clip, take.numbers[:12])}
    assert all(np.array_equal(frame.image, known[frame.index]) for frame in found)
    with pytest.raises(ps.PsvideoError, match="no frame appeared"):
        list(read_growing(clip / "truth", take.plan.camera, quiet_s=0.02))


def test_frames_that_a_recorder_writes_out_of_order_are_read_in_order_and_none_is_lost(
    clip: Path, tmp_path: Path
) -> None:
    names = sorted(path.name for path in (clip / "frames").iterdir())[:12]
    (tmp_path / "frames").mkdir()

    def write() -> None:
        for place in (0, 1, 3, 2, 4, 7, 6, 5, 9, 10, 8, 11):
            shutil.copyfile(clip / "frames" / names[place], tmp_path / "frames" / f".{names[place]}")
            (tmp_path / "frames" / f".{names[place]}").rename(tmp_path / "frames" / names[place])
            time.sleep(0.03)

    writer = threading.Thread(target=write)
    writer.start()
    take = ps.open_take(clip)
    found = [frame.index for frame in read_growing(tmp_path, take.plan.camera, quiet_s=0.6)]
    writer.join()
    assert found == list(range(12))


def test_a_file_that_a_recorder_never_finishes_is_waited_for_and_named_and_the_frames_after_it_come(
    clip: Path, tmp_path: Path
) -> None:
    files = sorted((clip / "frames").iterdir())[:8]
    for place, file in enumerate(files):
        data = file.read_bytes()
        (tmp_path / file.name).write_bytes(data[: len(data) // 2] if place in (0, 3) else data)
    said: list[str] = []
    began_s = time.monotonic()
    growing = read_growing(tmp_path, ps.open_take(clip).plan.camera, quiet_s=0.3, whole_s=0.2, noted=said.append)
    found = [(frame.index, frame.number) for frame in growing]
    assert found == [(0, 2), (1, 3), (3, 5), (4, 6), (5, 7), (6, 8)], "what is left out counts as a dropped frame"
    assert time.monotonic() - began_s > 0.2 + 0.2 + 0.3, "each was waited for, and the end"
    assert [files[place].name in sentence for place, sentence in zip((0, 3), said, strict=True)] == [True, True]


@pytest.mark.parametrize("whole", [0, 2])
def test_a_folder_in_which_no_file_gets_whole_is_refused_with_what_is_wrong(
    clip: Path, tmp_path: Path, whole: int
) -> None:
    for place, file in enumerate(sorted((clip / "frames").iterdir())[: whole + (4 if whole else 1)]):
        (tmp_path / file.name).write_bytes(file.read_bytes() if place < whole else b"")
    growing = read_growing(tmp_path, ps.open_take(clip).plan.camera, quiet_s=0.2, whole_s=0.05)
    with pytest.raises(ps.PsvideoError, match="is empty"):
        list(growing)


def test_frames_that_grow_are_called_by_their_files_numbers(clip: Path, tmp_path: Path) -> None:
    files = sorted((clip / "frames").iterdir())[:3]
    for number, file in zip((1001, 1002, 1004), files, strict=True):
        shutil.copyfile(file, tmp_path / f"take.{number}{file.suffix}")
    source = opened_source(str(tmp_path), plan=clip / "plan.toml", growing=True)
    found = list(itertools.islice(source.frames(), 3))
    assert [(frame.index, frame.number) for frame in found] == [(0, 1001), (1, 1002), (3, 1004)]
    chain = Chain(plan=source.plan)
    for frame in found:
        chain.take(frame)
    assert chain.count.first_file == 1001


def test_two_files_of_one_number_are_both_named(clip: Path, tmp_path: Path) -> None:
    file = next((clip / "frames").iterdir())
    for name in ("a.0001", "b.0001"):
        shutil.copyfile(file, tmp_path / f"{name}{file.suffix}")
    with pytest.raises(ps.PsvideoError, match=r"a\.0001.*b\.0001.*are both numbered 1"):
        list(read_growing(tmp_path, ps.open_take(clip).plan.camera, quiet_s=0.2))


def test_a_folder_of_many_frames_is_looked_through_once(clip: Path, tmp_path: Path) -> None:
    suffix = next((clip / "frames").iterdir()).suffix
    for number in range(1000):
        (tmp_path / f"take.{number:05d}{suffix}").touch()
    passed: dict[Path, set[str]] = {}
    assert _new_files(tmp_path, 998, passed) == [(999, tmp_path / f"take.00999{suffix}")]
    assert len(passed[tmp_path]) == 999
    assert _new_files(tmp_path, 999, passed) == []


def test_a_recorder_that_numbers_by_twos_is_waited_for_once_and_not_at_each_frame(clip: Path, tmp_path: Path) -> None:
    files = sorted((clip / "frames").iterdir())[:40:2]
    (tmp_path / "frames").mkdir()
    for file in files:
        shutil.copyfile(file, tmp_path / "frames" / file.name)
    began_s = time.monotonic()
    found = [frame.index for frame in read_growing(tmp_path, ps.open_take(clip).plan.camera, quiet_s=0.4)]
    assert found == list(range(0, 40, 2))
    assert time.monotonic() - began_s < 3.0, "a quarter of a second for each of twenty would be five"


@pytest.mark.parametrize(
    ("raw", "said"),
    [
        ("grey", "Did you mean gray?"),
        ("bayer_rggb8", "A mosaic is gray or gray16le"),
        ("grayf32le", "not a pixel format"),
    ],
)
def test_bare_bytes_of_an_unknown_kind_are_refused_with_the_kinds_that_are_read(
    clip: Path, raw: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["live", "-", "--raw", raw, "--plan", str(clip / "plan.toml"), "--no-page"]) == 2
    error = capsys.readouterr().err
    assert f"--raw {raw}" in error
    assert "gray, gray10le, gray12le, gray16le, rgb24" in error
    assert said in error


def rate_said(planned_hz: float, stamps_s: Iterable[float]) -> float | None:
    rate = StreamRate(planned_hz=planned_hz)
    return next((other for stamp_s in stamps_s if (other := rate.other_hz(stamp_s)) is not None), None)


@pytest.mark.parametrize("true_hz", [24, 25, 29.97, 30, 50, 60, 100, 119.88, 120, 240])
@pytest.mark.parametrize("planned_hz", [24, 25, 29.97, 30, 50, 60, 100, 119.88, 120, 240])
@pytest.mark.parametrize("tick_s", [1e-9, 1e-3])
def test_a_stream_at_another_rate_than_planned_is_known_by_its_stamps_and_no_other(
    true_hz: float, planned_hz: float, tick_s: float
) -> None:
    """Whole milliseconds, as some containers hold; frames are lost, and that is no rate."""
    rng = np.random.default_rng(0)
    stamps_s = [round(n / true_hz / tick_s) * tick_s for n in range(200) if n < 2 or rng.random() > 0.1]
    found = rate_said(planned_hz, stamps_s)
    if abs(true_hz / planned_hz - 1) < 0.002:
        assert found is None
    else:
        assert found == pytest.approx(true_hz, rel=0.012)


def test_stamps_of_when_frames_came_in_bursts_or_began_again_say_no_rate() -> None:
    in_bursts = [n // 4 * 4 / 100 + n % 4 * 1e-4 for n in range(200)]
    again = [*(n / 30 for n in range(20)), *(n / 100 for n in range(200))]
    assert rate_said(100, in_bursts) is None
    assert rate_said(100, again) is None
