"""A run that is cut into pieces gives the bytes that it gives at one go, wherever it is cut."""

import contextlib
import hashlib
import itertools
import json
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import psutil
import pytest
from numpy.typing import NDArray

import psvideo as ps
from psvideo.cli.app import main
from psvideo.clip import read_frames
from psvideo.errors import AllDoneError, PsvideoError, UsageError
from psvideo.formats.whole_folders import begun_folder, whole_folder
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.model.rows.shutter import Pulse, row_weights
from psvideo.plates import gather as gather_module
from psvideo.plates import spread
from psvideo.plates.align import light_history
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.gather import gather
from psvideo.plates.spread import rounds_spread, spread_over
from psvideo.report.observe.against_noise import AgainstNoise
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import PointLight
from psvideo.report.observe.rig_and_curve.yuille1997 import Lean
from psvideo.report.observe.worst import Thumbnail, Worst
from psvideo.runs.instants import piece_frames
from psvideo.runs.instants.job import Found
from psvideo.runs.instants.piece_notes import noted, write_notes
from psvideo.runs.instants.pieces import cut, piece_named
from psvideo.runs.many_takes import handed_out
from psvideo.runs.many_takes.cluster import Cluster, connected
from psvideo.solve import steady
from psvideo.strobe.link.boards import BOARDS, capabilities
from psvideo.strobe.link.replies import Identity
from psvideo.strobe.program import make_program
from psvideo.strobe.runlog import format_log, run_log
from psvideo.strobe.session import Outcome, Ready

CLIPS: dict[str, dict[str, Any]] = {
    "still": {},
    "moving": {"speed_px": 0.2},
    "half a shutter": {"shutter_deg": 180, "speed_px": 0.1},
    "no dark slot": {"marker": False, "frames": 400},
    "few dark slots": {"dark_every": 5, "speed_px": 0.1},
    "dark slots far apart": {"dark_every": 20, "speed_px": 0.1, "frames": 320},
    "slow lights": {"fall_s": 0.0008, "speed_px": 0.1},
    "slow lights, no dark slot": {"fall_s": 0.0008, "speed_px": 0.1, "marker": False},
}
OPTIONS: dict[str, dict[str, Any]] = {
    "as it comes": {},
    "shape": {"aov": ["depth", "error", "alpha", "residual", "age"], "mesh": ["ply"]},
    "averaged": {"denoise": 4},
    "all flow": {"align": "flow", "aov": ["motion"]},
    "not aligned": {"align": "none"},
    "24 a second, open": {"fps": 24, "shutter": 180, "plates": True},
    "10 a second, averaged": {"fps": 10, "denoise": 3},
    "every flash": {"fps": "flash"},
    "every frame": {"fps": "frame"},
    "beauty": {"aov": ["beauty"], "with_ambient": True},
}
PER_RUN = ("report.json", "report.html")
"""They hold where and when a run was made."""


RIG = """
schema = "psvideo-rig/1"
light = [
  { name = "a", direction = [0.53, 0.0, 0.848], intensity = 1.0 },
  { name = "b", direction = [-0.527, 0.105, 0.843], intensity = 1.0 },
  { name = "c", direction = [0.105, 0.527, 0.843], intensity = 1.0 },
]
"""
PLAN = """
schema = "psvideo-plan/1"
[camera]
name = "small"
width_px = {width}
height_px = {height}
fps = 100
shutter_deg = {shutter_deg}
readout_s = 0.0097
transfer = "linear"
black_level = 0
white_level = 65535
[strobe]
mode = "rolling"
dark_every = {dark_every}
fall_s = {fall_s}
flash = [
{dark}
  {{ lights = {{ a = 1.0 }}, duration_s = 0.001 }},
  {{ lights = {{ b = 1.0 }}, duration_s = 0.001 }},
  {{ lights = {{ c = 1.0 }}, duration_s = 0.001 }},
]
"""
HEIGHT, WIDTH = 36, 48


