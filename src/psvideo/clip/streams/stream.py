"""Frames of a stream as they come: pipes, network streams and video devices, by FFmpeg, in their own codes.

A stream's time stamps say when its frames were taken. Where a stamp goes back or leaps, the stream has begun again; its
frames are then placed after the earlier ones by the machine's clock.
"""

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import av

from psvideo.clip.decode.movies.movie_codes import rgb_codes
from psvideo.clip.decoded import CodedPicture
from psvideo.clip.filters import check_live_filters
from psvideo.clip.linear import in_codes, level_warning
from psvideo.clip.reading import looks
from psvideo.clip.record import Frame
from psvideo.clip.streams.stream_rate import StreamRate
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.camera import Camera
from psvideo.model.units import counted

STANDARD_INPUT = "-"
OPEN_S = 20.0
"""A stream that has not begun after this long is taken for missing."""
LEAP_S = 5.0
"""Stamps that leap by more are another stream's."""
CLOCKS_DIFFER = 1e-3
"""A sender's clock and this machine's differ by less, as shares of the time."""
MOST_DAMAGED = 24
"""A stream of which more frames in a row cannot be decoded is no stream of pictures."""
FEW_PX = 16
DEVICES = {"/dev/video": "v4l2"}


RAW = ("gray", "gray10le", "gray12le", "gray16le", "rgb24", "bgr24", "rgb48le", "gbrp", "yuv420p", "uyvy422", "nv12")
"""What cameras and recorders send as bare bytes, as FFmpeg calls it; other names of FFmpeg's are tried too."""
LIKELY = "yuv420p"
"""What streams usually hold that say it themselves."""


def is_device(source: str) -> bool:
    """Return whether a name is that of a video device, such as /dev/video0."""
    return source.startswith(tuple(DEVICES))


def stream_kind(raw: str | None) -> CodedPicture:
    """Return a few pixels as a stream codes them, black where that is 0: for bare bytes those that ``raw`` names, for
    others what is usual.

    Raises UsageError where FFmpeg has no such pixels, or they are not read here.
    """
    try:
        return rgb_codes(Path(raw or LIKELY), av.VideoFrame(FEW_PX, FEW_PX, raw or LIKELY))
    except (ValueError, av.FFmpegError, PsvideoError):
        bayer = " A mosaic is gray or gray16le, and the plan's cfa says its filters." if "bayer" in str(raw) else ""
        alike = get_close_matches(str(raw), RAW, 1)
        meant = f" Did you mean {alike[0]}?" if alike and not bayer else ""
        raise UsageError(
            f"`raw` {raw}: is not a pixel format that is read; expected {', '.join(RAW[:-1])} or {RAW[-1]}, or another "
            f"of FFmpeg's names for grey, RGB or YUV.{bayer}{meant}"
        ) from None


@dataclass(kw_only=True)
class StreamPlaces:
    """Turns time stamps in seconds into places in time; ``restarts`` counts streams that began again.

    A stream that begins again is placed by when its frame came, against when the quickest of those before came for
    their places: the last one before a pause is often handed out only after it.
    """

    rate_hz: float
    restarts: int = 0
    _zero_s: float = 0.0
    _stamp_s: float | None = None
    _place: int = -1
    _came_s: float = 0.0
    _zero_came_s: float = float("inf")

    def place(self, stamp_s: float | None, came_s: float) -> int:
        """Return a frame's place, later than that of the one before, from its stamp and when it came."""
        if stamp_s is None:
            self._place += 1
        elif self._stamp_s is None or not -1e-9 < stamp_s - self._stamp_s < LEAP_S:
            by_clock = 0 if self._stamp_s is None else round((came_s - self._zero_came_s) * self.rate_hz)
            self.restarts += self._stamp_s is not None
            self._place = max(by_clock, self._place + 1)
            self._zero_s = stamp_s - self._place / self.rate_hz
        else:
            self._place = max(round((stamp_s - self._zero_s) * self.rate_hz), self._place + 1)
        slack_s = CLOCKS_DIFFER * max(came_s - self._came_s, 0.0)
        self._zero_came_s = min(self._zero_came_s + slack_s, came_s - self._place / self.rate_hz)
        self._stamp_s, self._came_s = stamp_s, came_s
        return self._place


def read_stream(
    source: str, camera: Camera, *, raw: str | None = None, noted: Callable[[str], None] = lambda note: None
) -> Iterator[Frame]:
    """Give a stream's frames at their places in time: of a URL, a device, or standard input (``-``).

    ``raw`` is FFmpeg's name of the pixel format of frames that come as bare bytes, such as gray or gray16le. A stream
    that breaks off ends there, and frames that are damaged are left out; ``noted`` gets a sentence of either. Raises
    PsvideoError where nothing comes, or what comes is not the camera's.
    """
    name = "standard input" if source == STANDARD_INPUT else source
    stamps, rate = StreamPlaces(rate_hz=float(camera.fps)), StreamRate(planned_hz=float(camera.fps))
    first: CodedPicture | None = None
    for stamp_s, picture in _decoded(source, name, camera, raw, noted):
        _check(name, picture, camera, first)
        place = stamps.place(stamp_s, time.monotonic())
        if (other_hz := rate.other_hz(stamp_s)) is not None:
            raise PsvideoError(
                f"{name}: its time stamps are {other_hz:.4g} frames a second, and the plan says "
                f"{float(camera.fps):.6g}. Correct fps in the plan, or set the camera to it."
            )
        if first is None:
            first = picture
            for warning in level_warning(picture.header, camera.encoding):
                noted(f"{name}: {warning}.")
        yield Frame(index=place, number=place, coded=in_codes(picture, camera.encoding))
    if first is None:
        raise PsvideoError(f"{name}: ended before its first whole frame. Start what sends it, then psvideo live again.")


