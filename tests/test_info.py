"""psvideo info: every kind of file is known for what it is, and what does not fit is said with exit status 1."""

import dataclasses
import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import imagecodecs
import numpy as np
import OpenEXR
import pytest
import typer
from typer.testing import CliRunner

from psvideo.cli.commands.info import info
from psvideo.errors import PsvideoError
from psvideo.export.sequences.tags import Tags
from psvideo.formats.exr_files import write_exr
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.timing_json import format_timing
from psvideo.inspect.about_clip import level
from psvideo.inspect.about_plan import length_finding
from psvideo.inspect.describe import describe
from psvideo.inspect.findings import Description
from psvideo.model.camera import Camera, Encoding
from psvideo.model.plan import Plan, PlannedFlash, assemble_plan
from psvideo.model.rig import Light, Rig
from psvideo.model.timing import DroppedFrames, Flash, Timing

ROWS, COLS = 12, 16
LIGHTS = ("key", "left", "right")


@pytest.fixture
def plan(make_plan: Callable[..., Plan]) -> Plan:
    return make_plan(width_px=COLS, height_px=ROWS, lights=LIGHTS)


def put_frames(folder: Path, numbers: range, *, rows: int = ROWS, dtype: Any = np.uint16, share: float = 0.5) -> None:
    codes = np.full((rows, COLS, 3), share * np.iinfo(dtype).max, dtype)
    folder.mkdir(parents=True, exist_ok=True)
    for number in numbers:
        (folder / f"shot.{number:04d}.png").write_bytes(imagecodecs.png_encode(codes))


def put_plan(folder: Path, plan: Plan, **encoding: Any) -> Path:
    camera = dataclasses.replace(plan.camera, encoding=Encoding(**encoding))
    (folder / "plan.toml").write_text(format_plan(dataclasses.replace(plan, camera=camera)))
    return folder / "plan.toml"


def put_rig(folder: Path, names: tuple[str, ...]) -> Path:
    lights = tuple(Light(name=name, direction=(0.0, 0.6, 0.8)) for name in names)
    (folder / "rig.toml").write_text(format_rig(Rig(lights=lights)))
    return folder / "rig.toml"


@pytest.fixture
def shot(tmp_path: Path, plan: Plan) -> Path:
    put_frames(tmp_path / "shot" / "frames", range(1, 41))
    put_plan(tmp_path / "shot", plan)
    put_rig(tmp_path / "shot", LIGHTS)
    return tmp_path / "shot"


def lines(found: Description, level: str) -> str:
    return "\n".join(finding.text for finding in found.findings if finding.level == level)


def test_a_clip_that_fits_says_so(shot: Path) -> None:
    found = describe(shot)
    assert (found.kind, found.fits) == ("clip folder", True)
    assert {finding.level for finding in found.findings} == {"ok"}
    said = lines(found, "ok")
    for part in ("40 frames, numbered 1 to 40: png, 16 x 12 pixels", "9 whole rounds", "has the plan's 3 lights"):
        assert part in said
    assert found.facts["frames"] == 40


def test_the_rounds_of_a_clip_are_counted_by_its_plan(shot: Path, plan: Plan) -> None:
    """40 frames of 1001/120000 s, and four flashes a round, each with its dark time."""
    round_s = sum(flash.duration_s + plan.dark_s for flash in plan.flashes)
    expected = int(40 * 1001 / 120000 / round_s)
    assert f"{expected} whole round" in lines(describe(shot), "ok")


def no_change(shot: Path, plan: Plan) -> None:
    pass


def keep_two_frames(shot: Path, plan: Plan) -> None:
    for n in range(3, 41):
        (shot / f"frames/shot.{n:04d}.png").unlink()


