"""The page of results in a browser: what it asks for, complains of and draws, and what a ball lit in it looks like."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import page_folder as small

from psvideo.page import page_server, show_of
from psvideo.page.serving import PageServer

if TYPE_CHECKING:
    from playwright.sync_api import Page, ViewportSize

ALONE = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
]
SMALL: ViewportSize = {"width": 760, "height": 480}
"""Software rendering takes its time over every pixel."""
PATIENCE_MS = 60_000
KEY = (0.3, 0.8, 0.5)
"""Where the light of most tests stands: x right, y up, z to the camera."""


@contextmanager
def serving(folder: Path) -> Iterator[PageServer]:
    with page_server(show_of(folder), port=0) as one:
        thread = threading.Thread(target=one.serve_forever)
        thread.start()
        try:
            yield one
        finally:  # or a test that fails never ends
            one.shutdown()
            thread.join()


class Watched:
    """A page, and everything that it complained of or asked for."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.complaints: list[str] = []
        self.asked: list[str] = []
        page.set_default_timeout(PATIENCE_MS)
        page.on("console", lambda message: self.complaints.append(message.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.asked.append(request.url))

    def open(self, url: str) -> Page:
        self.page.goto(url)
        self.page.wait_for_selector("body[data-ready=true]")
        return self.page


def shown(page: Page, number: int) -> None:
    page.wait_for_selector(f"body[data-shown='{number}']")


def settled(page: Page) -> None:
    """Wait until what was asked for is drawn."""
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")


def light(direction: tuple[float, float, float], **more: object) -> dict[str, object]:
    unit = (np.array(direction) / np.linalg.norm(direction)).tolist()
    return {"place": 0, "name": "L", "direction": unit, "colour": "#ffffff", "intensity": 1, "near": False} | more


def relit_in(page: Page, **state: object) -> np.ndarray:
    """Return the relit light (row, col, 3) as floats, read back from the graphics processor."""
    page.evaluate("state => psvideo.change(state)", state)
    page.wait_for_function("() => !psvideo.loader.loading")
    found = page.evaluate("() => { const f = psvideo.relitValues(); return [f.width, f.height, Array.from(f.values)] }")
    return np.array(found[2], np.float64).reshape(found[1], found[0], 4)[..., :3]


def albedo() -> np.ndarray:
    return small.albedo(small.FIRST).astype(np.float16).astype(np.float64)


def lambert(direction: tuple[float, float, float]) -> np.ndarray:
    """Return n . l, and 0 on the far side, (row, col, 1), from the ball's equation."""
    unit = np.array(direction) / np.linalg.norm(direction)
    light: np.ndarray = np.maximum(small.ball()[0].astype(np.float64) @ unit, 0)[..., None]
    return light


def canvas_pixel(page: Page, right: float, down: float) -> list[int]:
    """Return the colour that the screen shows at a share of the viewer's width and height."""
    return list(
        page.evaluate(
            """async ([right, down]) => {
              psvideo.drawNow();
              const canvas = document.getElementById("picture");
              const copy = document.createElement("canvas");
              copy.width = canvas.width; copy.height = canvas.height;
              const pen = copy.getContext("2d");
              pen.drawImage(canvas, 0, 0);
              return Array.from(pen.getImageData(right * canvas.width, down * canvas.height, 1, 1).data);
            }""",
            [right, down],
        )
    )
