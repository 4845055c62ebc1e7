"""A scene lit by traced edges: the light of the plan's ideal train where the edges are that, else what they say."""

import json
import re
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
import tomlkit
from hypothesis import given, settings
from hypothesis import strategies as st

from psvideo.clip import open_clip, read_frames
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.trace_csv import TraceWriter, read_trace
from psvideo.model.plan import Plan
from psvideo.synth import read_scene, shoot
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.lamps.traced import TraceOptions
from psvideo.synth.lamps.traced_slots import wired_lines
from psvideo.synth.shotplan import true_plan

SPHERE = Path(__file__).resolve().parents[1] / "data_synth" / "sphere.toml"
HZ = 16_000_000
BEGIN = 123_457
HEAD = "# psvideo-trace/1 board=b hz=1000 wiring=gated\ncycle,line,level\n"

Edge = tuple[int, int | str, int]


def scene_file(folder: Path, **strobe: object) -> Path:
    document = tomlkit.parse(SPHERE.read_text())
    document["strobe"].update({"phase_s": 0.0031, **strobe})
    document["camera"].update({"width_px": 24, "height_px": 40})
    path = folder / "scene.toml"
    path.write_text(tomlkit.dumps(document))
    return path


def ideal_edges(plan: Plan, flashes: int, *, lines: Sequence[int] = (0, 1, 2), duty: float = 1.0) -> list[Edge]:
    """Return the edges of a plan's first flashes, in bursts of 0.1 ms where the duty is below 1."""
    train = plan.train(0, flashes)
    edges: list[Edge] = []
    for slot, start_s, duration_s in zip(train.slot, train.start_s, train.duration_s, strict=True):
        for name in plan.flashes[slot].lights:
            line = lines[plan.lights.index(name)]
            bursts = (
                [(0.0, duration_s)] if duty == 1 else [(k * 1e-4, duty * 1e-4) for k in range(round(duration_s / 1e-4))]
            )
            for at_s, on_s in bursts:
                edges.append((BEGIN + round((start_s + at_s) * HZ), line, 1))
                edges.append((BEGIN + round((start_s + at_s + on_s) * HZ), line, 0))
    return sorted(edges)


def write(path: Path, edges: Sequence[Edge]) -> Path:
    with path.open("w") as file:
        TraceWriter(file, board="atmega328p", hz=HZ, wiring="gated").write(edges)
    return path


def film(
    folder: Path, scene: Path, name: str, edges: Sequence[Edge] | None, **lines: int
) -> tuple[np.ndarray, dict[str, Any]]:
    options = None if edges is None else TraceOptions(path=write(folder / "trace.csv", edges), lines=lines)
    clip = shoot(scene, folder / name, trace=options).path
    footage = open_clip(clip)
    frames = np.stack([frame.image for frame in read_frames(footage, footage.numbers)])
    return frames, json.loads((clip / "truth" / "timing.json").read_text())


def first_plate(clip: Path) -> np.ndarray:
    """Return the true plate of a clip's first complete flash."""
    flashes = json.loads((clip / "truth" / "timing.json").read_text())["flashes"]
    plate = next(flash["plate"] for flash in flashes if "plate" in flash)
    pixels: np.ndarray = next(iter(OpenEXR.File(str(clip / "truth" / plate)).channels().values())).pixels
    return pixels


def test_a_perfect_trace_gives_the_clip_of_the_ideal_train(tmp_path: Path) -> None:
    scene = scene_file(tmp_path)
    plan = true_plan(read_scene(scene))
    ideal, truth = film(tmp_path, scene, "ideal", None)
    traced, found = film(tmp_path, scene, "traced", ideal_edges(plan, 60))
    begun = [flash for flash in truth["flashes"] if flash["start_s"] > 0]
    assert [f["slot"] for f in found["flashes"]] == [f["slot"] for f in begun]
    for flash, true in zip(found["flashes"], begun, strict=True):
        assert flash["start_s"] == pytest.approx(true["start_s"], abs=2e-7)
        assert flash["duration_s"] == pytest.approx(true["duration_s"], abs=2e-7)
        assert flash["complete"] == true["complete"]
    later = [n for n in range(len(ideal)) if n * 0.01 > begun[1]["start_s"]]
    np.testing.assert_allclose(traced[later], ideal[later], atol=2e-4)


