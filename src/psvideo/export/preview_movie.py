"""Movies for eyes: 8-bit pictures coded so that players show them as they are.

VP9 (libvpx, BSD) plays in browsers and most players; ProRes (FFmpeg's own encoder, LGPL) in editing programs. Neither
needs an encoder under the GPL. Pictures are sRGB; the stream says so: primaries and matrix of BT.709, transfer sRGB,
video range (ITU-T H.273). Encoders run with a fixed number of threads, so that the same pictures give the same bytes.
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

from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import whole_file
from psvideo.model.arrays import Pixels
from psvideo.model.choices import Codec

MOST_RATE = 1_000_000
CONTAINING = {"movflags": "+faststart", "use_editlist": "0"}
"""The description comes before the pictures, so that browsers begin at once."""
ENCODING_THREADS = 2
"""Fixed, because what libvpx writes depends on it."""


@dataclass(frozen=True, kw_only=True)
class _Coding:
    encoder: str
    container: str
    pixels: str
    options: dict[str, str]


CODINGS: dict[Codec, _Coding] = {
    "vp9": _Coding(
        encoder="libvpx-vp9",
        container="mp4",
        pixels="yuv420p",
        options={"crf": "20", "b": "0", "deadline": "realtime", "cpu-used": "8", "row-mt": "1"},
    ),
    # a sixth of the other encoder's time, for a third more bytes; profile 2 is standard
    "prores": _Coding(encoder="prores_aw", container="mov", pixels="yuv422p10le", options={"profile": "2"}),
}


def write_movie(path: Path, pictures: Iterable[Pixels], *, fps: Fraction, codec: Codec = "vp9") -> None:
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
    stream.codec_context.thread_count = ENCODING_THREADS
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
        threads=1,  # FFmpeg writes some rows a few pixels too long, over what another thread has written of the next
    )
    coded.color_primaries, coded.color_trc = ColorPrimaries.BT709, ColorTrc.IEC61966_2_1
    coded.colorspace, coded.color_range = Colorspace.ITU709, ColorRange.MPEG
    return coded


def even(picture: Pixels) -> Pixels:
    """Return a picture with an even count of rows and columns: the last one is repeated where it has to be."""
    rows, cols = picture.shape[:2]
    return np.pad(picture, ((0, rows % 2), (0, cols % 2), (0, 0)), mode="edge")
