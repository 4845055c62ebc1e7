"""Light from the traced edges of a strobe controller, instead of a plan's ideal train: what was really switched.

The edges come in cycles of the controller's clock; ``traced_slots`` says which belong to which flash of the plan. Here
they become flashes in camera time, with their bursts as they are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.trace_csv import Trace, merged_pulses, read_trace
from psvideo.model.plan import Plan
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.lamps.traced_slots import Pulse, Wired, check_lines, flash_pulses, wired_lines
from psvideo.synth.lamps.true_flashes import TrueClock, TrueFlash, clip_end_s, is_complete
from psvideo.synth.scene import Scene


@dataclass(frozen=True, kw_only=True)
class TraceOptions:
    """A trace to film by: its file, and the line of each light where it is not its place in the plan's order."""

    path: Path
    lines: Mapping[str, int]


@dataclass(frozen=True, kw_only=True)
class TracedLight:
    """Flashes as they happened, and ``parts``: the same flash by flash, split where lights of one differ in bursts.

    ``first_cycle`` is the controller's cycle of the first edge, which is at ``clock.phase_s`` on the camera's clock.
    """

    trace: Trace
    clock: TrueClock
    first_cycle: int
    flashes: tuple[TrueFlash, ...]
    parts: tuple[TrueFlash, ...]


def traced_light(scene: Scene, plan: Plan, clock: TrueClock, options: TraceOptions) -> TracedLight:
    """Return the light of a clip from a trace, in camera time.

    The first edge falls on the scene's ``phase_s``; where the scene leaves it open, on a moment drawn from its seed
    such that the clip lies within the run, if the run is long enough. Raises PsvideoError where trace and plan do not
    fit.
    """
    _refuse_unfit(scene, plan)
    trace = read_trace(options.path)
    wired = wired_lines(plan, options.lines)
    pulses = list(merged_pulses(trace, trace.lights))
    check_lines(options.path, trace, wired)
    if not pulses:
        raise PsvideoError(f"{options.path}: no light was ever on in this run. Emulate a run with flashes.")
    first = pulses[0][0]
    if scene.strobe.phase_s is None:
        clock = replace(clock, phase_s=_drawn_phase_s(scene, plan, clock, (pulses[-1][1] - first) / trace.hz))
    maker = _Maker(plan=plan, trace=trace, clock=clock, first=first, wired=wired)
    made = [maker.flash(slot, group) for slot, group in flash_pulses(options.path, plan, trace, wired, pulses)]
    flashes = _seen(plan, scene, _with_dark_slots(plan, clock, [whole for whole, _ in made]))
    parts_of = {whole.start_s: parts for whole, parts in made}
    return TracedLight(
        trace=trace,
        clock=clock,
        first_cycle=first,
        flashes=flashes,
        parts=tuple(
            replace(part, index=flash.index, complete=flash.complete)
            for flash in flashes
            for part in parts_of.get(flash.start_s, ())
        ),
    )


def _refuse_unfit(scene: Scene, plan: Plan) -> None:
    if plan.mode == "synced":
        raise UsageError("`trace`: this scene's camera triggers its flashes (mode synced), so no trace can drive them.")
    if scene.strobe.jitter_s > 0:
        raise UsageError(
            f"`trace`: the scene has jitter_s = {scene.strobe.jitter_s:g}, but a trace says itself when every flash "
            "comes. Leave jitter_s out of the scene."
        )


def _drawn_phase_s(scene: Scene, plan: Plan, clock: TrueClock, run_s: float) -> float:
    spare_s = run_s - clip_end_s(plan.camera, scene.frames)
    if spare_s > 0:
        return float(-np.random.default_rng([scene.seed, 3]).uniform(0.0, spare_s))
    return clock.phase_s


@dataclass(frozen=True, kw_only=True)
class _Maker:
    """Turns pulses in cycles into flashes in camera time."""

    plan: Plan
    trace: Trace
    clock: TrueClock
    first: int
    wired: Wired

    def flash(self, slot: int, group: Sequence[Pulse]) -> tuple[TrueFlash, tuple[TrueFlash, ...]]:
        """Return a flash as a whole, and its parts of lights that burst alike."""
        start, end = group[0][0], max(off for _, off, _ in group)
        trains = {line: [(on, off) for on, off, its in group if its == line] for _, _, line in group}
        alike: dict[tuple[tuple[int, int], ...], list[str]] = {}
        for line, train in trains.items():
            alike.setdefault(tuple(train), []).extend(self.wired[line])
        parts = tuple(self._part(slot, start, end, train, names) for train, names in alike.items())
        powers = {name: power for part in parts for name, power in part.lights.items()}
        return replace(parts[0], lights=powers), parts

    def _part(
        self, slot: int, start: int, end: int, train: Sequence[tuple[int, int]], names: Sequence[str]
    ) -> TrueFlash:
        at_s = self.clock.camera_time_s((np.array([[start, end], *train], np.float64) - self.first) / self.trace.hz)
        start_s, end_s = at_s[0]
        given = sum(off - on for on, off in train) / self.trace.hz
        power = given / self.plan.flashes[slot].duration_s
        whole = len(train) == 1 and train[0] == (start, end)
        return TrueFlash(
            index=0,
            slot=slot,
            lights=dict.fromkeys(names, power),
            start_s=float(start_s),
            duration_s=float(end_s - start_s),
            complete=False,
            bursts_s=() if whole else tuple((float(on - start_s), float(off - on)) for on, off in at_s[1:]),
        )


def _with_dark_slots(plan: Plan, clock: TrueClock, flashes: Sequence[TrueFlash]) -> list[TrueFlash]:
    """Put the dark slots in, which leave no edge: where the plan has them, before the flash that follows."""
    cycle, rate = plan.cycle_slots, float(clock.rate(np.array(0.0)))
    found: list[TrueFlash] = []
    place = -1
    for flash in flashes:
        ahead = [(place + k) % len(cycle) for k in range(1, len(cycle) + 1)]
        step = next(k for k, there in enumerate(ahead) if cycle[there] == flash.slot)
        skipped = [cycle[there] for there in ahead[:step]]
        if not all(plan.flashes[slot].is_dark for slot in skipped):
            skipped = []  # a new run
        place = ahead[step]
        at_s = flash.start_s - rate * sum(plan.flashes[slot].duration_s + plan.dark_s for slot in skipped)
        for slot in skipped:
            duration_s = rate * plan.flashes[slot].duration_s
            found.append(replace(flash, slot=slot, lights={}, start_s=at_s, duration_s=duration_s, bursts_s=()))
            at_s += duration_s + rate * plan.dark_s
        found.append(flash)
    return found


def _seen(plan: Plan, scene: Scene, flashes: Sequence[TrueFlash]) -> tuple[TrueFlash, ...]:
    """Number the flashes that give light while the clip records, and say which are complete."""
    emission = Emission(rise_s=plan.rise_s, fall_s=plan.fall_s)
    end_s = clip_end_s(plan.camera, scene.frames)
    recorded = np.array([n for n in range(scene.frames) if n not in scene.dropped], np.intp)
    seen = [f for f in flashes if f.start_s + emission.lasts_s(f.duration_s) > 0 and f.start_s < end_s]
    return tuple(
        replace(
            flash,
            index=index,
            complete=is_complete(plan.camera, emission, flash.start_s, flash.duration_s, recorded),
        )
        for index, flash in enumerate(seen)
    )