def test_bursts_are_kept_and_power_is_what_they_give(tmp_path: Path) -> None:
    scene = scene_file(tmp_path)
    plan = true_plan(read_scene(scene))
    full, _ = film(tmp_path, scene, "full", ideal_edges(plan, 60))
    bursts, truth = film(tmp_path, scene, "bursts", ideal_edges(plan, 60, duty=0.25))
    lit = [flash for flash in truth["flashes"] if flash["lights"]]
    assert {round(power, 6) for flash in lit for power in flash["lights"].values()} == {0.25}
    assert {flash["bursts"] for flash in lit} == {10}
    assert bursts.sum() / full.sum() == pytest.approx(0.25, rel=0.01)
    whole = np.abs(bursts - 0.25 * full).reshape(len(full), full.shape[1], -1).max(axis=2)
    assert whole.max() > 0.004, "rows at a flash's edge see its single bursts"
    assert np.median(whole) < 1e-3


def test_lights_of_one_flash_may_burst_differently(tmp_path: Path) -> None:
    scene = scene_file(
        tmp_path,
        flash=[{"lights": {"key": 0.5, "left": 0.2}, "duration_s": 0.001}, {"lights": {}, "duration_s": 0.001}],
    )
    plan = true_plan(read_scene(scene))

    def edges(key: bool, left: bool) -> list[Edge]:
        found: list[Edge] = []
        for start_s in plan.train(0, 40).start_s[::2]:
            for k in range(10):
                at = BEGIN + round((start_s + k * 1e-4) * HZ)
                found += [(at, 0, 1), (at + 800, 0, 0)] if key else []
                found += [(at, 1, 1), (at + 320, 1, 0)] if left else []
        return sorted(found, key=lambda edge: edge[0])

    both, truth = film(tmp_path, scene, "both", edges(True, True))
    lit = next(flash for flash in truth["flashes"] if flash["lights"] and flash["complete"])
    assert lit["lights"] == pytest.approx({"key": 0.5, "left": 0.2})
    alone = []
    for name, picked in (("key", (True, False)), ("left", (False, True))):
        only = scene_file(
            tmp_path, flash=[{"lights": {name: 1.0}, "duration_s": 0.001}, {"lights": {}, "duration_s": 0.001}]
        )
        alone.append(film(tmp_path, only, name, edges(*picked), **({"left": 1} if name == "left" else {}))[0])
    np.testing.assert_allclose(both, alone[0] + alone[1], atol=1e-3)
    plates = [first_plate(tmp_path / name) for name in ("both", "key", "left")]
    np.testing.assert_allclose(plates[0], plates[1] + plates[2], atol=1e-6)
    assert plates[1].max() > 0.1


def test_a_clip_lies_within_the_run_where_the_scene_leaves_the_phase_open(tmp_path: Path) -> None:
    scene = scene_file(tmp_path)
    document = tomlkit.parse(scene.read_text())
    del document["strobe"]["phase_s"]
    scene.write_text(tomlkit.dumps(document))
    _, truth = film(tmp_path, scene, "clip", ideal_edges(true_plan(read_scene(scene)), 60))
    assert truth["flashes"][0]["start_s"] < 0.02
    assert truth["flashes"][-1]["start_s"] > 0.1


def test_lights_hang_on_the_lines_that_are_named(tmp_path: Path) -> None:
    scene = scene_file(tmp_path)
    plan = true_plan(read_scene(scene))
    usual, _ = film(tmp_path, scene, "usual", ideal_edges(plan, 40))
    swapped, _ = film(tmp_path, scene, "swapped", ideal_edges(plan, 40, lines=(5, 0, 1)), key=5)
    np.testing.assert_array_equal(usual, swapped)
    assert wired_lines(plan, {"top": 0}) == {1: ("key",), 2: ("left",), 0: ("top",)}


def test_a_run_that_was_stopped_and_begun_again_starts_its_cycle_again(tmp_path: Path) -> None:
    scene = scene_file(tmp_path)
    plan = true_plan(read_scene(scene))
    first = ideal_edges(plan, 2)
    again = [(cycle + round(0.06 * HZ), line, level) for cycle, line, level in ideal_edges(plan, 8)]
    _, truth = film(tmp_path, scene, "clip", first + again)
    lit = [flash for flash in truth["flashes"] if flash["lights"]]
    assert [flash["slot"] for flash in truth["flashes"]][:6] == [0, 1, 0, 1, 2, 3]
    assert lit[2]["start_s"] - lit[0]["start_s"] == pytest.approx(0.06 * (1 + 40e-6), abs=1e-7)


