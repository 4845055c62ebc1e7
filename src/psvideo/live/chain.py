"""The chain without threads or clocks: frames in, the strobe followed, the newest round solved when somebody asks."""

import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import NoStrobeError
from psvideo.live.following.follow import Follower, State, caught_up
from psvideo.live.following.history import timing_now
from psvideo.live.following.lock import LONGEST_S, Lock, frames_to_lock, lock
from psvideo.live.incoming.ring import Ring, RingFrame, ring_of
from psvideo.live.showing.newest_round import LiveRounds
from psvideo.live.showing.smaller import Smaller, smaller_plan, smaller_rig, smaller_timing
from psvideo.model.arrays import Doubles
from psvideo.model.camera import Camera
from psvideo.model.coded import Coded
from psvideo.model.irradiance.intensity import lights_as_planned
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.model.rows.row_profiles import LOST, row_light
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.surface import Subject, Surface
from psvideo.model.timing import Timing, timed_camera
from psvideo.plates.sequence import Round
from psvideo.solve.instants import surfaces
from psvideo.solve.near_surface import near_surface_of
from psvideo.solve.normals.solving import Solving

GRID_PX = 240
"""A live surface is judged at half as many points a side as one that stays: it is shown for a moment."""
LOOKED_AGAIN = 32
"""What the subject reflects beyond n . l is found again after this many rounds: finding it takes a few ms."""
Search = Callable[[Callable[[], None]], None]
"""Runs a search: now, or beside what else goes on."""


@dataclass(frozen=True, kw_only=True)
class LiveFrame:
    """A frame as a source gives it: its place in time by the source's numbers, and when it came, by this machine.

    ``number`` is what its file is called by, where it has a file whose number nobody knew before.
    """

    index: int
    coded: Coded
    came_s: float
    number: int | None = None


@dataclass(frozen=True, kw_only=True)
class NewestRound:
    """The newest result: its plates, the surface where there is a rig, and when the last frame that showed it came.

    ``ended`` is that frame's place in time, ``frame`` the newest frame, at ``place``; ``step`` by how much pictures are
    smaller than the camera's.
    """

    round: Round
    surface: Surface | None
    came_s: float
    step: int
    timing: Timing
    frame: Coded
    place: int
    ended: int


def search_here(run: Callable[[], None]) -> None:
    """Search at once, while frames wait."""
    run()


def _set() -> threading.Event:
    event = threading.Event()
    event.set()
    return event


