"""The live chain on a virtual clip: what it shows, what it writes and what it says."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lit_ball import LIT_BALL
from live_clip import SCENE, live_clip

import psvideo as ps
from psvideo.cli.app import main
from psvideo.errors import PsvideoError
from psvideo.formats.rig_toml import format_rig
from psvideo.live.showing import newest_result
from psvideo.live.showing.newest_result import NewestRound
from psvideo.live.showing.smaller import Smaller, smaller_plan, smaller_timing
from psvideo.model.coded import Coded, Tone
from psvideo.model.rows.recipe import flash_recipe
from psvideo.model.rows.shutter import row_weights
from psvideo.model.surface import Surface
from psvideo.model.timing import timed_camera
from psvideo.runs.live import live

LIVE_ROWS = 0.05


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return live_clip(tmp_path_factory.mktemp("live"))


@pytest.fixture(scope="module")
def results(clip: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[list[NewestRound], Path]:
    """What the live chain makes of the clip, and the timing that it wrote."""
    out = tmp_path_factory.mktemp("timing") / "timing.json"
    shown: list[NewestRound] = []
    live(clip, rig=clip / "rig.toml", timing_out=out, pace="fastest", shown=shown.append)
    return shown, out


def degrees_apart(one: Surface, other: Surface) -> np.ndarray:
    cosine = (one.normals * other.normals).sum(axis=-1)[one.valid & other.valid]
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def test_live_normals_are_those_of_the_offline_run(clip: Path, results: tuple[list[NewestRound], Path]) -> None:
    take = ps.open_take(clip)
    offline = list(ps.solve(take, ps.read_rig(clip / "rig.toml"), align="none"))
    assert len(results[0]) > 12
    for newest in results[0][::5]:
        same = min(offline, key=lambda instant: abs(instant.round.time_s - newest.round.time_s))
        assert abs(same.round.time_s - newest.round.time_s) < 1e-6
        assert newest.surface is not None
        apart = degrees_apart(newest.surface, same.surface)
        assert apart.size > 500
        assert np.percentile(apart, 99) < 0.2


def test_what_the_subject_reflects_is_looked_at_again_after_some_rounds_and_held_between(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a glossy ball under noise every look gives other numbers."""
    monkeypatch.setattr(newest_result, "LOOKED_AGAIN", 4)
    lights = [(0.6, 0.0), (-0.6, 0.0), (0.0, 0.6), (0.0, -0.6), (0.2, 0.1), (-0.3, 0.3)]
    listed = "".join(f"[[light]]\nname = 'l{n}'\ndirection = [{x}, {y}, 0.8]\n" for n, (x, y) in enumerate(lights))
    gloss = "specular = { strength = 0.3, roughness = 0.35 }\n"
    text = SCENE.replace(LIT_BALL, f'{listed}[[object]]\nmesh = "sphere"\nalbedo = 0.6\n{gloss}')
    (tmp_path / "scene.toml").write_text(text.replace("width_m = 1.6", "width_m = 1.6\nfull_well_e = 9000"))
    clip, shown = Path(ps.shoot(tmp_path / "scene.toml", tmp_path / "clip").path), list[NewestRound]()
    live(clip, rig=clip / "rig.toml", pace="fastest", shown=shown.append)
    surfaces = [one.surface for one in shown if one.surface is not None]
    found = [one.misfit.reflectance for one in surfaces if one.misfit is not None]
    assert len(found) == len(shown) > 8
    looks = [found[first : first + 4] for first in range(0, len(found), 4)]
    assert all(len(set(look)) == 1 for look in looks)
    assert None not in found
    assert len(set(found)) == len(looks)


def test_the_written_timing_agrees_with_sync(clip: Path, results: tuple[list[NewestRound], Path]) -> None:
    written, offline = ps.read_timing(results[1]), ps.find_timing(ps.open_take(clip))
    assert written.order == "marker"
    apart_s = np.abs(offline.start_s[:, None] - written.start_s)
    assert apart_s.min(axis=0).max() / offline.row_time_s < LIVE_ROWS
    same = [
        offline.flashes[k].lights == one.lights for k, one in zip(apart_s.argmin(axis=0), written.flashes, strict=True)
    ]
    assert all(same)
    assert len(written.flashes) == len(offline.flashes)


