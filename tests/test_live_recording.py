"""Recording live: a clip as any other, whole or not at all, whatever the disk does."""

import errno
import itertools
import shutil
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from live_clip import live_clip

import psvideo as ps
from psvideo.cli.app import main
from psvideo.clip import open_clip, read_frames
from psvideo.errors import UsageError
from psvideo.export.sequences import code_files
from psvideo.export.sequences.code_files import write_codes
from psvideo.live.incoming import recording
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.live.incoming.recording import Recording
from psvideo.live.incoming.source import played_clip
from psvideo.live.status import LiveStatus
from psvideo.model.coded import Coded
from psvideo.runs.live import live
from psvideo.runs.steps.caller import PYTHON


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return live_clip(tmp_path_factory.mktemp("live"))


def test_normals_of_the_recording_are_those_of_the_clip(clip: Path, tmp_path: Path) -> None:
    shutil.copytree(clip, tmp_path / "holed")
    (tmp_path / "holed" / "frames" / sorted(path.name for path in (clip / "frames").iterdir())[70]).unlink()
    said: list[str] = []
    summary = live(tmp_path / "holed", record=tmp_path / "rec", pace="fastest", caller=replace(PYTHON, say=said.append))
    assert said[0] == f"The lights stand where {tmp_path / 'holed' / 'rig.toml'} says."
    assert ps.read_rig(tmp_path / "rec" / "rig.toml") == ps.read_rig(clip / "rig.toml")
    assert (summary.recorded, summary.lost) == (109, 1)
    takes = [ps.open_take(path) for path in (tmp_path / "holed", tmp_path / "rec")]
    assert takes[1].clip.dropped[0][1] == 1
    pairs = zip(*(read_frames(take.clip) for take in takes), strict=True)
    assert all(np.array_equal(one.image, other.image) and one.index == other.index for one, other in pairs)
    rig = ps.read_rig(clip / "rig.toml")
    timing = ps.find_timing(takes[0])
    solved = [list(ps.solve(take, rig, timing)) for take in takes]
    assert len(solved[0]) > 10
    for one, other in zip(*solved, strict=True):
        assert one.surface.normals.tobytes() == other.surface.normals.tobytes()


