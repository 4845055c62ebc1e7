"""A timing.json that is given to a run is the take's, or refused: what each of its keys may hold."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from psvideo.cli.app import main
from psvideo.clip import Take
from psvideo.errors import PsvideoError
from psvideo.formats.timing_json import read_timing
from psvideo.plates.named_timing import read_or_find_timing
from psvideo.plates.used_flashes import used_of
from psvideo.sync.open_take import open_take

SCENE = """schema = "psvideo-scene/1"
name = "ball"
frames = 14
seed = 3
[camera]
width_px = 40
height_px = 30
fps = 100
shutter_deg = 360.0
readout_s = 0.01
width_m = 1.6
[strobe]
clock_offset_ppm = 40.0
flash = [{lights = {a = 1.0}, duration_s = 0.001}, {lights = {b = 1.0}, duration_s = 0.001},
  {lights = {}, duration_s = 0.001}]
[[light]]
name = "a"
direction = [0.6, 0.0, 0.8]
[[light]]
name = "b"
direction = [-0.6, 0.0, 0.8]
[[object]]
mesh = "sphere"
albedo = 0.8
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clip of 14 frames, numbered from 1, and what ``sync`` says of it."""
    folder = tmp_path_factory.mktemp("given")
    (folder / "scene.toml").write_text(SCENE)
    assert main(["synth", str(folder / "scene.toml"), "-o", str(folder / "clip"), "-q"]) == 0
    assert main(["sync", str(folder / "clip"), "-o", str(folder / "timing.json"), "-q"]) == 0
    return folder


@pytest.fixture(scope="module")
def take(folder: Path) -> Take:
    return open_take(folder / "clip")


def edited(folder: Path, edit: Callable[[dict[str, Any]], None]) -> Path:
    data = json.loads((folder / "timing.json").read_text())
    edit(data)
    path = folder / "edited.json"
    path.write_text(json.dumps(data))
    return path


def put(key: str, value: object) -> Callable[[dict[str, Any]], None]:
    return lambda data: data.update({key: value})


def flash(key: str, value: object) -> Callable[[dict[str, Any]], None]:
    """Put a value into the fourth flash."""
    return lambda data: data["flashes"][3].update({key: value})


def exchange(data: dict[str, Any]) -> None:
    """Exchange when the third and the sixth flash start: both light the same."""
    one, other = data["flashes"][2], data["flashes"][5]
    one["start_s"], other["start_s"] = other["start_s"], one["start_s"]


def test_what_sync_wrote_is_taken(folder: Path, take: Take) -> None:
    path = folder / "timing.json"
    assert read_or_find_timing(take, path, first_light=None) == read_timing(path)


@pytest.mark.parametrize(
    ("edit", "said"),
    [
        (flash("start_s", 1e12), r"key 'flashes\[4\]\.start_s' is 1e\+12: expected a time while the clip is exposed"),
        (flash("start_s", -1.0), r"key 'flashes\[4\]\.start_s' is -1: expected a time while the clip is exposed"),
        (exchange, r"key 'flashes\[4\]\.start_s' is 0\.0\d+, before the flash listed ahead of it"),
        (flash("duration_s", 100.0), r"key 'flashes\[4\]\.duration_s' is 100: expected the plan's 0\.001 s"),
        (flash("duration_s", 0.0009), r"key 'flashes\[4\]\.duration_s' is 0\.0009: expected the plan's 0\.001 s"),
        (put("rise_s", 9.0), "key 'rise_s' is 9: expected no longer than"),
        (put("fall_s", 9.0), "key 'fall_s' is 9: expected no longer than"),
        (put("exposure_s", 1.0), "key 'exposure_s' is 1: expected no longer than the frame period of 10 ms"),
        (put("row_time_s", -5.0), "key 'row_time_s' is -5, so that 30 rows take 150 s: expected no longer than"),
        (put("clock_offset_ppm", 1e9), r"key 'clock_offset_ppm' is 1e\+09: expected within 20000 ppm of 0"),
        (
            put("dropped_frames", [{"after": 99999, "count": 1}]),
            r"'dropped_frames\[1\]\.after' is 99999: expected .* 1 to 14",
        ),
        (
            put("dropped_frames", 2 * [{"after": 4, "count": 1}]),
            r"'dropped_frames\[2\]\.after' is 4, as that of another",
        ),
        (put("dropped_frames", [{"after": 4, "count": 10**12}]), r"'dropped_frames\[1\]\.count' is 10{12}: expected"),
        (put("repeated_frames", [3, -4]), r"key 'repeated_frames\[2\]' is -4: expected the number of one of"),
        (put("repeated_frames", [3, 3]), r"key 'repeated_frames\[2\]' is 3, as another one: expected each frame once"),
        (put("repeated_frames", list(range(1, 15))), "key 'repeated_frames' lists all of the clip's frames"),
    ],
)
def test_what_cannot_be_of_the_take_is_refused(
    folder: Path, take: Take, edit: Callable[[dict[str, Any]], None], said: str
) -> None:
    path = edited(folder, edit)
    with pytest.raises(PsvideoError, match=said) as refused:
        read_or_find_timing(take, path, first_light=None)
    assert str(refused.value).startswith(f"{path}: ")
    assert "make it again with psvideo sync" in str(refused.value)


def test_frames_that_are_all_repeated_hold_no_flash(folder: Path, take: Take) -> None:
    timing = read_timing(edited(folder, put("repeated_frames", [7])))
    assert not any(one.complete for one in used_of(take, timing, [7]).flashes)
