"""The report as a browser shows it: whole at laptop width, in light and dark, without a request or a complaint."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from picture_file import read_picture

from psvideo.cli.app import main

if TYPE_CHECKING:
    from playwright.sync_api import Playwright, ViewportSize

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "pictures" / "report.png"
ALONE = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync"]  # fmt: skip
LAPTOP: ViewportSize = {"width": 1366, "height": 768}


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    scene = (ROOT / "data_synth" / "bust.toml").read_text()
    for old, new in (
        ("width_px = 640", "width_px = 320"),
        ("height_px = 360", "height_px = 180"),
        ("frames = 60", "frames = 26"),
        ("intensity = [1.15, 1.12, 1.06]", "intensity = [2.6, 2.5, 2.4]"),
    ):
        assert old in scene
        scene = scene.replace(old, new)
    (folder / "scene.toml").write_text(scene)
    clip, out = folder / "take_07", folder / "out"
    assert main(["synth", str(folder / "scene.toml"), "-o", str(clip), "-q"]) == 0
    assert main(["normals", str(clip), "--rig", str(clip / "rig.toml"), "-o", str(out), "-q"]) == 0
    return out / "report.html"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_is_whole_on_a_laptop_and_asks_for_nothing(
    report: Path, tmp_path: Path, scheme: str, playwright: Playwright, chromium: str
) -> None:
    said: list[str] = []
    browser = playwright.chromium.launch(executable_path=chromium, headless=True, args=ALONE)
    page = browser.new_context(viewport=LAPTOP, color_scheme=scheme).new_page()  # type: ignore[arg-type]
    page.on("console", lambda message: said.append(message.text))
    page.on("request", lambda one: said.append(one.url) if not one.url.startswith(("file:", "data:")) else None)
    page.goto(report.as_uri())
    assert not said
    assert page.evaluate("document.documentElement.scrollWidth") <= LAPTOP["width"], "nothing sticks out"
    verdict = page.locator(".verdict")
    assert "'key' is clipped" in verdict.inner_text()
    box = verdict.bounding_box()
    assert box is not None
    assert box["y"] + box["height"] < LAPTOP["height"], "the verdict is read without scrolling"
    assert _contrast(page.evaluate(COLOURS)) > 4.5, "WCAG 2.1, 1.4.3"
    shown = page.screenshot(path=tmp_path / "report.png")
    assert len(shown) > 20_000
    browser.close()
    picture = read_picture(tmp_path / "report.png")
    assert (picture.mean() > 128) == (scheme == "light")
    if scheme == "light":
        shutil.copy(tmp_path / "report.png", PICTURE) if not PICTURE.exists() else None
        away = np.abs(_small(picture) - _small(read_picture(PICTURE)))
        assert away.mean() < 2, "docs/report.md shows an old report: delete its picture to have it made again"


def test_on_a_phone_every_column_of_figures_is_seen(report: Path, playwright: Playwright, chromium: str) -> None:
    browser = playwright.chromium.launch(executable_path=chromium, headless=True, args=ALONE)
    page = browser.new_context(viewport={"width": 390, "height": 844}).new_page()
    page.goto(report.as_uri())
    page.locator("details summary").click()
    assert re.fullmatch(r"All \d results, the worst first", page.locator("details summary").inner_text())
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    hidden = "[...document.querySelectorAll('.wide')].map(one => one.scrollWidth - one.clientWidth)"
    assert max(page.evaluate(hidden)) <= 0
    browser.close()


def _small(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return a picture so small that fonts hardly show; a line of text that came or went does (14 codes on average)."""
    return cv2.resize(picture, None, fx=1 / 8, fy=1 / 8, interpolation=cv2.INTER_AREA).astype(np.float32)


COLOURS = """() => [...document.querySelectorAll('.verdict .word')].flatMap(one =>
  [getComputedStyle(one).color, getComputedStyle(one.parentElement).backgroundColor])"""


def _contrast(colours: list[str]) -> float:
    light, dark = sorted((_luminance(colour) for colour in colours), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(colour: str) -> float:
    parts = [int(part) / 255 for part in colour.removeprefix("rgb(").removesuffix(")").split(",")]
    linear = [part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
