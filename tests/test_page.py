"""The page in a real browser: light is right to a thousandth, controls do what they say, no other host is asked."""

from __future__ import annotations

import base64
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import page_folder as small
import pytest

from psvideo.errors import UsageError
from psvideo.page import page_server, show_of, side_by_side, write_single_page
from psvideo.page.serving import PageServer

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, Playwright, ViewportSize

ASSETS = Path(__file__).resolve().parents[1] / "src" / "psvideo" / "page" / "assets"
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
LAPTOP: ViewportSize = {"width": 1366, "height": 768}
SMALL: ViewportSize = {"width": 760, "height": 480}
"""Software rendering takes its time over every pixel."""
PATIENCE_MS = 60_000
KEY, RIM = (0.3, 0.8, 0.5), (-0.9, -0.2, 0.1)
ORANGE = np.array([1.0, ((0x80 / 255 + 0.055) / 1.055) ** 2.4, 0.0])
"""#ff8000 in linear light (IEC 61966-2-1)."""


@pytest.fixture(scope="session")
def browser(playwright: Playwright, chromium: str) -> Iterator[Browser]:
    started = playwright.chromium.launch(executable_path=chromium, headless=True, args=ALONE)
    yield started
    started.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = small.results(tmp_path_factory.mktemp("page") / "out")
    broken = made / "normals" / "take_normals.1005.exr"
    broken.write_bytes(broken.read_bytes()[:900])
    return made


@contextmanager
def serving(folder: Path) -> Iterator[PageServer]:
    with page_server(show_of(folder), port=0) as one:
        thread = threading.Thread(target=one.serve_forever)
        thread.start()
        yield one
        one.shutdown()
        thread.join()


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[PageServer]:
    with serving(folder) as one:
        yield one


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


@pytest.fixture
def watched(browser: Browser) -> Iterator[Watched]:
    context = browser.new_context(viewport=SMALL, has_touch=True)
    one = Watched(context.new_page())
    yield one
    context.close()
    assert not one.complaints


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


@pytest.mark.parametrize(("y", "world"), [("up", False), ("down", False), ("up", True), ("down", True)])
def test_relit_light_is_albedo_times_n_dot_l_in_every_space_and_whichever_way_y_points(
    y: str, world: bool, tmp_path: Path, watched: Watched
) -> None:
    with serving(small.results(tmp_path / "out", y=y, world=world)) as server:
        page = watched.open(server.url)
        found = relit_in(page, lights=[light(KEY), light(RIM, colour="#ff8000", intensity=0.7)])
    true = albedo() * (lambert(KEY) + 0.7 * ORANGE * lambert(RIM))
    assert np.abs(found - true).max() <= 1e-3
    assert true.max() > 0.5


@pytest.mark.parametrize("world", [False, True])
def test_a_near_light_falls_off_with_the_square_of_its_distance_to_every_point(
    world: bool, tmp_path: Path, watched: Watched
) -> None:
    """Points in widths of the picture from their median, as the page says; the position pass is in metres."""
    with serving(small.results(tmp_path / "out", world=world, position=True)) as server:
        page = watched.open(server.url)
        found = relit_in(page, lights=[light(KEY, near=True, distance=0.6)])
    normals, inside = small.ball()
    points = small.points() / small.SCALE_M
    points -= np.median(points[inside], axis=0)
    lamp = 0.6 * np.array(KEY) / np.linalg.norm(KEY)
    away = lamp - points
    reach = np.linalg.norm(away, axis=-1)
    facing = np.maximum((normals * away).sum(axis=-1) / reach, 0)
    true = albedo() * (facing * (0.6 / reach) ** 2)[..., None]
    assert np.abs(found - true)[inside].max() < 1e-3
    flat = albedo() * lambert(KEY)
    assert np.abs(flat - true)[inside].mean() > 0.2 * true[inside].mean()