def filmed(
    folder: Path,
    *,
    frames: int = 250,
    shutter_deg: float = 360,
    marker: bool = True,
    dark_every: int = 1,
    speed_px: float = 0.0,
    fall_s: float = 0.0,
) -> Path:
    """Film a ball that crosses the picture, ``speed_px`` pixels a frame, under three lights and some ambient light."""
    clip = folder / "clip"
    clip.mkdir()
    dark = "  { lights = {}, duration_s = 0.001 }," if marker else ""
    text = PLAN.format(
        shutter_deg=shutter_deg, dark_every=dark_every, dark=dark, width=WIDTH, height=HEIGHT, fall_s=fall_s
    )
    (clip / "plan.toml").write_text(text, encoding="utf-8")
    (clip / "rig.toml").write_text(RIG, encoding="utf-8")
    plan, rig = ps.read_plan(clip / "plan.toml"), ps.read_rig(clip / "rig.toml")
    rng = np.random.default_rng(3)
    pictures = np.full((frames, HEIGHT, WIDTH), 0.05) * (1 + 0.1 * np.sin(np.arange(frames) / 40))[:, None, None]
    time_s, slots = 0.003, [slot for one in range(plan.dark_every) for slot in _round(plan, one)]
    for slot in itertools.cycle(slots):
        flash = plan.flashes[slot]
        if time_s > frames / 100:
            break
        for name in flash.lights:
            first = int(time_s * 100) - 3
            near = range(max(first, 0), min(first + 6, frames))
            lit = Pulse(fall_s=fall_s)
            seen = row_weights(plan.camera, np.array([time_s]), np.array([flash.duration_s]), frames=near, pulse=lit)[0]
            pictures[near.start : near.stop] += 0.6 * seen[..., None] * _ball(rig, name, time_s * 100 * speed_px)
        time_s += flash.duration_s + plan.dark_s
    pictures += rng.normal(0, 0.002, pictures.shape)
    for number, picture in enumerate(pictures, 1):
        codes = np.clip(np.round(picture * 65535), 0, 65535).astype(np.uint16)
        cv2.imwrite(str(clip / f"small.{number:04d}.png"), codes)
    return clip


def _round(plan: Plan, number: int) -> list[int]:
    return [slot for slot, flash in enumerate(plan.flashes) if flash.lit or number == 0]


