"""Results at any instant: which instants a rate asks for, on paper, and what is delivered at them."""

import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import OpenEXR
import pytest

import psvideo as ps
from psvideo.cli.options.typed import parse_instants
from psvideo.clip import decoded_once, kept
from psvideo.clip.in_file import RowsInFile
from psvideo.errors import UsageError
from psvideo.export.sequences.planes import InstantPictures, planes_of
from psvideo.export.sequences.tags import Tags
from psvideo.export.space import Space
from psvideo.model.plan import Plan
from psvideo.model.quantities import QUANTITIES
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Surface
from psvideo.model.timing import Flash
from psvideo.plates.align import rounds
from psvideo.plates.align.comb import comb_of, schedule_of
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.align.velocity.moving import followed_at
from psvideo.plates.gather import gather
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.runs.delivery.relit import TILT, TURN_S, blur_of
from psvideo.runs.instants import depths
from psvideo.runs.steps.output import rate_of, sequence_fps
from psvideo.solve.depth import depth_of

PlanMaker = Callable[..., Plan]


def flashes_of(plan: Plan, count: int, without: tuple[int, ...] = ()) -> tuple[Flash, ...]:
    train = plan.train(0, count)
    return tuple(
        Flash(
            index=k,
            slot=int(slot),
            lights=plan.flashes[slot].lights,
            start_s=float(start_s),
            duration_s=float(duration_s),
            complete=k not in without,
        )
        for k, (slot, start_s, duration_s) in enumerate(zip(train.slot, train.start_s, train.duration_s, strict=True))
    )


@pytest.mark.parametrize(
    ("given", "exact"), [(23.976, "24000/1001"), ("59.94", "60000/1001"), (12.5, "25/2"), ("0.3", "3/10")]
)
def test_rounded_rates_mean_the_same_in_python_as_on_the_command_line(
    make_plan: PlanMaker, given: str | float, exact: str
) -> None:
    plan = make_plan(lights=("a", "b", "c", "d"), dark=False)
    assert parse_instants(str(given)) == Fraction(exact)
    comb = rate_of(given, plan)
    assert sequence_fps(plan, comb) == Fraction(exact)


@pytest.mark.parametrize("fps", ["24", "24000/1001", "25", "30", "48", "60", "frame"])
def test_instants_of_a_rate_are_exact_each_once_and_lie_between_a_rounds_neighbours(
    make_plan: PlanMaker, fps: str
) -> None:
    plan = make_plan()
    comb = rate_of(parse_instants(fps), plan)
    assert not isinstance(comb, str)
    assert sequence_fps(plan, comb) == comb.fps == (plan.camera.fps if fps == "frame" else Fraction(fps))
    flashes = flashes_of(plan, 40)
    due = schedule_of(plan, flashes, comb, start=1001, end_s=flashes[-1].start_s)
    shown = [one for instants in due.by_round.values() for one in instants]
    first = 0.5 * (plan.camera.exposure_s + (plan.camera.readout_s or 0.0))
    assert [number for number, _ in shown] == list(range(shown[0][0], shown[-1][0] + 1))
    for number, time_s in shown:
        assert time_s == first + float(Fraction(number - 1001) / comb.fps)
    middles = {1001 + r: np.mean([f.start_s + f.duration_s / 2 for f in flashes[4 * r : 4 * r + 3]]) for r in range(10)}
    for number, instants in due.by_round.items():
        for _, time_s in instants:
            assert abs(time_s - middles[number]) == min(abs(time_s - middle) for middle in middles.values())
    assert sum(due.left_out) + len(shown) == int((flashes[-1].start_s - first) * comb.fps) + 1


def test_instants_without_a_round_near_are_left_out_and_counted(make_plan: PlanMaker) -> None:
    plan = make_plan()
    comb = comb_of(Fraction(60), plan.camera)
    whole = schedule_of(plan, flashes_of(plan, 48), comb, start=1001, end_s=0.4)
    holed = schedule_of(plan, flashes_of(plan, 48, without=(18, 22)), comb, start=1001, end_s=0.4)
    assert set(holed.numbers) < set(whole.numbers)
    assert holed.left_out[1] == len(whole.numbers) - len(holed.numbers) > 1
    assert schedule_of(plan, flashes_of(plan, 3, without=(1,)), comb, start=1001, end_s=0.4).numbers == ()


def test_rates_that_cannot_be_had_are_refused(make_plan: PlanMaker) -> None:
    plan = make_plan()
    with pytest.raises(UsageError, match="nothing more often can be known"):
        rate_of(240, plan)
    with pytest.raises(UsageError, match="add `fps`"):
        rate_of("round", plan, shutter=180)
    for angle in (0.0, 361.0):
        with pytest.raises(UsageError, match="expected an angle"):
            rate_of(24, plan, shutter=angle)
    for wrong in ("fast", "0", "-24", "1/0"):
        with pytest.raises(UsageError, match="fps"):
            rate_of(parse_instants(wrong), plan)


