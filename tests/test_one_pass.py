"""Every frame of a clip is decoded once, whatever is known of its timing, and what is done with is let go."""

import collections
import contextlib
import shutil
import weakref
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import tifffile
from bytes_of_files import digest

from psvideo.cli.app import main
from psvideo.clip import kept, reading
from psvideo.clip.decode import tiff
from psvideo.clip.decode.decoders import decode
from psvideo.clip.decoded import CodedPicture
from psvideo.report.observe.observed import Observed
from psvideo.runs.instants import solving as runs
from psvideo.solve.instants import surfaces

SCENES = Path(__file__).resolve().parents[1] / "data_synth"


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("shoot") / "clip"
    assert run("synth", SCENES / "sphere.toml", "-o", folder, "-q") == 0
    return folder


@pytest.fixture(scope="module")
def timing(clip: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("sync") / "timing.json"
    assert run("sync", clip, "-o", file, "-q") == 0
    return file


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


@pytest.fixture
def decoded(monkeypatch: pytest.MonkeyPatch) -> collections.Counter[str]:
    """How often each file was decoded since the test began."""
    count: collections.Counter[str] = collections.Counter()

    def counted(kind: str, file: Path, **_: bool) -> CodedPicture:
        count.update([file.name])
        return decode(kind, file)

    monkeypatch.setattr(reading, "opened", counted)
    return count


def pictures(folder: Path) -> dict[str, str]:
    return {name: one for name, one in digest(folder).items() if name.endswith(".exr")}


@pytest.mark.parametrize("known", [False, True], ids=["timing found", "timing given"])
@pytest.mark.parametrize("command", ["split", "normals"])
def test_every_frame_is_decoded_once(
    clip: Path, timing: Path, decoded: collections.Counter[str], tmp_path: Path, command: str, known: bool
) -> None:
    given = ("--timing", timing) if known else ()
    rig = ("--rig", clip / "rig.toml") if command == "normals" else ()
    assert run(command, clip, *rig, "-o", tmp_path / "out", *given, "-q") == 0
    assert set(decoded) == {path.name for path in (clip / "frames").iterdir()}
    assert set(decoded.values()) == {1}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_without_room_frames_are_decoded_again_with_the_same_result_and_that_is_said(
    clip: Path,
    decoded: collections.Counter[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run("split", clip, "-o", tmp_path / "roomy", "-v") == 0
    frames = len(list((clip / "frames").iterdir()))
    assert f"{frames} decoded frames (" in capsys.readouterr().err
    decoded.clear()
    monkeypatch.setattr(kept, "SHARE_OF_FREE_SPACE", 0.0)
    assert run("split", clip, "-o", tmp_path / "tight") == 0
    assert set(decoded.values()) <= {2, 3}
    assert "were decoded again" in capsys.readouterr().err
    assert pictures(tmp_path / "tight") == pictures(tmp_path / "roomy") != {}


@pytest.mark.parametrize("end", [KeyboardInterrupt, RuntimeError])
def test_a_run_that_is_stopped_leaves_no_decoded_frames_behind(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, end: type[BaseException]
) -> None:
    stores: list[kept.Kept] = []
    made = kept.Kept.__init__

    def remembered(self: kept.Kept, *given: Any, **named: Any) -> None:
        stores.append(self)
        made(self, *given, **named)

    def stop(*_: object) -> None:
        assert len(stores[0]) > 0
        raise end

    monkeypatch.setattr(kept.Kept, "__init__", remembered)
    monkeypatch.setattr(Observed, "add", stop)
    with contextlib.suppress(RuntimeError):
        assert run("normals", clip, "--rig", clip / "rig.toml", "-o", tmp_path / "out", "-q") == 1
    assert [path.name for path in tmp_path.iterdir()] == [".out.partial"], "what --resume goes on with, and no more"
    assert len(stores[0]) == 0
    with pytest.raises(ValueError, match="closed"):
        stores[0]._file.tell()


@pytest.mark.parametrize("align", ["none", "auto", "flow"])
def test_plates_are_let_go_while_their_surface_waits_to_be_written(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, align: str
) -> None:
    plates: list[weakref.ref[Any]] = []
    jobs: list[Callable[[], None]] = []
    alive: list[int] = []

    def watched(*given: Any, **named: Any) -> Iterator[Any]:
        for instant in surfaces(*given, **named):
            alive.append(sum(plate() is not None for plate in plates))
            plates.extend(weakref.ref(plate.image) for plate in instant.round.plates)
            yield instant
            del instant

    @contextlib.contextmanager
    def never_written(**_: int) -> Iterator[Callable[[Callable[[], None]], None]]:
        yield jobs.append

    monkeypatch.setattr(runs, "surfaces", watched)
    monkeypatch.setattr(runs, "writing", never_written)
    assert run("normals", clip, "--rig", clip / "rig.toml", "-o", tmp_path / "out", "--align", align, "-q") == 0
    assert len(jobs) == len(alive) == 2
    assert alive == [0, 0]
    assert not any(plate() is not None for plate in plates)


def test_frames_that_stay_in_their_files_give_the_same_bytes(
    clip: Path, timing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Rows are read again for every step that wants them."""
    plain, results = tmp_path / "clip", []
    (plain / "frames").mkdir(parents=True)
    for name in ("plan.toml", "rig.toml"):
        shutil.copy(clip / name, plain)
    for file in (clip / "frames").iterdir():
        tifffile.imwrite(plain / "frames" / f"{file.stem}.tif", decode(file.suffix[1:], file).codes)
    whole = ("normals", plain, "--rig", plain / "rig.toml", "--timing", timing, "-q")
    for name, from_bytes in (("memory", 1 << 30), ("files", 1)):
        monkeypatch.setattr(tiff, "OF_CLIP_STAYS_FROM_BYTES", from_bytes)
        assert run(*whole, "-o", tmp_path / name, "--align", "flow", "--aov", "error") == 0
        results.append(pictures(tmp_path / name))
    assert results[0] == results[1] != {}


def test_kept_frames_that_stay_in_their_file_give_the_same_bytes(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Decoded for their timing, and read row by row for plates."""
    results = []
    for name, from_bytes in (("memory", 1 << 30), ("file", 1)):
        monkeypatch.setattr(kept, "STAYS_FROM_BYTES", from_bytes)
        assert run("normals", clip, "--rig", clip / "rig.toml", "-o", tmp_path / name, "-q", "--no-preview") == 0
        results.append(pictures(tmp_path / name))
    assert results[0] == results[1] != {}
