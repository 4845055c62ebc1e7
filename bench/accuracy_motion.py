"""A subject that moves while its lights flash in turn: plates as they are (before), brought to one instant (after).

A mottled ball before a mottled wall, least squares, three rounds with a dark slot each; the second one is looked at.
Where results are missing they are counted beside the error.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from bench.accuracy_measure import Accuracy, angles_deg, ring
from psvideo.model.surface import Surface
from psvideo.plates.align.denoise import Average, averaged
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

COLS, ROWS, WIDTH_M = 320, 240, 0.8
PITCH_S, FLASH_S = 0.009, 8e-4
RADIUS_PX = 80
WALL_M = -0.9
ROUNDS = 3
EDGE_PX = 8
UNALIGNED = Aligning(align="none")
MOTTLED = {"pattern": "noise", "colour": 0.8, "second": 0.3, "size_m": 0.05}


class Seen(NamedTuple):
    """The mean error of what is valid of the subject, and which share of it is valid."""

    error_deg: float
    valid: float

    def __str__(self) -> str:
        return f"{self.error_deg:.2f}°" + ("" if self.valid > 0.9995 else f", {self.valid:.1%} valid")


BUST = {"mesh": "bust", "height_m": 0.5, "rotate_deg": [0, 14, 0], "position_m": [0, -0.05, 0]}
BOX = {"mesh": "box", "height_m": 0.5, "rotate_deg": [20, 30, 10], "albedo": 0.6}
VASE = {"mesh": "vase", "height_m": 0.5, "rotate_deg": [20, 30, 10]}
ASLANT = (1, 2, 1)


def slide(px: float) -> dict[str, Any]:
    """A motion by so many pixels from flash to flash, aslant: not whole pixels, at which moving a plate is exact."""
    across, up = 0.98 * px, 0.2 * px
    return {"velocity_m_per_s": [step / PITCH_S * WIDTH_M / COLS for step in (across, up, 0.0)]}


def turn(px: float, axis: Sequence[int]) -> dict[str, Any]:
    """A rotation by which the ball's nearest or outermost point moves so many pixels from flash to flash."""
    return {"axis": list(axis), "spin_deg_per_s": float(np.rad2deg(px / RADIUS_PX) / PITCH_S)}


