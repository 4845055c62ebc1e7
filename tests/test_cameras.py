"""Several cameras that saw one strobe: codes, places in them, and clocks, against clocks that are known."""

import itertools
import json
import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from psvideo.cli.app import main
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.clocks_json import format_clocks, read_clocks
from psvideo.formats.plan_toml import format_plan, parse_plan, read_plan
from psvideo.model.camera_clocks import CameraClock, CameraClocks
from psvideo.model.marker import alike_turns, cycle_places, first_break
from psvideo.model.maximal_length import TAPS, maximal_length
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash, Timing
from psvideo.runs.steps.output import rate_of
from psvideo.strobe.link.boards import BOARDS, Board, capabilities
from psvideo.strobe.program import make_program
from psvideo.sync.shared_flashes import CameraTake, camera_clocks
from psvideo.synth import shoot

PlanMaker = Callable[..., Plan]
TRUE = CameraClock(clip="B", first_flash=0, offset_s=1.7, rate_ppm=41.0, drift_ppm_per_s=0.0, shared=0, error_s=0.0)


@pytest.mark.parametrize("order", TAPS)
def test_every_run_of_a_maximal_length_sequence_but_zeros_stands_once(order: int) -> None:
    bits = maximal_length(order)
    runs = {tuple((bits * 2)[n : n + order]) for n in range(len(bits))}
    assert len(bits) == len(runs) == 2**order - 1
    assert not any(not any(run) for run in runs)


def test_a_coded_plan_shows_its_place_in_any_run_of_rounds(make_plan: PlanMaker) -> None:
    plan = replace(make_plan(), dark_code=5)
    assert alike_turns(plan) == (0,)
    cycle = plan.cycle_slots
    assert len(cycle) == 3 * 31 + 16
    for place, length in itertools.product(range(len(cycle)), (24, 30)):
        assert cycle_places(plan, [cycle[(place + k) % len(cycle)] for k in range(length)]) == (place,)
    assert parse_plan(format_plan(plan)) == plan


def seen(plan: Plan, clock: CameraClock, *, begin: int, count: int, error_s: float = 0.0, seed: int = 0) -> CameraTake:
    """What a camera sees of the flashes ``begin`` and on, whose true times are the strobe's, on the reference clock."""
    train = plan.train(begin, count)
    camera_s = np.array([_on_camera(clock, float(time_s)) for time_s in train.start_s])
    camera_s += error_s * np.random.default_rng(seed).standard_normal()
    flashes = tuple(
        Flash(
            index=k,
            slot=int(slot),
            lights=plan.flashes[slot].lights,
            start_s=float(start_s),
            duration_s=0.0008,
            complete=True,
        )
        for k, (slot, start_s) in enumerate(zip(train.slot, camera_s, strict=True))
    )
    timing = Timing(
        clip=clock.clip,
        frame_period_s=plan.camera.frame_period_s,
        exposure_s=plan.camera.exposure_s,
        row_time_s=1e-5,
        clock_offset_ppm=0.0,
        phase_error_rows=0.1,
        phase_error_s=max(error_s, 1e-7),
        order="marker",
        flashes=flashes,
    )
    return CameraTake(plan=plan, timing=timing)


def _on_camera(clock: CameraClock, reference_s: float) -> float:
    """Invert the polynomial by Newton's steps."""
    camera_s = reference_s - clock.offset_s
    for _ in range(6):
        camera_s += reference_s - float(clock.reference_s(np.array([camera_s]))[0])
    return camera_s


@pytest.mark.parametrize(("lights", "order"), [("a,b,c", 6), ("a,b,c,d", 5), ("a,b,c,d,e,f,g,h", 4)])
def test_a_coded_marker_is_the_longest_that_every_board_plays(tmp_path: Path, lights: str, order: int) -> None:
    camera = ["--size", "640x360", "--fps", "120", "--readout", "8ms", "--flash", "0.8ms", "--marker", "coded"]
    assert main(["capture-plan", *camera, "--lights", lights, "-o", str(tmp_path / "plan.toml"), "-q"]) == 0
    plan = read_plan(tmp_path / "plan.toml")
    assert plan.dark_code == order
    most = min(board.steps for board in BOARDS.values())
    assert len(plan.cycle_slots) <= most < len(replace(plan, dark_code=order + 1).cycle_slots)
    assert main(["capture-plan", *camera, "--lights", lights, "--dark-every", "4"]) == 2


