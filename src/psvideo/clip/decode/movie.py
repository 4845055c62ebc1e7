"""Movies: every frame at full depth, its place in time taken from the file's timestamps.

Colours are converted by ``yuv`` with the matrix and range that the file is tagged with.
"""

import contextlib
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import av
import numpy as np
from av.container import InputContainer
from av.stream import Disposition
from av.video.stream import VideoStream

from psvideo.clip.decode.ffmpeg_planes import planes
from psvideo.clip.decode.movie_edits import edits_of
from psvideo.clip.decode.movie_tags import (
    capture_rate_hz,
    compression_warning,
    gamut_of,
    shot_by,
    side_data_of,
    transfer_of,
    turn_of,
)
from psvideo.clip.decode.movie_times import UNEVEN, Places, frame_places, promised_frames, stamps_of
from psvideo.clip.decode.yuv import CODES, HIGHEST, LOWEST, LUMA_WEIGHTS, signal_range, to_rgb
from psvideo.clip.record import CodedPicture, Header
from psvideo.errors import PsvideoError
from psvideo.formats.paths import check_file
from psvideo.model.units import counted

VIDEO_RANGE, FULL_RANGE = 1, 2  # FFmpeg's AVCOL_RANGE_MPEG and AVCOL_RANGE_JPEG
UNTAGGED = 2  # matrix coefficients "unspecified" (H.273)
HD_HEIGHT_PX = 720
MOST_REORDERED = 16  # frames by which H.264 and H.265 may put decoding before showing
AS_RECORDED = {"ignore_editlist": "1"}  # times as the camera wrote them; movie_edits says which frames count


@dataclass(frozen=True, kw_only=True)
class Movie:
    """A movie's first frame's header and, in the order of time, every frame's timestamp and place.

    ``places`` count frames from the first; a gap of whole frames between timestamps leaves places out. Where the rate
    varies there are ``per_frame`` places from one frame to the usual next one, and ``rates_hz`` are the lowest and the
    highest rate. ``rate_hz`` is the rate at which the file usually plays, None where a single frame shows none; rounded
    timestamps leave it unsure by the share ``rate_error``. ``capture_rate_hz`` is the rate at which it was shot, where
    the file says so.
    """

    header: Header
    timestamps: tuple[int, ...]
    places: tuple[int, ...]
    rate_hz: float | None
    rate_error: float = 0.0
    capture_rate_hz: float | None = None
    per_frame: int = 1
    rates_hz: tuple[float, float] | None = None

    @property
    def place_rate_hz(self) -> float | None:
        """How many places there are a second."""
        return None if self.rate_hz is None else self.rate_hz * self.per_frame


def index_movie(path: Path) -> Movie:
    """Read a movie's header, first frame and timestamps. Raises PsvideoError where it is damaged or truncated."""
    with _opened(path) as (container, stream):
        stamps = stamps_of(container, stream)
        shown = _shown(path, container, stream, stamps.timestamps)
        found = frame_places(path, shown)
        promised = promised_frames(container, stream, found.period * found.per_frame)
        time_base_s = float(stream.time_base or 1)
        code = container.metadata.get("timecode") or stream.metadata.get("timecode")
        capture_rate = capture_rate_hz(container.metadata | stream.metadata)
        shot = shot_by(container.metadata | stream.metadata)
        codec = stream.codec_context.codec.canonical_name
        others = len(_moving(container)) - 1
    held, timestamps = len(stamps.timestamps), found.timestamps
    hidden = held - len(shown)
    if not held:
        raise PsvideoError(f"{path}: holds no frame that can be found; it is truncated or damaged. Copy it again.")
    if held < promised and found.places[-1] + 1 + found.left_out + hidden < promised:
        raise PsvideoError(
            f"{path}: holds {held} frames, and its header promises {promised}: it is truncated. Copy it again."
        )
    header = next(read_movie(path, timestamps[:1])).header
    coding = compression_warning(codec, header.bits or 0, frames=held, whole_frames=stamps.whole_frames)
    uneven = _left_out(found) if found.left_out else None
    cut = _cut(hidden, held) if hidden else None
    several = SEVERAL.format(counted(others + 1, "video stream")) if others else None
    warnings = tuple(warning for warning in (coding, cut, several, uneven, _strays(found)) if warning)
    return Movie(
        header=replace(header, time_code=code, shot=shot, warnings=header.warnings + warnings),
        timestamps=timestamps,
        places=found.places,
        rate_hz=1 / (found.period * found.per_frame * time_base_s) if found.period else None,
        rate_error=1 / (timestamps[-1] - timestamps[0]) if found.period else 0.0,
        capture_rate_hz=capture_rate,
        per_frame=found.per_frame,
        rates_hz=_rates_hz(found, time_base_s) if found.per_frame > 1 else None,
    )


