"""Movies as cameras and editing programs write them, by PyAV: frames in any pixel format, at any times."""

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray

RATE = Fraction(120000, 1001)


def make_frame(planes: Iterable[NDArray[Any]], pix_fmt: str) -> av.VideoFrame:
    planes = list(planes)
    frame = av.VideoFrame(planes[0].shape[1], planes[0].shape[0], pix_fmt)
    target: Any
    for target, plane in zip(frame.planes, planes, strict=True):
        padded = np.zeros((target.height, target.line_size // plane.itemsize), plane.dtype)
        padded[: plane.shape[0], : plane.shape[1]] = plane
        target.update(padded)
    return frame


def write_movie(
    path: Path,
    frames: Iterable[av.VideoFrame],
    *,
    codec: str = "ffv1",
    places: Iterable[int] | None = None,
    matrix: int = 2,
    color_range: int = 0,
    transfer: int = 2,
    options: dict[str, str] | None = None,
    movflags: str = "",
    aspect: Fraction = Fraction(1),
) -> None:
    frames = list(frames)
    with av.open(str(path), "w", options={"movflags": movflags} if movflags else {}) as container:
        stream: Any = container.add_stream(codec, rate=RATE, options={"threads": "1"} | (options or {}))
        stream.width, stream.height, stream.pix_fmt = frames[0].width, frames[0].height, frames[0].format.name
        stream.codec_context.colorspace, stream.codec_context.color_range = matrix, color_range
        stream.codec_context.color_trc = transfer
        stream.codec_context.sample_aspect_ratio = aspect
        stream.codec_context.time_base = 1 / RATE
        for place, frame in zip(places or range(len(frames)), frames, strict=True):
            frame.pts, frame.time_base = place, 1 / RATE
            frame.colorspace, frame.color_range, frame.color_trc = matrix, color_range, transfer
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def grey_ramp(count: int, *, rows: int = 32, cols: int = 48) -> list[av.VideoFrame]:
    """Frames whose luma shows their place: code 40 + 8 * place in all pixels."""
    chroma = np.full((rows // 2, cols // 2), 128, np.uint8)
    return [
        make_frame([np.full((rows, cols), 40 + 8 * place, np.uint8), chroma, chroma], "yuv420p")
        for place in range(count)
    ]


def in_10_bits(frames: Iterable[av.VideoFrame]) -> list[av.VideoFrame]:
    return [frame.reformat(format="yuv422p10le") for frame in frames]


def write_rgb16(path: Path, frames: Iterable[NDArray[Any]], *, rate: int) -> None:
    """Write 16-bit frames, (row, col) or (row, col, channel) in OpenCV's order of blue, green and red, as FFV1."""
    colour = [frame if frame.ndim == 3 else np.repeat(frame[..., None], 3, axis=2) for frame in frames]
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream("ffv1", rate=rate, options={"threads": "1"})
        stream.width, stream.height, stream.pix_fmt = colour[0].shape[1], colour[0].shape[0], "gbrp16le"
        for frame in colour:
            shown = av.VideoFrame.from_ndarray(np.ascontiguousarray(frame[..., ::-1]), format="rgb48le")
            container.mux(stream.encode(shown.reformat(format="gbrp16le")))
        container.mux(stream.encode(None))