AT_FIRST = replace(TRUE, clip="A", offset_s=0.0, rate_ppm=0.0)


@pytest.mark.parametrize("drift", [0.0, 8.0])
@pytest.mark.parametrize("begin", [-60, 0, 90])
def test_a_clock_is_found_from_the_flashes_that_two_cameras_share(
    make_plan: PlanMaker, drift: float, begin: int
) -> None:
    plan = replace(make_plan(), dark_code=7)
    other = replace(plan, camera=replace(plan.camera, fps=Fraction(50), exposure_s=0.008))
    true = replace(TRUE, drift_ppm_per_s=drift)
    clocks = camera_clocks([seen(plan, AT_FIRST, begin=0, count=200), seen(other, true, begin=begin, count=200)])
    found = clocks.cameras[1]
    assert (clocks.numbering, found.first_flash) == ("marker", begin)
    at_s = np.array([_on_camera(true, float(time_s)) for time_s in plan.train(max(begin, 0), 50).start_s])
    assert found.reference_s(at_s) == pytest.approx(true.reference_s(at_s), abs=0.5e-6)
    assert found.drift_ppm_per_s == pytest.approx(drift, abs=0.01)


def test_whole_cycles_that_nothing_decides_are_listed_and_never_chosen(make_plan: PlanMaker) -> None:
    plan = make_plan()
    takes = [seen(plan, AT_FIRST, begin=0, count=60), seen(plan, TRUE, begin=17, count=60)]
    with pytest.raises(PsvideoError, match=r"repeats itself every .* may have begun"):
        camera_clocks(takes)
    began_s = takes[0].timing.flashes[17].start_s - takes[1].timing.flashes[0].start_s
    clocks = camera_clocks(takes, starts_s=[100.0, 100.0 + began_s + 0.1 * plan.cycle_s])
    assert (clocks.numbering, clocks.cameras[1].first_flash) == ("given", 17)
    with pytest.raises(UsageError, match="decides nothing"):
        camera_clocks(takes, starts_s=[100.0, 100.0 + began_s + 0.45 * plan.cycle_s])


@pytest.mark.parametrize("start_s", [12.4, 60.0, -60.0])
def test_a_start_decides_by_the_cameras_seconds_and_not_by_the_strobes(make_plan: PlanMaker, start_s: float) -> None:
    """The strobe runs slow by 3000 ppm: in 12 s it is late by one cycle."""
    plan = make_plan()
    slow = 1 / (1 + 3e-3) - 1
    begin = int(start_s * (1 + slow) / plan.cycle_s * len(plan.cycle_slots)) + 3
    later = replace(AT_FIRST, clip="B", rate_ppm=1e6 * slow, offset_s=start_s * (1 + slow))
    last = abs(begin) + 100
    takes = [
        seen(plan, replace(AT_FIRST, rate_ppm=1e6 * slow), begin=0, count=last if begin > 0 else 100),
        seen(plan, later, begin=begin, count=100 if begin > 0 else last),
    ]
    found = camera_clocks(takes, starts_s=[5.0, 5.0 + start_s]).cameras[1]
    assert found.first_flash == begin
    assert found.offset_s == pytest.approx(start_s, abs=1e-6)
    nearer = camera_clocks(takes, starts_s=[5.0, 5.0 + start_s + 0.2 * plan.cycle_s]).cameras[1]
    assert nearer.first_flash == begin


def test_starts_that_are_listed_are_in_the_cameras_seconds(make_plan: PlanMaker) -> None:
    plan = make_plan()
    slow = replace(AT_FIRST, rate_ppm=-3000.0)
    takes = [seen(plan, slow, begin=0, count=1400), seen(plan, replace(slow, clip="B"), begin=1200, count=1400)]
    with pytest.raises(PsvideoError, match="may have begun") as refusal:
        camera_clocks(takes)
    said = re.findall(r"may have begun (.*), \.\.\. s after", str(refusal.value))[0]
    cycle_s = float(np.diff(takes[0].timing.start_s[[0, len(plan.cycle_slots)]])[0])
    assert np.diff([float(one) for one in said.split(", ")]) == pytest.approx(cycle_s, abs=0.0011)
    earliest = -1400 + next(n for n in range(1, 12) if (n - 1400 - 1200) % len(plan.cycle_slots) == 0)
    began_s = _on_camera(slow, float(plan.train(earliest, 1).start_s[0])) - takes[1].timing.flashes[0].start_s
    assert float(said.split(", ")[0]) == pytest.approx(began_s, abs=0.0006)


