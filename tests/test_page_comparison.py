"""What the page shows of a clip: its frames, and plates by either method as the splitting commands write them."""

import shutil
import subprocess
import sys
from pathlib import Path

import av
import numpy as np
import OpenEXR
import pytest
from picture_file import read_picture

from psvideo.cli.app import main
from psvideo.clip.decode.decoders import decode
from psvideo.clip.folder import KINDS
from psvideo.errors import UsageError
from psvideo.page import show_of
from psvideo.page.picture import Look
from psvideo.page.show import Show, index_of

ROOT = Path(__file__).resolve().parents[1]
SCENES = ROOT / "data_synth"


@pytest.fixture(scope="module")
def shoot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a clip of a sphere, its plates by both methods, and its results."""
    folder = tmp_path_factory.mktemp("shoot")
    clip = folder / "clip"
    assert main(["synth", str(SCENES / "sphere.toml"), "-o", str(clip), "-q"]) == 0
    assert main(["split", str(clip), "-o", str(folder / "plates"), "-q"]) == 0
    assert main(["split", str(clip), "-o", str(folder / "old"), "--method", "hudon2015", "-q"]) == 0
    assert main(["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(folder / "out"), "-q"]) == 0
    return folder


def picture(show: Show, name: str, number: int) -> np.ndarray:
    sequence = show.sequence(name)
    assert sequence is not None
    return sequence.read(number, Look(width_px=show.width_px)).pixels.astype(np.float64)


def plate(folder: Path, light: str, number: int) -> np.ndarray:
    (path,) = (folder / light).glob(f"*.{number}.exr")
    channels = OpenEXR.File(str(path), separate_channels=True).channels()
    names = ["Y"] if "Y" in channels else ["R", "G", "B"]
    return np.stack([channels[name].pixels for name in names], axis=-1).astype(np.float64)


def test_results_stand_beside_the_clip_they_were_made_from(shoot: Path) -> None:
    show = show_of(shoot / "out")
    groups = {sequence.group for sequence in show.sequences}
    assert groups == {"Results", "Clip", "Plates by the rows' weights", "Plates by Algorithm 1"}
    assert show.sequences[0].id == "normals"
    assert show.sequence("frames") is not None


def test_results_stand_beside_the_movie_they_were_made_from(shoot: Path, tmp_path: Path) -> None:
    shutil.copyfile(shoot / "clip" / "plan.toml", tmp_path / "plan.toml")
    with av.open(str(tmp_path / "take.mkv"), "w") as container:
        stream = container.add_stream("ffv1", rate=100, options={"threads": "1"})
        stream.width, stream.height, stream.pix_fmt = 160, 120, "gbrp16le"
        for file in sorted((shoot / "clip" / "frames").iterdir()):
            codes = np.asarray(decode(KINDS[file.suffix], file).codes)
            colour = np.ascontiguousarray(np.broadcast_to(codes.reshape(120, 160, -1), (120, 160, 3)))
            shown = av.VideoFrame.from_ndarray(colour, format="rgb48le")
            container.mux(stream.encode(shown.reformat(format="gbrp16le")))
        container.mux(stream.encode(None))
    rig = str(shoot / "clip" / "rig.toml")
    assert main(["normals", str(tmp_path / "take.mkv"), "--rig", rig, "-o", str(tmp_path / "out"), "-q"]) == 0
    show, beside = show_of(tmp_path / "out"), show_of(shoot / "out")
    assert "Frames are those of take.mkv." in show.notes
    for name in ("frames", "normals"):
        sequence = beside.sequence(name)
        assert sequence is not None
        number = sequence.numbers[1]
        shown_at = show.sequence(name)
        assert shown_at is not None
        there = picture(show, name, shown_at.numbers[1])
        assert np.abs(there - picture(beside, name, number)).max() <= 2


@pytest.mark.parametrize("of", ["out", "clip"])
def test_before_and_after_are_the_plates_that_the_command_writes(shoot: Path, of: str) -> None:
    show = show_of(shoot / of)
    master = show.sequences[0]
    lights = [sequence for sequence in show.sequences if sequence.id.startswith("weights-")]
    apart = []
    for sequence in lights:
        light = sequence.label.split(",")[0]
        number = master.numbers[len(master.numbers) // 2]
        found = sequence.read(number, Look(width_px=show.width_px))
        after = plate(shoot / "plates", light, int(str(found.facts["round"])))
        assert np.abs(found.pixels.astype(np.float64) - after).max() < 1e-3
        before = picture(show, sequence.id.replace("weights", "hudon2015"), number)
        apart.append(np.abs(before - after).mean())
    assert len(lights) >= 3
    assert max(apart) > 0.01, "Algorithm 1 is led astray by the scene's dark rows"


@pytest.mark.parametrize("dark_every", [1, 5])
def test_beside_a_round_stand_the_plates_of_that_round(tmp_path: Path, dark_every: int) -> None:
    """Also of the last light, whose flash is nearer to the next round's first; and where few rounds have dark slots."""
    scene = (SCENES / "sphere.toml").read_text(encoding="utf-8").replace("frames = 12", "frames = 90")
    scene = scene.replace("width_px = 160\nheight_px = 120", "width_px = 40\nheight_px = 30")
    scene = scene.replace("flash_s = 0.001", f"flash_s = 0.001\ndark_every = {dark_every}")
    (tmp_path / "sphere.toml").write_text(scene)
    clip = tmp_path / "clip"
    assert main(["synth", str(tmp_path / "sphere.toml"), "-o", str(clip), "-q"]) == 0
    assert main(["split", str(clip), "-o", str(tmp_path / "plates"), "-q"]) == 0
    rig = str(clip / "rig.toml")
    assert main(["normals", str(clip), "--rig", rig, "-o", str(tmp_path / "out"), "-q"]) == 0
    for name in ("plates", "out"):
        show = show_of(tmp_path / name)
        lights = [sequence for sequence in show.sequences if sequence.id.startswith("weights-")]
        assert len(lights) == 3
        for sequence in lights:
            numbers = sequence.numbers[1:-1:4]
            assert len(numbers) > 3
            rounds = [sequence.read(number, Look(width_px=40)).facts["round"] for number in numbers]
            assert rounds == list(numbers)