def test_the_sources_time_code_counts_the_frames_of_the_delivery_where_the_camera_is_faster() -> None:
    tags = Tags(
        fps=Fraction(24),
        colour="",
        plan_sha256="",
        camera_fps=Fraction(120_000, 1001),
        first_time_code="10:00:00:12",
    )
    assert [tags.time_code(0.008 + k / 24) for k in (0, 11, 12)] == ["10:00:00:12", "10:00:00:23", "10:00:01:00"]


SCENE = """
schema = "psvideo-scene/1"
name = "pass"
frames = 20
[camera]
width_px = 96
height_px = 64
fps = 100
shutter_deg = 360.0
readout_s = 0.009
width_m = 0.30
colour = "grey"
[strobe]
flash_s = 0.0008
phase_s = 0.001
[[light]]
name = "a"
direction = [0.5, 0.2, 0.85]
[[light]]
name = "b"
direction = [-0.5, 0.2, 0.85]
[[light]]
name = "c"
direction = [0.0, -0.5, 0.85]
[[object]]
mesh = "plane"
scale = 2.0
position_m = [0.0, 0.0, -0.1]
albedo = { pattern = "noise", size_m = 0.03 }
motion = { velocity_m_per_s = [0.6, 0.0, 0.0] }
"""


PX_PER_FRAME = 1.92


@pytest.fixture(scope="module")
def passing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A textured wall that passes by at 192 px a second."""
    folder = tmp_path_factory.mktemp("passing")
    (folder / "scene.toml").write_text(SCENE)
    return Path(ps.shoot(folder / "scene.toml", folder / "clip").path)


@pytest.mark.skipif(sys.platform == "win32", reason="all threads share one place in an open file there")
def test_moved_plates_take_no_memory_where_a_run_has_a_file_for_them_and_show_the_same(
    passing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kept, "STAYS_FROM_BYTES", 1)
    take = ps.open_take(passing)
    timing = ps.find_timing(take)
    in_memory = [plate for one in gather(take, timing, aligning=Aligning()) for plate in one.plates]
    with decoded_once(take, output=tmp_path / "out") as stored:
        count = 0
        for one in gather(stored, timing, aligning=Aligning()):
            for plate in one.plates:
                assert isinstance(plate.picture.frames[0].codes, RowsInFile), plate.light
                assert np.array_equal(plate.image, in_memory[count].image)
                assert np.array_equal(plate.picture.thinned(3), in_memory[count].picture.thinned(3))
                count += 1
    assert count == len(in_memory) >= 9
    assert all(isinstance(plate.picture.frames[0].codes, np.ndarray) for plate in in_memory)


def exr(path: Path, channel: str) -> np.ndarray:
    pixels: np.ndarray = OpenEXR.File(str(path)).channels()[channel].pixels
    return pixels


def test_results_at_every_camera_frame_show_it_where_it_was_then(passing: Path, tmp_path: Path) -> None:
    report = ps.normals(passing, rig=passing / "rig.toml", out=tmp_path / "out", fps="frame", aov=["motion"])
    assert len(report.instants) > 10
    pictures = [exr(path, "RGB")[..., 1] for path in sorted((tmp_path / "out" / "albedo").iterdir())]
    assert len(pictures) == len(report.instants)
    inner = np.s_[8:-8, 16:-24]
    window = cv2.createHanningWindow((96 - 40, 64 - 16), cv2.CV_64F)
    cut = [np.asarray(one[inner], np.float64) for one in pictures]
    went = [cv2.phaseCorrelate(one, other, window)[0][0] for one, other in pairwise(cut)]
    assert went == pytest.approx([PX_PER_FRAME] * len(went), abs=0.4)
    assert np.mean(went) == pytest.approx(PX_PER_FRAME, abs=0.1)
    times_s = [one.time_s for one in report.instants]
    assert times_s == pytest.approx([0.0095 + (one.number - 1001) / 100 for one in report.instants], abs=1e-9)
    said = OpenEXR.File(str(next((tmp_path / "out" / "normals").iterdir()))).header()
    assert said["framesPerSecond"] == 100
    motions = sorted((tmp_path / "out" / "motion").iterdir())
    rows, cols = np.mgrid[:64, :96].astype(np.float32)
    for k in range(1, len(pictures) - 1):
        u, v, back_u, back_v = (exr(motions[k], name) for name in QUANTITIES["motion"].channels)
        for other, way_u, way_v in ((pictures[k + 1], u, v), (pictures[k - 1], back_u, back_v)):
            there = cv2.remap(np.asarray(other, np.float32), cols + way_u, rows - way_v, cv2.INTER_CUBIC)
            warped, stayed = (np.abs(one - pictures[k])[inner].mean() for one in (there, other))
            assert warped < 0.5 * stayed
        assert np.median(u[inner]) == pytest.approx(PX_PER_FRAME, abs=0.3)
    with pytest.raises(UsageError, match="would be repeated"):
        ps.normals(passing, rig=passing / "rig.toml", out=tmp_path / "none", fps="frame", align="none")


def test_depth_of_what_moves_is_integrated_before_the_next_instant_is_followed(
    passing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Either takes as much memory as all else of a run: not at the same time."""
    followed, integrated = [0], [0]

    def integrating(*given: Any) -> Any:
        assert threading.current_thread() is threading.main_thread(), "which cannot follow meanwhile"
        depth = depth_of(*given)
        integrated[0] += 1
        return depth

    def following(*given: Any, **more: Any) -> Any:
        followed[0] += 1
        assert integrated[0] == max(followed[0] - 2, 0), "the first is integrated in another way, to fix the scale"
        return followed_at(*given, **more)

    monkeypatch.setattr(depths, "depth_of", integrating)
    monkeypatch.setattr(rounds, "followed_at", following)
    report = ps.normals(passing, rig=passing / "rig.toml", out=tmp_path / "out", aov=["depth", "motion"], preview=())
    assert integrated[0] == len(report.instants) - 1 >= 2