@pytest.mark.parametrize("dark_code", [None, 7])
def test_clips_that_are_said_not_to_have_run_at_the_same_time_share_nothing(
    make_plan: PlanMaker, dark_code: int | None
) -> None:
    """Even where only one number would let them: a code that is unique says nothing of clips of different times."""
    plan = make_plan() if dark_code is None else replace(make_plan(), dark_code=dark_code)
    takes = [seen(plan, AT_FIRST, begin=0, count=60), seen(plan, TRUE, begin=17, count=60)]
    began_s = takes[0].timing.flashes[17].start_s - takes[1].timing.flashes[0].start_s
    for apart_s in (60.0, -60.0, began_s + 20.7 * plan.cycle_s):
        with pytest.raises(UsageError, match=r"is said to begin .* s after A, and then they share no flashes"):
            camera_clocks(takes, starts_s=[0.0, apart_s])
    assert camera_clocks(takes, starts_s=[0.0, began_s + 0.2 * plan.cycle_s]).cameras[1].first_flash == 17
    if dark_code is not None:  # one number alone needs no more than to be told from no overlap
        assert camera_clocks(takes, starts_s=[0.0, began_s + 0.4 * plan.cycle_s]).cameras[1].first_flash == 17


def test_exact_numbers_after_any_cut_of_two_seconds(make_plan: PlanMaker) -> None:
    plan = replace(make_plan(lights=("key", "left", "right", "top")), dark_code=7)
    count = round(2.0 * len(plan.cycle_slots) / plan.cycle_s)
    first = seen(plan, AT_FIRST, begin=0, count=count)
    for begin in (*range(-count + 12, count - 12, 31), count - 12):
        assert camera_clocks([first, seen(plan, TRUE, begin=begin, count=count)]).cameras[1].first_flash == begin


def test_cameras_of_different_strobes_are_refused(make_plan: PlanMaker) -> None:
    plan = replace(make_plan(), dark_code=6)
    first = seen(plan, AT_FIRST, begin=0, count=200)
    other = make_plan(duration_s=0.0009)
    with pytest.raises(PsvideoError, match="strobe is not A's"):
        camera_clocks([first, seen(replace(other, dark_code=6), TRUE, begin=0, count=200)])
    with pytest.raises(PsvideoError, match=r"expected 0\.[0-9]+ ms of flash 1, found 0\.9 ms"):
        camera_clocks([first, seen(replace(other, dark_code=6), TRUE, begin=0, count=200)])
    darker = replace(plan, dark_s=plan.dark_s + 1e-3)
    with pytest.raises(PsvideoError, match=r"expected a dark time of [0-9.]+ ms, found [0-9.]+ ms, as"):
        camera_clocks([first, seen(darker, TRUE, begin=0, count=200)])
    names = {light: f"{light}2" for light in plan.lights}
    renamed = tuple(
        replace(one, lights={names[light]: power for light, power in one.lights.items()}) for one in plan.flashes
    )
    with pytest.raises(
        PsvideoError, match=f"expected {plan.lights[0]} in flash 1 of the round, found {plan.lights[0]}2"
    ):
        camera_clocks([first, replace(first, plan=replace(plan, flashes=renamed))])
    with pytest.raises(PsvideoError, match="saw different strobes"):
        camera_clocks([first, seen(plan, replace(TRUE, rate_ppm=2400.0), begin=0, count=200)])
    with pytest.raises(PsvideoError, match="share 0 flash"):
        camera_clocks([seen(plan, AT_FIRST, begin=0, count=100), seen(plan, TRUE, begin=150, count=20)])
    late = seen(plan, TRUE, begin=0, count=200).timing
    jumped = tuple(replace(f, start_s=f.start_s + 3e-4 * (f.index > 120)) for f in late.flashes)
    with pytest.raises(PsvideoError, match="do not follow one clock"):
        camera_clocks([first, CameraTake(plan=plan, timing=replace(late, flashes=jumped))])
    misnamed = camera_clocks([first, seen(plan, replace(TRUE, rate_ppm=1020.0), begin=0, count=200)])
    assert "misnamed" in misnamed.notes[0]
    guessed = CameraTake(plan=plan, timing=replace(first.timing, order="guess"))
    with pytest.raises(PsvideoError, match=r"is a guess.* see that every light fires"):
        camera_clocks([first, guessed])


