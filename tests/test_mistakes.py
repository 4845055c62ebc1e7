"""Mistakes that new users make: each is answered in one paragraph that says what to do, and nothing is lost."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from psvideo.cli.app import main
from psvideo.clip import read_mask
from psvideo.formats.whole_files import PICTURE_MARK, marked_png

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mistakes") / "clip"
    assert main(["synth", str(ROOT / "data_synth/sphere.toml"), "-o", str(folder), "-q"]) == 0
    return folder


def reported(capsys: pytest.CaptureFixture[str], *words: object, status: int) -> str:
    """Return what a command says that must end with ``status``."""
    assert main([str(word) for word in words]) == status
    said = capsys.readouterr().err
    assert "Traceback" not in said
    return " ".join(said.split())


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["sync", "{clip}", "--plan", "{clip}"], "plan.toml"),
        (["strobe", "check", "{clip}"], "plan.toml"),
        (["calibrate", "convert", "{clip}", "-o", "{other}/lights.lp"], "rig.toml"),
        (["calibrate", "flat-field", "{clip}", "--rig", "{clip}", "-o", "{other}/rig.toml"], "rig.toml"),
    ],
)
def test_a_folder_where_a_file_is_meant_names_the_files_of_that_kind_in_it(
    words: list[str], meant: str, clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = reported(capsys, *(word.format(clip=clip, other=tmp_path) for word in words), status=1)
    assert said.endswith(f"{clip}: is a folder, and a file is expected. Name the file in it: {clip / meant}.")


@pytest.mark.parametrize("command", ["sync", "normals", "info"])
def test_a_frame_that_is_a_link_to_nothing_is_named_with_what_it_should_lead_to(
    command: str, clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(clip, tmp_path / "clip", ignore=shutil.ignore_patterns("truth"))
    frame = tmp_path / "clip" / "frames" / "sphere.0006.png"
    frame.unlink()
    frame.symlink_to(tmp_path / "disk" / "a.png")
    out = [] if command == "info" else ["-o", tmp_path / "out.json"]
    assert main([command, str(tmp_path / "clip"), *map(str, out)]) == 1
    told = capsys.readouterr()
    said = " ".join((told.out if command == "info" else told.err).split())
    assert f"{frame}: is a link to {tmp_path / 'disk' / 'a.png'}, which is not there. Put the file itself" in said


@pytest.mark.parametrize(
    ("found", "written", "expected"),
    [
        ("fps = 100", "fps = true", "key 'camera.fps' is True: expected a whole number or a number or text."),
        (
            "readout_s = 0.01",
            'readout_s = "often"',
            "key 'camera.readout_s' is 'often': expected a number or 'unknown'.",
        ),
        ("width_px = 160", 'width_px = "160"', "key 'camera.width_px' is '160': expected a whole number."),
        ('mode = "rolling"', 'mode = "roling"', "key 'strobe.mode' is 'roling': expected 'rolling', 'half-rate' or"),
    ],
)
def test_a_wrong_value_in_a_plan_is_reported_once_with_all_that_it_may_be(
    found: str, written: str, expected: str, clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (clip / "plan.toml").read_text()
    assert found in text
    (tmp_path / "plan.toml").write_text(text.replace(found, written))
    said = reported(capsys, "sync", clip, "--plan", tmp_path / "plan.toml", status=1)
    assert expected in said
    assert said.count("key '") == 1


@pytest.mark.parametrize("mode", ["1", "P", "L", "RGB", "RGBA", "LA", "I;16"])
def test_a_mask_may_be_saved_in_any_of_the_ways_in_which_painting_programs_save(mode: str, tmp_path: Path) -> None:
    white = np.zeros((6, 8), np.uint8)
    white[2:4, 3:6] = 255
    if mode == "I;16":
        cv2.imwrite(str(tmp_path / "mask.png"), white.astype(np.uint16) * 257)
    else:
        Image.fromarray(white).convert(mode).save(tmp_path / "mask.png")
    assert np.array_equal(read_mask(tmp_path / "mask.png", width_px=8, height_px=6), white > 0)


PLAN = ("capture-plan", "--camera", "Sony F65", "--fps", "120", "--flash", "0.8ms", "-q", "--force")


@pytest.mark.parametrize("name", ["diagram.png", "diagram.svg"])
def test_force_replaces_a_diagram_that_psvideo_drew_and_no_other_picture(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture, plan = tmp_path / name, tmp_path / "plan.toml"
    theirs = cv2.imencode(".png", np.zeros((9, 9, 3), np.uint8))[1].tobytes()
    picture.write_bytes(theirs)
    assert "not replaced" in reported(capsys, *PLAN, "-o", plan, "--diagram", picture, status=2)
    assert picture.read_bytes() == theirs
    assert not plan.exists()
    picture.unlink()
    reported(capsys, *PLAN, "-o", plan, "--diagram", picture, status=0)
    reported(capsys, *PLAN, "-o", plan, "--diagram", picture, status=0)


def test_force_replaces_no_picture_of_the_crew_beside_a_rig_or_a_timing(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    theirs = tmp_path / "rig.png"
    cv2.imwrite(str(theirs), np.zeros((9, 9, 3), np.uint8))
    before = theirs.read_bytes()
    for words in (
        ("sync", clip, "--picture", theirs),
        ("calibrate", "matte-sphere", clip, "-o", tmp_path / "rig.toml"),
    ):
        assert "not replaced" in reported(capsys, *words, "--force", "-q", status=2)
    assert theirs.read_bytes() == before


def test_a_marked_png_is_a_png_with_the_same_pixels() -> None:
    pixels = np.random.default_rng(1).integers(0, 256, (7, 5, 3), dtype=np.uint8)
    marked = marked_png(cv2.imencode(".png", pixels)[1].tobytes())
    read = cv2.imdecode(np.frombuffer(marked, np.uint8), cv2.IMREAD_COLOR)
    assert read is not None
    assert np.array_equal(read, pixels)
    assert PICTURE_MARK.encode() in marked[:80]


def test_a_picture_of_timing_is_a_png(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "such as" in reported(capsys, "sync", clip, "--picture", tmp_path / "timing.jpg", status=2)
    assert not (tmp_path / "timing.jpg").exists()


def test_a_board_that_is_not_in_the_table_hears_what_usual_boards_have(
    clip: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "Uno" in reported(capsys, "strobe", "check", clip / "plan.toml", "--board", "uno", status=2)


def test_what_to_distrust_in_the_timing_is_reported_by_the_commands_that_find_it_for_themselves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = (ROOT / "data_synth/sphere.toml").read_text()
    scene = scene.replace("fps = 100\n", 'fps = "100000/1001"\n').replace(
        "clock_offset_ppm = 40.0", "clock_offset_ppm = 0.0"
    )
    (tmp_path / "scene.toml").write_text(scene.replace("frames = 12", "frames = 30") + "\n[plan]\nfps = 100\n")
    clip = tmp_path / "clip"
    assert main(["synth", str(tmp_path / "scene.toml"), "-o", str(clip), "-q"]) == 0
    capsys.readouterr()
    said = reported(capsys, "split", clip, "-o", tmp_path / "plates", status=0)
    assert "which is what a frame rate misnamed by 1.001 looks like" in said