def test_algorithm_1_makes_the_plates_that_the_command_writes(shoot: Path) -> None:
    show = show_of(shoot / "plates")
    compared = 0
    for sequence in show.sequences:
        light = sequence.label.split(",")[0]
        for number in sequence.numbers if sequence.id.startswith("hudon2015-") else ():
            if list((shoot / "old" / light).glob(f"*.{number}.exr")):
                found = picture(show, sequence.id, number)
                assert np.abs(found - plate(shoot / "old", light, number)).max() < 1e-3
                compared += 1
    assert compared >= 3


def test_a_clip_by_itself_shows_frames_and_finds_its_timing(shoot: Path) -> None:
    show = show_of(shoot / "clip")
    assert show.kind == "clip"
    frames = show.sequences[0]
    assert frames.id == "frames"
    assert list(np.diff(frames.times_s)) == pytest.approx([1 / show.fps] * (len(frames.numbers) - 1))
    assert show.timing is not None
    record = show.timing()
    assert record["order"] == "marker"
    assert record["first_number"] == frames.numbers[0]


def test_plates_show_every_light_and_the_ambient_last(shoot: Path) -> None:
    show = show_of(shoot / "plates")
    own = [sequence for sequence in show.sequences if sequence.group == "Plates"]
    assert own[-1].label == "ambient"
    number = own[0].numbers[0]
    assert np.array_equal(picture(show, own[0].id, number), plate(shoot / "plates", own[0].label, number))
    assert {entry["family"] for entry in index_of(show)["sequences"]} == {"camera"}  # type: ignore[attr-defined]


@pytest.mark.campaign
def test_the_pictures_of_the_documentation_can_be_taken(shoot: Path, tmp_path: Path) -> None:
    """In a process of its own: a browser may be open in this one."""
    call = [sys.executable, "-m", "bench.view_pictures", str(shoot), str(tmp_path)]
    subprocess.run(call, check=True, cwd=ROOT, capture_output=True, timeout=600)
    taken = sorted(tmp_path.glob("*.png"))
    assert [path.name for path in taken] == sorted(
        path.name for path in (ROOT / "docs" / "pictures").glob("view_*.png")
    )
    for path in taken:
        picture = read_picture(path)
        assert picture is not None
        assert picture.shape == (522, 928, 3)
        assert picture[70:280, 70:640].std() > 10, "something is shown"
        assert path.stat().st_size < 400_000


def test_a_clip_that_cannot_be_used_is_said_to_be_so(shoot: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="`clip`"):
        show_of(shoot / "clip", clip=shoot / "clip")
    shutil.copytree(shoot / "out", tmp_path / "out")
    (tmp_path / "clip").mkdir()
    (tmp_path / "clip" / "plan.toml").write_text("nonsense")
    show = show_of(tmp_path / "out")
    assert {sequence.group for sequence in show.sequences} == {"Results"}
    assert any("The clip beside this folder is not shown." in note for note in show.notes)
