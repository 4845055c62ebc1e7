"""The readout time from a strobed clip: found without the plan's word, true within its own errors, with its sign."""

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from memory_frame import MemoryFrame

from psvideo.calibrate.strobed_readout import StrobedReadout, readout_of
from psvideo.capture import cameras
from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.model.plan import Plan
from psvideo.model.rows.row_profiles import collect
from psvideo.sync.find import timing_from_rows
from psvideo.synth import Noise, TrueClock, expose

PlanMaker = Callable[..., Plan]


def measured(plan: Plan, *, seed: int = 0, frames: int = 60) -> StrobedReadout:
    """Film a textured scene under the plan and measure with a plan that does not know the readout."""
    camera = plan.camera
    rng = np.random.default_rng(seed)
    plates: dict[int, np.ndarray] = {
        slot: 0.1 + 0.6 * rng.random((camera.height_px, camera.width_px)) for slot in plan.lit_slots
    }
    clock = TrueClock(phase_s=0.0123 + 0.001 * seed, offset_ppm=30.0)
    noise = Noise(full_well_e=20_000, read_e=8)
    shot = expose(plates, plan, frames=frames, clock=clock, noise=noise, bits=12, seed=seed)
    indices, profiles = collect(MemoryFrame(n, image) for n, image in zip(shot.indices, shot.frames, strict=True))
    unknown = replace(plan, camera=replace(camera, readout_s=None))
    return readout_of(unknown, timing_from_rows(unknown, indices, profiles), frames=frames)


@pytest.mark.parametrize("share", [0.4, -0.8, 1.0])
def test_the_readout_is_found_to_its_own_error_with_its_sign(share: float, make_plan: PlanMaker) -> None:
    plan = make_plan(readout=share)
    assert plan.camera.readout_s is not None
    found = measured(plan)
    off_s = abs(found.readout_s - plan.camera.readout_s)
    assert off_s < 3 * found.rows_error_s
    assert off_s < 1e-3 * abs(plan.camera.readout_s)
    assert found.rows_error_s < 1e-3 * abs(plan.camera.readout_s)
    assert found.direction == ("top-down" if share > 0 else "bottom-up")
    assert found.frame_share == pytest.approx(abs(share), abs=3 * found.frame_share_error)
    assert not found.warnings, "what is measured is no reason to warn"


@pytest.mark.campaign
def test_claimed_errors_are_those_that_are_made(make_plan: PlanMaker) -> None:
    plan = make_plan(readout=0.6, height_px=80)
    assert plan.camera.readout_s is not None
    found = [measured(plan, seed=seed, frames=40) for seed in range(8)]
    ratios = [(one.readout_s - plan.camera.readout_s) / one.rows_error_s for one in found]
    assert 0.4 < np.sqrt(np.mean(np.square(ratios))) < 1.8


def test_the_strobe_s_tolerance_has_its_part_in_the_error(make_plan: PlanMaker) -> None:
    exact, loose = (measured(make_plan(readout=0.5, clock_tolerance_ppm=ppm)) for ppm in (50.0, 5000.0))
    assert loose.clock_error_s == pytest.approx(loose.readout_s * 5000e-6 / np.sqrt(3))
    assert loose.error_s == pytest.approx(np.hypot(loose.rows_error_s, loose.clock_error_s))
    assert loose.error_s > 20 * exact.error_s


def test_a_tolerance_that_is_given_counts_instead_of_the_plan_s(
    shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clip = str(shared_data / "clips" / "plain")
    found = []
    for arguments in ([], ["--led-tolerance-ppm", "5000"]):
        assert main(["calibrate", "readout", clip, "--json", *arguments]) == 0
        found.append(json.loads(capsys.readouterr().out))
    assert found[1]["tolerance_ppm"] == 5000
    assert found[1]["clock_error_s"] == pytest.approx(found[1]["readout_s"] * 5000e-6 / np.sqrt(3))
    assert found[0]["clock_error_s"] < 0.2 * found[1]["clock_error_s"]


def test_a_timing_that_took_the_plan_s_word_is_no_measurement(make_plan: PlanMaker) -> None:
    plan = make_plan(mode="synced", readout=0.0)
    timing = timing_from_rows(plan, np.arange(8), np.zeros((8, plan.camera.height_px)))
    with pytest.raises(PsvideoError, match="does not show the readout"):
        readout_of(plan, timing, frames=8)


@pytest.mark.parametrize(("clip", "true_ms"), [("plain", 10.0), ("ambient", 0.7 * 1001 / 96)])
def test_another_simulator_s_clips_are_measured_and_the_table_takes_the_line(
    clip: str, true_ms: float, shared_data: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", "readout", str(shared_data / "clips" / clip), "--make", "Acme", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert abs(result["readout_s"] * 1e3 - true_ms) < 3e3 * result["rows_error_s"]
    header = "make,model,mode,width_px,height_px,fps,readout_ms,direction,sure,source"
    mode = cameras._mode(next(csv.DictReader([header, result["camera_line"]])))
    assert (mode.width_px, mode.height_px) == (320, 180)
    assert mode.fps == {"plain": Fraction(100), "ambient": Fraction(96_000, 1001)}[clip]
    assert mode.readout_s * 1e3 == pytest.approx(true_ms, rel=1e-4)
    records = Path(__file__).resolve().parents[1] / "calibration" / "records" / "readout.csv"
    columns = records.read_text(encoding="utf-8").splitlines()[0].split(",")
    assert len(next(csv.reader([result["record_line"]]))) == len(columns)


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (["nowhere"], 1, "Without --led-hz a strobed clip is expected"),
        (["one.png", "two.png"], 2, "2 files without --led-hz"),
        (["clip", "--rows", "1080"], 2, "--rows: belongs to the stripes"),
        (["clip", "--near", "16ms"], 2, "--near: belongs to the stripes"),
        (["clip", "--led-hz", "500", "--plan", "plan.toml"], 2, "--plan: belongs to a strobed clip"),
    ],
)
def test_what_does_not_fit_together_is_said(
    arguments: list[str], status: int, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["calibrate", "readout", *arguments]) == status
    said = capsys.readouterr().err
    assert words in said
    assert len(said.strip().splitlines()) == 1
