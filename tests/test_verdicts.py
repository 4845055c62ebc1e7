"""Every threshold of a verdict separates footage that is just good from footage that is just not."""

import re
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from psvideo.clip import Masks
from psvideo.model.camera import Camera, Encoding
from psvideo.model.plan import Plan, PlannedFlash, assemble_plan
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Misfit, Surface
from psvideo.model.timing import DroppedFrames, Timing
from psvideo.model.turn import CLOCKWISE, UPRIGHT
from psvideo.plates.ambient.ambient_regression import Separated
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import AMBIENT, Round
from psvideo.report.html import _timing
from psvideo.report.judge import of_motion, of_rows, of_timing, result
from psvideo.report.judge.every_line import judgements
from psvideo.report.judge.of_ambient import ambient
from psvideo.report.judge.of_exposure import exposure as judge_exposure
from psvideo.report.judge.of_frames import frame_light
from psvideo.report.judge.of_lamps import lamps as judge_lamps
from psvideo.report.judge.of_rig import rig as judge_rig
from psvideo.report.judge.powers import power_words
from psvideo.report.judge.rig_by_plates import lights_near
from psvideo.report.judge.rig_of_three import STRONGER, turned_deg
from psvideo.report.judgement import Judgement, verdict_of
from psvideo.report.observe.against_noise import AgainstNoise
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.kept_facts import KeptFacts
from psvideo.report.observe.levels import count_levels
from psvideo.report.observe.motion import glimpse, motion_between
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import rig_points
from psvideo.report.observe.rig_and_curve.slopes import coarse_normals
from psvideo.report.observe.rig_and_curve.yuille1997 import Lean, Lens, lean
from psvideo.report.observe.shadow import shadow_light
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving

SIZE = 96
SEEDS = (0, 1, 2)
Line = tuple[str, str]


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
GOOD = Footage()


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


def flickering(share: float) -> list[list[float]]:
    """Return gains by which the second light's level jumps by a share of it from round to round."""
    return [[1.0, 1.0 + share * (n % 2), 1.0, 1.0, 1.0] for n in range(6)]


def missing(count: int, left: float) -> list[list[float]]:
    """Return gains by which the second light gives only a part in some of twelve rounds."""
    return [[1.0, left if n < count else 1.0, 1.0, 1.0, 1.0] for n in range(12)]


@dataclass(frozen=True, kw_only=True)
class Threshold:
    """What is judged, of which subject, and footage on both sides of the border with its grades."""

    name: str
    judge: Callable[[Observed], Any]
    subject: str
    good: Footage
    grade: str = "good"
    worse: Footage
    worse_grade: str = "doubtful"


def _by(name: str, judge: Callable[[Observed], Any], subject: str, good: dict[str, Any], worse: dict[str, Any],
        grades: str = "good doubtful", **both: Any) -> Threshold:  # fmt: skip
    grade, worse_grade = grades.split()
    return Threshold(
        name=name,
        judge=judge,
        subject=subject,
        good=Footage(**both, **good),
        grade=grade,
        worse=Footage(**both, **worse),
        worse_grade=worse_grade,
    )


LIT = [
    _by("dim", exposure, "exposure", {"stops": -3.4}, {"stops": -3.7}),
    _by("dark", exposure, "exposure", {"stops": -5.8}, {"stops": -6.3}, "doubtful bad"),
    _by("clips", exposure, "clipping", {"clip": 0.016}, {"clip": 0.025}, "nothing doubtful", noise=0),
    _by("clips much", exposure, "clipping", {"clip": 0.23}, {"clip": 0.27}, "doubtful bad", noise=0),
    _by("five are spared", exposure, "clipping", {"lights": 6}, {"lights": 5}, "doubtful bad", noise=0, clip=0.4),
    _by("clips much of three", exposure, "clipping", {"clip": 0.09}, {"clip": 0.11}, "doubtful bad", noise=0, lights=3),
    _by("all clip", exposure, "clipping", {"clip": 0.16}, {"clip": 0.3}, "doubtful bad", noise=0, clipping=5),
    _by("weak", lamps, "lights", {"gains": [1, 0.15, 1, 1, 1]}, {"gains": [1, 0.1, 1, 1, 1]}),
    _by("dead", lamps, "lights", {"gains": [1, 0.012, 1]}, {"gains": [1, 0.008, 1]}, "doubtful bad", lights=3),
    _by("missed", lamps, "lights", {"gains": missing(1, 0.55)}, {"gains": missing(1, 0.45)}, rounds=12),
    _by("missed often", lamps, "lights", {"gains": missing(1, 0.3)}, {"gains": missing(2, 0.3)}, "doubtful bad",
        rounds=12),
    _by("unsteady", lamps, "lights", {"gains": flickering(0.016)}, {"gains": flickering(0.025)}, rounds=6),
    _by("ambient", ambient, "ambient", {"ambient": [0.09]}, {"ambient": [0.11]}),
    _by("ambient lost", ambient, "ambient", {"ambient": [0.48]}, {"ambient": [0.52]}, "doubtful bad"),
    _by("ambient swings", ambient, "ambient", {"ambient": [0.074, 0.087]}, {"ambient": [0.07, 0.09]}, rounds=6),
    _by("ambient noticed", ambient, "ambient", {"ambient": [0.03, 0.06]}, {"ambient": [0.04, 0.08]}, rounds=6),
    _by("ambient measured", ambient, "ambient", {"measured": 0.82}, {"measured": 0.78}, ambient=[0.03]),
    _by("ambient faint", ambient, "ambient", {"ambient": [0.018]}, {"ambient": [0.023]}, measured=0.7),
    _by("focus", result.focus, "focus", {"blur_px": 2.5}, {"blur_px": 3.2}, shape="tiles"),
]  # fmt: skip


def rig_of(one: Observed) -> list[Judgement]:
    return list(judge_rig(one))


def rig_but_leaning(one: Observed) -> list[Judgement]:
    """Judge the rig by all but how its normals lean, which shows sooner: the other lines hold where nothing bends."""
    one.leans.clear()
    return rig_of(one)


def accuracy(one: Observed) -> list[Judgement]:
    return list(result.accuracy(one))


def validity(one: Observed) -> list[Judgement]:
    return list(result.validity(one))


def steadiness(one: Observed) -> list[Judgement]:
    return list(result.steadiness(one.facts))


def levels(share: float) -> list[float]:
    return [1.0, 1.0 + share]


