"""A strobed clip in memory, made from given plates: frames with known truth, without rendering."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Image
from psvideo.model.plan import Plan
from psvideo.synth.camera.noise import NOISELESS, Noise, frame_rng
from psvideo.synth.camera.sensor import MainsSwing, expose_frames, plates_by_slot
from psvideo.synth.lamps.true_flashes import TrueClock, TrueFlash, true_flashes


@dataclass(frozen=True, kw_only=True)
class Exposure:
    """Frames and their truth. ``frames`` has shape (frame, row, col[, channel]), linear, 1.0 = saturation.

    Frame indices are in ``indices``; the flashes' times are on the camera's clock, zero when the first row of frame 0
    opens.
    """

    frames: NDArray[np.float32]
    indices: tuple[int, ...]
    flashes: tuple[TrueFlash, ...]


Plates = Mapping[int, Image] | Sequence[Image | None] | Callable[[TrueFlash], Image]


def expose(
    plates: Plates,
    plan: Plan,
    *,
    frames: int,
    clock: TrueClock | None = None,
    ambient: Image | float = 0.0,
    mains: MainsSwing | None = None,
    noise: Noise = NOISELESS,
    bits: int = 0,
    dropped: Sequence[int] = (),
    gain: Sequence[float] | None = None,
    seed: int = 0,
) -> Exposure:
    """Expose a scene under the plan's flashes and return frames as a clip would give them.

    ``plates`` holds one image per slot of the plan's round (None or missing = dark), as one whole flash of that slot
    lights the scene; for a scene that moves it is a function that gives the image of any one flash. ``ambient`` is what
    one whole exposure collects as well. ``gain`` is what the camera multiplies each frame by before it saturates, as an
    automatic exposure does. Frames saturate at 1.0 and come in steps of a converter where ``bits`` is given; below
    black they may be slightly negative through noise.

    >>> from fractions import Fraction
    >>> from psvideo.model.camera import Camera
    >>> from psvideo.model.plan import PlannedFlash
    >>> camera = Camera(width_px=1, height_px=4, fps=Fraction(100), exposure_s=0.01, readout_s=0.01)
    >>> flash = PlannedFlash(lights={"key": 1.0}, duration_s=0.001)
    >>> plan = Plan(camera=camera, flashes=(flash,), dark_s=1.0)
    >>> shot = expose([np.full((4, 1), 0.8, np.float32)], plan, frames=3, clock=TrueClock(phase_s=0.0145))
    >>> shot.frames[:, :, 0].round(3)
    array([[0. , 0. , 0.4, 0.8],
           [0.8, 0.8, 0.4, 0. ],
           [0. , 0. , 0. , 0. ]], dtype=float32)
    """
    flashes = true_flashes(plan, clock or TrueClock(), frames=frames, dropped=frozenset(dropped))
    kept = tuple(n for n in range(frames) if n not in set(dropped))
    plate_of = plates if callable(plates) else plates_by_slot(_by_slot(plates))
    shape = next(plate.shape for plate in map(plate_of, flashes) if plate is not None)
    steady = np.broadcast_to(np.asarray(ambient, np.float32), shape)
    light = expose_frames(
        plan,
        flashes,
        plate_of,
        frames=kept,
        ambient_of=(lambda _: steady) if np.any(steady) else None,
        mains=mains,
        channels=shape[2] if len(shape) == 3 else 0,
    )
    gains = np.ones(frames) if gain is None else np.asarray(gain, np.float64)
    images = [
        _read(image * np.float32(gains[n]), noise, bits, np_seed=(seed, n))
        for n, image in zip(kept, light, strict=True)
    ]
    return Exposure(frames=np.stack(images), indices=kept, flashes=flashes)


def _by_slot(plates: Mapping[int, Image] | Sequence[Image | None]) -> dict[int, Image]:
    if isinstance(plates, Mapping):
        return dict(plates)
    return {slot: plate for slot, plate in enumerate(plates) if plate is not None}


def _read(image: Image, noise: Noise, bits: int, *, np_seed: tuple[int, int]) -> Image:
    read = np.minimum(noise.add(image, frame_rng(*np_seed)), np.float32(1.0))
    if bits:
        steps = np.float32(2**bits - 1)
        read = np.round(read * steps) / steps
    return read
