"""From a camera to the page: a virtual shoot that a camera plays, followed, shown, and its lights found by a click."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import pytest
from bench.live_browser import Tab, browser
from bench.live_scene import DIRECTIONS, LOOP_FLASHES, LOOP_FRAMES, OFFSET_PPM, SETTLED
from bench.mirror_scene import Ball, Lamp, Lens, photograph, unit

import psvideo as ps
from psvideo.clip.streams import genicam
from psvideo.clip.streams.genicam import found_cameras
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_toml import format_rig
from psvideo.live.status import LiveStatus
from psvideo.model.camera import Camera, Encoding
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig
from psvideo.runs.live import live
from psvideo.synth import Noise, TrueClock, expose

FPS, WIDTH, HEIGHT, FOCAL_PX = 50, 240, 160, 400.0
WITHIN_DEG, WITHIN = 1.5, 0.002
MOST_S = 60.0
"""A machine that is busy may take this long over what takes a second or two."""
WORDS = "document.getElementById('ball-words').textContent"
RELIT = """(() => {
  const { held, relit } = psvideoLive;
  return [held.normals, held.albedo].map((one) => [one.half, one.channels, Array.from(one.data)])
    .concat([[false, 4, Array.from(relit().values)]]);
})()"""


@dataclass(frozen=True, kw_only=True)
class Shoot:
    """A folder with a plan, a rig of the right lens and wrong lights, and frames that come round with the flashes."""

    folder: Path
    plan: Plan
    codes: list[np.ndarray]


def plan_of_ball() -> Plan:
    camera = Camera(
        width_px=WIDTH,
        height_px=HEIGHT,
        fps=Fraction(FPS),
        exposure_s=1 / FPS,
        readout_s=0.97 / FPS,
        encoding=Encoding(black_level=0.0, white_level=255.0),
    )
    flashes = [PlannedFlash(lights=dict.fromkeys([name], 1.0), duration_s=0.1 / FPS) for name in (*DIRECTIONS, "")]
    flashes[-1] = PlannedFlash(lights={}, duration_s=0.1 / FPS)
    step_s = LOOP_FRAMES / LOOP_FLASHES / FPS / (1 + 1e-6 * OFFSET_PPM)
    return Plan(camera=camera, flashes=tuple(flashes), dark_s=step_s - 0.1 / FPS)


@pytest.fixture(scope="module")
def shoot(tmp_path_factory: pytest.TempPathFactory) -> Shoot:
    """A chrome ball before a wall, as a camera films it while four lights flash in turn."""
    folder, plan = tmp_path_factory.mktemp("ball"), plan_of_ball()
    lens, ball = Lens(width=WIDTH, height=HEIGHT, focal=FOCAL_PX), Ball(centre=(0.02, 0.01, -0.5))
    plates = {
        slot: photograph(lens, [ball], [Lamp(direction=at, size_deg=2.0)], wall=0.3)
        for slot, at in zip(plan.lit_slots, DIRECTIONS.values(), strict=True)
    }
    clock = TrueClock(phase_s=0.003, offset_ppm=OFFSET_PPM)
    noise = Noise(full_well_e=10_000, read_e=5)
    shot = expose(plates, plan, frames=SETTLED + LOOP_FRAMES, clock=clock, ambient=0.01, noise=noise)
    codes = [np.clip(np.rint(255 * image), 0, 255).astype(np.uint8) for image in shot.frames[SETTLED:]]
    lights = tuple(Light(name=name, direction=(-x, -y, z)) for name, (x, y, z) in DIRECTIONS.items())
    rig = Rig(lights=lights, focal_px=(FOCAL_PX, FOCAL_PX))
    (folder / "plan.toml").write_text(format_plan(plan), encoding="utf-8")
    (folder / "rig.toml").write_text(format_rig(rig), encoding="utf-8")
    return Shoot(folder=folder, plan=plan, codes=codes)


@pytest.fixture
def tab(chromium: str) -> Iterator[Tab]:
    """A page, steered without Playwright: that would read all pictures along."""
    with browser(width_px=1280, height_px=720) as opened:
        yield opened


def wait(tab: Tab, faults: list[Exception], true: str) -> None:
    until_s = time.monotonic() + MOST_S
    while not tab.run(true):
        assert not faults, faults
        assert time.monotonic() < until_s, (true, tab.run("document.body.innerText"))
        time.sleep(0.1)


def place_of(tab: Tab, selector: str) -> tuple[float, float, float, float]:
    """Left, top, width, height of a part of the page."""
    box = tab.run(f"JSON.parse(JSON.stringify(document.querySelector('{selector}').getBoundingClientRect()))")
    return box["left"], box["top"], box["width"], box["height"]


def is_filmed_calibrated_and_relit(shoot: Shoot, source: str, tab: Tab, rig_out: Path) -> list[LiveStatus]:
    """Run the live view of a source, click on the page, and hold what comes of it against the truth."""
    said: list[LiveStatus] = []
    opened: list[str] = []
    faults: list[Exception] = []
    there, over = threading.Event(), threading.Event()

    def told(status: LiveStatus) -> None:
        said.append(status)
        if over.is_set():
            raise KeyboardInterrupt

    def arrived(url: str) -> None:
        opened.append(url)
        there.set()

    def run() -> None:
        options: dict[str, Any] = {"rig": shoot.folder / "rig.toml", "rig_out": rig_out, "page": True, "port": 0}
        try:
            live(source, plan=shoot.folder / "plan.toml", **options, opened=arrived, said=told)
        except KeyboardInterrupt:
            pass
        except Exception as fault:
            faults.append(fault)
            there.set()

    watching = threading.Thread(target=run, daemon=True)
    watching.start()
    try:
        assert there.wait(MOST_S)
        assert not faults, faults
        tab.open(opened[0])
        wait(tab, faults, "document.querySelector('#state[data-state=locked]') && document.body.dataset.drawn")
        left, top, width, height = place_of(tab, "#ball")
        tab.pointer(left + width / 2, top + height / 2, click=True)
        wait(tab, faults, f"{WORDS} && !{WORDS}.startsWith('Looking')")
        assert str(tab.run(WORDS)).startswith("Lights found"), tab.run("document.body.innerText")
        relit_follows_the_mouse(tab)
    finally:
        over.set()
        watching.join(MOST_S)
    assert not faults, faults
    return said


def relit_follows_the_mouse(tab: Tab) -> None:
    """What the page draws is the light's direction under the mouse on the normals that it was sent."""
    wait(tab, [], "psvideoLive.held.normals")
    left, top, width, height = place_of(tab, "#viewer")
    for x, y in ((0.4, 0.3), (-0.5, 0.2)):
        tab.pointer(left + (1 + x) / 2 * width, top + (1 - y) / 2 * height)
        until_s, off = time.monotonic() + MOST_S, np.inf
        while off > WITHIN and time.monotonic() < until_s:  # a browser hears of the mouse when it next draws
            normals, albedo, relit = (_plane(*given) for given in tab.run(RELIT))
            lit = albedo * np.maximum(normals @ np.array([x, y, np.sqrt(1 - x**2 - y**2)]), 0)[:, None]
            off = np.abs(relit[:, :3] - lit).max() / max(lit.max(), 1e-6)
        assert off < WITHIN, f"the light at {x}, {y}"
        assert (np.linalg.norm(normals, axis=1) > 0.9).mean() > 0.5