SOLVED = [
    _by("rig", rig_but_leaning, "rig", {"claimed_deg": 15}, {"claimed_deg": 26}, shape="waves", lights=8),
    _by("rig lost", rig_but_leaning, "rig", {"claimed_deg": 26}, {"claimed_deg": 40}, "doubtful bad", shape="waves",
        lights=8),
    _by("strength", rig_of, "rig", {"claimed_gain": 1.15}, {"claimed_gain": 1.4}, shape="waves"),
    _by("turned", rig_but_leaning, "rig", {"turned_deg": 24}, {"turned_deg": 27}, "nothing doubtful", shape="waves",
        lights=3),
    _by("turned around", rig_but_leaning, "rig", {"turned_deg": 31}, {"turned_deg": 35}, "doubtful bad", shape="waves",
        lights=3),
    _by("accuracy", accuracy, "accuracy", {"claimed_deg": 1}, {"claimed_deg": 5}, shape="waves", lights=8),
    _by("noise alone", validity, "validity", {"noise": 0.025}, {"noise": 0.032}, "doubtful bad"),
    _by("weak beside the rig", lamps, "lights", {"gains": [1, 0.15, 1]}, {"gains": [1, 0.1, 1]}, "good bad", lights=3),
    _by("tilted", rig_of, "rig", {"claimed_tilt_deg": 5}, {"claimed_tilt_deg": 9}, "nothing doubtful", lights=3),
    _by("tilted much", rig_of, "rig", {"claimed_tilt_deg": 14}, {"claimed_tilt_deg": 19}, "doubtful bad", lights=8),
    _by("rolled", rig_of, "rig", {"turned_deg": 8}, {"turned_deg": 10}, lights=4),
    _by("away", rig_but_leaning, "rig", {"claimed_tilt_deg": 40}, {"claimed_tilt_deg": 50}, "good bad"),
    _by("sRGB as light", rig_of, "rig", {"recorded": "linear"}, {"recorded": "srgb"}, noise=0.0005),
    _by("light as sRGB", rig_of, "rig", {"recorded": "linear"}, {"recorded": "undone"}),
    _by("near", rig_of, "rig", {"near": 18}, {"near": 14}, shape="waves"),
    _by("near lost", rig_of, "rig", {"near": 4.2}, {"near": 3.3}, "doubtful bad", shape="waves"),
    _by("validity", validity, "validity", {"dark": 0.35}, {"dark": 0.45}),
    _by("validity lost", validity, "validity", {"dark": 0.75}, {"dark": 0.85}, "doubtful bad"),
    _by("noise", steadiness, "noise", {"noise": 0.015}, {"noise": 0.022}, "nothing doubtful",
        shape="waves", stops=-0.1, rounds=2, lights=3),
    _by("noise lost", steadiness, "noise", {"noise": 0.042}, {"noise": 0.06}, "doubtful bad",
        shape="waves", stops=-0.1, rounds=2, lights=3),
    _by("flicker", steadiness, "flicker", {"gains": [[1.0] * 3, [1.008] * 3]}, {"gains": [[1.0] * 3, [1.013] * 3]},
        rounds=2, lights=3),
]  # fmt: skip


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("times_noise", "grade"), [(80, "good"), (24, "good"), (13, "doubtful"), (7, "doubtful"), (3, "bad"), (1, "bad")]
)
@pytest.mark.parametrize(
    ("transfer", "stops"), [("logc3", -6.4), ("slog3", -5.9), ("logc4", -11.0), ("st2084", -7.0), ("hlg", -4.5)]
)
def test_a_scene_far_below_its_curves_end_is_judged_by_its_noise(
    transfer: str, stops: float, times_noise: float, grade: str, seed: int
) -> None:
    """LogC3 with diffuse white where it belongs was "not usable": 6.4 stops below the largest code, and 25 times its
    noise."""
    one = Footage(stops=stops, noise=2.0**stops / times_noise).observed(seed)
    plan = plan_of(one.lights)
    for white in (None, 50000.0):  # the plan may say where the sensor saturates
        encoding = Encoding(transfer=transfer, white_level=white)
        lines = judgements(replace(plan, camera=replace(plan.camera, encoding=encoding)), timing_of(), one)
        assert graded(lines, "exposure") == grade
        said = next(line.found for line in lines if line.subject == "exposure")
        assert ("saturation" in said) == (white is not None)


def test_a_bright_scene_is_not_dark_for_its_grain() -> None:
    one = Footage(stops=-2, noise=0.05).observed(0)
    assert graded(list(judge_exposure(one, under="the largest code")), "exposure") == "good"


@pytest.mark.parametrize(("read", "photon"), [(1e-6, 0.0), (1e-7, 1e-4), (0.0, 1e-3)])
def test_so_many_stops_more_light_is_as_many_times_its_noise(read: float, photon: float) -> None:
    dim = AgainstNoise(level=0.003, read=read, photon=photon)
    lit = replace(dim, level=dim.level * 2 ** dim.stops_to(25))
    assert lit.ratio == pytest.approx(25)


def test_a_subject_that_clips_everywhere_is_called_so_and_is_told_to_look_again() -> None:
    lines = exposure(Footage(shape="waves", stops=3, noise=0).observed(0))
    assert graded(lines, "clipping") == "bad"
    assert "10 %" in next(line.advice for line in lines if line.subject == "clipping")


@pytest.mark.parametrize("case", LIT, ids=lambda case: case.name)
@pytest.mark.parametrize("seed", SEEDS)
def test_light_on_both_sides_of_a_threshold_is_told_apart(case: Threshold, seed: int) -> None:
    assert graded(case.judge(case.good.observed(seed)), case.subject) == case.grade
    assert graded(case.judge(case.worse.observed(seed)), case.subject) == case.worse_grade


@pytest.mark.parametrize("case", SOLVED, ids=lambda case: case.name)
@pytest.mark.parametrize("seed", SEEDS)
def test_results_on_both_sides_of_a_threshold_are_told_apart(case: Threshold, seed: int) -> None:
    assert graded(case.judge(replace(case.good, solved=True).observed(seed)), case.subject) == case.grade
    assert graded(case.judge(replace(case.worse, solved=True).observed(seed)), case.subject) == case.worse_grade


def test_what_is_left_beyond_noise_makes_a_take_doubtful_and_then_bad_whatever_is_to_blame() -> None:
    one = Footage().observed(0)

    def said(off_deg: float) -> tuple[str, str]:
        misfit = Misfit(share=0.1, error_deg=off_deg / result.MEAN_OF_HELD)
        one.facts = KeptFacts(replace(facts, misfit=misfit, valid_share=0.1, measured_share=1.0) for facts in one.facts)
        return graded(accuracy(one), "accuracy"), graded(validity(one), "validity")

    assert [said(off_deg) for off_deg in (2.9, 3.1, 14.9, 15.1)] == [
        ("good", "bad"), ("doubtful", "doubtful"), ("doubtful", "doubtful"), ("bad", "bad")
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("shape", "footage", "share", "grade"),
    [
        ("ball", {"claimed_deg": 7}, 0.06, "doubtful"),
        ("waves", {"claimed_deg": 7}, 0.06, "doubtful"),
        ("ball", {"claimed_deg": 7}, 0.04, "bad"),  # hardly a normal is trusted, whatever is to blame
        ("ball", {"claimed_deg": 19}, 0.06, "bad"),  # the rig does not explain the light
        ("waves", {"noise": 0.03}, 0.06, "bad"),
    ],
)
@pytest.mark.parametrize("seed", range(3))
def test_of_four_lights_that_the_rig_nearly_explains_a_twentieth_must_be_trusted(
    shape: str, footage: dict[str, Any], share: float, grade: str, seed: int
) -> None:
    one = Footage(shape=shape, lights=4, rounds=2, solved=True, **footage).observed(seed)
    one.facts = KeptFacts(replace(facts, valid_share=share, measured_share=1.0) for facts in one.facts)
    assert graded(validity(one), "validity") == grade


