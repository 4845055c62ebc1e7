"""A measured readout time as lines of files: for the table of cameras and for the records of measurements."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from psvideo.calibrate.stripes.readout import Led, Readout
from psvideo.calibrate.strobed_readout import StrobedReadout


@dataclass(frozen=True, kw_only=True)
class MeasuredMode:
    """What the pictures do not say about the camera; a word in capitals stands where it is not known."""

    make: str = "MAKE"
    model: str = "MODEL"
    mode: str = "MODE"
    width_px: int | None = None
    fps: Fraction | None = None

    def fields(self, readout: Readout | StrobedReadout) -> list[str]:
        """Return the columns with which both files begin."""
        width = "WIDTH" if self.width_px is None else str(self.width_px)
        fps = "FPS" if self.fps is None else str(self.fps)
        return [self.make, self.model, self.mode, width, str(readout.rows), fps]


def camera_line(readout: Readout, mode: MeasuredMode, led: Led) -> str:
    """Return the line for the table of cameras (``capture/cameras.csv``)."""
    source = (
        f"{_frames(readout.frames)} of a {led.rate_hz:g} Hz LED: {readout.readout_s * 1e3:.3f} +- "
        f"{readout.error_s * 1e3:.3f} ms (psvideo calibrate readout)"
    )
    return _line([*mode.fields(readout), _ms(readout.readout_s, readout), _direction(readout), "measured", source])


def record_line(readout: Readout, mode: MeasuredMode, led: Led, *, date: str) -> str:
    """Return the line for ``calibration/records/readout.csv``."""
    spread = "" if readout.spread_s is None else f"{readout.spread_s * 1e3:.4f}"
    found = [f"{led.rate_hz:g}", f"{readout.rows_per_period:.3f}", str(readout.frames), _ms(readout.readout_s, readout)]
    return _line([*mode.fields(readout), *found, spread, _direction(readout), date, "psvideo calibrate readout"])


def strobed_camera_line(readout: StrobedReadout, mode: MeasuredMode) -> str:
    """Return the line for the table of cameras of a readout measured from a strobed clip."""
    amount_s = abs(readout.readout_s)
    source = (
        f"{_frames(readout.frames)} of a strobed clip: {_ms(amount_s, readout)} +- {_ms(readout.error_s, readout)} ms "
        "(psvideo calibrate readout)"
    )
    return _line([*mode.fields(readout), _ms(amount_s, readout), _direction(readout), "measured", source])


def strobed_record_line(readout: StrobedReadout, mode: MeasuredMode, *, date: str) -> str:
    """Return the line for ``calibration/records/readout.csv``: no LED's rate, no stripes, no single frames' spread."""
    found = ["", "", str(readout.frames), _ms(abs(readout.readout_s), readout), ""]
    source = "psvideo calibrate readout from a strobed clip"
    return _line([*mode.fields(readout), *found, _direction(readout), date, source])


def _direction(readout: Readout | StrobedReadout) -> str:
    return "DIRECTION" if readout.direction == "unknown" else readout.direction


def _frames(count: int) -> str:
    return "one frame" if count == 1 else f"{count} frames"


def _ms(seconds: float, readout: Readout | StrobedReadout) -> str:
    """Return milliseconds with the digits that are worth writing."""
    return f"{seconds * 1e3:.{3 if readout.error_s > 1e-6 else 4}f}"


def _line(fields: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(fields)
    return text.getvalue()
