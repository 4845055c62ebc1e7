"""When a movie's frames were taken: their timestamps, and the place of each, counted in frames.

A camera that keeps its rate leaves even steps, and whole steps out where it dropped frames. One that changes between
rates (30 and 24 a second, as phones do in dim light) leaves steps that are whole multiples of a shorter one (1/120 s):
places count those. Where there is no such step, places can be counted only within an even run.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

import av
import numpy as np
from av.container import InputContainer
from av.video.stream import VideoStream

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles

UNEVEN = 0.25
LEAST_EVEN_SHARE = 0.5
"""The longest even run is used where it is at least this share of the movie."""
MOST_STEPS = 8
"""The usual step between frames is divided into at most this many parts: 24, 25, 30 and 60 a second are whole multiples
of 1/8 of one another or less."""
EXACT = 0.02
"""A step is a whole multiple within this share of the usual one, or the timestamps' own unit."""
UNSURE = 3.0
"""Standard errors by which timestamps that jitter leave a rate unsure."""
LEAST_HELD_SHARE = 0.8
"""A rate is held for a while: this many of the steps that are no whole frames are as long as the one before or after.
Timestamps that jitter, or stumble once, are not."""


@dataclass(frozen=True, kw_only=True)
class Places:
    """The timestamps of an even run of frames, each one's place in time, and the period in the timestamps' unit.

    ``first`` is how many frames come before the run, ``left_out`` how many are not of it; places count from ``first``.
    The period is 0 where a single frame shows none. Where the rate varies it is the ``per_frame``-th part of the usual
    step between frames, and places count such parts. ``strays`` is by how many frames timestamps are off, at most, and
    ``rate_error`` the share by which they leave the rate unsure.
    """

    timestamps: tuple[int, ...]
    places: tuple[int, ...]
    period: float
    first: int = 0
    left_out: int = 0
    per_frame: int = 1
    strays: float = 0.0
    rate_error: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Stamps:
    """Every frame's timestamp in the order of time, and how many of them can be decoded by themselves."""

    timestamps: tuple[int, ...]
    whole_frames: int


def stamps_of(container: InputContainer, stream: VideoStream) -> Stamps:
    """Return what the file says of its frames' times, from its index where that holds all of them."""
    index = stream.index_entries
    if len(index) == stream.frames > 0 and not stream.codec_context.has_b_frames:
        entries = [(entry.timestamp, entry.is_keyframe) for entry in index]
    else:
        packets = (packet for packet in container.demux(stream) if packet.size and not packet.is_discard)
        entries = [(p.pts, p.is_keyframe) for p in packets if p.pts is not None and not p.is_corrupt]
    return Stamps(
        timestamps=tuple(sorted(stamp for stamp, _ in entries)), whole_frames=sum(bool(key) for _, key in entries)
    )


def promised_frames(container: InputContainer, stream: VideoStream, period: float) -> int:
    """Return how many frames the header promises: their number, else as many as fill the length of the video.

    The container's own length counts only where it holds nothing else: sound may go on after the last frame.
    """
    if stream.frames or not period:
        return stream.frames
    length_s = _length_s(container, stream)
    return int(length_s / (period * float(stream.time_base or 1)) - 0.5)


def _length_s(container: InputContainer, stream: VideoStream) -> float:
    if stream.duration:
        return float(stream.duration * (stream.time_base or 1))
    begins_s = float((stream.start_time or 0) * (stream.time_base or 1))
    try:
        found = datetime.strptime(stream.metadata.get("DURATION", "")[:15], "%H:%M:%S.%f")
        ends_s = found.hour * 3600 + found.minute * 60 + found.second + found.microsecond * 1e-6
    except ValueError:  # Matroska alone writes it, as when the stream ends
        ends_s = (container.duration or 0) / av.time_base if len(container.streams) == 1 else 0.0
    return ends_s - begins_s


