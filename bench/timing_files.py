"""Frames written as cameras write them, and read back as psvideo reads a clip."""

from pathlib import Path
from typing import Any

import av
import numpy as np

from psvideo.clip import Frame, open_clip, read_frames
from psvideo.formats.plan_toml import format_plan
from psvideo.model.plan import Plan
from psvideo.synth.camera.curves import CURVES
from psvideo.synth.camera.dpx_writer import dpx_bytes
from psvideo.synth.camera.encode import Codes
from psvideo.synth.camera.frames import write_frame
from psvideo.synth.scene_tables import CameraTable

QUALITY = 18
"""Constant rate factor of H.264: about what a camera's best setting gives."""
BLACK_12_BIT = 256


def as_h264(folder: Path, plan: Plan, frames: np.ndarray) -> list[Frame]:
    """An 8-bit sRGB movie, 4:2:0 in video range."""
    write_h264(folder / "clip.mp4", plan, frames)
    return read_back(folder / "clip.mp4", plan)


def write_h264(path: Path, plan: Plan, frames: np.ndarray, *, crf: int = QUALITY, preset: str = "medium") -> None:
    """Write grey frames (frame, row, col) in linear light as 8-bit sRGB, 4:2:0, BT.709, video range.

    By one thread the same frames give the same bytes; by more they do not under load. x264's assembly code decides on
    frames by memory that nobody set, and is left out.
    """
    signal = CURVES["srgb"].encode(np.clip(frames, 0, 1))
    luma = np.round(16 + 219 * signal).astype(np.uint8)
    rows, cols = luma.shape[1:]
    options = {"crf": str(crf), "preset": preset, "threads": "1", "x264-params": "asm=0"}
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("libx264", rate=plan.camera.fps, options=options)
        stream.width, stream.height, stream.pix_fmt = cols, rows, "yuv420p"
        stream.codec_context.colorspace, stream.codec_context.color_range = 1, 1  # BT.709, video range
        stream.codec_context.time_base = 1 / plan.camera.fps
        for number, picture in enumerate(luma):
            frame = av.VideoFrame.from_ndarray(
                np.concatenate([picture, np.full((rows // 2, cols), 128, np.uint8)]), "yuv420p"
            )
            frame.pts, frame.time_base, frame.colorspace, frame.color_range = number, 1 / plan.camera.fps, 1, 1
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def as_slog3(folder: Path, plan: Plan, frames: np.ndarray) -> list[Frame]:
    """10-bit S-Log3 in DPX."""
    codes = Codes(curve=CURVES["slog3"], bits=10, black=95, white=1023, top=1023)
    for number, picture in enumerate(frames):
        coded = np.repeat(codes.from_light(picture)[..., None], 3, axis=2)
        (folder / f"frame.{number:05d}.dpx").write_bytes(dpx_bytes(coded, 10))
    return read_back(folder, plan)


def as_bayer(folder: Path, plan: Plan, frames: np.ndarray) -> list[Frame]:
    """12-bit CinemaDNG with colour filters RGGB."""
    codes = Codes(curve=CURVES["linear"], bits=12, black=BLACK_12_BIT, white=4095, top=4095)
    rows, cols = frames.shape[1:]
    camera = CameraTable(
        width_px=cols, height_px=rows, fps=str(plan.camera.fps), shutter_deg=360, readout_s=0.0, cfa="RGGB"
    )
    for number, picture in enumerate(frames):
        write_frame(
            folder / f"frame.{number:05d}.dng", codes.from_light(picture), kind="dng", camera=camera, scale=codes
        )
    return read_back(folder, plan)


def read_back(path: Path, plan: Plan) -> list[Frame]:
    """Write a clip's plan beside it and return its frames as psvideo reads them."""
    folder = path if path.is_dir() else path.parent
    (folder / "plan.toml").write_text(format_plan(plan), encoding="utf-8")
    return list(read_frames(open_clip(path)))
