"""The page in a real browser: controls do what they say, what is named is shown, no other host is asked."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
import page_folder as small
import pytest
from watched_page import SMALL, Watched, albedo, canvas_pixel, light, serving, settled, shown

from psvideo.page.serving import PageServer

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page, ViewportSize

LAPTOP: ViewportSize = {"width": 1366, "height": 768}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = small.results(tmp_path_factory.mktemp("page") / "out")
    broken = made / "normals" / "take_normals.1005.exr"
    broken.write_bytes(broken.read_bytes()[:900])
    return made


@pytest.fixture(scope="module")
def server(folder: Path) -> Iterator[PageServer]:
    with serving(folder) as one:
        yield one


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


@pytest.mark.parametrize(("trusted", "said"), [(0, "nothing is trusted"), (29, "only 2 % is trusted")])
def test_a_picture_of_which_next_to_nothing_is_trusted_is_shown_and_said_so(
    trusted: int, said: str, browser: Browser, tmp_path: Path
) -> None:
    """Hatched all over it would show nothing at all; V hatches it all the same."""
    made = small.results(tmp_path / "out")
    _, inside = small.ball()
    sure = inside & (np.cumsum(inside).reshape(inside.shape) <= trusted)
    small.write(made / "valid" / f"take_valid.{small.FIRST}.exr", {"Y": sure.astype(np.float16)}, small.FIRST)
    with serving(made) as server:
        page = Watched(browser.new_context(viewport=SMALL).new_page()).open(server.url)
        box = page.locator(".pane").first.bounding_box()
        assert box is not None
        first = _drawn(page, box)
        assert said in page.locator(".caption").first.inner_text()
        assert not page.locator("#mark-invalid").is_checked()
        page.keyboard.press("v")
        settled(page)
        assert page.locator("#mark-invalid").is_checked()
        assert "trusted" not in page.locator(".caption").first.inner_text()
        assert (np.abs(first.astype(int) - _drawn(page, box)).max(axis=2) > 8).mean() > 0.05
        page.keyboard.press("ArrowRight")
        shown(page, small.FIRST + 1)
        assert "trusted" not in page.locator(".caption").first.inner_text()


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