def test_a_highlight_is_blinns(server: PageServer, watched: Watched) -> None:
    found = relit_in(watched.open(server.url), lights=[light(KEY)], specular=0.4, exponent=20)
    unit = np.array(KEY) / np.linalg.norm(KEY)
    half = unit + np.array([0, 0, 1])
    half /= np.linalg.norm(half)
    normals = small.ball()[0].astype(np.float64)
    shine = 0.4 * np.maximum(normals @ half, 0) ** 20 * (normals @ unit > 0)
    true = albedo() * lambert(KEY) + shine[..., None]
    near = np.abs(normals @ unit) > 0.01  # at the edge of its own shadow the highlight ends at once
    assert np.abs(found - true)[near].max() <= 4e-3  # the 20th power of a half float


def around_in(page: Page, name: str, directions: np.ndarray) -> np.ndarray:
    """Return the light (n, 3) that comes from directions (n, 3), as the page's own file defines it."""
    source = base64.b64encode((ASSETS / "around.js").read_bytes()).decode()
    script = "async ([source, name, all]) => { const made = await import(`data:text/javascript;base64,${source}`);"
    found = page.evaluate(
        f"{script} return all.map((one) => made.radianceOf(name, one)); }}", [source, name, directions.tolist()]
    )
    return np.array(found)


@pytest.mark.parametrize(("name", "turn_deg"), [("studio", 0), ("window", 50)])
def test_light_from_all_around_is_what_a_matte_surface_gathers(
    name: str, turn_deg: float, server: PageServer, watched: Watched
) -> None:
    """Gathered direction by direction, from surroundings that are turned about the upright axis."""
    polar, across = np.meshgrid((np.arange(40) + 0.5) * np.pi / 40, (np.arange(80) + 0.5) * np.pi / 40, indexing="ij")
    level = np.sin(polar)
    there = np.stack([level * np.sin(across), np.cos(polar), level * np.cos(across)], axis=-1).reshape(-1, 3)
    watched.page.goto("about:blank")
    radiance = around_in(watched.page, name, there) * (level.ravel() * (np.pi / 40) ** 2)[:, None]
    cos, sin = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turned = there @ np.array([[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]])
    normals, inside = small.ball()
    gathered = np.maximum(normals.astype(np.float64) @ turned.T, 0) @ radiance / np.pi
    page = watched.open(server.url)
    found = relit_in(page, lights=[], around=name, aroundTurn=turn_deg, aroundStrength=1)
    true = albedo() * gathered
    error = np.abs(found - true)[inside]
    assert error.mean() < 0.03 * true[inside].max(), "two degrees of the harmonics leave 1 % on average"
    assert error.max() < 0.1 * true[inside].max(), "and 9 % at most (Ramamoorthi and Hanrahan 2001)"


def test_it_scrubs_plays_and_takes_lights_by_mouse_finger_and_keys(server: PageServer, watched: Watched) -> None:
    page = watched.open(server.url)
    shown(page, 1001)
    page.locator("#scrub").fill("3")
    shown(page, 1004)
    page.locator("h1").click()
    for key, number in (("End", 1006), ("ArrowLeft", 1005), ("Home", 1001), ("ArrowRight", 1002)):
        page.keyboard.press(key)
        shown(page, number)
    page.locator("#number").fill("1004")
    page.keyboard.press("Enter")
    shown(page, 1004)
    page.locator("h1").click()
    page.keyboard.press("Space")
    page.wait_for_selector("#play[aria-label=Stop]")
    page.wait_for_function("() => psvideo.state.at !== 3")
    page.keyboard.press("Space")
    page.wait_for_selector("#play[aria-label=Play]")
    page.keyboard.press("Home")
    shown(page, 1001)
    page.keyboard.press("l")
    assert page.evaluate("() => psvideo.state.lights.length") == 2
    pane = page.locator(".pane").first.bounding_box()
    assert pane is not None
    middle = (pane["x"] + pane["width"] / 2, pane["y"] + pane["height"] / 2)
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 30, middle[1] - 40, steps=4)
    page.mouse.up()
    page.wait_for_function("() => psvideo.state.lights[1].direction[0] > 0")
    x, y, z = page.evaluate("() => psvideo.state.lights[1].direction")
    assert 0 < x < y
    assert np.isclose(x * x + y * y + z * z, 1)
    page.touchscreen.tap(middle[0] - 30, middle[1])
    page.wait_for_function("() => psvideo.state.lights[1].direction[0] < 0")
    page.locator(".knob").nth(0).focus()
    before = page.evaluate("() => psvideo.state.lights[0].direction")
    page.keyboard.press("ArrowLeft")
    after = page.evaluate("() => psvideo.state.lights[0].direction")
    assert after[0] < before[0]
    assert after[1] == before[1]
    page.keyboard.press("Delete")
    assert page.evaluate("() => psvideo.state.lights.length") == 1
    assert all(url.startswith((server.url, "data:")) for url in watched.asked)


