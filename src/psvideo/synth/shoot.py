"""The virtual shoot: a scene goes in, a clip folder as a camera would leave it comes out, the truth beside it."""

import contextlib
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from psvideo.errors import UsageError
from psvideo.formats.clip_layout import PLAN_FILE
from psvideo.formats.paths import path_of
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_folder import RIG_FILE
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.whole_files import not_written, refuse_existing
from psvideo.formats.whole_folders import whole_folder
from psvideo.model.arrays import Image
from psvideo.synth.camera.encode import codes_of, mosaic, sensor_noise
from psvideo.synth.camera.frames import SUFFIX, write_frame
from psvideo.synth.camera.noise import frame_rng
from psvideo.synth.camera.sensor import MainsSwing, expose_frames
from psvideo.synth.flash_truth import FlashTruth
from psvideo.synth.lamps.traced import TraceOptions, traced_light
from psvideo.synth.lamps.true_flashes import TrueClock, true_flashes
from psvideo.synth.other_cameras import filmed_by
from psvideo.synth.scene import read_scene
from psvideo.synth.scenes import scene_file
from psvideo.synth.shotplan import claimed_plan, true_clock
from psvideo.synth.stage import Stage, set_stage
from psvideo.synth.truth import write_scene_truth, write_timing

CLIPPED_WARNING = 0.005
"""A frame in which a larger share of the samples saturates is worth a word."""

Track = Callable[[Sequence[int]], Iterable[int]]


@dataclass(frozen=True, kw_only=True)
class VirtualTake:
    """What a virtual shoot left: the clip's folder, its frames and flashes, and what to know about them."""

    path: Path
    frames: int
    flashes: int
    complete: int
    clock: TrueClock
    clipped_share: float
    warnings: tuple[str, ...]


def shoot(
    scene: Path | str,
    out: Path | str,
    *,
    camera: str | None = None,
    force: bool = False,
    track: Track = iter,
    trace: TraceOptions | None = None,
) -> VirtualTake:
    """Film a virtual scene: a clip folder as a camera would leave it, and the truth beside it.

    Parameters
    ----------
    scene
        A scene file, or the name of one that comes with psvideo: bust, cameras, colour, fan, gloss, sphere,
        still_life.
    out
        The clip folder to write, whole or not at all: frames/, plan.toml and rig.toml as a camera and its crew would
        leave them, and truth/ with what only the virtual shoot knows.
    camera
        Which of a scene's cameras films, by its name; the first where left out.
    force
        Replaces an earlier virtual clip of that name.
    track
        Passes frame indices through, for showing progress.
    trace
        Lets the traced edges of a strobe controller light the scene instead of the plan's ideal train.

    Returns
    -------
    VirtualTake
        ``path``, how many ``frames`` and ``flashes`` there are and how many of these are ``complete``, the strobe's
        true ``clock``, ``warnings``.

    Raises
    ------
    UsageError
        Where ``out`` exists and ``force`` is not given; where the scene does not have that ``camera``.
    PsvideoError
        For a faulty scene or mesh, or where writing fails.

    Examples
    --------
    >>> import psvideo as ps
    >>> ps.shoot("sphere", "another_take/").frames
    12
    """
    scene, out = path_of("scene", scene), path_of("out", out)
    _refuse_footage(out, force=force)
    file = scene_file(scene)
    stage = set_stage(filmed_by(read_scene(file), camera, source=str(file)), file.parent)
    with whole_folder(out, mark="truth/scene.json", force=force) as folder, _nothing_left(folder, out):
        (folder / "frames").mkdir()
        return _film(stage, folder, out, track, trace)


def _refuse_footage(out: Path, *, force: bool) -> None:
    """Refuse to replace anything but an earlier virtual clip, even by force: footage cannot be made again."""
    refuse_existing(out, force=force)
    if out.exists() and not (out / "truth" / "scene.json").is_file():
        raise UsageError(
            f"{out}: exists and was not written by psvideo synth (it holds no truth/scene.json), so `force` does not "
            "replace it. Name another folder as `out`, or remove this one yourself."
        )


@contextlib.contextmanager
def _nothing_left(folder: Path, out: Path) -> Iterator[None]:
    """Remove an unfinished clip where the shoot fails: it is filmed again, never resumed."""
    try:
        yield
    except OSError as fault:
        shutil.rmtree(folder, ignore_errors=True)
        raise not_written(out, fault) from fault
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _film(stage: Stage, folder: Path, out: Path, track: Track, trace: TraceOptions | None) -> VirtualTake:
    """Expose and write frame by frame; only the plates that the current frame sees are held."""
    scene, plan = stage.scene, stage.plan
    clock = true_clock(scene)
    traced = None if trace is None else traced_light(scene, plan, clock, trace)
    if traced is None:
        flashes = parts = true_flashes(plan, clock, frames=scene.frames, dropped=scene.dropped)
    else:
        clock, flashes, parts = traced.clock, traced.flashes, traced.parts
    truth = FlashTruth(stage, folder / "truth", Counter(part.index for part in parts))
    kept = [n for n in range(scene.frames) if n not in scene.dropped]
    light = expose_frames(
        plan,
        parts,
        truth.plate,
        frames=track(kept),
        ambient_of=stage.ambient(),
        mains=MainsSwing(hz=scene.ambient.flicker_hz, depth=scene.ambient.flicker_depth),
        channels=scene.camera.channels,
    )
    clipped = [_record(stage, folder, n, image) for n, image in zip(kept, light, strict=True)]
    (folder / PLAN_FILE).write_text(format_plan(claimed_plan(scene)), encoding="utf-8")
    (folder / RIG_FILE).write_text(format_rig(stage.rig), encoding="utf-8")
    no_plane = stage.rig.plane is None and any(light.position_m is not None for light in stage.rig.lights)
    write_timing(folder / "truth", plan, flashes, truth.plates)
    write_scene_truth(folder / "truth", scene, plan, clock, max(clipped), traced)
    return VirtualTake(
        path=out,
        frames=len(kept),
        flashes=len(flashes),
        complete=sum(flash.complete for flash in flashes),
        clock=clock,
        clipped_share=max(clipped),
        warnings=tuple(_warnings(max(clipped), len(flashes), no_plane=no_plane)),
    )


def _record(stage: Stage, folder: Path, n: int, image: Image) -> float:
    """Write frame ``n`` as the camera records the collected light, and return the share of samples that saturate."""
    scene = stage.scene
    scale = codes_of(scene.camera, scene.output.kind)
    sampled = image if scene.camera.cfa is None else mosaic(image, scene.camera.cfa)
    codes = scale.from_light(sensor_noise(scene.camera).add(sampled, frame_rng(scene.seed, n)))
    name = f"{scene.name}.{scene.output.first_number + n:04d}{SUFFIX[scene.output.kind]}"
    write_frame(folder / "frames" / name, codes, kind=scene.output.kind, camera=scene.camera, scale=scale)
    return float(np.mean(sampled >= 1.0))


def _warnings(clipped: float, flashes: int, *, no_plane: bool) -> Iterator[str]:
    if no_plane:
        yield (
            "lights are near, and rig.toml does not say where the surface is, so that psvideo normals refuses it: that "
            "needs a view in perspective and a first object that is seen. Give the camera view = 'perspective' and "
            "focal_px."
        )
    if clipped > CLIPPED_WARNING:
        yield (
            f"up to {clipped:.1%} of a frame's samples saturate; lower the lights' intensity or the ambient level in "
            "the scene if that is not meant."
        )
    if flashes == 0:
        yield "no flash falls into the clip: it is shorter than the strobe's cycle. Give the scene more frames."
