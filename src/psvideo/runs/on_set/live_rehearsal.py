"""A rehearsal before the first frame: what live does is done once with made-up frames, so that what it needs is
loaded, or compiled where nothing is kept yet, before a source is opened whose frames do not wait."""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from psvideo.live.chain import Chain
from psvideo.live.following.lock import frames_to_lock
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.live.incoming.source import LiveSource
from psvideo.live.showing.newest_pictures import NewestPictures
from psvideo.live.showing.smaller import smaller_plan
from psvideo.live.watching import ENOUGH, LOOK_S, Watching
from psvideo.model.camera import Camera
from psvideo.model.coded import Coded
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Rig
from psvideo.model.timing import timed_camera
from psvideo.runs.steps.small_pictures import RING, SmallPictures
from psvideo.synth.camera.exposure import expose
from psvideo.synth.camera.noise import Noise

FEWEST = 3
"""Lights that give normals, which a click on a ball may ask for."""

PLANE = 2
"""Dimensions of a grey picture, or a mosaic."""


def rehearse(source: LiveSource, rig: Rig | None, *, step: int, page: bool) -> None:
    """Follow, solve, and with ``page`` judge and pack made-up frames of the kind that a source is likely to give.

    ``step``: by how much pictures are made smaller at first. What comes of it goes nowhere.
    """
    near = rig is not None and any(light.position_m is not None for light in rig.lights)
    lights = min(max(len(source.plan.lights), FEWEST), len(RING))
    small = SmallPictures(lights=lights, colour=len(source.kind.shape) > PLANE, near=near)
    plan = _plan(source.plan, small, step)
    chain = Chain(plan=plan, cfa=source.cfa, rig=small.rig, step=step)
    pictures, watching = NewestPictures(), Watching(plan=plan, rig=small.rig)
    for frame in _frames(source.kind, plan, small, step):
        chain.take(frame)
        newest = chain.solve()
        if newest is not None and page:
            shown = smaller_plan(plan, newest.step)
            pictures.put(newest, timed_camera(shown, newest.timing))
            pictures.packed("")
            watching.look(newest, shown)


def _plan(plan: Plan, small: SmallPictures, step: int) -> Plan:
    """Return a plan of one flash for every light and a dark slot, on a slow camera of a small picture: its rounds are
    far enough apart for each to be judged."""
    flashes = len(small.rig.lights) + 1
    fps = Fraction(int(flashes / LOOK_S))
    period_s = float(1 / fps)
    camera = Camera(
        width_px=small.size_px * step,
        height_px=small.size_px * step,
        fps=fps,
        exposure_s=period_s,
        readout_s=0.97 * period_s,
        encoding=plan.camera.encoding,
    )
    lit = [PlannedFlash(lights={light.name: 1.0}, duration_s=0.1 * period_s) for light in small.rig.lights]
    dark = PlannedFlash(lights={}, duration_s=0.1 * period_s)
    return Plan(camera=camera, flashes=(*lit, dark), dark_s=1.05 * period_s)


def _frames(kind: Coded, plan: Plan, small: SmallPictures, step: int) -> Iterator[LiveFrame]:
    """Yield frames of the small pictures under the plan's flashes, coded as the few pixels ``kind`` are."""
    count = frames_to_lock(plan) + (ENOUGH + 1) * len(plan.flashes)
    plates = [np.repeat(np.repeat(one, step, 0), step, 1) for one in _with_shadows(small.images)]
    shot = expose(plates, plan, frames=count, ambient=0.02, noise=Noise(full_well_e=10_000, read_e=5))
    light = _light_of_codes(kind)
    for index, image in enumerate(shot.frames):
        codes = image if light is None else np.searchsorted(light[:-1], image).astype(kind.codes.dtype)
        yield LiveFrame(index=index, coded=replace(kind, codes=codes), came_s=0.0)


def _with_shadows(images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return plates of which a corner is dark, and beside it a part that two lights alone reach: it is to be filled."""
    shadowed, quarter = images.copy(), images.shape[1] // 4
    shadowed[:, :quarter, :quarter] = 0
    shadowed[2:, :quarter, quarter : 2 * quarter] = 0
    return shadowed


def _light_of_codes(kind: Coded) -> NDArray[np.float32] | None:
    """Return the light of every code, rising; None for floats."""
    if kind.codes.dtype.kind == "f":
        return None
    codes = np.arange(1 << 8 * kind.codes.dtype.itemsize, dtype=kind.codes.dtype)[:, None]
    return np.maximum.accumulate(replace(kind, codes=codes).light()[:, 0])
