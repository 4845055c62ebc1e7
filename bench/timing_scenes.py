"""The plans and scenes that finding the timing is tried on."""

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction

import numpy as np

from psvideo.model.camera import Camera, Encoding
from psvideo.model.plan import Plan, PlannedFlash, default_dark_s
from psvideo.synth import TrueFlash

HEIGHT, WIDTH = 240, 16
NTSC_120 = Fraction(120_000, 1001)
Picture = np.ndarray
Scene = Callable[[Plan, np.random.Generator], Callable[[TrueFlash], Picture]]


def plan_of(
    *,
    lights: Sequence[str] = ("key", "left", "right"),
    durations_s: Sequence[float] = (0.0008,),
    dark: bool = True,
    dark_every: int = 1,
    fps: Fraction = NTSC_120,
    shutter: float = 1.0,
    readout: float = 1.0,
    tolerance_ppm: float | None = 200.0,
    patterns: Sequence[Mapping[str, float]] = (),
    fall_s: float = 0.0,
    rise_s: float = 0.0,
    height_px: int = HEIGHT,
    width_px: int = WIDTH,
    encoding: Encoding | None = None,
) -> Plan:
    """Return a plan; ``durations_s`` repeats over the lights, the dark slot is as long as the first."""
    period_s = float(1 / fps)
    camera = Camera(
        width_px=width_px,
        height_px=height_px,
        fps=fps,
        exposure_s=shutter * period_s,
        readout_s=readout * period_s,
        encoding=encoding or Encoding(),
    )
    lit = list(patterns) or [{name: 1.0} for name in lights]
    flashes = [
        PlannedFlash(lights=powers, duration_s=durations_s[n % len(durations_s)]) for n, powers in enumerate(lit)
    ]
    if dark:
        flashes.append(PlannedFlash(lights={}, duration_s=durations_s[0]))
    dark_s = default_dark_s(camera, durations_s, mode="rolling", clock_tolerance_ppm=tolerance_ppm)
    return Plan(
        camera=camera,
        flashes=tuple(flashes),
        dark_s=dark_s,
        dark_every=dark_every,
        clock_tolerance_ppm=tolerance_ppm,
        fall_s=fall_s,
        rise_s=rise_s,
    )


def _shape(plan: Plan) -> tuple[int, int]:
    return plan.camera.height_px, plan.camera.width_px


def _down(plan: Plan) -> Picture:
    """Return every row's place in the picture, 0 to 1, shape (row, 1)."""
    rows = plan.camera.height_px
    return (np.arange(rows) / rows)[:, None]


def _lit_plates(plan: Plan, base: Callable[[str], Picture]) -> Callable[[TrueFlash], Picture]:
    """Return plates that add up the lights of each slot, in proportion to power and duration."""
    pictures = {name: base(name) for name in plan.lights}
    longest_s = max(flash.duration_s for flash in plan.flashes)
    plates = [
        sum((power * pictures[name] for name, power in flash.lights.items()), np.zeros(_shape(plan), np.float32))
        * np.float32(flash.duration_s / longest_s)
        for flash in plan.flashes
    ]
    return lambda flash: np.asarray(plates[flash.slot], np.float32)


