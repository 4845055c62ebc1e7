"""The page in a real browser: light is right to a thousandth, controls do what they say, no other host is asked."""

import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import page_folder as small
import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from psvideo.page import page_server, show_of
from psvideo.page.serving import PageServer

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
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
LAPTOP = {"width": 1366, "height": 768}


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    program = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if program is None:
        pytest.fail("these tests need a Chromium browser: Debian's package chromium (tests/install.sh installs it)")
    with sync_playwright() as play:
        started = play.chromium.launch(executable_path=program, headless=True, args=ALONE)
        yield started
        started.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small.results(tmp_path_factory.mktemp("page") / "out")


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[PageServer]:
    yield from serving(folder)


def serving(folder: Path) -> Iterator[PageServer]:
    with page_server(show_of(folder), port=0) as one:
        thread = threading.Thread(target=one.serve_forever)
        thread.start()
        yield one
        one.shutdown()
        thread.join()


class Watched:
    """A page, and everything that it complained of or asked for."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.complaints: list[str] = []
        self.asked: list[str] = []
        page.on("console", lambda message: self.complaints.append(message.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.asked.append(request.url))

    def open(self, url: str) -> Page:
        self.page.goto(url)
        self.page.wait_for_selector("body[data-ready=true]")
        return self.page


@pytest.fixture
def watched(browser: Browser) -> Iterator[Watched]:
    context = browser.new_context(viewport=LAPTOP, has_touch=True)
    one = Watched(context.new_page())
    one.page.set_default_timeout(60_000)
    yield one
    context.close()
    assert not one.complaints


def shown(page: Page, number: int) -> None:
    page.wait_for_selector(f"body[data-shown='{number}']")


def relit_in(page: Page, **state: object) -> np.ndarray:
    """Return the relit light (row, col, 3) as floats, read back from the graphics processor."""
    page.evaluate("state => psvideo.change(state)", state)
    found = page.evaluate("() => { const f = psvideo.relitValues(); return [f.width, f.height, Array.from(f.values)] }")
    return np.array(found[2], np.float64).reshape(found[1], found[0], 4)[..., :3]


def light(direction: tuple[float, float, float], **more: object) -> dict[str, object]:
    unit = (np.array(direction) / np.linalg.norm(direction)).tolist()
    return {"place": 0, "name": "L", "direction": unit, "colour": "#ffffff", "intensity": 1, "near": False} | more


@pytest.mark.parametrize("y", ["up", "down"])
def test_relit_light_is_albedo_times_n_dot_l_whichever_way_y_points(y: str, tmp_path: Path, watched: Watched) -> None:
    for server in serving(small.results(tmp_path / "out", y=y)):
        page = watched.open(server.url)
        normals, _ = small.ball()
        albedo = small.albedo(small.FIRST).astype(np.float16).astype(np.float64)
        key, rim = (0.3, 0.8, 0.5), (-0.9, -0.2, 0.1)
        lights = [light(key), light(rim, colour="#ff8000", intensity=0.7)]
        found = relit_in(page, lights=lights)
        orange = np.array([1.0, ((0x80 / 255 + 0.055) / 1.055) ** 2.4, 0.0])
        true = sum(
            strength * colour * albedo * np.maximum(normals @ (np.array(way) / np.linalg.norm(way)), 0)[..., None]
            for way, colour, strength in ((key, np.ones(3), 1.0), (rim, orange, 0.7))
        )
        assert np.abs(found - true).max() <= 1e-3
        assert true.max() > 0.5


def test_it_scrubs_plays_and_takes_lights_by_mouse_and_keys(server: PageServer, watched: Watched) -> None:
    page = watched.open(server.url)
    shown(page, 1001)
    page.locator("#scrub").fill("3")
    shown(page, 1004)
    page.locator("body").click(position={"x": 60, "y": 15})
    page.keyboard.press("End")
    shown(page, 1006)
    page.keyboard.press("ArrowLeft")
    shown(page, 1005)
    page.keyboard.press("Home")
    shown(page, 1001)
    page.keyboard.press("Space")
    shown(page, 1003)
    page.keyboard.press("Space")
    page.keyboard.press("l")
    assert page.evaluate("() => psvideo.state.lights.length") == 2
    before = page.evaluate("() => psvideo.state.lights[1].direction")
    pane = page.locator(".pane").first.bounding_box()
    assert pane is not None
    page.mouse.move(pane["x"] + 0.5 * pane["width"], pane["y"] + 0.5 * pane["height"])
    page.mouse.down()
    page.mouse.move(pane["x"] + 0.6 * pane["width"], pane["y"] + 0.4 * pane["height"], steps=4)
    page.mouse.up()
    after = page.evaluate("() => psvideo.state.lights[1].direction")
    assert after != before
    assert after[0] > 0.1
    assert after[1] > 0.1
    assert np.isclose(np.linalg.norm(after), 1)
    assert all(url.startswith((server.url, "data:")) for url in watched.asked)
