"""The virtual shoots that the timing is found from: every disturbance alone, and several at once, in groups."""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path

import numpy as np

from bench.timing_files import as_bayer, as_h264, as_slog3
from bench.timing_plates import HeldFrame
from bench.timing_scenes import (
    Picture,
    Scene,
    banded,
    dimmer,
    mosaicked,
    painted,
    plan_of,
    rolling_stripes,
    saturated,
    saturated_and_vignetted,
    textured,
    tumbling,
    vignetted,
    void,
)
from psvideo.clip import Frame
from psvideo.model.camera import Encoding
from psvideo.model.plan import Plan
from psvideo.synth import Exposure, MainsSwing, Noise, TrueClock, TrueFlash, expose

NOISE = Noise(full_well_e=20_000, read_e=8)
DRIFTING, ALL_AT_ONCE = 0.1, 0.3
"""Bars in rows for clocks that drift, and for tails that the plan does not give or everything at once."""
S_MATRIX = [{"a": 1.0, "b": 1.0}, {"b": 1.0, "c": 1.0}, {"a": 1.0, "c": 1.0}]
Recorder = Callable[[Path, Plan, np.ndarray], list[Frame]]


@dataclass(frozen=True, kw_only=True)
class Filmed:
    """A clip as psvideo gets it, and its truth. ``true_index`` (frame,) are the frames' places, -1 for repeats."""

    exposure: Exposure
    plate_of: Callable[[TrueFlash], Picture]
    frames: list[HeldFrame]
    true_index: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Case:
    """One virtual shoot: ``plan`` is what happened, ``claimed`` what plan.toml says of it (the same if None).

    ``numbered``: the numbering shows the dropped frames. ``recorder``: what kind of file the clip goes through. The
    clip goes on by ``step`` frames a frame, rounded down; ``recoded`` is what encoding it again adds to each row's
    mean, in standard deviations of the picture. ``or_refused``: the picture may not show the times; then a refusal is
    right, and wrong times are not.
    """

    plan: Plan
    claimed: Plan | None = None
    scene: Scene = textured
    frames: int = 96
    clock: TrueClock = field(default_factory=lambda: TrueClock(phase_s=0.0123, offset_ppm=40.0))
    ambient: float = 0.0
    mains: MainsSwing | None = None
    dropped: tuple[int, ...] = ()
    repeated: tuple[int, ...] = ()
    step: Fraction = Fraction(1)
    recoded: float = 0.0
    numbered: bool = False
    marker: bool = True
    recorder: Recorder | None = None
    bar_rows: float = 0.05
    or_refused: bool = False
    seeds: int = 2

    def film(self, seed: int) -> Filmed:
        """Film the case once; the strobe's phase is random."""
        rng = np.random.default_rng(seed)
        clock = replace(self.clock, phase_s=rng.uniform(0, self.plan.cycle_s), seed=seed)
        plate_of = self.scene(self.plan, rng)
        shot = expose(
            plate_of,
            self.plan,
            frames=self.frames,
            clock=clock,
            ambient=self.ambient,
            mains=self.mains,
            noise=NOISE,
            bits=0 if self.recorder else 12,
            dropped=self.dropped,
            seed=seed,
        )
        pictures = shot.frames if self.recorder is None else _through(self.recorder, self.plan, shot.frames)
        shown = np.arange(int(len(pictures) / self.step)) * self.step.numerator // self.step.denominator
        order = np.sort(np.concatenate([shown, np.array(self.repeated, np.int64)]))
        added = self.recoded * float(np.std(pictures[0])) * rng.standard_normal((len(order), len(pictures[0]), 1))
        numbers = np.array(shot.indices) if self.numbered else np.arange(len(order))
        again = np.append(False, np.diff(order) == 0)
        return Filmed(
            exposure=shot,
            plate_of=plate_of,
            frames=[
                HeldFrame(int(number), np.asarray(pictures[n] + more, np.float32) if self.recoded else pictures[n])
                for number, n, more in zip(numbers, order, added, strict=True)
            ],
            true_index=np.where(again, -1, np.array(shot.indices)[order]),
        )


