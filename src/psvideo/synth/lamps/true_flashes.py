"""When the virtual strobe's flashes really happen, in seconds of the camera's clock.

The strobe plays the plan on a clock of its own that started at an unknown moment, runs a little fast or slow, may drift
as it warms up, and may jitter. What stands here is the truth that finding the timing is measured against.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.camera import Camera
from psvideo.model.plan import FlashTrain, HasLights, Plan
from psvideo.synth.lamps.emission import Bursts, Emission

TAIL_LOST = 1e-3
"""A flash with a tail is complete when no row lost more of its light; the last of a tail never ends."""


NEWTON_STEPS = 4
"""Clocks are nearly straight: each step squares what is left of a thousandth."""


@dataclass(frozen=True, kw_only=True)
class TrueClock:
    """The strobe's clock against the camera's.

    ``phase_s`` is when a cycle begins, on the camera's clock. A strobe second lasts ``1 + offset_ppm * 1e-6`` camera
    seconds at that moment, and ``drift_ppm_per_s`` more with every second; ``jitter_s`` is the standard deviation by
    which each flash starts early or late.
    """

    phase_s: float = 0.0
    offset_ppm: float = 0.0
    drift_ppm_per_s: float = 0.0
    jitter_s: float = 0.0
    seed: int = 0

    def camera_time_s(self, strobe_s: Doubles) -> Doubles:
        """Return strobe seconds since the cycle's begin as times on the camera's clock, without jitter."""
        drift = 0.5e-6 * self.drift_ppm_per_s * strobe_s**2
        return self.phase_s + strobe_s * (1.0 + self.offset_ppm * 1e-6) + drift

    def strobe_time_s(self, camera_s: Doubles) -> Doubles:
        """Return times on the camera's clock as strobe seconds since the cycle's begin: ``camera_time_s`` reversed."""
        strobe_s = np.asarray(camera_s - self.phase_s, np.float64)
        for _ in range(NEWTON_STEPS):
            strobe_s = strobe_s - (self.camera_time_s(strobe_s) - camera_s) / self.rate(strobe_s)
        return strobe_s

    def rate(self, strobe_s: Doubles) -> Doubles:
        """Return how many camera seconds a strobe second lasts at the given strobe times."""
        return 1.0 + (self.offset_ppm + self.drift_ppm_per_s * strobe_s) * 1e-6


@dataclass(frozen=True, kw_only=True)
class TrueFlash(HasLights):
    """One flash as it happened: ``index`` from 0 for the clip's first, times on the camera's clock.

    ``complete``: no light of it was lost before the clip's first frame, after its last, or in a dropped one.
    ``bursts_s`` are starts (after the flash's) and lengths where the light is not on throughout.
    """

    index: int
    slot: int
    lights: Mapping[str, float]
    start_s: float
    duration_s: float
    complete: bool
    bursts_s: Bursts = ()

    @property
    def middle_s(self) -> float:
        """The instant that the flash shows."""
        return self.start_s + 0.5 * self.duration_s


def row_opens_s(camera: Camera) -> Doubles:
    """Return when each row of a frame opens after the frame's first row, shape (row,), never negative.

    Rows follow one another by readout / height: downwards from the top row, or upwards from the bottom row where the
    readout time is negative.
    """
    step_s = abs(camera.row_time_s)
    order = np.arange(camera.height_px, dtype=np.float64)
    return step_s * (order if camera.row_time_s >= 0 else order[::-1])


def clip_end_s(camera: Camera, frames: int) -> float:
    """Return when the last row of a clip's last frame closes."""
    return (frames - 1) * camera.frame_period_s + float(row_opens_s(camera).max()) + camera.exposure_s


def true_flashes(
    plan: Plan, clock: TrueClock, *, frames: int, dropped: frozenset[int] = frozenset()
) -> tuple[TrueFlash, ...]:
    """Return every flash that gives light while the clip records, in order, cut ones at the ends included.

    ``frames`` counts the frames of the clip including ``dropped`` ones (indices from 0). Raises PsvideoError where a
    synced flash does not fit into the time in which all rows are open.
    """
    camera = plan.camera
    end_s = clip_end_s(camera, frames)
    train, start_s, duration_s = _synced(plan, frames) if plan.mode == "synced" else _free(plan, clock, end_s)
    emission = Emission(rise_s=plan.rise_s, fall_s=plan.fall_s)
    seen = (start_s + duration_s + emission.lasts_s(0.0) > 0.0) & (start_s < end_s)
    recorded = np.array([n for n in range(frames) if n not in dropped], np.intp)
    return tuple(
        TrueFlash(
            index=index,
            slot=int(train.slot[k]),
            lights=plan.flashes[train.slot[k]].lights,
            start_s=float(start_s[k]),
            duration_s=float(duration_s[k]),
            complete=is_complete(camera, emission, float(start_s[k]), float(duration_s[k]), recorded),
        )
        for index, k in enumerate(np.flatnonzero(seen))
    )


def _free(plan: Plan, clock: TrueClock, end_s: float) -> tuple[FlashTrain, Doubles, Doubles]:
    """Let the strobe run freely from well before the clip to well after it."""
    per_cycle = len(plan.cycle_slots)
    ends_s = clock.strobe_time_s(np.array([0.0, end_s]))
    first, last = int(np.floor(ends_s[0] / plan.cycle_s)) - 1, int(np.ceil(ends_s[1] / plan.cycle_s)) + 1
    train = plan.train(first * per_cycle, (last - first) * per_cycle)
    late_s = clock.jitter_s * np.random.default_rng([clock.seed, 1]).standard_normal(len(train.start_s))
    return train, clock.camera_time_s(train.start_s) + late_s, train.duration_s * clock.rate(train.start_s)


def _synced(plan: Plan, frames: int) -> tuple[FlashTrain, Doubles, Doubles]:
    """Trigger one flash per frame, in the middle of the time in which all of the frame's rows are open."""
    camera = plan.camera
    train = plan.train(0, frames)
    last_opens_s = float(row_opens_s(camera).max())
    open_s = camera.exposure_s - last_opens_s
    longest_s = float(train.duration_s.max())
    if longest_s > open_s + 1e-9:
        raise PsvideoError(
            f"The synced plan flashes for {longest_s * 1e3:.4g} ms, but all rows of {camera.name!r} are open together "
            f"for only {max(open_s, 0.0) * 1e3:.4g} ms. Shorten the flash, expose longer, or use the rolling mode."
        )
    start_s = np.arange(frames) * camera.frame_period_s + last_opens_s + 0.5 * (open_s - train.duration_s)
    return train, start_s, train.duration_s


def is_complete(
    camera: Camera, emission: Emission, start_s: float, duration_s: float, recorded: NDArray[np.intp]
) -> bool:
    """Return whether no light of the flash fell into frames that were not recorded."""
    opens_s = row_opens_s(camera)
    reach = int(np.ceil((opens_s.max() + camera.exposure_s) / camera.frame_period_s)) + 1
    now = int(np.floor(start_s / camera.frame_period_s))
    ahead = int(np.ceil(emission.lasts_s(duration_s) / camera.frame_period_s)) + 1
    frames = np.arange(now - reach, now + ahead + 1)
    lost = frames[~np.isin(frames, recorded)]
    since_s = lost[:, None] * camera.frame_period_s + opens_s - start_s
    shares = emission.share(since_s + camera.exposure_s, duration_s) - emission.share(since_s, duration_s)
    return bool(shares.sum(axis=0).max(initial=0.0) <= (TAIL_LOST if emission.fall_s > 0 else 1e-9))
