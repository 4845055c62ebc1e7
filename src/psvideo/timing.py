"""When every flash fired, on the camera's clock, and how sure that is: what ``sync`` finds and ``split`` uses.

As a file it is timing.json (schema ``psvideo-timing/1``).
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field, ValidationError

from psvideo.camera import FloatArray
from psvideo.errors import PsvideoError
from psvideo.tomlfile import Contract, check_schema, read_text

SCHEMA = "psvideo-timing/1"
Order = Literal["marker", "rig", "given", "guess"]


@dataclass(frozen=True, kw_only=True)
class Flash:
    """One flash of the clip. ``slot`` is its place in the plan's list; ``complete`` False: the clip cuts it."""

    index: int
    slot: int
    lights: Mapping[str, float]
    start_s: float
    duration_s: float
    complete: bool
    plate: str | None = None


@dataclass(frozen=True, kw_only=True)
class DroppedFrames:
    """A hole in the clip: ``count`` frames are missing after the file numbered ``after``."""

    after: int
    count: int


@dataclass(frozen=True, kw_only=True)
class Timing:
    """The flashes of a clip in order. ``order`` says how the lights' names were found: a guess is called ``guess``.

    ``order_note`` is a sentence on how a rig's directions decided the order, or why they did not; empty where none were
    asked. ``repeated_frames`` are the numbers of frames that show the same moment as the frame before them. ``notes``
    are sentences for people on what to distrust; ``row_time_error_s`` is the row time's standard error where the
    picture told it, None where the plan did; ``phase_error_s`` is ``phase_error_rows`` in seconds. None of these three
    goes into the file. A global shutter's rows open together: its ``phase_error_rows`` are of ``frame_period_s`` /
    height each.
    """

    clip: str
    frame_period_s: float
    exposure_s: float
    row_time_s: float
    clock_offset_ppm: float
    phase_error_rows: float
    order: Order
    flashes: tuple[Flash, ...]
    dropped_frames: tuple[DroppedFrames, ...] = ()
    repeated_frames: tuple[int, ...] = ()
    order_note: str = ""
    notes: tuple[str, ...] = field(default=(), compare=False)
    row_time_error_s: float | None = field(default=None, compare=False)
    phase_error_s: float | None = field(default=None, compare=False)

    @property
    def how_sure(self) -> str:
        """One sentence on how sure the flashes' times are; empty where nothing was fitted."""
        rows = f"{self.phase_error_rows:.2g} row"
        if self.phase_error_s is None:
            return f"Flash times are sure to {rows}." if self.phase_error_rows else ""
        times = (
            f"{self.phase_error_s * 1e6:.2g} us" if self.phase_error_s < 1e-3 else f"{self.phase_error_s * 1e3:.2g} ms"
        )
        return f"Flash times are sure to {times}, {rows}." if self.row_time_s else f"Flash times are sure to {times}."

    @property
    def start_s(self) -> FloatArray:
        """When every flash starts, shape (flash,)."""
        return np.array([flash.start_s for flash in self.flashes], np.float64)

    @property
    def duration_s(self) -> FloatArray:
        """How long every flash lasts on the camera's clock, shape (flash,)."""
        return np.array([flash.duration_s for flash in self.flashes], np.float64)


def places_in_time(timing: Timing, numbers: Sequence[int]) -> dict[int, int]:
    """Return the true index of every frame of a clip, by number; repeated frames, which add nothing, are left out.

    ``numbers`` are all the clip's frame numbers, ascending. Holes that the numbering does not show count too.

    >>> timing = Timing(clip="", frame_period_s=1, exposure_s=1, row_time_s=0, clock_offset_ppm=0, phase_error_rows=0,
    ...     order="given", flashes=(), dropped_frames=(DroppedFrames(after=2, count=3),), repeated_frames=(5,))
    >>> places_in_time(timing, [1, 2, 4, 5, 6])
    {1: 0, 2: 1, 4: 5, 6: 6}
    """
    missing = {hole.after: hole.count for hole in timing.dropped_frames}
    repeated = set(timing.repeated_frames)
    places: dict[int, int] = {}
    index = 0
    for number, following in zip(numbers, (*numbers[1:], None), strict=True):
        if number not in repeated:
            places[number] = index
        if following is not None:
            told = following - number - 1
            index += 1 + max(missing.get(number, 0), told) - (following in repeated)
    return places