def _plane(half: bool, channels: int, data: list[float]) -> np.ndarray:
    values = np.array(data, np.uint16).view(np.float16) if half else np.array(data, np.float32)
    return values.astype(np.float32).reshape(-1, channels)


def found_within_deg(rig_out: Path) -> float:
    rig = ps.read_rig(rig_out)
    assert rig.focal_px == (FOCAL_PX, FOCAL_PX)
    off = [unit(np.array(light.direction)) @ unit(np.array(DIRECTIONS[light.name])) for light in rig.lights]
    assert len(off) == len(DIRECTIONS)
    return float(np.degrees(np.arccos(np.clip(min(off), -1, 1))))


@pytest.fixture
def played(shoot: Shoot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[], str]:
    """A process that speaks as a camera's does and sends the shoot's frames when they are due."""

    def source() -> str:
        (tmp_path / "loop").write_bytes(b"".join(codes.tobytes() for codes in shoot.codes))
        words = ["-m", "bench.live_camera", str(tmp_path / "loop"), "--shape", str(HEIGHT), str(WIDTH)]
        words += ["--fps", str(FPS), "--seconds", "600", "--late", "0.04", "--out", str(tmp_path / "camera.json")]
        words += ["--form", "Mono8"]
        monkeypatch.setattr(genicam, "find_spec", lambda name: True)
        monkeypatch.setattr(genicam, "_command", lambda *_: [sys.executable, *words])
        return "genicam"

    return source


def test_a_click_in_a_browser_finds_the_lights_of_a_running_shoot_and_relights_by_them(
    shoot: Shoot, played: Callable[[], str], tab: Tab, tmp_path: Path
) -> None:
    said = is_filmed_calibrated_and_relit(shoot, played(), tab, tmp_path / "found.toml")
    assert found_within_deg(tmp_path / "found.toml") < WITHIN_DEG
    followed = [status for status in said if status.clock_offset_ppm is not None]
    assert abs((followed[-1].clock_offset_ppm or 0.0) - OFFSET_PPM) < 20


@pytest.mark.skipif(find_spec("pypylon") is None, reason="the extra genicam is not installed")
def test_an_emulated_genicam_camera_is_filmed_with_from_its_first_frame_to_the_page(
    shoot: Shoot, monkeypatch: pytest.MonkeyPatch, tab: Tab, tmp_path: Path
) -> None:
    monkeypatch.setenv("PYLON_CAMEMU", "1")
    frames = tmp_path / "frames"
    frames.mkdir()
    for number, codes in enumerate(shoot.codes):
        (frames / f"frame.{number:03d}.png").write_bytes(imagecodecs.png_encode(codes))
    (camera,) = found_cameras()
    source = f"{camera.source}?Width={WIDTH}&Height={HEIGHT}&PixelFormat=Mono8&AcquisitionFrameRate={FPS}"
    source += f"&TestImageSelector=Off&ImageFilename={frames}&ImageFileMode=On"
    is_filmed_calibrated_and_relit(shoot, source, tab, tmp_path / "found.toml")
    assert found_within_deg(tmp_path / "found.toml") < WITHIN_DEG
