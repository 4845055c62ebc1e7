"""The check on the set: a line for each thing, an exit status, and each new take of a folder as soon as it is whole."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from filmed import filmed
from picture_file import read_picture
from written_movies import write_rgb16

import psvideo as ps
from psvideo.cli.app import main
from psvideo.clip import Take
from psvideo.errors import NoStrobeError
from psvideo.model.timing import Timing
from psvideo.report.judgement import Judgement
from psvideo.report.observe.focus import sharpest_blur_px
from psvideo.report.run_report import RunReport
from psvideo.runs.many_takes.arriving import takes_in, whole_takes
from psvideo.runs.many_takes.check_folder import Unread, check_takes
from psvideo.runs.steps.checked import Check
from psvideo.sync.take_timing import find_timing

SPHERE = (Path(__file__).resolve().parents[1] / "data_synth" / "sphere.toml").read_text()
SCENE = SPHERE.replace("frames = 12", "frames = 26").replace("readout_s = 0.01\n", "readout_s = 0.01\nread_e = 5.0\n")
EVEN = ((0.6, 0.0), (0.0, 0.6), (-0.6, 0.0), (0.0, -0.6))
MOVES = (
    "albedo = 0.8",
    (
        'albedo = { pattern = "noise", colour = 0.8, second = 0.3, size_m = 0.15 }\n'
        "motion = { sway_m = [0.2, 0.0, 0.0], sway_hz = 2.0 }"
    ),
)
SCENES = {
    "good": SCENE,
    "dead": SCENE.replace('name = "left"\n', 'name = "left"\nintensity = 0.0001\n'),
    "clips": SCENE.replace('name = "key"\n', 'name = "key"\nintensity = 1.8\n'),
    "ring": re.sub(
        r"(?s)\[\[light\]\].*(?=\[\[object\]\])",
        "".join(f'[[light]]\nname = "light{n}"\ndirection = [{x}, {y}, 0.8]\n' for n, (x, y) in enumerate(EVEN)),
        SCENE,
    ),
    "half": SCENE.replace("frames = 26", "frames = 40").replace("360.0", "180.0"),
    "half moves": SCENE.replace("frames = 26", "frames = 40").replace("360.0", "180.0").replace(*MOVES),
    "quarter moves": SCENE.replace("frames = 26", "frames = 40").replace("360.0", "90.0").replace(*MOVES),
    "room": SCENE + "\n[ambient]\nlevel = 0.6\n",
}


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Film one of the scenes, once."""
    return filmed(tmp_path_factory.mktemp("shoots"), SCENES)


def listing(folder: Path) -> list[tuple[str, int, int]]:
    return [(str(path), path.stat().st_size, path.stat().st_mtime_ns) for path in sorted(folder.rglob("*"))]


def test_a_good_take_passes_with_a_word_for_each_thing_and_nothing_is_written(
    shot: Callable[[str], Path], capsys: pytest.CaptureFixture[str]
) -> None:
    clip = shot("good")
    before = listing(clip.parent)
    assert run("check", clip, "--rig", clip / "rig.toml") == 0
    lines = capsys.readouterr().out.splitlines()
    assert "This take is usable." in lines[0]
    words = dict(line.split()[1::-1] for line in lines[1:])
    for subject in ("strobe", "timing", "order", "rows", "exposure", "lights", "ambient", "motion"):
        assert words[subject] == "good", subject
    assert set(words.values()) <= {"good", "unknown"}
    assert listing(clip.parent) == before


