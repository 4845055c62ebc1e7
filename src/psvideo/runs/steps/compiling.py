"""Compiling ahead what usual runs need: a few small virtual takes are run once, each in a process of its own.

There is no list of loops and types: what these runs compile is kept for all later ones (docs/decisions/first-run.md).
"""

import tempfile
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from psvideo.compute.progress import Watch, unwatched
from psvideo.compute.threads import thread_count
from psvideo.model.quantities import Aov
from psvideo.runs.steps.caller import Caller
from psvideo.runs.steps.small_pictures import RING, SmallPictures

SCENE = """
schema = "psvideo-scene/1"
name = "small"
frames = {frames}
camera = {{ width_px = 96, height_px = 120, fps = 100, shutter_deg = 360, readout_s = 0.0097, width_m = 1.0, {camera} }}
output = {{ kind = "{kind}" }}
ambient = {{ level = 0.02 }}
object = [{{ mesh = "sphere", albedo = {{ pattern = "noise" }}{motion}{gloss} }}]
light = [{lights}]
"""
GLOSS = ", specular = { strength = 0.3, roughness = 0.35 }"


@dataclass(frozen=True, kw_only=True)
class SmallTake:
    """A take that makes loops compile: its number of lights, whether its rig says that they stand ``near``, its files
    and camera, what is asked of it, and whether it is watched live too. Where results are ``float32``, its frames are
    too."""

    lights: int
    near: bool = False
    kind: str = "png16"
    camera: str = "full_well_e = 30000"
    motion: str = ""
    gloss: str = ""
    aov: tuple[Aov, ...] = ()
    live: bool = False
    float32: bool = False

    @property
    def scene(self) -> str:
        """The scene as its file would hold it."""
        lights = [f'{{ name = "l{n}", direction = [{x}, {y}, 0.8] }}' for n, (x, y) in enumerate(RING[: self.lights])]
        return SCENE.format(
            frames=FRAMES_LIVE if self.live else 6 * (self.lights + 1),
            camera=self.camera,
            kind=self.kind,
            motion=self.motion,
            gloss=self.gloss,
            lights=", ".join(lights),
        )


FRAMES_LIVE = 72
"""Enough to find the strobe in, and to follow it."""

USUAL = (
    SmallTake(lights=8, aov=("residual", "error", "depth", "beauty"), gloss=GLOSS, live=True),
    SmallTake(lights=4, motion=", motion = { velocity_m_per_s = [0.4, 0.0, 0.0] }", aov=("depth",)),
    SmallTake(lights=3, kind="png8", camera='bits = 8, transfer = "srgb"', aov=("error",), live=True),
    SmallTake(lights=4, kind="dng", camera='cfa = "RGGB"', live=True),
    SmallTake(lights=3, kind="exr", float32=True),  # frames of 32 bits, as Algorithm 1's pictures are
    SmallTake(lights=3, near=True),
)
"""What usual footage runs through: 16 and 8 bits, mosaics, floats; few lights and many, far and near; at rest and
moving."""


PICTURES = (
    SmallPictures(lights=3, near=True),
    SmallPictures(lights=4),
    SmallPictures(lights=3, colour=True),
    SmallPictures(lights=8, colour=True, near=True),
    SmallPictures(lights=8),
    SmallPictures(lights=8, metal=True),
)
"""What a caller from Python may hand over: few lights and many, near and far, in colour and grey, matte and metal."""


def solve_small() -> None:
    """Solve the small pictures."""
    from psvideo.solve.images import solve_images

    for one in PICTURES:
        solve_images(one.images, one.rig)
    _draw_an_outline()
    _leave_a_point()


def compile_ahead(*, watch: Watch = unwatched) -> None:
    """Compile and keep what usual runs need, takes side by side; what is kept already is only loaded.

    Raises PsvideoError where a small take cannot be run.
    """
    with ProcessPoolExecutor(min(thread_count(), len(USUAL)), mp_context=get_context("spawn")) as pool:
        waiting = [*(pool.submit(run_small, take) for take in USUAL), pool.submit(solve_small)]
        for one in watch(waiting, total=len(waiting), what="compiling, once", unit="takes"):
            one.result()


