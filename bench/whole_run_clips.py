"""The clips of ``bench/whole_run``: 1080p colour at 119.88 fps, every light's picture made once and put into frames by
the virtual shoot's sensor, with a camera's noise, in five kinds of files."""

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import av
import cv2
import numpy as np
import tifffile
from numpy.typing import NDArray

from psvideo.formats.frame_rates import parse_fps
from psvideo.formats.plan_toml import format_plan
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.whole_folders import whole_folder
from psvideo.model.camera import Camera, Encoding
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig
from psvideo.synth import Noise, TrueClock, TrueFlash
from psvideo.synth.camera.curves import CURVES
from psvideo.synth.camera.encode import Codes, mosaic
from psvideo.synth.camera.frames import write_frame
from psvideo.synth.camera.noise import frame_rng
from psvideo.synth.camera.sensor import expose_frames
from psvideo.synth.lamps.true_flashes import true_flashes
from psvideo.synth.scene_tables import CameraTable

Kind = Literal["tiff", "exr", "dng", "prores", "h264"]
Image = NDArray[np.float32]

ROWS, COLS = 1080, 1920
FPS = "120000/1001"
FLASH_S = 0.0008
SPEED_PX = 2
"""How far the subject of a moving clip goes from flash to flash."""
SUBJECT = slice(480, 1440)
"""The columns that move; those beside them stand still."""
NOISE = Noise(full_well_e=20_000, read_e=6)
LINEAR_16 = Codes(curve=CURVES["linear"], bits=16, black=0, white=65535, top=65535)
LINEAR_12 = Codes(curve=CURVES["linear"], bits=12, black=256, white=4095, top=4095)
SRGB_10 = Codes(curve=CURVES["srgb"], bits=10, black=0, white=1023, top=1023)
ENCODERS: dict[str, tuple[str, str, dict[str, str]]] = {
    "prores": ("prores_ks", "yuv422p10le", {"profile": "hq"}),
    "h264": ("libx264", "yuv420p", {"crf": "14", "preset": "veryfast", "threads": "1"}),
}


@dataclass(frozen=True, kw_only=True)
class ClipOf:
    """One clip: the kind of its files, how many lights flash in a round beside the dark slot, and whether its subject
    moves, or everything."""

    kind: Kind
    lights: int
    moving: bool
    everything: bool = False

    @property
    def name(self) -> str:
        """What a row is called, and chosen by."""
        return f"{self.kind} {self.lights} {'everything' if self.everything else 'moving' if self.moving else 'still'}"

    @property
    def plan(self) -> Plan:
        """The capture plan: full shutter, readout nearly as long as the frame, one dark slot a round."""
        fps = parse_fps(FPS)
        period_s = float(1 / fps)
        camera = Camera(width_px=COLS, height_px=ROWS, fps=fps, exposure_s=period_s, readout_s=0.97 * period_s)
        if self.kind in ENCODERS:
            camera = replace(camera, encoding=Encoding(transfer="srgb"))
        lit = [PlannedFlash(lights={name: 1.0}, duration_s=FLASH_S) for name in directions(self.lights)]
        return Plan(
            camera=camera, flashes=(*lit, PlannedFlash(lights={}, duration_s=FLASH_S)), dark_s=1.0002 * period_s
        )

    def frames_of(self, rounds: int) -> int:
        """Return how many frames show so many whole rounds, wherever the strobe began."""
        plan = self.plan
        return math.ceil((rounds + 1) * plan.cycle_s / plan.camera.frame_period_s) + 1


def directions(lights: int) -> dict[str, tuple[float, float, float]]:
    """Return unit vectors to so many lights on a ring 30 degrees off the axis."""
    turns = [0.3 + 2 * math.pi * k / lights for k in range(lights)]
    return {f"l{k}": (0.5 * math.cos(turn), 0.5 * math.sin(turn), math.sqrt(0.75)) for k, turn in enumerate(turns)}


