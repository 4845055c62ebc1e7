"""Verdicts under right and wrong rigs, held against true normals: how many virtual takes are called what.

Shapes of ``bench.predicted``, painted and with a camera's noise, under a ring of lights and one near the axis, three
seeds each. ``python -m bench.verdict_rigs`` prints how often each rig was doubted, and how far normals were off.
"""

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from bench.accuracy_measure import Case, angles_deg, ring
from bench.predicted import shapes, shot
from bench.table import Row, table
from psvideo.model.camera import Camera
from psvideo.model.plan import Plan, PlannedFlash, assemble_plan
from psvideo.model.rig import Light, Rig
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.mixing.mixture import mixture_of
from psvideo.plates.sequence import Round
from psvideo.report.judge.of_accuracy import accuracy
from psvideo.report.judge.of_ambient import ambient
from psvideo.report.judge.of_exposure import exposure
from psvideo.report.judge.of_lamps import lamps
from psvideo.report.judge.of_rig import rig
from psvideo.report.judge.of_validity import validity
from psvideo.report.judge.typical_error import likely_deg
from psvideo.report.judgement import verdict_of
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.rig_and_curve.rigpoints import rig_points
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.solving import Solving

LIGHTS, SEEDS = (3, 5, 8, 12), (0, 1, 2)
NOISE = 0.003
Claim = Callable[[np.ndarray, np.random.Generator], np.ndarray]


def each_off(angle_deg: float) -> Claim:
    """Claim directions that are off by so much, each its own way."""

    def claimed(ways: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        across = np.cross(ways, rng.normal(size=ways.shape))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        return np.asarray(np.cos(np.radians(angle_deg)) * ways + np.sin(np.radians(angle_deg)) * across)

    return claimed


def tilted(angle_deg: float) -> Claim:
    """Claim directions that are all turned by so much around an axis in the picture."""

    def claimed(ways: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        around, angle = rng.uniform(0, 2 * np.pi), np.radians(angle_deg)
        axis = np.array([np.cos(around), np.sin(around), 0.0])
        along = np.outer(ways @ axis, axis)
        return np.asarray(along + np.cos(angle) * (ways - along) + np.sin(angle) * np.cross(axis, ways))

    return claimed


def mirrored(ways: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Claim directions with left and right exchanged."""
    return ways * [-1, 1, 1]


def exchanged(ways: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Claim directions of which two are each other's."""
    order = np.arange(len(ways))
    one, other = rng.choice(len(ways) - 1, 2, replace=False)
    order[[one, other]] = order[[other, one]]
    return np.asarray(ways[order])


def right(ways: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Claim what is so."""
    return ways


RIGS: tuple[tuple[str, Claim], ...] = (
    ("right", right),
    ("each 2 degrees off", each_off(2)),
    ("each 5 degrees off", each_off(5)),
    ("each 10 degrees off", each_off(10)),
    ("each 20 degrees off", each_off(20)),
    ("tilted by 5 degrees", tilted(5)),
    ("tilted by 10 degrees", tilted(10)),
    ("tilted by 20 degrees", tilted(20)),
    ("tilted by 30 degrees", tilted(30)),
    ("mirrored", mirrored),
    ("two lights exchanged", exchanged),
)
GOOD_DEG, LOST_DEG, CLOSE = 5.0, 8.0, 1.5
"""A take is doubted without need where its normals are off by less than the first in the mean, and missed where it is
not doubted though they are off by more than the second, and its accuracy is not said within the third, a factor."""


def rows() -> Iterator[Row]:
    """Give how often every rig is doubted, by the number of lights."""
    for name, claim in RIGS:
        for lights in LIGHTS:
            takes = list(_takes(claim, lights))
            doubted = [take for take in takes if not take.verdict.startswith("This take is usable")]
            lost = [take for take in doubted if "not usable" in take.verdict]
            needless = [take for take in doubted if take.off_deg < GOOD_DEG]
            missed = [
                take
                for take in takes
                if take not in doubted and take.off_deg > LOST_DEG and take.said_deg * CLOSE < take.off_deg
            ]
            off = [take.off_deg for take in takes]
            yield Row(
                f"{name}, {lights} lights",
                f"{len(doubted)} of {len(takes)} doubted ({len(lost)} not usable), {len(needless)} without need, "
                f"{len(missed)} missed; normals off by {np.mean(off):.1f}° ({min(off):.1f} to {max(off):.1f})",
                "<= 10 % wrong",
                len(needless) + len(missed) <= 0.1 * len(takes),
            )


class Judged(NamedTuple):
    """The verdict on a take, and how far off its normals are in the mean, in truth and as is said."""

    verdict: str
    off_deg: float
    said_deg: float


def _takes(claim: Claim, lights: int) -> Iterator[Judged]:
    """Give every subject and seed."""
    for seed in SEEDS:
        ways = np.concatenate([ring(lights - 1, 40), ring(1, 10)]) if lights > 3 else ring(3, 35)
        for _, normals, inside in shapes():
            case = shot(normals, inside, ways, noise=NOISE)
            claimed = claim(ways, np.random.default_rng(seed))
            yield judged(case, claimed)


def judged(case: Case, claimed: np.ndarray) -> Judged:
    """Return the verdict on a take solved with claimed directions."""
    lit = Illumination(directions=claimed, intensities=np.ones((len(claimed), 3)))
    surface = Solving(error=True).solve(case.plates, lit, mask=case.mask)
    rows, cols = case.mask.shape
    names = tuple(f"light{n}" for n in range(len(claimed)))
    plan = _plan(names, rows, cols)
    lamps_of = tuple(
        Light(name=name, direction=(float(x), float(y), float(z)), intensity=(1.0,))
        for name, (x, y, z) in zip(names, claimed, strict=True)
    )
    points = rig_points(plan, Rig(lights=lamps_of), height_px=rows, width_px=cols, channels=3)
    observed = Observed(lights=names, points=points)
    seen = np.ones(rows, np.bool_)
    plates = tuple(
        LightPlate(light=name, number=1001, time_s=0.0, picture=mixture_of(plate), seen=seen)
        for name, plate in zip(names, case.plates, strict=True)
    )
    observed.add(Round(number=1001, plates=plates), surface)
    lines = [*exposure(observed), *lamps(observed), ambient(observed), *rig(observed)]
    both = surface.measured & case.mask
    off = float(angles_deg(surface.normals[both], case.truth[both]).mean()) if both.any() else 90.0
    return Judged(verdict_of([*lines, *accuracy(observed), *validity(observed)]), off, likely_deg(observed) or 0.0)


def _plan(names: tuple[str, ...], rows: int, cols: int) -> Plan:
    camera = Camera(width_px=cols, height_px=rows, fps=Fraction(100), exposure_s=0.01, readout_s=0.0)
    flashes = [PlannedFlash(lights={name: 1.0}, duration_s=0.005) for name in names]
    return assemble_plan(camera=camera, flashes=flashes, dark_s=None, mode="synced")


if __name__ == "__main__":
    print(table(list(rows())))