def _decoded(
    source: str, name: str, camera: Camera, raw: str | None, noted: Callable[[str], None]
) -> Iterator[tuple[float | None, CodedPicture]]:
    options = {"flags": "low_delay"}
    kind = next((kind for begin, kind in DEVICES.items() if source.startswith(begin)), None)
    if raw is not None:
        kind = "rawvideo"
        options = {
            "video_size": f"{camera.width_px}x{camera.height_px}",
            "pixel_format": raw,
            "framerate": str(camera.fps),
        }
    file = sys.stdin.buffer if source == STANDARD_INPUT else source
    came = False
    try:
        with av.open(file, mode="r", format=kind, options=options, timeout=(OPEN_S, None)) as container:
            if not container.streams.video:
                raise PsvideoError(f"{name}: holds no video; expected the camera's frames.")
            stream = container.streams.video[0]
            for frame in _whole_frames(container, stream, name, noted):
                came = True
                base_s = frame.time_base or stream.time_base
                stamp_s = None if frame.pts is None or base_s is None else float(frame.pts * base_s)
                yield stamp_s, rgb_codes(Path(name), frame)
    except (av.FFmpegError, OSError, UnicodeDecodeError) as fault:
        if not came:
            raise PsvideoError(f"{name}: cannot be read ({_why(fault)}). {_advice(source)}") from fault
        noted(f"{name}: broke off ({_why(fault)}). What came before that was used.")


def _whole_frames(
    container: "av.container.InputContainer", stream: "av.VideoStream", name: str, noted: Callable[[str], None]
) -> Iterator[av.VideoFrame]:
    """Give the frames that can be decoded; a sender that is killed leaves half of one, networks lose parts. FFmpeg
    paints over what is lost of a frame, and flags it."""
    damaged, in_a_row = 0, 0
    for packet in container.demux(stream):
        try:
            frames = packet.decode()
        except av.FFmpegError:
            damaged, in_a_row = damaged + 1, in_a_row + 1
            if in_a_row > MOST_DAMAGED:
                raise
            continue
        in_a_row = 0 if frames else in_a_row
        damaged += sum(frame.is_corrupt for frame in frames)
        yield from (frame for frame in frames if not frame.is_corrupt)
    if damaged:
        noted(
            f"{name}: {counted(damaged, 'frame')} came damaged or cut short, and {_were(damaged)} left out."
            f"{_cut_short(stream)}"
        )


def _cut_short(stream: "av.VideoStream") -> str:
    """Say of bare bytes how many make a frame: where a sender's frames have fewer, every later one is shifted."""
    if stream.codec_context.codec.name != "rawvideo" or stream.codec_context.pix_fmt is None:
        return ""
    size, pixels = f"{stream.width} x {stream.height}", stream.codec_context.pix_fmt
    return (
        f" By the plan and `raw`, {size} pixels of {pixels} make a frame; where the sender's frames are shorter or "
        "longer, pictures roll and no strobe is found: check both."
    )


def _why(fault: Exception) -> str:
    """Return what the system says of a fault, without its number and the name that it knows the source by."""
    return str(getattr(fault, "strerror", None) or fault)


def _were(count: int) -> str:
    return "was" if count == 1 else "were"


def _advice(source: str) -> str:
    """Return what to do where nothing can be read."""
    if is_device(source):
        return "Check the camera's cable and the device's name, and that no other program uses it."
    return (
        "Expected y4m or another stream that FFmpeg knows; say with `raw` which pixels bare bytes hold, such as gray "
        "or gray16le, and check that the sender runs."
    )


def _check(name: str, picture: CodedPicture, camera: Camera, first: CodedPicture | None) -> None:
    """Refuse frames of another size than planned, or of another kind than the first."""
    head = picture.header
    if (head.width_px, head.height_px) != (camera.width_px, camera.height_px):
        raise PsvideoError(
            f"{name}: sends {head.width_px} x {head.height_px} pixels, and the plan says {camera.width_px} x "
            f"{camera.height_px}. Set the camera to the plan's size, or use the plan of this mode."
        )
    check_live_filters(name, head, camera.encoding.cfa)
    if first is not None and looks(head) != looks(first.header):
        raise PsvideoError(
            f"{name}: sends {looks(head)} all of a sudden, and began with {looks(first.header)}. Somebody changed the "
            "camera's mode: start psvideo live again."
        )
