"""Frames made smaller in their codes: what the live picture is made of, at the size that there is time for.

Rows that are averaged opened one after the other; ``smaller_plan`` and ``smaller_timing`` say of the small picture
when its rows open, that each is a mean of several, and when flashes come, so that recipes hold for it as for any. A
mosaic becomes colour on the way: of each colour the mean of its samples in a cell, which lie around the cell's middle
where it is an odd number of pixels wide. A cell with a clipped sample is clipped.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.live.showing.smaller_kernel import average
from psvideo.model.coded import Coded, Tone
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.model.rows.clipping import SATURATED
from psvideo.model.timing import Timing

FINER = 16
"""Means are kept in sixteenths of a code, as far as 16 bits hold them."""
CHANNELS = {"R": 0, "G": 1, "B": 2}


@dataclass(frozen=True, kw_only=True)
class Smaller:
    """How frames are made smaller: cells of ``step`` by ``step`` pixels; ``cfa`` is the filter pattern of a mosaic."""

    step: int
    cfa: str | None = None

    def of(self, picture: Coded) -> Coded:
        """Return a picture made smaller: (row, col) of a grey one, (row, col, 3) of colour or a mosaic."""
        step, tone = self.step, picture.tone
        codes: NDArray[Any] = np.ascontiguousarray(np.asarray(picture.codes))
        if step == 1:
            return Coded(codes=codes, tone=tone)
        if tone.table.size or codes.dtype.kind == "f" or not _is_even(tone):
            codes, tone = picture.light(), Tone()
        planes = codes[..., None] if codes.ndim == 2 else codes
        channel_of, channels = _channels(self.cfa, planes.shape[2])
        scale, clips, top = _scale(tone, codes.dtype)
        kind = np.float32 if codes.dtype.kind == "f" else np.uint16
        small = np.empty((codes.shape[0] // step, codes.shape[1] // step, channels), kind)
        average(planes, step, channel_of, np.float32(scale), np.float32(clips), np.float32(top), small)
        even = replace(tone, zero=tone.zero[:1, :1] * scale, gain=tone.gain[:1, :1] / scale, most=tone.most * scale)
        return Coded(codes=small[..., 0] if channels == 1 else small, tone=even)


def smaller_plan(plan: Plan, step: int) -> Plan:
    """Return the plan of a camera whose picture is made smaller."""
    camera = plan.camera
    height_px, width_px = camera.height_px // step, camera.width_px // step
    readout_s = None if camera.readout_s is None else camera.readout_s * height_px * step / camera.height_px
    small = replace(camera, height_px=height_px, width_px=width_px, readout_s=readout_s, rows_each=step)
    return replace(plan, camera=small)


def smaller_timing(timing: Timing, step: int, height_px: int) -> Timing:
    """Return the timing of frames of ``height_px`` rows once these are made smaller: a small row opens as the mean of
    its rows does."""
    late_s = abs(timing.row_time_s) * (step - 1) / 2
    if timing.row_time_s < 0:
        late_s += abs(timing.row_time_s) * (height_px % step)
    flashes = tuple(replace(flash, start_s=flash.start_s - late_s) for flash in timing.flashes)
    return replace(timing, row_time_s=timing.row_time_s * step, flashes=flashes)


def smaller_rig(rig: Rig, step: int) -> Rig:
    """Return the rig with its lens in the small picture's pixels."""
    focal, principal = rig.focal_px, rig.principal_px
    return replace(
        rig,
        focal_px=None if focal is None else (focal[0] / step, focal[1] / step),
        principal_px=None
        if principal is None
        else ((principal[0] + 0.5) / step - 0.5, (principal[1] + 0.5) / step - 0.5),
    )


def _is_even(tone: Tone) -> bool:
    """Return whether all positions of a mosaic have the same levels."""
    return bool((tone.zero == tone.zero[0, 0]).all() and (tone.gain == tone.gain[0, 0]).all())


def _channels(cfa: str | None, channels: int) -> tuple[NDArray[np.int64], int]:
    """Return which channel a sample goes to, by (row % 2, col % 2, channel), and how many there are.

    A picture of several channels is no mosaic, whatever the plan says: readers refuse it, and a rehearsal is before
    them.
    """
    if cfa is None or channels > 1:
        return np.tile(np.arange(channels, dtype=np.int64), (2, 2, 1)), channels
    return np.array([CHANNELS[name] for name in cfa], np.int64).reshape(2, 2, 1), 3


def _scale(tone: Tone, kind: np.dtype[Any]) -> tuple[float, float, float]:
    """Return by what codes are multiplied, from which code on they are clipped, and what a clipped cell becomes."""
    clips = SATURATED / float(tone.gain[0, 0]) + float(tone.zero[0, 0])
    most = min(tone.most, np.inf if kind.kind == "f" else float(np.iinfo(kind).max))
    scale = 1.0 if kind.kind == "f" else float(min(FINER, 65535 // max(int(most), 1)))
    top = max(clips, min(most, 1.0 / float(tone.gain[0, 0]) + float(tone.zero[0, 0]))) * scale
    return max(scale, 1.0), clips, np.ceil(top) if kind.kind != "f" else top
