"""Chromium without a screen that shows one page, and is asked as little as can be.

Playwright would do, but it hears every message of a WebSocket, as text: that costs more than to draw what is in it.
"""

import itertools
import json
import shutil
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from websockets.sync.client import ClientConnection, connect

from bench.view import FLAGS

READY_S = 30.0
LOOK_S = 0.02


@dataclass(kw_only=True)
class Tab:
    """The browser's one page; ``pid`` is the browser's process."""

    pid: int
    _asking: ClientConnection
    _numbers: Iterator[int] = field(default_factory=itertools.count)

    def run(self, script: str) -> Any:
        """Return what a line of JavaScript gives."""
        return self._asked("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def size(self, width_px: int, height_px: int) -> None:
        """Make the page so large."""
        given = {"width": width_px, "height": height_px, "deviceScaleFactor": 1, "mobile": False}
        self._asked("Emulation.setDeviceMetricsOverride", **given)

    def open(self, url: str) -> None:
        """Go to a page."""
        self._asked("Page.navigate", url=url)

    def pointer(self, x_px: float, y_px: float, *, click: bool = False) -> None:
        """Move the mouse to a place in the page, and click there."""
        for kind in ("mouseMoved", *(("mousePressed", "mouseReleased") if click else ())):
            pressed = {"button": "left", "clickCount": 1} if kind != "mouseMoved" else {}
            self._asked("Input.dispatchMouseEvent", type=kind, x=x_px, y=y_px, **pressed)

    def picture(self) -> str:
        """Return what the page looks like, as PNG in base 64."""
        return str(self._asked("Page.captureScreenshot", format="png")["data"])

    def _asked(self, method: str, **given: object) -> Any:
        number = next(self._numbers)
        self._asking.send(json.dumps({"id": number, "method": method, "params": given}))
        while (answer := json.loads(self._asking.recv(READY_S))).get("id") != number:
            pass
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']}")
        return answer["result"]


@contextmanager
def browser(*, width_px: int, height_px: int) -> Iterator[Tab]:
    """Give an empty page of a browser that runs until the block ends."""
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))))
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        call = [program, *FLAGS.split(), "--headless=new", "--remote-debugging-port=0", "--hide-scrollbars"]
        call += [f"--user-data-dir={folder}", "about:blank"]
        with subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            try:
                with connect(_address(Path(folder)), max_size=None) as asking:
                    tab = Tab(pid=process.pid, _asking=asking)
                    tab.size(width_px, height_px)
                    yield tab
            finally:
                process.terminate()


def _address(folder: Path) -> str:
    """Return where the page answers, once the browser has said by which port."""
    said, until_s = folder / "DevToolsActivePort", time.monotonic() + READY_S
    while time.monotonic() < until_s:
        if said.is_file() and (words := said.read_text(encoding="ascii").split()):
            with urllib.request.urlopen(f"http://127.0.0.1:{words[0]}/json/list") as answer:
                pages = [one for one in json.load(answer) if one["type"] == "page"]
            if pages:
                return str(pages[0]["webSocketDebuggerUrl"])
        time.sleep(LOOK_S)
    raise RuntimeError("the browser did not begin")