class _FlashFile(Contract):
    index: int
    slot: int = Field(ge=0)
    lights: dict[str, float]
    start_s: float
    duration_s: float = Field(gt=0)
    complete: bool
    plate: str | None = None


class _DroppedFile(Contract):
    after: int
    count: int = Field(gt=0)


class _TimingFile(Contract):
    schema_: str = Field(alias="schema")
    clip: str
    frame_period_s: float = Field(gt=0)
    exposure_s: float = Field(gt=0)
    row_time_s: float
    clock_offset_ppm: float
    phase_error_rows: float = Field(ge=0)
    order: Order
    order_note: str = ""
    dropped_frames: list[_DroppedFile] = Field(default_factory=list)
    repeated_frames: list[int] = Field(default_factory=list)
    flashes: list[_FlashFile]


def read_timing(path: Path) -> Timing:
    """Read timing.json. Raises PsvideoError that names the file, the key and what was expected."""
    try:
        data = json.loads(read_text(path))
        check_schema(data.get("schema"), SCHEMA, source=str(path))
        file = _TimingFile.model_validate(data)
    except (json.JSONDecodeError, AttributeError) as fault:
        raise PsvideoError(f"{path}: not a JSON object ({fault}). Make it again with psvideo sync.") from fault
    except ValidationError as fault:
        first = fault.errors()[0]
        key = ".".join(map(str, first["loc"]))
        raise PsvideoError(f"{path}: key '{key}': {first['msg']}. Make it again with psvideo sync.") from None
    flashes = tuple(Flash(**flash.model_dump()) for flash in file.flashes)
    dropped = tuple(DroppedFrames(after=hole.after, count=hole.count) for hole in file.dropped_frames)
    scalars = file.model_dump(exclude={"schema_", "flashes", "dropped_frames", "repeated_frames"})
    repeated = tuple(file.repeated_frames)
    return Timing(flashes=flashes, dropped_frames=dropped, repeated_frames=repeated, **scalars)


def timing_record(timing: Timing) -> dict[str, object]:
    """Return the timing as what timing.json holds."""
    order_note = {"order_note": timing.order_note} if timing.order_note else {}
    repeated = {"repeated_frames": list(timing.repeated_frames)} if timing.repeated_frames else {}
    return {
        "schema": SCHEMA,
        "clip": timing.clip,
        "frame_period_s": timing.frame_period_s,
        "exposure_s": timing.exposure_s,
        "row_time_s": timing.row_time_s,
        "clock_offset_ppm": timing.clock_offset_ppm,
        "phase_error_rows": timing.phase_error_rows,
        "order": timing.order,
        **order_note,
        "dropped_frames": [{"after": hole.after, "count": hole.count} for hole in timing.dropped_frames],
        **repeated,
        "flashes": [_flash_row(flash) for flash in timing.flashes],
    }


def format_timing(timing: Timing) -> str:
    """Return the timing as JSON text, one flash a line; reading it back gives an equal timing."""
    record = timing_record(timing)
    rows = ",\n  ".join(json.dumps(row) for row in map(_flash_row, timing.flashes))
    head = json.dumps(record | {"flashes": []}, indent=1)
    return head.removesuffix("[]\n}") + f"[\n  {rows}\n ]\n}}\n"


def _flash_row(flash: Flash) -> dict[str, object]:
    row: dict[str, object] = {
        "index": flash.index,
        "slot": flash.slot,
        "lights": dict(flash.lights),
        "start_s": flash.start_s,
        "duration_s": flash.duration_s,
        "complete": flash.complete,
    }
    return row if flash.plate is None else row | {"plate": flash.plate}
