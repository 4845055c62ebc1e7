"""Live: processor time of every frame and of every result, a mosaic of 8 bits under four lights, by stage."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from typing import TypeVar

import numpy as np

from bench.table import Row
from psvideo.live.chain import LiveFrame, NewestRound
from psvideo.live.follow import caught_up
from psvideo.live.history import timing_now
from psvideo.live.lock import frames_to_lock, lock
from psvideo.live.newest_pictures import NewestPictures
from psvideo.live.newest_round import LiveRounds
from psvideo.live.ring import RingFrame, ring_of
from psvideo.live.smaller import Smaller, smaller_plan, smaller_timing
from psvideo.live.watching import EVERY, Watching
from psvideo.model.camera import Camera
from psvideo.model.coded import Coded, Tone
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig
from psvideo.model.row_profiles import row_light
from psvideo.model.timing import timed_camera
from psvideo.solve.instants import surfaces
from psvideo.solve.normals.solving import Solving
from psvideo.synth import Noise, TrueClock, expose

Given = TypeVar("Given")
DIRECTIONS = {"key": (0.48, 0.36, 0.8), "left": (-0.6, 0.0, 0.8), "top": (0.0, 0.6, 0.8), "low": (0.0, -0.6, 0.8)}
TONE = Tone(zero=np.full((1, 1), 4.0), gain=np.full((1, 1), 1 / 251))
FRAMES = 72
MODES = ((1280, 720, 120, 15, 2), (1920, 1080, 60, 10, 4))
"""Width, height, frames a second, results a second that are asked for, and by how much the picture is made smaller."""


@dataclass(kw_only=True)
class Spent:
    """Processor seconds by stage, of one call after the other."""

    each_s: dict[str, list[float]] = field(default_factory=dict)

    def on(self, stage: str, action: Callable[[], Given]) -> Given:
        """Do something, and note what it cost, all threads together."""
        began = time.process_time()
        given = action()
        self.each_s.setdefault(stage, []).append(time.process_time() - began)
        return given

    def mean_s(self, stage: str) -> float:
        """Return a stage's mean cost, its first call, which may compile, left out."""
        return float(np.mean(self.each_s[stage][1:]))


def rows() -> Iterator[Row]:
    """Run every stage of the chain on two modes, and add up what a second of footage costs."""
    for width_px, height_px, fps, results, step in MODES:
        spent = _spent(width_px, height_px, fps, step)
        name = f"{width_px} x {height_px} at {fps}"
        for stage in ("row profiles", "made smaller", "clock followed"):
            yield Row(f"{name}: a frame, {stage}", f"{1e3 * spent.mean_s(stage):.2f} ms", "", None)
        for stage in ("plates and normals", "packed for the page", "judged (every fourth)"):
            yield Row(f"{name}: a result, {stage}", f"{1e3 * spent.mean_s(stage):.1f} ms", "", None)
        frame_s = sum(spent.mean_s(stage) for stage in ("row profiles", "made smaller", "clock followed"))
        result_s = spent.mean_s("plates and normals") + spent.mean_s("packed for the page")
        result_s += spent.mean_s("judged (every fourth)") / EVERY
        second = fps * frame_s + results * result_s
        words = f"{name}: a second, {results} results of {width_px // step} x {height_px // step}"
        yield Row(words, f"{second:.2f} processor seconds", "<= 2", second <= 2)
        yield Row(
            f"{name}: the strobe found, once",
            f"{spent.each_s['lock'][-1]:.2f} s",
            "<= 2 s",
            spent.each_s["lock"][-1] <= 2,
        )


def _spent(width_px: int, height_px: int, fps: int, step: int) -> Spent:
    plan = _plan(width_px, height_px, fps)
    frames, spent = _frames(plan), Spent()
    rig = Rig(lights=tuple(Light(name=name, direction=at) for name, at in DIRECTIONS.items()))
    small, rounds = smaller_plan(plan, step), LiveRounds(plan=smaller_plan(plan, step))
    watching, pictures = Watching(plan=plan, rig=rig), NewestPictures()
    profiles = np.stack([row_light(frame.coded)[0] for frame in frames])
    first = frames_to_lock(plan)
    for _ in range(2):
        found = spent.on("lock", lambda: lock(plan, np.arange(first), profiles[:first]))
    follower, ring, smaller = (
        caught_up(plan, found, list(profiles[:first])),
        ring_of(plan),
        Smaller(step=step, cfa="RGGB"),
    )
    for frame in frames:
        mean, _ = spent.on("row profiles", partial(row_light, frame.coded))
        coded = spent.on("made smaller", partial(smaller.of, frame.coded))
        if frame.index >= first:
            spent.on("clock followed", partial(follower.add, frame.index, mean))
        ring.add(frame.index, RingFrame(coded=coded, came_s=0.0))
        timing = smaller_timing(timing_now(follower, (min(ring.frames), max(ring.frames))), step, height_px)
        held = {place: one.coded for place, one in ring.frames.items()}
        began = time.process_time()
        one = rounds.newest(held, timing)
        if one is None:
            continue
        surface = next(surfaces([one], small, rig, solving=Solving(), one_by_one=True)).surface
        spent.each_s.setdefault("plates and normals", []).append(time.process_time() - began)
        newest = NewestRound(
            round=one, surface=surface, came_s=0.0, step=step, timing=timing, frame=coded, place=frame.index
        )
        pictures.put(newest, timed_camera(small, timing))
        spent.on("packed for the page", partial(pictures.packed, "key"))
        watching._passed = EVERY - 1
        spent.on("judged (every fourth)", partial(watching.look, newest, small))
    return spent


def _plan(width_px: int, height_px: int, fps: int) -> Plan:
    camera = Camera(width_px=width_px, height_px=height_px, fps=Fraction(fps), exposure_s=1 / fps, readout_s=0.97 / fps)
    flashes = [PlannedFlash(lights={name: 1.0}, duration_s=0.1 / fps) for name in DIRECTIONS]
    flashes.append(PlannedFlash(lights={}, duration_s=0.1 / fps))
    return Plan(camera=camera, flashes=tuple(flashes), dark_s=1.002 / fps)


def _frames(plan: Plan) -> list[LiveFrame]:
    """Return frames of a relief under the plan's lights: a mosaic in 8 bits, black at 4."""
    rows, cols = plan.camera.height_px, plan.camera.width_px
    y, x = np.mgrid[0:rows, 0:cols].astype(np.float32) * (9.0 / rows)
    normals = np.stack([0.4 * np.sin(3 * x), 0.4 * np.cos(2 * y), np.ones_like(x)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    lit = [0.8 * np.maximum(normals @ np.array(at, np.float32), 0) for at in DIRECTIONS.values()]
    plates = {slot: lit[slot].astype(np.float32) for slot in plan.lit_slots}
    noise = Noise(full_well_e=10_000, read_e=5)
    clock = TrueClock(phase_s=0.003, offset_ppm=25.0)
    shot = expose(plates, plan, frames=FRAMES, clock=clock, ambient=0.02, noise=noise)
    return [
        LiveFrame(
            index=place,
            coded=Coded(codes=np.clip(np.rint(image * 251 + 4), 0, 255).astype(np.uint8), tone=TONE),
            came_s=0.0,
        )
        for place, image in enumerate(shot.frames)
    ]