FAULTS: dict[str, tuple[Callable[[Path, Plan], Any], str]] = {
    "size": (lambda shot, plan: put_frames(shot / "frames", range(1, 41), rows=9), "is 16 x 9 pixels, and"),
    "one frame's size": (
        lambda shot, plan: put_frames(shot / "frames", range(7, 8), rows=9),
        r"shot.0007.png: is 16 x 9",
    ),
    "one frame's depth": (lambda shot, plan: put_frames(shot / "frames", range(7, 8), dtype=np.uint8), "8 bits"),
    "an empty frame": (lambda shot, plan: (shot / "frames/shot.0009.png").write_bytes(b""), "shot.0009.png: is empty"),
    "too short": (keep_two_frames, "too short"),
    "no plan": (lambda shot, plan: (shot / "plan.toml").unlink(), "there is no plan.toml"),
    "a bad plan": (lambda shot, plan: (shot / "plan.toml").write_text("schema ="), "not a TOML file"),
    "a light not in the rig": (
        lambda shot, plan: put_rig(shot, ("key", "left")),
        "rig.toml: The rig has no light named 'right'",
    ),
    "levels": (lambda shot, plan: put_plan(shot, plan, transfer="logc3", white_level=20), "not brighter than"),
    "colour filters": (lambda shot, plan: put_plan(shot, plan, cfa="RGGB"), "is a colour picture"),
    "curve": (lambda shot, plan: put_plan(shot, plan, transfer="filmlook"), "not a curve that this psvideo knows"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_what_does_not_fit_is_a_fault(shot: Path, plan: Plan, name: str) -> None:
    spoil, message = FAULTS[name]
    spoil(shot, plan)
    found = describe(shot)
    assert not found.fits
    assert message in lines(found, "FAULT")


WARNINGS: dict[str, tuple[Callable[[Path, Plan], Any], str]] = {
    "dropped frames": (lambda shot, plan: (shot / "frames/shot.0017.png").unlink(), "1 frame dropped: 1 after 16"),
    "saturation": (
        lambda shot, plan: put_frames(shot / "frames", range(1, 41), share=1.0),
        "100.0% of the pixels are saturated",
    ),
    "12 bits read as 16": (
        lambda shot, plan: put_frames(shot / "frames", range(1, 41), share=0.03),
        "white_level is not counted",
    ),
    "white level too low": (lambda shot, plan: put_plan(shot, plan, white_level=4095), "does not fit the files' codes"),
    "no marker": (
        lambda shot, plan: put_plan(shot, dataclasses.replace(plan, flashes=plan.flashes[:3])),
        "their names are a guess: give `first_light`",
    ),
    "short dark time": (
        lambda shot, plan: put_plan(shot, dataclasses.replace(plan, dark_s=0.9 * plan.dark_s)),
        "is shorter than the exposure",
    ),
    "a light that is never lit": (lambda shot, plan: put_rig(shot, (*LIGHTS, "rim")), "does not flash: rim"),
}


def test_what_is_said_of_lights_is_true_of_these_lights(tmp_path: Path, shot: Path, plan: Plan) -> None:
    near = tuple(Light(name=name, position_m=(x, 0.1, 0.2)) for name, x in zip("abc", (-1.0, 0.0, 1.0), strict=True))
    for lights, said in (
        (near, "near, with positions"),
        ((*near, Light(name="d", direction=(0.0, 0.6, 0.8))), "3 of them near, with positions; the others distant"),
    ):
        (tmp_path / "near.toml").write_text(format_rig(Rig(lights=lights)))
        told = lines(describe(tmp_path / "near.toml"), "ok")
        assert said in told
        assert ("distant" in told) == (len(lights) > 3)
    one = dataclasses.replace(plan, flashes=tuple(dataclasses.replace(plan.flashes[0]) for _ in range(2)))
    put_plan(shot, one)
    assert "names are a guess" not in lines(describe(shot / "plan.toml"), "warn")


def test_pictures_that_show_no_light_are_all_counted(tmp_path: Path) -> None:
    put_frames(tmp_path, range(1, 6))
    for name in "wxyz":
        (tmp_path / f"{name}_mask.png").write_bytes((tmp_path / "shot.0001.png").read_bytes())
    told = lines(describe(tmp_path), "ok")
    assert "w_mask.png, x_mask.png, y_mask.png and 1 more show no light" in told


@pytest.mark.parametrize("name", WARNINGS)
def test_what_may_cost_accuracy_is_a_warning(shot: Path, plan: Plan, name: str) -> None:
    spoil, message = WARNINGS[name]
    spoil(shot, plan)
    found = describe(shot)
    assert found.fits
    assert message in lines(found, "warn")


def test_a_white_level_of_other_files_is_said_once_and_not_that_the_picture_may_be_very_dark_as_well(
    shot: Path, plan: Plan
) -> None:
    put_frames(shot / "frames", range(1, 41), dtype=np.uint8)
    put_plan(shot, plan, white_level=65535)
    told = lines(describe(shot), "warn")
    assert "white_level is 65535 in the plan, and the largest code of these 8-bit files is 255" in told
    assert "dark" not in told


@pytest.mark.parametrize(
    ("frames", "level", "message"), [(8, "ok", "2 whole rounds"), (9, "warn", "1 frame "), (3, "FAULT", "1 are")]
)
def test_a_synced_clip_has_one_frame_per_flash(
    tmp_path: Path, plan: Plan, frames: int, level: str, message: str
) -> None:
    put_frames(tmp_path, range(frames))
    put_plan(tmp_path, dataclasses.replace(plan, mode="synced"))
    assert message in lines(describe(tmp_path), level)


def test_plan_and_rig_files_are_known_by_their_schema(shot: Path) -> None:
    assert describe(shot / "plan.toml").kind == "plan"
    assert "lights key, left, right" in lines(describe(shot / "plan.toml"), "ok")
    assert describe(shot / "rig.toml").kind == "rig"
    assert "3 lights: key, left, right" in lines(describe(shot / "rig.toml"), "ok")
    renamed = (shot / "plan.toml").rename(shot / "monday.toml")
    assert describe(renamed).kind == "plan"


def make_timing(**changes: Any) -> Timing:
    flash = Flash(
        index=0, slot=0, lights={"key": 1.0}, start_s=0.0, duration_s=8e-4, complete=True, plate="key/a.1001.exr"
    )
    timing = Timing(
        clip="shot",
        frame_period_s=0.01,
        exposure_s=0.01,
        row_time_s=1e-5,
        clock_offset_ppm=12.0,
        phase_error_rows=0.01,
        order="marker",
        flashes=(flash, dataclasses.replace(flash, index=1, complete=False, plate=None)),
    )
    return dataclasses.replace(timing, **changes)


def test_a_timing_says_how_sure_it_is(tmp_path: Path) -> None:
    (tmp_path / "timing.json").write_text(format_timing(make_timing()))
    found = describe(tmp_path / "timing.json")
    assert (found.kind, found.facts["flashes"], found.facts["complete"]) == ("timing", 2, 1)
    assert "found by marker" in lines(found, "ok")
    (tmp_path / "given.json").write_text(format_timing(make_timing(order="given")))
    assert "the order of the lights was given" in lines(describe(tmp_path / "given.json"), "ok")
    doubtful = make_timing(order="guess", clock_offset_ppm=-1003.0, dropped_frames=(DroppedFrames(after=16, count=2),))
    (tmp_path / "timing.json").write_text(format_timing(doubtful))
    said = lines(describe(tmp_path / "timing.json"), "warn")
    for part in ("is a guess", "misnamed by 1000/1001", "2 frames dropped, after 16"):
        assert part in said


def put_exr(file: Path, names: str = "RGB") -> None:
    file.parent.mkdir(parents=True, exist_ok=True)
    header = {
        "type": OpenEXR.scanlineimage,
        "psvideo:space": "camera",
        "psvideo:time_s": 1.25,
        "framesPerSecond": Fraction(30000, 1001),
    }
    OpenEXR.File(header, {name: np.zeros((ROWS, COLS), np.float16) for name in names}).write(str(file))


def test_an_exr_shows_its_attributes(tmp_path: Path) -> None:
    put_exr(tmp_path / "a.1001.exr")
    found = describe(tmp_path / "a.1001.exr")
    assert (found.facts["psvideo:space"], found.facts["psvideo:time_s"]) == ("camera", 1.25)
    assert found.facts["framesPerSecond"] == "30000/1001"
    assert "16 x 12 pixels, channels R, G, B" in lines(found, "ok")


def test_plates_are_held_against_their_timing(tmp_path: Path) -> None:
    put_exr(tmp_path / "key" / "a.1001.exr")
    (tmp_path / "timing.json").write_text(format_timing(make_timing()))
    assert (describe(tmp_path).kind, describe(tmp_path).fits) == ("plates folder", True)
    (tmp_path / "key" / "a.1001.exr").rename(tmp_path / "key" / "a.1002.exr")
    assert "lists key/a.1001.exr" in lines(describe(tmp_path), "FAULT")


def test_results_hold_the_same_numbers(tmp_path: Path) -> None:
    for number in (1001, 1002):
        for name, channels in (("normals", "RGB"), ("albedo", "RGB"), ("valid", "Y")):
            put_exr(tmp_path / name / f"shot_{name}.{number}.exr", channels)
    found = describe(tmp_path)
    assert (found.kind, found.fits) == ("results folder", True)
    assert "normals: 2 files, numbered 1001 to 1002, 16 x 12, channels R, G, B" in lines(found, "ok")
    (tmp_path / "albedo" / "shot_albedo.1002.exr").unlink()
    assert "albedo/ and normals/ do not hold the same numbers (1 differ)" in lines(describe(tmp_path), "FAULT")


def test_results_say_their_space_direction_colour_and_rate(tmp_path: Path) -> None:
    tags = Tags(fps=Fraction(24), colour="lin_awg4_scene", plan_sha256="ab" * 32, y="down", space="world")
    for name, channels in (("normals", "RGB"), ("albedo", "RGB"), ("valid", "Y"), ("error", "Y")):
        data = {channel: np.zeros((12, 16), np.float32) for channel in channels}
        attributes = tags.attributes(time_s=0.5, data=name != "albedo")
        write_exr(tmp_path / name / f"shot_{name}.1001.exr", data, attributes=attributes, fps=tags.fps)
    found = describe(tmp_path)
    said = "normals in world space, y down (DirectX); albedo in lin_awg4_scene, linear; 24 results a second"
    assert said in lines(found, "ok")
    assert "error: 1 file, numbered 1001 to 1001, 16 x 12, channels Y, in °" in lines(found, "ok")
    (tmp_path / "delivery.json").write_text('{"schema": "psvideo-delivery/1"}', encoding="utf-8")
    assert describe(tmp_path / "delivery.json").kind == "results folder"
    assert (found.facts["space"], found.facts["y"], found.facts["colour"]) == ("world", "down", "lin_awg4_scene")


def test_what_lies_in_a_folder_of_results_stands_for_it_and_its_movie_for_itself(tmp_path: Path) -> None:
    out = tmp_path / "out"
    for name, channels in (("normals", "RGB"), ("albedo", "RGB"), ("valid", "Y")):
        put_exr(out / name / f"shot_{name}.1001.exr", channels)
    (out / "preview").mkdir()
    for name in ("shot.usda", "shot.otio", "shot.nk", "README-nuke.txt", "report.html"):
        (out / name).write_text("x")
    for name in ("normals", "preview", "shot.usda", "shot.otio", "shot.nk", "README-nuke.txt", "report.html"):
        found = describe(out / name)
        assert (found.kind, found.fits) == ("results folder", True), name
    with av.open(str(out / "preview" / "shot_relit.mov"), "w") as container:
        stream = container.add_stream("prores_ks", rate=24)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv422p10le"
        container.mux(stream.encode(av.VideoFrame.from_ndarray(np.zeros((48, 64, 3), np.uint8), format="rgb24")))
        container.mux(stream.encode())
    found = describe(out / "preview" / "shot_relit.mov")
    assert (found.kind, found.fits) == ("movie", True), lines(found, "FAULT")
    assert "a movie for eyes made from out, no footage" in lines(found, "ok")
    assert describe(out / "normals" / "shot_normals.1001.exr").kind == "exr image"


def test_a_folder_of_several_takes_names_each_and_whose_files_do_not_fit(tmp_path: Path) -> None:
    held = {"take1": {"normals": 2, "albedo": 2, "valid": 2}, "take2": {"normals": 2, "albedo": 1, "valid": 2}}
    for take, counts in held.items():
        for name, count in counts.items():
            for number in range(count):
                put_exr(tmp_path / take / name / f"{name}.{number:04d}.exr")
    found = describe(tmp_path)
    assert found.kind == "results of several takes"
    assert "take1: results folder, 2 results" in lines(found, "ok")
    assert lines(found, "FAULT").startswith("take2: albedo/ and normals/ do not hold the same numbers")


def test_light_that_only_rounding_left_is_none() -> None:
    assert [level(light) for light in (-4.28e-07, 0.0, -0.0012, 0.5)] == ["0", "0", "-0.0012", "0.5"]


def test_a_clip_of_exr_frames_with_its_timing_beside_them_is_no_folder_of_plates(tmp_path: Path, plan: Plan) -> None:
    put_plan(tmp_path, plan)
    put_exr(tmp_path / "frames" / "a.0001.exr", "RGB")
    (tmp_path / "timing.json").write_text(format_timing(make_timing()))
    assert describe(tmp_path).kind == "clip folder"


def test_what_psvideo_does_not_know_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.pdf").write_text("x")
    (tmp_path / "pyproject.toml").write_text("[project]")
    for name in ("notes.pdf", "pyproject.toml"):
        with pytest.raises(PsvideoError, match=f"{name}: is nothing of which psvideo can say more"):
            describe(tmp_path / name)
    with pytest.raises(PsvideoError, match="there is no such file or folder"):
        describe(tmp_path / "gone")


@pytest.fixture
def run() -> Callable[..., Any]:
    app = typer.Typer()
    app.command()(info)
    return lambda *arguments: CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_the_command_prints_a_line_per_finding_and_fails_where_it_does_not_fit(
    shot: Path, run: Callable[..., Any]
) -> None:
    good = run(shot)
    assert good.exit_code == 0
    assert good.stdout.startswith(f"{shot}: clip folder\n  ok    40 frames")
    put_rig(shot, ("key",))
    bad = run(shot)
    assert bad.exit_code == 1
    assert "\n  FAULT " in bad.stdout


def test_the_command_speaks_json(shot: Path, run: Callable[..., Any]) -> None:
    record = json.loads(run(shot, "--json").stdout)
    assert (record["kind"], record["fits"], record["facts"]["lights"]) == ("clip folder", True, list(LIGHTS))
    assert {"level", "text"} == set(record["findings"][0])


@pytest.mark.parametrize("name", ["plain", "ambient"])
def test_another_simulators_clips_fit(shared_data: Path, name: str) -> None:
    found = describe(shared_data / "clips" / name)
    assert {finding.level for finding in found.findings} == {"ok"}


def test_photographs_with_a_plan_of_their_own_fit(shared_data: Path, tmp_path: Path, plan: Plan) -> None:
    lights = tuple(PlannedFlash(lights={f"L{light}": 1.0}, duration_s=1e-3) for light in range(12))
    camera = dataclasses.replace(plan.camera, width_px=512, height_px=340)
    still = dataclasses.replace(plan, mode="synced", flashes=lights, camera=camera)
    found = describe(shared_data / "uw_psm" / "cat", plan=put_plan(tmp_path, still))
    assert found.fits
    assert "12 frames, 12 flashes a round: 1 whole round" in lines(found, "ok")
    assert "cat.mask.png" in lines(found, "ok")


def test_a_picture_is_described_and_a_broken_one_is_a_fault(tmp_path: Path) -> None:
    path = tmp_path / "still.png"
    path.write_bytes(imagecodecs.png_encode(np.full((6, 8, 3), 30_000, np.uint16)))
    found = describe(path)
    assert (found.kind, found.facts["width_px"], found.facts["height_px"]) == ("png image", 8, 6)
    assert (found.facts["channels"], found.facts["bits"]) == (3, 16)
    assert [finding.level for finding in found.findings] == ["ok"]
    path.write_bytes(path.read_bytes()[:40])
    broken = describe(path)
    assert [finding.level for finding in broken.findings] == ["FAULT"]
    assert "still.png" in broken.findings[0].text


@pytest.mark.parametrize(
    ("missing", "rounds"), [((), "4 whole rounds"), ((5,), "3 whole rounds"), ((5, 8), "2 whole rounds")]
)
def test_rounds_that_miss_a_frame_are_not_counted_as_whole(missing: tuple[int, ...], rounds: str) -> None:
    """Ten frames of three flashes a round are three rounds only where all that lacks is in one of them."""
    camera = Camera(width_px=16, height_px=12, fps=Fraction(60), exposure_s=1 / 60, readout_s=0.0)
    flashes = [PlannedFlash(lights={name: 1.0}, duration_s=0.001) for name in "abc"]
    plan = assemble_plan(camera=camera, flashes=flashes, dark_s=None, mode="synced")
    found = length_finding(plan, tuple(number for number in range(1, 13) if number not in missing))
    assert rounds in found.text
