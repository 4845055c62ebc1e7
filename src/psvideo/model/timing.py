"""When every flash fired, on the camera's clock, and how certain that is: what ``sync`` finds and ``split`` uses."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.camera import Camera
from psvideo.model.half_flash import HalfFlash
from psvideo.model.plan import HasLights, Plan
from psvideo.model.rows.ripple import Ripple
from psvideo.model.rows.shutter import Pulse
from psvideo.model.swing import Swing
from psvideo.model.units import show_seconds

Order = Literal["marker", "rig", "given", "guess"]


@dataclass(frozen=True, kw_only=True)
class Flash(HasLights):
    """One flash of the clip. ``slot`` is its place in the plan's list; ``complete`` False: the clip cuts it, or it
    never fired."""

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
    """The flashes of a clip in order, and what else was found. Times are seconds on the camera's clock.

    Attributes
    ----------
    clip
        The clip's name.
    frame_period_s, exposure_s, row_time_s
        Of the camera; the row time is negative where the bottom row comes first.
    clock_offset_ppm
        By how much the strobe's seconds are longer than the camera's.
    phase_error_rows
        The standard error of the flashes' times, in row times; a global shutter's rows open together, and its error is
        in shares of ``frame_period_s`` / height.
    order
        How the lights' names were found: "marker", "rig", "given" or "guess".
    flashes
        Of each flash ``start_s``, ``duration_s``, its ``lights`` with their power, and whether it is ``complete``.
    dropped_frames, repeated_frames
        Holes in the clip, and the numbers of frames that show the same moment as the frame before them.
    order_note
        A sentence on how a rig's directions decided the order, or why they did not; empty where none were asked.
    rise_s, fall_s
        The LEDs' 1/e times, given or found.
    mains
        How ambient light swings with the mains, None where the clip does not show it clearly.
    swing
        How the clip's light grows and shrinks, None where it does not or that was not looked at. Not in the file, like
        what follows.
    half
        How bright half of a flash looks, None where that is half of all of it or was not looked at.
    notes
        Sentences on what to distrust.
    row_time_error_s
        The row time's standard error where the picture gave it, None where the plan did.
    phase_error_s
        ``phase_error_rows`` in seconds.
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
    rise_s: float = 0.0
    fall_s: float = 0.0
    mains: Ripple | None = None
    swing: Swing | None = field(default=None, compare=False)
    half: HalfFlash | None = field(default=None, compare=False)
    notes: tuple[str, ...] = field(default=(), compare=False)
    row_time_error_s: float | None = field(default=None, compare=False)
    phase_error_s: float | None = field(default=None, compare=False)

    def spelled(self, spell: Callable[[str], str]) -> "Timing":
        """Return the timing with its sentences in the words of whoever reads them: parameters, or options."""
        return replace(self, order_note=spell(self.order_note), notes=tuple(map(spell, self.notes)))

    @property
    def how_sure(self) -> str:
        """One sentence on how certain the flashes' times are; empty where nothing was fitted."""
        return f"Flash times are known to {self.known_to}." if self.known_to else ""

    @property
    def known_to(self) -> str:
        """How certain the flashes' times are, in seconds and rows; empty where nothing was fitted."""
        rows = f"{self.phase_error_rows:.2g} row"
        if self.phase_error_s is None:
            return rows if self.phase_error_rows else ""
        times = show_seconds(self.phase_error_s, figures=2)
        return f"{times}, {rows}" if self.row_time_s else times

    @property
    def pulse(self) -> Pulse:
        """How the LEDs answer their drive, as it was given or found."""
        return Pulse(rise_s=self.rise_s, fall_s=self.fall_s)

    @cached_property
    def start_s(self) -> Doubles:
        """When every flash starts, shape (flash,). Kept, for two hours have 200,000 flashes; not to be written to."""
        return _kept([flash.start_s for flash in self.flashes])

    @cached_property
    def duration_s(self) -> Doubles:
        """How long every flash lasts on the camera's clock, shape (flash,). Not to be written to."""
        return _kept([flash.duration_s for flash in self.flashes])

    @cached_property
    def shortest_gap_s(self) -> float:
        """The shortest time from a flash's end to the next one's start; infinite for fewer than two flashes."""
        return float(np.min(self.start_s[1:] - (self.start_s + self.duration_s)[:-1], initial=np.inf))


def _kept(values: list[float]) -> Doubles:
    kept = np.array(values, np.float64)
    kept.flags.writeable = False
    return kept


def timed_camera(plan: Plan, timing: Timing) -> Camera:
    """Return the plan's camera with the exposure and readout that the timing found."""
    readout_s = timing.row_time_s * plan.camera.height_px
    return replace(plan.camera, exposure_s=timing.exposure_s, readout_s=readout_s)


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
            numbered = following - number - 1
            index += 1 + max(missing.get(number, 0), numbered) - (following in repeated)
    return places