@dataclass(frozen=True, kw_only=True)
class Filmed:
    """Rounds of plates of a subject, and what is true of it at any time."""

    rounds: tuple[Round, ...]
    lit: Illumination
    stage: Stage

    def shown(self, how: Aligning) -> list[Round]:
        """Return what alignment makes of the rounds."""
        plates = (plate for one in self.rounds for plate in one.plates)
        return list(aligned(plates, self.lit.names, how, first=self.rounds[0].number))

    def solved(self, one: Round) -> Surface:
        """Return a round's surface."""
        seen = np.stack([plate.pixels_seen for plate in one.plates])
        return solve(LitPlates([plate.image for plate in one.plates], self.lit, seen=seen))

    def truth(self, time_s: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the true normals at a time, and where the subject is."""
        hits = self.stage.view(time_s).hits
        subject = hits.image((hits.point_m[:, 2] > WALL_M + 0.01).astype(np.float32)) > 0.5
        return true_normals(hits), subject

    def seen(self, one: Round, *, edge: bool = False) -> Seen:
        """Return how far a round is off at its instant: over the subject, or along its outline on both sides."""
        return self.judged(self.solved(one), one.time_s, edge=edge)

    def judged(self, surface: Surface, time_s: float, *, edge: bool = False) -> Seen:
        """Return how far a surface is off."""
        normals, where = self.truth(time_s)
        if edge:
            disc = np.ones((2 * EDGE_PX + 1, 2 * EDGE_PX + 1), np.uint8)
            wide, narrow = (way(where.astype(np.uint8), disc) > 0 for way in (cv2.dilate, cv2.erode))
            where = wide & ~narrow
        chosen = surface.valid & where
        return Seen(
            float(angles_deg(surface.normals[chosen], normals[chosen]).mean()), float(chosen.sum() / where.sum())
        )


def filmed(
    lights: int,
    motion: dict[str, Any] | None,
    *,
    noise: float = 0.0,
    skin: Any = MOTTLED,
    rounds: int = ROUNDS,
    subject: dict[str, Any] | None = None,
) -> Filmed:
    """Film a ball, or another ``subject``, as flashes see it, the middle of all rounds at 0 s."""
    directions = ring(lights, 27)
    table = [{"name": f"l{n}", "direction": [float(x) for x in d], "intensity": 0.9} for n, d in enumerate(directions)]
    wall = {"pattern": "noise", "colour": 0.4, "second": 0.2, "size_m": 0.1}
    camera = {"width_px": COLS, "height_px": ROWS, "fps": 120, "shutter_deg": 360.0, "readout_s": 0.008,
              "width_m": WIDTH_M, "colour": "grey"}  # fmt: skip
    thing = subject or {"mesh": "sphere", "height_m": 0.4, "albedo": skin}
    objects = [
        thing | {"motion": motion},
        {"mesh": "plane", "scale": 4.0, "position_m": [0, 0, WALL_M], "albedo": wall},
    ]
    scene = {"schema": "psvideo-scene/1", "camera": camera, "light": table, "object": objects}
    stage = set_stage(Scene.model_validate(scene), Path())
    names = tuple(str(entry["name"]) for entry in table)
    lit = Illumination(directions=directions, intensities=np.full((lights, 1), 0.9), names=names)
    return Filmed(rounds=shoot(stage, names, rounds=rounds, noise=noise), lit=lit, stage=stage)


def shoot(stage: Stage, names: tuple[str, ...], *, rounds: int = ROUNDS, noise: float = 0.0) -> tuple[Round, ...]:
    """Return rounds of plates, each light once and a dark slot, the middle of all at 0 s."""
    rng = np.random.default_rng(5)
    middle = (rounds - 1) / 2 * (len(names) + 1) + (len(names) - 1) / 2
    still = stage.still
    gathered = []
    for index in range(rounds):
        plates = []
        for n, name in enumerate(names):
            time_s = (index * (len(names) + 1) + n - middle) * PITCH_S
            flash = TrueFlash(
                index=0, slot=n, lights={name: 1.0}, start_s=time_s - FLASH_S / 2, duration_s=FLASH_S, complete=True
            )
            image = stage.plate(flash, still or stage.view(time_s))
            noisy = np.asarray(image + rng.normal(0, noise, image.shape), np.float32)
            seen = np.ones(len(image), np.bool_)
            plates.append(
                LightPlate(light=name, number=1001 + index, time_s=time_s, picture=mixture_of(noisy), seen=seen)
            )
        gathered.append(Round(number=1001 + index, plates=tuple(plates)))
    return tuple(gathered)


def rows() -> Iterator[Accuracy]:
    """Give what alignment, results per flash and averaging make of motion and rest."""
    for lights in (3, 4, 8):
        yield _moving(f"{lights} lights, 4 px per flash", filmed(lights, slide(4)), 1.5 if lights == 3 else None)
    three = filmed(3, slide(4))
    yield _moving("the same, 3 lights, 1 % noise", filmed(3, slide(4), noise=0.01))
    yield _moving("3 lights, 1 px per flash", filmed(3, slide(1)))
    yield _moving("3 lights, 16 px per flash", filmed(3, slide(16)))
    yield _moving("3 lights, 4 px per flash, bare skin (no texture)", filmed(3, slide(4), skin=0.6))
    yield _moving("3 lights, spinning in the picture, 3 px per flash at its edge", filmed(3, turn(3, (0, 0, 1))))
    yield _moving("3 lights, turning about the vertical, 3 px per flash", filmed(3, turn(3, (0, 1, 0))))
    for px in (2, 8, 16):
        yield _moving(f"bust, 5 lights, {px} px per flash", filmed(5, slide(px), subject=BUST))
    for name, subject, lights in (("bust", BUST, 5), ("bare box", BOX, 5), ("vase", VASE, 3)):
        clip = filmed(lights, turn(2, ASLANT), subject=subject)
        yield _moving(f"{name}, {lights} lights, tumbling, 2 px per flash", clip)
    before, after = three.rounds[1], three.shown(Aligning())[1]
    yield Accuracy(
        f"3 lights, 4 px per flash: within {EDGE_PX} px of the outline, ball and wall",
        str(three.seen(before, edge=True)),
        "--align",
        str(three.seen(after, edge=True)),
    )
    yield from _at_every_flash(three)
    yield from _at_rest()


def _moving(what: str, clip: Filmed, bar_deg: float | None = None) -> Accuracy:
    before, after = clip.seen(clip.rounds[1]), clip.seen(clip.shown(Aligning())[1])
    bar = "" if bar_deg is None else f"< {bar_deg}°"
    return Accuracy(what, str(before), "--align", str(after), bar, None if bar_deg is None else after[0] < bar_deg)


def _at_every_flash(clip: Filmed) -> Iterator[Accuracy]:
    """One result per flash: the mean of the second round's three."""
    before, after = (
        [clip.seen(one) for one in clip.shown(Aligning(align=align, rate="flash"))[3:6]] for align in ("none", "auto")
    )
    means = [Seen(*np.mean(seen, axis=0).tolist()) for seen in (before, after)]
    yield Accuracy("3 lights, 4 px per flash, --fps flash", str(means[0]), "--align", str(means[1]))


def _at_rest() -> Iterator[Accuracy]:
    for lights in (3, 8):
        clip = filmed(lights, None, noise=0.01)
        before = clip.seen(clip.rounds[1])
        for align in ("auto", "flow"):
            after = clip.seen(clip.shown(Aligning(align=align))[1])
            bar = f"<= {before.error_deg + 0.05:.2f}°"
            met = after.error_deg <= before.error_deg + 0.05
            yield Accuracy(f"{lights} lights at rest, 1 % noise", str(before), f"--align {align}", str(after), bar, met)
    for what, motion in (("at rest", None), ("4 px per flash", slide(4))):
        clip = filmed(3, motion, noise=0.01, rounds=4)
        average: Average | None = None
        for one in clip.shown(Aligning()):
            plain = clip.solved(one)
            average, surface = averaged(average, plain, 4)
        yield Accuracy(
            f"3 lights {what}, 1 % noise",
            str(clip.judged(plain, one.time_s)),
            "--denoise 4",
            str(clip.judged(surface, one.time_s)),
        )
