"""A long take through the whole chain, and a page that stays open: do memory and open files stay flat?

``python -m bench.soak --frames 20000 --page-minutes 5`` films a second of a scene whose flashes and frames come round
together, and makes of it a take as long as is asked for: every frame is a link to one of the first ones.
"""

import argparse
import os
import shutil
import sys
import tempfile
import threading
import time
import urllib.request
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import cycle
from pathlib import Path
from typing import NamedTuple, TypeVar

from psvideo.runs.normals import normals
from psvideo.runs.view import view
from psvideo.synth.shoot import shoot

Item = TypeVar("Item")
PERIOD = 22
"""Frames after which flashes and frames come round together: five cycles of 44 ms are 22 frames of 10 ms."""
SCENE = f"""
schema = "psvideo-scene/1"
name = "soak"
frames = {PERIOD}
camera = {{ width_px = 64, height_px = 48, fps = 100, shutter_deg = 360, readout_s = 0.0097, width_m = 1.0 }}
ambient = {{ level = 0.02 }}
strobe = {{ flash_s = 0.001, dark_s = 0.01 }}
object = [{{ mesh = "sphere" }}]
light = [
  {{ name = "a", direction = [0.5, 0.0, 0.8] }},
  {{ name = "b", direction = [-0.5, 0.1, 0.8] }},
  {{ name = "c", direction = [0.1, 0.5, 0.8] }},
]
"""
FRAMES, PAGE_MINUTES = 10_000, 1.0
LOOK_S = 1.0
"""The page is looked at so often, and more often where it is open for less than a minute."""
MIDDLE = 0.25
"""Growth is counted from here on: before, libraries are loaded and pools filled."""


class Flatness(NamedTuple):
    """What went on for how long, and how memory and open files grew from its first quarter to its end."""

    what: str
    amount: str
    seconds: str
    memory_mb: str
    grown_mb: float
    handles: int
    more_handles: int


@dataclass
class Gauge:
    """Looks at this process again and again: at memory of its own, not at files that it maps."""

    memory_mb: list[float] = field(default_factory=list)
    handles: list[int] = field(default_factory=list)
    began_s: float = field(default_factory=time.monotonic)

    def look(self) -> None:
        """Take down what this process has now."""
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        self.memory_mb.append(next(int(line.split()[1]) / 1e3 for line in lines if line.startswith("RssAnon")))
        self.handles.append(len(os.listdir("/proc/self/fd")) - 1)  # noqa: PTH208 - iterdir would open one more

    def flatness(self, what: str, amount: str) -> Flatness:
        """Return how flat all looks were: the highest of the last quarter against the highest of the second."""
        begin, end = int(len(self.handles) * MIDDLE), int(len(self.handles) * (1 - MIDDLE))
        early, late = slice(begin, 2 * begin), slice(end, None)
        return Flatness(
            what=what,
            amount=amount,
            seconds=f"{time.monotonic() - self.began_s:.0f}",
            memory_mb=f"{max(self.memory_mb):.0f}",
            grown_mb=round(max(self.memory_mb[late]) - max(self.memory_mb[early]), 1),
            handles=max(self.handles),
            more_handles=max(self.handles[late]) - max(self.handles[early]),
        )


def long_take(folder: Path, frames: int) -> Path:
    """Film the scene and make a take of so many frames of it."""
    (folder / "soak.toml").write_text(SCENE, encoding="utf-8")
    clip = shoot(folder / "soak.toml", folder / "clip").path
    shutil.rmtree(clip / "truth")
    first = sorted((clip / "frames").iterdir())
    for number, frame in zip(range(PERIOD + 1, frames + 1), cycle(first), strict=False):
        (clip / "frames" / f"soak.{number:07d}{frame.suffix}").hardlink_to(frame)
    for number, frame in enumerate(first, 1):
        frame.rename(frame.with_name(f"soak.{number:07d}{frame.suffix}"))
    return clip


def through_the_chain(folder: Path, frames: int) -> Flatness:
    """Solve a long take and look at this process at every hundredth frame or round."""
    clip, gauges = long_take(folder, frames), [Gauge()]

    def watch(items: Iterable[Item], *, total: int, what: str, unit: str = "frames") -> Iterator[Item]:
        gauges.append(Gauge())
        for count, item in enumerate(items):
            yield item
            if count % 20 == 0:
                gauges[-1].look()

    report = normals(clip, rig=clip / "rig.toml", out=folder / "out", aov=["depth"], preview=(), watch=watch)
    longest = max(gauges, key=lambda gauge: len(gauge.handles))
    return longest.flatness("a take through normals", f"{frames} frames, {len(report.instants)} results")


def with_the_page_open(folder: Path, minutes: float, *, pause_s: float = 0.0) -> Flatness:
    """Ask the page for pictures until so much time is over, and wait for ``pause_s`` after each as people do."""
    gauge, asked = Gauge(), 0
    with view(folder / "out") as server:
        serving_it = threading.Thread(target=server.serve_forever)
        serving_it.start()
        for name in cycle(_paths(folder / "out")):
            with urllib.request.urlopen(server.url + name) as answer:
                answer.read()
            asked += 1
            if time.monotonic() - gauge.began_s > len(gauge.handles) * min(LOOK_S, LOOK_S * minutes):
                gauge.look()
            time.sleep(pause_s)
            if time.monotonic() - gauge.began_s > 60 * minutes:
                break
        server.shutdown()
        serving_it.join()
    return gauge.flatness("the page open", f"{asked} requests")


def _paths(out: Path) -> list[str]:
    """Return what a browser asks for: the page, and every picture."""
    numbers = sorted(int(path.stem.rpartition(".")[2]) for path in (out / "normals").iterdir())
    pictures = [f"picture/{name}/{number}" for number in numbers for name in ("normals", "albedo", "valid")]
    return ["", "index.json", "timing.json", *pictures]


def rows() -> Iterator[Flatness]:
    """Measure both."""
    with tempfile.TemporaryDirectory() as place:
        yield through_the_chain(Path(place), FRAMES)
        yield with_the_page_open(Path(place), PAGE_MINUTES)


def main() -> int:
    """Measure both, for as long as is asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--frames", type=int, default=FRAMES)
    parser.add_argument("--page-minutes", type=float, default=PAGE_MINUTES)
    parser.add_argument("--page-pause-s", type=float, default=0.0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        print(*through_the_chain(Path(place), asked.frames), flush=True)
        print(*with_the_page_open(Path(place), asked.page_minutes, pause_s=asked.page_pause_s), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