def _ball(rig: Rig, name: str, moved_px: float) -> NDArray[np.float64]:
    """Return how bright a light makes the ball, which stands at a third of the width and has moved since."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    x, y = (x - WIDTH / 3 - moved_px % (WIDTH / 3)) / 12, (HEIGHT / 2 - y) / 12
    inside = x**2 + y**2 < 1
    z = np.sqrt(np.where(inside, 1 - x**2 - y**2, 0))
    direction = next(light.direction for light in rig.lights if light.name == name)
    assert direction is not None
    lit = np.maximum(direction[0] * x + direction[1] * y + direction[2] * z, 0) * (0.8 + 0.2 * np.sin(9 * x + 7 * y))
    return np.where(inside, lit, 0.05)


def digest(out: Path) -> dict[str, str]:
    files = [path for path in sorted(out.rglob("*")) if path.is_file() and path.name not in PER_RUN]
    return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def judged(out: Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads((out / "report.json").read_text(encoding="utf-8"))
    return report | {"settings": None}


def same_in_pieces(clip: Path, folder: Path, words: tuple[str, ...], **options: Any) -> None:
    """Solve a clip at one go, and again by some pieces and what they leave; compare all files and the reports."""
    given = {"rig": clip / "rig.toml", **options}
    ps.normals(clip, out=folder / "whole", **given)
    for piece in words:
        ps.normals(clip, out=folder / "pieces", piece=piece, **given)
    ps.normals(clip, out=folder / "pieces", resume=True, **given)
    assert digest(folder / "pieces") == digest(folder / "whole")
    assert judged(folder / "pieces") == judged(folder / "whole")
    assert not [*folder.glob(".*")]


def test_a_run_in_pieces_gives_the_bytes_of_one_at_one_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (light_history, piece_frames, steady):  # else half a hundred rounds were needed
        monkeypatch.setattr(module, "POOLED_ROUNDS", 4)
    clip = filmed(tmp_path, frames=100, speed_px=0.2)
    options: dict[str, Any] = {"aov": ["beauty"], "with_ambient": True, "denoise": 2, "preview": ()}
    same_in_pieces(clip, tmp_path, ("0/9", "9/9"), **options)
    with pytest.raises(AllDoneError):
        ps.normals(clip, out=tmp_path / "pieces", rig=clip / "rig.toml", piece="2/3", **options)


GLOSSY = """
schema = "psvideo-scene/1"
name = "gloss"
frames = 46
output = { kind = "png16" }
ambient = { level = 0.02 }
[camera]
width_px = 96
height_px = 72
fps = 100
shutter_deg = 360
readout_s = 0.0097
width_m = 1.0
full_well_e = 9000
[[object]]
mesh = "sphere"
albedo = { pattern = "noise" }
specular = { strength = 0.3, roughness = 0.35 }
motion = { velocity_m_per_s = [0.3, 0.0, 0.0] }
"""
GLOSSY += "".join(
    f"[[light]]\nname = '{name}'\ndirection = [{x}, {y}, 0.8]\n"
    for name, (x, y) in zip(
        "abcdef", [(0.6, 0.0), (-0.6, 0.0), (0.0, 0.6), (0.0, -0.6), (0.2, 0.1), (-0.3, 0.3)], strict=True
    )
)


@pytest.fixture(scope="module")
def glossy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("glossy")
    (folder / "scene.toml").write_text(GLOSSY, encoding="utf-8")
    return Path(ps.shoot(folder / "scene.toml", folder / "clip").path)


def test_rounds_share_what_their_subject_reflects_and_pieces_take_over_what_the_first_noted(
    glossy: Path, tmp_path: Path
) -> None:
    clip = shutil.copytree(glossy, tmp_path / "clip")
    given: dict[str, Any] = {"rig": clip / "rig.toml", "preview": ()}
    whole = ps.normals(clip, out=tmp_path / "whole", **given)
    found = {None if one.misfit is None else one.misfit.reflectance for one in whole.instants}
    assert len(whole.instants) >= 4
    assert len(found) == 1
    assert None not in found
    ps.normals(clip, out=tmp_path / "pieces", piece="3/3", **given)
    noted_by_first = next(tmp_path.glob(".*/.pieces/subject.json"))
    assert json.loads(noted_by_first.read_text())["reflectance"] == list(found.pop() or ())
    ps.normals(clip, out=tmp_path / "pieces", resume=True, **given)
    assert digest(tmp_path / "pieces") == digest(tmp_path / "whole")
    assert judged(tmp_path / "pieces") == judged(tmp_path / "whole")


def test_what_comes_in_late_is_looked_at_too(glossy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spread, "EACH", 2)
    take = ps.open_take(glossy)
    timing = ps.find_timing(take)
    every = {one.number: one for one in gather(take, timing, aligning=Aligning())}
    read: list[int] = []

    def counted(clip: Any, numbers: Any, **options: Any) -> Any:
        read.extend(numbers)
        return read_frames(clip, numbers, **options)

    monkeypatch.setattr(gather_module, "read_frames", counted)
    some = [*rounds_spread(take, timing, aligning=Aligning())]
    assert [one.number for one in some] == [min(one, max(every) - 1) for one in spread_over([*every])]
    assert some[-1].number >= max(every) - 1
    assert len(read) < 0.9 * len(take.numbers) * len(some)
    for one in some:
        for plate, other in zip(one.plates, every[one.number].plates, strict=True):
            assert np.abs(plate.image - other.image).mean() < 0.004


CUTS = (("7/7",), ("2/7", "5/7"), ("20/60", "33/60", "34/60"))
EVERY_CLIP_AND_OPTION = sorted(
    {*((name, "as it comes") for name in CLIPS), *(("moving", options) for options in OPTIONS)}
)


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("name", "options", "cuts"),
    [(*pair, cuts) for pair, cuts in zip(EVERY_CLIP_AND_OPTION, itertools.cycle(CUTS), strict=False)],
)
def test_any_cut_gives_the_bytes_of_one_go(name: str, options: str, cuts: tuple[str, ...], tmp_path: Path) -> None:
    named: dict[str, Any] = {} if CLIPS[name].get("marker", True) else {"first_light": "a"}
    same_in_pieces(filmed(tmp_path, **CLIPS[name]), tmp_path, cuts, **OPTIONS[options], **named)


def test_pieces_are_as_equal_as_they_come_and_leave_nothing_out() -> None:
    for count in range(1, 12):
        found = cut(range(1001, 1011), count)
        assert [number for piece in found for number in piece] == [*range(1001, 1011)]
        assert len({len(piece) for piece in found}) <= 2
    assert piece_named("3/5", range(10)) == range(4, 6)
    assert not piece_named("0/5", range(10))
    assert not piece_named("12/12", range(10))


@pytest.mark.parametrize("word", ["", "3", "6/5", "-1/5", "a/b", "1/5/2"])
def test_a_word_that_names_no_piece_is_refused(word: str) -> None:
    with pytest.raises(UsageError, match="expected which of how many"):
        piece_named(word, range(10))


def test_what_a_piece_found_is_read_back_as_it_was(tmp_path: Path) -> None:
    facts = InstantFacts(
        number=1003, time_s=0.1 + 0.2, valid_share=1 / 3, clipped_share=0.0, unseen_share=0.0, levels=(0.1, 2 / 3)
    )
    normals, valid = np.ones((2, 3, 3), np.float16), np.eye(2, 3, dtype=np.bool_)
    worst = Thumbnail(number=1003, badness=0.7, why="67 % valid", normals=normals, valid=valid)
    observed = Observed(
        lights=("a", "b"),
        facts=KeptFacts([facts]),
        counts={"a": np.arange(5), "b": np.arange(5) * 2},
        blurs_px=[0.7],
        noises=[AgainstNoise(level=1 / 3, read=1e-6, photon=2 / 3)],
        leans=[Lean(lean_deg=1 / 3, gain=0.2, turn_deg=(0.1, 0.2, 0.3), rest_deg=0.1)],
        light_at_points=[PointLight(np.random.default_rng(1).random((4, 2)), np.array([1.0, 4.0]))],
        in_shadow=[0.04],
        ambient_measured={128: 0.25},
        worst=Worst([worst]),
    )
    picture = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    write_notes(tmp_path, range(1003, 1004), Found(observed=observed, picture=picture, reserved=("No scale.",)))
    ((numbers, found),) = noted(tmp_path)
    seen = found.observed
    assert (numbers, found.reserved, list(seen.facts)) == (range(1003, 1004), ("No scale.",), [facts])
    assert (seen.blurs_px, seen.ambient_measured) == ([0.7], {128: 0.25})
    assert seen.noises == observed.noises
    assert (seen.leans, seen.in_shadow) == (observed.leans, [0.04])
    assert all(np.array_equal(seen.counts[light], observed.counts[light]) for light in observed.counts)
    assert np.array_equal(seen.light_at_points[0].light, observed.light_at_points[0].light)
    assert seen.light_at_points[0].white.tolist() == [1.0, 4.0]
    assert found.picture is not None
    assert np.array_equal(found.picture, picture)
    assert [(one.number, one.badness, one.why) for one in seen.thumbnails] == [(1003, 0.7, "67 % valid")]
    assert np.array_equal(seen.thumbnails[0].valid, valid)


def test_damaged_notes_are_refused_by_name(tmp_path: Path) -> None:
    write_notes(tmp_path, range(3, 5), Found(observed=Observed(lights=("a",))))
    (path,) = (tmp_path / ".pieces").glob("*.npz")
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(PsvideoError, match=r"3-5\.npz: cannot be read .* Remove it"):
        list(noted(tmp_path))


def test_two_runs_into_one_folder_are_refused_and_pieces_are_not(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with whole_folder(out, mark="timing.json", settings="a") as folder:
        (folder / "kept").touch()
        for resume in (False, True):
            with (
                pytest.raises(PsvideoError, match="another run is writing"),
                whole_folder(out, mark="timing.json", resume=resume, settings="a"),
            ):
                pass
        with pytest.raises(PsvideoError, match="another run"), begun_folder(out, mark="timing.json", settings="a"):
            pass
        assert (folder / "kept").is_file()
    other = tmp_path / "other"
    with begun_folder(other, mark="timing.json", settings="a"):
        with begun_folder(other, mark="timing.json", settings="a"):
            pass
        with pytest.raises(PsvideoError, match="another run"), whole_folder(other, mark="timing.json"):
            pass
        with pytest.raises(UsageError, match="other settings"), begun_folder(other, mark="timing.json", settings="b"):
            pass


def test_pieces_replace_what_is_finished_where_that_is_forced(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with whole_folder(out, mark="timing.json", settings="a") as folder:
        (folder / "timing.json").touch()
        (folder / "old").touch()
    with pytest.raises(AllDoneError), begun_folder(out, mark="timing.json", settings="a"):
        pass
    with begun_folder(out, mark="timing.json", force=True, settings="a") as folder:
        (folder / "timing.json").touch()
    assert (out / "old").is_file()
    with whole_folder(out, mark="timing.json", force=True, resume=True, settings="a"):
        pass
    assert [path.name for path in out.iterdir() if not path.name.startswith(".")] == ["timing.json"]


def test_pieces_cut_in_two_ways_leave_no_instant_out_of_the_report(tmp_path: Path) -> None:
    same_in_pieces(filmed(tmp_path, frames=70), tmp_path, ("1/2", "2/3"), preview=())


def test_a_strobe_s_log_that_came_meanwhile_makes_it_another_run(tmp_path: Path) -> None:
    clip = filmed(tmp_path, frames=40)
    given = {"rig": clip / "rig.toml", "preview": ()}
    ps.normals(clip, out=tmp_path / "out", piece="1/2", **given)  # type: ignore[arg-type]
    caps = capabilities(BOARDS["atmega328p"], "gated")
    board = Ready(identity=Identity(proto=1, board="atmega328p", firmware="1", unit="one"), caps=caps)
    program = make_program(ps.read_plan(clip / "plan.toml"), caps)
    outcome = Outcome(
        started_utc="", stopped_utc="", start_tick=0, cycles=1, ended="done", fault=None, message=None, clock=None
    )
    log = run_log(clip / "plan.toml", board, program, outcome)
    (clip / "strobe.json").write_text(format_log(log))
    with pytest.raises(UsageError, match="other settings, footage, plan"):
        ps.normals(clip, out=tmp_path / "out", resume=True, **given)  # type: ignore[arg-type]


def test_two_workers_give_the_bytes_of_one_process_and_takes_one_report(tmp_path: Path) -> None:
    clip = filmed(tmp_path, frames=60)
    given: dict[str, Any] = {"rig": clip / "rig.toml", "preview": ()}
    ps.normals(clip, out=tmp_path / "one" / "clip", **given)
    (tmp_path / "dark").mkdir()
    shutil.copy(clip / "plan.toml", tmp_path / "dark")
    cv2.imwrite(str(tmp_path / "dark" / "dark.0001.png"), np.zeros((HEIGHT, WIDTH), np.uint16))
    results = ps.normals_of_takes([clip, tmp_path / "dark"], out=tmp_path / "all", workers=2, pieces=2, **given)
    assert [one.clip.name for one in results] == ["dark", "clip"], "the worst first"
    assert "dark" in results[0].fault
    assert results[1].instants == len(judged(tmp_path / "one" / "clip")["instants"])
    assert digest(tmp_path / "all" / "clip") == digest(tmp_path / "one" / "clip")
    assert judged(tmp_path / "all" / "clip") == judged(tmp_path / "one" / "clip")
    assert "dark: failed." in (tmp_path / "all" / "report.html").read_text(encoding="utf-8")
    again = ps.normals_of_takes([clip], out=tmp_path / "all" / "clip", workers=2, pieces=2, resume=True, **given)
    assert [one.fault for one in again] == [""], "what is done is no fault"


@pytest.mark.parametrize("how", [[], pytest.param(["--workers", "2"], marks=pytest.mark.campaign)])
def test_split_of_several_takes_gives_the_bytes_of_one_at_a_time(
    how: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = filmed(tmp_path, frames=40)
    shutil.copytree(clip, tmp_path / "again")
    (tmp_path / "dark").mkdir()
    shutil.copy(clip / "plan.toml", tmp_path / "dark")
    cv2.imwrite(str(tmp_path / "dark" / "dark.0001.png"), np.zeros((HEIGHT, WIDTH), np.uint16))
    for name in ("clip", "again"):
        ps.split(tmp_path / name, out=tmp_path / "one" / name, beauty=True)
    takes = [str(tmp_path / name) for name in ("clip", "again", "dark")]
    for again in ([], ["--resume"]):
        assert main(["split", *takes, "-o", str(tmp_path / "all"), "--beauty", *how, *again]) == 1
        said = capsys.readouterr()
        named = [Path(line.split(":")[0]).name for line in said.out.splitlines()[-3:]]
        assert named == ["dark", "again", "clip"], said.out
        assert ("all done" in said.out) == (not how and bool(again)), "workers say nothing"
    for name in ("clip", "again"):
        assert digest(tmp_path / "all" / name) == digest(tmp_path / "one" / name)
    assert "dark: failed." in (tmp_path / "all" / "report.html").read_text(encoding="utf-8")
    with pytest.raises(UsageError, match="exists already"):
        ps.split_of_takes(takes, out=tmp_path / "all", workers=2)


@pytest.mark.campaign
def test_a_worker_that_is_killed_is_replaced_and_its_piece_done_again(tmp_path: Path) -> None:
    clip = filmed(tmp_path, frames=160)
    command = [sys.executable, "-m", "psvideo.cli.app", "normals", str(clip), "--no-preview", "-q"]
    command += ["--rig", str(clip / "rig.toml"), "-o"]
    subprocess.run([*command, str(tmp_path / "one" / "clip")], check=True)
    running = subprocess.Popen([*command, str(tmp_path / "two" / "clip"), "--workers", "2"])
    busy = _when_solving(tmp_path / "two" / ".clip.partial", psutil.Process(running.pid))
    assert len(busy) >= 2
    busy[0].kill()
    assert running.wait(timeout=300) == 0
    assert digest(tmp_path / "two" / "clip") == digest(tmp_path / "one" / "clip")
    assert judged(tmp_path / "two" / "clip") == judged(tmp_path / "one" / "clip")


def test_a_piece_hangs_that_takes_far_longer_than_the_others_did() -> None:
    looks = handed_out.Hanging(ours={"a", "b"})
    assert looks.workers({"one": ["a", "theirs"], "two": ["b"]}, 0.0) == []
    assert looks.workers({"one": ["a", "theirs"], "two": []}, 100.0) == []
    assert looks.workers({"one": ["a", "theirs"]}, handed_out.HANGS_TIMES * 100.0) == []
    assert looks.workers({"one": ["a", "theirs"]}, handed_out.HANGS_TIMES * 100.0 + 1) == ["one"]
    assert looks.workers({"one": ["theirs"], "two": ["a"]}, handed_out.HANGS_TIMES * 100.0 + 2) == []
    assert looks.longest_s == 100.0, "a piece that hung is none that was done"


@pytest.mark.campaign
def test_a_worker_that_hangs_is_replaced_and_its_piece_done_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = filmed(tmp_path, frames=160)
    given: dict[str, Any] = {"rig": clip / "rig.toml", "preview": ()}
    ps.normals(clip, out=tmp_path / "one" / "clip", **given)
    for name, value in {"HANGS_S": 15.0, "HANGS_TIMES": 3.0, "LOOKS_EVERY_S": 1.0}.items():
        monkeypatch.setattr(handed_out, name, value)
    stopped: list[psutil.Process] = []

    def stop_one() -> None:
        busy = _when_solving(tmp_path / "two" / ".clip.partial", psutil.Process())
        busy[0].suspend()
        stopped.append(busy[0])

    stopping = threading.Thread(target=stop_one)
    stopping.start()
    ps.normals_of_takes([clip], out=tmp_path / "two" / "clip", workers=2, pieces=4, **given)
    stopping.join()
    assert stopped
    assert not stopped[0].is_running()
    assert digest(tmp_path / "two" / "clip") == digest(tmp_path / "one" / "clip")


@pytest.mark.campaign
def test_a_scheduler_that_is_killed_leaves_a_run_that_resume_ends(tmp_path: Path) -> None:
    clip = filmed(tmp_path, frames=160)
    given = [str(clip), "--rig", str(clip / "rig.toml"), "--no-preview", "-q", "-o"]
    normals = [sys.executable, "-m", "psvideo.cli.app", "normals", *given]
    subprocess.run([*normals, str(tmp_path / "one" / "clip")], check=True)
    where = tmp_path / "scheduler.json"
    dask = str(Path(sys.executable).with_name("dask"))
    here = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(where)]
    scheduler = subprocess.Popen([dask, "scheduler", *here], stderr=subprocess.DEVNULL)
    address = _address_in(where)
    worker = subprocess.Popen([dask, "worker", address, "--nthreads", "1"], stderr=subprocess.DEVNULL)
    try:
        out = tmp_path / "two" / "clip"
        running = subprocess.Popen([*normals, str(out), "--scheduler", address], stderr=subprocess.PIPE, text=True)
        _when_solving(tmp_path / "two" / ".clip.partial", psutil.Process(worker.pid))
        scheduler.kill()
        _, said = running.communicate(timeout=120)
    finally:
        for one in (*psutil.Process(worker.pid).children(recursive=True), worker, scheduler):
            with contextlib.suppress(psutil.NoSuchProcess):
                one.kill()
            one.wait()
    assert running.returncode == 1
    assert "The cluster's scheduler is gone." in said
    assert "Traceback" not in said
    subprocess.run([*normals, str(out), "--resume"], check=True)
    assert digest(out) == digest(tmp_path / "one" / "clip")
    assert not [*out.parent.glob(".*")]


def _address_in(where: Path) -> str:
    """Return a scheduler's address once its file is whole: dask opens the file first and writes into it later."""
    until_s = time.monotonic() + 300
    while time.monotonic() < until_s:
        with contextlib.suppress(FileNotFoundError, json.JSONDecodeError):
            return str(json.loads(where.read_text(encoding="utf-8"))["address"])
        time.sleep(0.05)
    raise TimeoutError(f"{where} was not written")


