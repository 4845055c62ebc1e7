"""The newest result: the round that the latest frames hold whole, its plates, and the surface where there is a rig."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from psvideo.live.incoming.ring import RingFrame
from psvideo.live.showing.newest_round import LiveRounds
from psvideo.live.showing.smaller import smaller_plan, smaller_rig, smaller_timing
from psvideo.model.camera import Camera
from psvideo.model.coded import Coded
from psvideo.model.irradiance.intensity import lights_as_planned
from psvideo.model.plan import Plan
from psvideo.model.rig import Rig
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.surface import Subject, Surface
from psvideo.model.timing import Timing, timed_camera
from psvideo.plates.sequence import Round
from psvideo.solve.instants import surfaces
from psvideo.solve.near_surface import near_surface_of
from psvideo.solve.normals.solving import Solving

GRID_PX = 240
"""A live surface is judged at half as many points a side as one that stays: it is shown for a moment."""
LOOKED_AGAIN = 32
"""What the subject reflects beyond n . l is found again after this many rounds: finding it takes a few ms."""


@dataclass(frozen=True, kw_only=True)
class NewestRound:
    """The newest result: its plates, the surface where there is a rig, and when the last frame that showed it came.

    ``ended`` is that frame's place in time, ``frame`` the newest frame, at ``place``; ``step`` by how much pictures are
    smaller than the camera's.
    """

    round: Round
    surface: Surface | None
    came_s: float
    step: int
    timing: Timing
    frame: Coded
    place: int
    ended: int


@dataclass(kw_only=True)
class NewestResults:
    """Makes results of the latest frames. Kept from one to the next: rounds that are done, and what is known of the
    subject."""

    plan: Plan
    _rounds: LiveRounds | None = None
    _subject: Subject | None = None
    _solved: int = field(default=0)

    def of(self, frames: Mapping[int, RingFrame], timing: Timing, *, rig: Rig | None, step: int) -> NewestRound | None:
        """Return what the newest whole round gives, None where there is no new one.

        ``frames`` are by their places in time, made smaller by ``step``; ``timing`` is the camera's own.
        """
        plan = smaller_plan(self.plan, step)
        small = smaller_timing(timing, step, self.plan.camera.height_px)
        one = self._rounds_of(plan).newest({place: frame.coded for place, frame in frames.items()}, small)
        if one is None:
            return None
        last = max(frames)
        ended = min(_last_frame_of(one, timed_camera(plan, small), small), last)
        return NewestRound(
            round=one,
            surface=None if rig is None else self._surface(one, plan, smaller_rig(rig, step)),
            came_s=frames.get(ended, frames[last]).came_s,
            step=step,
            timing=small,
            frame=frames[last].coded,
            place=last,
            ended=ended,
        )

    def _rounds_of(self, plan: Plan) -> LiveRounds:
        """Return what makes rounds at this size; where the size changed, rounds are counted on."""
        if self._rounds is None or self._rounds.plan != plan:
            number = LiveRounds.number if self._rounds is None else self._rounds.number
            self._rounds = LiveRounds(plan=plan, number=number)
        return self._rounds

    def _surface(self, one: Round, plan: Plan, rig: Rig) -> Surface | None:
        """Return a round's surface. What the subject reflects is found now and then, and known in between."""
        camera, lights = plan.camera, lights_as_planned(rig, plan)
        near = near_surface_of(rig, lights, height_px=camera.height_px, width_px=camera.width_px)
        known = self._subject if self._solved % LOOKED_AGAIN else None
        solving = Solving(grid_px=GRID_PX, subject=known, metal=False)
        solved = surfaces([one], plan, rig, solving=solving, near=near, one_by_one=True)
        surface = next((instant.surface for instant in solved), None)
        if surface is not None:
            self._solved += 1
            if known is None:
                self._subject = None if surface.misfit is None else Subject(reflectance=surface.misfit.reflectance)
        return surface


def _last_frame_of(one: Round, camera: Camera, timing: Timing) -> int:
    """Return the place in time of the last frame that shows any light of a round."""
    time_s = max(plate.time_s for plate in one.plates)
    flash = min(timing.flashes, key=lambda flash: abs(flash.start_s + flash.duration_s / 2 - time_s))
    return int(frames_touched(camera, np.array([flash.start_s]), np.array([flash.duration_s]))[1][0])
