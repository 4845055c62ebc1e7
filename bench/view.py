"""The page of `psvideo view` on 240 results at 1080p: how soon it is ready, and how fast it scrubs.

Normals, albedo and validity of a bumpy surface with noise (which takes longer to decode than one without), drawn 960
pixels wide by Chromium with software rendering (SwiftShader), which shares the cores with the server and with what
else runs. A scrub sets the slider sixty times a second to the next picture and counts the pictures that came onto the
screen, relit. The best of some tries counts.
Processor time, of the server and of all of the browser, depends less on what else runs.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np
from playwright.sync_api import Browser, Page, ViewportSize, sync_playwright

from bench.table import Row
from psvideo.formats.exr_files import write_exr

COUNT, DIFFERENT = 240, 8
ROWS, COLS = 1080, 1920
VIEWPORT: ViewportSize = {"width": 960 + 268, "height": 540 + 90}
"""The page beside its panel, so that one pane is 960 pixels wide."""
TRIES = 3
SCRUB_MS = 4000
FLAGS = (
    "--no-sandbox --disable-quic --no-first-run --disable-background-networking --disable-component-update "
    "--disable-sync --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader"
)
SCRUB = """async ([places, milliseconds]) => {
  const app = psvideo, began = performance.now(), seen = [];
  for (const at of places) {
    if (performance.now() - began > milliseconds) break;
    app.go(at);
    await new Promise((done) => setTimeout(done, 1000 / 60));
    if (seen[seen.length - 1] !== document.body.dataset.shown) seen.push(document.body.dataset.shown);
  }
  return [seen.length, (performance.now() - began) / 1000];
}"""
VISIT = """async (places) => {
  const app = psvideo;
  for (const at of places) {
    app.go(at);
    while (app.loader.shown.at !== at) await new Promise((done) => setTimeout(done, 10));
  }
}"""
FIRST, KNOWN = 20, 24
"""Where scrubs begin, and how many places are scrubbed to and fro once all of them were shown."""


def rows() -> Iterator[Row]:
    """Yield the table's rows."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        out = Path(folder) / "out"
        _results(out)
        program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
        browser = play.chromium.launch(executable_path=program, args=FLAGS.split())
        tries = [_tried(browser, out) for _ in range(TRIES)]
        browser.close()
    starts, readies, scrubs = zip(*tries, strict=True)
    new, again = (max(scrubs, key=lambda scrub: scrub[place].fps)[place] for place in (0, 1))
    load = f"load of the machine's {os.cpu_count()} cores meanwhile {os.getloadavg()[1]:.0f}"
    yield Row(f"command until it answers ({load})", f"{min(starts):.2f} s", "", None)
    yield Row("address until the first relit picture is drawn", f"{min(readies):.2f} s", "2 s", min(readies) <= 2)
    for what, scrub in (("scrubbing what was never shown", new), ("scrubbing it again", again)):
        yield Row(what, f"{scrub.fps:.1f} fps", "15 fps", scrub.fps >= 15)
        yield Row(f"{what}: processor time a picture, server", f"{scrub.server_ms:.0f} ms", "", None)
        yield Row(f"{what}: processor time a picture, browser", f"{scrub.browser_ms:.0f} ms", "", None)


class Scrub(NamedTuple):
    """Pictures a second, and processor time for each."""

    fps: float
    server_ms: float
    browser_ms: float


def _tried(browser: Browser, out: Path) -> tuple[float, float, tuple[Scrub, Scrub]]:
    """Return seconds until the server answers and until the page is ready, and what scrubbing gave, new and again."""
    call = [sys.executable, "-m", "psvideo.cli.app", "view", str(out), "--no-browser", "--json"]
    began = time.perf_counter()
    with subprocess.Popen(call, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        answer = "".join(server.stdout.readline() for _ in range(4))
        answers_s = time.perf_counter() - began
        page = browser.new_page(viewport=VIEWPORT)
        began = time.perf_counter()
        page.goto(json.loads(answer)["url"])
        page.wait_for_selector("body[data-ready=true]", timeout=120_000)
        ready_s = time.perf_counter() - began
        page.keyboard.press("s")
        new = _scrubbed(page, list(range(FIRST, COUNT)))
        known = list(range(FIRST, FIRST + KNOWN))
        page.evaluate(VISIT, known)
        scrubs = (new, _scrubbed(page, (known + known[::-1]) * 10))
        page.close()
        server.terminate()
    return answers_s, ready_s, scrubs


def _scrubbed(page: Page, places: list[int]) -> Scrub:
    page.evaluate("at => psvideo.go(at)", places[0])
    page.wait_for_timeout(1500)
    before = _processor_s()
    pictures, seconds = page.evaluate(SCRUB, [places, SCRUB_MS])
    server_s, browser_s = (after - one for after, one in zip(_processor_s(), before, strict=True))
    shown = max(pictures, 1)
    return Scrub(fps=pictures / seconds, server_ms=1e3 * server_s / shown, browser_ms=1e3 * browser_s / shown)


def _processor_s() -> tuple[float, float]:
    """Return processor seconds, user and system, that the server and all processes of the browser have taken."""
    server = browser = 0.0
    for process in Path("/proc").glob("[0-9]*"):
        try:
            words = (process / "cmdline").read_bytes().decode(errors="replace")
            spent = (process / "stat").read_text().rpartition(")")[2].split()
        except OSError:  # it ended meanwhile
            continue
        seconds = (int(spent[11]) + int(spent[12])) / os.sysconf("SC_CLK_TCK")
        server += seconds * ("psvideo.cli.app" in words)
        browser += seconds * ("chrom" in words)
    return server, browser


def _results(out: Path) -> None:
    """Write a few different results and link them to as many numbers as there are to be."""
    rng = np.random.default_rng(7)
    y, x = np.mgrid[0:ROWS, 0:COLS].astype(np.float32) / 60
    for place in range(DIFFERENT):
        slopes = np.stack([np.sin(x + place / 4), np.cos(y + place / 3), np.full_like(x, 1.5)], axis=-1)
        slopes += rng.normal(0, 0.01, slopes.shape).astype(np.float32)
        normals = slopes / np.linalg.norm(slopes, axis=-1, keepdims=True)
        albedo = (0.4 + 0.2 * np.sin(x / 7 + y / 5))[..., None] + rng.normal(0, 0.005, slopes.shape)
        valid = (np.hypot(x - 16, y - 9) < 15).astype(np.float32)
        for name, channels in {
            "normals": dict(zip("RGB", np.moveaxis(normals, -1, 0), strict=True)),
            "albedo": dict(zip("RGB", np.moveaxis(albedo.astype(np.float32), -1, 0), strict=True)),
            "valid": {"Y": valid},
        }.items():
            first = out / name / f"take_{name}.{1001 + place}.exr"
            write_exr(first, channels, attributes={"psvideo:y": "up", "psvideo:time_s": 0.0}, fps=Fraction(24))
            for number in range(1001 + place + DIFFERENT, 1001 + COUNT, DIFFERENT):
                os.link(first, out / name / f"take_{name}.{number}.exr")


if __name__ == "__main__":
    from bench.table import table

    print(table(rows()))
