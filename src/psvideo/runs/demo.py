"""The whole chain on a virtual shoot, and one picture that shows it: frames, plates, normals, albedo, relit."""

from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Clip, decoded_once, read_frames
from psvideo.compute.progress import Watch, unwatched
from psvideo.export.sequences.result_files import Delivery
from psvideo.export.space import Space
from psvideo.formats.screen_pictures import write_png
from psvideo.formats.whole_files import refuse_existing
from psvideo.model.rig import Vector
from psvideo.model.surface import Surface
from psvideo.pictures.contact import Strip, Tile, sheet
from psvideo.pictures.on_screen import exposure_for, srgb
from psvideo.pictures.quantity import picture_of
from psvideo.pictures.relighting import relight
from psvideo.plates.named_timing import read_or_find_timing
from psvideo.runs.instants.job import Job
from psvideo.runs.instants.results import normals_run
from psvideo.runs.steps.lighting import read_lighting
from psvideo.runs.steps.output import Output
from psvideo.solve.instants import Instant
from psvideo.sync.open_take import open_take
from psvideo.synth.scenes import builtin_scene
from psvideo.synth.shoot import shoot

SHOWN_FRAMES = slice(3, 7)
RELIT_FROM: tuple[Vector, ...] = ((0.85, 0.2, 0.5), (-0.6, 0.75, 0.35))
WARM, COOL = (1.0, 0.82, 0.6), (0.62, 0.8, 1.0)


def run_demo(folder: Path, *, force: bool = False, watch: Watch = unwatched) -> Path:
    """Film the built-in scene, solve it, and return the path of a picture that shows every step.

    Writes ``clip/`` (with its truth), ``out/`` (the results) and ``demo.png`` into the folder. Raises UsageError where
    the folder exists and ``force`` is not given.
    """
    refuse_existing(folder, force=force)
    clip_path, out = folder / "clip", folder / "out"
    shoot(
        builtin_scene(), clip_path, force=force, track=lambda frames: watch(frames, total=len(frames), what="filming")
    )
    delivery = Delivery(space=Space())
    output = Output(folder=out, force=force)
    with decoded_once(open_take(clip_path), output=out) as take:
        timing = read_or_find_timing(take, None, first_light=None, watch=watch)
        lighting = read_lighting(take, clip_path / "rig.toml")
        sheet_of = partial(demo_sheet, take.clip)
        job = Job(take=take, timing=timing, lighting=lighting, delivery=delivery)
        result = normals_run(job, output, watch=watch, picture_of=sheet_of)
    write_png(folder / "demo.png", result.picture)
    return folder / "demo.png"


def demo_sheet(clip: Clip, sample: Instant) -> NDArray[np.uint8]:
    """Return the picture: the first frames, one round's plates, and what they say about the surface."""
    exposure = exposure_for(sample.round.plates[0].image)
    frames = [
        Tile(f"frame {frame.number}", srgb(frame.image, exposure=exposure))
        for frame in read_frames(clip, clip.numbers[SHOWN_FRAMES])
    ]
    plates = [Tile(plate.light, srgb(plate.image, exposure=exposure)) for plate in sample.round.plates]
    return sheet(
        [
            Strip("Frames, as the camera records them", frames),
            Strip("Plates, one whole picture per light, rebuilt from the frames", plates),
            Strip(
                "What the plates say about the surface, and the surface under new light", _surface_tiles(sample.surface)
            ),
        ]
    )


def _surface_tiles(surface: Surface) -> list[Tile]:
    albedo = surface.albedo.astype(np.float32)
    exposure = exposure_for(albedo)
    warm = relight(surface, RELIT_FROM[0], colour=WARM, gloss=0.06)
    cool = relight(surface, RELIT_FROM[1], colour=COOL, gloss=0.06)
    return [
        Tile("normals", picture_of("normals", surface.normals)),
        Tile("albedo", picture_of("albedo", albedo)),
        Tile("relit, warm from the right", srgb(warm, exposure=exposure)),
        Tile("relit, warm and cool together", srgb(0.7 * warm + 0.6 * cool, exposure=exposure)),
    ]