def _when_solving(beside: Path, parent: psutil.Process) -> list[psutil.Process]:
    """Return the processes of workers below another, once the first piece of a run was noted."""
    until_s = time.monotonic() + 300
    while not (beside / ".pieces" / "timing.json").is_file() and time.monotonic() < until_s:
        time.sleep(0.05)
    return [one for one in parent.children(recursive=True) if any("spawn_main" in word for word in one.cmdline())]


@pytest.mark.parametrize(("deaths", "starts"), [(1, 2), (9, 2)])
def test_workers_that_die_while_they_start_are_started_once_more(
    deaths: int, starts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A process that is killed before it has answered ends dask's cluster with RuntimeError."""
    begun: list[int] = []

    def local(**given: Any) -> Any:
        begun.append(given["n_workers"])
        if len(begun) <= deaths:
            raise RuntimeError("Nanny failed to start.")
        return contextlib.nullcontext("a cluster")

    monkeypatch.setattr("distributed.LocalCluster", local)
    monkeypatch.setattr("distributed.Client", lambda cluster, **_: contextlib.nullcontext(cluster))
    expected = pytest.raises(PsvideoError, match="`workers` 3: the processes end") if deaths > 1 else None
    with expected or contextlib.nullcontext(), connected(Cluster(workers=3)) as client:
        assert client == "a cluster"
    assert begun == [3] * starts


def test_what_cannot_be_shared_is_refused_in_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {"out": tmp_path / "out", "rig": tmp_path / "rig.toml"}
    with pytest.raises(UsageError, match="`workers` 0: expected"):
        ps.normals_of_takes(["clip"], workers=0, **given)
    with pytest.raises(UsageError, match="expected one of the two"):
        ps.normals_of_takes(["clip"], workers=2, scheduler="tcp://127.0.0.1:9", **given)
    with pytest.raises(UsageError, match="`scheduler` nonsense: expected its address"):
        ps.normals_of_takes(["clip"], scheduler="nonsense", **given)
    with pytest.raises(UsageError, match="several are named 'clip'"):
        ps.normals_of_takes(["a/clip", "b/clip"], **given)
    with pytest.raises(UsageError, match="names no clip"):
        ps.normals_of_takes([], **given)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"python -m pip install 'psvideo\[dask\]'"):
        ps.normals_of_takes(["clip"], workers=2, **given)
