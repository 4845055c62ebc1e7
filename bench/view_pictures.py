"""The pictures of the page in docs/view.md: ``python -m bench.view_pictures psvideo-demo docs/pictures``."""

import shutil
import sys
import threading
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, sync_playwright

from bench.view import FLAGS
from psvideo.page import page_server, show_of

LAPTOP: ViewportSize = {"width": 1366, "height": 768}
IN_DOCS = (928, 522)
WARM = {"place": 0, "name": "Light 1", "direction": [0.72, 0.42, 0.55], "colour": "#ffd9a8", "intensity": 1.3}
COOL = {"place": 1, "name": "Light 2", "direction": [-0.88, 0.18, 0.44], "colour": "#8fc2ff", "intensity": 1.1}
WITHOUT_WEBGL2 = """
const open = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind === "webgl2" ? null : open.call(this, kind, ...rest);
};"""


def view_pictures(demo: Path, pictures: Path) -> list[Path]:
    """Photograph the page on ``out/`` and the ``clip/`` beside it in a folder; return the pictures' paths."""
    pictures.mkdir(parents=True, exist_ok=True)
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with page_server(show_of(demo / "out"), port=0) as server, sync_playwright() as play:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        browser = play.chromium.launch(executable_path=program, args=FLAGS.split())
        made = [
            _relit(_opened(browser, server.url), pictures / "view_relit.png"),
            _all(_opened(browser, server.url), pictures / "view_quantities.png"),
            _before(_opened(browser, server.url), pictures / "view_before_after.png"),
            _timing(_opened(browser, server.url), pictures / "view_timing.png"),
            _flat(_opened(browser, server.url, script=WITHOUT_WEBGL2), pictures / "view_without_webgl2.png"),
        ]
        browser.close()
        server.shutdown()
        thread.join()
    return made


def _opened(browser: Browser, url: str, *, script: str = "") -> Page:
    page = browser.new_page(viewport=LAPTOP)
    page.set_default_timeout(120_000)
    if script:
        page.add_init_script(script)
    page.goto(url)
    page.wait_for_selector("body[data-ready=true]")
    page.evaluate(
        "lights => psvideo.change({ lights, specular: 0.06 })", [dict(WARM, near=False), dict(COOL, near=False)]
    )
    return page


def _taken(page: Page, path: Path) -> Path:
    """Photograph a page once everything that it asked for is drawn."""
    page.wait_for_function("() => !psvideo.loader.loading && !psvideo.source.underway.size")
    page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    page.screenshot(path=path)
    page.close()
    with Image.open(path) as taken:
        taken.convert("RGB").resize(IN_DOCS, Image.Resampling.LANCZOS).save(path, optimize=True)
    return path


def _relit(page: Page, path: Path) -> Path:
    page.evaluate("() => psvideo.go(Math.floor(psvideo.master.numbers.length / 2))")
    return _taken(page, path)


def _all(page: Page, path: Path) -> Path:
    page.keyboard.press("f")
    page.evaluate("() => psvideo.change({ markInvalid: true })")
    page.mouse.move(300, 220)
    return _taken(page, path)


def _before(page: Page, path: Path) -> Path:
    page.keyboard.press("b")
    page.wait_for_function("() => psvideo.loader.slowIds().every((id) => psvideo.loader.blocks()[id])")
    return _taken(page, path)


def _timing(page: Page, path: Path) -> Path:
    page.keyboard.press("t")
    page.wait_for_selector("#timing-facts dt")
    page.evaluate("() => psvideo.showIn(1, 'frames')")
    page.evaluate("() => psvideo.go(3)")
    return _taken(page, path)


def _flat(page: Page, path: Path) -> Path:
    return _taken(page, path)


if __name__ == "__main__":
    for picture in view_pictures(Path(sys.argv[1]), Path(sys.argv[2])):
        print(picture, picture.stat().st_size)
