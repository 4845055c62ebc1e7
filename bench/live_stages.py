"""What every stage of the live chain costs by itself: processor time of every frame and of every result."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from bench.live_scene import CFA, coded, frames, plan_of, rig
from bench.table import Row
from psvideo.live.following.catching_up import caught_up
from psvideo.live.following.history import timing_now
from psvideo.live.following.lock import frames_to_lock, lock
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.live.incoming.ring import RingFrame, ring_of
from psvideo.live.showing.newest_pictures import NewestPictures
from psvideo.live.showing.newest_result import GRID_PX, NewestRound
from psvideo.live.showing.newest_round import LiveRounds
from psvideo.live.showing.smaller import Smaller, smaller_plan, smaller_timing
from psvideo.live.watching import LOOK_S, Watching
from psvideo.model.camera import Camera
from psvideo.model.rows.row_profiles import row_light
from psvideo.model.timing import timed_camera
from psvideo.solve.instants import surfaces
from psvideo.solve.normals.solving import Solving

Given = TypeVar("Given")
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

    def usual_s(self, stage: str) -> float:
        """Return what a stage usually costs: the median, as its first calls may compile."""
        return float(np.median(self.each_s[stage]))


def rows() -> Iterator[Row]:
    """Run every stage of the chain on two modes, and add up what a second of footage costs."""
    for width_px, height_px, fps, results, step in MODES:
        spent = _spent(width_px, height_px, fps, step)
        name = f"{width_px} x {height_px} at {fps}"
        for stage in ("row profiles", "made smaller", "clock followed"):
            yield Row(f"{name}: a frame, {stage}", f"{1e3 * spent.usual_s(stage):.2f} ms", "", None)
        for stage in ("plates and normals", "packed for the page", "judged (now and then)"):
            yield Row(f"{name}: a result, {stage}", f"{1e3 * spent.usual_s(stage):.1f} ms", "", None)
        frame_s = sum(spent.usual_s(stage) for stage in ("row profiles", "made smaller", "clock followed"))
        result_s = spent.usual_s("plates and normals") + spent.usual_s("packed for the page")
        judged_s = spent.usual_s("judged (now and then)") / LOOK_S
        second = fps * frame_s + results * result_s + judged_s
        words = f"{name}: a second, {results} results of {width_px // step} x {height_px // step}"
        yield Row(words, f"{second:.2f} processor seconds", "<= 2", second <= 2)
        yield Row(
            f"{name}: the strobe found, once",
            f"{spent.each_s['lock'][-1]:.2f} s",
            "<= 2 s",
            spent.each_s["lock"][-1] <= 2,
        )


def _spent(width_px: int, height_px: int, fps: int, step: int) -> Spent:
    plan, known, spent = plan_of(width_px, height_px, fps), rig(), Spent()
    filmed = [LiveFrame(index=n, coded=coded(codes), came_s=0.0) for n, codes in enumerate(frames(plan, FRAMES))]
    small, rounds = smaller_plan(plan, step), LiveRounds(plan=smaller_plan(plan, step))
    watching, pictures = Watching(plan=plan, rig=known), NewestPictures()
    profiles = np.stack([row_light(frame.coded)[0] for frame in filmed])
    first = frames_to_lock(plan)
    for _ in range(2):
        found = spent.on("lock", lambda: lock(plan, np.arange(first), profiles[:first]))
    follower, ring, smaller = (
        caught_up(plan, found, list(profiles[:first])),
        ring_of(plan),
        Smaller(step=step, cfa=CFA),
    )
    for frame in filmed:
        mean, _ = spent.on("row profiles", partial(row_light, frame.coded))
        thinner = spent.on("made smaller", partial(smaller.of, frame.coded))
        if frame.index >= first:
            spent.on("clock followed", partial(follower.add, frame.index, mean))
        ring.add(frame.index, RingFrame(coded=thinner, came_s=0.0))
        timing = smaller_timing(timing_now(follower, (min(ring.frames), max(ring.frames))), step, height_px)
        held = {place: one.coded for place, one in ring.frames.items()}
        began = time.process_time()
        one = rounds.newest(held, timing)
        if one is None:
            continue
        surface = next(surfaces([one], small, known, solving=Solving(grid_px=GRID_PX), one_by_one=True)).surface
        spent.each_s.setdefault("plates and normals", []).append(time.process_time() - began)
        newest = NewestRound(
            round=one,
            surface=surface,
            came_s=0.0,
            step=step,
            timing=timing,
            frame=thinner,
            place=frame.index,
            ended=frame.index,
        )
        spent.on("packed for the page", partial(_show, pictures, newest, timed_camera(small, timing)))
        watching._looked_s = float("-inf")
        spent.on("judged (now and then)", partial(watching.look, newest, small))
    return spent


def _show(pictures: NewestPictures, newest: NewestRound, camera: Camera) -> None:
    """What a page asked for before is packed as a result is put in, the first time as it is asked for."""
    pictures.put(newest, camera)
    pictures.packed("key")
