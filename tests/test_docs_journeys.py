"""The five journeys of docs/journeys.md, each run as the page writes it, in a folder that holds what it names alone."""

import shlex
import shutil
import struct
import time
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import OpenEXR
import pytest
from angles import angles_deg
from nuke_reader import picture_of, read_script
from numpy.typing import NDArray
from PIL import Image

import psvideo as ps
from psvideo.cli.app import main
from psvideo.clip import open_clip, read_frames
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_toml import format_rig, read_rig
from psvideo.model.camera import Encoding
from psvideo.model.rig import Rig
from psvideo.model.turn import EXIF

ROOT = Path(__file__).resolve().parents[1]
Array = NDArray[np.float64]


def travel(title: str) -> None:
    """Run the block of a section of the page, in the folder that is the current one."""
    page = (ROOT / "docs" / "journeys.md").read_text(encoding="utf-8")
    block = page.split(f"## {title}\n")[1].split("```sh\n")[1].split("```")[0]
    began_s, worked_s = time.perf_counter(), time.process_time()
    for line in block.strip().splitlines():
        assert main(shlex.split(line)[1:]) == 0, line
    took_s, work_s = time.perf_counter() - began_s, time.process_time() - worked_s
    print(f"{title}: {took_s:.1f} s, {work_s:.1f} s of processor time")


def planes(out: Path, what: str) -> Array:
    return pixels(min((out / what).iterdir()))


def pixels(file: Path) -> Array:
    channels = OpenEXR.File(str(file), separate_channels=True).channels()
    return np.stack([channels[name].pixels for name in ("RGB" if "R" in channels else "Y")], axis=-1).astype(np.float64)


def mean_error_deg(found: Array, true: Array, where: NDArray[np.bool_]) -> float:
    assert where.sum() > 300
    return float(angles_deg(found, true)[where].mean())


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("journeys") / "clip"
    ps.shoot(ROOT / "data_synth" / "sphere.toml", folder)
    return folder