def _through(recorder: Recorder, plan: Plan, frames: np.ndarray) -> Sequence[Picture]:
    """Write frames to files and read them back, one channel of what is grey."""
    with tempfile.TemporaryDirectory() as folder:
        images = [frame.image for frame in recorder(Path(folder), plan, frames)]
    return [image if image.ndim == 2 else np.ascontiguousarray(image[..., 1]) for image in images]


def _clock(ppm: float, drift: float = 0.0, jitter_s: float = 0.0) -> TrueClock:
    return TrueClock(offset_ppm=ppm, drift_ppm_per_s=drift, jitter_s=jitter_s)


def _unknown(plan: Plan) -> Plan:
    return replace(plan, camera=replace(plan.camera, readout_s=None))


def _off(plan: Plan, *, exposure: float = 1.0, fps: Fraction | None = None) -> Plan:
    camera = replace(plan.camera, exposure_s=plan.camera.exposure_s * exposure)
    return replace(plan, camera=replace(camera, fps=fps or camera.fps))


def groups() -> dict[str, dict[str, Case]]:
    """Return every group of disturbances and its cases."""
    return {
        "Clean": _clean(),
        "Shutter and readout": _shutters(),
        "Clocks": _clocks(),
        "Scenes": _scenes(),
        "Other light": _other_light(),
        "Flashes": _flashes(),
        "Frames missing or twice": _holes(),
        "Movies re-timed": _retimed(),
        "Files": _files(),
        "Several at once": _combined(),
    }


def _clean() -> dict[str, Case]:
    plain = plan_of()
    return {
        "nothing": Case(plan=plain),
        "nothing, 600 frames": Case(plan=plain, frames=600),
        "8 lights": Case(plan=plan_of(lights=tuple("abcdefgh")), frames=120),
        "dark slot in every 5th round": Case(plan=plan_of(dark_every=5)),
        "no marker": Case(plan=plan_of(dark=False), marker=False),
    }


def _shutters() -> dict[str, Case]:
    plain, half = plan_of(), plan_of(shutter=0.5, readout=0.6)
    unknown = {
        f"readout {readout:g}, unknown": Case(plan=plan_of(readout=readout), claimed=_unknown(plain))
        for readout in (1.0, 0.6, 0.3, 0.0, -0.8)
    }
    return {
        "350 degrees": Case(plan=plan_of(shutter=350 / 360)),
        "270 degrees": Case(plan=plan_of(shutter=0.75)),
        "180 degrees": Case(plan=plan_of(shutter=0.5)),
        "90 degrees": Case(plan=plan_of(shutter=0.25)),
        "90 degrees, readout 0.3": Case(plan=plan_of(shutter=0.25, readout=0.3)),
        "readout 0.6": Case(plan=plan_of(readout=0.6)),
        "readout 0.3": Case(plan=plan_of(readout=0.3)),
        "readout 0 (global)": Case(plan=plan_of(readout=0.0)),
        "bottom row first": Case(plan=plan_of(readout=-1.0)),
        **unknown,
        "readout 0.6, unknown, 180 degrees": Case(plan=half, claimed=_unknown(half)),
        "exposure nominal, 3 % off": Case(plan=half, claimed=_off(half, exposure=1.03)),
    }


def _clocks() -> dict[str, Case]:
    plain, wide = plan_of(), plan_of(tolerance_ppm=None)
    apart = {f"{ppm:+d} ppm": Case(plan=wide, clock=_clock(ppm)) for ppm in (50, 500, -2000, 5000, 9900, -9900)}
    small = plan_of(tolerance_ppm=None, height_px=96, width_px=8)
    ntsc, whole = Fraction(120_000, 1001), Fraction(120)
    return {
        **apart,
        "drift 0.5 ppm/s (3 C a minute), 10,000 frames of 96 rows": Case(
            plan=small, clock=_clock(3000, 0.5), frames=10_000, bar_rows=DRIFTING, seeds=1
        ),
        "drift 5 ppm/s, 600 frames": Case(plan=wide, clock=_clock(-2000, 5.0), frames=600, bar_rows=DRIFTING),
        "jitter 3 us": Case(plan=plain, clock=_clock(40, jitter_s=3e-6), bar_rows=DRIFTING),
        "119.88 frames a second called 120": Case(plan=plain, claimed=_off(plain, fps=whole)),
        "120 frames a second called 119.88": Case(plan=plan_of(fps=whole), claimed=_off(plan_of(fps=whole), fps=ntsc)),
    }