@pytest.mark.parametrize("board", BOARDS.values(), ids=lambda board: board.name)
def test_a_plan_beside_a_boards_log_is_the_strobe_of_one_without(make_plan: PlanMaker, board: Board) -> None:
    """A board plays whole ticks and the bursts nearest to a power; 1600 ticks of 0.5 us are not 0.0008 s in binary."""
    whole = replace(make_plan(), dark_code=6)
    powers = (1.0, 0.37, 1.0)
    dimmed = tuple(
        replace(flash, lights=dict.fromkeys(flash.lights, powers[n % 3]), duration_s=0.00081234 + 1e-7 * n)
        for n, flash in enumerate(whole.flashes)
    )
    for plan in (whole, replace(whole, flashes=dimmed, dark_s=0.01012345)):
        played = make_program(plan, capabilities(board, board.first_wiring)).played
        assert played.flashes != plan.flashes or plan is whole
        takes = [seen(plan, AT_FIRST, begin=0, count=200), seen(played, TRUE, begin=17, count=200)]
        for pair in (takes, takes[::-1]):
            found = camera_clocks(pair).cameras[1]
            assert (found.first_flash, found.shared) == (17 if pair is takes else -17, 183)
    ticks = tuple(replace(flash, duration_s=round(flash.duration_s / 5e-7) * 5e-7) for flash in whole.flashes)
    logged = replace(whole, flashes=ticks)
    assert logged.flashes != whole.flashes
    camera_clocks([seen(whole, AT_FIRST, begin=0, count=200), seen(logged, TRUE, begin=0, count=200)])
    for wrong in (
        replace(logged, dark_s=logged.dark_s + 2e-6),
        replace(logged, flashes=(replace(ticks[0], duration_s=ticks[0].duration_s + 2e-6), *ticks[1:])),
        replace(logged, flashes=(replace(ticks[0], lights=dict.fromkeys(ticks[0].lights, 0.98)), *ticks[1:])),
    ):
        with pytest.raises(PsvideoError, match="strobe is not A's"):
            camera_clocks([seen(whole, AT_FIRST, begin=0, count=200), seen(wrong, TRUE, begin=0, count=200)])


