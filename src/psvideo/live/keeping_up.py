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
SETTLES_S = 3.0
"""After the first results, which wait for what is loaded once, until it is judged whether there is time for more."""


@dataclass(kw_only=True)
class KeepingUp:
    """The live picture's ``quality`` after every second; ``source`` is the name of what gives the frames."""

    plan: Plan
    source: str
    quality: Quality
    _slow: bool = False
    _settled_s: float | None = None

    def notes_on(self, status: LiveStatus, measured: LiveSecond | None) -> Iterator[str]:
        """Judge one second, None where no result was made in it: yield what is new to be said."""
        if status.state != "locked" or measured is None:
            return
        self._settled_s = status.at_s + SETTLES_S if self._settled_s is None else self._settled_s
        if status.at_s < self._settled_s:
            return
        if share_of_frames(status, self.plan) < SLOW and not self._slow:
            self._slow = True
            yield (
                f"{self.source}: its frames come at {status.fps:.1f} a second, and the plan says "
                f"{float(self.plan.camera.fps):.5g}: what sends or reads them does not keep up."
            )
        before, self.quality = self.quality.step, self.quality.after_second(measured)
        if self.quality.step != before:
            word = "smaller, to keep up" if self.quality.step > before else "larger: there is time for it"
            camera = smaller_plan(self.plan, self.quality.step).camera
            yield f"The live picture is now {camera.width_px} x {camera.height_px} pixels, {word}."