def _scenes() -> dict[str, Case]:
    plain = plan_of()
    return {
        "black and bright bands": Case(plan=plain, scene=banded),
        "bands with the dark row's profile": Case(plan=plain, scene=painted),
        "void": Case(plan=plain, scene=void),
        "void, readout unknown": Case(plan=plain, claimed=_unknown(plain), scene=void),
        "stripes moving with the dark row": Case(plan=plain, scene=rolling_stripes()),
        "half the picture striped, 8 lights": Case(
            plan=plan_of(lights=tuple("abcdefgh"), durations_s=(0.0016,), readout=0.9),
            scene=rolling_stripes(speed=1.1, share=0.5, pitch=1.0, light=0.5),
            ambient=0.02,
        ),
        "stripes at twice the dark row's speed, 3000 ppm": Case(
            plan=plan_of(durations_s=(0.0016,), tolerance_ppm=None),
            scene=rolling_stripes(speed=2.0, share=0.5, light=0.0),
            clock=_clock(3000),
            frames=150,
        ),
        "half the picture striped, with the dark row, 180 degrees": Case(
            plan=plan_of(lights=tuple("abcdefgh"), shutter=0.5),
            scene=rolling_stripes(share=0.5, pitch=1.0),
            frames=240,
            or_refused=True,
        ),
        "tumbling in a void": Case(plan=plain, scene=tumbling),
        "saturation": Case(plan=plain, scene=saturated),
        "vignetting": Case(plan=plain, scene=vignetted),
    }


def _other_light() -> dict[str, Case]:
    plain, half = plan_of(), plan_of(shutter=0.5, readout=0.6)
    return {
        "ambient": Case(plan=plain, ambient=0.15),
        "ambient at 100 Hz": Case(plan=plain, ambient=0.15, mains=MainsSwing(hz=100, depth=0.6)),
        "ambient at 120 Hz": Case(plan=plain, ambient=0.15, mains=MainsSwing(hz=120, depth=0.6)),
        "ambient at 100 Hz, 180 degrees": Case(plan=half, ambient=0.15, mains=MainsSwing(hz=100, depth=0.6)),
        "ambient at 120 Hz, 180 degrees": Case(plan=half, ambient=0.15, mains=MainsSwing(hz=120, depth=0.6)),
    }


def _flashes() -> dict[str, Case]:
    tails = plan_of(fall_s=6e-5, rise_s=2e-5)
    hdr = plan_of(lights=("key", "key", "left", "left"), durations_s=(0.0008, 0.0002))
    patterns, bare = plan_of(patterns=S_MATRIX), plan_of(patterns=S_MATRIX, dark=False)
    half_as_bright = dimmer(textured, 0.55)
    return {
        "unequal durations": Case(plan=plan_of(durations_s=(0.0008, 0.0004, 0.0006))),
        "HDR durations": Case(plan=hdr),
        "long flash as marker": Case(plan=plan_of(dark=False, durations_s=(0.0012, 0.0006, 0.0006))),
        "S-matrix, dark slot": Case(plan=patterns, scene=half_as_bright),
        "S-matrix, no marker": Case(plan=bare, scene=half_as_bright, marker=False),
        "S-matrix, no marker, mostly clipped": Case(plan=bare, marker=False, seeds=5),
        "LED tails given": Case(plan=tails),
        "LED tails not given": Case(plan=tails, claimed=replace(tails, fall_s=0.0, rise_s=0.0), bar_rows=ALL_AT_ONCE),
    }