def test_the_command_says_how_things_stand_and_ends_with_a_summary(
    clip: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["live", str(clip), "--pace", "fastest", "--seconds", "0.9", "--no-page", "--json"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[0]["state"] == "locked"
    assert lines[-1]["done"]
    assert lines[-1]["frames"] == 90
    assert lines[-1]["lost"] == 0
    assert lines[-1]["results"] > 4
    assert lines[0]["fps"] * lines[0]["at_s"] == pytest.approx(90, rel=0.01), "as fast as it went"
    assert lines[0]["results_per_s"] * lines[0]["at_s"] == pytest.approx(lines[0]["results"], rel=0.01)


def test_a_timing_that_cannot_be_written_is_refused_before_a_frame_is_taken(clip: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(ps.PsvideoError, match="cannot be written"):
        live(clip, timing_out=tmp_path / "file" / "timing.json", said=lambda status: pytest.fail("it ran"))
    assert not list((tmp_path).glob(".*"))


def test_a_clip_without_the_plans_strobe_ends_in_one_paragraph(clip: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["live", str(clip), "--pace", "fastest", "--seconds", "0.3", "--no-page"]) == 1
    said = capsys.readouterr().err.strip()
    assert "too few" in said
    assert main(["live", str(clip.parent / "none"), "--no-page"]) == 1
    assert "there is no such clip" in capsys.readouterr().err


def test_a_clip_in_colour_is_followed_with_a_rig_that_knows_the_colours_of_lights(clip: Path, tmp_path: Path) -> None:
    rig = ps.read_rig(clip / "rig.toml")
    coloured = tuple(replace(light, intensity=(1.0, 0.9, 0.8)) for light in rig.lights)
    (tmp_path / "coloured.toml").write_text(format_rig(replace(rig, lights=coloured)), encoding="utf-8")
    assert ps.open_take(clip).clip.channels == 3
    assert live(clip, rig=tmp_path / "coloured.toml", page=False, pace="fastest").results > 1


def test_a_rig_that_gives_no_normals_is_refused_before_anything_is_shown(clip: Path, tmp_path: Path) -> None:
    rig = ps.read_rig(clip / "rig.toml")
    turned = [(float(np.sin(at)), 0.0, float(np.cos(at))) for at in np.linspace(-0.6, 0.6, len(rig.lights))]
    flat = [replace(light, direction=direction) for light, direction in zip(rig.lights, turned, strict=True)]
    (tmp_path / "flat.toml").write_text(format_rig(replace(rig, lights=tuple(flat))), encoding="utf-8")
    opened: list[str] = []
    with pytest.raises(PsvideoError, match="nearly in one plane"):
        live(
            clip, rig=tmp_path / "flat.toml", record=tmp_path / "kept", page=True, pace="fastest", opened=opened.append
        )
    assert not opened
    assert [path.name for path in tmp_path.iterdir()] == ["flat.toml"]


@pytest.mark.parametrize("step", [4, 8])
@pytest.mark.parametrize("upward", [False, True])
def test_a_smaller_frame_sees_flashes_when_its_rows_did(
    clip: Path, results: tuple[list[NewestRound], Path], upward: bool, step: int
) -> None:
    """The mean of the rows' weights is the small row's weight."""
    take, timing = ps.open_take(clip), ps.read_timing(results[1])
    if upward:
        timing = replace(timing, row_time_s=-timing.row_time_s)
    camera = timed_camera(take.plan, timing)
    small = smaller_timing(timing, step, camera.height_px)
    cell = timed_camera(smaller_plan(take.plan, step), small)
    frames = range(10, 14)
    whole = row_weights(camera, timing.start_s, timing.duration_s, frames=frames)
    mean = whole[..., : cell.height_px * step].reshape(*whole.shape[:2], -1, step).mean(axis=-1)
    assert np.abs(row_weights(cell, small.start_s, small.duration_s, frames=frames) - mean).max() < 1e-9
    assert flash_recipe(cell, small, small.flashes[8], frozenset(range(40))).seen.all()


def test_a_mosaic_becomes_colour_in_sixteenths_of_a_code() -> None:
    codes = np.zeros((4, 8), np.uint8)
    codes[::2, ::2], codes[::2, 1::2], codes[1::2, ::2], codes[1::2, 1::2] = 10, 20, 21, 40
    codes[0, 6] = 255
    tone = Tone(zero=np.full((1, 1), 4.0), gain=np.full((1, 1), 1 / 251))
    small = Smaller(step=2, cfa="RGGB").of(Coded(codes=codes, tone=tone))
    assert small.codes.dtype == np.uint16
    assert np.allclose(small.light()[0, 0] * 251, [6, 16.5, 36], atol=0.05)
    assert small.light()[0, 3, 0] >= 0.998, "a cell with a clipped sample is clipped"
