"""The verdict lines of check while the camera runs: of the last second or two, by the same judgements."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from psvideo.live.showing.newest_result import NewestRound
from psvideo.live.status import LiveStatus
from psvideo.model.channels import brightest_channel
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.report.judge.every_line import judgements
from psvideo.report.judge.powers import power_words
from psvideo.report.judgement import Judgement, gravest_first, verdict_of
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import rig_points
from psvideo.report.observe.rig_and_curve.yuille1997 import Lens

LOOK_S = 0.4
"""So far apart are rounds that are looked at, in the footage's time: to look costs as much as to solve."""
ENOUGH = 4
"""Rounds by which the lines are made."""
STARVED = 2
"""Results after which there was no time for a step; with the next one it is done all the same, and a picture waits."""
HISTOGRAM = 64
THINNED = 2
"""Histograms count every second row and column."""


@dataclass(kw_only=True)
class Watching:
    """Looks at some of the rounds; ``lines`` are the judgements of the last few, ``histograms`` each light's counts,
    ``powers`` what to set each light's power to. A round is looked at in steps, and ``_took_s`` (by step) is what each
    cost."""

    plan: Plan
    rig: Rig | None = None
    spell: Callable[[str], str] = str
    lines: tuple[Judgement, ...] = ()
    histograms: dict[str, list[int]] = field(default_factory=dict)
    powers: dict[str, str] = field(default_factory=dict)
    _observed: Observed | None = None
    _step: int = 0
    _looked_s: float = float("-inf")
    _looking: Iterator[None] | None = None
    _place: int = 0
    _took_s: dict[int, float] = field(default_factory=dict)
    _passed: int = 0

    @property
    def busy(self) -> bool:
        """Whether a round is being looked at, for which there was no time yet."""
        return self._looking is not None

    def look(self, newest: NewestRound, plan: Plan, *, until_s: float = inf) -> None:
        """Go on with the round that is being looked at; or begin with this one, of a picture of the plan's size.

        A step is taken where it will be over at ``until_s``, on the monotonic clock, by what it took before.
        """
        if self._looking is None:
            if abs(newest.round.time_s - self._looked_s) < LOOK_S:
                return
            self._looked_s = newest.round.time_s
            self._looking, self._place = self._steps(newest, plan), 0
        while self._looking is not None:
            began_s, took_s = time.monotonic(), self._took_s.get(self._place, 0.0)
            if began_s + took_s > until_s and self._passed < STARVED:
                self._passed += 1
                return
            self._passed = 0
            for _ in self._looking:
                break
            else:
                self._looking = None
            self._took_s[self._place] = max(time.monotonic() - began_s, 0.5 * took_s)
            self._place += 1

    def _steps(self, newest: NewestRound, plan: Plan) -> Iterator[None]:
        """Look at a round, and judge once there are enough."""
        if self._observed is None or self._step != newest.step:
            self._step, self._observed = newest.step, self._fresh(plan, newest)
        observed = self._observed
        yield
        yield from observed.adding(newest.round, newest.surface)
        yield
        counts = {}
        for plate in newest.round.plates:
            counts[plate.light] = _counts(plate.picture.thinned(THINNED), plate.saturation)
            yield
        self.histograms = counts
        if len(observed.facts) >= ENOUGH:
            whole = replace(newest.timing, flashes=tuple(one for one in newest.timing.flashes if one.complete))
            found = judgements(plan, whole, observed, foretold=True)
            self.lines = tuple(one.spelled(self.spell) for one in found)
            self.powers = power_words(plan, observed)
            self._observed = None

    def _fresh(self, plan: Plan, newest: NewestRound) -> Observed:
        points = None
        size = {"height_px": plan.camera.height_px, "width_px": plan.camera.width_px}
        if self.rig is not None and all(light.direction is not None for light in self.rig.lights):
            channels = 1 if len(newest.round.plates[0].shape) == 2 else 3
            points = rig_points(plan, self.rig, channels=channels, **size)
        return Observed(lights=plan.lights, points=points, lens=Lens.of(self.rig, **size))


def _counts(thin: NDArray[np.float32], saturation: float) -> list[int]:
    """Return how many pixels of a plate are how bright, by their brightest channel: the last bin holds the clipped."""
    bright = brightest_channel(thin)
    place = np.clip(np.sqrt(np.clip(bright / saturation, 0, 1)) * (HISTOGRAM - 1), 0, HISTOGRAM - 1).astype(np.intp)
    return [int(count) for count in np.bincount(place.ravel(), minlength=HISTOGRAM)]


def told(status: LiveStatus | None, watching: Watching) -> dict[str, object]:
    """Return what a page says beside its pictures: how things stand, the gravest lines first, histograms by light."""
    lines = (*gravest_first(watching.lines), *(one for one in watching.lines if one.grade in ("good", "unknown")))
    return {
        "state": _told_state(status),
        "line": "" if status is None else status.line,
        "alarm": "Recording ended" if status is not None and status.record_ended else "",
        "compiling": "" if status is None else status.compiling,
        "notes": [] if status is None else [watching.spell(words) for words in status.all_words],
        "verdict": verdict_of(watching.lines) if watching.lines else "",
        "lines": [{"subject": one.subject, "grade": one.grade, "sentence": one.sentence} for one in lines],
        "histograms": watching.histograms,
        "powers": watching.powers,
        "lights": list(watching.plan.lights),
    }


def _told_state(status: LiveStatus | None) -> str:
    """Return the state as a page shows it: pictures of a source that fell silent are old, whatever they show."""
    if status is None:
        return "preparing"
    return "silent" if status.silent else status.state
