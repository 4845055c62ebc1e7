"""A run that is cut into pieces gives the bytes that it gives at one go, wherever it is cut."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import psvideo as ps
from psvideo.errors import AllDoneError, PsvideoError, UsageError
from psvideo.formats.whole_folders import begun_folder, whole_folder
from psvideo.report.observe.observed import InstantFacts, Observed
from psvideo.report.observe.worst import Thumbnail, Worst
from psvideo.runs.piece_notes import noted, write_notes
from psvideo.runs.pieces import cut, piece_named
from psvideo.runs.solving import Found
from psvideo.synth.shoot import shoot

SCENE = """
schema = "psvideo-scene/1"
name = "{name}"
frames = {frames}
seed = 3
camera = {{ width_px = 48, height_px = 36, fps = 100, shutter_deg = {shutter}, readout_s = 0.0097, width_m = 1.0 }}
ambient = {{ level = 0.05 }}
{strobe}
object = [{{ mesh = "sphere", motion = {{ velocity_m_per_s = [{speed}, 0.0, 0.0] }} }}]
light = [
  {{ name = "a", direction = [0.5, 0.0, 0.8] }},
  {{ name = "b", direction = [-0.5, 0.1, 0.8] }},
  {{ name = "c", direction = [0.1, 0.5, 0.8] }},
]
"""
CLIPS: dict[str, dict[str, object]] = {
    "still": {"frames": 250, "shutter": 360, "strobe": "", "speed": 0.0},
    "moving": {"frames": 250, "shutter": 360, "strobe": "", "speed": 0.1},
    "half a shutter": {"frames": 250, "shutter": 180, "strobe": "", "speed": 0.03},
    "no dark slot": {"frames": 400, "shutter": 360, "strobe": "strobe = { marker = false }", "speed": 0.02},
    "few dark slots": {"frames": 300, "shutter": 360, "strobe": "strobe = { dark_every = 5 }", "speed": 0.05},
    "dark slots far apart": {"frames": 420, "shutter": 360, "strobe": "strobe = { dark_every = 20 }", "speed": 0.05},
}
SHORT: dict[str, object] = {"frames": 200, "shutter": 360, "strobe": "", "speed": 0.1}
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


def filmed(folder: Path, name: str, facts: Mapping[str, object]) -> Path:
    (folder / "scene.toml").write_text(SCENE.format(name=name.replace(" ", "_"), **facts), encoding="utf-8")
    shoot(folder / "scene.toml", folder / "clip")
    return folder / "clip"


def digest(out: Path) -> dict[str, str]:
    files = [path for path in sorted(out.rglob("*")) if path.is_file() and path.name not in PER_RUN]
    return {str(path.relative_to(out)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def judged(out: Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads((out / "report.json").read_text(encoding="utf-8"))
    return report | {"settings": None}


def same_in_pieces(clip: Path, folder: Path, pieces: tuple[str, ...], **options: Any) -> None:
    """Solve a clip at one go, and again by some pieces and what they leave; compare all files and the reports."""
    given = {"rig": clip / "rig.toml", **options}
    ps.normals(clip, out=folder / "whole", **given)
    for piece in pieces:
        ps.normals(clip, out=folder / "pieces", piece=piece, **given)
    ps.normals(clip, out=folder / "pieces", resume=True, **given)
    assert digest(folder / "pieces") == digest(folder / "whole")
    assert judged(folder / "pieces") == judged(folder / "whole")
    assert not [*folder.glob(".*")]


def test_a_run_in_pieces_gives_the_bytes_of_one_at_one_go(tmp_path: Path) -> None:
    clip = filmed(tmp_path, "moving", SHORT)
    options: dict[str, Any] = {"aov": ["beauty"], "with_ambient": True, "denoise": 2}
    same_in_pieces(clip, tmp_path, ("0/9", "9/9"), **options)
    with pytest.raises(AllDoneError):
        ps.normals(clip, out=tmp_path / "pieces", rig=clip / "rig.toml", piece="2/3", **options)


@pytest.mark.campaign
@pytest.mark.parametrize("pieces", [("7/7",), ("2/7", "5/7"), ("20/60", "33/60", "34/60")])
@pytest.mark.parametrize("name", CLIPS)
@pytest.mark.parametrize("options", OPTIONS)
def test_any_cut_gives_the_bytes_of_one_go(name: str, options: str, pieces: tuple[str, ...], tmp_path: Path) -> None:
    clip = filmed(tmp_path, name, CLIPS[name])
    named = {"first_light": "a"} if name == "no dark slot" else {}
    same_in_pieces(clip, tmp_path, pieces, **OPTIONS[options], **named)


def test_pieces_are_as_equal_as_they_come_and_leave_nothing_out() -> None:
    for count in range(1, 12):
        pieces = cut(range(1001, 1011), count)
        assert [number for piece in pieces for number in piece] == [*range(1001, 1011)]
        assert len({len(piece) for piece in pieces}) <= 2
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
        facts=[facts],
        counts={"a": np.arange(5), "b": np.arange(5) * 2},
        blurs_px=[0.7],
        light_at_points=[np.random.default_rng(1).random((4, 2))],
        ambient_measured={128: 0.25},
        worst=Worst([worst]),
    )
    picture = np.arange(12, dtype=np.uint8).reshape(2, 2, 3)
    write_notes(tmp_path, range(1003, 1004), Found(observed=observed, picture=picture, reserved=("No scale.",)))
    ((numbers, found),) = noted(tmp_path)
    seen = found.observed
    assert (numbers, found.reserved, seen.facts) == (range(1003, 1004), ("No scale.",), [facts])
    assert (seen.blurs_px, seen.ambient_measured) == ([0.7], {128: 0.25})
    assert all(np.array_equal(seen.counts[light], observed.counts[light]) for light in observed.counts)
    assert np.array_equal(seen.light_at_points[0], observed.light_at_points[0])
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
