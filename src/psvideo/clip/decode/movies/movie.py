"""Movies: every frame at full depth, its place in time taken from the file's timestamps.

``movie_codes`` makes codes of each decoded frame.
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

from psvideo.clip.decode.movies.movie_codes import rgb_codes
from psvideo.clip.decode.movies.movie_edits import edits_of
from psvideo.clip.decode.movies.movie_tags import (
    capture_rate_hz,
    compression_warning,
    gamut_of,
    shot_by,
    transfer_of,
)
from psvideo.clip.decode.movies.movie_times import UNEVEN, Places, frame_places, promised_frames, stamps_of
from psvideo.clip.record import CodedPicture, Header
from psvideo.errors import PsvideoError
from psvideo.formats.paths import check_file
from psvideo.model.units import counted

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
        transfer, colour = transfer_of(stream.codec_context), gamut_of(stream.codec_context)
        stamps = stamps_of(container, stream)
        shown = _shown(path, container, stream, stamps.timestamps)
        found = frame_places(path, shown)
        promised = promised_frames(container, stream, found.period * found.per_frame)
        time_base_s = float(stream.time_base or 1)
        code = container.metadata.get("timecode") or stream.metadata.get("timecode")
        capture_rate = capture_rate_hz(container.metadata | stream.metadata)
        shot = shot_by(container.metadata | stream.metadata)
        codec = stream.codec_context.codec
        odd = _pixels_not_square(stream)
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
    exact = codec.lossless and not codec.lossy  # changes of other frames cost nothing then
    whole = held if exact else stamps.whole_frames
    coding = compression_warning(codec.canonical_name, header.bits or 0, frames=held, whole_frames=whole)
    uneven = _left_out(found) if found.left_out else None
    cut = _cut(hidden, held) if hidden else None
    several = SEVERAL.format(counted(others + 1, "video stream")) if others else None
    warnings = tuple(warning for warning in (coding, cut, several, odd, uneven, _strays(found)) if warning)
    return Movie(
        header=replace(
            header,
            time_code=code,
            shot=shot,
            transfer=header.transfer or transfer,  # frames may say less than the container
            colour=header.colour or colour,
            warnings=header.warnings + warnings,
        ),
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


def _pixels_not_square(stream: VideoStream) -> str | None:
    """Say where pixels are shown wider than high, or the reverse: as of an anamorphic lens, or a squeezed format."""
    aspect = stream.sample_aspect_ratio
    if not aspect or aspect == 1:
        return None
    return (
        f"its pixels are not square, but {float(aspect):.4g} times as wide as high. Results keep the movie's pixels: "
        "show them as you show the movie. Normals stay right; depth and meshes need square pixels"
    )


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
"""This many bytes at both ends of a file: there lies its description."""


def _sealed(path: Path) -> str:
    """Say that a movie is encrypted; empty where it is not, or cannot be read."""
    with contextlib.suppress(OSError), path.open("rb") as file:
        found = file.read(LOOKED_AT)
        file.seek(max(path.stat().st_size - LOOKED_AT, 0))
        return "is encrypted" if ENCRYPTED in found + file.read(LOOKED_AT) else ""
    return ""