def _shown(path: Path, container: InputContainer, stream: VideoStream, timestamps: tuple[int, ...]) -> tuple[int, ...]:
    """Return the timestamps of those frames that the movie's edit list shows."""
    edits = edits_of(path, stream.id) if "mov" in container.format.name else None
    shown = timestamps if edits is None else edits.shown(timestamps)
    if timestamps and not shown:
        raise PsvideoError(
            f"{path}: its edit list shows none of its {counted(len(timestamps), 'frame')}. Undo the cuts, or name the "
            "movie that the camera recorded."
        )
    return shown


def _cut(hidden: int, held: int) -> str:
    return (
        f"the movie was cut: its edit list hides {hidden} of the {counted(held, 'frame')} that the file holds. They "
        "are left out; undo the cuts to use them"
    )


def _rates_hz(found: Places, time_base_s: float) -> tuple[float, float]:
    steps_s = np.diff(found.places) * found.period * time_base_s
    return float(1 / steps_s.max()), float(1 / steps_s.min())


def _left_out(found: Places) -> str:
    return (
        f"the frames do not come at an even rate throughout: {found.left_out} of them before place {found.places[0]} "
        f"or after place {found.places[-1]} are left out. Record at a constant frame rate"
    )


def _strays(found: Places) -> str | None:
    """Say where timestamps wander: each step is about a frame, and together they do not keep time."""
    if found.strays <= UNEVEN:
        return None
    return (
        f"the frames' times stray by up to {found.strays:.2g} frames from an even rate, which is taken all the same: "
        "the flashes show whether it was. Record at a constant frame rate"
    )


def read_movie(path: Path, timestamps: Sequence[int]) -> Iterator[CodedPicture]:
    """Decode the frames with these timestamps, in ascending order.

    Raises PsvideoError where one of them cannot be decoded or does not come.
    """
    wanted, unordered = deque(timestamps), ""
    with _opened(path) as (container, stream):
        if container.format.name == "avi" and not stream.codec_context.codec.intra_only:
            unordered = ", or its frames are coded out of their order, which AVI does not say (repack it as .mkv)"
        if wanted[0] > (stream.start_time or 0):
            with contextlib.suppress(av.PermissionError):  # the index names no whole frame before: from the first on
                container.seek(_safe_start(stream, wanted[0]), stream=stream)
        for frame in container.decode(stream):
            if frame.pts is None or frame.pts < wanted[0]:
                continue
            if frame.pts > wanted[0] or frame.is_corrupt:  # a damaged frame is painted over, and flagged
                break
            yield rgb_codes(path, frame)
            wanted.popleft()
            if not wanted:
                return
    raise PsvideoError(
        f"{path}: the frame with timestamp {wanted[0]} cannot be decoded; the movie is truncated or damaged "
        f"there{unordered}. Copy it again, or choose other frames with `frames`."
    )


def _safe_start(stream: VideoStream, timestamp: int) -> int:
    """Return where to seek for a frame. Files are searched by the order of decoding, which B-frames' own runs ahead."""
    if not stream.codec_context.has_b_frames or not stream.average_rate:
        return timestamp
    period = float(1 / (stream.average_rate * (stream.time_base or 1)))
    return max(timestamp - int(MOST_REORDERED * period), stream.start_time or 0)


@contextmanager
def _opened(path: Path) -> Iterator[tuple[InputContainer, VideoStream]]:
    """Open a movie and its first video stream."""
    check_file(path)
    try:
        with av.open(str(path), options=AS_RECORDED) as container:
            if not (moving := _moving(container)):
                raise PsvideoError(f"{path}: holds no video. Name the movie that the camera recorded.")
            stream = moving[0]
            if stream.codec_context is None:
                raise PsvideoError(f"{path}: {_sealed(path) or 'is coded in a way that is not read'}. {IN_THE_CLEAR}")
            stream.thread_type = "AUTO"
            yield container, stream
    except (av.FFmpegError, UnicodeDecodeError) as fault:
        if path.is_file() and not path.stat().st_size:
            raise PsvideoError(f"{path}: is empty (0 bytes). Copy it again from the camera's card.") from None
        if sealed := _sealed(path):
            raise PsvideoError(f"{path}: {sealed}. {IN_THE_CLEAR}") from fault
        raise PsvideoError(
            f"{path}: cannot be decoded; it is truncated, damaged or of a kind that is not read ({fault}). "
            "Copy it again from the camera's card."
        ) from fault