@dataclass(kw_only=True)
class Chain:
    """What happens to every frame, and what is made of the newest. ``take`` and ``solve`` may run in two threads.

    ``lost_frames`` counts frames that never came, by the source's numbers or by the picture; ``gaps`` are those of the
    numbers, by the last place before each, and ``first_number`` the first frame's, where it has one of its own.
    ``why`` says why no strobe was found the last time that one
    was looked for; ``fault`` is what went wrong in looking.
    """

    plan: Plan
    cfa: str | None = None
    rig: Rig | None = None
    first_light: str | None = None
    step: int = 1
    search: Search = search_here
    seen: int = 0
    lost_frames: int = 0
    first_number: int | None = None
    why: str = ""
    fault: Exception | None = None
    gaps: dict[int, int] = field(default_factory=dict)
    followed: list[Follower] = field(default_factory=list)
    follower: Follower | None = None
    _ring: Ring | None = None
    _rounds: LiveRounds | None = None
    _pending: deque[tuple[int, Doubles, Doubles | None]] = field(default_factory=deque)
    _idle: threading.Event = field(default_factory=_set)
    _first: int | None = None
    _last: int | None = None
    _wanted: int = 0
    _subject: Subject | None = None
    _solved: int = 0
    _guard: threading.RLock = field(default_factory=threading.RLock)

    @property
    def state(self) -> State:
        """Whether the strobe is found, doubted, or looked for."""
        return "seeking" if self.follower is None else self.follower.state

    def take(self, frame: LiveFrame) -> None:
        """Take in one more frame."""
        mean, clipped = row_light(frame.coded)
        doubt = LOST * clipped if clipped.any() else None
        small = Smaller(step=self.step, cfa=self.cfa).of(frame.coded)
        with self._guard:
            if not self.seen:
                self.first_number = frame.number
            self._count(frame.index)
            self._pending.append((frame.index, mean, doubt))
            while len(self._pending) > 1 and self._too_old(self._pending[0][0]):
                self._pending.popleft()
            place = frame.index if self.follower is None else self._follow(frame.index, mean, doubt)
            self._ring = self._ring or ring_of(self.plan)
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
        if self._ring is None or not self._ring.frames:
            return 0.0
        camera, newest = self.plan.camera, max(self._ring.frames)
        ended_s = newest * camera.frame_period_s + camera.exposure_s + abs(camera.readout_s or 0.0)
        return ended_s + max(host_s - self._ring.frames[newest].came_s, 0.0)

    def wait(self, most_s: float) -> None:
        """Wait until a search that is under way is over, and no longer than ``most_s``."""
        self._idle.wait(most_s)

    def solve(self) -> NewestRound | None:
        """Return what the newest whole round gives, None where there is no new one or no strobe is followed."""
        with self._guard:
            follower, ring, step = self.follower, self._ring, self.step
            if follower is None or follower.state == "lost" or ring is None or not ring.frames:
                return None
            held = {place: frame for place, frame in ring.frames.items() if _fits(frame, self.plan, step)}
            if not held:
                return None
            timing = timing_now(follower, (min(held), max(held)))
        plan = smaller_plan(self.plan, step)
        if self._rounds is None or self._rounds.plan != plan:
            before = FIRST if self._rounds is None else self._rounds.number
            self._rounds = LiveRounds(plan=plan, number=before)
        small = smaller_timing(timing, step, self.plan.camera.height_px)
        one = self._rounds.newest({place: frame.coded for place, frame in held.items()}, small)
        if one is None:
            return None
        last = max(held)
        ended = min(_ended(one, timed_camera(plan, small), small), last)
        return NewestRound(
            round=one,
            surface=None if self.rig is None else self._surface(one, plan, step),
            came_s=held.get(ended, held[last]).came_s,
            step=step,
            timing=small,
            frame=held[last].coded,
            place=last,
            ended=ended,
        )

    def _surface(self, one: Round, plan: Plan, step: int) -> Surface | None:
        assert self.rig is not None  # noqa: S101
        rig = smaller_rig(self.rig, step)
        camera, lights = plan.camera, lights_as_planned(rig, plan)
        near = near_surface_of(rig, lights, height_px=camera.height_px, width_px=camera.width_px)
        known = self._subject if self._solved % LOOKED_AGAIN else None
        solving = Solving(grid_px=GRID_PX, subject=known)
        solved = surfaces([one], plan, rig, solving=solving, near=near, one_by_one=True)
        surface = next((instant.surface for instant in solved), None)
        if surface is not None:
            self._solved += 1
            if known is None:
                self._subject = None if surface.misfit is None else Subject(reflectance=surface.misfit.reflectance)
        return surface

    def _count(self, index: int) -> None:
        self.seen += 1
        self._first = index if self._first is None else self._first
        if self._last is not None and index > self._last + 1:
            self.lost_frames += index - self._last - 1
            self.gaps[self._last] = index - self._last - 1
        self._last = index

    def _too_old(self, index: int) -> bool:
        most = max(round(LONGEST_S / self.plan.camera.frame_period_s), frames_to_lock(self.plan))
        return self._idle.is_set() and (self._last or 0) - index >= most

    def _follow(self, index: int, mean: Doubles, doubt: Doubles | None) -> int:
        follower = self.follower
        assert follower is not None  # noqa: S101
        extra, before = follower.extra, follower.state
        place = follower.add(index, mean, doubt)
        later = follower.extra - extra
        self.lost_frames += later
        if later and self._ring is not None:
            first = follower.holes[-1].before + extra if later > 0 else follower.doubted_from or 0
            self._ring.moved({at: at + later if at >= first else at for at in self._ring.frames})
        if follower.state == "lost" and before != "lost":
            self._look_behind(follower)
        return place

    def _look_behind(self, follower: Follower) -> None:
        """Look for the strobe in frames that came since it was lost."""
        assert follower.doubted_from is not None  # noqa: S101
        self._wanted = follower.doubted_from - follower.extra - 1 + frames_to_lock(self.plan)

    def _look(self) -> None:
        """Search for the strobe in the latest frames, once there are enough that came since it was last looked for."""
        with self._guard:
            newest = self._pending[-1][0]
            fresh = [one for one in self._pending if one[0] > self._wanted - frames_to_lock(self.plan)]
            if not self._idle.is_set() or newest < self._wanted or len(fresh) < frames_to_lock(self.plan):
                return
            self._idle.clear()
            index = np.array([one[0] for one in fresh], np.int64)
            known = sum(follower.later_at(fresh[0][0]) for follower in self.followed)
            values = np.stack([one[1] for one in fresh])
            doubts = _stacked([one[2] for one in fresh], values)
            first_light = self.first_light if index[0] == self._first else None  # it speaks of the first frames alone

        def run() -> None:
            try:
                found: Lock | str = lock(self.plan, index + known, values, doubt=doubts, first_light=first_light)
            except NoStrobeError as fault:
                found = str(fault)
            except Exception as fault:  # handed to whoever waits for the run
                self.fault, found = fault, str(fault)
            self._looked(found, index)

        self.search(run)

    def _looked(self, found: "Lock | str", index: NDArray[np.int64]) -> None:
        """Begin to follow what was found, from the frames that it was found in up to the newest."""
        with self._guard:
            self._idle.set()
            if isinstance(found, str):
                self._look_later(found)
                return
            known = [one for one in self._pending if index[0] <= one[0] <= index[-1]]
            later = [one for one in self._pending if one[0] > index[-1]]
            numbers = index.tolist()
            follower = caught_up(
                self.plan, found, [one[1] for one in known], [one[2] for one in known], numbers=numbers
            )
            if follower.state != "locked":
                self._look_later("The strobe was found, and gone again before it could be followed.")
                return
            self._catch_up(follower, later)
            self.why = ""
            for before in self.followed:  # what it took for missing in the frames that were searched is known better
                self.lost_frames -= before.missing_before(self._last or 0) - before.missing_before(numbers[0])
                before.forget_after(numbers[0])
            self.lost_frames += follower.missing_before(self._last or 0)
            self.follower = follower
            self.followed.append(follower)
            if self._ring is not None and len(self.followed) == 1:
                taken = [*numbers, *(one[0] for one in later)]
                self._ring.moved({number: number + follower.later_at(number) for number in taken})
            elif self._ring is not None:
                self._ring.frames.clear()

    def _catch_up(self, follower: Follower, later: list[tuple[int, Doubles, Doubles | None]]) -> None:
        for number, mean, doubt in later:
            follower.add(number, mean, doubt)
        if follower.state == "lost":
            self._look_behind(follower)

    def _look_later(self, why: str) -> None:
        self.why = why
        self._wanted = (self._last or 0) + frames_to_lock(self.plan) // 2


FIRST = LiveRounds.number


def _stacked(doubts: list[Doubles | None], values: Doubles) -> Doubles | None:
    if all(one is None for one in doubts):
        return None
    return np.stack([np.zeros(values.shape[1]) if one is None else one for one in doubts])


def _ended(one: Round, camera: Camera, timing: Timing) -> int:
    """Return the place in time of the last frame that shows any light of a round."""
    time_s = max(plate.time_s for plate in one.plates)
    flash = min(timing.flashes, key=lambda flash: abs(flash.start_s + flash.duration_s / 2 - time_s))
    return int(frames_touched(camera, np.array([flash.start_s]), np.array([flash.duration_s]))[1][0])


def _fits(frame: RingFrame, plan: Plan, step: int) -> bool:
    """Return whether a frame has the size that is made now, and not the one before."""
    return frame.coded.shape[0] == plan.camera.height_px // step
