"""The strobe looked for while frames come: which of the latest ones are searched, and when that is worth it."""

import threading
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import NoStrobeError
from psvideo.live.following.lock import LONGEST_S, Lock, frames_to_lock, lock
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan


@dataclass(frozen=True, kw_only=True)
class NumberedProfile:
    """One frame by the source's number: its row means (row,), and by how much these may be wrong (None: not).

    ``same``: its codes are those of the frame before.
    """

    number: int
    value: Doubles
    doubt: Doubles | None = None
    same: bool = False


def _set() -> threading.Event:
    event = threading.Event()
    event.set()
    return event


@dataclass(kw_only=True)
class Seeking:
    """The latest frames' profiles, and from which number on there are enough of them for the next search.

    ``idle`` is set while no search is under way; profiles stay as long as one is. ``why`` says why the last one found
    nothing.
    """

    plan: Plan
    latest: deque[NumberedProfile] = field(default_factory=deque)
    idle: threading.Event = field(default_factory=_set)
    why: str = ""
    _again_at: int = 0

    def keep(self, profile: NumberedProfile) -> None:
        """Keep one more frame's profile, and let those go that are too old to be searched."""
        self.latest.append(profile)
        most = max(round(LONGEST_S / self.plan.camera.frame_period_s), frames_to_lock(self.plan))
        while self.idle.is_set() and len(self.latest) > 1 and profile.number - self.latest[0].number >= most:
            self.latest.popleft()

    def begun(self) -> list[NumberedProfile]:
        """Return the profiles to be searched now, none where it is too early; a search is under way then."""
        enough = frames_to_lock(self.plan)
        if not self.idle.is_set() or self.latest[-1].number < self._again_at:
            return []
        fresh = [one for one in self.latest if one.number > self._again_at - enough]
        if len(fresh) < enough:
            return []
        self.idle.clear()
        return fresh

    def ended(self) -> None:
        """Note that the search is over."""
        self.idle.set()

    def found_nothing(self, why: str) -> None:
        """Look again once half of the frames that are searched are new."""
        self.why = why
        self._again_at = self.latest[-1].number + frames_to_lock(self.plan) // 2

    def lost_at(self, number: int) -> None:
        """Look again in frames that came since the strobe was lost, from a numbered one on."""
        self._again_at = number - 1 + frames_to_lock(self.plan)


def searched(
    plan: Plan, profiles: list[NumberedProfile], *, later: int, first_light: str | None
) -> Lock | str | Exception:
    """Return the strobe that frames show, or why there is none; a fault of the search itself is returned as it is.

    The first frame stands ``later`` places after its number, by what earlier locks knew.
    """
    places: NDArray[np.int64] = np.array([one.number for one in profiles], np.int64) + later
    values = np.stack([one.value for one in profiles])
    try:
        return lock(plan, places, values, doubt=_stacked(profiles), first_light=first_light)
    except NoStrobeError as fault:
        return str(fault)
    except Exception as fault:  # handed to whoever waits for the run
        return fault


def _stacked(profiles: list[NumberedProfile]) -> Doubles | None:
    if all(one.doubt is None for one in profiles):
        return None
    return np.stack([np.zeros_like(one.value) if one.doubt is None else one.doubt for one in profiles])
