"""A movie's frames, decoded in codes, and what is said where one cannot be opened."""

import contextlib
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import av
from av.container import InputContainer
from av.stream import Disposition
from av.video.stream import VideoStream

from psvideo.clip.decode.movies.ffv1_slices import SliceChecks
from psvideo.clip.decode.movies.movie_codes import rgb_codes
from psvideo.clip.decode.movies.movie_ends import how_it_breaks_off
from psvideo.clip.decoded import CodedPicture
from psvideo.errors import PsvideoError
from psvideo.formats.paths import check_file

MOST_REORDERED = 16  # frames by which H.264 and H.265 may put decoding before showing
AS_RECORDED = {"ignore_editlist": "1"}  # times as the camera wrote them; movie_edits says which frames count


def read_movie(path: Path, timestamps: Sequence[int], numbers: Sequence[int] = ()) -> Iterator[CodedPicture]:
    """Decode the frames with these timestamps, in ascending order; ``numbers`` are what the clip calls them.

    Raises PsvideoError where one of them cannot be decoded or does not come.
    """
    wanted = deque(timestamps)
    with opened_movie(path) as (container, stream):
        tick_s, start = float(stream.time_base or 1), stream.start_time or 0
        unordered = container.format.name == "avi" and not stream.codec_context.codec.intra_only
        with contextlib.suppress(av.InvalidDataError):  # said below, of the frame that is waited for
            for frame, damaged in _frames_from(container, stream, wanted[0]):
                if frame.pts is None or frame.pts < wanted[0]:
                    continue
                if frame.pts > wanted[0] or damaged:
                    break
                yield rgb_codes(path, frame)
                wanted.popleft()
                if not wanted:
                    return
    where = f" {(wanted[0] - start) * tick_s:.3f} s from the start"
    raise PsvideoError(_lost(path, where, numbers, done=len(timestamps) - len(wanted), unordered=unordered))


def _frames_from(
    container: InputContainer, stream: VideoStream, timestamp: int
) -> Iterator[tuple[av.VideoFrame, bool]]:
    """Decode frames from a timestamp or before it on, and say of each whether it is damaged: painted over."""
    checks = SliceChecks() if stream.codec_context.codec.name == "ffv1" else None
    broken: set[int | None] = set()
    if timestamp > (stream.start_time or 0):
        if checks:  # the movie's first packet shows whether there are checksums
            checks.damaged(bytes(next(container.demux(stream))))
        with contextlib.suppress(av.PermissionError):  # the index names no whole frame before: from the first on
            container.seek(_safe_start(stream, timestamp), stream=stream)
    for packet in container.demux(stream):
        if checks and packet.size and checks.damaged(bytes(packet)):
            broken.add(packet.pts)
        yield from ((frame, frame.is_corrupt or frame.pts in broken) for frame in packet.decode())


def _lost(path: Path, where: str, numbers: Sequence[int], *, done: int, unordered: bool) -> str:
    """Say which frame cannot be decoded, ``done`` of those that were asked for lying before it, and what to do."""
    frame = f"frame {numbers[done]}," if numbers else "the frame"
    why = (
        ", or its frames are coded out of their order, which AVI does not say (repack it as .mkv)" if unordered else ""
    )
    kept = (
        f"go on with those before it, which are whole (`frames` {numbers[0]}-{numbers[done - 1]})"
        if numbers and done
        else "choose other frames with `frames`"
    )
    return (
        f"{path}: {frame}{where}, cannot be decoded; the movie is truncated or damaged there{why}. Copy it again, or "
        f"{kept}."
    )


def _safe_start(stream: VideoStream, timestamp: int) -> int:
    """Return where to seek for a frame. Files are searched by the order of decoding, which B-frames' own runs ahead."""
    if not stream.codec_context.has_b_frames or not stream.average_rate:
        return timestamp
    period = float(1 / (stream.average_rate * (stream.time_base or 1)))
    return max(timestamp - int(MOST_REORDERED * period), stream.start_time or 0)


@contextmanager
def opened_movie(path: Path) -> Iterator[tuple[InputContainer, VideoStream]]:
    """Open a movie and its first video stream."""
    check_file(path)
    try:
        with av.open(str(path), options=AS_RECORDED) as container:
            if not (moving := moving_streams(container)):
                broken = how_it_breaks_off(path) or "holds no video. Name the movie that the camera recorded."
                raise PsvideoError(f"{path}: {broken}")
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
        if broken := how_it_breaks_off(path):
            raise PsvideoError(f"{path}: {broken}") from fault
        raise PsvideoError(
            f"{path}: cannot be decoded; it is truncated, damaged or of a kind that is not read ({fault}). "
            "Copy it again from the camera's card."
        ) from fault


def moving_streams(container: InputContainer) -> list[VideoStream]:
    """Return the streams of moving pictures: a cover or a thumbnail is none."""
    return [stream for stream in container.streams.video if not stream.disposition & Disposition.attached_pic]


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