def textured(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A wall of noise under one gradient per light."""

    def one(_: str) -> Picture:
        slope = np.linspace(rng.uniform(0.4, 1), rng.uniform(0.4, 1), plan.camera.height_px)[:, None]
        return (0.35 + 0.45 * rng.random(_shape(plan))) * slope

    return _lit_plates(plan, one)


def dimmer(scene: Scene, factor: float) -> Scene:
    """The same scene with all lights weaker (or stronger), for patterns whose lights add up."""

    def made(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
        plate = scene(plan, rng)
        return lambda flash: np.asarray(np.float32(factor) * plate(flash), np.float32)

    return made


def mosaicked(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A textured wall as a sensor with red, green and blue filters (RGGB) sees it."""
    plate = textured(plan, rng)
    filters = np.tile(np.array([[0.5, 1.0], [1.0, 0.6]]), (plan.camera.height_px // 2, plan.camera.width_px // 2))
    return lambda flash: np.asarray(filters * plate(flash), np.float32)


def banded(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """Black and bright bands with hard edges."""
    down = _down(plan)
    albedo = np.where((down % 0.23) < 0.07, 0.01, 0.5) * np.where((down % 0.31) > 0.26, 1.8, 1.0)
    return _lit_plates(plan, lambda _: albedo * rng.uniform(0.6, 1) * (0.9 + 0.1 * rng.random(_shape(plan))))


def painted(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """Bands that have the dark row's own profile, and a black and a bright one."""
    down = _down(plan)
    albedo = np.full_like(down, 0.5)
    reach = plan.flashes[0].duration_s / plan.camera.frame_period_s
    for middle in (0.2, 0.55, 0.8):
        albedo *= np.clip(np.abs(down - middle) / reach, 0.02, 1)
    albedo[(down > 0.35) & (down < 0.42)] = 0.01
    albedo[(down > 0.66) & (down < 0.7)] = 0.9
    return _lit_plates(plan, lambda _: albedo * rng.uniform(0.6, 1) * (0.9 + 0.1 * rng.random(_shape(plan))))


def void(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A subject in a void: only a third of the rows ever see light."""
    shape = np.clip(1 - ((_down(plan) - 0.45) / 0.18) ** 2, 0, 1) ** 0.5
    return _lit_plates(plan, lambda _: shape * rng.uniform(0.3, 0.7) * (0.8 + 0.2 * rng.random(_shape(plan))))


def vignetted(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A wall in a picture with dark corners: an eighth of the light is left in the first and last rows."""
    fall = np.clip(1 - 0.87 * (2 * _down(plan) - 1) ** 2, 0, 1)
    return _lit_plates(plan, lambda _: fall * (0.4 + 0.4 * rng.random(_shape(plan))))


def saturated(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A wall of which a third saturates."""
    return _lit_plates(plan, lambda _: 0.4 + 0.9 * rng.random(_shape(plan)))


def saturated_and_vignetted(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A bright wall that saturates in part, with dark corners."""
    fall = np.clip(1 - 0.85 * (2 * _down(plan) - 1) ** 2, 0, 1)
    return _lit_plates(plan, lambda _: fall * (0.4 + 0.9 * rng.random(_shape(plan))))


def tumbling(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A lumpy subject that tumbles fast in a void: its rows brighten and darken from flash to flash."""
    down = _down(plan)[:, 0]
    gains = dict(zip(plan.lights, rng.uniform(0.5, 1, len(plan.lights)), strict=True))
    lumps = rng.uniform(0, 2 * np.pi, (6, 2))
    columns = 0.8 + 0.2 * rng.random((1, plan.camera.width_px))

    def plate(flash: TrueFlash) -> Picture:
        turn = 2 * np.pi * 1.1 * flash.middle_s
        across = (down - 0.5 - 0.15 * np.sin(0.9 * turn)) / (0.25 + 0.08 * np.sin(1.7 * turn + 1))
        body = np.clip(1 - across**2, 0, 1) ** 0.5
        for k, (a, b) in enumerate(lumps):
            body = body * (1 + 0.12 * np.sin((k + 1) * across * 2 + turn + a) * np.sin(turn + b))
        light = sum(power * gains[name] for name, power in flash.lights.items())
        return np.asarray(0.5 * light * body[:, None] * columns, np.float32)

    return plate


def rolling_stripes(*, speed: float = 1.0, share: float = 0.1, pitch: float = 0.5, light: float = 0.15) -> Scene:
    """Stripes that travel down the picture at a multiple of the dark row's speed.

    ``pitch`` is from stripe to stripe, as a share of the picture's height, and ``share`` of that is a stripe, which
    gives back so much of its light.
    """

    def made(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
        still = textured(plan, rng)
        camera = plan.camera
        pitch_s = plan.flashes[0].duration_s + plan.dark_s
        rows_per_s = speed * (pitch_s - camera.frame_period_s) / abs(camera.row_time_s) / pitch_s
        rows = np.arange(camera.height_px)
        each = camera.height_px * pitch

        def plate(flash: TrueFlash) -> Picture:
            place = (rows - rows_per_s * flash.middle_s) % each
            return np.asarray(still(flash) * np.where(place < share * each, light, 1.0)[:, None], np.float32)

        return plate

    return made