def _holes() -> dict[str, Case]:
    plain = plan_of()
    at_random = tuple(np.random.default_rng(0).choice(np.arange(1, 300), 18, replace=False).tolist())
    return {
        "dropped, numbers show it": Case(plan=plain, dropped=(31, 32, 60), numbered=True),
        "dropped, nothing shows it": Case(plan=plain, dropped=(31, 32, 60)),
        "dropped near either end": Case(plan=plain, dropped=(5, 90)),
        "one repeated": Case(plan=plain, repeated=(50,)),
        "one repeated for one dropped": Case(plan=plain, dropped=(40,), repeated=(39,)),
        "dropped before the last frame": Case(plan=plain, dropped=(94,)),
        "dropped after the first frame": Case(plan=plain, dropped=(1, 2)),
        "6 of 100 dropped at random": Case(plan=plain, dropped=at_random, frames=300),
    }


def _retimed() -> dict[str, Case]:
    plain, wide = plan_of(), plan_of(tolerance_ppm=None)
    sixth, four_fifths = Fraction(6, 5), Fraction(4, 5)
    return {
        "every 6th missing (30 to 25)": Case(plan=plain, step=sixth, frames=120),
        "3 of 5 missing (60 to 24)": Case(plan=plain, step=Fraction(5, 2), frames=240),
        "every 2nd missing": Case(plan=plain, step=Fraction(2), frames=200),
        "one of five repeated, encoded again": Case(plan=plain, step=four_fifths, recoded=0.01),
        "2:3 repeats, encoded again": Case(plan=plain, step=Fraction(2, 5), recoded=0.01),
        "every 6th missing, void": Case(plan=plain, scene=void, step=sixth, frames=120),
        "every 6th missing, global shutter": Case(plan=plan_of(readout=0.0), step=sixth, frames=120),
        "every 6th missing, 3000 ppm": Case(plan=wide, step=sixth, frames=120, clock=_clock(3000)),
    }


def _files() -> dict[str, Case]:
    srgb = plan_of(width_px=64, encoding=Encoding(transfer="srgb"))
    log = plan_of(encoding=Encoding(transfer="slog3"))
    bayer = plan_of(encoding=Encoding(cfa="RGGB"))
    return {
        "8-bit sRGB, H.264": Case(plan=srgb, recorder=as_h264),
        "8-bit sRGB, H.264, void": Case(plan=srgb, scene=void, recorder=as_h264),
        "10-bit S-Log3": Case(plan=log, recorder=as_slog3),
        "12-bit Bayer mosaic": Case(plan=bayer, scene=mosaicked, recorder=as_bayer),
    }


def _combined() -> dict[str, Case]:
    wide = plan_of(tolerance_ppm=None)
    hard = plan_of(readout=0.7, tolerance_ppm=None, fall_s=5e-5)
    movie = plan_of(width_px=64, tolerance_ppm=None, shutter=0.5, encoding=Encoding(transfer="srgb"))
    drift = _clock(3000, 2.0)
    return {
        "tumbling in a void, 3000 ppm and drift": Case(
            plan=wide, scene=tumbling, clock=drift, frames=300, bar_rows=DRIFTING
        ),
        "painted bands, ambient, 3000 ppm and drift": Case(
            plan=wide, scene=painted, ambient=0.1, clock=drift, frames=300, bar_rows=DRIFTING
        ),
        "saturation and vignetting": Case(plan=plan_of(), scene=saturated_and_vignetted),
        "H.264, 180 degrees, ambient, -5000 ppm, dropped frames": Case(
            plan=movie, clock=_clock(-5000), ambient=0.1, frames=150, dropped=(70,), recorder=as_h264
        ),
        "HDR durations, bottom row first, readout unknown, dropped": Case(
            plan=plan_of(lights=("key", "key", "left", "left"), durations_s=(0.0008, 0.0002), readout=-0.8),
            claimed=_unknown(plan_of(lights=("key", "key", "left", "left"), durations_s=(0.0008, 0.0002))),
            frames=150,
            dropped=(70,),
        ),
        "everything: void, tumbling, drift, tails, flicker, readout": Case(
            plan=hard,
            claimed=_unknown(replace(hard, fall_s=0.0)),
            scene=tumbling,
            clock=drift,
            ambient=0.05,
            mains=MainsSwing(hz=100, depth=0.4),
            frames=300,
            dropped=(120,),
            bar_rows=ALL_AT_ONCE,
        ),
    }
