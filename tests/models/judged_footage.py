"""Footage on either side of a verdict's border: shapes, lit and filmed as a case says, and what was observed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import cv2
import numpy as np
import pytest

from psvideo.clip import Masks
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash, assemble_plan
from psvideo.model.rig import Light, Rig
from psvideo.model.timing import Timing
from psvideo.plates.ambient.ambient_regression import Separated
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import AMBIENT, Round
from psvideo.report.judge import of_accuracy, of_validity
from psvideo.report.judge.of_exposure import exposure as judge_exposure
from psvideo.report.judge.of_lamps import lamps as judge_lamps
from psvideo.report.judge.of_rig import rig as judge_rig
from psvideo.report.judgement import Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import rig_points
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving

SIZE = 96
SEEDS = (0, 1, 2)
ONE_QUICKLY = [seed if seed == 0 else pytest.param(seed, marks=pytest.mark.campaign) for seed in SEEDS]
"""One seed in the suite, the others in the campaigns."""


@dataclass(frozen=True, kw_only=True)
class Footage:
    """A painted ball in the void, or a wall of waves, under a few lights, filmed for a few rounds.

    stops: where its brightest hundredth (0.5 %) lies below saturation under the first light; ``clip`` instead: the
        share of it that the first ``clipping`` lights clip. gains: of each light, (light,) or (round, light).
    noise: of saturation. dark: a part of the subject where only two lights reach. ambient: by round, as a share of what
        an exposure holds. blur_px, shift_px: of the picture, and how far it moves from round to round.
    claimed_deg, turned_deg, claimed_tilt_deg, claimed_gain: by how much the rig's directions are off, each its own way;
        by how much all are turned around the axis, and around the picture's rows; what it says of the first light's
        strength. near: how many picture widths away the lights stand, which the rig takes for distant. recorded: by
        which curve: "srgb" where sRGB was read as light, "undone" where light was read as sRGB. sheen: what is mirrored
        head on beside the albedo, and how narrowly (the cosine's power). solved: whether normals are needed. powers:
        of each light, for which the plan has it weaker than full; plates are at full power.
    """

    shape: str = "ball"
    lights: int = 5
    rounds: int = 1
    stops: float = -0.5
    clip: float | None = None
    clipping: int = 1
    gains: Sequence[float] | Sequence[Sequence[float]] = (1.0,)
    noise: float = 0.001
    dark: float = 0.0
    ambient: Sequence[float] = ()
    measured: float | None = None
    blur_px: float = 0.0
    shift_px: float = 0.0
    claimed_deg: float = 0.0
    turned_deg: float = 0.0
    claimed_tilt_deg: float = 0.0
    near: float = 0.0
    recorded: str = "linear"
    claimed_gain: float = 1.0
    unseen: float = 0.0
    borrowed: float = 0.0
    sheen: tuple[float, float] = (0.0, 1.0)
    solved: bool = False
    fill: bool = True
    backdrop: float = 0.0
    powers: Sequence[float] = (1.0,)

    def observed(self, seed: int) -> Observed:
        """Film it, solve it where that is asked for, and return what a run observes."""
        rng = np.random.default_rng(seed)
        ways = ring(self.lights)
        claimed, rig = self._claimed(ways, seed)
        names = tuple(one.name for one in rig.lights)
        points = rig_points(plan_of(names), rig, height_px=SIZE, width_px=SIZE, channels=1) if self.solved else None
        observed = Observed(lights=names, points=points)
        strengths = [share * one.intensity[0] for share, one in zip(self._shares, rig.lights, strict=True)]
        lit = Illumination(directions=claimed, intensities=np.array(strengths)[:, None])
        for n in range(self.rounds):
            clean = self._plates(ways, n)
            noisy = [(one + rng.normal(0, self.noise, one.shape)).astype(np.float32) for one in clean]
            plates = [BENT[self.recorded](np.minimum(one, 1.0)) for one in noisy]
            one = self._round(names, plates, clean, n)
            if self.measured is not None:
                stood = np.arange(100).reshape(10, 10) < 100 * self.measured
                image = np.full((SIZE, SIZE), self._dark_level(clean, n), np.float32)
                observed.look_at_window(Separated(begins=0, image=image, stood=stood, known=np.ones(SIZE, np.bool_)))
            observed.add(one, Solving(error=True, fill=self.fill).solve(plates, lit) if self.solved else None)
        return observed

    @property
    def _shares(self) -> list[float]:
        return [self.powers[n % len(self.powers)] for n in range(self.lights)]

    def _claimed(self, ways: np.ndarray, seed: int) -> tuple[np.ndarray, Rig]:
        across = np.random.default_rng(100 + seed).normal(size=ways.shape)
        across -= np.sum(across * ways, axis=1, keepdims=True) * ways
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        off, turn = np.radians(self.claimed_deg), np.radians(self.turned_deg)
        claimed = np.cos(off) * ways + np.sin(off) * across
        claimed = claimed @ np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        tilt = np.radians(self.claimed_tilt_deg)
        claimed = claimed @ np.array([[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, -np.sin(tilt), np.cos(tilt)]])
        gains = np.where(np.arange(len(ways)) == 0, self.claimed_gain, 1.0)
        lights = tuple(
            Light(name=f"light{n}", direction=(float(way[0]), float(way[1]), float(way[2])), intensity=(float(gain),))
            for n, (way, gain) in enumerate(zip(claimed, gains, strict=True))
        )
        return claimed, Rig(lights=lights)

    def _plates(self, ways: np.ndarray, number: int) -> list[np.ndarray]:
        normals, albedo = SHAPES[self.shape](self.shift_px * number)
        shades = [albedo * (_fallen(normals, way * self.near) if self.near else normals @ way) for way in ways]
        shades = [np.maximum(shade, 0) for shade in shades]
        if self.sheen[0]:
            shades = [shade + self._mirrored(normals, way) for shade, way in zip(shades, ways, strict=True)]
        if self.backdrop:
            shades = [np.where(albedo > 0, one, self.backdrop * way[2]) for one, way in zip(shades, ways, strict=True)]
        if self.dark:
            inside = np.linalg.norm(normals, axis=-1) > 0
            cols = np.argsort(np.argsort(np.where(inside, np.arange(SIZE)[None, :], SIZE).ravel())).reshape(
                inside.shape
            )
            hidden = inside & (cols < self.dark * inside.sum())
            shades = [shade * (1 - hidden * (n > 1)) for n, shade in enumerate(shades)]
        if self.blur_px:
            shades = [np.asarray(cv2.GaussianBlur(shade, (0, 0), self.blur_px)) for shade in shades]
        lit = shades[0][shades[0].max() * 0.01 < np.max(shades, axis=0)]
        target = 2.0**self.stops if self.clip is None else 1.0
        scale = target / float(np.quantile(lit, 0.995 if self.clip is None else 1 - self.clip))
        gains = np.asarray(self.gains, np.float64)
        gains = np.resize(gains[number] if gains.ndim == 2 else gains, self.lights)
        if self.clip is not None:
            gains = np.where(np.arange(self.lights) < self.clipping, gains, 0.3 / scale)
        return [shade * scale * gain for shade, gain in zip(shades, gains, strict=True)]

    def _mirrored(self, normals: np.ndarray, way: np.ndarray) -> np.ndarray:
        strength, narrow = self.sheen
        half = way + np.array([0, 0, 1])
        half /= np.linalg.norm(half)
        return np.asarray(strength * np.maximum(normals @ half, 0) ** narrow * (normals @ way > 0))

    def _dark_level(self, clean: Sequence[np.ndarray], number: int) -> float:
        subject = np.max(clean, axis=0) > 0.01
        mean = float(np.mean([one[subject].mean() for one in clean]))
        share = self.ambient[number % len(self.ambient)]
        return mean * share / (1 - share)

    def _round(self, names: Sequence[str], plates: Sequence[np.ndarray], clean: Sequence[np.ndarray], n: int) -> Round:
        seen = np.arange(SIZE) >= self.unseen * SIZE
        shown_s = np.where(np.arange(SIZE) < self.borrowed * SIZE, n - 1.0, float(n)) if self.borrowed else None
        full = [np.asarray(plate / share, np.float32) for plate, share in zip(plates, self._shares, strict=True)]
        taken = tuple(
            LightPlate(
                light=name, number=1001 + n, time_s=float(n), picture=mixture_of(plate), seen=seen, shown_s=shown_s,
                saturation=1 / share, brightest_share=share,
            )
            for name, plate, share in zip(names, full, self._shares, strict=True)
        )  # fmt: skip
        dark = None
        if self.ambient and self.measured is None:
            level = np.full((SIZE, SIZE), self._dark_level(clean, n), np.float32)
            whole = np.ones(SIZE, np.bool_)
            dark = LightPlate(light=AMBIENT, number=1001 + n, time_s=float(n), picture=mixture_of(level), seen=whole)
        return Round(number=1001 + n, plates=taken, ambient=dark)


def _to_srgb(light: np.ndarray) -> np.ndarray:
    held = np.clip(light, 0, 1)
    return np.asarray(np.where(held < 0.0031308, 12.92 * held, 1.055 * held ** (1 / 2.4) - 0.055), np.float32)


def _from_srgb(signal: np.ndarray) -> np.ndarray:
    held = np.clip(signal, 0, 1)
    return np.asarray(np.where(held < 0.04045, held / 12.92, ((held + 0.055) / 1.055) ** 2.4), np.float32)


BENT: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "linear": np.asarray, "srgb": _to_srgb, "undone": _from_srgb
}  # fmt: skip


def _fallen(normals: np.ndarray, lamp: np.ndarray) -> np.ndarray:
    """Return n . l under a lamp that stands there, in picture widths from the middle, 1 head on at that distance."""
    rows, cols = np.mgrid[:SIZE, :SIZE] / (SIZE - 1) - 0.5
    towards = lamp - np.stack([cols, -rows, 0 * cols], axis=-1)
    away = np.linalg.norm(towards, axis=-1)
    return np.asarray(np.sum(normals * towards, axis=-1) * (lamp @ lamp) / away**3)


def ring(lights: int) -> np.ndarray:
    around = 0.3 + np.arange(lights) * 2 * np.pi / lights
    return np.stack([0.5 * np.cos(around), 0.5 * np.sin(around), np.full(lights, np.sqrt(0.75))], axis=-1)


def ball(shift_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Return normals and albedo of a ball whose paint moves."""
    rows, cols = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    x, y = cols / (0.45 * SIZE), -rows / (0.45 * SIZE)
    inside = x * x + y * y < 0.8
    normals = np.stack([x, y, np.sqrt(np.where(inside, 1 - x * x - y * y, 0))], axis=-1) * inside[..., None]
    return normals, (0.7 + 0.1 * paint(shift_px)) * inside


def waves(shift_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Return normals and albedo of a wall that fills the picture."""
    rows, cols = np.mgrid[:SIZE, :SIZE] * (6 * np.pi / SIZE)
    one, other = 0.4 * np.cos(cols + 0.7 * rows), 0.4 * np.cos(rows - 0.4 * cols)
    normals = np.stack([0.4 * other - one, 0.7 * one + other, np.ones_like(one)], axis=-1)  # of sin + sin, y up
    return normals / np.linalg.norm(normals, axis=-1, keepdims=True), 0.7 + 0.2 * paint(shift_px)


def tiles(shift_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Return normals and albedo of a flat wall of dark and bright tiles, for sharpness."""
    rows, cols = np.mgrid[:SIZE, :SIZE] // 16
    flat = np.zeros((SIZE, SIZE, 3))
    flat[..., 2] = 1
    return flat, np.where((rows + cols) % 2, 0.8, 0.2)


def paint(shift_px: float) -> np.ndarray:
    wide = np.random.default_rng(9).normal(size=(SIZE, 4 * SIZE))
    soft = np.asarray(cv2.GaussianBlur(wide, (0, 0), 3))
    start = SIZE + round(shift_px)
    return np.asarray(np.clip(soft[:, start : start + SIZE] / soft.std(), -2, 2))


def card(shift_px: float) -> tuple[np.ndarray, np.ndarray]:
    return np.broadcast_to([0.0, 0.0, 1.0], (SIZE, SIZE, 3)), np.full((SIZE, SIZE), 0.8)


def pipe(shift_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Return normals and albedo of a pipe that stands upright."""
    x = np.tile((np.arange(SIZE) - (SIZE - 1) / 2) / (0.3 * SIZE), (SIZE, 1))
    inside = np.abs(x) < 1
    normals = np.stack([x, 0 * x, np.sqrt(np.where(inside, 1 - x * x, 0))], axis=-1) * inside[..., None]
    return normals, (0.7 + 0.1 * paint(shift_px)) * inside


def bottle(shift_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Return normals and albedo of a bottle: a belly, a shoulder and a neck."""
    x, up = np.meshgrid((np.arange(SIZE) - (SIZE - 1) / 2) / SIZE, ((SIZE - 1) / 2 - np.arange(SIZE)) / SIZE)
    neck = 1 / (1 + np.exp(-30 * (up - 0.1)))
    radius, taper = 0.3 - 0.1 * neck, 3 * neck * (1 - neck)
    inside = np.abs(x) < radius
    normals = np.stack([x / radius, taper, np.sqrt(np.where(inside, 1 - (x / radius) ** 2, 0))], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return normals * inside[..., None], (0.7 + 0.1 * paint(shift_px)) * inside


SHAPES: dict[str, Callable[[float], tuple[np.ndarray, np.ndarray]]] = {
    "ball": ball,
    "waves": waves,
    "tiles": tiles,
    "card": card,
    "pipe": pipe,
    "bottle": bottle,
}


def plan_of(names: Sequence[str], *, fps: int = 100, **changed: Any) -> Plan:
    camera = Camera(width_px=SIZE, height_px=SIZE, fps=Fraction(fps), exposure_s=1 / fps, readout_s=0.0)
    flashes = [PlannedFlash(lights={name: 1.0}, duration_s=0.5 / fps) for name in names]
    return replace(assemble_plan(camera=camera, flashes=flashes, dark_s=None, mode="synced"), **changed)


def timing_of(**changed: Any) -> Timing:
    known = Timing(
        clip="c", frame_period_s=0.01, exposure_s=0.01, row_time_s=1e-4, clock_offset_ppm=0.0, phase_error_rows=0.1,
        order="marker", flashes=(),
    )  # fmt: skip
    return replace(known, **changed)


def graded(lines: Judgement | Sequence[Judgement] | None, subject: str) -> str:
    """Return the gravest grade that a judgement gives to a subject."""
    said = [lines] if isinstance(lines, Judgement) else list(lines or ())
    grades = [line.grade for line in said if line.subject == subject]
    return next((grade for grade in ("bad", "doubtful", "good") if grade in grades), "nothing")


def exposure(one: Observed) -> list[Judgement]:
    return list(judge_exposure(one))


def lamps(one: Observed) -> list[Judgement]:
    return list(judge_lamps(one))


def rig_of(one: Observed) -> list[Judgement]:
    return list(judge_rig(one))


def rig_but_leaning(one: Observed) -> list[Judgement]:
    """Judge the rig by all but how its normals lean, which shows sooner: the other lines hold where nothing bends."""
    one.closely.leans.clear()
    return rig_of(one)


def accuracy(one: Observed) -> list[Judgement]:
    return list(of_accuracy.accuracy(one))


def validity(one: Observed) -> list[Judgement]:
    return list(of_validity.validity(one))


def facts_of(**what: Any) -> InstantFacts:
    known = {"number": 1001, "time_s": 0.0, "valid_share": 1.0, "clipped_share": 0.0, "unseen_share": 0.0}
    return InstantFacts(**{**known, **what})


def even(light: str, level: float, *, unseen: slice = slice(0), clips: float = 0.0) -> LightPlate:
    """A plate that is as bright everywhere, of which no frame saw some rows, and a share of whose columns clips."""
    image, seen = np.full((SIZE, SIZE), level, np.float32), np.ones(SIZE, np.bool_)
    image[:, : round(clips * SIZE)], seen[unseen] = 1.0, False
    picture = mixture_of(image * np.float32(1) * seen[:, None])
    return LightPlate(light=light, number=1001, time_s=0.0, picture=picture, seen=seen)


def looked_at(plates: Sequence[LightPlate], dark: LightPlate | None = None, masks: Masks | None = None) -> Observed:
    observed = Observed(lights=tuple(plate.light for plate in plates), masks=masks)
    observed.add(Round(number=1001, plates=tuple(plates), ambient=dark))
    return observed


ALL_WEAKER, ONE_WEAKER = (0.3,), (1.0, 0.1, 1.0, 1.0)
"""Powers of four lights in a plan. Their plates are at full power, so that saturation lies at 3.3 and at 10."""