def test_a_disk_that_fills_leaves_what_was_recorded_whole(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    write, room = code_files.write_codes, iter(range(60))

    def full(path: Path, codes: np.ndarray) -> None:
        write(path, codes)
        if next(room, None) is None:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(recording, "write_codes", full)
    words = ["live", str(clip), "--record", str(tmp_path / "rec"), "--pace", "fastest", "--no-page"]
    assert main(words) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert "Recording ended after 60 frames, which are whole" in said
    assert "No space left on device" in said
    assert "RECORDING ENDED, 60 recorded" in said
    assert len(ps.open_take(tmp_path / "rec").numbers) == 60
    assert main(words) == 2, "what is there is not replaced"
    assert "exists already" in capsys.readouterr().err


def test_a_disk_that_takes_a_part_of_a_frame_is_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """numpy counts what it wrote, and names no error of the system's."""
    record = Recording(folder=tmp_path / "rec", most_bytes=64, waits=True)
    (tmp_path / "rec" / "frames").mkdir(parents=True)

    def cut(path: Path, codes: np.ndarray) -> None:
        raise OSError("64 requested and 16 written")

    monkeypatch.setattr(recording, "write_codes", cut)
    record.take(LiveFrame(index=0, coded=Coded(codes=np.zeros((8, 8), np.uint8)), came_s=0.0))
    record.write()
    assert "(the disk takes no more). Make room on the disk" in record.ended


def test_a_writer_that_fails_in_any_way_ends_the_recording_and_nobody_waits_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = Recording(folder=tmp_path / "rec", most_bytes=64, waits=True)
    (tmp_path / "rec" / "frames").mkdir(parents=True)
    monkeypatch.setattr(recording, "write_codes", lambda *_: 1 // 0)
    frame = LiveFrame(index=0, coded=Coded(codes=np.zeros((8, 8), np.uint8)), came_s=0.0)
    record.take(frame)
    record.write()
    assert "Recording ended at once: not even the first frame could be written" in record.ended
    record.take(frame)  # would wait for ever


def test_a_disk_that_is_too_slow_ends_the_recording_without_a_hole(tmp_path: Path) -> None:
    record = Recording(folder=tmp_path / "rec", most_bytes=10 * 64)
    (tmp_path / "rec" / "frames").mkdir(parents=True)
    for index in range(20):
        record.take(LiveFrame(index=index, coded=Coded(codes=np.zeros((8, 8), np.uint8)), came_s=0.0))
    record.over()
    record.write()
    assert record.written == 10
    assert "too slow for this camera: recording ended after 10 frames" in record.ended


def test_what_is_cut_while_a_frame_is_written_takes_no_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A second Ctrl-C comes while a frame is being written, and the source gives another before it hears of it."""
    record = recording.Recording(folder=tmp_path / "rec")
    (tmp_path / "rec" / "frames").mkdir(parents=True)
    frames = [LiveFrame(index=n, coded=Coded(codes=np.zeros((8, 8), np.uint8)), came_s=0.0) for n in range(2)]
    whole = write_codes

    def cut_meanwhile(path: Path, codes: np.ndarray) -> None:
        record.cut()
        record.take(frames[1])
        whole(path, codes)

    monkeypatch.setattr(recording, "write_codes", cut_meanwhile)
    record.take(frames[0])
    record.write()
    assert (record.written, record._bytes, len(record._queue)) == (1, 0, 0)


def test_the_log_of_a_strobe_that_was_played_meanwhile_lies_in_the_recording(clip: Path, tmp_path: Path) -> None:
    source = played_clip(open_clip(clip), pace="fastest")
    with recording.recording(tmp_path / "rec", source, force=False) as record:
        record.take(next(source.frames()))
        record.beside["strobe.json"] = "what was played"
    assert (tmp_path / "rec" / "strobe.json").read_text(encoding="utf-8") == "what was played"


def stopping(when: Callable[[LiveStatus], bool]) -> Callable[[LiveStatus], None]:
    """Return what presses Ctrl-C once things stand so."""

    def look(status: LiveStatus) -> None:
        if when(status):
            raise KeyboardInterrupt  # as Python does in the main thread, which says how things stand

    return look


def test_a_run_that_is_ended_by_ctrl_c_leaves_its_recording_and_its_timing_whole(tmp_path: Path) -> None:
    clip, rec = live_clip(tmp_path, frames=700), tmp_path / "rec"
    locked = stopping(lambda status: status.state == "locked")
    summary = live(clip, record=rec, timing_out=tmp_path / "timing.json", said=locked)
    assert len(ps.open_take(rec).numbers) == summary.recorded == summary.frames < 700
    assert ps.read_timing(tmp_path / "timing.json").flashes


def test_what_was_recorded_is_kept_where_no_strobe_is_found(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = played_clip(open_clip(clip))
    first = next(source.frames())

    def still() -> Iterator[LiveFrame]:
        for place in itertools.count():
            time.sleep(0.01)
            yield replace(first, index=place, came_s=time.monotonic())

    monkeypatch.setattr("psvideo.runs.live.opened_source", lambda *_, **__: replace(source, frames=still))
    with pytest.raises(ps.PsvideoError, match=r"recorded all the same, and whole, in .*rec\.$"):
        live("camera", record=tmp_path / "rec", said=stopping(lambda status: bool(status.recorded)))
    assert ps.open_take(tmp_path / "rec").numbers


def test_a_source_that_fails_leaves_the_frames_until_then_whole(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = played_clip(open_clip(clip), pace="fastest")

    def broken() -> Iterator[LiveFrame]:
        yield from itertools.islice(source.frames(), 60)
        raise ps.PsvideoError("camera: the cable came out.")

    monkeypatch.setattr("psvideo.runs.live.opened_source", lambda *_, **__: replace(source, frames=broken))
    said = r"the cable came out\. 60 frames are recorded all the same, and whole, in .*rec\.$"
    with pytest.raises(ps.PsvideoError, match=said):
        live("camera", record=tmp_path / "rec")
    assert len(ps.open_take(tmp_path / "rec").numbers) == 60


def test_what_a_recording_that_was_killed_left_is_not_removed_unasked(clip: Path, tmp_path: Path) -> None:
    left = tmp_path / ".rec.partial" / "frames"
    left.mkdir(parents=True)
    (left / "live.000001.tif").write_bytes(b"footage")
    with pytest.raises(UsageError, match=r"was killed, and left 1 frame in"):
        live(clip, record=tmp_path / "rec", pace="fastest")
    assert (left / "live.000001.tif").read_bytes() == b"footage"
    assert live(clip, record=tmp_path / "rec", pace="fastest", force=True).recorded == 110


def test_nothing_appears_where_no_frame_was_recorded(clip: Path, tmp_path: Path) -> None:
    with pytest.raises(ps.PsvideoError, match="there is no such clip"):
        live(clip / "none", record=tmp_path / "rec", pace="fastest")
    assert not (tmp_path / "rec").exists()


def test_a_second_stop_leaves_out_what_waits_for_a_slow_disk_and_nothing_hidden(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, source = code_files.write_codes, played_clip(open_clip(clip))

    def slow(path: Path, codes: np.ndarray) -> None:
        time.sleep(0.05)
        write(path, codes)

    monkeypatch.setattr(recording, "write_codes", slow)
    first = next(source.frames())
    made: list[Recording] = []

    def stopped() -> None:
        with recording.recording(tmp_path / "rec", source, force=False) as record:
            made.append(record)
            for index in range(200):
                record.take(replace(first, index=index))
            time.sleep(0.12)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert [path.name for path in tmp_path.iterdir()] == ["rec"]
    assert 1 <= len(ps.open_take(tmp_path / "rec").numbers) == made[0].written < 20
    assert "more frames waited for the disk" in made[0].ended


def test_a_run_that_is_stopped_before_its_first_frame_leaves_nothing(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("psvideo.runs.live.rehearse", lambda *_, **__: time.sleep(2.5))
    with pytest.raises(KeyboardInterrupt):
        live(clip, record=tmp_path / "rec", said=stopping(lambda status: status.state == "preparing"))
    assert not list(tmp_path.iterdir())


def test_a_log_that_finds_no_room_costs_no_recording(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = played_clip(open_clip(clip), pace="fastest")

    def full(path: Path, *_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    with recording.recording(tmp_path / "rec", source, force=False) as record:
        record.take(next(source.frames()))
        record.beside["strobe.json"] = "what was played"
        monkeypatch.setattr(Path, "write_text", full)
    monkeypatch.undo()
    assert len(ps.open_take(tmp_path / "rec").numbers) == 1
    assert "strobe.json could not be written (No space left on device)" in record.ended


def test_the_timing_of_a_run_that_is_recorded_is_the_recordings(clip: Path, tmp_path: Path) -> None:
    shutil.copytree(clip, tmp_path / "holed")
    for file in sorted((tmp_path / "holed" / "frames").iterdir()):
        number = int(file.stem.rpartition(".")[2])
        file.rename(file.with_name(f"shot.{number + 500:06d}{file.suffix}"))
    sorted((tmp_path / "holed" / "frames").iterdir())[70].unlink()
    rec = tmp_path / "rec"
    live(tmp_path / "holed", record=rec, timing_out=tmp_path / "timing.json", pace="fastest")
    timing, of_recording = ps.read_timing(tmp_path / "timing.json"), ps.find_timing(ps.open_take(rec))
    assert timing.clip == of_recording.clip == "rec"
    assert timing.dropped_frames == of_recording.dropped_frames
    assert timing.dropped_frames
