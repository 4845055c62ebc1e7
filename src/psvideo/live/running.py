"""The chain with threads and a clock: frames taken as they come, results made beside that, a status every second."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from math import inf

from psvideo.compute.compile_count import CompileCount, compiles_counted
from psvideo.compute.heap import no_looks_at_what_is_loaded
from psvideo.compute.side_threads import run_beside
from psvideo.live.chain import Chain, search_here
from psvideo.live.following.holding import Holding
from psvideo.live.incoming.behind import Behind
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.live.incoming.recording import Recording
from psvideo.live.incoming.source import LiveSource
from psvideo.live.keeping_up import KeepingUp
from psvideo.live.preparing import compiling_words, prepared
from psvideo.live.result_times import STATUS_S, ResultTimes
from psvideo.live.rhythm import Rhythm
from psvideo.live.showing.newest_result import NewestRound
from psvideo.live.showing.quality import Quality
from psvideo.live.standing import Counted, Standing
from psvideo.live.status import LiveState, LiveStatus, LiveSummary
from psvideo.live.waiting import Waiting

IDLE_S = 0.1
"""Whoever waits for a frame looks this often whether the run is over."""
SEARCH_S = 60.0
"""A search that is under way when the source ends is waited for no longer than this."""
LEAVES_S = 5.0
"""Threads that are still at work when the run is over are waited for this long."""
SILENT_LEAVES_S = 0.5
"""Whoever reads a silent source hears only with its next frame that the run was ended, and is waited for this long."""
Shows = Callable[[NewestRound], None]
Meanwhile = Callable[[NewestRound, float], None]
Said = Callable[[LiveStatus], None]


def search_beside(run: Callable[[], None]) -> None:
    """Search in a thread of its own, while frames are taken."""
    run_beside(run, name="psvideo search")


@dataclass(kw_only=True)
class Running:
    """One live run. ``shown`` gets every new result, ``said`` a status each second, ``recording`` every frame.
    ``meanwhile`` gets it after that, and until when (on the monotonic clock) there is time before the next one.

    ``prepare`` is done before the source is opened, where frames do not wait for it.
    ``drawn_ages_s`` says how old results were when pages had drawn them since a time; ``status`` is the last one that
    was said."""

    chain: Chain
    source: LiveSource
    quality: Quality
    shown: Shows
    said: Said
    meanwhile: Meanwhile = lambda newest, until_s: None
    prepare: Callable[[], None] = lambda: None
    drawn_ages_s: Callable[[float], list[float]] = lambda since_s: []
    recording: Recording | None = None
    holding: Holding | None = None
    seconds: float | None = None
    notes: list[str] = field(default_factory=list)
    first_lock_s: float | None = None
    status: LiveStatus | None = None
    times: ResultTimes = field(default_factory=ResultTimes)
    _keeping_up: KeepingUp = field(init=False)
    _behind: Behind | None = None
    _waiting: Waiting = field(init=False)
    _compiles: CompileCount = field(default_factory=CompileCount)
    _preparing: bool = False
    _stop: threading.Event = field(default_factory=threading.Event)
    _came: threading.Event = field(default_factory=threading.Event)
    _taking: threading.Lock = field(default_factory=threading.Lock)
    _fault: BaseException | None = None

    def __post_init__(self) -> None:
        """See who is waited for, and what has to keep up with what."""
        self._keeping_up = KeepingUp(
            plan=self.chain.plan, source=self.source.name, quality=self.quality, slow_hint=self.source.slow_hint
        )
        self._waiting = Waiting(name=self.source.name, check=self.source.check)

    def stop(self) -> None:
        """End the run soon, from any thread."""
        self._stop.set()

    def run(self) -> LiveSummary:
        """Take the source's frames to their end, or until stopped, and return what it came to."""
        began_s = time.monotonic()
        with compiles_counted() as self._compiles:
            if self.source.paced:
                self._get_ready(began_s)
                with no_looks_at_what_is_loaded():
                    self._beside(began_s)
            else:
                self._one_by_one(began_s)
        self._say_what_is_new(time.monotonic() - began_s)
        fault = self._fault or self.chain.fault
        if fault is not None:
            raise fault
        return self._standing.summary(began_s, first_lock_s=self.first_lock_s, paced=self.source.paced)

    def _say_what_is_new(self, took_s: float) -> None:
        """Say what came up since the last status, also where the run ends in a fault."""
        said = () if self.status is None else self.status.notes
        if self.all_notes != said:
            self.said(self._status(took_s, took_s, Counted()))

    def _one_by_one(self, began_s: float) -> None:
        """Take and solve in turn: for a clip that is played as fast as it goes, so that nothing depends on time."""
        self.chain.search = search_here
        for frame in self.source.frames():
            self._take(frame)
            newest = self._solve()
            if newest is not None:
                self.meanwhile(newest, inf)
            if self._stop.is_set() or self._over(frame.index):
                break
        took_s = time.monotonic() - began_s
        self.said(self._status(took_s, took_s, Counted()))

    def _get_ready(self, began_s: float) -> None:
        """Rehearse, and say how far that is."""

        def said() -> None:
            self.said(self._status(time.monotonic() - began_s, STATUS_S, Counted()))

        self._preparing = True
        wrong = prepared(self.prepare, said=said, every_s=STATUS_S)
        self._preparing = False
        self.notes.extend([wrong] if wrong else [])

    def _beside(self, began_s: float) -> None:
        self.chain.search = search_beside
        # whoever reads a silent source would keep the process from ending
        reading = threading.Thread(target=self._guarded, args=(self._read,), name="psvideo frames", daemon=True)
        reading.start()
        threads = [reading, run_beside(partial(self._guarded, self._make), name="psvideo results")]
        asked = self._until_over(began_s)
        if asked and self._taking.acquire(timeout=LEAVES_S):  # a frame that has come is recorded whole
            self._taking.release()
        for thread, wait_s in zip(threads, (SILENT_LEAVES_S if asked else LEAVES_S, LEAVES_S), strict=True):
            thread.join(wait_s)
        if asked:  # whoever ends a run waits for no search
            return
        self.chain.wait(SEARCH_S)  # a short clip may end before the strobe is found in it
        if not threads[-1].is_alive():  # else it is solving, and two would use one memory
            self._solve()

    def _until_over(self, began_s: float) -> bool:
        """Say each second how things stand, until the frames end or somebody ends the run; return whether somebody did.

        Ctrl-C is how live runs of cameras end: what was recorded and followed is written as at the end of a clip.
        """
        before, said_s = Counted(), time.monotonic()
        try:
            while not self._stop.wait(STATUS_S):
                now_s = time.monotonic()
                status = self._status(now_s - began_s, now_s - said_s, before)
                self._adapt(status)
                before, said_s = Counted(frames=status.frames, results=status.results), now_s
                self.said(status)
        except KeyboardInterrupt:
            self.stop()
            return True
        return False

    def _guarded(self, run: Callable[[], None]) -> None:
        try:
            run()
        except BaseException as fault:  # handed to whoever called
            self._fault = fault
        finally:
            self._stop.set()

    def _read(self) -> None:
        for frame in self.source.frames():
            with self._taking:
                if self._stop.is_set():
                    break
                self._take(frame)
            if self._stop.is_set() or self._over(frame.index):
                break

    def _make(self) -> None:
        """Solve when a frame has come and a result is due, and see to all else while none is."""
        plan = self.chain.plan
        rhythm = Rhythm(round_s=plan.cycle_s / len(plan.dark_rounds), frame_s=plan.camera.frame_period_s)
        while not self._stop.is_set():
            if not self._came.wait(IDLE_S):
                continue
            now_s = time.monotonic()
            if self._stop.wait(max(rhythm.next_begins_s(now_s) - now_s, 0.0)):
                continue
            self._came.clear()
            began_s = time.monotonic()
            newest = self._solve()
            if newest is not None:
                rhythm = rhythm.after_result(began_s=began_s, came_s=newest.came_s)
                self.meanwhile(newest, rhythm.idle_until_s(time.monotonic()))

    def _take(self, frame: LiveFrame) -> None:
        self._behind = self._behind or Behind(period_s=self.chain.plan.camera.frame_period_s)
        self._behind.take(frame.index, frame.came_s)
        if self.recording is not None:
            self.recording.take(frame)
        self.chain.take(frame)
        self._came.set()
        if self.chain.fault is not None:
            self.stop()
        if self.first_lock_s is None and self.chain.follower is not None:
            self.first_lock_s = self.chain.count.seen * self.chain.plan.camera.frame_period_s

    def _solve(self) -> NewestRound | None:
        began_s = time.monotonic()
        with self.times.making(began_s):
            newest = self.chain.solve()
            if newest is None:
                return None
            self.shown(newest)
        self.times.add(came_s=newest.came_s, began_s=began_s)
        return newest

    def _over(self, index: int) -> bool:
        return self.seconds is not None and (index + 1) * self.chain.plan.camera.frame_period_s >= self.seconds

    def _adapt(self, status: LiveStatus) -> None:
        """Make the picture smaller where there was no time for it, larger where there is, and say so."""
        behind_s = 0.0 if self._behind is None else self._behind.second_s()
        measured = self.times.last_second(status, self.chain.plan, behind_s=behind_s)
        before = self._keeping_up.quality.step
        self.notes.extend(self._keeping_up.notes_on(status, measured))
        if self._keeping_up.quality.step != before:
            self.chain.step = self._keeping_up.quality.step

    def _status(self, at_s: float, last_s: float, before: Counted) -> LiveStatus:
        """Return how things stand ``at_s`` after the run began, and keep that; of ``last_s``, since ``before``."""
        chain = self.chain
        state: LiveState = "preparing" if self._preparing else chain.state
        self.status = self._standing.status(
            at_s,
            state=state,
            last_s=last_s,
            before=before,
            drawn_ages_s=self.drawn_ages_s(time.monotonic() - last_s),
            compiling=compiling_words(self._compiles, time.monotonic(), preparing=self._preparing),
            waits_for=self._waiting.look(at_s, state=state, frames=chain.count.seen, why=chain.why),
        )
        return self.status

    @property
    def _standing(self) -> Standing:
        return Standing(
            chain=self.chain,
            times=self.times,
            recording=self.recording,
            holding=self.holding,
            notes=(*self.source.notes, *self.notes, *filter(None, [self._keeping_up.size_words])),
        )

    @property
    def all_notes(self) -> tuple[str, ...]:
        """What there is to say of the run."""
        return self._standing.all_notes
