"""What the live benches film: a relief under four lights and a dark slot, a mosaic of 8 bits, black at 4."""

from collections.abc import Iterator
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from psvideo.model.camera import Camera, Encoding
from psvideo.model.coded import Coded, Tone
from psvideo.model.plan import Plan, PlannedFlash
from psvideo.model.rig import Light, Rig
from psvideo.synth import Noise, TrueClock, expose

DIRECTIONS = {"key": (0.48, 0.36, 0.8), "left": (-0.6, 0.0, 0.8), "top": (0.0, 0.6, 0.8), "low": (0.0, -0.6, 0.8)}
CFA = "RGGB"
BLACK, WHITE = 4.0, 255.0
TONE = Tone(zero=np.full((1, 1), BLACK), gain=np.full((1, 1), 1 / (WHITE - BLACK)))
SETTLED = 12
"""Frames from which on the strobe flashes as if it always had."""
LOOP_FRAMES, LOOP_FLASHES = 71, 65
"""So many frames and flashes come round together, and each of these flashes comes at another moment of its frame."""
OFFSET_PPM = 25.0
"""By how much the strobe's clock is slower than the plan says."""
Codes = NDArray[np.uint8]


def plan_of(width_px: int, height_px: int, fps: int) -> Plan:
    """Return the plan: a flash every 1.09 frames, the shutter always open."""
    camera = Camera(
        width_px=width_px,
        height_px=height_px,
        fps=Fraction(fps),
        exposure_s=1 / fps,
        readout_s=0.97 / fps,
        encoding=Encoding(black_level=BLACK, white_level=WHITE, cfa=CFA),
    )
    step_s = LOOP_FRAMES / LOOP_FLASHES / fps / (1 + 1e-6 * OFFSET_PPM)
    flashes = [PlannedFlash(lights={name: 1.0}, duration_s=0.1 / fps) for name in DIRECTIONS]
    flashes.append(PlannedFlash(lights={}, duration_s=0.1 / fps))
    return Plan(camera=camera, flashes=tuple(flashes), dark_s=step_s - 0.1 / fps)


def rig() -> Rig:
    """Return where the lights are."""
    return Rig(lights=tuple(Light(name=name, direction=at) for name, at in DIRECTIONS.items()))


def frames(plan: Plan, count: int = LOOP_FRAMES) -> Iterator[Codes]:
    """Yield the codes of so many frames, row by row; the first comes after ``LOOP_FRAMES`` of them again."""
    rows, cols = plan.camera.height_px, plan.camera.width_px
    y, x = np.mgrid[0:rows, 0:cols].astype(np.float32) * (9.0 / rows)
    normals = np.stack([0.4 * np.sin(3 * x), 0.4 * np.cos(2 * y), np.ones_like(x)], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    plates = {
        slot: (0.8 * np.maximum(normals @ np.array(at, np.float32), 0)).astype(np.float32)
        for slot, at in zip(plan.lit_slots, DIRECTIONS.values(), strict=True)
    }
    shot = expose(
        plates,
        plan,
        frames=SETTLED + count,
        clock=TrueClock(phase_s=0.003, offset_ppm=OFFSET_PPM),
        ambient=0.02,
        noise=Noise(full_well_e=10_000, read_e=5),
    )
    for image in shot.frames[SETTLED:]:
        yield np.clip(np.rint(image * (WHITE - BLACK) + BLACK), 0, WHITE).astype(np.uint8)


def coded(codes: Codes) -> Coded:
    """Return codes as a source gives them."""
    return Coded(codes=codes, tone=TONE)