def test_an_alpha_channel_that_is_left_out_costs_nothing_and_what_costs_accuracy_is_a_reservation(
    shot: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """normals said "with reservations" of what check called usable: of an alpha channel, and of H.264 as well."""
    good = shot("good")
    for path in sorted((good / "frames").glob("*.png")):
        codes = read_picture(path, cv2.IMREAD_UNCHANGED)
        colour = codes if codes.ndim == 3 else np.repeat(codes[..., None], 3, axis=2)
        alpha = np.full(codes.shape[:2], 65535, codes.dtype)
        cv2.imwrite(str(tmp_path / f"{path.stem}.png"), np.dstack([colour, alpha]))
    shutil.copy(good / "plan.toml", tmp_path)
    assert run("check", tmp_path) == 0
    said = capsys.readouterr().out
    assert "This take is usable." in said
    assert "note      the PNG files' alpha channel is left out" in said
    warned = Check(
        clip="c",
        path=tmp_path,
        frames=1,
        looked_at=1,
        judged=(1, 1),
        seconds=0.1,
        judgements=(),
        warnings=("H.264 costs accuracy",),
    )
    assert warned.verdict == "This take is usable, with reservations."


@pytest.mark.parametrize(
    ("name", "subject", "words"),
    [
        ("dead", "lights", "'left' gives no light"),
        ("clips", "clipping", "'key' is clipped in .* power"),
        ("room", "ambient", "Ambient light is 5. %"),
    ],
)
def test_a_spoilt_take_fails_and_says_what_to_change(
    shot: Callable[[str], Path], capsys: pytest.CaptureFixture[str], name: str, subject: str, words: str
) -> None:
    assert run("check", shot(name), "--json") == 1
    found = json.loads(capsys.readouterr().out)
    assert found["schema"] == "psvideo-check/1"
    assert not found["usable"]
    line = next(one for one in found["judgements"] if one["subject"] == subject)
    assert line["grade"] == "bad"
    assert re.search(words, f"{line['found']} {line['advice']}")


def test_lights_that_did_not_flash_are_a_strobe_that_is_not_seen(
    shot: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = tmp_path / "clip"
    shutil.copytree(shot("good"), clip)
    files = sorted((clip / "frames").iterdir())
    lit = read_picture(files[4], cv2.IMREAD_UNCHANGED)
    for file in files:
        cv2.imwrite(str(file), lit)
    assert run("check", clip) == 1
    out = capsys.readouterr().out
    assert re.search(r"bad +strobe", out)
    assert re.search(r"(good|bad) +exposure", out)


def test_more_frames_are_looked_at_before_a_strobe_is_said_to_be_missing(
    shot: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = list[int]()

    def only_in_many(take: Take, **others: Any) -> Timing:
        asked.append(len(take.numbers))
        if len(asked) == 1:
            raise NoStrobeError("no strobe in so few")
        return find_timing(take, **others)

    monkeypatch.setattr("psvideo.runs.steps.where_to_look.find_timing", only_in_many)
    monkeypatch.setattr("psvideo.runs.steps.checked_frames.LEAST_FRAMES", 1)
    monkeypatch.setattr("psvideo.runs.steps.checked_frames.ROUNDS", 2)
    assert run("check", shot("good"), "--json") == 0
    checked = json.loads(capsys.readouterr().out)
    assert len(asked) == 2
    assert asked[0] < asked[1] <= 2 * asked[0]
    assert asked[1] <= checked["looked_at"] <= checked["frames"]


def test_the_blur_of_sharp_shapes_is_reported_and_that_of_noise_is_not() -> None:
    rng = np.random.default_rng(4)
    shapes = np.full((300, 420), 0.1, np.float32)
    for _ in range(40):
        middle, size = rng.integers(0, 420, 2).tolist(), rng.integers(30, 90, 2).tolist()
        cv2.rectangle(shapes, middle, (middle[0] + size[0], middle[1] + size[1]), float(rng.uniform(0.1, 0.9)), -1)
    for sigma_px in (1.0, 2.0, 4.0, 8.0):
        noise = rng.normal(0, 0.004, shapes.shape).astype(np.float32)
        reported = sharpest_blur_px(np.asarray(cv2.GaussianBlur(shapes, (0, 0), sigma_px), np.float32) + noise)
        assert reported is not None
        assert 0.45 * sigma_px < reported < 1.2 * sigma_px, "corners look sharper: it is a lower bound"
    assert sharpest_blur_px(rng.normal(0.2, 0.004, shapes.shape).astype(np.float32)) is None


def test_one_sharp_thing_in_a_large_soft_picture_is_found_wherever_it_stands() -> None:
    rng = np.random.default_rng(4)
    soft = np.full((1080, 1920), 0.1, np.float32)
    for middle in rng.integers(0, 1900, (12, 2)).tolist():
        cv2.circle(soft, middle, 90, float(rng.uniform(0.2, 0.5)), -1)
    noise = rng.normal(0, 0.002, soft.shape).astype(np.float32)
    soft = np.asarray(cv2.GaussianBlur(soft, (0, 0), 8.0), np.float32) + noise
    assert 3.5 < (sharpest_blur_px(soft) or 0) < 9.6
    for row, col in ((200, 300), (540, 960), (700, 1500)):
        sharp = soft.copy()
        sharp[row : row + 120, col : col + 120] = 0.9
        sharp = np.asarray(cv2.GaussianBlur(sharp, (0, 0), 0.8), np.float32)
        assert 0.4 < (sharpest_blur_px(sharp) or 0) < 1.2


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        ("no plan", "no plan.toml here.*--plan"),
        ("empty", "holds no numbered|no image|nothing"),
        ("short", r"holds \d+ frame"),
        ("truncated", r"(truncated|damaged|cannot be|decoded)"),
        ("missing", "there is no such clip"),
    ],
)
def test_what_cannot_be_checked_is_one_plain_paragraph(
    shot: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], spoil: str, words: str
) -> None:
    clip = tmp_path / "clip"
    if spoil != "missing":
        shutil.copytree(shot("good"), clip)
    files = sorted((clip / "frames").iterdir()) if clip.is_dir() else []
    if spoil == "no plan":
        (clip / "plan.toml").unlink()
    elif spoil == "empty":
        shutil.rmtree(clip / "frames")
    elif spoil == "short":
        for file in files[3:]:
            file.unlink()
    elif spoil == "truncated":
        files[5].write_bytes(files[5].read_bytes()[:200])
    assert run("check", clip) == 1
    said = capsys.readouterr()
    assert said.err.startswith("psvideo: ")
    assert said.err.count("\n") == 1
    assert re.search(words, said.err)
    assert "Traceback" not in said.err


