"""Decoded pictures come back from their temporary file as they were, within the room that they may take."""

import io
import shutil
import sys
import tempfile
from collections import deque
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from psvideo.clip import Kept, keeping_near
from psvideo.clip import kept as kept_module
from psvideo.clip.decoded import CodedPicture, Header, PictureInFile
from psvideo.errors import PsvideoError

KINDS = st.sampled_from([np.uint8, np.uint16, np.float32])
SHAPES = st.one_of(
    st.tuples(st.integers(1, 5), st.integers(1, 5)), st.tuples(st.integers(1, 5), st.integers(1, 5), st.just(3))
)
ARRAYS = KINDS.flatmap(lambda kind: hnp.arrays(kind, SHAPES))


def picture(codes: np.ndarray, black: float = 0.0) -> CodedPicture:
    rows, cols = codes.shape[:2]
    head = Header(width_px=cols, height_px=rows, channels=1, bits=16, black=((black,),))
    return CodedPicture(header=head, codes=codes)


@given(st.lists(ARRAYS, min_size=1, max_size=5), st.booleans())
def test_what_is_kept_comes_back_bit_for_bit_in_any_order(arrays: list[np.ndarray], turned: bool) -> None:
    with keeping_near(Path(tempfile.gettempdir()) / "out") as kept:
        put = {}
        for number, codes in enumerate(arrays):
            put[number] = picture(codes[::-1, ::-1] if turned else codes, black=number)
            kept.put(number, put[number])
        for number in reversed(put):
            back = kept.get(number)
            assert back.header == put[number].header, "every frame keeps its own levels"
            assert back.codes.dtype == put[number].codes.dtype
            assert np.asarray(back.codes).tobytes() == put[number].codes.tobytes()
        assert kept.bytes_held == sum(codes.nbytes for codes in arrays)


def test_no_more_room_is_taken_than_is_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    codes = np.zeros((10, 10), np.uint16)

    class Usage:
        free = 1000

    monkeypatch.setattr(shutil, "disk_usage", lambda folder: Usage)
    with keeping_near(tmp_path / "out") as kept:
        for number in range(5):
            kept.put(number, picture(codes))
        assert [number in kept for number in range(5)] == [True, True, False, False, False]
        assert (len(kept), kept.bytes_held, kept.missed) == (2, 400, 3)


def test_a_disk_that_turns_out_to_be_full_ends_the_keeping_and_not_the_run() -> None:
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no device that is always full")
    with io.FileIO(str(full), "r+") as file:
        kept = Kept(file, most_bytes=10**9)
        for number in range(2):
            kept.put(number, picture(np.zeros((4, 4), np.uint16)))
        assert (len(kept), kept.missed) == (0, 2)


class SlowToWrite(io.FileIO):
    def write(self, data: memoryview) -> int:  # type: ignore[override]
        return super().write(data[:7])


class SlowToRead(io.FileIO):
    """Linux gives 2 GiB at a time."""

    def readinto(self, room: memoryview) -> int:  # type: ignore[override]
        return super().readinto(room[:7]) or 0


@pytest.mark.parametrize("slow", [SlowToWrite, SlowToRead])
def test_a_write_or_a_reading_of_only_a_part_is_gone_on_with(slow: type[io.FileIO], tmp_path: Path) -> None:
    codes = np.arange(100, dtype=np.uint16).reshape(10, 10)
    with slow(str(tmp_path / "file"), "w+") as file:
        kept = Kept(file, most_bytes=10**6)
        kept.put(3, picture(codes))
        assert np.array_equal(kept.get(3).codes, codes)


def test_a_picture_that_the_disk_does_not_give_back_is_said(tmp_path: Path) -> None:
    with io.FileIO(str(tmp_path / "file"), "w+") as file:
        kept = Kept(file, most_bytes=10**6)
        kept.put(3, picture(np.ones((10, 10), np.uint16)))
        file.truncate(50)
        with pytest.raises(PsvideoError, match="file that holds decoded frames and plates cannot be read back"):
            kept.get(3)


