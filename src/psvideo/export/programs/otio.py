"""An OpenTimelineIO file that ties a run's sequences to the clip they come from, at the right rates and places.

Written as the JSON of OpenTimelineIO's schemas (Timeline.1, Stack.1, Track.1, Clip.2, ImageSequenceReference.1,
ExternalReference.1), which needs no package; the library reads it in the tests. One track per sequence, the clip at the
bottom, cut to where the sequences begin: the tracks start together and play in real time.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from psvideo import __version__

Record = dict[str, object]


@dataclass(frozen=True, kw_only=True)
class Images:
    """Numbered pictures ``<folder>/<prefix><number><suffix>``; ``folder`` is a URL relative to the timeline's file."""

    name: str
    folder: str
    prefix: str
    suffix: str
    first: int
    count: int
    fps: Fraction
    digits: int = 4


@dataclass(frozen=True, kw_only=True)
class Footage:
    """The clip: a movie's URL or numbered pictures; ``start`` is how far into it the sequences begin, in frames."""

    name: str
    media: Images | str
    frames: int
    fps: Fraction
    start: float


def timeline_text(name: str, sequences: Sequence[Images], footage: Footage) -> str:
    """Return the timeline as the text of an .otio file."""
    begin = min((images.first for images in sequences), default=0)
    tracks = [_track("clip", [{**_footage(footage, sequences), "name": footage.name}])]
    tracks += [_track(images.name, _images(images, begin)) for images in sequences]
    record = {
        **_named("Timeline.1", name),
        "metadata": {"psvideo": {"version": __version__}},
        "global_start_time": None,
        "tracks": {**_composed("Stack.1", "tracks"), "children": tracks},
    }
    return json.dumps(record, indent=1) + "\n"


def _named(schema: str, name: str) -> Record:
    return {"OTIO_SCHEMA": schema, "metadata": {}, "name": name}


def _composed(schema: str, name: str) -> Record:
    return {**_named(schema, name), "source_range": None, "effects": [], "markers": [], "enabled": True}


def _track(name: str, children: Sequence[Record]) -> Record:
    return {**_composed("Track.1", name), "kind": "Video", "children": list(children)}


def _images(images: Images, begin: int) -> list[Record]:
    """Return a sequence's clip, after a gap where its first number comes later than the others'."""
    whole = _range(float(images.first), float(images.count), images.fps)
    clip = {**_clip(_sequence(images), whole), "name": images.name}
    late = float(images.first - begin)
    gap = {**_composed("Gap.1", ""), "source_range": _range(0.0, late, images.fps)}
    return [gap, clip] if late else [clip]


def _footage(footage: Footage, sequences: Sequence[Images]) -> Record:
    """Return the clip's part that plays while the sequences do."""
    begin = min((images.first for images in sequences), default=0)
    lasts = max(((images.first + images.count - begin) / images.fps for images in sequences), default=Fraction(0))
    first = footage.media.first if isinstance(footage.media, Images) else 0
    length = min(float(lasts * footage.fps), footage.frames - footage.start)  # the last instant may outlast the clip
    part = _range(first + footage.start, length, footage.fps)
    if isinstance(footage.media, Images):
        return _clip(_sequence(footage.media), part)
    media = {
        **_named("ExternalReference.1", ""),
        "available_range": _range(0.0, float(footage.frames), footage.fps),
        "available_image_bounds": None,
        "target_url": footage.media,
    }
    return _clip(media, part)


def _clip(media: Record, part: Record) -> Record:
    return {
        **_composed("Clip.2", ""),
        "source_range": part,
        "media_references": {"DEFAULT_MEDIA": media},
        "active_media_reference_key": "DEFAULT_MEDIA",
    }


def _sequence(images: Images) -> Record:
    return {
        **_named("ImageSequenceReference.1", ""),
        "available_range": _range(float(images.first), float(images.count), images.fps),
        "available_image_bounds": None,
        "target_url_base": images.folder,
        "name_prefix": images.prefix,
        "name_suffix": images.suffix,
        "start_frame": images.first,
        "frame_step": 1,
        "rate": float(images.fps),
        "frame_zero_padding": images.digits,
        "missing_frame_policy": "hold",
    }


def _range(start: float, duration: float, fps: Fraction) -> Record:
    return {"OTIO_SCHEMA": "TimeRange.1", "start_time": _time(start, fps), "duration": _time(duration, fps)}


def _time(value: float, fps: Fraction) -> Record:
    return {"OTIO_SCHEMA": "RationalTime.1", "rate": float(fps), "value": value}