def frame_places(path: Path, timestamps: Sequence[int]) -> Places:
    """Return each frame's place in time, of the longest even run where the rate changes on the way.

    Raises PsvideoError where no run is long enough for that.
    """
    steps = np.diff(np.array(timestamps, np.float64))
    if not steps.size:
        return Places(timestamps=tuple(timestamps), places=(0,), period=0.0)
    usual = float(np.median(steps))
    like = steps[np.abs(steps - usual) < 0.5 * usual]
    period = float(like.mean()) if like.size else usual
    counts = np.rint(steps / period) if period > 0 else np.zeros_like(steps)
    uneven = (np.abs(steps - counts * period) > max(UNEVEN * period, 1.0)) | (counts < 1)
    if varying := _of_several_rates(timestamps, steps, usual):
        return varying
    first, last = _longest_run(uneven)
    if last - first < LEAST_EVEN_SHARE * steps.size or last == first:
        raise PsvideoError(
            f"{path}: its frames do not come at an even rate ({int(uneven.sum())} of {steps.size} steps between "
            "timestamps are no whole number of frames), so their times are not known. Record at a constant frame rate."
        )
    places = np.concatenate([[0], np.cumsum(counts[first:last])])
    even = _even_rate(np.array(timestamps[first : last + 1], np.float64), places)
    return Places(
        timestamps=tuple(timestamps[first : last + 1]),
        places=tuple(int(place) for place in first + places),
        period=even.period,
        first=first,
        left_out=len(timestamps) - (last + 1 - first),
        strays=even.strays,
        rate_error=even.rate_error,
    )


class _EvenRate(NamedTuple):
    """The ``period`` in the timestamps' unit, and the rest as in ``Places``."""

    period: float
    strays: float
    rate_error: float


def _even_rate(timestamps: Doubles, places: Doubles) -> _EvenRate:
    """Return the even rate that timestamps keep: by the first and the last where they are only rounded, else by all."""
    span = float(timestamps[-1] - timestamps[0])
    period = span / float(places[-1])
    if len(places) < 3:
        return _EvenRate(period, 0.0, 1 / span)
    fitted, begin = np.polyfit(places, timestamps, 1)
    off = timestamps - begin - fitted * places
    most = float(np.abs(off).max())
    if most <= 1.0:
        return _EvenRate(period, most / period, 1 / span)
    error = np.sqrt((off**2).sum() / (len(off) - 2) / ((places - places.mean()) ** 2).sum())
    return _EvenRate(float(fitted), most / float(fitted), max(1 / span, UNSURE * float(error) / float(fitted)))


def _of_several_rates(
    timestamps: Sequence[int], steps: np.ndarray[tuple[int], np.dtype[np.float64]], usual: float
) -> Places | None:
    """Return the places of frames that keep one rate, then another; None where they keep one, jittering or with whole
    frames left out, or where their steps have no common part."""
    whole = np.rint(steps / usual) if usual > 0 else np.zeros_like(steps)
    mean = float(steps.sum() / max(whole.sum(), 1.0))
    if usual <= 0 or np.abs(np.cumsum(steps - whole * mean)).max() <= UNEVEN * usual:
        return None
    alike = np.abs(np.diff(steps)) <= np.maximum(EXACT * usual, 1.0)
    held = np.append(alike, False) | np.append(False, alike)
    for parts in range(2, MOST_STEPS + 1):
        period, allowed = usual / parts, max(EXACT * usual, 1.0)
        counts = np.rint(steps / period)
        period = float(steps.sum() / max(counts.sum(), 1.0))
        fits = allowed < UNEVEN * period and counts.min() >= 1 and np.abs(steps - counts * period).max() <= allowed
        odd = counts % parts > 0
        if fits and held[odd].sum() >= LEAST_HELD_SHARE * odd.sum() > 0:
            places = np.concatenate([[0], np.cumsum(counts)])
            return Places(
                timestamps=tuple(timestamps),
                places=tuple(int(place) for place in places),
                period=period,
                per_frame=parts,
                rate_error=1 / float(timestamps[-1] - timestamps[0]),
            )
    return None


def _longest_run(uneven: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> tuple[int, int]:
    """Return the first step of the longest run of even ones, and the one after its last."""
    breaks = np.concatenate([[-1], np.flatnonzero(uneven), [uneven.size]])
    lengths = np.diff(breaks) - 1
    at = int(lengths.argmax())
    return int(breaks[at]) + 1, int(breaks[at + 1])
