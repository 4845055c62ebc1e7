"""Whether camera and machine keep up, judged once a second: how small the live picture is made, and what is said."""

from collections.abc import Iterator
from dataclasses import dataclass

from psvideo.live.result_times import share_of_frames
from psvideo.live.showing.quality import LiveSecond, Quality
from psvideo.live.showing.smaller import smaller_plan
from psvideo.live.status import LiveStatus
from psvideo.model.plan import Plan

SLOW = 0.9
"""A source that gives less than this share of the plan's frames is slow, and said to be."""
SLOW_S = 4
"""Seconds in a row until that is said: in one a stream may begin, end or take a breath."""
SETTLES_S = 3.0
"""After the first results, which wait for what is loaded once, until it is judged whether there is time for more."""


@dataclass(kw_only=True)
class KeepingUp:
    """The live picture's ``quality`` after every second; ``source`` is the name of what gives the frames, ``slow_hint``
    what else it may mean that they come slowly; ``size_words`` say how large the picture has become."""

    plan: Plan
    source: str
    quality: Quality
    slow_hint: str = ""
    size_words: str = ""
    _slow_s: int = 0
    _settled_s: float | None = None

    def notes_on(self, status: LiveStatus, measured: LiveSecond | None) -> Iterator[str]:
        """Judge one second, None where no result was made in it: yield what is new to be said."""
        yield from self._slow_notes(status)
        if status.state != "locked" or measured is None:
            return
        self._settled_s = status.at_s + SETTLES_S if self._settled_s is None else self._settled_s
        if status.at_s < self._settled_s:
            return
        before, self.quality = self.quality.step, self.quality.after_second(measured)
        if self.quality.step != before:
            word = "smaller, to keep up" if self.quality.step > before else "larger: there is time for it"
            camera = smaller_plan(self.plan, self.quality.step).camera
            self.size_words = f"The live picture is now {camera.width_px} x {camera.height_px} pixels, {word}."

    def _slow_notes(self, status: LiveStatus) -> Iterator[str]:
        """Say once that frames come slowly; that none comes is said elsewhere."""
        if self._slow_s >= SLOW_S:
            return
        slow = status.fps > 0 and share_of_frames(status, self.plan) < SLOW
        self._slow_s = self._slow_s + 1 if slow else 0
        if self._slow_s == SLOW_S:
            words = (
                f"{self.source}: its frames come at {status.fps:.1f} a second, and the plan says "
                f"{float(self.plan.camera.fps):.5g}: what sends or reads them does not keep up. {self.slow_hint}"
            )
            yield words.rstrip()
