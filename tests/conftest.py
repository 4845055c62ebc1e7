"""What several tests share: where the real data lie, small plans to try things on, a browser for the few that need one.

Nothing here imports Playwright: tests that open no browser run without it.
"""

import shutil
import subprocess
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import HealthCheck, settings

from psvideo.formats.plan_toml import format_plan
from psvideo.model.camera import Camera, Encoding
from psvideo.model.plan import Plan, PlannedFlash, default_dark_s
from psvideo.strobe.limits import cycle_check
from psvideo.strobe.link.protocol import format_request
from psvideo.strobe.link.requests import Arm, Slot, Steps
from psvideo.strobe.link.words import WiringName
from psvideo.strobe.stand_ins.toolchain import AVR_BOARDS, AvrBoard, build

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Playwright
    from watched_page import Watched

settings.register_profile(
    "suite", derandomize=True, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("suite")
"""The same examples in every run, however busy the machine is."""
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real captures, which is not part of the project; tests that need it are skipped without it."""
    if not SHARED_DATA.is_dir():
        pytest.skip("the real captures (../shared/data) are not on this machine")
    return SHARED_DATA


@pytest.fixture(scope="session")
def playwright() -> "Iterator[Playwright]":
    """What drives browsers; a process can start it once only. Tests fail, and say so, where it is not installed."""
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        pytest.fail("this test needs Playwright: python -m pip install -e '.[test]' installs it, as make test does")
    with sync_playwright() as started:
        yield started


@pytest.fixture(scope="session")
def chromium() -> str:
    """The path of the system's Chromium. Tests fail, and say so, where there is none."""
    program = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if program is None:
        pytest.fail("this test needs a Chromium browser: Debian's package chromium (tests/install.sh installs it)")
    return program


@pytest.fixture(scope="session")
def browser(playwright: "Playwright", chromium: str) -> "Iterator[Browser]":
    """A browser that draws by software and asks nobody but the page's server."""
    from watched_page import ALONE

    started = playwright.chromium.launch(executable_path=chromium, headless=True, args=ALONE)
    yield started
    started.close()


@pytest.fixture
def watched(browser: "Browser") -> "Iterator[Watched]":
    """A small browser window, of which nothing may have been complained when the test ends."""
    from watched_page import SMALL, Watched

    context = browser.new_context(viewport=SMALL, has_touch=True)
    one = Watched(context.new_page())
    yield one
    context.close()
    assert not one.complaints


@pytest.fixture(scope="session")
def make_plan() -> Callable[..., Plan]:
    """Make a small plan: three lights and a dark slot, full shutter, readout as long as the frame, unless said."""
    return _make_plan


def _make_plan(
    *,
    lights: tuple[str, ...] = ("key", "left", "right"),
    dark: bool = True,
    dark_every: int = 1,
    duration_s: float = 0.0008,
    width_px: int = 24,
    height_px: int = 120,
    fps: Fraction = Fraction(120_000, 1001),
    shutter: float = 1.0,
    readout: float = 1.0,
    mode: str = "rolling",
    clock_tolerance_ppm: float = 200.0,
) -> Plan:
    period_s = float(1 / fps)
    camera = Camera(
        width_px=width_px,
        height_px=height_px,
        fps=fps,
        exposure_s=shutter * period_s,
        readout_s=readout * period_s,
    )
    flashes = [PlannedFlash(lights={light: 1.0}, duration_s=duration_s) for light in lights]
    if dark:
        flashes.append(PlannedFlash(lights={}, duration_s=duration_s))
    dark_s = default_dark_s(camera, [duration_s], mode=mode, clock_tolerance_ppm=clock_tolerance_ppm)  # type: ignore[arg-type]
    return Plan(
        camera=camera,
        flashes=tuple(flashes),
        dark_s=dark_s,
        mode=mode,  # type: ignore[arg-type]
        dark_every=dark_every,
        clock_tolerance_ppm=clock_tolerance_ppm,
    )


@pytest.fixture
def written_plan(tmp_path: Path, make_plan: Callable[..., Plan]) -> Callable[..., Path]:
    """Return what writes a plan whose frames have a size, a rate and an encoding, and gives its path."""

    def write(*, rows: int, cols: int, fps: Fraction = Fraction(120000, 1001), **encoding: Any) -> Path:
        plan = make_plan(width_px=cols, height_px=rows, fps=fps)
        camera = replace(plan.camera, encoding=Encoding(**encoding))
        (tmp_path / "plan.toml").write_text(format_plan(replace(plan, camera=camera)))
        return tmp_path / "plan.toml"

    return write


@pytest.fixture(scope="session")
def emulate() -> Callable[..., list[str]]:
    """Play a script (lights/emulator/script.h) on a board fresh from power-on and return what it printed.

    Where the tools are missing, tests fail with the names of the Debian packages.
    """
    built = {board: build(board) for board in AVR_BOARDS}

    def play(
        script: Sequence[str],
        *,
        board: AvrBoard = "atmega328p",
        wiring: WiringName = "gated",
        trace: Path | None = None,
        breakable: bool = False,
    ) -> list[str]:
        """``breakable``: the build that knows HANG (lights/firmware/hang.h)."""
        firmware = built[board].firmware
        words: list[str | Path] = [built[board].emulator, "--board", board, "--wiring", wiring, "--script", "-"]
        words += ["--trace", trace] if trace else []
        words.append(firmware.with_name(f"{board}-hang.elf") if breakable else firmware)
        text = "\n".join(["wait 5", *script, ""])
        return subprocess.run(words, input=text, capture_output=True, text=True, check=True).stdout.splitlines()

    return play


@pytest.fixture(scope="session")
def upload() -> Callable[..., list[str]]:
    """Turn slots that are played once each into a script that uploads and arms them."""

    def lines(slots: Sequence[Slot], *, wiring: WiringName = "gated") -> list[str]:
        requests = [*slots, Steps(first=0, slots=tuple(range(len(slots)))), Arm(check=cycle_check(slots))]
        sent = [format_request(request).decode().strip() for request in requests]
        return [f"send WIRING {wiring}", *(f"send {text}" for text in sent)]

    return lines
