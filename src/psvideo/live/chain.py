"""The chain without threads or clocks: frames in, the strobe followed, the newest round solved when somebody asks."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from psvideo.live.following.catching_up import caught_up
from psvideo.live.following.follow import Follower, State
from psvideo.live.following.history import timing_now
from psvideo.live.following.lock import Lock
from psvideo.live.following.seeking import NumberedProfile, Seeking, searched
from psvideo.live.incoming.frame_count import FrameCount
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.live.incoming.ring import Ring, RingFrame, ring_of
from psvideo.live.showing.newest_result import NewestResults, NewestRound
from psvideo.live.showing.smaller import Smaller
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.model.rows.row_profiles import LOST, row_light

Search = Callable[[Callable[[], None]], None]
"""Runs a search: now, or beside what else goes on."""


def search_here(run: Callable[[], None]) -> None:
    """Search at once, while frames wait."""
    run()


@dataclass(kw_only=True)
class Chain:
    """What happens to every frame, and what is made of the newest. ``take`` and ``solve`` may run in two threads.

    ``count`` is of the frames that came, ``followed`` all that was followed, one lock after the other, ``follower`` the
    last of these; ``fault`` is what went wrong in looking for the strobe.
    """

    plan: Plan
    cfa: str | None = None
    rig: Rig | None = None
    first_light: str | None = None
    step: int = 1
    search: Search = search_here
    count: FrameCount = field(default_factory=FrameCount)
    fault: Exception | None = None
    followed: list[Follower] = field(default_factory=list)
    follower: Follower | None = None
    _seeking: Seeking = field(init=False)
    _ring: Ring = field(init=False)
    _results: NewestResults = field(init=False)
    _before: tuple[LiveFrame, Doubles] | None = None
    _guard: threading.RLock = field(default_factory=threading.RLock)

    def __post_init__(self) -> None:
        """Begin with nothing seen."""
        self._seeking, self._results = Seeking(plan=self.plan), NewestResults(plan=self.plan)
        self._ring = ring_of(self.plan)

    @property
    def state(self) -> State:
        """Whether the strobe is found, doubted, or looked for."""
        return "seeking" if self.follower is None else self.follower.state

    @property
    def why(self) -> str:
        """Why no strobe was found the last time that one was looked for, "" where one was."""
        return self._seeking.why

    @property
    def lost_frames(self) -> int:
        """How many frames never came, by the source's numbers or by the picture."""
        return self.count.missing + sum(one.places.missing for one in self.followed)

    def take(self, frame: LiveFrame) -> None:
        """Take in one more frame."""
        value, clipped = row_light(frame.coded)
        doubt = LOST * clipped if clipped.any() else None
        profile = NumberedProfile(number=frame.index, value=value, doubt=doubt, same=self._is_same(frame, value))
        self._before = frame, value
        small = Smaller(step=self.step, cfa=self.cfa).of(frame.coded)
        with self._guard:
            self.count = self.count.after(frame)
            self._seeking.keep(profile)
            place = frame.index if self.follower is None else self._follow(self.follower, profile)
            self._ring.add(place, RingFrame(coded=small, came_s=frame.came_s))
        if self.state in ("seeking", "lost"):
            self._look()

    @contextmanager
    def at_rest(self) -> Iterator[None]:
        """Let no frame be taken while the block runs."""
        with self._guard:
            yield

    def camera_s(self, host_s: float) -> float:
        """Return a time of this machine's clock (not before the newest frame came) on the camera's clock."""
        if not self._ring.frames:
            return 0.0
        camera, newest = self.plan.camera, max(self._ring.frames)
        ended_s = newest * camera.frame_period_s + camera.exposure_s + abs(camera.readout_s or 0.0)
        return ended_s + max(host_s - self._ring.frames[newest].came_s, 0.0)

    def wait(self, most_s: float) -> None:
        """Wait until a search that is under way is over, and no longer than ``most_s``."""
        self._seeking.idle.wait(most_s)

    def solve(self) -> NewestRound | None:
        """Return what the newest whole round gives, None where there is no new one or no strobe is followed."""
        with self._guard:
            follower, step = self.follower, self.step
            frames = self._ring.of_height(self.plan.camera.height_px // step)
            if follower is None or follower.state == "lost" or not frames:
                return None
            timing = timing_now(follower, (min(frames), max(frames)))
        return self._results.of(frames, timing, rig=self.rig, step=step)

    def _is_same(self, frame: LiveFrame, value: Doubles) -> bool:
        """Return whether a frame has the codes of the one before; ``value`` are its row means."""
        if self._before is None or not np.array_equal(value, self._before[1]):
            return False
        return np.array_equal(np.asarray(frame.coded.codes), np.asarray(self._before[0].coded.codes))

    def _follow(self, follower: Follower, profile: NumberedProfile) -> int:
        """Follow one more frame and return its place in time; frames in the ring are moved where it shows that."""
        places, before = follower.places, follower.state
        place = follower.add(profile.number, profile.value, profile.doubt, same=profile.same)
        later = follower.places.missing - places.missing
        if later > 0:
            self._ring.moved_from(follower.places.holes[-1].before + places.late, later)
        elif later < 0:
            self._ring.moved_from(follower.doubted_from or 0, later)
        if follower.state == "lost" and before != "lost":
            self._look_behind(follower)
        return place

    def _look_behind(self, follower: Follower) -> None:
        """Look for the strobe in frames that came since it was lost."""
        assert follower.doubted_from is not None  # noqa: S101
        self._seeking.lost_at(follower.doubted_from - follower.places.late)

    def _look(self) -> None:
        """Search for the strobe in the latest frames, once there are enough that came since it was last looked for."""
        with self._guard:
            profiles = self._seeking.begun()
            if not profiles:
                return
            first = profiles[0].number
            later = sum(follower.places.late_by(first) for follower in self.followed)
            named = self.first_light if first == self.count.first else None  # it speaks of the first frames alone

        def run() -> None:
            self._looked(searched(self.plan, profiles, later=later, first_light=named), profiles)

        self.search(run)

    def _looked(self, found: Lock | str | Exception, profiles: list[NumberedProfile]) -> None:
        """Begin to follow what was found, from the frames that it was found in up to the newest."""
        with self._guard:
            self._seeking.ended()
            if isinstance(found, Exception):
                self.fault = found
            if not isinstance(found, Lock):
                self._seeking.found_nothing(str(found))
                return
            follower = self._caught_up(found, profiles)
            if follower.state != "locked":
                self._seeking.found_nothing("The strobe was found, but was gone again before it could be followed.")
                return
            later = [one for one in self._seeking.latest if one.number > profiles[-1].number]
            self._begin(follower, later, from_number=profiles[0].number)
            self._seeking.why = ""

    def _caught_up(self, found: Lock, profiles: list[NumberedProfile]) -> Follower:
        values, doubts = [one.value for one in profiles], [one.doubt for one in profiles]
        return caught_up(self.plan, found, values, doubts, numbers=[one.number for one in profiles])

    def _begin(self, follower: Follower, later: list[NumberedProfile], *, from_number: int) -> None:
        """Follow a new lock from a numbered frame on; frames that came ``later`` than those searched are caught up."""
        for one in later:
            follower.add(one.number, one.value, one.doubt, same=one.same)
        if follower.state == "lost":
            self._look_behind(follower)
        for before in self.followed:  # what it took for missing in the frames that were searched is known better
            before.places = before.places.until(from_number)
        if self.followed:
            self._ring.frames.clear()
        else:
            self._ring.placed(follower.places.late_by)
        self.follower = follower
        self.followed.append(follower)
