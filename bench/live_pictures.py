"""The pictures of the live page in docs/live.md: ``python -m bench.live_pictures CLIP docs/pictures``.

The clip, with its rig beside it, is played at its own pace; the page is photographed as it is, in Chromium.
"""

import base64
import io
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image

from bench.live_browser import Tab, browser

PAGE_PX = (1366, 768)
IN_DOCS = (928, 522)
MOST_S = 90.0
EVEN_S = 6.0
"""After the first results, which wait for what is loaded once."""
LINES = "document.querySelectorAll('#lines li').length"


def live_pictures(clip: Path, pictures: Path) -> list[Path]:
    """Photograph the page while it looks for the strobe, and once it judges the take; return the pictures' paths."""
    with browser(width_px=PAGE_PX[0], height_px=PAGE_PX[1]) as tab, _watched(clip) as url:
        tab.open(url)
        _wait(tab, "document.getElementById('state')?.dataset.state === 'seeking'")
        seeking = _taken(tab, pictures / "live_seeking.png")
        _wait(tab, f"{LINES} > 8")
        time.sleep(EVEN_S)
        return [seeking, _taken(tab, pictures / "live.png")]


@contextmanager
def _watched(clip: Path) -> Iterator[str]:
    """Play a clip until the block ends; give the page's address."""
    call = [
        sys.executable,
        "-m",
        "psvideo",
        "live",
        str(clip),
        "--rig",
        str(clip / "rig.toml"),
        "--no-browser",
        "--json",
    ]
    with subprocess.Popen(call, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as live:
        assert live.stdout is not None
        try:
            yield json.loads(live.stdout.readline())["url"]
        finally:
            live.terminate()


def _wait(tab: Tab, true: str) -> None:
    until_s = time.monotonic() + MOST_S
    while not tab.run(true):
        if time.monotonic() > until_s:
            raise RuntimeError(f"the page never came so far: {true}")
        time.sleep(0.1)


def _taken(tab: Tab, path: Path) -> Path:
    """Photograph a page, as small as it stands in the docs."""
    with Image.open(io.BytesIO(base64.b64decode(tab.picture()))) as picture:
        small = picture.convert("RGB").resize(IN_DOCS, Image.Resampling.LANCZOS)
        small.save(path, optimize=True)
    return path


if __name__ == "__main__":
    for made in live_pictures(Path(sys.argv[1]), Path(sys.argv[2])):
        print(made)