@pytest.mark.parametrize(("claimed_deg", "grade"), [(0, "good"), (3, "good"), (8, "unknown")])
@pytest.mark.parametrize("shape", ["ball", "waves"])
def test_four_lights_that_leave_what_wrong_directions_would_do_not_show_the_rig_to_be_right(
    shape: str, claimed_deg: float, grade: str
) -> None:
    for seed in range(3):
        one = Footage(shape=shape, lights=4, claimed_deg=claimed_deg, solved=True).observed(seed)
        assert {line.grade for line in rig_but_leaning(one) if line.subject == "rig"} == {grade}


def test_files_read_by_another_curve_than_they_say_are_doubtful_and_motion_is_not_blamed() -> None:
    one = Footage().observed(0)
    misfit = Misfit(share=0.1, error_deg=3.1 / result.MEAN_OF_HELD)
    one.facts = KeptFacts(
        replace(facts, misfit=misfit, valid_share=0.1, measured_share=1.0, moving_share=1.0) for facts in one.facts
    )
    (lacking,) = result.validity(one)
    assert "Move slower" in lacking.advice
    (lacking,) = result.validity(one, first=result.first_of_all((), curve_doubted=True))
    assert lacking.advice == result.CURVE_FIRST
    said = list(judge_rig(one, curve_doubt="the files are tagged 'hlg'"))
    assert [(line.grade, line.found) for line in said] == [("doubtful", "The files are tagged 'hlg'.")]


@pytest.mark.parametrize(("noise_deg", "blamed"), [(3.9, "Move slower, raise"), (4.1, "Noise alone turns")])
def test_where_noise_alone_spoils_normals_motion_is_not_blamed(noise_deg: float, blamed: str) -> None:
    one = Footage().observed(0)
    misfit = Misfit(share=0.01, error_deg=6.0, noise_deg=noise_deg / result.MEAN_OF_HELD)
    one.facts = KeptFacts(
        replace(facts, misfit=misfit, valid_share=0.16, measured_share=0.98, moving_share=0.14) for facts in one.facts
    )
    (lacking,) = result.validity(one)
    assert blamed in lacking.advice


def test_a_guessed_order_is_blamed_before_the_rig_where_normals_are_no_surface_s() -> None:
    one = Footage().observed(0)
    one.slopes[:] = [-0.2]
    guessed, known = (
        " ".join(f"{line.found} {line.advice}" for line in judge_rig(one, guessed=g)) for g in (True, False)
    )
    assert "the order of the lights is a guess" in guessed
    assert "first_light" in guessed
    assert "camera axes" not in guessed
    assert "camera axes" in known


def test_ambient_light_that_is_the_same_everywhere_is_called_a_black_level() -> None:
    one = Footage().observed(0)
    one.facts = KeptFacts(replace(facts, ambient=0.3) for facts in one.facts)
    for even, named in ((0.95, True), (0.5, False)):
        one.dark_evenness = array("d", [even])
        assert ("black_level" in ambient(one).advice) == named
        assert ambient(one).grade == "doubtful"


@pytest.mark.parametrize(("shape", "named"), [("ball", True), ("card", False)])
def test_even_ambient_light_over_an_even_card_is_no_black_level(shape: str, named: bool) -> None:
    one = Footage(shape=shape, ambient=(0.3,)).observed(0)
    assert ("black_level" in ambient(one).advice) == named


def timed(**changed: Any) -> str:
    return graded(list(of_timing.timing_and_order(timing_of(**changed), "rolling")), "timing")


def covered(subject: str, footage: Footage = GOOD, *, dark_s: float = 0.01, **changed: Any) -> str:
    """Return what is said of rows under a rolling plan of 5 ms flashes with this dark time, at an exposure of 10 ms."""
    plan = plan_of(["a"], mode="rolling", dark_s=dark_s)
    return graded(list(of_rows.coverage(plan, timing_of(**changed), footage.observed(0))), subject)


def moved(px_per_flash: float, *, aligned: bool = False) -> str:
    """Return what is said of paint that moves by so much from flash to flash of one light, a flash a second."""
    one = Footage(shape="waves", lights=1, rounds=4, shift_px=px_per_flash).observed(0)
    return graded(
        of_motion.motion(plan_of(one.lights, fps=1), timing_of(frame_period_s=1.0), one, aligned=aligned), "motion"
    )


def test_times_rows_and_motion_on_both_sides_of_a_threshold_are_told_apart() -> None:
    assert [timed(phase_error_rows=rows) for rows in (0.28, 0.32, 1.9, 2.1)] == ["good", "doubtful", "doubtful", "bad"]
    assert [covered("rows", dark_s=dark_s) for dark_s in (0.00985, 0.0097, 0.0077, 0.0073)] == [
        "good", "doubtful", "doubtful", "bad"
    ]  # fmt: skip
    unseen = [covered("rows", Footage(unseen=share)) for share in (0.01, 0.04, 0.28, 0.33)]
    assert unseen == ["good", "doubtful", "doubtful", "bad"]
    borrowed = [covered("rows", Footage(borrowed=share), exposure_s=open_s) for share, open_s in
                ((0.01, 0.005), (0.2, 0.00975), (0.2, 0.0096))]  # fmt: skip
    assert borrowed == ["good", "good", "doubtful"]
    assert covered("frames", dropped_frames=(DroppedFrames(after=3, count=1),)) == "doubtful"
    assert [moved(px) for px in (0, 1, 2, 4, 5)] == ["good", "good", "doubtful", "doubtful", "bad"]
    assert moved(5, aligned=True) == "doubtful"


def test_rows_whose_ambient_light_no_part_of_a_flash_tells_are_not_laid_to_the_shutter() -> None:
    plan, one = plan_of(["a"], mode="rolling", dark_s=0.01), Footage(unseen=0.1).observed(0)
    (said,) = of_rows.coverage(plan, timing_of(), one)
    assert said.grade == "doubtful"
    assert "dark slot" in said.advice
    assert "360" not in said.advice
    assert graded(list(of_rows.coverage(plan, timing_of(), one, take_s=5.0)), "rows") == "good"
    dark = replace(plan, flashes=(*plan.flashes, replace(plan.flashes[0], lights={})))
    assert "360" in next(of_rows.coverage(dark, timing_of(), one)).advice


