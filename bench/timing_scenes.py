"""The scenes and disturbances that finding the timing is tried on: what the strobe plays, and what goes wrong."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

import numpy as np

from psvideo.camera import Camera
from psvideo.plan import Plan, PlannedFlash, default_dark_s
from psvideo.synth import Exposure, Flicker, Noise, StrobeClock, TrueFlash, expose

HEIGHT, WIDTH = 240, 16
NTSC_120 = Fraction(120_000, 1001)
NOISE = Noise(full_well_e=20_000, read_e=8)
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
) -> Plan:
    """Return a plan; ``durations_s`` repeats over the lights, the dark slot is as long as the first."""
    period_s = float(1 / fps)
    camera = Camera(
        width_px=WIDTH, height_px=HEIGHT, fps=fps, exposure_s=shutter * period_s, readout_s=readout * period_s
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


def _lit_plates(plan: Plan, base: Callable[[str], Picture]) -> Callable[[TrueFlash], Picture]:
    """Return plates that add up the lights of each slot, in proportion to power and duration."""
    pictures = {name: base(name) for name in plan.lights}
    longest_s = max(flash.duration_s for flash in plan.flashes)
    plates = [
        sum((power * pictures[name] for name, power in flash.lights.items()), np.zeros((HEIGHT, WIDTH), np.float32))
        * np.float32(flash.duration_s / longest_s)
        for flash in plan.flashes
    ]
    return lambda flash: np.asarray(plates[flash.slot], np.float32)


def textured(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A wall of noise under one gradient per light."""

    def one(_: str) -> Picture:
        slope = np.linspace(rng.uniform(0.4, 1), rng.uniform(0.4, 1), HEIGHT)[:, None]
        return (0.35 + 0.45 * rng.random((HEIGHT, WIDTH))) * slope

    return _lit_plates(plan, one)


