"""What moves between the plates of one light, looked for as they pass; and where a camera shakes, the whole picture."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from psvideo.model.arrays import Flags
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.sequence import Round
from psvideo.report.observe.motion import Glimpse, Motion, glimpse, motion_between

WEAK_BESIDE = 1 / 8
"""Motion and sharpness are looked for under the first light, unless it gives less than this of the brightest."""


@dataclass(kw_only=True)
class WatchedMotion:
    """Motion between the plates of the ``watched`` light; left out, it is the first light's, or the brightest's where
    the first gives hardly any light in the first round. ``white`` is what counts as white, found with its first plate.
    ``latest`` is what moved up to the newest plate, since the one before, or where these share too few rows, since the
    one before that."""

    watched: str = ""
    white: float | None = None
    latest: Motion | None = None
    _first: dict[str, Glimpse] = field(default_factory=dict)
    _glimpse: Glimpse | None = None
    _earlier: Glimpse | None = None
    _before: Motion | None = None
    _before_s: float = 0.0

    def glance(self, plate: LightPlate, lights: Sequence[str]) -> None:
        """Look for motion in a plate; of the first round, keep what it is told from. ``lights`` are the clip's."""
        if not self.watched and plate.light in self._first:
            self.watch_brightest(lights)
        if not self.watched and plate.light in lights:
            self._first[plate.light] = glimpse(plate)
        elif plate.light == self.watched:
            self._look(plate)

    def watch_brightest(self, lights: Sequence[str]) -> None:
        """Choose whose plates motion is looked for in from now on, by those that were seen so far: the first light's
        unless it is weak beside the brightest."""
        if self.watched or not self._first:
            return
        light = max(self._first, key=lambda one: self._first[one].white)
        first = lights[0]
        if first in self._first and self._first[first].white >= WEAK_BESIDE * self._first[light].white:
            light = first
        self.watched, self._glimpse = light, self._first[light]
        self.white = self._glimpse.white
        self._first.clear()

    def _look(self, plate: LightPlate) -> None:
        earlier = [one for one in (self._glimpse, self._earlier) if one is not None]
        self._earlier, self._glimpse = self._glimpse, glimpse(plate, self.white)
        self.white = self._glimpse.white
        self._before, self.latest = self.latest, None
        for before in earlier:
            self.latest, self._before_s = motion_between(before, self._glimpse), before.time_s
            if self.latest is not None:
                return

    def stirring(self, time_s: float) -> Flags | None:
        """Return what moves at an instant, of the glimpses' pixels: what changed until then and changes from then on,
        where the next plate was seen already; else what changed until then, with what came out from behind."""
        if self.latest is None or self.latest.changed is None or self._glimpse is None:
            return None
        changed, before = self.latest.changed, self._before
        if before is None or time_s > (self._before_s + self._glimpse.time_s) / 2:
            return changed
        return None if before.changed is None else changed & before.changed


def shaken(moving: Motion | None, one: Round) -> Motion | None:
    """Return what moves in a round whose plates were brought to one instant: all of the picture where the camera shook,
    else what was seen to. Fine detail that shifts everywhere looks like noise in the plates of one light."""
    if one.motion is None or one.motion.carried is None:
        return moving
    pixels = np.array(one.plates[0].shape[1::-1]) / one.motion.moves.shape[::-1]
    speed_px_s = float(np.hypot(*(pixels * one.motion.carried)))
    if moving is not None and moving.speed_px_s is not None:
        speed_px_s = max(speed_px_s, moving.speed_px_s)
    return Motion(speed_px_s=speed_px_s, share=1.0, changed=np.ones((1, 1), np.bool_))
