"""One good small file of every kind that psvideo reads, to be damaged."""

import shutil
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
import tifffile
from numpy.typing import NDArray

from psvideo.formats.exr_files import write_exr
from psvideo.formats.light_lists.light_list_writer import write_rig
from psvideo.formats.rig_toml import read_rig
from psvideo.formats.timing_json import format_timing
from psvideo.model.choices import Compression
from psvideo.model.timing import DroppedFrames, Flash, Timing
from psvideo.synth.shoot import shoot

SIZE = (32, 48)
SCENE = """
schema = "psvideo-scene/1"
name = "hostile"
frames = 3
camera = {{ width_px = 48, height_px = 32, fps = 100, shutter_deg = 360, readout_s = 0.0097, width_m = 1.0{camera} }}
output = {{ kind = "{kind}" }}
object = [{{ mesh = "sphere" }}]
light = [{{ name = "a", direction = [0.5, 0.0, 0.8] }}, {{ name = "b", direction = [-0.5, 0.0, 0.8] }}]
"""
KINDS = {"png16": "", "png8": ", bits = 8", "tif": "", "exr": "", "dng": ', cfa = "RGGB"', "dpx": ", bits = 10"}
"""What virtual cameras write, and what else such a camera needs."""
PACKINGS: tuple[Compression, ...] = ("none", "rle", "zips", "piz")
CODECS = {"prores.mov": ("prores_ks", "yuv422p10le"), "h264.mp4": ("libx264", "yuv420p"), "ffv1.mkv": ("ffv1", "bgr0")}


def good_files(folder: Path) -> list[Path]:
    """Write the files into a folder and return them."""
    rng = np.random.default_rng(0)
    codes = rng.integers(0, 65535, (*SIZE, 3), dtype=np.uint16)
    for kind, camera in KINDS.items():
        _filmed(folder, kind, camera)
    tifffile.imwrite(folder / "plain.tif", codes, photometric="rgb")
    tifffile.imwrite(folder / "tiled.tif", codes, photometric="rgb", tile=(16, 16), compression="lzw", predictor=True)
    tifffile.imwrite(folder / "bottom.tif", codes[..., 0], byteorder=">", photometric="minisblack")
    cv2.imwrite(str(folder / "still.jpg"), (codes >> 8).astype(np.uint8))
    for packing in PACKINGS:
        planes = dict(zip("RGB", np.moveaxis(codes / np.float32(65535), -1, 0), strict=True))
        write_exr(folder / f"{packing}.exr", planes, compression=packing)
    for name, (codec, layout) in CODECS.items():
        _movie(folder / name, codec, layout, (codes >> 8).astype(np.uint8))
    write_rig(folder / "lights.lp", read_rig(folder / "rig.toml"))
    (folder / "timing.json").write_text(format_timing(_timing()), encoding="utf-8")
    return sorted(path for path in folder.iterdir() if path.is_file())


def _filmed(folder: Path, kind: str, camera: str) -> None:
    scene, clip = folder / "scene.toml", folder / "clip"
    scene.write_text(SCENE.format(kind=kind, camera=camera), encoding="utf-8")
    shoot(scene, clip)
    files = (path for path in sorted(clip.rglob("*")) if path.is_file() and not path.name.startswith("."))
    frame = next(path for path in files if path.suffix not in (".toml", ".json"))
    frame.rename(folder / f"{kind}{frame.suffix}")
    for name in ("plan.toml", "rig.toml"):
        (clip / name).rename(folder / name)
    shutil.rmtree(clip)
    scene.unlink()


def _timing() -> Timing:
    flashes = tuple(
        Flash(index=n, slot=n % 3, lights={"a": 1.0}, start_s=0.01 * n, duration_s=0.001, complete=True)
        for n in range(6)
    )
    return Timing(
        clip="clip",
        frame_period_s=0.01,
        exposure_s=0.01,
        row_time_s=1e-5,
        clock_offset_ppm=12.0,
        phase_error_rows=0.06,
        order="marker",
        flashes=flashes,
        dropped_frames=(DroppedFrames(after=116, count=2),),
    )


def _movie(path: Path, codec: str, layout: str, codes: NDArray[np.uint8]) -> None:
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(codec, rate=Fraction(100))
        stream.width, stream.height, stream.pix_fmt = SIZE[1], SIZE[0], layout
        for number in range(6):
            frame = av.VideoFrame.from_ndarray(np.roll(codes, number, axis=1), "rgb24").reformat(format=layout)
            frame.pts = number
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
