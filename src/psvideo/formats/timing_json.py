"""A timing as timing.json (schema ``psvideo-timing/1``)."""

import json
from pathlib import Path

from pydantic import Field

from psvideo.formats.contract import Contract, parse_record, read_json
from psvideo.formats.paths import path_of
from psvideo.model.rows.ripple import Ripple
from psvideo.model.timing import DroppedFrames, Flash, Order, Timing

SCHEMA = "psvideo-timing/1"
ADVICE = "Make it again with psvideo sync."


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


class _MainsFile(Contract):
    hz: float = Field(gt=0)
    cosine: float = Field(ge=-1, le=1)
    sine: float = Field(ge=-1, le=1)
    error: float = Field(ge=0)


class _TimingFile(Contract):
    schema_: str = Field(alias="schema")
    clip: str
    frame_period_s: float = Field(gt=0)
    exposure_s: float = Field(gt=0)
    row_time_s: float
    clock_offset_ppm: float
    rise_s: float = Field(default=0.0, ge=0)
    fall_s: float = Field(default=0.0, ge=0)
    mains: _MainsFile | None = None
    phase_error_rows: float = Field(ge=0)
    order: Order
    order_note: str = ""
    dropped_frames: list[_DroppedFile] = Field(default_factory=list)
    repeated_frames: list[int] = Field(default_factory=list)
    flashes: list[_FlashFile]


def read_timing(path: Path | str) -> Timing:
    """Read timing.json: when every flash of a clip fired.

    Parameters
    ----------
    path
        The file, as ``sync`` and whole runs write it.

    Returns
    -------
    Timing
        As ``find_timing`` gives it.

    Raises
    ------
    PsvideoError
        Names the file, the key and what was expected.

    Examples
    --------
    >>> import psvideo as ps
    >>> found = ps.sync("take3/", out="timing.json")
    >>> ps.read_timing("timing.json").flashes[0].lights == found.flashes[0].lights
    True
    """
    path = path_of("path", path)
    return parse_timing(read_json(path, advice=ADVICE), source=str(path))


def parse_timing(data: dict[str, object], *, source: str) -> Timing:
    """Return the timing that a record as ``timing_record`` gives it holds; ``source`` names its file in errors."""
    file = parse_record(data, _TimingFile, SCHEMA, source=source, advice=ADVICE)
    flashes = tuple(Flash(**flash.model_dump()) for flash in file.flashes)
    dropped = tuple(DroppedFrames(after=hole.after, count=hole.count) for hole in file.dropped_frames)
    scalars = file.model_dump(exclude={"schema_", "flashes", "dropped_frames", "repeated_frames", "mains"})
    repeated = tuple(file.repeated_frames)
    mains = None if file.mains is None else _ripple(file.mains)
    return Timing(flashes=flashes, dropped_frames=dropped, repeated_frames=repeated, mains=mains, **scalars)


def _ripple(file: _MainsFile) -> Ripple:
    return Ripple(hz=file.hz, amplitude=complex(file.cosine, -file.sine), error=file.error)


def _mains_row(ripple: Ripple) -> dict[str, float]:
    return {"hz": ripple.hz, "cosine": ripple.amplitude.real, "sine": -ripple.amplitude.imag, "error": ripple.error}


def timing_record(timing: Timing) -> dict[str, object]:
    """Return the timing as what timing.json holds."""
    order_note = {"order_note": timing.order_note} if timing.order_note else {}
    mains = {} if timing.mains is None else {"mains": _mains_row(timing.mains)}
    repeated = {"repeated_frames": list(timing.repeated_frames)} if timing.repeated_frames else {}
    return {
        "schema": SCHEMA,
        "clip": timing.clip,
        "frame_period_s": timing.frame_period_s,
        "exposure_s": timing.exposure_s,
        "row_time_s": timing.row_time_s,
        "clock_offset_ppm": timing.clock_offset_ppm,
        "rise_s": timing.rise_s,
        "fall_s": timing.fall_s,
        **mains,
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