def filmed(clip: ClipOf, cache: Path, *, frames: int) -> tuple[Path, Path]:
    """Return a clip (a folder or a movie) and its rig in the cache folder; film it where it is not there yet."""
    folder = cache / f"{clip.name.replace(' ', '_')}_{frames}"
    movie = {"prores": "clip.mov", "h264": "clip.mp4"}.get(clip.kind)
    if not folder.is_dir():
        with whole_folder(folder, mark="plan.toml", force=False) as there:
            if movie:
                _write_movie(clip, there / movie, _exposed(clip, frames))
            else:
                _write_frames(clip, there, _exposed(clip, frames))
            (there / "plan.toml").write_text(format_plan(clip.plan), encoding="utf-8")
            lights = tuple(Light(name=name, direction=one) for name, one in directions(clip.lights).items())
            (there / "rig.toml").write_text(format_rig(Rig(lights=lights)), encoding="utf-8")
    return folder / movie if movie else folder, folder / "rig.toml"


def _exposed(clip: ClipOf, frames: int) -> Iterator[Image]:
    plan = clip.plan
    flashes = true_flashes(plan, TrueClock(phase_s=0.0123, offset_ppm=20.0), frames=frames)
    light = expose_frames(plan, flashes, _scene(clip), frames=range(frames), channels=3)
    for number, image in enumerate(light):
        yield np.clip(NOISE.add(image, frame_rng(0, number)), -0.05, 1.0)


def _scene(clip: ClipOf) -> Callable[[TrueFlash], Image | None]:
    """A textured relief, its middle half going sideways where the clip moves, or all of it."""
    subject = slice(None) if clip.everything else SUBJECT
    y, x = np.mgrid[0:ROWS, 0:COLS].astype(np.float32) / 240
    normals = np.stack([0.4 * np.sin(9 * x), 0.4 * np.cos(7 * y), np.ones_like(x)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    rough = cv2.GaussianBlur(np.random.default_rng(1).standard_normal((ROWS, COLS, 3)).astype(np.float32), (0, 0), 3.0)
    albedo = np.clip(0.6 + 2.0 * rough, 0.3, 0.9)
    lit = {
        slot: np.asarray(np.maximum(normals @ np.array(one, np.float32), 0)[..., None] * albedo, np.float32)
        for slot, one in enumerate(directions(clip.lights).values())
    }

    def plate(flash: TrueFlash) -> Image | None:
        image = lit.get(flash.slot)
        if image is None or not clip.moving:
            return image
        moved = image.copy()
        moved[:, subject] = np.roll(image[:, subject], SPEED_PX * flash.index, axis=1)
        return moved

    return plate


def _write_frames(clip: ClipOf, folder: Path, images: Iterable[Image]) -> None:
    (folder / "frames").mkdir()
    camera = CameraTable(width_px=COLS, height_px=ROWS, fps=FPS, shutter_deg=360, readout_s=0.0, cfa="RGGB")
    for number, image in enumerate(images):
        path = folder / "frames" / f"relief.{number:05d}"
        if clip.kind == "tiff":  # uncompressed, as converters write it
            tifffile.imwrite(path.with_name(f"{path.name}.tif"), LINEAR_16.from_light(image), photometric="rgb")
        elif clip.kind == "exr":
            codes = LINEAR_16.from_light(image)
            write_frame(path.with_name(f"{path.name}.exr"), codes, kind="exr", camera=camera, scale=LINEAR_16)
        else:
            codes = LINEAR_12.from_light(mosaic(image, "RGGB"))
            write_frame(path.with_name(f"{path.name}.dng"), codes, kind="dng", camera=camera, scale=LINEAR_12)


def _write_movie(clip: ClipOf, path: Path, images: Iterable[Image]) -> None:
    encoder, pixels, options = ENCODERS[clip.kind]
    rate = Fraction(clip.plan.camera.fps)
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(encoder, rate=rate, options=options)
        stream.width, stream.height, stream.pix_fmt = COLS, ROWS, pixels
        stream.codec_context.time_base = 1 / rate
        for number, image in enumerate(images):
            codes = np.asarray(SRGB_10.from_light(image) * 64, np.uint16)
            frame = av.VideoFrame.from_ndarray(codes, "rgb48le").reformat(format=pixels)
            frame.pts, frame.time_base = number, 1 / rate
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
