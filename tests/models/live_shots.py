"""Small shots whose strobe is followed live: what is shot, how it is taken, and how far found flashes are off."""

from collections.abc import Sequence

import numpy as np
from memory_frame import MemoryFrame

from psvideo.live.chain import Chain
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.model.rows.row_profiles import collect
from psvideo.model.timing import Timing
from psvideo.synth import Exposure, Noise, TrueClock, expose

FRAMES = 150
LIVE_ROWS = 0.05
"""So far may live and offline be apart, in rows."""


def plates_of(plan: Plan) -> dict[int, np.ndarray]:
    """Return a plate of chance for each of a plan's lit slots."""
    rng = np.random.default_rng(3)
    shape = plan.camera.height_px, plan.camera.width_px
    return {slot: (0.05 + 0.3 * rng.random(shape)).astype(np.float32) for slot in plan.lit_slots}


def shoot(plan: Plan, *, frames: int = FRAMES, clock: TrueClock | None = None, **options: object) -> Exposure:
    """Expose frames of 12 bits under a plan's strobe."""
    plates = options.pop("plates", plates_of(plan))
    clock = clock or TrueClock(phase_s=0.0123, offset_ppm=30.0)
    noise = Noise(full_well_e=20_000, read_e=8)
    return expose(plates, plan, frames=frames, clock=clock, noise=noise, bits=12, **options)  # type: ignore[arg-type]


def profiles_of(shot: Exposure) -> Doubles:
    """Return the row profiles of a shot's frames, (frame, row)."""
    return collect(MemoryFrame(n, image) for n, image in enumerate(shot.frames))[1]


def taken(chain: Chain, images: Sequence[np.ndarray]) -> Chain:
    """Return a chain after it took pictures, numbered from 0."""
    for index, image in enumerate(images):
        chain.take(LiveFrame(index=index, coded=MemoryFrame(index, image).coded, came_s=0.0))
    return chain


def apart_rows(one: Timing, start_s: Doubles, plan: Plan) -> Doubles:
    """Return how far every flash is from the nearest that starts at ``start_s``, in rows."""
    nearest = np.abs(start_s[:, None] - one.start_s).argmin(axis=0)
    apart: Doubles = (one.start_s - start_s[nearest]) / plan.camera.row_time_s
    return apart
