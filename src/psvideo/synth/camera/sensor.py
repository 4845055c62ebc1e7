"""The virtual sensor: what each row of each frame integrates of each flash.

The running integral of a flash's emission says how much of its energy has been given off at any moment, so a row
records the integral at its closing minus the integral at its opening. Nothing else of the project computes light so.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles, Image
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.lamps.true_flashes import TrueFlash, row_opens_s


@dataclass(frozen=True, kw_only=True)
class MainsSwing:
    """Ambient light on mains: it swings by ``depth`` (0 to 1) of its mean at ``hz`` light pulses per second."""

    hz: float = 0.0
    depth: float = 0.0

    def mean(self, opens_s: Doubles, exposure_s: float) -> Doubles:
        """Return each row's mean ambient level over its exposure, 1 without mains."""
        if self.hz <= 0 or self.depth == 0:
            return np.ones_like(opens_s)
        turn = 2 * np.pi * self.hz
        return 1.0 + self.depth * (np.cos(turn * opens_s) - np.cos(turn * (opens_s + exposure_s))) / (turn * exposure_s)


def seen_share(camera: Camera, emission: Emission, flash: TrueFlash, frame: int) -> Doubles:
    """Return which fraction of a flash each row of one frame records, shape (row,)."""
    since_s = frame * camera.frame_period_s + row_opens_s(camera) - flash.start_s
    closed = emission.share(since_s + camera.exposure_s, flash.duration_s, flash.bursts_s)
    return closed - emission.share(since_s, flash.duration_s, flash.bursts_s)


def expose_frames(
    plan: Plan,
    flashes: Iterable[TrueFlash],
    plate_of: Callable[[TrueFlash], Image | None],
    *,
    frames: Iterable[int],
    ambient_of: Callable[[int], Image] | None = None,
    mains: MainsSwing | None = None,
    channels: int = 0,
) -> Iterator[Image]:
    """Yield what the sensor collects in each frame, linear, 1.0 = saturation, not yet clipped and without noise.

    ``plate_of`` gives the scene as one whole flash lights it (None = dark), asked for once per flash and in order;
    ``ambient_of`` gives what a whole exposure collects of the light that does not flash, for a frame index. ``frames``
    are rising frame indices. Images are (row, col) where ``channels`` is 0, else (row, col, channel). Only the plates
    that the current frame sees are held.
    """
    camera = plan.camera
    emission = Emission(rise_s=plan.rise_s, fall_s=plan.fall_s)
    opens_s = row_opens_s(camera)
    spread_s = float(opens_s.max()) + camera.exposure_s
    shape = (camera.height_px, camera.width_px, *([channels] if channels else []))
    coming = iter(flashes)
    ahead = next(coming, None)
    live: list[tuple[TrueFlash, Image]] = []
    for frame in frames:
        begin_s = frame * camera.frame_period_s
        while ahead is not None and ahead.start_s < begin_s + spread_s:
            plate = plate_of(ahead) if ahead.start_s + emission.lasts_s(ahead.duration_s) > begin_s else None
            if plate is not None:
                live.append((ahead, plate))
            ahead = next(coming, None)
        live = [(flash, plate) for flash, plate in live if flash.start_s + emission.lasts_s(flash.duration_s) > begin_s]
        image = np.zeros(shape, np.float32)
        if ambient_of is not None:
            level = (mains or MainsSwing()).mean(begin_s + opens_s, camera.exposure_s)
            image += _per_row(level, shape) * ambient_of(frame)
        for flash, plate in live:
            _collect(image, plate, seen_share(camera, emission, flash, frame))
        yield image


def _collect(image: Image, plate: Image, share: Doubles) -> None:
    """Add the share of a plate that each row saw, touching only the rows that saw any of it."""
    rows = np.flatnonzero(share > 0)
    if rows.size:
        lit = slice(rows[0], rows[-1] + 1)
        image[lit] += _per_row(share[lit], plate.shape) * plate[lit]


def _per_row(values: Doubles, shape: tuple[int, ...]) -> Image:
    return values.astype(np.float32).reshape((-1,) + (1,) * (len(shape) - 1))


def plates_by_slot(plates: Mapping[int, Image]) -> Callable[[TrueFlash], Image | None]:
    """Return the plate source of a scene that stands still: one plate per slot of the plan, missing = dark."""
    return lambda flash: plates.get(flash.slot)
