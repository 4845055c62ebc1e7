"""A minute of the live view by the clock on the wall: a camera that is not there sends frames in real time, the page is
open in Chromium, and what counts is what came onto it."""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bench.live_browser import Tab, browser
from bench.live_scene import frames, plan_of, rig
from bench.live_watched import TICK_S
from bench.table import Row
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_toml import format_rig
from psvideo.model.camera import Camera

PAGE_PX = (1280, 720)
STEADY_S = 5.0
"""Processor time is counted from here on: before, libraries are loaded and the strobe is looked for."""
LEAST_RESULTS = {720: 15.0, 1080: 10.0}
MOST_AGE_S, MOST_MB, MOST_LOCK_S = 0.2, 600.0, 2.0
WARM_S, LOADED_S = 4.0, 0.3
DRAWN = """(() => {
  globalThis.drawnAt = [];
  document.addEventListener("drawn", ({ detail }) => {
    const gl = document.getElementById("picture").getContext("webgl2");
    requestAnimationFrame(() => {
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      drawnAt.push([performance.now(), detail.place, detail.ended]);
    });
  });
})()"""
"""A picture counts as drawn when the browser comes to the one after it and the renderer has done all it was given."""


@dataclass(kw_only=True)
class Watched:
    """What a run came to: its lines of JSON, processor seconds by process at each, and what the page drew: (picture,
    3), seconds of this machine's clock, the newest frame's place, and that of the last frame of its round."""

    lines: list[dict[str, Any]] = field(default_factory=list)
    spent_s: list[dict[str, float]] = field(default_factory=list)
    drawn: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    camera: dict[str, float] = field(default_factory=dict)


