"""The verdict lines of check while the camera runs: of the last second or two, by the same judgements."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.live.chain import NewestRound
from psvideo.live.status import LiveStatus
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.report.judge.every_line import judgements
from psvideo.report.judge.powers import power_words
from psvideo.report.judgement import Judgement, gravest_first, verdict_of
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rigpoints import rig_points
from psvideo.report.observe.yuille1997 import Lens

LOOK_S = 0.4
"""So far apart are rounds that are looked at, in the footage's time: to look costs as much as to solve."""
ENOUGH = 4
"""Rounds by which the lines are made."""
HISTOGRAM = 64


@dataclass(kw_only=True)
class Watching:
    """Looks at some of the rounds; ``lines`` are the judgements of the last few, ``histograms`` each light's counts,
    ``powers`` what to set each light's power to."""

    plan: Plan
    rig: Rig | None = None
    spell: Callable[[str], str] = str
    lines: tuple[Judgement, ...] = ()
    histograms: dict[str, list[int]] = field(default_factory=dict)
    powers: dict[str, str] = field(default_factory=dict)
    _observed: Observed | None = None
    _step: int = 0
    _looked_s: float = float("-inf")

    def look(self, newest: NewestRound, plan: Plan) -> None:
        """Look at a round of a picture of the plan's size, and judge once there are enough."""
        if abs(newest.round.time_s - self._looked_s) < LOOK_S:
            return
        self._looked_s = newest.round.time_s
        if self._observed is None or self._step != newest.step:
            self._step, self._observed = newest.step, self._fresh(plan, newest)
        self._observed.add(newest.round, newest.surface)
        self.histograms = {plate.light: _counts(plate.image, plate.saturation) for plate in newest.round.plates}
        if len(self._observed.facts) >= ENOUGH:
            whole = replace(newest.timing, flashes=tuple(one for one in newest.timing.flashes if one.complete))
            found = judgements(plan, whole, self._observed)
            self.lines = tuple(one.spelled(self.spell) for one in found)
            self.powers = power_words(plan, self._observed)
            self._observed = None

    def _fresh(self, plan: Plan, newest: NewestRound) -> Observed:
        points = None
        size = {"height_px": plan.camera.height_px, "width_px": plan.camera.width_px}
        if self.rig is not None and all(light.direction is not None for light in self.rig.lights):
            channels = 1 if len(newest.round.plates[0].shape) == 2 else 3
            points = rig_points(plan, self.rig, channels=channels, **size)
        return Observed(lights=plan.lights, points=points, lens=Lens.of(self.rig, **size))


def _counts(image: NDArray[np.float32], saturation: float) -> list[int]:
    """Return how many pixels of a plate are how bright, by their brightest channel: the last bin holds the clipped."""
    thin = image[::2, ::2]
    bright = thin if thin.ndim == 2 else thin.max(axis=2)
    place = np.clip(np.sqrt(np.clip(bright / saturation, 0, 1)) * (HISTOGRAM - 1), 0, HISTOGRAM - 1).astype(np.intp)
    return [int(count) for count in np.bincount(place.ravel(), minlength=HISTOGRAM)]


def told(status: LiveStatus | None, watching: Watching) -> dict[str, object]:
    """Return what a page says beside its pictures: how things stand, the gravest lines first, histograms by light."""
    lines = (*gravest_first(watching.lines), *(one for one in watching.lines if one.grade in ("good", "unknown")))
    return {
        "state": "preparing" if status is None else status.state,
        "line": "" if status is None else status.line,
        "compiling": "" if status is None else status.compiling,
        "notes": [] if status is None else [watching.spell(words) for words in status.all_words],
        "verdict": verdict_of(watching.lines) if watching.lines else "",
        "lines": [{"subject": one.subject, "grade": one.grade, "sentence": one.sentence} for one in lines],
        "histograms": watching.histograms,
        "powers": watching.powers,
        "lights": list(watching.plan.lights),
    }
