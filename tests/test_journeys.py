"""Whole commands, as a user runs them: from a scene to normals, and what is said when something is wrong."""

import json
import os
import shutil
from pathlib import Path

import cv2
import numpy as np
import OpenEXR
import pytest
from angles import angles_deg
from bytes_of_files import digest, digest_of_results

from psvideo.cli.app import main
from psvideo.errors import PsvideoError

SCENES = Path(__file__).resolve().parents[1] / "data_synth"


def planes(path: Path) -> np.ndarray:
    """Return an EXR's picture, (row, col[, channel])."""
    channels = OpenEXR.File(str(path)).channels()
    picture: np.ndarray = next(iter(channels.values())).pixels if "RGB" not in channels else channels["RGB"].pixels
    return picture.astype(np.float32)


def mean_error_deg(found: np.ndarray, true: np.ndarray, where: np.ndarray) -> float:
    return float(angles_deg(found, true)[where].mean())


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clip of a sphere, as the virtual shoot leaves it."""
    folder = tmp_path_factory.mktemp("shoot") / "clip"
    assert main(["synth", str(SCENES / "sphere.toml"), "-o", str(folder), "-q"]) == 0
    return folder


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


def test_a_scene_is_filmed_and_solved_to_its_own_normals(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = digest(clip)
    out = tmp_path / "out"
    assert run("normals", clip, "--rig", clip / "rig.toml", "-o", out) == 0
    assert "This take is usable." in capsys.readouterr().out
    assert digest(clip) == before, "footage is never touched"
    true = planes(clip / "truth" / "normals.exr")
    numbers = sorted(path.name.split(".")[1] for path in (out / "normals").iterdir())
    assert len(numbers) == 2
    for number in numbers:
        valid = planes(out / "valid" / f"clip_valid.{number}.exr") > 0
        inside = valid & (planes(clip / "truth" / "mask.exr") > 0.5)
        assert inside.sum() > 0.5 * (planes(clip / "truth" / "mask.exr") > 0.5).sum()
        assert mean_error_deg(planes(out / "normals" / f"clip_normals.{number}.exr"), true, inside) < 0.5
        albedo = planes(out / "albedo" / f"clip_albedo.{number}.exr")
        assert abs(float(np.median(albedo[inside])) - 0.8) < 0.01
    assert json.loads((out / "report.json").read_text())["order"] == "marker"
    assert json.loads((out / "timing.json").read_text())["schema"] == "psvideo-timing/1"
    assert "<img" in (out / "report.html").read_text()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out"]


def test_each_command_reads_what_the_one_before_wrote(clip: Path, tmp_path: Path) -> None:
    timing, plates, out = tmp_path / "timing.json", tmp_path / "plates", tmp_path / "out"
    assert run("sync", clip, "-o", timing, "-q") == 0
    assert run("split", clip, "-o", plates, "--timing", timing, "--flashes", "-q") == 0
    assert run("normals", clip, "--rig", clip / "rig.toml", "-o", out, "--timing", timing, "-q") == 0
    found = json.loads((plates / "timing.json").read_text())["flashes"]
    truth = json.loads((clip / "truth" / "timing.json").read_text())["flashes"]
    compared = 0
    for flash, true in zip(found, truth, strict=True):
        assert abs(flash["start_s"] - true["start_s"]) < 0.05 * 0.01 / 120
        if flash.get("plate") and true.get("plate"):
            difference = planes(plates / flash["plate"]) - planes(clip / "truth" / true["plate"])
            assert np.sqrt(np.mean(difference**2)) < 0.01
            compared += 1
    assert compared >= 6
    assert (plates / "ambient").is_dir()
    assert len(list((plates / "flashes").iterdir())) == sum(flash["complete"] for flash in found)


def test_what_machines_read_is_json_and_nothing_else(clip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("sync", clip, "--json") == 0
    assert json.loads(capsys.readouterr().out)["order"] == "marker"


def test_a_part_of_a_clip_gives_the_same_plates_under_the_same_numbers(clip: Path, tmp_path: Path) -> None:
    assert run("sync", clip, "-o", tmp_path / "timing.json", "-q") == 0
    assert run("split", clip, "-o", tmp_path / "all", "--timing", tmp_path / "timing.json", "-q") == 0
    assert (
        run("split", clip, "-o", tmp_path / "part", "--timing", tmp_path / "timing.json", "--frames", "5-12", "-q") == 0
    )
    parts = [path for path in (tmp_path / "part").rglob("*.exr") if path.parent.name != "ambient"]
    assert parts
    for path in parts:
        whole = planes(tmp_path / "all" / path.relative_to(tmp_path / "part"))
        assert np.abs(planes(path) - whole).max() < 0.01


def test_a_stopped_run_goes_on_where_it_stopped_and_only_as_it_began(
    clip: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    whole, out = tmp_path / "whole", tmp_path / "out"
    command = ("normals", clip, "--rig", clip / "rig.toml", "-q", "-o")
    assert run(*command, whole) == 0

    def stop(*_: object) -> None:
        raise PsvideoError("the power went off")

    with monkeypatch.context() as patched:
        patched.setattr("psvideo.runs.instants.results.write_text", stop)
        assert run(*command, out) == 1
    assert not out.exists()
    kept = sorted((tmp_path / ".out.partial" / "albedo").iterdir())
    kept[0].unlink()
    before = kept[1].stat().st_mtime_ns
    assert run(*command, out, "--resume", "--y", "down") == 2
    assert "had other settings" in capsys.readouterr().err
    assert run(*command, out, "--resume") == 0
    reports = [json.loads((folder / "report.json").read_text()) for folder in (out, whole)]
    commands = [report["settings"].pop("Command") for report in reports]
    assert commands[0] == commands[1].replace(str(whole), str(out)) + " --resume"
    assert reports[0] == reports[1]
    assert digest_of_results(out) == digest_of_results(whole)
    assert (out / "albedo" / kept[1].name).stat().st_mtime_ns == before, "what was whole is not written again"


@pytest.mark.parametrize("options", [(), ("--align", "flow")], ids=" ".join)
def test_results_may_be_numbered_from_nought(options: tuple[str, ...], clip: Path, tmp_path: Path) -> None:
    for first in ("0", "1001"):
        command = ("normals", clip, "--rig", clip / "rig.toml", "-q", "--no-preview", *options)
        assert run(*command, "--start-number", first, "-o", tmp_path / first) == 0
    files = [sorted((tmp_path / first / "normals").iterdir()) for first in ("0", "1001")]
    numbers = [[int(file.name.split(".")[-2]) for file in some] for some in files]
    assert [number + 1001 for number in numbers[0]] == numbers[1]
    for one, other in zip(*files, strict=True):
        assert np.array_equal(planes(one), planes(other))


def test_resume_begins_where_nothing_was_begun_and_says_when_all_is_done(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy, out = spoilt(clip, tmp_path), tmp_path / "out"
    command = ("split", copy, "-q", "-o", out, "--resume")
    assert run(*command) == 0
    before = digest(out)
    capsys.readouterr()
    assert run(*command) == 0
    assert "all done" in capsys.readouterr().err
    assert run(*command, "--start-number", "5") == 2
    assert "exists already" in capsys.readouterr().err
    assert digest(out) == before
    frame = a_frame(copy)
    os.utime(frame, ns=(0, frame.stat().st_mtime_ns + 10**9))
    assert run(*command) == 2, "other footage"
    assert run(*command, "--force") == 0


def test_force_replaces_results_and_never_footage(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = spoilt(clip, tmp_path)
    before = digest(copy)
    rig = ("--rig", copy / "rig.toml", "-q", "--force")
    shoot = ("--camera", "Sony F65", "--fps", "120", "--flash", "1ms")
    assert run("normals", copy, *rig, "-o", copy) == 2
    assert run("normals", copy, *rig, "-o", copy / "frames") == 2
    assert run("split", copy, "-q", "--force", "-o", copy / "frames") == 2
    assert run("sync", copy, "-q", "--force", "-o", a_frame(copy)) == 2
    assert run("sync", copy, "-q", "--force", "-o", copy / "plan.toml") == 2
    assert run("capture-plan", *shoot, "-q", "--force", "-o", a_frame(copy)) == 2
    assert capsys.readouterr().err.count("not replaced, not even with --force") == 6
    assert digest(copy) == before
    out = tmp_path / "out"
    assert run("normals", copy, *rig, "-o", out) == 0
    assert run("normals", copy, *rig, "-o", out) == 0


def test_still_photographs_one_per_light_are_a_synced_clip(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    directions = np.array([[0.5, 0.0, 0.866], [-0.25, 0.433, 0.866], [-0.25, -0.433, 0.866], [0.0, 0.0, 1.0]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    normals = rng.standard_normal((20, 30, 3)) * [0.15, 0.15, 0] + [0, 0, 1]
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    stills = tmp_path / "stills"
    stills.mkdir()
    for number, direction in enumerate(directions):
        light = 0.7 * np.clip(normals @ direction, 0, None)
        cv2.imwrite(str(stills / f"shot_{number:02d}.png"), (65535 * light).astype(np.uint16))
    flashes = "".join(f'[[strobe.flash]]\nlights = {{ "L{n}" = 1.0 }}\n' for n in range(4))
    (stills / "plan.toml").write_text(
        'schema = "psvideo-plan/1"\n[camera]\nwidth_px = 30\nheight_px = 20\nfps = 1\n[strobe]\nmode = "synced"\n'
        + flashes
    )
    rig = tmp_path / "lights.txt"
    rig.write_text("4\n" + "\n".join(" ".join(map(str, direction)) for direction in directions))
    out = tmp_path / "out"
    assert run("normals", stills, "--rig", rig, "-o", out, "--float", "-q") == 0
    found = planes(out / "normals" / "stills_normals.1001.exr")
    assert mean_error_deg(found, normals, np.ones((20, 30), np.bool_)) < 0.01


@pytest.mark.parametrize("small", [True, pytest.param(False, marks=pytest.mark.campaign)])
def test_the_demo_ends_with_the_path_of_its_picture(
    small: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = (SCENES / "bust.toml").read_text()
    for whole, part in (("width_px = 640", "320"), ("height_px = 360", "180"), ("frames = 60", "26")):
        assert whole in scene
        scene = scene.replace(whole, f"{whole.split()[0]} = {part}")
    (tmp_path / "small.toml").write_text(scene)
    if small:
        monkeypatch.setattr("psvideo.runs.demo.builtin_scene", lambda: tmp_path / "small.toml")
    assert run("demo", "-o", tmp_path / "demo") == 0
    last = capsys.readouterr().out.strip().splitlines()[-1]
    picture = cv2.imread(last)
    assert picture is not None
    assert picture.shape[1] == 1600
    assert float(picture.std()) > 30


Spoil = dict[str, tuple[str, str]]
FIRST = "frames/sphere.0003.png"


def spoilt(clip: Path, tmp_path: Path) -> Path:
    copy = tmp_path / "clip"
    shutil.copytree(clip, copy)
    shutil.rmtree(copy / "truth")
    return copy


def a_frame(folder: Path, place: int = 3) -> Path:
    return sorted((folder / "frames").iterdir())[place]


def test_a_truncated_frame_is_named_and_nothing_is_written(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = spoilt(clip, tmp_path)
    frame = a_frame(copy)
    frame.write_bytes(frame.read_bytes()[:2000])
    assert run("normals", copy, "--rig", copy / "rig.toml", "-o", tmp_path / "out") == 1
    reported = capsys.readouterr().err
    assert frame.name in reported
    assert "Traceback" not in reported
    assert not (tmp_path / "out").exists()


def test_a_frame_of_another_size_is_named(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = spoilt(clip, tmp_path)
    frame = a_frame(copy)
    cv2.imwrite(str(frame), np.zeros((50, 60, 3), np.uint16))
    assert run("sync", copy) == 1
    assert frame.name in capsys.readouterr().err


def test_a_missing_frame_is_a_dropped_frame_that_is_reported_and_marked(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = spoilt(clip, tmp_path)
    a_frame(copy, 5).unlink()
    assert run("normals", copy, "--rig", copy / "rig.toml", "-o", tmp_path / "out") == 0
    captured = capsys.readouterr()
    assert "missing after number" in captured.out
    assert "usable, with reservations" in captured.out
    timing = json.loads((tmp_path / "out" / "timing.json").read_text())
    assert [hole["count"] for hole in timing["dropped_frames"]] == [1]
    shares = [planes(path).mean() for path in sorted((tmp_path / "out" / "valid").iterdir())]
    assert min(shares) < max(shares) or min(shares) < 0.5


BROKEN = {
    "no clip": (["sync", "{tmp}/none"], 1, "there is no such clip"),
    "a timing by another ending": (["sync", "{clip}", "-o", "{tmp}/t.txt"], 2, "such as"),
    "a page by another ending": (["view", "{clip}", "--export", "{tmp}/page.txt"], 2, "page.html"),
    "an output that exists": (["sync", "{clip}", "-o", "{clip}/plan.toml"], 2, "exists already"),
    "a rig without a light of the plan": (
        ["normals", "{clip}", "--rig", "{tmp}/rig.toml", "-o", "{tmp}/o"],
        1,
        "no light named",
    ),
    "a rig that is a plan": (
        ["normals", "{clip}", "--rig", "{clip}/plan.toml", "-o", "{tmp}/o"],
        1,
        "another kind of file",
    ),
    "no rig": (["normals", "{clip}", "--rig", "{tmp}/nope.toml", "-o", "{tmp}/o"], 1, "there is no such file"),
    "an unknown option": (["sync", "{clip}", "--frobnicate"], 2, "frobnicate"),
    "an unknown command": (["frobnicate"], 2, "frobnicate"),
    "a range that is none": (["sync", "{clip}", "--frames", "abc"], 2, "--frames"),
    "a range outside": (["sync", "{clip}", "--frames", "900-910"], 2, "--frames"),
    "too few frames": (["split", "{clip}", "-o", "{tmp}/o", "--frames", "1-2"], 1, "needs at least"),
    "an unknown first light": (["sync", "{clip}", "--first-light", "lamp"], 2, "lamp"),
    "a plan with an unknown key": (["sync", "{clip}", "--plan", "{tmp}/plan.toml"], 1, "did you mean"),
    "a mask of another size": (
        ["normals", "{clip}", "--rig", "{clip}/rig.toml", "--mask", "{tmp}/mask.png", "-o", "{tmp}/o"],
        1,
        "the mask is 3 x 2 pixels",
    ),
    "world space without a camera": (
        ["normals", "{clip}", "--rig", "{clip}/rig.toml", "-o", "{tmp}/o", "--space", "world"],
        2,
        "--camera-to-world",
    ),
    "a scene that is none": (["synth", "{tmp}/rig.toml", "-o", "{tmp}/o"], 1, "rig.toml"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_mistake_is_reported_in_one_paragraph(
    case: str, clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rig.toml").write_text(
        'schema = "psvideo-rig/1"\n[[light]]\nname = "other"\ndirection = [0.0, 0.0, 1.0]\n'
    )
    (tmp_path / "plan.toml").write_text((clip / "plan.toml").read_text().replace("dark_s", "dark"))
    cv2.imwrite(str(tmp_path / "mask.png"), np.full((2, 3), 255, np.uint8))
    arguments, status, words = BROKEN[case]
    assert main([word.format(clip=clip, tmp=tmp_path) for word in arguments]) == status
    reported = capsys.readouterr().err
    assert words in reported
    assert "Traceback" not in reported
    assert reported.count("psvideo: ") <= 1
    assert not (tmp_path / "o").exists()


def test_nearly_coplanar_lights_are_refused_with_their_condition(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = (clip / "rig.toml").read_text()
    lights = 'schema = "psvideo-rig/1"\n'
    for name, direction in {"key": "[0.6, 0.0, 0.8]", "left": "[-0.6, 0.0, 0.8]", "top": "[0.0, 0.0, 1.0]"}.items():
        assert f'"{name}"' in rig
        lights += f'[[light]]\nname = "{name}"\ndirection = {direction}\n'
    (tmp_path / "rig.toml").write_text(lights)
    assert run("normals", clip, "--rig", tmp_path / "rig.toml", "-o", tmp_path / "out") == 1
    assert "condition" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_lights_that_always_flash_together_are_refused(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = spoilt(clip, tmp_path)
    plan = (copy / "plan.toml").read_text().replace("{left = 1.0}", "{left = 1.0, key = 1.0}")
    (copy / "plan.toml").write_text(plan.replace("{key = 1.0}", "{key = 1.0, left = 1.0}"))
    assert run("normals", copy, "--rig", copy / "rig.toml", "-o", tmp_path / "out") == 1
    reported = capsys.readouterr().err
    assert "cannot separate the lights key, left" in reported


def test_a_timing_of_other_footage_is_refused(clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    timing = tmp_path / "timing.json"
    assert run("sync", clip, "-o", timing, "-q") == 0
    record = json.loads(timing.read_text())
    for change in ({"clip": "other"}, {"frame_period_s": 0.02}, {"flashes": record["flashes"][1:]}):
        timing.write_text(json.dumps(record | change))
        assert run("split", clip, "--timing", timing, "-o", tmp_path / "out", "-q") == 1
        assert str(timing) in capsys.readouterr().err


def test_frames_taken_in_steps_are_called_what_they_are(
    clip: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("sync", clip, "-o", tmp_path / "timing.json", "-q") == 0
    given = ("--timing", tmp_path / "timing.json", "--frames", "1-12x2")
    assert run("normals", clip, "--rig", clip / "rig.toml", "-o", tmp_path / "out", *given) == 0
    reported = capsys.readouterr()
    assert "usable." not in reported.out.replace("not usable", "")
    assert "seen by no frame" in reported.err