def rows(size: int, fps: int, seconds: float) -> Iterator[Row]:
    """Yield the table of one mode against its bars."""
    plan = plan_of(size * 16 // 9, size, fps)
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        (folder / "plan.toml").write_text(format_plan(plan), encoding="utf-8")
        (folder / "rig.toml").write_text(format_rig(rig()), encoding="utf-8")
        with (folder / "frames").open("wb") as out:
            for codes in frames(plan):
                out.write(codes.tobytes())
        watched(folder, plan.camera, WARM_S)
        yield from _table(watched(folder, plan.camera, seconds), plan.camera, seconds)


def watched(folder: Path, camera: Camera, seconds: float) -> Watched:
    """Run the camera, the live view and the browser for so long."""
    late_s = camera.exposure_s + abs(camera.readout_s or 0.0)
    sends = [sys.executable, "-m", "bench.live_camera", str(folder / "frames"), "--out", str(folder / "camera.json")]
    sends += ["--shape", str(camera.height_px), str(camera.width_px), "--fps", str(float(camera.fps))]
    sends += ["--seconds", str(seconds + 5), "--late", str(late_s)]
    watch = [sys.executable, "-m", "bench.live_watched", str(folder / "plan.toml"), str(folder / "rig.toml")]
    found = Watched()
    with browser(width_px=PAGE_PX[0], height_px=PAGE_PX[1]) as tab:
        with subprocess.Popen([*watch, str(seconds), *sends], stdout=subprocess.PIPE, text=True) as live:
            assert live.stdout is not None
            tab.open(json.loads(live.stdout.readline())["url"])
            time.sleep(LOADED_S)
            clock_s = _clock_s(tab)
            tab.run(DRAWN)
            for line in live.stdout:
                found.lines.append(json.loads(line) | {"heard_s": time.monotonic()})
                found.spent_s.append(_spent_s(live.pid, tab.pid))
        drawn = np.array(tab.run("drawnAt"), float).reshape(-1, 3)
    drawn = drawn[np.unique(drawn[:, 2], return_index=True)[1]]  # an answer without pictures draws them again
    drawn[:, 0] = clock_s + 1e-3 * drawn[:, 0]
    found.drawn = drawn
    found.camera = json.loads((folder / "camera.json").read_text(encoding="ascii"))
    return found


def _clock_s(tab: Tab) -> float:
    """Return this machine's monotonic time at the page's zero, by the quickest of some questions."""
    best, zero_s = np.inf, 0.0
    for _ in range(20):
        before_s = time.monotonic()
        there_s = 1e-3 * tab.run("performance.now()")
        after_s = time.monotonic()
        if after_s - before_s < best:
            best, zero_s = after_s - before_s, 0.5 * (before_s + after_s) - there_s
    return zero_s


def _spent_s(live: int, shows: int) -> dict[str, float]:
    """Return processor seconds of the live process, of its camera, and of the browser."""
    spent: dict[int, float] = {}
    parents: dict[int, int] = {}
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()
        except OSError:  # it ended meanwhile
            continue
        parents[int(process.name)] = int(words[1])
        spent[int(process.name)] = TICK_S * (int(words[11]) + int(words[12]))
    found = {"live": spent.get(live, 0.0), "camera": 0.0, "browser": 0.0}
    for one, seconds in spent.items():
        above = parents.get(one, 0)
        while above not in (0, live, shows):
            above = parents.get(above, 0)
        if above == live:
            found["camera"] += seconds
        elif shows in (one, above):
            found["browser"] += seconds
    return found


def _table(found: Watched, camera: Camera, seconds: float) -> Iterator[Row]:
    size, end = camera.height_px, found.lines[-1]
    name = f"{camera.width_px} x {size} at {float(camera.fps):g}, {seconds:g} s"
    lost = int(end["lost"]) + int(found.camera["dropped"])
    yield Row(f"{name}: frames that came / were lost", f"{end['frames']} / {lost}", "0 lost", lost == 0)
    steady = _steady(found)
    if len(steady) < 2:
        raise RuntimeError(f"{name}: hardly a picture was drawn; is something else running on this machine?")
    rate = (len(steady) - 1) / (steady[-1, 0] - steady[0, 0])
    least = LEAST_RESULTS.get(size, 10.0)
    yield Row(f"{name}: results drawn a second", f"{rate:.1f}", f">= {least:g}", bool(rate >= least))
    for words, place in (("of a round's last frame", 2), ("of the newest frame", 1)):
        ended_s = found.camera["began_s"] + steady[:, place] * camera.frame_period_s
        ages = 1e3 * (steady[:, 0] - ended_s - camera.exposure_s - abs(camera.readout_s or 0.0))
        middle, most = np.median(ages), np.percentile(ages, 95)
        met = bool(most <= 1e3 * MOST_AGE_S)
        bar = f"<= {1e3 * MOST_AGE_S:g} ms" if place == 2 else ""
        yield Row(
            f"{name}: from the end of the exposure {words} until drawn, median / 95 % / most",
            f"{middle:.0f} / {most:.0f} / {ages.max():.0f} ms",
            bar,
            met if bar else None,
        )
    yield Row(f"{name}: peak memory", f"{end['peak_mb']:.0f} MB", f"<= {MOST_MB:g} MB", end["peak_mb"] <= MOST_MB)
    lock_s = end["first_lock_s"]
    yield Row(f"{name}: locked after so much footage", f"{lock_s:.2f} s", "<= 2 s", lock_s <= MOST_LOCK_S)
    last = found.lines[-2]
    yield Row(f"{name}: size of the live picture at the end", f"{last['width_px']} x {last['height_px']}", "", None)
    yield from _processor(found, name, camera)


def _steady(found: Watched) -> np.ndarray:
    """Return what was drawn from when processor time is counted until the live run's last full second."""
    from_s = found.lines[0]["heard_s"] + STEADY_S
    at_s = found.drawn[:, 0]
    within = (at_s > min(from_s, np.median(at_s))) & (at_s < found.lines[-2]["heard_s"])
    return np.asarray(found.drawn[within])


def _processor(found: Watched, name: str, camera: Camera) -> Iterator[Row]:
    """Yield processor time for each frame, by process and by thread, over the steady seconds."""
    first = next(
        (n for n, line in enumerate(found.lines[:-2]) if line["at_s"] > STEADY_S and line["state"] == "locked"), 0
    )
    early, late = found.lines[first], found.lines[-2]
    frames = late["frames"] - early["frames"]
    room = 2e3 * camera.frame_period_s
    total = 0.0
    for process in ("live", "camera", "browser"):
        spent = 1e3 * (found.spent_s[-2][process] - found.spent_s[first][process]) / frames
        total += spent
        yield Row(f"{name}: processor time a frame, {process}", f"{spent:.2f} ms", "", None)
        if process == "live":
            for thread, seconds in sorted(late["threads_s"].items(), key=lambda one: -one[1]):
                each = 1e3 * (seconds - early["threads_s"].get(thread, 0.0)) / frames
                if each >= 0.01:
                    yield Row(f"{name}: of it the threads called {thread!r}", f"{each:.2f} ms", "", None)
    yield Row(f"{name}: processor time a frame, all", f"{total:.2f} ms", f"< {room:.1f} ms (two cores)", total < room)