def test_rows_that_the_rest_of_the_take_shows_are_not_lost_unless_the_strobe_keeps_step() -> None:
    """Below 360 degrees a part of a take shows fewer rows than all of it."""

    def said(dark_s: float, take_s: float | None) -> tuple[str, str]:
        plan = plan_of(["a"], mode="rolling", dark_s=dark_s)
        found = list(
            of_rows.coverage(plan, timing_of(exposure_s=0.005), Footage(unseen=0.5).observed(0), take_s=take_s)
        )
        return graded(found, "rows"), " ".join(f"{one.found} {one.advice}" for one in found)

    flash_s = plan_of(["a"], mode="rolling", dark_s=0.01).flashes[0].duration_s
    assert said(0.0105, 5.0)[0] == "doubtful"
    assert said(0.0105, None)[0] == "bad"
    for take_s in (None, 5.0):
        grade, words = said(0.01 - flash_s, take_s)
        assert grade == "bad"
        assert "keeps step" in words
        assert "dark_s" in words


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("around", "grade"), [(0.0, "unknown"), (0.025, "unknown"), (0.06, "doubtful")])
def test_light_that_is_left_in_attached_shadow_is_said_where_no_dark_slot_shows_it(
    around: float, grade: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    ways = ring(6) * [1.7, 1.7, 0.6]
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    normals, albedo = ball(0)
    shades = [albedo * (np.maximum(normals @ way, 0) + around) for way in ways]
    plates = [(shade + rng.normal(0, 0.001, shade.shape)).astype(np.float32) for shade in shades]
    surface = Solving().solve(plates, Illumination(directions=ways, intensities=np.ones((6, 1))))
    left = shadow_light(np.array(plates), np.ones((6, SIZE, SIZE), np.bool_), surface, ways, step=1)
    assert left is not None
    one = Observed(lights=("a",), in_shadow=[left])
    assert ambient(one).grade == grade


@pytest.mark.parametrize(("ambient", "said"), [(0.03, False), (0.08, True)])
def test_ambient_light_that_no_flash_freezes_is_said_with_its_blur_and_its_lean(ambient: float, said: bool) -> None:
    plan = replace(plan_of(["a"], fps=1), mode="rolling")
    timing = timing_of(frame_period_s=1.0, exposure_s=0.5, row_time_s=1.0 / SIZE)
    one = Footage(shape="waves", lights=1, rounds=4, shift_px=4).observed(0)
    one.facts = KeptFacts(replace(facts, ambient=ambient) for facts in one.facts)
    found = of_motion.motion(plan, timing, one).found
    assert ("do not freeze the ambient light, 8 % of the signal" in found) == said
    speed_px_s = float(np.median([facts.speed_px_s or 0.0 for facts in one.facts[1:]]))
    assert not said or f"blurs by up to {0.5 * speed_px_s:.0f} px and leans by {speed_px_s:.0f} px" in found


@pytest.mark.parametrize("fill", [True, False])
def test_validity_is_counted_over_the_subject_filled_or_not_before_a_dim_backdrop(fill: bool) -> None:
    one = Footage(dark=0.45, solved=True, fill=fill)
    for backdrop in (0.0, 0.02):
        (facts,) = replace(one, backdrop=backdrop).observed(0).facts
        assert facts.valid_share is not None
        assert 0.48 < facts.valid_share < 0.58, "of the ball; what is behind it counts neither way"


def test_lights_nearly_in_a_plane_are_named_where_normals_lean_and_the_rig_is_not_blamed_alone() -> None:
    one = Footage(solved=True).observed(0)
    one.leans[:] = [Lean(lean_deg=20.0, gain=1.0, turn_deg=(20.0, 0.0, 0.0), rest_deg=0.2)]
    (line,) = rig_of(one)
    assert (line.grade, "tilted up or down as a whole by about 20 degrees" in line.found) == ("bad", True)
    assert one.points is not None
    one.points = replace(one.points, vectors=one.points.vectors * [1, 1, 0.05])
    one.light_at_points.clear()
    (line,) = (each for each in rig_of(one) if "lean" in each.found)
    assert (line.grade, "nearly in a plane" in line.found) == ("doubtful", True)
    one.facts = KeptFacts(replace(facts, clipped_share=0.2) for facts in one.facts)
    assert not any("lean" in each.found for each in rig_of(one)), "what clips leans normals, too"


def lenses(*, right: float, tilt_deg: float, width: float = 0.6) -> np.ndarray:
    """Return normals of a wall of waves seen through a lens, ``width`` the picture's over the focal length, whose axis
    lies so many widths ``right`` of its middle, turned by an angle around the picture's columns."""
    rows, cols = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    x, y = width * (cols / SIZE - right), -width * rows / SIZE
    far = np.ones_like(x)
    for _ in range(50):  # the wall stands at 1 and swells by height(x, y)
        height, across, up = _swell(x * far, y * far)
        far = 1 - height
    normals = np.stack([-across, -up, np.ones_like(up)], axis=-1)
    turn = np.radians(tilt_deg)
    turned = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True) @ turned.T)


