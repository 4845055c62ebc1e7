"""How a live run stands: its status of the last second and its summary at the end, from those who do the work."""

import time
from dataclasses import dataclass

import numpy as np

from psvideo.live.chain import Chain
from psvideo.live.following.holding import Holding
from psvideo.live.following.light_names import guess_words, order_of
from psvideo.live.incoming.recording import Recording
from psvideo.live.result_times import ResultTimes
from psvideo.live.showing.smaller import smaller_plan
from psvideo.live.status import LiveState, LiveStatus, LiveSummary


@dataclass(frozen=True, kw_only=True)
class Counted:
    """Frames and results up to a moment, from which the next second is counted."""

    frames: int = 0
    results: int = 0


@dataclass(frozen=True, kw_only=True)
class Standing:
    """Who is asked how the run stands; ``notes`` are what was to be said of the run so far."""

    chain: Chain
    times: ResultTimes
    recording: Recording | None
    holding: Holding | None
    notes: tuple[str, ...]

    @property
    def all_notes(self) -> tuple[str, ...]:
        """What there is to say of the run."""
        ended = "" if self.recording is None else self.recording.ended
        refused = "" if self.holding is None else self.holding.note
        named = guess_words(self.chain.followed, first_light=self.chain.first_light)
        return (*self.notes, *filter(None, (named, ended, refused)))

    def status(
        self,
        at_s: float,
        *,
        state: LiveState,
        last_s: float,
        before: Counted,
        drawn_ages_s: list[float],
        compiling: str,
        waits_for: str,
    ) -> LiveStatus:
        """Return the status ``at_s`` after the run began, of the ``last_s`` since so much was counted."""
        chain, follower, holding = self.chain, self.chain.follower, self.holding
        camera = smaller_plan(chain.plan, chain.step).camera
        ages_s = drawn_ages_s or self.times.ages_since(before.results)
        return LiveStatus(
            at_s=round(at_s, 3),
            state=state,
            fps=(chain.count.seen - before.frames) / last_s,
            frames=chain.count.seen,
            lost=chain.lost_frames,
            results=self.times.count,
            results_per_s=(self.times.count - before.results) / last_s,
            age_s=float(np.median(ages_s)) if ages_s else None,
            oldest_s=max(ages_s, default=None),
            phase_error_rows=None if follower is None else follower.error_rows,
            clock_offset_ppm=None if follower is None else follower.clock.offset_ppm,
            order=None if follower is None else order_of(chain.followed),
            width_px=camera.width_px,
            height_px=camera.height_px,
            why=chain.why,
            compiling=compiling,
            waits_for=waits_for,
            recorded=None if self.recording is None else self.recording.written,
            record_ended=self.recording is not None and bool(self.recording.ended),
            off_rows=None if holding is None else holding.short_rows,
            trim_ppm=None if holding is None or holding.ended else holding.ppm,
            notes=self.all_notes,
        )

    def summary(self, began_s: float, *, first_lock_s: float | None, paced: bool) -> LiveSummary:
        """Return what the run came to that began at a time of the monotonic clock and is over now.

        ``paced``: frames came when they were due; else a picture's age means nothing.
        """
        chain, follower, ages_s = self.chain, self.chain.follower, self.times.ages_s
        return LiveSummary(
            seconds=time.monotonic() - began_s,
            frames=chain.count.seen,
            lost=chain.lost_frames,
            locks=len(chain.followed),
            first_lock_s=first_lock_s,
            results=self.times.count,
            ages_s=(float(np.median(ages_s)), max(ages_s)) if ages_s and paced else None,
            phase_error_rows=None if follower is None else follower.error_rows,
            clock_offset_ppm=None if follower is None else follower.clock.offset_ppm,
            recorded=None if self.recording is None else self.recording.written,
            notes=self.all_notes,
        )