@pytest.mark.parametrize("which", [0, 1])
def test_a_clip_whose_strobe_started_again_is_named_with_where_and_what_to_do(make_plan: PlanMaker, which: int) -> None:
    plan = replace(make_plan(), dark_code=7)
    takes = [seen(plan, AT_FIRST, begin=0, count=200), seen(plan, replace(TRUE, offset_s=-1.7), begin=5, count=200)]
    left = [flash for flash in takes[which].timing.flashes if not 80 <= flash.index < 83]
    flashes = tuple(replace(flash, index=n) for n, flash in enumerate(left))
    broken = replace(takes[which].timing, flashes=flashes)
    period_s, numbers = plan.camera.frame_period_s, tuple(n for n in range(5001, 5400) if n != 5007)
    last = 5001 + int(left[79].start_s // period_s)
    takes[which] = replace(takes[which], timing=broken, numbers=numbers)
    with pytest.raises(PsvideoError, match=rf"{broken.clip}: its strobe started again.*folder of their own") as refusal:
        camera_clocks(takes)
    first, after = map(int, re.findall(r"between frames (\d+) and (\d+)", str(refusal.value))[0])
    assert first <= last < after
    assert after - first < 2 * 8 * 4, "a code may go on for some rounds as if nothing were amiss"
    half = (flashes[:80], tuple(replace(flash, index=n) for n, flash in enumerate(flashes[80:])))
    for part, begin in zip(half, (0, 83), strict=True):
        takes[which] = replace(takes[which], timing=replace(broken, flashes=part))
        assert camera_clocks(takes).cameras[1].first_flash == (5 + begin if which else 5 - begin)


def test_the_first_break_is_where_no_place_in_the_cycle_fits(make_plan: PlanMaker) -> None:
    plan = replace(make_plan(), dark_code=3)
    cycle = plan.cycle_slots
    for start, cut in itertools.product(range(len(cycle)), (1, 9, 30)):
        slots = [cycle[(start + n) % len(cycle)] for n in range(60)]
        assert first_break(plan, slots) is None
        broken = slots[:cut] + slots[cut + 1 :]
        fits = [n for n in range(len(broken) + 1) if cycle_places(plan, broken[:n])]
        assert first_break(plan, broken) == (None if fits[-1] == len(broken) else fits[-1])


SCENE = """
schema = "psvideo-scene/1"
name = "{name}"
frames = {frames}
seed = {seed}
[camera]
width_px = 24
height_px = 64
fps = {fps}
shutter_deg = {shutter}
readout_s = {readout}
width_m = 0.4
colour = "grey"
[strobe]
flash_s = 0.0008
dark_s = 0.0103
dark_code = 5
clock_offset_ppm = {ppm}
phase_s = {phase}
[[light]]
name = "a"
direction = [0.3, 0.3, 0.9]
[[light]]
name = "b"
direction = [-0.3, 0.3, 0.9]
[output]
dropped = {dropped}
[[object]]
mesh = "plane"
scale = 4.0
albedo = {{ pattern = "noise", size_m = 0.03 }}
"""


def film(folder: Path, name: str, **scene: object) -> Path:
    (folder / f"{name}.toml").write_text(SCENE.format(name=name, **scene))
    assert main(["synth", str(folder / f"{name}.toml"), "-o", str(folder / name), "-q"]) == 0
    return folder / name


def test_sync_of_several_clips_of_unlike_cameras_writes_their_clocks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The strobe's second is 60 ppm longer than A's and 25 ppm longer than B's; B began 0.21 s later."""
    a, b = 60e-6, 25e-6
    first = film(
        tmp_path, "A", frames=48, seed=1, fps=100, shutter=360, readout=0.008, ppm=60, phase=-0.2, dropped=[20]
    )
    later_s, start_s = 0.21, 0.2 / (1 + a)
    phase_b_s = -(later_s / (1 + a) + start_s) * (1 + b)
    other = film(
        tmp_path, "B", frames=40, seed=2, fps=120, shutter=360, readout=-0.006, ppm=25, phase=phase_b_s, dropped=[]
    )
    capsys.readouterr()
    assert main(["sync", str(first), str(other), "-o", str(tmp_path / "clocks.json")]) == 0
    assert "known from the marker" in capsys.readouterr().out
    clocks = json.loads((tmp_path / "clocks.json").read_text())
    found = clocks["cameras"][1]
    assert (clocks["schema"], clocks["reference"], clocks["numbering"]) == ("psvideo-clocks/1", "A", "marker")
    assert found["offset_s"] == pytest.approx(later_s, abs=2e-6)
    assert found["rate_ppm"] == pytest.approx(35.0, abs=5.0)
    (tmp_path / "again").mkdir()
    alike = other.rename(tmp_path / "again" / "A")
    assert main(["sync", str(first), str(alike), "-o", str(tmp_path / "alike.json")]) == 0
    assert "2 clips are called A" in capsys.readouterr().err
    assert main(["sync", str(first), str(first), "--starts", "0,0", "-o", str(tmp_path / "one.json")]) == 0
    assert "are called" not in capsys.readouterr().err, "one clip against itself"
    other = alike.rename(tmp_path / "B")
    assert main(["sync", str(first), str(other), "--first-light", "a"]) == 2
    assert "belongs to one clip" in capsys.readouterr().err
    assert main(["sync", str(first), str(other), "--starts", "0"]) == 2


SLIDING = """
schema = "psvideo-scene/1"
name = "{name}"
frames = 36
seed = 3
[camera]
width_px = 96
height_px = 60
fps = {fps}
shutter_deg = 360
readout_s = {readout_s}
width_m = 0.96
[strobe]
flash_s = 0.0008
dark_s = 0.0102
phase_s = {phase_s}
clock_offset_ppm = {ppm}
[[light]]
name = "key"
direction = [0.3, 0.4, 0.9]
[[light]]
name = "left"
direction = [-0.5, 0.1, 0.9]
[[light]]
name = "right"
direction = [0.4, -0.5, 0.9]
[[object]]
mesh = "sphere"
height_m = 0.36
position_m = [{x_m}, 0.0, 0.0]
albedo = {{ pattern = "noise", colour = [0.9, 0.8, 0.7], second = [0.2, 0.3, 0.4], size_m = 0.06 }}
motion = {{ velocity_m_per_s = [0.6, 0.0, 0.0] }}
"""
LATER_S, FASTER_PPM = 0.0713, 40.0


def filmed(folder: Path, *, name: str, fps: int, readout_s: float, later_s: float, ppm: float) -> Path:
    """Film a sphere that slides by 60 px a second, ``later_s`` seconds after the first camera began."""
    phase_s, x_m = (0.0031 - later_s) / (1 + 1e-6 * ppm), -0.18 + 0.6 * later_s
    scene = folder / f"{name}.toml"
    scene.write_text(SLIDING.format(name=name, fps=fps, readout_s=readout_s, phase_s=phase_s, ppm=-ppm, x_m=x_m))
    return shoot(scene, folder / name).path


def plate_numbers(folder: Path) -> set[int]:
    return {int(file.suffixes[-2].removeprefix(".")) for file in folder.iterdir()}


def picture_of(file: Path) -> tuple[NDArray[np.float32], float]:
    with OpenEXR.File(str(file)) as read:
        return np.asarray(read.channels()["RGB"].pixels, np.float32), float(read.header()["psvideo:time_s"])


def test_cameras_of_one_strobe_show_the_same_instants_under_the_same_numbers(tmp_path: Path) -> None:
    a = filmed(tmp_path, name="a", fps=119, readout_s=0.007, later_s=0.0, ppm=0.0)
    b = filmed(tmp_path, name="b", fps=100, readout_s=-0.009, later_s=LATER_S, ppm=FASTER_PPM)
    clocks = tmp_path / "clocks.json"
    assert main(["sync", str(a), str(b), "-o", str(clocks), "--starts", f"0,{LATER_S}", "-q"]) == 0
    found = read_clocks(clocks)
    assert found.of("b").offset_s == pytest.approx(LATER_S, abs=5e-6)
    for clip in (a, b):
        out = str(tmp_path / f"plates_{clip.name}")
        assert main(["split", str(clip), "--fps", "24", "--resync", str(clocks), "-o", out, "-q"]) == 0
    numbers = [plate_numbers(tmp_path / f"plates_{name}" / "key") for name in "ab"]
    shared = sorted(numbers[0] & numbers[1])
    assert len(shared) >= 4
    for light, number in itertools.product(("key", "left", "right"), shared):
        (one, one_s), (other, other_s) = (
            picture_of(tmp_path / f"plates_{name}" / light / f"{name}_{light}.{number}.exr") for name in "ab"
        )
        assert np.abs(one - other).mean() < 0.003 * one.mean()
        assert found.of("b").reference_s(np.float64(other_s)) == pytest.approx(one_s, abs=1e-7)


def test_instants_that_no_two_cameras_share_are_refused(tmp_path: Path, make_plan: PlanMaker) -> None:
    plan = make_plan()
    clocks = CameraClocks(cameras=(AT_FIRST, TRUE), numbering="marker", cycle_s=0.05, first_instant_s=0.01)
    path = tmp_path / "clocks.json"
    path.write_text(format_clocks(clocks), encoding="utf-8")
    assert read_clocks(path) == clocks
    with pytest.raises(UsageError, match="the clocks are those of A, B"):
        rate_of("24", plan, resync=path, clip="C")
    with pytest.raises(UsageError, match="Add `fps`"):
        rate_of("frame", plan, resync=path, clip="B")
    record = json.loads(format_clocks(clocks))
    path.write_text(json.dumps({**record, "cameras": record["cameras"][::-1]}), encoding="utf-8")
    with pytest.raises(PsvideoError, match="the reference is 'A', and the first camera 'B'"):
        read_clocks(path)
    path.write_text(format_clocks(clocks), encoding="utf-8")
    path.write_text(path.read_text(encoding="utf-8").replace('"rate_ppm": 41.0', '"rate_ppm": "41"'), encoding="utf-8")
    with pytest.raises(PsvideoError, match=r"clocks\.json: .*rate_ppm"):
        read_clocks(path)


@given(
    st.floats(-100, 100), st.floats(-200, 200), st.floats(-5, 5), st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=5)
)
def test_times_carried_to_another_camera_and_back_are_the_same(
    offset_s: float, rate_ppm: float, drift: float, times_s: list[float]
) -> None:
    clock = replace(TRUE, offset_s=offset_s, rate_ppm=rate_ppm, drift_ppm_per_s=drift)
    at_s = np.array(times_s)
    assert clock.camera_s(clock.reference_s(at_s)) == pytest.approx(at_s, abs=1e-8)