def test_a_part_of_the_frames_shows_the_same_instants_under_the_same_numbers(passing: Path, tmp_path: Path) -> None:
    timing, light = tmp_path / "timing.json", "a"
    ps.sync(passing, out=timing)
    numbers = sorted(int(path.stem.split(".")[-1]) for path in (passing / "frames").iterdir())
    for name, frames in (("all", None), ("part", f"{numbers[6]}-{numbers[-1]}")):
        ps.split(passing, out=tmp_path / name, timing=timing, frames=frames, fps=24)
    whole, part = ({path.name: path for path in (tmp_path / name / light).iterdir()} for name in ("all", "part"))
    assert set(part) == set(whole) - {min(whole)}
    for name, path in part.items():
        apart = np.abs(exr(path, "Y") - exr(whole[name], "Y"))[8:-8, 16:-24]
        assert apart.mean() < 0.001, "but for what flows from other flashes at the cut"


def test_a_rate_so_low_that_no_instant_is_near_a_round_is_refused_as_that(passing: Path, tmp_path: Path) -> None:
    with pytest.raises(
        UsageError,
        match=r"no instant at this rate, the first at .*is near one of the clip's \d+ whole rounds\. Give a hi",
    ):
        ps.split(passing, out=tmp_path / "out", fps=0.001)


def test_the_relit_movie_is_blurred_as_the_plates_are(make_plan: PlanMaker) -> None:
    """Of a matte surface that moves: what it shows under a further light is blurred as under that one it would be."""
    plan, fps = make_plan(lights=("a", "b", "c", "d"), dark=False), Fraction(24)
    ways = np.array([[0.5, 0.2, 0.85], [-0.5, 0.2, 0.85], [0.0, -0.5, 0.85], [0.1, 0.4, 0.9]])
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    rig = Rig(
        lights=tuple(Light(name=n, direction=tuple(d), intensity=(1.4,)) for n, d in zip("abcd", ways, strict=True))
    )
    normal = np.array([0.1, -0.2, 0.97])
    albedo, blurred = np.zeros((2, 12, 16, 3), np.float32)
    albedo[:, 4:8], blurred[:, 2:10] = (0.6, 0.4, 0.2), (0.3, 0.2, 0.1)

    def plates(surface: np.ndarray) -> tuple[LightPlate, ...]:
        rows = np.ones(12, bool)
        lit = [np.asarray(1.4 * (way @ normal) * surface, np.float32) for way in ways]
        return tuple(
            LightPlate(light=name, number=1007, time_s=0.1, picture=mixture_of(image), seen=rows)
            for name, image in zip("abcd", lit, strict=True)
        )

    sharp = plates(albedo)
    assert blur_of(Round(number=1007, plates=sharp, open_plates=sharp), plan, rig, fps) is None
    added = blur_of(Round(number=1007, plates=sharp, open_plates=plates(blurred)), plan, rig, fps)
    assert added is not None
    angle = 2 * np.pi * 1007 / 24 / TURN_S
    light = np.array([TILT * np.cos(angle), TILT * np.sin(angle), np.sqrt(1 - TILT**2)])
    np.testing.assert_allclose(added, (blurred - albedo) * (normal @ light), atol=1e-5)


def test_motion_vectors_are_named_and_signed_as_the_program_wants_them() -> None:
    """One pixel to the right and two up in a frame, three to the left and four down in the one before."""
    flat = np.zeros((2, 2, 3), np.float32)
    surface = Surface(normals=flat, albedo=flat, valid=np.ones((2, 2), bool))
    motion = np.broadcast_to(np.array([1.0, 2.0, -3.0, -4.0], np.float32), (2, 2, 4))
    made = InstantPictures(surface=surface, space=Space(), motion=lambda: motion, program="nuke")
    plain = {name: float(plane[0, 0]) for name, plane in planes_of("motion", made).items()}
    assert plain == {"forward.u": 1, "forward.v": 2, "backward.u": -3, "backward.v": -4}
    blender = [float(plane[0, 0]) for plane in planes_of("motion", replace(made, program="blender")).values()]
    assert blender == [-3, -4, -1, -2]
