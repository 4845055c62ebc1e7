"""Which instants of a clip are shown at a rate of its own, and from which round each is made.

Instant ``k`` is ``first_s + k / fps`` on the camera's clock, exactly, or on the clock of the first of several cameras,
where all are to show the same instants; its file has the number ``start + k``. An instant belongs to the whole round
whose middle is nearest: then every light flashed before and after it, in that round and one beside it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from psvideo.errors import UsageError
from psvideo.model.camera import Camera
from psvideo.model.camera_clocks import CameraClock, CameraClocks
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash
from psvideo.plates.sequence import coming, round_numbers

SAMPLES = 15
"""Instants of one opening, the middle one among them: what moves by this many pixels in it is blurred without steps."""
MOST_DEG = 360.0
REACH = 0.75
"""Of a round's length: what is farther from the middle of any whole round is shown by none, beside a hole."""


@dataclass(frozen=True, kw_only=True)
class Comb:
    """Instants at a steady rate: number ``k``, from 0, is at ``first_s + k / fps`` on the camera's clock.

    ``open_s`` is how long a shutter is to be open about each, 0 where results are to be sharp. ``clock`` is the
    camera's against another one's, on whose clock the instants are then steady. ``only`` are the instants that are
    shown, ``k`` ascending, where not all of them are.
    """

    fps: Fraction
    first_s: float
    open_s: float = 0.0
    clock: CameraClock | None = None
    only: tuple[int, ...] | None = None

    def time_s(self, k: int) -> float:
        """Return instant ``k`` in seconds on the camera's clock."""
        return self._on_camera(self.first_s + float(k / self.fps))

    def samples_s(self, k: int) -> list[float]:
        """Return the instants that instant ``k`` is made of: itself, or those of an opening about it, ascending."""
        if not self.open_s:
            return [self.time_s(k)]
        steady_s = self.first_s + float(k / self.fps)
        return [self._on_camera(steady_s + self.open_s * ((j - SAMPLES // 2) / SAMPLES)) for j in range(SAMPLES)]

    def count_until(self, end_s: float) -> int:
        """Return how many instants come up to a time on the camera's clock."""
        steady_s = end_s if self.clock is None else float(self.clock.reference_s(np.float64(end_s)))
        return max(int((steady_s - self.first_s) * self.fps) + 1, 0)

    def _on_camera(self, steady_s: float) -> float:
        return steady_s if self.clock is None else float(self.clock.camera_s(np.float64(steady_s)))


def comb_of(
    fps: Fraction,
    camera: Camera,
    *,
    shutter_deg: float | None = None,
    clocks: CameraClocks | None = None,
    clip: str = "",
) -> Comb:
    """Return the instants of a rate, the first in the middle of the clip's first frame: of its middle row's exposure.

    ``shutter_deg`` opens a shutter about each. With ``clocks`` they are those of the reference's clip, seen by the
    ``clip`` of that name: all cameras show the same instants under the same numbers. Raises UsageError where a rate is
    above the camera's, where an angle is none, and where the clocks are others'.
    """
    if shutter_deg is not None and not 0 < shutter_deg <= MOST_DEG:
        raise UsageError(f"`shutter` {shutter_deg:g}: expected an angle above 0 and up to {MOST_DEG:g} degrees.")
    if fps > camera.fps:
        raise UsageError(
            f"`fps` {fps}: the camera took {camera.fps} frames a second, and nothing more often can be known of the "
            "scene. Give at most that, or `fps` frame."
        )
    open_s = (shutter_deg or 0.0) / MOST_DEG / float(fps)
    if clocks is None:
        return Comb(fps=fps, first_s=camera.middle_s, open_s=open_s)
    return Comb(fps=fps, first_s=clocks.first_instant_s, open_s=open_s, clock=clocks.of(clip))


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """The instants that are shown, (number, time in seconds), by round; ``left_out``, how many of the comb before
    the first, within holes, and after the last instant lack a round; and how many whole ``rounds`` there are."""

    by_round: Mapping[int, tuple[tuple[int, float], ...]]
    left_out: tuple[int, int, int]
    rounds: int

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers of all instants that are shown, ascending."""
        return tuple(dict.fromkeys(number for instants in self.by_round.values() for number, _ in instants))


def schedule_of(
    plan: Plan,
    flashes: tuple[Flash, ...],
    comb: Comb,
    *,
    start: int,
    end_s: float,
    within: tuple[Flash, ...] | None = None,
) -> Schedule:
    """Return which instants up to ``end_s``, where the clip ends, are shown from which round.

    ``within`` are the same flashes, complete where the frames that are used hold them.
    """
    lights = coming(plan, flashes, start=start, within=within)
    times_s: dict[int, list[float]] = {}
    for flash, number in zip(within or flashes, round_numbers(flashes, start=start), strict=True):
        if flash.complete and flash.lit and lights[number] >= {*plan.lights}:
            times_s.setdefault(number, []).append(flash.start_s + 0.5 * flash.duration_s)
    count = comb.count_until(end_s)
    shown = range(count) if comb.only is None else comb.only
    if not times_s:
        return Schedule(by_round={}, left_out=(len(shown), 0, 0), rounds=0)
    numbers = list(times_s)
    middles_s = np.array([np.mean(times) for times in times_s.values()])
    reach_s = REACH * plan.cycle_s / len(plan.dark_rounds)
    first_s, last_s = min(times_s[numbers[0]]), max(times_s[numbers[-1]])
    by_round: dict[int, list[tuple[int, float]]] = {}
    left_out = [0, 0, 0]
    for k in shown:
        times = np.array(comb.samples_s(k))
        nearest = np.abs(middles_s - times[:, None]).argmin(axis=1)
        where = 0 if times[0] < first_s else 2 if times[-1] > last_s else 1
        if where == 1 and (np.abs(middles_s[nearest] - times) <= reach_s).all():
            for place, time_s in zip(nearest, times, strict=True):
                by_round.setdefault(numbers[int(place)], []).append((start + k, float(time_s)))
        else:
            left_out[where] += 1
    return Schedule(
        by_round={number: tuple(instants) for number, instants in by_round.items()},
        left_out=(left_out[0], left_out[1], left_out[2]),
        rounds=len(times_s),
    )