def filmed(take: SmallTake, folder: Path) -> Path:
    """Film a small take into a folder, and return the clip, its rig beside it."""
    from psvideo.formats.light_lists.light_list_writer import write_rig
    from psvideo.synth.shoot import shoot

    scene, clip = folder / "small.toml", folder / "clip"
    scene.write_text(take.scene, encoding="utf-8")
    shoot(scene, clip)
    if take.float32:
        _as_floats(clip / "frames")
    if take.near:
        write_rig(clip / "rig.toml", SmallPictures(lights=take.lights, near=True).rig)
    return clip


def _halve_one(clip: Path) -> None:
    """Halve a plate, as runs do with large pictures before they look for motion."""
    from psvideo.plates.gather import gather
    from psvideo.plates.named_timing import read_or_find_timing
    from psvideo.sync.open_take import open_take

    take = open_take(clip)
    some = next(iter(gather(take, read_or_find_timing(take, None, first_light=None))))
    some.plates[0].picture.halved()


def _search_otherwise(clip: Path) -> None:
    """Look for the strobe under every readout, as runs do where a plan's camera seems to be another, and for LEDs that
    are slow to go out."""
    from psvideo.sync.find import as_profiles
    from psvideo.sync.open_take import open_take
    from psvideo.sync.rowfit.coarse.search import search
    from psvideo.sync.rowfit.coarse.seed import SEARCH_ROWS, first_guess
    from psvideo.sync.take_timing import take_profiles

    take = open_take(clip)
    seen = take_profiles(take)
    rows = as_profiles(take.plan, seen.index, seen.value, seen.doubt).one_window().binned(SEARCH_ROWS)
    guess = first_guess(take.plan)
    search(take.plan, rows, range_ppm=0.0, start=guess, readout_known=False)
    search(take.plan, rows, range_ppm=0.0, start=replace(guess, fall_s=1e-4), readout_known=True)


def _draw_an_outline() -> None:
    """Draw an outline of one point, as runs do where near lights find a wall behind their subject."""
    from psvideo.solve.nearest_surfaces import FAR, nearest_surfaces

    unknown, ways = np.full((2, 1, 1), -1, np.int32), np.full((2, 1, 1), FAR)
    nearest_surfaces(np.ones((1, 1, 1), np.float32), np.ones((1, 1), np.float32), 0.0, 0.0, unknown, ways)


def _leave_a_point() -> None:
    """Ask what one surface leaves of a point's plates, as runs do where something turns."""
    from psvideo.plates.align.rigid.along_kernel import PLANES, along_points

    dark, lamps, place = np.zeros((4, 2, 2, 3), np.float32), np.ones((4, 4), np.float32), np.zeros((7, 1), np.float32)
    along_points(dark, lamps, place, 0, 1, np.zeros((2, 1), np.float32), np.zeros((PLANES, 4, 1), np.float32))


def _as_floats(frames: Path) -> None:
    """Write half-float frames again as 32-bit floats, as renderers do: pictures that no code of 16 bits holds."""
    from psvideo.clip.decode.exr import read_halves
    from psvideo.formats.exr_files import write_exr

    for path in frames.glob("*.exr"):
        write_exr(path, {"Y": read_halves(path).planes[0].astype(np.float32)}, half=False)


def run_small(take: SmallTake) -> None:
    """Film a small take and run the whole of ``normals`` on it, timing and all, in a folder that is gone afterwards."""
    from psvideo.runs.live import live
    from psvideo.runs.normals import normals

    quiet = Caller(say=_unsaid, warn=_unsaid, detail=_unsaid)
    with tempfile.TemporaryDirectory(prefix="psvideo-compiling-") as folder:
        clip = filmed(take, Path(folder))
        normals(clip, rig=clip / "rig.toml", out=Path(folder) / "out", aov=take.aov, float32=take.float32, caller=quiet)
        _halve_one(clip)
        _search_otherwise(clip)
        if take.live:
            live(clip, rig=clip / "rig.toml", pace="fastest", caller=quiet)


def _unsaid(_: str) -> None: ...


if __name__ == "__main__":  # what building the package calls
    compile_ahead()