def test_space_plays_also_after_a_click_on_a_button(server: PageServer, watched: Watched) -> None:
    page = watched.open(server.url)
    page.locator(".choice button[data-layout=one]").click()
    page.keyboard.press("Space")
    page.wait_for_selector("#play[aria-label=Stop]")
    page.keyboard.press("Space")
    page.wait_for_selector("#play[aria-label=Play]")
    page.keyboard.press("Tab")
    page.keyboard.press("Space")
    assert page.evaluate("() => psvideo.state.layout") == "two", "what Tab reached is pressed"


def test_what_is_not_measured_is_hatched_and_the_disc_of_lights_is_drawn(server: PageServer, watched: Watched) -> None:
    page = watched.open(server.url)
    assert page.locator("#mark-invalid").is_checked()
    disc, knob = page.locator(".disc"), page.locator(".knob").first
    box, handle = disc.bounding_box(), knob.bounding_box()
    assert box is not None
    assert handle is not None
    assert box["x"] < handle["x"] + 13 < box["x"] + box["width"]
    assert disc.get_attribute("data-tip") == "drag the light"
    knob.drag_to(page.locator(".pane").first)
    page.wait_for_selector(".disc[data-tip='']", state="attached")


def test_gaps_of_the_subject_are_hatched_and_what_lies_around_it_is_not(browser: Browser, tmp_path: Path) -> None:
    """With ``--no-fill`` what was not measured holds zeros, like everything around the subject."""
    made = small.results(tmp_path / "out")
    normals, inside = small.ball()
    gap = np.zeros_like(inside)
    gap[small.ROWS // 2 - 4 : small.ROWS // 2 + 4, small.COLS // 2 - 4 : small.COLS // 2 + 4] = True
    for folder, planes in (
        ("normals", small.rgb(normals * ~gap[..., None])),
        ("valid", {"Y": (inside & ~gap).astype(np.float16)}),
    ):
        small.write(made / folder / f"take_{folder}.{small.FIRST}.exr", planes, small.FIRST)
    with serving(made) as server:
        page = Watched(browser.new_context(viewport=SMALL).new_page()).open(server.url)
        page.evaluate("() => psvideo.change({ layout: 'one', contents: ['normals', 'normals', 'normals', 'normals'] })")
        box = page.locator(".pane").first.bounding_box()
        assert box is not None
        marked = _drawn(page, box)
        page.evaluate("() => psvideo.change({ markInvalid: false })")
        differs = np.abs(marked.astype(int) - _drawn(page, box)).max(axis=2) > 8
    rows, cols = differs.shape
    across, down = min(cols / small.COLS, rows / small.ROWS) * np.array([3, 3])
    middle = np.s_[int(rows / 2 - down) : int(rows / 2 + down), int(cols / 2 - across) : int(cols / 2 + across)]
    assert differs[middle].mean() > 0.9
    assert differs.sum() < 0.1 * rows * cols


def _drawn(page: Page, box: Any) -> np.ndarray:
    page.wait_for_function("() => !psvideo.loader.loading")
    settled(page)
    picture = cv2.imdecode(np.frombuffer(page.screenshot(clip=box), np.uint8), cv2.IMREAD_COLOR)
    return np.asarray(picture)


@pytest.mark.parametrize(("width", "height", "stacked"), [(1440, 420, "no"), (390, 844, "yes")])
def test_two_pictures_stand_as_they_are_larger_and_nothing_is_cut_off(
    browser: Browser, server: PageServer, width: int, height: int, stacked: str
) -> None:
    context = browser.new_context(viewport={"width": width, "height": height})
    page = Watched(context.new_page()).open(server.url)
    settled(page)
    assert page.locator("#viewer").get_attribute("data-stacked") == stacked
    outside = page.evaluate(
        """() => [...document.querySelectorAll("button, select, input, a")].filter((one) => one.checkVisibility())
             .filter((one) => { const b = one.getBoundingClientRect(); return b.left < 0 || b.right > innerWidth; })
             .map((one) => one.outerHTML.slice(0, 80))"""
    )
    assert not outside
    context.close()


def test_a_corrupt_picture_says_so_in_its_pane_and_the_others_are_shown(server: PageServer, watched: Watched) -> None:
    page = watched.open(server.url)
    page.locator("#scrub").fill("4")
    shown(page, 1005)
    message = page.locator(".pane .message").first
    message.wait_for()
    assert "take_normals.1005.exr" in message.inner_text()
    page.locator("#scrub").fill("5")
    shown(page, 1006)
    message.wait_for(state="hidden")


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


def test_views_are_chosen_by_keys_and_show_what_they_name(server: PageServer, watched: Watched) -> None:
    page = watched.open(server.url)
    for key, layout, panes in (("s", "one", 1), ("f", "four", 4), ("w", "wipe", 2), ("d", "two", 2), ("s", "one", 1)):
        page.keyboard.press(key)
        assert page.locator(f"#viewer[data-layout={layout}]").count() == 1
        assert page.locator(".pane").count() == panes
    page.keyboard.press("2")
    page.wait_for_selector(".pane[data-content=normals]")
    page.wait_for_function("() => !psvideo.loader.loading")
    assert canvas_pixel(page, 0.5, 0.5)[:3] == pytest.approx([128, 128, 255], abs=6), "it faces the camera"
    page.keyboard.press("4")
    page.wait_for_selector(".legend .key.valid")
    page.wait_for_function("() => !psvideo.loader.loading")
    assert min(canvas_pixel(page, 0.5, 0.5)[:3]) > 200
    page.keyboard.press("5")
    page.wait_for_selector(".pane[data-content=depth] .legend canvas")
    page.keyboard.press("1")
    page.keyboard.press("v")
    settled(page)
    assert not page.locator("#mark-invalid").is_checked()
    page.keyboard.press("v")
    settled(page)
    page.keyboard.press("]")
    settled(page)
    assert "+0.25 EV" in page.locator("#part-display").inner_text()
    page.mouse.wheel(0, -600)
    page.keyboard.press("0")
    assert page.evaluate("() => psvideo.state.zoom") == 1


def test_the_pixel_under_the_pointer_is_read_out(server: PageServer, watched: Watched) -> None:
    page = watched.open(server.url)
    page.keyboard.press("s")
    page.keyboard.press("3")
    page.wait_for_function("() => !psvideo.loader.loading && psvideo.loader.shown.blocks.albedo")
    box = page.locator("#viewer").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    said = page.locator("#pixel").inner_text()
    assert f"{small.COLS // 2}, {small.ROWS // 2}" in said
    assert "0.505 0.5 0.1" in said


def test_timing_is_drawn_and_listed_and_leads_to_the_picture(server: PageServer, watched: Watched) -> None:
    page = watched.open(server.url)
    page.keyboard.press("t")
    page.wait_for_selector("#timing-facts dt")
    said = page.locator("#timing-facts").inner_text()
    for words in ("18, 18 complete", "0.012 row", "+31.2 ppm", "1 after 7", "from the dark slot", "key", "left"):
        assert words in said
    box = page.locator("#timing-diagram").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + box["width"] - 3, box["y"] + 8)
    shown(page, 1004)  # the picture nearest to 0.2 s
    page.keyboard.press("t")
    page.locator("#timing").wait_for(state="hidden")