def _moving(container: InputContainer) -> list[VideoStream]:
    """Return the streams of moving pictures: a cover or a thumbnail is none."""
    return [stream for stream in container.streams.video if not stream.disposition & Disposition.attached_pic]


SEVERAL = "the movie holds {}; the first one counts. Where another is meant, export it by itself"
IN_THE_CLEAR = "Expected a movie as the camera recorded it: ProRes, DNxHR, H.264 or H.265, without protection."
ENCRYPTED = b"encv"
"""The sample entry of encrypted video (ISO/IEC 14496-12, 8.12)."""
LOOKED_AT = 1 << 22
"""So many bytes at both ends of a file: there lies its description."""


def _sealed(path: Path) -> str:
    """Say that a movie is encrypted; empty where it is not, or cannot be read."""
    with contextlib.suppress(OSError), path.open("rb") as file:
        found = file.read(LOOKED_AT)
        file.seek(max(path.stat().st_size - LOOKED_AT, 0))
        return "is encrypted" if ENCRYPTED in found + file.read(LOOKED_AT) else ""
    return ""


def rgb_codes(path: Path, frame: av.VideoFrame) -> CodedPicture:
    """Take a decoded frame's planes and make R'G'B' codes of them."""
    if frame.interlaced_frame:
        raise PsvideoError(f"{path}: is interlaced; expected whole frames. Record progressive footage.")
    found = planes(path, frame)
    bits = frame.format.components[0].bits
    is_yuv = frame.format.name.startswith("yuv") or (not frame.format.is_rgb and len(found) > 1)
    full_by_name = frame.format.name.startswith("yuvj") or not is_yuv
    video_range = frame.color_range == VIDEO_RANGE or (frame.color_range != FULL_RANGE and not full_by_name)
    zero, one = signal_range(bits, video_range=video_range)
    turn, askew = turn_of(frame)
    alpha = "the movie's alpha channel is left out" if len(found) in (2, 4) else None
    header = Header(
        width_px=frame.width,
        height_px=frame.height,
        channels=3 if len(found) > 2 else 1,
        bits=bits,
        signal_at_0=-zero / (one - zero),
        signal_per_code=1 / (one - zero),
        video_range=video_range,
        turn=turn,
        transfer=transfer_of(frame),
        colour=gamut_of(frame),
        warnings=tuple(warning for warning in (alpha, askew) if warning),
    )
    if not is_yuv:
        return CodedPicture(header=header, codes=found[0].copy() if len(found) < 3 else np.stack(found[:3], axis=-1))
    matrix, warnings = _matrix(path, frame)
    codes = to_rgb(found[0], found[1], found[2], bits=bits, matrix=matrix, video_range=video_range)
    span = (HIGHEST - LOWEST) / CODES
    header = replace(header, signal_at_0=LOWEST, signal_per_code=span, warnings=header.warnings + warnings)
    return CodedPicture(header=header, codes=codes)


def _matrix(path: Path, frame: av.VideoFrame) -> tuple[int, tuple[str, ...]]:
    """Return the matrix coefficients that the frame is tagged with, or what its height makes likely, with a note."""
    tagged = UNTAGGED if frame.colorspace is None else int(frame.colorspace)
    if tagged in LUMA_WEIGHTS:
        return tagged, ()
    if tagged == UNTAGGED and side_data_of(frame).get("DOVI_METADATA") is not None:
        raise PsvideoError(
            f"{path}: is Dolby Vision whose picture stands for light only together with its metadata (profile 5), "
            "which is not read; expected HLG, PQ or SDR. Record or export one of these."
        )
    if tagged != UNTAGGED:
        names = ", ".join(sorted({name for name, *_ in LUMA_WEIGHTS.values()}))
        raise PsvideoError(
            f"{path}: its colours are coded with matrix {tagged} (ITU-T H.273), which is not read; expected {names} or "
            "RGB. Export the movie with one of these."
        )
    likely = 1 if frame.height >= HD_HEIGHT_PX else 6
    return likely, (
        "the movie does not say which matrix its colours are coded with; taken for "
        f"{LUMA_WEIGHTS[likely][0]}, as is usual at {frame.height} rows",
    )
