"""The live page while the camera runs: every result is shown there, some are judged, and a click finds lights."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from psvideo.formats.rig_folder import RIG_FILE
from psvideo.formats.rig_toml import SCHEMA as RIG
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.whole_files import check_ending, refuse_existing, write_text
from psvideo.live.ball_lights import BallLights
from psvideo.live.incoming.source import LiveSource
from psvideo.live.running import Running
from psvideo.live.showing.newest_pictures import NewestPictures
from psvideo.live.showing.newest_result import NewestRound
from psvideo.live.showing.page_server import live_page
from psvideo.live.showing.smaller import smaller_plan
from psvideo.live.watching import Watching, told
from psvideo.model.irradiance.intensity import lights_as_planned
from psvideo.model.rig import Rig
from psvideo.model.timing import timed_camera
from psvideo.runs.steps.caller import Caller
from psvideo.solve.near_surface import near_surface_of
from psvideo.solve.normals.illumination import illumination

Kept = Callable[[Rig], str]
"""Keeps a rig that was found live, and says what became of it."""


@dataclass(frozen=True, kw_only=True)
class PageAddress:
    """Where the page is served: at a ``port`` (None: a free one) of ``host``, to those who know the ``token``."""

    host: str
    port: int | None
    token: str | None


def check_gives_normals(rig: Rig, source: LiveSource) -> None:
    """Raise PsvideoError where a rig gives no normals: before a board flashes, not when the first round is solved."""
    lights, camera = lights_as_planned(rig, source.plan), source.plan.camera
    near = near_surface_of(rig, lights, height_px=camera.height_px, width_px=camera.width_px)
    channels = source.channels or max(len(light.by_channel) for light in lights)
    illumination(lights, channels=channels, ground=None if near is None else near.ground)


def rig_keeper(path: Path | None, *, force: bool) -> Kept:
    """Return what writes a rig that was found live to a path, if any, and says what became of it.

    Raises UsageError where the path is no rig's, or there is something.
    """
    if path is None:
        return lambda rig: "Lights found, and used from now on. With `rig_out` they are written, too."
    check_ending(path, ".toml", name="rig_out")
    refuse_existing(path, force=force, mark=RIG)

    def write(rig: Rig) -> str:
        write_text(path, format_rig(rig))
        return f"Lights found, used from now on, and written to {path}."

    return write


@contextmanager
def viewed(
    running: Running,
    rig: Rig | None,
    address: PageAddress,
    *,
    kept: Kept,
    opened: Callable[[str], None],
    caller: Caller,
) -> Iterator[None]:
    """Serve the live page of a run while the block runs; ``opened`` gets its URL, ``kept`` a rig found on the page."""
    plan, pictures = running.source.plan, NewestPictures()
    watching, shown = Watching(plan=plan, rig=rig, spell=caller.spell), running.shown
    ball = BallLights(rig=rig, found=lambda found: _used(found, running, watching, kept))

    def show(newest: NewestRound) -> None:
        pictures.put(newest, timed_camera(smaller_plan(plan, newest.step), newest.timing))
        ball.look(newest)
        shown(newest)

    def judge(newest: NewestRound, until_s: float) -> None:
        watching.look(newest, smaller_plan(plan, newest.step), until_s=until_s)

    def say() -> dict[str, object]:
        return told(running.status, watching) | {"ball": [caller.spell(words) for words in ball.words]}

    running.shown, running.meanwhile, running.drawn_ages_s = show, judge, pictures.drawn_ages_s
    server = live_page(pictures, say, host=address.host, port=address.port, token=address.token, ball=ball.ask)
    try:
        opened(server.url)
        yield
    finally:
        server.close()


def _used(found: Rig, running: Running, watching: Watching, kept: Kept) -> str:
    """Use a rig that was found from now on, record it beside the frames, and keep it; return what became of it."""
    check_gives_normals(found, running.source)
    running.chain.rig = watching.rig = found
    if running.recording is not None:
        running.recording.beside[RIG_FILE] = format_rig(found)
    return kept(found)