def test_twelve_stills_become_a_relit_web_page(here: Path) -> None:
    stills = (ROOT / "docs" / "stills.md").read_text(encoding="utf-8")
    assert "psvideo stills photos/ --lights lights.lp -o out/\npsvideo view out/ --export relit.html\n" in stills
    names = [f"IMG_{number}.JPG" for number in (4, 5, 7, 8, 12, 19, 20, 21, 30, 31, 100, 101)]
    angles, lean = np.radians(np.arange(12) * 30), np.where(np.arange(12) % 2, 0.35, 0.6)
    lights = np.stack([lean * np.cos(angles), lean * np.sin(angles), np.sqrt(1 - lean**2)], axis=1)
    y, x = (np.mgrid[:64, :64] - 31.5) / 27
    inside = x**2 + y**2 < 1
    normals = np.stack([x, -y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)
    (here / "photos").mkdir()
    for name, light in zip(names, lights, strict=True):
        shade = np.where(inside, 0.7 * np.maximum(normals @ light, 0), 0)
        signal = np.where(shade <= 0.0031308, 12.92 * shade, 1.055 * shade ** (1 / 2.4) - 0.055)
        Image.fromarray((255 * signal + 0.5).astype(np.uint8)).save(here / "photos" / name, quality=98)
    rows = [f"{name} {' '.join(map(str, light))}" for name, light in zip(names, lights.tolist(), strict=True)]
    (here / "lights.lp").write_text("\n".join(["12", *rows, ""]))
    travel("Twelve stills to a relit web page")
    assert mean_error_deg(planes(here / "out", "normals"), normals, normals[..., 2] > 0.3) < 1.5
    assert "<canvas" in (here / "relit.html").read_text(encoding="utf-8")


FOCAL, COLS, ROWS, BALL_M = 1100.0, 400, 260, 0.04
GOLDEN = np.pi * (3 - np.sqrt(5))
TURNS = GOLDEN * np.arange(20)
REACH = 0.25 + 0.25 * np.sqrt(np.arange(20) / 19)
LAMPS = np.stack([REACH * np.cos(TURNS), REACH * np.sin(TURNS), -0.15 + 0.08 * np.cos(3 * TURNS)], axis=1)
"""Twenty lamps around the lens, nearer than the subject; camera axes, metres."""


def ball_at(middle: Array, radius: float) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return where rays of a pinhole camera meet a ball, its normals there, and where they do: (row, col[, 3])."""
    v, u = np.mgrid[:ROWS, :COLS].astype(np.float64)
    rays = np.stack([(u - (COLS - 1) / 2) / FOCAL, ((ROWS - 1) / 2 - v) / FOCAL, -np.ones_like(u)], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    along = rays @ middle
    depth2 = along**2 - (middle @ middle - radius**2)
    met = depth2 > 0
    points = rays * (along - np.sqrt(np.maximum(depth2, 0)))[..., None]
    return points, (points - middle) / radius, met


def save(path: Path, light: Array) -> None:
    cv2.imwrite(str(path), (65535 * np.clip(light, 0, 1) + 0.5).astype(np.uint16))


def chrome(folder: Path, middle: Array) -> None:
    folder.mkdir()
    points, normals, met = ball_at(middle, BALL_M)
    seen = points / np.linalg.norm(points, axis=-1, keepdims=True)
    mirrored = seen - 2 * (seen * normals).sum(axis=-1, keepdims=True) * normals
    for number, lamp in enumerate(LAMPS):
        way = lamp - points
        way /= np.linalg.norm(way, axis=-1, keepdims=True)
        spot = np.exp(((mirrored * way).sum(axis=-1) - 1) / 0.06**2)
        save(folder / f"lamp_{number:02d}.png", np.where(met, 0.02 + 0.9 * spot, 0.0))
    save(folder / "room.png", np.where(met, 0.5, 0.02))


def test_two_chrome_balls_and_twenty_lights_to_near_lights(here: Path) -> None:
    chrome(here / "left", np.array([-0.085, 0.02, -0.75]))
    chrome(here / "right", np.array([0.08, -0.02, -0.7]))
    points, normals, met = ball_at(np.array([0.0, 0.0, -0.74]), 0.05)
    (here / "photos").mkdir()
    for number, lamp in enumerate(LAMPS):
        way = lamp - points
        away = np.linalg.norm(way, axis=-1)
        shade = 0.2 * np.maximum((normals * way).sum(axis=-1), 0) / away**3
        save(here / "photos" / f"lamp_{number:02d}.png", np.where(met, 0.6 * shade, 0.0))
    travel("Two chrome balls and twenty lights to near lights")
    found = read_rig(here / "out" / "setup" / "rig.toml")
    at = np.array([light.position_m for light in found.lights], np.float64)
    assert len(at) == 20
    away_m = np.linalg.norm(at - LAMPS, axis=1)
    print(f"lamps off by {1e3 * away_m.mean():.1f} mm on the mean, {1e3 * away_m.max():.1f} at most")
    assert away_m.mean() < 0.015
    assert mean_error_deg(planes(here / "out", "normals"), normals, met & (normals[..., 2] > 0.5)) < 3


def hlg(light: Array) -> Array:
    """Return the signal of BT.2100's HLG for scene light from 0 to 1 (ITU-R BT.2100, table 5)."""
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    return np.where(light <= 1 / 12, np.sqrt(3 * light), a * np.log(np.maximum(12 * light - b, 1e-9)) + c)


def as_a_phone_writes(path: Path, pictures: list[Array]) -> None:
    """Write scene light (row, col, 3) as 10-bit HLG, BT.2020, H.265, to be shown turned by 90 degrees clockwise."""
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx265", rate=100, options={"crf": "4", "x265-params": "log-level=none"})
        rows, cols = pictures[0].shape[:2]
        stream.width, stream.height, stream.pix_fmt, stream.codec_tag = cols, rows, "yuv420p10le", "hvc1"
        context = stream.codec_context
        context.color_range, context.colorspace, context.color_trc, context.color_primaries = 1, 9, 18, 9
        for number, light in enumerate(pictures):
            red, green, blue = np.moveaxis(hlg(np.clip(light, 0, 1)), -1, 0)
            luma = 0.2627 * red + 0.678 * green + 0.0593 * blue
            chroma = [(blue - luma) / 1.8814, (red - luma) / 1.4746]
            small = [one.reshape(rows // 2, 2, cols // 2, 2).mean(axis=(1, 3)) for one in chroma]
            codes = [64 + 876 * luma, *(512 + 896 * one for one in small)]
            flat = np.concatenate([np.rint(one).astype(np.uint16).ravel() for one in codes])
            frame = av.VideoFrame.from_ndarray(flat.reshape(rows * 3 // 2, cols), format="yuv420p10le")
            frame.pts, frame.time_base = number, Fraction(1, 100)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    data = bytearray(path.read_bytes())
    place = data.index(b"tkhd") + 4 + 40
    data[place : place + 36] = struct.pack(">9i", 0, 65536, 0, -65536, 0, 0, 0, 0, 1 << 30)
    path.write_bytes(data)


def upright(vectors: Any) -> Any:
    """Turn x (right) and y (up) by 90 degrees clockwise."""
    return np.stack([vectors[..., 1], -vectors[..., 0], vectors[..., 2]], axis=-1)


def test_a_phones_hlg_movie_becomes_upright_normals(clip: Path, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shot = open_clip(clip)
    as_a_phone_writes(here / "take.mov", [frame.image.astype(np.float64) for frame in read_frames(shot)])
    plan = replace(shot.plan, camera=replace(shot.plan.camera, encoding=Encoding(transfer="hlg")))
    (here / "plan.toml").write_text(format_plan(plan), encoding="utf-8")
    lights = read_rig(clip / "rig.toml").lights
    turned = [replace(one, direction=tuple(upright(np.array(one.direction)).tolist())) for one in lights]
    (here / "rig.toml").write_text(format_rig(Rig(lights=tuple(turned))), encoding="utf-8")
    travel("A phone's movie, held upright")
    said = capsys.readouterr().out
    print(said.splitlines()[-1])
    assert "turned by 90 degrees clockwise" in " ".join(said.split())
    true, mask = (EXIF[6].upright(pixels(clip / "truth" / f"{what}.exr")) for what in ("normals", "mask"))
    found, valid = planes(here / "out", "normals"), planes(here / "out", "valid")
    assert found.shape == (160, 120, 3)
    solid = (mask[..., 0] > 0.5) & (valid[..., 0] == 1)
    assert solid.sum() > 0.5 * (mask > 0.5).sum()
    assert mean_error_deg(found, upright(true), solid) < 2


def test_a_clip_is_handed_to_blender(clip: Path, here: Path) -> None:
    shutil.copytree(clip, here / "clip")
    travel("A clip to Blender")
    assert {"psvideo_import.zip", "delivery.json", "README-blender.txt"} <= {
        file.name for file in (here / "out").iterdir()
    }
    assert len(list((here / "out" / "normals_png16").iterdir())) == len(list((here / "out" / "normals").iterdir()))


def test_a_clip_is_handed_to_nuke(clip: Path, here: Path) -> None:
    shutil.copytree(clip, here / "clip")
    travel("A clip to Nuke")
    script = here / "out" / "clip.nk"
    nodes = read_script(script)
    (viewer,) = [node for node in nodes if node.kind == "Viewer"]
    first = next(int(node.knobs["first"]) for node in nodes if node.kind == "Read")
    shown = picture_of(viewer.inputs[0], script, first)
    normals, albedo = (planes(here / "out", what) for what in ("normals", "albedo"))
    lamps = [
        np.array(light.intensity) * np.maximum(normals @ np.array(light.direction), 0)[..., None]
        for light in read_rig(here / "clip" / "rig.toml").lights
    ]
    assert np.abs(shown[..., :3] - albedo * sum(lamps)).max() < 1e-4