def banded(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """Black and bright bands, and bands that have the dark row's own profile."""
    rows = np.arange(HEIGHT)
    albedo = np.full(HEIGHT, 0.5)
    reach = plan.flashes[0].duration_s / abs(plan.camera.row_time_s)
    for middle in (HEIGHT * 0.2, HEIGHT * 0.55, HEIGHT * 0.8):
        albedo *= np.clip(np.abs(rows - middle) / reach, 0.02, 1)
    albedo[int(HEIGHT * 0.35) : int(HEIGHT * 0.42)] = 0.01
    albedo[int(HEIGHT * 0.66) : int(HEIGHT * 0.7)] = 0.9

    def one(_: str) -> Picture:
        return albedo[:, None] * rng.uniform(0.6, 1) * (0.9 + 0.1 * rng.random((HEIGHT, WIDTH)))

    return _lit_plates(plan, one)


def void(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A subject in a void: only a third of the rows ever see light."""
    shape = np.clip(1 - ((np.arange(HEIGHT) - 0.45 * HEIGHT) / (0.18 * HEIGHT)) ** 2, 0, 1) ** 0.5

    def one(_: str) -> Picture:
        return shape[:, None] * rng.uniform(0.3, 0.7) * (0.8 + 0.2 * rng.random((HEIGHT, WIDTH)))

    return _lit_plates(plan, one)


def vignetted(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A bright wall that saturates in part, with dark corners."""
    fall = np.clip(1 - 0.85 * ((np.arange(HEIGHT) - HEIGHT / 2) / (HEIGHT / 2)) ** 2, 0, 1)[:, None]
    return _lit_plates(plan, lambda _: fall * (0.4 + 0.9 * rng.random((HEIGHT, WIDTH))))


def tumbling(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """A lumpy subject that tumbles fast in a void: its rows brighten and darken from flash to flash."""
    rows = np.arange(HEIGHT)
    gains = dict(zip(plan.lights, rng.uniform(0.5, 1, len(plan.lights)), strict=True))
    lumps = rng.uniform(0, 2 * np.pi, (6, 2))
    columns = 0.8 + 0.2 * rng.random((1, WIDTH))

    def plate(flash: TrueFlash) -> Picture:
        turn = 2 * np.pi * 1.1 * flash.middle_s
        middle = HEIGHT * (0.5 + 0.15 * np.sin(0.9 * turn))
        size = HEIGHT * (0.25 + 0.08 * np.sin(1.7 * turn + 1))
        body = np.clip(1 - ((rows - middle) / size) ** 2, 0, 1) ** 0.5
        for k, (a, b) in enumerate(lumps):
            body = body * (1 + 0.12 * np.sin((k + 1) * (rows - middle) / size * 2 + turn + a) * np.sin(turn + b))
        light = sum(power * gains[name] for name, power in flash.lights.items())
        return np.asarray(0.5 * light * body[:, None] * columns, np.float32)

    return plate


def rolling_stripes(plan: Plan, rng: np.random.Generator) -> Callable[[TrueFlash], Picture]:
    """Stripes that travel down the picture as fast as the dark row does."""
    still = textured(plan, rng)
    camera = plan.camera
    pitch_s = plan.flashes[0].duration_s + plan.dark_s
    rows_per_s = (pitch_s - camera.frame_period_s) / abs(camera.row_time_s) / pitch_s
    rows = np.arange(HEIGHT)

    def plate(flash: TrueFlash) -> Picture:
        place = (rows - rows_per_s * flash.middle_s) % (HEIGHT / 2)
        return np.asarray(still(flash) * np.where(place < 24, 0.15, 1.0)[:, None], np.float32)

    return plate


@dataclass(frozen=True, kw_only=True)
class Case:
    """One virtual shoot: ``plan`` is what happened, ``claimed`` what plan.toml says of it (the same if None)."""

    plan: Plan
    claimed: Plan | None = None
    scene: Scene = textured
    frames: int = 96
    clock: StrobeClock = field(default_factory=lambda: StrobeClock(phase_s=0.0123, offset_ppm=40.0))
    ambient: float = 0.0
    flicker: Flicker | None = None
    dropped: tuple[int, ...] = ()
    repeated: tuple[int, ...] = ()
    told: bool = False
    marker: bool = True
    bar_rows: float = 0.05

    def shoot(self, seed: int) -> tuple[Exposure, np.ndarray, np.ndarray]:
        """Return the exposure, the frames' indices as the files number them, and the frames; the phase is random."""
        rng = np.random.default_rng(seed)
        clock = replace(self.clock, phase_s=rng.uniform(0, self.plan.cycle_s), seed=seed)
        shot = expose(
            self.scene(self.plan, rng),
            self.plan,
            frames=self.frames,
            clock=clock,
            ambient=self.ambient,
            flicker=self.flicker,
            noise=NOISE,
            bits=12,
            dropped=self.dropped,
            seed=seed,
        )
        frames = shot.frames
        indices = np.array(shot.indices) if self.told else np.arange(len(frames))
        if self.repeated:
            order = np.sort(np.concatenate([np.arange(len(frames)), np.array(self.repeated)]))
            frames, indices = frames[order], np.arange(len(order))
        return shot, indices, frames


def unknown_readout(plan: Plan) -> Plan:
    """Return the plan as one says it whose camera nobody measured."""
    return replace(plan, camera=replace(plan.camera, readout_s=None))


def _off(plan: Plan, *, exposure: float = 1.0, fps: Fraction | None = None) -> Plan:
    camera = replace(plan.camera, exposure_s=plan.camera.exposure_s * exposure)
    return replace(plan, camera=replace(camera, fps=fps or camera.fps))


def cases() -> dict[str, Case]:
    """Return every disturbance alone, and several at once."""
    plain = plan_of()
    wide = plan_of(tolerance_ppm=None)
    half = plan_of(shutter=0.5, readout=0.6)
    tails = plan_of(fall_s=6e-5, rise_s=2e-5)
    s_matrix = [{"a": 1.0, "b": 1.0}, {"b": 1.0, "c": 1.0}, {"a": 1.0, "c": 1.0}]
    hdr = plan_of(lights=("key", "key", "left", "left"), durations_s=(0.0008, 0.0002))
    misnamed = replace(plain, camera=replace(plain.camera, fps=Fraction(120)))
    hard = plan_of(readout=0.7, tolerance_ppm=None, fall_s=5e-5)
    drift = StrobeClock(offset_ppm=3000.0, drift_ppm_per_s=2.0)

    def clock(ppm: float, drift: float = 0.0, jitter_s: float = 0.0) -> StrobeClock:
        return StrobeClock(offset_ppm=ppm, drift_ppm_per_s=drift, jitter_s=jitter_s)

    return {
        "clean": Case(plan=plain),
        "long, 600 frames": Case(plan=plain, frames=600),
        "shutter 180": Case(plan=plan_of(shutter=0.5)),
        "shutter 90, readout 0.3": Case(plan=plan_of(shutter=0.25, readout=0.3)),
        "global shutter": Case(plan=plan_of(readout=0.0)),
        "readout 0.6": Case(plan=plan_of(readout=0.6)),
        "bottom-up": Case(plan=plan_of(readout=-1.0)),
        "readout unknown (1.0)": Case(plan=plain, claimed=unknown_readout(plain)),
        "readout unknown (0.3)": Case(plan=plan_of(readout=0.3), claimed=unknown_readout(plain)),
        "readout unknown (-0.8)": Case(plan=plan_of(readout=-0.8), claimed=unknown_readout(plain)),
        "readout unknown (0)": Case(plan=plan_of(readout=0.0), claimed=unknown_readout(plain)),
        "readout unknown, 180, 0.6": Case(plan=half, claimed=unknown_readout(half)),
        "exposure 3 % off": Case(plan=half, claimed=_off(half, exposure=1.03)),
        "10,000 ppm": Case(plan=wide, clock=clock(9900)),
        "-10,000 ppm": Case(plan=wide, clock=clock(-9900)),
        "3000 ppm": Case(plan=wide, clock=clock(3000)),
        "drift 0.5 ppm/s, 3000 frames": Case(plan=wide, clock=clock(3000, 0.5), frames=3000, bar_rows=0.1),
        "drift 5 ppm/s, 600 frames": Case(plan=wide, clock=clock(-2000, 5.0), frames=600, bar_rows=0.1),
        "fps 120 for 119.88": Case(plan=plain, claimed=misnamed),
        "bands": Case(plan=plain, scene=banded),
        "void": Case(plan=plain, scene=void),
        "void, readout unknown": Case(plan=plain, claimed=unknown_readout(plain), scene=void),
        "rolling stripes": Case(plan=plain, scene=rolling_stripes),
        "tumbling in a void": Case(plan=plain, scene=tumbling),
        "tumbling, 3000 ppm, drift": Case(plan=wide, scene=tumbling, clock=drift, frames=300, bar_rows=0.1),
        "saturated, vignetted": Case(plan=plain, scene=vignetted),
        "ambient": Case(plan=plain, ambient=0.2),
        "ambient at 100 Hz": Case(plan=plain, ambient=0.2, flicker=Flicker(hz=100, depth=0.6)),
        "ambient at 120 Hz, 180": Case(plan=half, ambient=0.2, flicker=Flicker(hz=120, depth=0.6)),
        "unequal flashes": Case(plan=plan_of(durations_s=(0.0008, 0.0004, 0.0006))),
        "HDR pairs": Case(plan=hdr),
        "long flash marks": Case(plan=plan_of(dark=False, durations_s=(0.0012, 0.0006, 0.0006))),
        "no marker": Case(plan=plan_of(dark=False), marker=False),
        "S-matrix, dark slot": Case(plan=plan_of(patterns=s_matrix)),
        "S-matrix, no marker": Case(plan=plan_of(patterns=s_matrix, dark=False), marker=False),
        "dark slot every 5th": Case(plan=plan_of(dark_every=5)),
        "8 lights": Case(plan=plan_of(lights=tuple("abcdefgh")), frames=120),
        "tails given": Case(plan=tails),
        "tails not given": Case(plan=tails, claimed=replace(tails, fall_s=0.0, rise_s=0.0), bar_rows=0.3),
        "jitter 3 us": Case(plan=plain, clock=clock(40, jitter_s=3e-6), bar_rows=0.1),
        "declared drops": Case(plan=plain, dropped=(31, 32, 60), told=True),
        "undeclared drops": Case(plan=plain, dropped=(31, 32, 60)),
        "early and late drops": Case(plan=plain, dropped=(5, 90)),
        "drop and repeat": Case(plan=plain, dropped=(40,), repeated=(39,)),
        "repeated frame": Case(plan=plain, repeated=(50,)),
        "bands, void, ambient, drift": Case(
            plan=wide, scene=banded, ambient=0.1, clock=drift, frames=300, bar_rows=0.1
        ),
        "everything at once": Case(
            plan=hard,
            claimed=unknown_readout(replace(hard, fall_s=0.0)),
            scene=tumbling,
            clock=drift,
            ambient=0.05,
            flicker=Flicker(hz=100, depth=0.4),
            frames=300,
            dropped=(120,),
            bar_rows=0.3,
        ),
    }
