"""A run that is cut into pieces gives the bytes that it gives at one go, wherever it is cut."""

import itertools
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bytes_of_files import digest_of_results
from clips_in_pieces import filmed, judged, same_in_pieces

import psvideo as ps
from psvideo.clip import read_frames
from psvideo.errors import AllDoneError
from psvideo.plates import flash_plates, spread
from psvideo.plates.align import light_history
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.gather import gather
from psvideo.plates.spread import rounds_spread, spread_over
from psvideo.runs.instants import piece_frames
from psvideo.runs.instants.pieces import cut, piece_named
from psvideo.solve import steady

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


@pytest.mark.campaign
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
    assert digest_of_results(tmp_path / "pieces") == digest_of_results(tmp_path / "whole")
    assert judged(tmp_path / "pieces") == judged(tmp_path / "whole")


def test_what_comes_in_late_is_looked_at_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spread, "EACH", 2)
    take = ps.open_take(filmed(tmp_path, frames=46, speed_px=0.3))
    timing = ps.find_timing(take)
    every = {one.number: one for one in gather(take, timing, aligning=Aligning())}
    read: list[int] = []

    def counted(clip: Any, numbers: Any, **options: Any) -> Any:
        read.extend(numbers)
        return read_frames(clip, numbers, **options)

    monkeypatch.setattr(flash_plates, "read_frames", counted)
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