@pytest.mark.skipif(sys.platform == "win32", reason="all threads share one place in an open file there")
def test_a_picture_may_stay_in_the_file_while_rows_of_it_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Until the last picture is gone, also when the store is; what the disk does not give back is said."""
    codes = np.arange(600, dtype=np.uint16).reshape(10, 20, 3)
    with keeping_near(tmp_path / "out") as kept:
        kept.put(2, picture(codes))
        kept.put(3, picture(codes[::-1]))
        assert isinstance(kept.get(3, in_file=True), CodedPicture), "so small a one is read"
        monkeypatch.setattr(kept_module, "STAYS_FROM_BYTES", 1)
        found = kept.get(3, in_file=True)
    assert isinstance(found, PictureInFile)
    assert np.array_equal(found.codes[2:7], codes[::-1][2:7])
    assert found.codes.dtype == codes.dtype
    with tempfile.TemporaryFile(dir=tmp_path, buffering=0) as file:
        kept = Kept(file, most_bytes=10**6)
        kept.put(3, picture(codes))
        found = kept.get(3, in_file=True)
        file.truncate(50)
        with pytest.raises(PsvideoError, match="file that holds decoded frames and plates cannot be read back"):
            np.asarray(found.codes)


@pytest.mark.skipif(sys.platform == "win32", reason="all threads share one place in an open file there")
def test_passing_pictures_stay_in_the_file_while_they_are_held_and_others_take_their_places(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    each = [np.full((10, 20, 3), number, np.uint16) for number in range(50)]
    with keeping_near(tmp_path / "out") as kept:
        assert isinstance(kept.passing(picture(each[0])), CodedPicture), "so small a one stays in memory"
        monkeypatch.setattr(kept_module, "STAYS_FROM_BYTES", 1)
        held: deque[CodedPicture | PictureInFile] = deque(maxlen=3)
        for number, codes in enumerate(each):
            held.append(kept.passing(picture(codes)))
            assert [int(np.asarray(one.codes).max()) for one in held] == [*range(max(number - 2, 0), number + 1)]
        assert all(isinstance(one, PictureInFile) for one in held)
        assert kept.bytes_held <= 4 * each[0].nbytes, "the file is as long as what is held at a time"
        kept.put(7, picture(each[7]))
        held.clear()
        held.extend(kept.passing(picture(codes)) for codes in each[:3])
        assert np.array_equal(kept.get(7).codes, each[7])


@pytest.mark.skipif(sys.platform == "win32", reason="all threads share one place in an open file there")
def test_a_passing_picture_for_which_there_is_no_room_stays_in_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kept_module, "STAYS_FROM_BYTES", 1)
    codes = np.arange(200, dtype=np.uint16).reshape(10, 20)
    with io.FileIO(str(tmp_path / "file"), "w+") as file:
        kept = Kept(file, most_bytes=codes.nbytes)
        first, second = kept.passing(picture(codes)), kept.passing(picture(codes + 1))
        assert isinstance(first, PictureInFile)
        assert isinstance(second, CodedPicture)
        assert np.array_equal(np.asarray(first.codes), codes)
        assert np.array_equal(second.codes, codes + 1)


@pytest.mark.parametrize("end", [None, PsvideoError, KeyboardInterrupt])
def test_nothing_is_left_however_the_run_ends(tmp_path: Path, end: type[BaseException] | None) -> None:
    def work(kept: Kept) -> None:
        kept.put(1, picture(np.ones((10, 10), np.uint16)))
        assert list(tmp_path.iterdir()) == [], "the file has no name: even a process that is killed leaves nothing"
        if end is not None:
            raise end

    held: list[Kept] = []
    try:
        with keeping_near(tmp_path / "not" / "yet" / "there") as kept:
            held.append(kept)
            work(kept)
    except (PsvideoError, KeyboardInterrupt):
        assert end is not None
    assert list(tmp_path.iterdir()) == []
    assert 1 not in held[0]
    held[0].put(2, picture(np.ones((10, 10), np.uint16)))
    assert held[0].missed == 1, "a decoding thread that comes late finds the file closed and does no harm"


def test_a_folder_that_cannot_be_written_is_said_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(**_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(tempfile, "TemporaryFile", refused)
    with pytest.raises(PsvideoError, match="no file can be made here"), keeping_near(tmp_path / "out"):
        pass