Change = Callable[[list[Edge]], list[Edge]]
UNFIT: dict[str, tuple[Change, dict[str, object], dict[str, int], type[PsvideoError], str]] = {
    "another order": (
        lambda e: [(c, (int(n) + 1) % 3, v) for c, n, v in e],
        {},
        {},
        PsvideoError,
        "flash 1 of the trace lights",
    ),
    "another dark time": (lambda e: e, {"dark_s": 0.0115}, {}, PsvideoError, "flash 2 of the trace starts 11.001 ms"),
    "longer flashes": (
        lambda e: [(c + 8000 * (1 - v), n, v) for c, n, v in e],
        {},
        {},
        PsvideoError,
        "lasts 1.5 ms",
    ),
    "no light at all": (lambda e: [], {}, {}, PsvideoError, "no light was ever on"),
    "a line without a light": (lambda e: [(c, 7, v) for c, _, v in e], {}, {}, PsvideoError, "line 7 is lit"),
    "a light that is not there": (lambda e: e, {}, {"kye": 0}, UsageError, "did you mean 'key'"),
    "two lights on a line": (lambda e: e, {}, {"key": 1, "left": 1}, PsvideoError, "key and left on line 1"),
    "jitter as well": (lambda e: e, {"jitter_s": 1e-6}, {}, UsageError, "jitter_s"),
    "a synced scene": (lambda e: e, {"mode": "synced"}, {}, UsageError, "mode synced"),
}


@pytest.mark.parametrize("fault", UNFIT)
def test_a_trace_that_does_not_fit_is_refused(tmp_path: Path, fault: str) -> None:
    change, strobe, lines, kind, named = UNFIT[fault]
    edges = change(ideal_edges(true_plan(read_scene(scene_file(tmp_path))), 20))
    with pytest.raises(kind, match=re.escape(named)):
        film(tmp_path, scene_file(tmp_path, **strobe), "clip", edges, **lines)
    assert not (tmp_path / "clip").exists()


@settings(max_examples=60, deadline=None)
@given(
    tail_s=st.sampled_from([0.0, 1e-4, 1e-3]), cuts=st.lists(st.floats(0.01, 0.99), min_size=1, max_size=4, unique=True)
)
def test_bursts_without_gaps_are_one_flash_where_tails_are_alike(tail_s: float, cuts: list[float]) -> None:
    emission = Emission(rise_s=tail_s, fall_s=tail_s)
    marks = 0.002 * np.array([0.0, *sorted(cuts), 1.0])
    bursts = tuple((float(a), float(b - a)) for a, b in pairwise(marks))
    since_s = np.linspace(-0.001, 0.02, 50)
    np.testing.assert_allclose(emission.share(since_s, 0.002, bursts), emission.share(since_s, 0.002), atol=1e-9)


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    edges: list[Edge] = [(5, "S0", 1), (7, "X0", 1), (7, 0, 1), (9, 0, 0), (9, "X0", 0), (12, 0, 1)]
    trace = read_trace(write(tmp_path / "trace.csv", edges))
    assert {name: list(cycles) for name, cycles in trace.edges.items()} == {"S0": [5], "X0": [7, 9], "0": [7, 9, 12]}
    assert trace.lights == (0,)
    assert trace.pulses(0).tolist() == [[7, 9]], "a light that is still on has no pulse yet"
    assert trace.pulses(3).size == 0


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "not the trace"),
        ("cycle,line,level\n1,0,1\n", "not the trace"),
        (HEAD.replace("/1", "/2"), "psvideo-trace/2"),
        (HEAD + "1,0,1\n2,0\n", "line 4: found '2,0'"),
        (HEAD + "1,0,1\n2,0,1\n", "is 1 already"),
        (HEAD + "1,0,0\n", "is 0 already"),
        (HEAD + "5,0,1\n4,0,0\n", "cycle 4 comes after 5"),
    ],
)
def test_a_damaged_trace_is_named_with_its_line(tmp_path: Path, text: str, named: str) -> None:
    path = tmp_path / "trace.csv"
    path.write_text(text)
    with pytest.raises(PsvideoError, match=re.escape(named)):
        read_trace(path)
