"""How many results a live run made, how long each took, and how old it was when it was there."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from psvideo.live.showing.quality import LiveSecond
from psvideo.live.status import LiveStatus
from psvideo.model.plan import Plan

STATUS_S = 1.0
"""A status is sent this often."""


@dataclass(kw_only=True)
class ResultTimes:
    """Written by the thread that makes results, read by the one that says how things stand.

    ``ages_s``: of every result, from the coming of its last frame until it was made.
    """

    count: int = 0
    ages_s: list[float] = field(default_factory=list)
    _made_s: list[float] = field(default_factory=list)
    _making_since_s: float | None = None

    @contextmanager
    def making(self, began_s: float) -> Iterator[None]:
        """One result is being made, since ``began_s``."""
        self._making_since_s = began_s
        try:
            yield
        finally:
            self._making_since_s = None

    def add(self, *, came_s: float, began_s: float) -> None:
        """One result is there, whose last frame came at ``came_s``, and which was begun at ``began_s``."""
        self.count += 1
        self.ages_s.append(time.monotonic() - came_s)
        self._made_s.append(time.monotonic() - began_s)

    def ages_since(self, count: int) -> list[float]:
        """Return the ages of the results after the first ``count``."""
        return self.ages_s[len(self.ages_s) - max(self.count - count, 0) :]

    def last_second(self, status: LiveStatus, plan: Plan, *, behind_s: float) -> LiveSecond | None:
        """Return what the last second's results came to; None where none was made, nor was being made all the time."""
        since_s, made_s, self._made_s = self._making_since_s, self._made_s, []
        if not made_s and since_s is not None and self.count and time.monotonic() - since_s > STATUS_S:
            made_s = [time.monotonic() - since_s]
        if not made_s:
            return None
        made_age_s = max(self.ages_s[-len(made_s) :] if status.oldest_s is not None else made_s)
        return LiveSecond(
            age_s=made_age_s if status.oldest_s is None else status.oldest_s,
            made_age_s=made_age_s,
            made_s=float(np.median(made_s)),
            rate=status.results_per_s,
            rounds_per_s=share_of_frames(status, plan) * len(plan.dark_rounds) / plan.cycle_s,
            behind_s=behind_s,
        )


def share_of_frames(status: LiveStatus, plan: Plan) -> float:
    """Return which share of the plan's frames came, at most all."""
    return min(status.fps * plan.camera.frame_period_s, 1.0)
