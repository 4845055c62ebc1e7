"""Three cameras that differ in everything, one strobe with a coded marker: their clocks from cuts of two seconds."""

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from bench.timing_plates import HeldFrame
from bench.timing_scenes import plan_of
from psvideo.errors import PsvideoError
from psvideo.model.camera_clocks import CameraClock
from psvideo.model.plan import Plan
from psvideo.model.rows.row_profiles import collect
from psvideo.sync.find import timing_from_rows
from psvideo.sync.shared_flashes import CameraTake, camera_clocks
from psvideo.synth import Noise, TrueClock, expose

CODE = 7
SECONDS = 2.0
BAR_US = 2.0
STROBE_DARK_S = 0.0102


class Line(NamedTuple):
    """One camera against the first: the worst of the flashes that both saw."""

    camera: str
    began_s: float
    shared: int
    numbering: str
    numbers: str
    error_us: str
    claimed_us: str
    met: str


class _Camera(NamedTuple):
    """A camera, how far the strobe's clock is from its own, and frames that it loses."""

    name: str
    fps: Fraction
    shutter: float
    readout: float
    ppm: float
    dropped: tuple[int, ...]


CAMERAS = (
    _Camera("A, 119.88 fps, 360", Fraction(120_000, 1001), 1.0, 0.97, 60.0, ()),
    _Camera("B, 100 fps, 360, 3 dropped", Fraction(100), 1.0, 0.6, 25.0, (40, 41, 120)),
    _Camera("C, 143 fps, 300, bottom up", Fraction(143), 300 / 360, -0.9, -12.0, (7,)),
)


def _plan(camera: _Camera) -> Plan:
    plan = plan_of(
        lights=("key", "left", "right", "top"),
        fps=camera.fps,
        shutter=camera.shutter,
        readout=camera.readout,
        height_px=180,
    )
    return replace(plan, dark_s=STROBE_DARK_S, dark_code=CODE)


def _seen(camera: _Camera, begins_s: float, seed: int) -> CameraTake:
    """Film a textured subject from a strobe second on, on the camera's own clock."""
    plan = _plan(camera)
    rate = 1 + camera.ppm * 1e-6
    rng = np.random.default_rng(seed)
    shape = (plan.camera.height_px, plan.camera.width_px)
    plates = {slot: (0.1 + 0.6 * rng.random(shape)).astype(np.float32) for slot in plan.lit_slots}
    shot = expose(
        plates,
        plan,
        frames=int(SECONDS * camera.fps),
        clock=TrueClock(phase_s=-begins_s * rate, offset_ppm=camera.ppm),
        noise=Noise(full_well_e=20_000, read_e=8),
        bits=12,
        dropped=camera.dropped,
    )
    pairs = [HeldFrame(index=n, image=image) for n, image in zip(shot.indices, shot.frames, strict=True)]
    indices, profiles = collect(iter(pairs))
    return CameraTake(plan=plan, timing=timing_from_rows(plan, indices, profiles, clip=camera.name))


def rows() -> Iterator[Line]:
    """Film, cut at several places, compare."""
    for cut, starts_s in enumerate(((0.0, 1.13, -0.87), (3.9, 2.6, 5.1))):
        takes = [
            _seen(camera, at_s, 7 * cut + n) for n, (camera, at_s) in enumerate(zip(CAMERAS, starts_s, strict=True))
        ]
        for n in (1, 2):
            yield _line(takes[0], takes[n], CAMERAS[n], starts_s[n] - starts_s[0])


def _line(first: CameraTake, take: CameraTake, camera: _Camera, later_s: float) -> Line:
    try:
        clocks = camera_clocks([first, take])
    except PsvideoError as fault:
        return Line(camera.name, later_s, 0, str(fault)[:60], "", "", "", "no")
    found = clocks.cameras[1]
    error_us = 1e6 * _error_s(found, take, camera, later_s)
    exact = error_us < 1000
    return Line(
        camera=camera.name,
        began_s=round(later_s, 3),
        shared=found.shared,
        numbering=clocks.numbering,
        numbers="exact" if exact else "WRONG",
        error_us=f"{error_us:.2f}",
        claimed_us=f"{found.error_s * 1e6:.2f}",
        met="yes" if error_us <= BAR_US else "no",
    )


def _error_s(found: CameraClock, take: CameraTake, camera: _Camera, later_s: float) -> float:
    """Return by how much times that are carried over are off at worst, over the flashes that were shared."""
    first = max(-found.first_flash, 0)
    at_s = take.timing.start_s[first : first + found.shared]
    strobe_s = at_s / (1 + camera.ppm * 1e-6) + later_s
    return float(np.abs(found.reference_s(at_s) - strobe_s * (1 + CAMERAS[0].ppm * 1e-6)).max())
