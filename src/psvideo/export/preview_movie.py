"""Movies for eyes: 8-bit pictures coded so that players show them as they are.

H.264 plays in browsers, players and editing programs; VP9 in browsers and most players; ProRes in editing programs.
Pictures are sRGB; the stream says so: primaries and matrix of BT.709, transfer sRGB, video range (ITU-T H.273).
Encoders run with a fixed number of threads, so that the same pictures give the same bytes.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc
from av.video.stream import VideoStream
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import whole_file
from psvideo.model.choices import Codec

Pixels = NDArray[np.uint8]
MOST_RATE = 1_000_000
CONTAINING = {"movflags": "+faststart", "use_editlist": "0"}
"""The description comes before the pictures, so that browsers begin at once."""
KEY_EVERY = 12
"""Pictures from one that is coded by itself to the next: editing programs and sliders jump there."""


@dataclass(frozen=True, kw_only=True)
class _Coding:
    encoder: str
    container: str
    pixels: str
    options: dict[str, str]
    threads: int = 2


CODINGS: dict[Codec, _Coding] = {
    "h264": _Coding(
        encoder="libx264",
        container="mp4",
        pixels="yuv420p",
        # no B-frames: they would shift the first time stamp, which asks for an edit list that some programs ignore;
        # no assembly code: it decides by memory that nobody set, so that bytes may differ from run to run
        options={"crf": "18", "preset": "superfast", "bf": "0", "g": str(KEY_EVERY), "x264-params": "asm=0"},
        threads=1,
    ),
    "vp9": _Coding(
        encoder="libvpx-vp9",
        container="mp4",
        pixels="yuv420p",
        options={"crf": "20", "b": "0", "deadline": "realtime", "cpu-used": "7", "row-mt": "1"},
    ),
    "prores": _Coding(encoder="prores_ks", container="mov", pixels="yuv422p10le", options={"profile": "standard"}),
}


def codec_at_hand(codec: Codec) -> Codec:
    """Return a codec, or VP9 where it is H.264 and this FFmpeg was built without an encoder for it."""
    return codec if codec != "h264" or CODINGS[codec].encoder in av.codecs_available else "vp9"


def write_movie(path: Path, pictures: Iterable[Pixels], *, fps: Fraction, codec: Codec = "h264") -> None:
    """Write sRGB pictures (row, col, 3), all of one even size, as a movie, whole or not at all; one is held at a time.

    Raises PsvideoError where the movie cannot be written.
    """
    coding = CODINGS[codec]
    with whole_file(path) as beside:
        try:
            with av.open(str(beside), "w", format=coding.container, options=CONTAINING) as container:
                stream: VideoStream | None = None
                for picture in pictures:
                    stream = stream or _stream(container, coding, picture, fps)
                    container.mux(stream.encode(_frame(picture, coding)))
                if stream is None:
                    raise PsvideoError(f"{path}: there is no picture to make a movie of.")
                container.mux(stream.encode(None))
        except av.FFmpegError as fault:
            raise PsvideoError(f"{path}: the movie cannot be written ({fault}). Make room, then run again.") from fault


def _stream(container: av.container.OutputContainer, coding: _Coding, picture: Pixels, fps: Fraction) -> VideoStream:
    rate = fps.limit_denominator(MOST_RATE)
    stream = cast(VideoStream, container.add_stream(coding.encoder, rate=rate, options=coding.options))
    stream.thread_type = "AUTO"
    stream.codec_context.thread_count = coding.threads
    stream.height, stream.width = picture.shape[:2]
    stream.pix_fmt = coding.pixels
    context = stream.codec_context
    context.color_primaries, context.color_trc = ColorPrimaries.BT709, ColorTrc.IEC61966_2_1
    context.colorspace, context.color_range = Colorspace.ITU709, ColorRange.MPEG
    return stream


def _frame(picture: Pixels, coding: _Coding) -> av.VideoFrame:
    frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
    coded = frame.reformat(
        format=coding.pixels,
        src_color_range=ColorRange.JPEG,
        dst_color_range=ColorRange.MPEG,
        dst_colorspace=Colorspace.ITU709,
    )
    coded.color_primaries, coded.color_trc = ColorPrimaries.BT709, ColorTrc.IEC61966_2_1
    coded.colorspace, coded.color_range = Colorspace.ITU709, ColorRange.MPEG
    return coded


def even(picture: Pixels) -> Pixels:
    """Return a picture with an even count of rows and columns: the last one is repeated where it has to be."""
    rows, cols = picture.shape[:2]
    return np.pad(picture, ((0, rows % 2), (0, cols % 2), (0, 0)), mode="edge")