def test_a_movie_is_not_decoded_to_its_end(
    shot: Callable[[str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from psvideo.clip.decode.movies import movie_codes, movie_frames

    clip = shot("good")
    frames = [read_picture(file, cv2.IMREAD_UNCHANGED) for file in sorted((clip / "frames").iterdir())]
    write_rgb16(tmp_path / "take.mkv", frames * 8, rate=100)
    shutil.copy(clip / "plan.toml", tmp_path / "plan.toml")
    decoded: list[int] = []
    picture = movie_codes.rgb_codes
    monkeypatch.setattr(movie_frames, "rgb_codes", lambda *given: decoded.append(1) or picture(*given))  # type: ignore[func-returns-value]
    run("check", tmp_path / "take.mkv", "-q")
    assert 20 < len(decoded) < 60


def looks(folder: Path, changes: list[Callable[[], object]], **options: Any) -> list[list[str]]:
    """Return the names of the takes that are given after each look; before each but the first, one change is made."""
    steps = iter(changes)

    class OverError(Exception):
        pass

    def sleep(_: float) -> None:
        step = next(steps, None)
        if step is None:
            raise OverError
        step()

    given: list[list[str]] = [[]]
    try:
        for path in whole_takes(folder, interval_s=0.0, sleep=sleep, **options):
            if path is None:
                given.append([])
            else:
                given[-1].append(path.name)
    except OverError:
        pass
    return given


def add_frames(clip: Path, first: int, count: int) -> None:
    clip.mkdir(parents=True, exist_ok=True)
    for number in range(first, first + count):
        (clip / f"f.{number:04d}.png").write_bytes(b"x" * 100)


def nothing() -> None:
    """Let time pass."""


def test_a_take_is_given_once_it_has_stopped_growing(tmp_path: Path) -> None:
    add_frames(tmp_path / "old", 1, 3)
    grow = [lambda n=n: add_frames(tmp_path / "new", n, 1) for n in range(4)]
    given = looks(tmp_path, [*grow, nothing, nothing, nothing, nothing])
    assert [name for names in given for name in names] == ["new"]
    assert all(not names for names in given[:5]), "not while it grows"


def test_many_takes_at_once_come_all_and_the_oldest_first(tmp_path: Path) -> None:
    def appear() -> None:
        for n in range(5):
            add_frames(tmp_path / "card" / f"take{n}" / "frames", 1, 2)
            for file in (tmp_path / "card" / f"take{n}" / "frames").iterdir():
                os.utime(file, (1000 - n, 1000 - n))
        (tmp_path / "movie.mov").write_bytes(b"x")

    given = looks(tmp_path, [appear, nothing, nothing, nothing])
    assert [name for names in given for name in names] == ["take4", "take3", "take2", "take1", "take0", "movie.mov"]


def test_a_take_that_goes_away_is_forgotten_and_one_that_changes_comes_again(tmp_path: Path) -> None:
    take = tmp_path / "take"
    changes: list[Callable[[], object]] = [
        lambda: add_frames(tmp_path / "gone", 1, 3),
        lambda: shutil.rmtree(tmp_path / "gone"),
        lambda: add_frames(take, 1, 3),
        *[nothing] * 3,
        lambda: (take / "plan.toml").write_text("late"),
        *[nothing] * 3,
    ]
    given = looks(tmp_path, changes)
    assert [name for names in given for name in names] == ["take", "take"]


def test_takes_that_were_there_are_given_only_when_asked_for(tmp_path: Path) -> None:
    add_frames(tmp_path / "old", 1, 3)
    assert looks(tmp_path, [nothing] * 3)[-1] == []
    assert [name for names in looks(tmp_path, [nothing] * 3, existing=True) for name in names] == ["old"]


def test_a_drive_that_is_away_for_a_while_does_not_make_its_takes_new(tmp_path: Path) -> None:
    folder, away = tmp_path / "drive", tmp_path / "away"
    add_frames(folder / "old", 1, 3)
    given = looks(folder, [lambda: folder.rename(away), nothing, lambda: away.rename(folder), *[nothing] * 4])
    assert not any(given)


def test_hidden_files_and_other_folders_are_no_takes(tmp_path: Path) -> None:
    add_frames(tmp_path / ".copying", 1, 3)
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "list.txt").write_text("x")
    (tmp_path / ".take.mov").write_bytes(b"x")
    assert takes_in(tmp_path) == {}


def heeds_ctrl_c() -> None:
    """Shells start what runs in the background deaf to Ctrl-C, and children inherit that."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.parametrize("how", [[], pytest.param(["--workers", "2"], marks=pytest.mark.campaign)])
def test_several_takes_are_checked_and_one_that_cannot_be_read_does_not_keep_the_others(
    how: list[str], shot: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "checks.html"
    assert run("check", tmp_path / "takes" / "nothing", shot("good"), "--report", page, *how) == 1
    said = capsys.readouterr().out
    assert f"{shot('good')}: This take is usable" in said
    assert "nothing: cannot be checked yet" in said
    assert "2 takes checked: 1 usable, 0 not, 1 could not be read." in said
    assert "nothing" in page.read_text(encoding="utf-8")


def test_a_take_that_never_was_is_not_said_to_be_removed(tmp_path: Path) -> None:
    (found,) = check_takes([tmp_path / "nope"])
    assert isinstance(found, Unread)
    assert "removed" not in found.fault
    assert "nope" in found.fault


def test_a_check_of_several_takes_that_is_stopped_is_no_pass(
    shot: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stopped(clips: list[Path], **_: object) -> Iterator[Check]:
        yield Check(clip="good", path=clips[0], frames=9, looked_at=9, judged=(1, 9), seconds=1.0, judgements=())
        raise KeyboardInterrupt

    monkeypatch.setattr("psvideo.runs.many_takes.check_folder.check_takes", stopped)
    assert run("check", shot("good"), shot("good").parent / "other") == 1
    said = capsys.readouterr()
    assert "good: This take is usable" in said.out
    assert "stopped" in said.err


def test_watching_reports_every_take_and_ends_well_with_ctrl_c(shot: Callable[[str], Path], tmp_path: Path) -> None:
    folder, page = tmp_path / "takes", tmp_path / "checks.html"
    folder.mkdir()
    command = [sys.executable, "-m", "psvideo.cli.app", "check", "--watch", str(folder), "--interval", "0.2"]
    command.append("--existing")  # its first look may come late
    with subprocess.Popen(
        [*command, "--report", str(page)],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        bufsize=1,
        preexec_fn=heeds_ctrl_c,
    ) as watching:
        try:
            assert watching.stdout is not None
            assert "Ctrl-C ends" in watching.stdout.readline()
            shutil.copytree(shot("good"), folder / "good")
            add_frames(folder / "broken", 1, 30)
            said = ""
            while not ("good: This take" in said and "broken: cannot" in said):
                line = watching.stdout.readline()
                assert line, said
                said += line
            until = time.monotonic() + 120
            while time.monotonic() < until and not (page.is_file() and page.read_text().count('class="verdict') == 2):
                time.sleep(0.1)
            watching.send_signal(signal.SIGINT)
            rest, _ = watching.communicate(timeout=120)
        finally:
            watching.kill()
    assert watching.returncode == 0
    assert "2 takes checked: 1 usable, 0 not, 1 could not be read." in rest
    assert re.search(r"good: This take is usable\.", said)
    assert re.search(r"broken: cannot be checked yet", said)
    assert "Traceback" not in said + rest
    assert sorted(path.name for path in folder.iterdir()) == ["broken", "good"]
    assert "good: This take is usable." in page.read_text()


def test_a_page_among_the_footage_is_refused(shot: Callable[[str], Path], capsys: pytest.CaptureFixture[str]) -> None:
    clip = shot("good")
    assert run("check", clip, "--report", clip / "check.html") == 2
    assert "among the footage" in capsys.readouterr().err
    assert run("check", "--watch", clip.parent, "--report", clip / "check.html") == 2
    assert run("check", "--watch", clip.parent, "--workers", "2") == 2
    assert run("check") == 2
    assert run("check", clip, "--watch", clip) == 2
    assert run("check", "--watch", clip / "nowhere") == 2


def test_a_rig_that_explains_the_light_of_another_surface_is_no_good_rig(
    shot: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Three lights explain any plates; mirrored ones give normals of no surface."""
    rig = (shot("good") / "rig.toml").read_text()
    mirrored = re.sub(r"direction = \[([-\d.e]+),", lambda m: f"direction = [{-float(m[1])!r},", rig)
    assert mirrored != rig
    (tmp_path / "mirrored.toml").write_text(mirrored)
    assert run("check", shot("good"), "--rig", tmp_path / "mirrored.toml") == 1
    assert "normals cannot be those of one surface" in " ".join(capsys.readouterr().out.split())
    assert run("check", shot("good"), "--rig", shot("good") / "rig.toml") == 0


def test_below_360_degrees_what_moves_is_said_to_be_lost_and_what_stands_is_not(shot: Callable[[str], Path]) -> None:
    """No two plates were whole, so that motion was "not known" and takes that lost 84 % passed for usable."""
    found = {name: ps.check(shot(name)) for name in ("half", "half moves")}
    motion = {name: next(line for line in one.judgements if line.subject == "motion") for name, one in found.items()}
    assert [line.grade for line in motion.values()] == ["good", "doubtful"]
    assert all(one.usable for one in found.values())
    assert motion["half"].found == "Nothing moves."
    assert "px from round to round, and the shutter is open for 180 degrees only" in motion["half moves"].found
    assert "left as they are, some of it is lost or comes out wrong" in motion["half moves"].found
    assert "leave `align` at auto, which moves these rows" in motion["half moves"].advice


@pytest.mark.campaign
def test_where_plates_share_hardly_a_row_nobody_knows_whether_anything_moves(shot: Callable[[str], Path]) -> None:
    (motion,) = [line for line in ps.check(shot("quarter moves")).judgements if line.subject == "motion"]
    assert motion.grade == "unknown"
    assert "Whether anything moves is not known: the shutter is open for 90 degrees" in motion.found
    assert motion.advice == "Shoot at 360 degrees, or let the subject stand still."


def _said(report: RunReport, subject: str) -> Judgement:
    return next(line for line in report.judgements if line.subject == subject)


def test_below_360_degrees_neither_rig_nor_surface_is_blamed_for_what_moves(
    shot: Callable[[str], Path], tmp_path: Path
) -> None:
    """Left as they are, rows of other rounds spoil most of it; moved to where things are, they do not."""
    left = ps.normals(shot("half moves"), out=tmp_path / "left", preview=(), align="none")
    brought = ps.normals(shot("half moves"), out=tmp_path / "brought", preview=())
    for report in (left, brought):
        lines = {line.subject: line for line in report.judgements}
        assert lines["motion"].grade == "doubtful"
        assert "rig" not in lines or lines["rig"].grade in ("good", "unknown")
    assert "where what moves is elsewhere" in _said(left, "motion").found
    assert _said(left, "validity").advice.startswith("See the line on motion first")
    assert "are moved along with it" in _said(brought, "motion").found
    assert _said(brought, "validity").grade == "good"


def test_the_rig_beside_the_footage_is_held_against_the_plates_as_in_a_run(
    shot: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A take with two lights exchanged in its rig.toml was called usable; normals took that file, and was not."""
    clip = tmp_path / "clip"
    shutil.copytree(shot("ring"), clip)
    assert run("check", clip) == 0
    assert f"note      The lights stand where {clip / 'rig.toml'} says." in capsys.readouterr().out
    right = (clip / "rig.toml").read_text()
    swapped = right.replace('"light0"', '"other"').replace('"light1"', '"light0"').replace('"other"', '"light1"')
    (clip / "rig.toml").write_text(swapped)
    assert run("check", clip, "--json") == 1
    found = json.loads(capsys.readouterr().out)
    assert "rig" in {one["subject"] for one in found["judgements"] if one["grade"] in ("doubtful", "bad")}
    (tmp_path / "right.toml").write_text(right)
    assert run("check", clip, "--rig", tmp_path / "right.toml") == 0
    assert "The lights stand where" not in capsys.readouterr().out


@pytest.mark.parametrize(("haze", "doubted"), [(0.0, False), (0.08, True)])
def test_light_that_is_added_alike_by_all_lamps_is_no_usable_take_before_the_run_either(
    shot: Callable[[str], Path], tmp_path: Path, *, haze: float, doubted: bool
) -> None:
    """Haze before four lights at one slant leaves no residual: check called usable what normals did not."""
    clip = tmp_path / "clip"
    shutil.copytree(shot("ring"), clip)
    for path in sorted((clip / "frames").iterdir()):
        codes = read_picture(path, cv2.IMREAD_UNCHANGED).astype(np.float64)
        lit = np.percentile(codes, 99, axis=(1, 2), keepdims=True) - codes.min()
        cv2.imwrite(str(path), np.clip(codes + haze * lit, 0, 65535).astype(np.uint16))
    found = ps.check(clip, rig=clip / "rig.toml")
    grades = {line.subject: line.grade for line in found.judgements}
    assert grades["rig"] != "bad"
    assert ("doubtful" in (grades.get("accuracy"), grades.get("validity"))) == doubted


def test_a_rig_that_is_turned_by_180_degrees_shows_where_the_subject_ends(
    shot: Callable[[str], Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Four lights at one slant explain the plates as well the other way round, by a ball that is a bowl."""
    clip = shot("ring")
    turned = re.sub(
        r"direction = \[([-\d.e]+), ([-\d.e]+),",
        lambda m: f"direction = [{-float(m[1])!r}, {-float(m[2])!r},",
        (clip / "rig.toml").read_text(),
    )
    (tmp_path / "turned.toml").write_text(turned)
    said = []
    for rig in (clip / "rig.toml", tmp_path / "turned.toml"):
        assert run("check", clip, "--rig", rig) == 0
        said.append(" ".join(capsys.readouterr().out.split()))
    assert ["do not face outwards where the subject ends" in one for one in said] == [False, True]