def test_help_opens_and_closes_and_a_laptop_shows_all_controls_with_names(browser: Browser, server: PageServer) -> None:
    context = browser.new_context(viewport=LAPTOP)
    watched = Watched(context.new_page())
    page = watched.open(server.url)
    page.keyboard.press("?")
    page.locator("#help").wait_for()
    assert "add a light" in page.locator("#help").inner_text()
    page.keyboard.press("Escape")
    page.locator("#help").wait_for(state="hidden")
    assert page.evaluate("() => [document.documentElement.scrollWidth, document.documentElement.scrollHeight]") == [
        LAPTOP["width"],
        LAPTOP["height"],
    ]
    nameless = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select, [role=slider]")]
             .filter((one) => !(one.getAttribute("aria-label") || one.textContent.trim() || one.labels?.length))
             .map((one) => one.outerHTML)"""
    )
    assert not nameless
    assert not page.evaluate(CONTRAST_BELOW, 4.5)
    context.close()
    assert not watched.complaints


CONTRAST_BELOW = """least => {
  const channels = (text) => text.match(/[0-9.]+/g).map(Number);
  const level = (code) => (code /= 255) <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4;
  const luminance = ([r, g, b]) => 0.2126 * level(r) + 0.7152 * level(g) + 0.0722 * level(b);
  const ground = (one) => {
    for (; one; one = one.parentElement) {
      const [r, g, b, alpha = 1] = channels(getComputedStyle(one).backgroundColor);
      if (alpha > 0.5) return [r, g, b];
    }
    return [0, 0, 0];
  };
  const own = (one) => [...one.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
  return [...document.querySelectorAll("body *")].filter((one) => own(one) && one.checkVisibility() && !one.disabled)
    .map((one) => {
      const [ink, back] = [luminance(channels(getComputedStyle(one).color)), luminance(ground(one))];
      return [one.outerHTML.slice(0, 80), (Math.max(ink, back) + 0.05) / (Math.min(ink, back) + 0.05)];
    }).filter(([, contrast]) => contrast < least);
}"""
"""Texts whose contrast to their ground is below a bar (WCAG 2.2, 1.4.3)."""


def test_one_file_opens_by_itself_and_relights_alike(folder: Path, tmp_path: Path, watched: Watched) -> None:
    page_file = tmp_path / "page.html"
    held = write_single_page(show_of(folder), page_file, width_px=640, count=3)
    assert (held.pictures, held.missing, held.width_px) == (12, 0, small.COLS)
    assert held.total_bytes == page_file.stat().st_size
    text = page_file.read_text()
    assert str(tmp_path) not in text
    assert str(folder) not in text
    page = watched.open(page_file.as_uri())
    found = relit_in(page, lights=[light(KEY)])
    assert np.abs(found - albedo() * lambert(KEY)).max() <= 1e-3
    page.keyboard.press("End")
    shown(page, 1006)
    page.keyboard.press("t")
    page.wait_for_selector("#timing-facts dt")
    assert [url for url in watched.asked if not url.startswith("data:")] == [page_file.as_uri()]


@pytest.mark.parametrize("in_one_file", [False, True])
def test_results_side_by_side_are_each_relit_as_they_are_under_the_same_light(
    in_one_file: bool, folder: Path, tmp_path: Path, watched: Watched
) -> None:
    other = small.results(tmp_path / "other", y="down", world=True)
    for file in other.glob("albedo/*.exr"):
        small.write(file, small.rgb(np.full((small.ROWS, small.COLS, 3), 0.25)), int(file.stem[-4:]))
    show = side_by_side([show_of(folder), show_of(other)], [folder, other])
    assert [one.group for one in show.sequences] == ["out"] * 4 + ["other"] * 4
    with page_server(show, port=0) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        write_single_page(show, tmp_path / "page.html", width_px=640, count=3)
        page = watched.open((tmp_path / "page.html").as_uri() if in_one_file else server.url)
        assert page.evaluate("() => psvideo.panes()") == ["relit", "r2.relit"]
        assert np.abs(relit_in(page, lights=[light(KEY)]) - albedo() * lambert(KEY)).max() <= 1e-3
        found = page.evaluate("() => Array.from(psvideo.relitValues('r2.relit').values)")
        second = np.array(found).reshape(small.ROWS, small.COLS, 4)[..., :3]
        assert np.abs(second - 0.25 * lambert(KEY)).max() <= 1e-3
        settled(page)
        assert page.locator(".caption").all_inner_texts() == ["out · 1001", "other · 1001 · world space · y down"]
        server.shutdown()
        thread.join()


@pytest.mark.parametrize(("fps", "shown"), [(1 / 12, False), (24.0, True)])
def test_results_of_photographs_have_no_time(
    fps: float, shown: bool, folder: Path, tmp_path: Path, watched: Watched
) -> None:
    write_single_page(replace(show_of(folder), fps=fps), tmp_path / "page.html", width_px=64, count=small.COUNT)
    page = watched.open((tmp_path / "page.html").as_uri())
    assert [bool(page.locator(f"#{name}").inner_text()) for name in ("clock", "rate")] == [shown, shown]


def test_what_cannot_stand_side_by_side_is_named(folder: Path, tmp_path: Path) -> None:
    one = show_of(folder)
    with pytest.raises(UsageError, match=r"wide: its pictures are 128 x 48 pixels"):
        side_by_side([one, replace(one, width_px=128)], [folder, tmp_path / "wide"])
    with pytest.raises(UsageError, match=r"plates: holds no results"):
        side_by_side([one, replace(one, kind="plates")], [folder, tmp_path / "plates"])
    later = replace(one, sequences=tuple(replace(s, numbers=tuple(n + 7 for n in s.numbers)) for s in one.sequences))
    both = side_by_side([one, later], [tmp_path / "a" / "out", tmp_path / "b" / "out"])
    assert {s.timeline for s in both.sequences} == {"rounds", "r2.rounds"}, "then by time"
    assert both.name == "a/out | b/out"


WITHOUT_WEBGL2 = """
const open = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind === "webgl2" ? null : open.call(this, kind, ...rest);
};"""


def test_a_browser_without_webgl2_says_so_and_shows_flat_pictures(server: PageServer, watched: Watched) -> None:
    watched.page.add_init_script(WITHOUT_WEBGL2)
    page = watched.open(server.url)
    assert "WebGL2" in page.locator("#notice").inner_text()
    page.keyboard.press("s")
    page.evaluate("lights => psvideo.change({ lights })", [light((0, 0, 1))])
    page.wait_for_function("() => !psvideo.loader.loading")
    settled(page)
    bright = canvas_pixel(page, 0.5, 0.5)
    base = page.evaluate("() => psvideo.bases.get('albedo')")
    linear = np.clip(albedo()[24, 32] * base, 0, 1)
    assert bright[:3] == pytest.approx(255 * (1.055 * linear ** (1 / 2.4) - 0.055), abs=6)
    page.keyboard.press("2")
    settled(page)
    page.wait_for_function("() => !psvideo.loader.loading")
    assert canvas_pixel(page, 0.5, 0.5)[:3] == pytest.approx([128, 128, 255], abs=8)
