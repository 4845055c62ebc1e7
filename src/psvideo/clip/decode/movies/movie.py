"""What a movie holds: its first frame's header, every frame's timestamp, and its place in time."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np
from av.container import InputContainer
from av.video.stream import VideoStream

from psvideo.clip.decode.movies.movie_edits import edits_of
from psvideo.clip.decode.movies.movie_frames import moving_streams, opened_movie, read_movie
from psvideo.clip.decode.movies.movie_tags import capture_rate_hz, compression_warning, gamut_of, shot_by, transfer_of
from psvideo.clip.decode.movies.movie_times import (
    UNEVEN,
    Places,
    Stamps,
    frame_places,
    promised_frames,
    stamps_of,
)
from psvideo.clip.decoded import Header
from psvideo.errors import PsvideoError
from psvideo.model.units import counted

SEVERAL = "the movie holds {}; the first one counts. Where another is meant, export it by itself"


@dataclass(frozen=True, kw_only=True)
class Movie:
    """A movie's first frame's header and, in the order of time, every frame's timestamp and place.

    ``places`` count frames from the first; a gap of whole frames between timestamps leaves places out. Where the rate
    varies there are ``per_frame`` places from one frame to the usual next one, and ``rates_hz`` are the lowest and the
    highest rate. ``rate_hz`` is the rate at which the file usually plays, None where a single frame shows none;
    timestamps that are rounded, or jitter, leave it unsure by the share ``rate_error``. ``capture_rate_hz`` is the rate
    at which it was shot, where the file says so.
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
    with opened_movie(path) as (container, stream):
        stamps = stamps_of(container, stream)
        shown = _shown(path, container, stream, stamps.timestamps)
        found = frame_places(path, shown)
        promised = promised_frames(container, stream, found.period * found.per_frame)
        said = _Said.of(container, stream)
    hidden = len(stamps.timestamps) - len(shown)
    _refuse_truncated(
        path, found, held=len(stamps.timestamps), hidden=hidden, promised=promised, tick_s=said.time_base_s
    )
    timestamps = found.timestamps
    header = next(read_movie(path, timestamps[:1])).header
    warnings = _warnings(said, stamps, found, hidden=hidden, bits=header.bits or 0)
    return Movie(
        header=replace(
            header,
            time_code=said.time_code,
            shot=said.shot,
            transfer=header.transfer or said.transfer,  # frames may say less than the container
            colour=header.colour or said.colour,
            warnings=header.warnings + warnings,
        ),
        timestamps=timestamps,
        places=found.places,
        rate_hz=1 / (found.period * found.per_frame * said.time_base_s) if found.period else None,
        rate_error=found.rate_error,
        capture_rate_hz=said.capture_rate_hz,
        per_frame=found.per_frame,
        rates_hz=_rates_hz(found, said.time_base_s) if found.per_frame > 1 else None,
    )


@dataclass(frozen=True, kw_only=True)
class _Said:
    """What a movie's file says of itself, beside its frames' times. ``exact``: its coding loses nothing."""

    time_base_s: float
    time_code: str | None
    shot: tuple[tuple[str, str], ...]
    transfer: str | None
    colour: str | None
    capture_rate_hz: float | None
    codec: str
    exact: bool
    several: str | None
    odd_pixels: str | None

    @classmethod
    def of(cls, container: InputContainer, stream: VideoStream) -> Self:
        codec, others = stream.codec_context.codec, len(moving_streams(container)) - 1
        return cls(
            time_base_s=float(stream.time_base or 1),
            time_code=container.metadata.get("timecode") or stream.metadata.get("timecode"),
            shot=shot_by(container.metadata | stream.metadata),
            transfer=transfer_of(stream.codec_context),
            colour=gamut_of(stream.codec_context),
            capture_rate_hz=capture_rate_hz(container.metadata | stream.metadata),
            codec=codec.canonical_name,
            exact=codec.lossless and not codec.lossy,
            several=SEVERAL.format(counted(others + 1, "video stream")) if others else None,
            odd_pixels=_pixels_not_square(stream),
        )


def _refuse_truncated(path: Path, found: Places, *, held: int, hidden: int, promised: int, tick_s: float) -> None:
    if not held:
        raise PsvideoError(f"{path}: holds no frame that can be found; it is truncated or damaged. Copy it again.")
    if held < promised and found.places[-1] + 1 + found.left_out + hidden < promised:
        last_s = (found.timestamps[-1] - found.timestamps[0]) * tick_s
        raise PsvideoError(
            f"{path}: holds {held} frames, and its header promises {promised}: it is truncated, or damaged behind the "
            f"last of these, {last_s:.3f} s from the start. Copy it again. Where there is no better copy, repack what "
            f"it holds: ffmpeg -i {path.name} -c copy repacked{path.suffix}"
        )


def _warnings(said: _Said, stamps: Stamps, found: Places, *, hidden: int, bits: int) -> tuple[str, ...]:
    held = len(stamps.timestamps)
    whole = held if said.exact else stamps.whole_frames  # where nothing is lost, changes of other frames cost nothing
    warnings = (
        compression_warning(said.codec, bits, frames=held, whole_frames=whole),
        _cut(hidden, held) if hidden else None,
        said.several,
        said.odd_pixels,
        _left_out(found) if found.left_out else None,
        _strays(found),
    )
    return tuple(warning for warning in warnings if warning)


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