def _swell(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a height and its slopes."""
    one, other = 20 * x + 14 * y, 24 * y - 8 * x
    height = 0.02 * (np.sin(one) + np.cos(other))
    return height, 0.02 * (20 * np.cos(one) + 8 * np.sin(other)), 0.02 * (14 * np.cos(one) - 24 * np.sin(other))


@pytest.mark.parametrize(
    ("right", "tilt_deg", "lens", "subject"),
    [
        (0.0, 0, None, "nothing"),
        (0.3, 0, None, "lens"),  # a shifted lens and a right rig
        (0.3, 0, Lens(width=0.6, right=0.3), "nothing"),
        (0.0, 9, Lens(width=0.6), "rig"),
        (0.0, 9, None, "lens"),  # which of them it is, nobody can tell
        (0.0, 25, None, "rig"),  # no lens shifts so far
    ],
)
def test_a_rig_is_not_doubted_for_what_a_shifted_lens_that_nobody_named_would_explain(
    right: float, tilt_deg: float, lens: Lens | None, subject: str
) -> None:
    one = Footage(solved=True).observed(0)
    normals = lenses(right=right, tilt_deg=tilt_deg).astype(np.float32)
    surface = Surface(
        normals=normals, albedo=np.ones((SIZE, SIZE, 1), np.float32), valid=np.ones((SIZE, SIZE), np.bool_)
    )
    found = lean(coarse_normals(surface), lens=lens)
    assert found is not None
    one.leans[:] = [found]
    doubted = [line for line in rig_of(one) if line.grade != "good"]
    assert [line.subject for line in doubted] == ([] if subject == "nothing" else [subject])
    assert verdict_of(doubted).startswith("This take is usable") == (subject != "rig")


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("shape", "sheen"), [("ball", (0.4, 30)), ("waves", (0.8, 6))])
def test_among_many_lights_those_that_are_not_as_strong_as_the_rig_says_are_named(
    shape: str, sheen: tuple[float, float], seed: int
) -> None:
    """Photographs of a bear, of which a few were a quarter brighter, were said to show a surface that is not matte."""
    off, right = (
        Footage(shape=shape, lights=8, gains=gains, sheen=sheen, solved=True).observed(seed)
        for gains in ([1.0, 1.2, 1.0, 1.0, 1.0, 0.82, 1.0, 1.0], [1.04, 0.96] * 4)
    )
    (line,) = (one for one in rig_but_leaning(off) if one.grade != "good")
    assert (line.subject, line.grade) == ("rig", "doubtful")
    assert re.search(r"it would: 'light5' 8[1-4] %, 'light1' 1(1[7-9]|2[01]) % of what the rig says", line.found)
    assert not any("other strengths" in one.found for one in rig_of(right))
    assert "not as strong" in " ".join(one.found for one in result.accuracy(off))


@pytest.mark.parametrize("seed", SEEDS)
def test_strengths_are_told_beside_a_light_that_is_dead(seed: int) -> None:
    gains = [1.0, 1.3, 1.0, 0.0, 1.0, 0.75, 1.0, 1.0, 1.0]
    dead = Footage(shape="waves", lights=9, gains=gains, sheen=(0.2, 12), solved=True).observed(seed)
    assert any("'light5' 7" in one.found and "'light3'" not in one.found for one in rig_but_leaning(dead))
    assert "not as strong" in " ".join(one.found for one in result.accuracy(dead))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("share", [0.07, 0.3])
def test_strengths_are_told_beside_a_light_that_the_rig_calls_weak(share: float, seed: int) -> None:
    """Under a tenth of the others' it was in shadow everywhere, and of no light was said how strong it is."""
    gains = [share, 1.2, 1.0, 0.8, 1.0, 1.0, 1.0, 1.0]
    off, right = (
        Footage(shape="waves", lights=8, gains=own, claimed_gain=share, sheen=(0.2, 12), solved=True).observed(seed)
        for own in (gains, [share] + [1.0] * 7)
    )
    assert any("'light3' 8" in one.found and "'light0'" not in one.found for one in rig_but_leaning(off))
    assert "not as strong" in " ".join(one.found for one in result.accuracy(off))
    assert right.rig_fit is not None
    assert not any("not as strong" in one.found or "other strengths" in one.found for one in rig_of(right))


@pytest.mark.parametrize("seed", SEEDS)
def test_skin_that_bulges_is_not_taken_for_light_that_stands_near(seed: int) -> None:
    satin = Footage(shape="ball", lights=6, sheen=(0.8, 6), solved=True).observed(seed)
    fit = satin.rig_fit
    assert fit is not None
    assert fit.near is not None
    assert fit.near.misfit < 0.8 * fit.misfit  # lamps would explain it, too
    assert fit.near.by_surface < fit.near.misfit
    assert not any("stand near" in line.found for line in rig_of(satin))


def test_a_rig_is_fitted_once_until_more_is_seen() -> None:
    seen = Footage(shape="ball", lights=6, solved=True, rounds=3).observed(0)
    fit = seen.rig_fit
    assert fit is not None
    assert seen.rig_fit is fit  # a report asks three times
    dimmed = seen.light_at_points[0]
    seen.light_at_points.append(dimmed._replace(light=0.5 * dimmed.light))
    wider = seen.rig_fit
    assert wider is not fit
    assert wider is not None
    assert seen.points is not None
    assert wider == seen.points.fit(seen.light_at_points, seen.firing)


@pytest.mark.parametrize(("by_surface", "named"), [(0.9, True), (0.5, False)])
def test_lamps_are_said_to_stand_near_where_that_explains_more_than_the_surface_would(
    by_surface: float, named: bool
) -> None:
    fit = Footage(shape="ball", lights=6, sheen=(0.8, 6), solved=True).observed(0).rig_fit
    assert fit is not None
    assert fit.near is not None
    near = replace(fit.near, rise=0.5, misfit=0.6 * fit.misfit, by_surface=by_surface * fit.misfit)
    found = lights_near(replace(fit, near=near))
    assert (found is not None) == named


def test_a_dead_light_among_enough_others_is_named_and_left_out_and_the_rig_is_still_checked() -> None:
    dead = Footage(lights=6, gains=[1, 1, 0, 1, 1, 1], solved=True).observed(0)
    (line,) = lamps(dead)
    assert (line.grade, line.found) == (
        "doubtful", "The light 'light2' gives no light (0.0 % of the strongest); normals come from the other 5."
    )  # fmt: skip
    assert verdict_of([line, *rig_of(dead), *validity(dead)]) == "This take is usable, with reservations."
    wrong = Footage(shape="waves", lights=6, gains=[1, 1, 0, 1, 1, 1], claimed_deg=40, solved=True).observed(0)
    assert graded(rig_but_leaning(wrong), "rig") in ("doubtful", "bad")


@pytest.mark.parametrize("lights", [3, 5])
def test_three_lights_do_not_show_how_far_normals_are_off_and_that_is_said(lights: int) -> None:
    said = accuracy(Footage(lights=lights, solved=True).observed(0))
    grades = [line.grade for line in said if "three lights explain any surface" in line.found]
    assert grades == (["unknown"] if lights == 3 else [])
    assert all("cannot check each other" in line.found for line in said if line.grade == "unknown")


def test_many_dead_lights_are_one_line() -> None:
    (line,) = lamps(Footage(lights=10, gains=[1, 1, 0, 1, 0, 0, 0, 0, 1, 1], solved=True).observed(0))
    assert line.found == (
        "5 lights give no light ('light2', 'light4', 'light5', 'light6' and 1 more; at most 0.0 % of the strongest); "
        "normals come from the other 5."
    )


@pytest.mark.parametrize(("dimmed", "failed"), [(1.0, False), (0.2, True)])
def test_a_light_does_not_fail_where_only_the_value_changes_at_which_it_clips(dimmed: float, failed: bool) -> None:
    """Lamps of several colours that are separated clip at another value in every round."""
    one = Observed(lights=("a", "b", "c"))
    for number in range(8):
        white = 5.0 if number == 2 else 1.0
        levels = tuple(level * (dimmed if number == 2 else 1.0) / white for level in (0.3, 0.2, 0.25))
        one.facts.append(
            InstantFacts(number=number, time_s=0.0, valid_share=1.0, clipped_share=0.0, unseen_share=0.0,
                         levels=levels, clipped=(0.0,) * 3, white=(white,) * 3, moving_share=0.0)
        )  # fmt: skip
    assert any("Nothing is lit in 1 of 8 rounds" in line.found for line in lamps(one)) == failed
    assert not any("flickers" in line.found for line in lamps(one))


@pytest.mark.parametrize("passing", [False, True])
def test_motion_and_sharpness_are_looked_for_in_plates_that_are_lit_where_the_first_light_is_dead(
    passing: bool,
) -> None:
    dark = Footage(shape="tiles", lights=4, gains=[0, 1, 1, 1], noise=0.001)
    rounds = [dark._round([f"light{n}" for n in range(4)], plates, plates, number)
              for number, plates in enumerate(_tiles_that_move(dark, 3))]  # fmt: skip
    one = Observed(lights=rounds[0].lights)
    for each in rounds:
        for plate in each.plates if passing else ():
            one.look(plate)
        one.add(each)
    assert one.watched == "light1"
    assert one.blurs_px
    assert one.blurs_px[0] < result.SOFT_PX
    assert [facts.moving_share is not None and facts.moving_share > 0.05 for facts in one.facts[1:]] == [True, True]


def _tiles_that_move(footage: Footage, rounds: int) -> list[list[np.ndarray]]:
    rng = np.random.default_rng(0)
    each = []
    for number in range(rounds):
        clean = [np.roll(one, 4 * number, axis=1) for one in footage._plates(ring(footage.lights), 0)]
        each.append([(one + rng.normal(0, footage.noise, one.shape)).astype(np.float32) for one in clean])
    return each


def test_a_light_of_which_no_frame_showed_the_subject_is_not_called_dead() -> None:
    one = Footage(rounds=2).observed(0)
    one.counts[one.lights[0]] = np.zeros_like(one.counts[one.lights[0]])
    one.facts = KeptFacts(replace(fact, levels=(0.0, *fact.levels[1:])) for fact in one.facts)
    assert [line.grade for line in lamps(one)] == ["good"]


def test_what_is_clipped_does_not_seem_to_move_where_the_rows_that_two_frames_share_roll() -> None:
    """Two halves of a flash, each below saturation, add up to more than a whole one that is clipped."""

    def plate(number: int) -> LightPlate:
        light = 2 * tiles(0)[1]
        shared = (np.arange(SIZE) - 24 * number) % SIZE < 24
        clipped = np.where(shared[:, None], light, np.minimum(light, 1)).astype(np.float32)
        return LightPlate(
            light="a", number=number, time_s=float(number), picture=mixture_of(clipped), seen=np.ones(SIZE, np.bool_)
        )

    one = glimpse(plate(0))
    found = motion_between(one, glimpse(plate(1), one.white))
    assert found is not None
    assert (found.speed_px_s, found.share) == (0, 0)


def test_a_light_that_was_never_seen_does_not_pass_for_a_bright_one() -> None:
    dim = np.full(1000, 0.005, np.float32)
    one = Observed(lights=("a", "b"))
    one.counts["a"], one.counts["b"] = count_levels(dim, 1.0), np.zeros_like(count_levels(dim, 1.0))
    (line,) = judge_exposure(one)
    assert (line.grade, "The picture is dark" in line.found) == ("bad", True)
    assert list(power_words(plan_of(("a", "b")), one)) == ["a"]


def facts_of(**what: Any) -> InstantFacts:
    known = {"number": 1001, "time_s": 0.0, "valid_share": 1.0, "clipped_share": 0.0, "unseen_share": 0.0}
    return InstantFacts(**{**known, **what})


@pytest.mark.parametrize("hole", [(), (DroppedFrames(after=7, count=1),)])
def test_rows_that_nobody_saw_are_judged_beside_a_missing_frame(hole: tuple[DroppedFrames, ...]) -> None:
    timing = replace(timing_of(), dropped_frames=hole, repeated_frames=(9,))
    one = Observed(lights=("a",), facts=KeptFacts([facts_of(unseen_share=0.8)]))
    lines = list(of_rows.coverage(plan_of(("a",)), timing, one))
    assert (lines[0].subject, lines[0].grade) == ("rows", "bad")
    assert {line.subject for line in lines} == {"rows", "frames"}


def test_every_row_is_said_to_be_seen_only_where_every_row_was() -> None:
    found = []
    for share in (0.0, 0.015):
        one = Observed(lights=("a",), facts=KeptFacts([facts_of(unseen_share=share)]))
        (line,) = of_rows.coverage(plan_of(("a",)), timing_of(), one)
        found.append((line.grade, line.found.split(" seen")[0]))
    assert found == [("good", "Every row of every round was"), ("good", "All but 1.5 % of the rows were")]


def test_motion_in_a_few_rounds_is_said() -> None:
    speeds = [0.0] * 19 + [900.0]
    rounds = [facts_of(moving_share=0.1 if speed else 0.0, speed_px_s=speed) for speed in speeds]
    one = Observed(lights=("a",), facts=KeptFacts(rounds))
    line = of_motion.motion(plan_of(("a",)), timing_of(), one)
    assert "Nothing moves" not in line.found
    assert "In nine of ten rounds" in line.found


def test_frames_with_values_that_are_no_numbers_are_judged_by_the_others() -> None:
    image = np.full((40, 40), 0.5, np.float32)
    image[0, 0] = np.nan
    assert frame_light(image).top == pytest.approx(0.5)


def test_lights_that_were_never_seen_are_not_said_to_fire() -> None:
    one = Observed(lights=("a", "b", "c"))
    bright = count_levels(np.full(100, 0.5, np.float32), 1.0)
    one.counts |= {"a": bright, "b": bright, "c": np.zeros_like(bright)}
    for number in range(4):
        one.facts.append(facts_of(number=number, levels=(0.4, 0.4, 0.4), clipped=(0.0,) * 3, white=(1.0,) * 3,
                                  unseen_share=0.1 if number else 0.0))  # fmt: skip
    (line,) = lamps(one)
    assert line.found == "The 2 of 3 lights that were seen fire; the weakest gives 0.0 stops less than the strongest."


@pytest.mark.parametrize(("share", "grades"), [(0.09, []), (0.11, ["doubtful"])])
def test_what_is_not_known_of_near_lights_distance_is_said_and_not_laid_upon_the_surface(
    share: float, grades: list[str]
) -> None:
    one = Footage().observed(0)
    misfit = Misfit(share=0.01, error_deg=1.0, distance_share=share)
    one.facts = KeptFacts(replace(facts, misfit=misfit, valid_share=0.4, measured_share=1.0) for facts in one.facts)
    assert [line.grade for line in result.distance(one)] == grades
    (lacking,) = validity(one)
    assert ("line on distance" in lacking.advice) is bool(grades)
    assert [line.grade for line in accuracy(one)] == ["good"]


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


@pytest.mark.parametrize(
    ("unseen", "dark_unseen"), [((0, 0), 0), ((SIZE, SIZE), 0), ((0, 0), SIZE // 2), ((SIZE, 8), SIZE // 4)]
)
def test_ambient_lights_share_is_of_what_was_seen(unseen: tuple[int, int], dark_unseen: int) -> None:
    plates = [even("a", 0.46), *(even(name, 0.46, unseen=slice(rows)) for name, rows in zip("bc", unseen, strict=True))]
    observed = looked_at(plates, even(AMBIENT, 0.04, unseen=slice(dark_unseen)))
    assert observed.facts[0].ambient == pytest.approx(0.08)


def test_what_is_dim_where_no_frame_saw_the_dark_slot_does_not_make_it_uneven() -> None:
    lit = LightPlate(
        light="a", number=1001, time_s=0.0, seen=np.ones(SIZE, np.bool_),
        picture=mixture_of(np.tile(np.linspace(0.1, 0.9, SIZE, dtype=np.float32), (SIZE, 1))),
    )  # fmt: skip
    observed = looked_at([lit], even(AMBIENT, 0.04, unseen=slice(SIZE // 2)))
    assert observed.dark_evenness[0] == pytest.approx(1)


def test_the_share_that_clips_is_of_what_was_seen() -> None:
    observed = looked_at([even("a", 0.5, unseen=slice(SIZE // 2), clips=0.25), even("b", 0.5)])
    assert observed.facts[0].clipped == (0.25, 0.0)
    assert observed.levels("a").clipped_share == pytest.approx(0.25)


def test_rows_that_nobody_saw_are_not_borrowed() -> None:
    shown_s = np.zeros(SIZE)
    shown_s[24:36] = 1.0
    plate = replace(even("a", 0.5, unseen=slice(24)), shown_s=shown_s)
    assert looked_at([plate]).facts[0].borrowed_share == pytest.approx(12 / SIZE)


@pytest.mark.parametrize(("opened", "mode", "said"), [(0.9, "rolling", False), (1.0, "synced", True)])
def test_rows_that_a_closed_shutter_costs_are_not_laid_to_a_missing_frame(opened: float, mode: str, said: bool) -> None:
    timing = timing_of(exposure_s=0.01 * opened, dropped_frames=(DroppedFrames(after=3, count=1),))
    one = Observed(lights=("a",), facts=KeptFacts([facts_of(unseen_share=0.1)] * 12))
    lines = list(of_rows.coverage(plan_of(("a",), mode=mode, dark_s=0.01), timing, one))
    assert ("spoils 12 of 12 rounds" in next(line.found for line in lines if line.subject == "frames")) == said


def test_lamps_are_not_said_to_fire_where_nothing_is_lit() -> None:
    one = looked_at([even(name, 0.0) for name in "abc"])
    assert [line.subject for line in (*exposure(one), *lamps(one))] == ["exposure"]


def test_a_mask_that_slips_between_the_points_looked_at_is_not_called_dark() -> None:
    mask = np.zeros((SIZE, SIZE), np.bool_)
    mask[:, 13:16] = True
    one = looked_at([even(name, 0.5) for name in "abc"], masks=Masks(still=mask))
    assert [(line.subject, line.grade) for line in (*exposure(one), *lamps(one))] == [("mask", "doubtful")]
    solved = Surface(
        normals=np.tile(np.array([0, 0, 1], np.float32), (SIZE, SIZE, 1)),
        albedo=np.ones((SIZE, SIZE), np.float32),
        valid=mask,
    )
    one.add(Round(number=1002, plates=tuple(even(name, 0.5) for name in "abc")), solved)
    assert one.facts[1].valid_share is None


@pytest.mark.parametrize(("moving", "named"), [(0.0, ["a", "b"]), (0.3, []), (None, [])])
def test_lamps_flicker_only_where_it_is_known_that_nothing_moves(moving: float | None, named: list[str]) -> None:
    levels = 0.3 * (1 + 0.1 * np.sin(1.9 * np.arange(10)))
    facts = [
        facts_of(levels=(level, level), clipped=(0.0,) * 2, white=(1.0,) * 2, moving_share=moving) for level in levels
    ]
    said = [
        line.found for line in lamps(Observed(lights=("a", "b"), facts=KeptFacts(facts))) if "flickers" in line.found
    ]
    assert [line.split("'")[1] for line in said] == named


def test_one_light_is_not_compared_with_itself() -> None:
    assert [line.found for line in lamps(looked_at([even("a", 0.5)]))] == ["The light fires in every round."]


@pytest.mark.parametrize(
    ("known", "words"),
    [
        ({"row_time_s": 0.0, "phase_error_rows": 0.05, "phase_error_s": 2e-6}, "2 us"),
        ({"phase_error_rows": 0.05, "phase_error_s": 5e-6}, "5 us, 0.05 row"),
        ({"phase_error_rows": 0.05}, "0.05 row"),
        ({"phase_error_rows": 0.0}, "not fitted"),
    ],
)
def test_the_report_says_how_sure_flash_times_are_as_the_timing_does(known: dict[str, float], words: str) -> None:
    timing = timing_of(**known)
    report: Any = SimpleNamespace(timing=timing)
    assert f"<td>{words}</td>" in _timing(report)
    assert timing.how_sure == ("" if words == "not fitted" else f"Flash times are known to {words}.")


ALL_WEAKER, ONE_WEAKER = (0.3,), (1.0, 0.1, 1.0, 1.0)
"""Powers of four lights in a plan. Their plates are at full power, so that saturation lies at 3.3 and at 10."""


@pytest.mark.parametrize("powers", [ALL_WEAKER, (0.2, 0.5, 1.0, 0.3)])
@pytest.mark.parametrize("shape", ["ball", "waves"])
@pytest.mark.parametrize("seed", SEEDS)
def test_a_right_curve_is_not_doubted_where_flashes_are_weaker_than_full(
    shape: str, powers: Sequence[float], seed: int
) -> None:
    """All that lay above 1.0 was bent to one value, which any rig explains."""
    right, wrong = (
        Footage(
            shape=shape, lights=4, noise=0.0002, gains=powers, powers=powers, recorded=recorded, solved=True
        ).observed(seed)
        for recorded in ("linear", "srgb")
    )
    assert graded(rig_of(right), "rig") == "good"
    assert any("recorded as sRGB" in line.found for line in rig_of(wrong))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_light_that_the_plan_itself_sets_weak_is_not_held_against_the_rig(seed: int) -> None:
    gains = [1.0, 0.1, 1.0, 1.0]
    as_planned, weaker = (
        lamps(Footage(lights=4, gains=gains, powers=powers, solved=True).observed(seed))
        for powers in (ONE_WEAKER, (1.0,))
    )
    assert graded(as_planned, "lights") == "doubtful"  # its noise is larger, and no more
    assert graded(weaker, "lights") == "bad"


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("powers", [(1.0,), ALL_WEAKER])
def test_ambient_light_is_compared_with_what_the_flash_gave_not_with_a_full_one(
    powers: Sequence[float], seed: int
) -> None:
    just_good, just_bad = (
        ambient(Footage(lights=4, ambient=[share], powers=powers).observed(seed)) for share in (0.09, 0.11)
    )
    assert (just_good.grade, just_bad.grade) == ("good", "doubtful")


@pytest.mark.parametrize("noise", [0.0005, 0.01])
@pytest.mark.parametrize("lights", [3, 6])
@pytest.mark.parametrize("shape", ["pipe", "bottle"])
def test_pipes_and_bottles_under_a_right_rig_are_not_doubted(shape: str, lights: int, noise: float) -> None:
    """Upright, they change in one direction only: what was left across was held against the rig."""
    one = Footage(shape=shape, lights=lights, noise=noise, solved=True).observed(1)
    assert "doubtful" not in {line.grade for line in rig_of(one)}


@pytest.mark.parametrize(("spoilt", "rounds", "grade"), [(1, 8, "nothing"), (2, 20, "nothing"), (3, 20, "bad")])
def test_a_missing_frame_costs_its_rounds_and_not_the_take(spoilt: int, rounds: int, grade: str) -> None:
    """One lost frame of 120 took 31 % of one round's rows of 28, and the take was "not usable"."""
    timing = timing_of(dropped_frames=(DroppedFrames(after=50, count=1),))
    facts = [facts_of(number=1001 + n, unseen_share=0.31 if n < spoilt else 0.0) for n in range(rounds)]
    lines = list(of_rows.coverage(plan_of(("a",)), timing, Observed(lights=("a",), facts=KeptFacts(facts))))
    assert graded(lines, "rows") == grade
    assert graded(lines, "frames") == "doubtful"
    assert not any("360" in line.advice for line in lines)


@pytest.mark.parametrize("clip", [0.016, 0.2])
def test_a_clipped_take_is_not_told_to_give_more_light(clip: float) -> None:
    one = Footage(lights=3, clip=clip, clipping=3, noise=0, solved=True, dark=0.7).observed(0)
    lines = judgements(plan_of(one.lights), timing_of(), one)
    (lacking,) = (line for line in lines if line.subject == "validity")
    assert lacking.grade != "good"
    assert ("more light," in lacking.advice) == (clip < 0.02)
    assert (lacking.advice == result.CLIPPING_FIRST) == (clip > 0.02)


@pytest.mark.parametrize(("gain", "doubted"), [(1.0, False), (2.0, True)])
def test_under_a_doubted_rig_more_light_is_not_what_lacks(gain: float, doubted: bool) -> None:
    one = Footage(shape="waves", lights=4, claimed_gain=gain, solved=True).observed(0)
    one.facts = KeptFacts(replace(facts, valid_share=0.1, measured_share=1.0) for facts in one.facts)
    lines = judgements(plan_of(one.lights), timing_of(), one)
    assert (graded(lines, "rig") != "good") == doubted
    assert (next(line.advice for line in lines if line.subject == "validity") == result.RIG_FIRST) == doubted


@pytest.mark.parametrize(("clipping", "words"), [(5, "all powers to"), (1, "its power"), (9, "their powers")])
def test_powers_to_lower_are_said_as_a_share_of_what_they_are(clipping: int, words: str) -> None:
    """Lamps at 40 % that clipped by far were told "lower all powers to 50 %", which is more."""
    lines = exposure(
        Footage(lights=5 if clipping <= 5 else clipping + 1, clip=0.16, clipping=clipping, noise=0).observed(0)
    )
    (line,) = (one for one in lines if one.subject == "clipping")
    assert words in line.advice
    assert re.search(r"\d %( of the| of) what (it is|they are)", line.advice)


@pytest.mark.parametrize(("planned", "said"), [(0.04, "to 0.4 % (now 4 %)"), (0.5, "to 5 % (now 50 %)")])
def test_no_power_is_advised_as_nothing(planned: float, said: str) -> None:
    one = Observed(lights=("a",), counts={"a": count_levels(np.full(100, 2, np.float32), 1.0)})
    plan = plan_of(("a",))
    flashes = tuple(replace(flash, lights={"a": planned}) for flash in plan.flashes)
    assert said in power_words(replace(plan, flashes=flashes), one)["a"]


@pytest.mark.parametrize(("gain", "weak"), [(0.15, False), (0.1, True)])
def test_where_a_light_is_known_to_be_weaker_than_the_rig_says_no_turned_rig_is_named(gain: float, weak: bool) -> None:
    one = Footage(lights=3, gains=[1.0, gain, 1.0], solved=True).observed(0)
    one.leans[:] = [Lean(lean_deg=20.0, gain=1.0, turn_deg=(0.0, 20.0, 0.0), rest_deg=0.2)]
    one.slopes[:] = [0.9]
    said = " ".join(line.found for line in rig_of(one))
    one.slopes[:] = [0.2]
    assert any("mirrored" in line.found for line in rig_of(one)) is not weak
    assert ("swung to the left or right" in said) is not weak
    assert ("'light1'" in said) is weak


@pytest.mark.parametrize("lights", [3, 4])
def test_a_rig_that_is_turned_beside_a_clip_that_is_turned_too_is_told_of_it(lights: int) -> None:
    for turn in (UPRIGHT, CLOCKWISE):
        one = Footage(lights=lights, turned_deg=90, solved=True, shape="waves").observed(0)
        one.turn = turn
        said = " ".join(line.found for line in rig_but_leaning(one))
        assert "directions are mirrored or turned" in said
        assert ("turned by 90 degrees clockwise" in said) is (turn == CLOCKWISE)


def test_under_three_lights_strengths_may_be_why_normals_lean() -> None:
    one = Footage(lights=3, claimed_gain=2.0, solved=True).observed(0)
    (line,) = rig_of(one)
    assert line.grade != "good"
    assert "directions or strengths" in line.found or "other strengths" in line.found
    assert "exchanged" in line.found


@pytest.mark.parametrize(("gain", "unmeasured"), [(1.0, True), (1.1, False)])
def test_three_lights_do_not_show_the_rig_to_be_right(gain: float, unmeasured: bool) -> None:
    """One light is as strong as the rig says or a tenth weaker: nothing shows it, so nothing is called good."""
    (line,) = rig_of(Footage(lights=3, claimed_gain=gain, solved=True).observed(0))
    assert line.grade == "unknown"
    assert "other strengths or with two lights exchanged" in line.found
    assert "flat-field" in line.advice
    assert ("the strength 1" in line.found) is unmeasured


def test_a_light_that_is_stronger_than_the_rig_says_turns_normals_as_far_as_is_said() -> None:
    vectors = ring(3)
    shades = vectors @ np.array([0, 0, 1]) * np.array([1, STRONGER, 1])
    normal = np.linalg.solve(vectors, shades)
    off_deg = float(np.degrees(np.arccos(normal[2] / np.linalg.norm(normal))))
    assert off_deg > 3
    assert turned_deg(vectors) == pytest.approx(off_deg), "lights in a ring all do the same"
