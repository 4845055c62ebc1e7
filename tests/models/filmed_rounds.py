"""Rounds of plates of scenes that move in known ways, rendered without a camera, and what alignment makes of them."""

import functools
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from angles import angles_deg

from psvideo.model.surface import Surface
from psvideo.plates.align.rounds import Aligning, aligned
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares.woodham1980 import solve
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.synth.lamps.true_flashes import TrueFlash
from psvideo.synth.scene import Scene
from psvideo.synth.stage import Stage, set_stage
from psvideo.synth.truth import true_normals

COLS, ROWS, WIDTH_M = 240, 180, 0.6
PITCH_S = 0.009
WALL_M = -0.9
ROUNDS = 3

Plates = tuple[Round, ...]


def metres_per_s(px_per_flash: float) -> float:
    return px_per_flash / PITCH_S * WIDTH_M / COLS


MOTIONS: dict[str, dict[str, Any] | None] = {
    "at rest": None,
    "0.2 px": {"velocity_m_per_s": [metres_per_s(0.2), metres_per_s(-0.05), 0]},
    "1 px": {"velocity_m_per_s": [metres_per_s(1.1), metres_per_s(0.3), 0]},
    "4 px": {"velocity_m_per_s": [metres_per_s(4.2), metres_per_s(-0.7), 0]},
    "16 px": {"velocity_m_per_s": [metres_per_s(15.8), metres_per_s(2.7), 0]},
    "spin": {"axis": [0, 0, 1], "spin_deg_per_s": float(np.rad2deg(3.0 / 80) / PITCH_S)},
    "tumbling, 8 px": {"axis": [1, 2, 1], "spin_deg_per_s": float(np.rad2deg(8.0 / 80) / PITCH_S)},
    "turn": {"axis": [0, 1, 0], "spin_deg_per_s": float(np.rad2deg(1.0 / 80) / PITCH_S)},
}


@dataclass(frozen=True)
class Filmed:
    """Rounds of plates, the lights, and what is true at any instant."""

    rounds: Plates
    lit: Illumination
    stage: Stage
    truths: dict[float, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    """True normals and where the subject is, by time: tests ask for both, and before and after alignment."""

    @property
    def lights(self) -> tuple[str, ...]:
        return self.lit.names

    def error_deg(self, surface: Surface, time_s: float) -> tuple[float, float]:
        """Return the mean error over the subject, and which share of it is valid."""
        normals, subject = self.truth(time_s)
        said = surface.valid & subject
        off_deg = angles_deg(surface.normals, normals)
        return float(off_deg[said].mean()), float(said.sum() / subject.sum())

    def subject(self, time_s: float) -> np.ndarray:
        """Return where the subject is."""
        return self.truth(time_s)[1]

    def truth(self, time_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the true normals, and where the subject is."""
        if time_s not in self.truths:
            hits = self.stage.view(time_s).hits
            subject = hits.image((hits.point_m[:, 2] > WALL_M + 0.01).astype(np.float32)) > 0.5
            self.truths[time_s] = true_normals(hits), subject
        return self.truths[time_s]

    def solved(self, one: Round) -> Surface:
        return solve(LitPlates([plate.image for plate in one.plates], self.lit, seen=seen(one)))


def seen(one: Round) -> np.ndarray:
    return np.stack([plate.pixels_seen for plate in one.plates])


def filmed(lights: int, motion: str, noise: float = 0.0) -> Filmed:
    """Film, and let the sensor add noise."""
    clip = noiseless(lights, motion)
    rng = np.random.default_rng(5)

    def noisy(plate: LightPlate) -> LightPlate:
        return replace(
            plate, picture=mixture_of(np.asarray(plate.image + rng.normal(0, noise, plate.image.shape), np.float32))
        )

    return replace(clip, rounds=tuple(replace(one, plates=tuple(map(noisy, one.plates))) for one in clip.rounds))


@functools.cache
def noiseless(lights: int, motion: str, wider: float = 1.0) -> Filmed:
    """Film a mottled subject before a wall: three rounds of the lights and a dark slot, middle at 0 s."""
    turns = 2 * np.pi * np.arange(lights) / lights + 0.3
    directions = np.stack([0.45 * np.cos(turns), 0.45 * np.sin(turns), np.full(lights, 0.893)], axis=1)
    table = [{"name": f"l{n}", "direction": [float(x) for x in d], "intensity": 0.9} for n, d in enumerate(directions)]
    skin = {"pattern": "noise", "colour": 0.8, "second": 0.3, "size_m": 0.05}
    wall = {"pattern": "noise", "colour": 0.4, "second": 0.2, "size_m": 0.1}
    stage = set_stage(
        Scene.model_validate(
            {
                "schema": "psvideo-scene/1",
                "camera": {"width_px": round(wider * COLS), "height_px": round(wider * ROWS), "fps": 120,
                           "shutter_deg": 360.0, "readout_s": 0.008, "width_m": wider * WIDTH_M, "colour": "grey"},
                "light": table,
                "object": [
                    {"mesh": "sphere", "height_m": 0.4, "albedo": skin, "motion": MOTIONS[motion]},
                    {"mesh": "plane", "scale": 4.0, "position_m": [0, 0, WALL_M], "albedo": wall},
                ],
            }
        ),
        Path(),
    )  # fmt: skip
    still: dict[int, np.ndarray] = {}
    middle = (ROUNDS - 1) / 2 * (lights + 1) + (lights - 1) / 2
    rounds = []
    for index in range(ROUNDS):
        plates = []
        for n in range(lights):
            time_s = (index * (lights + 1) + n - middle) * PITCH_S
            flash = TrueFlash(
                index=0, slot=n, lights={f"l{n}": 1.0}, start_s=time_s - 4e-4, duration_s=8e-4, complete=True
            )
            image = still.get(n)
            if image is None:
                image = stage.plate(flash, stage.view(time_s))
            if MOTIONS[motion] is None:
                still[n] = image
            plates.append(
                LightPlate(
                    light=f"l{n}",
                    number=1001 + index,
                    time_s=time_s,
                    picture=mixture_of(image),
                    seen=np.ones(len(image), np.bool_),
                )
            )
        rounds.append(Round(number=1001 + index, plates=tuple(plates)))
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    names = tuple(f"l{n}" for n in range(lights))
    lit = Illumination(directions=unit, intensities=np.full((lights, 1), 0.9), names=names)
    return Filmed(rounds=tuple(rounds), lit=lit, stage=stage)


@functools.cache
def brought_as_filmed(lights: int, motion: str, how: Aligning = Aligning()) -> list[Round]:
    return brought(noiseless(lights, motion), how)


def brought(clip: Filmed, how: Aligning = Aligning(), rounds: Plates | None = None) -> list[Round]:
    plates = (plate for one in rounds or clip.rounds for plate in one.plates)
    return list(aligned(plates, clip.lights, how, first=1001))


def at_once(clip: Filmed, time_s: float) -> Round:
    """The plates as they would be if all lights had flashed at one instant."""
    view = clip.stage.view(time_s)
    plates = []
    for n, plate in enumerate(clip.rounds[1].plates):
        flash = TrueFlash(index=0, slot=n, lights={plate.light: 1.0}, start_s=time_s, duration_s=1e-9, complete=True)
        plates.append(replace(plate, picture=mixture_of(clip.stage.plate(flash, view)), time_s=time_s))
    return Round(number=1, plates=tuple(plates))
