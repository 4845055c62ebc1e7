"""Sets of a few lights, drawn at random: what is trusted of photographs, and how much of it is over 10 degrees."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.accuracy_measure import (
    Case,
    angles_deg,
    diligent_ball,
    photographed,
    rendered_bunny,
    washington_sphere,
)
from psvideo.model.arrays import Doubles, Integers
from psvideo.model.surface import MEASURED
from psvideo.solve.normals.solving import Solving

COUNTS = (3, 4, 5, 6)
SETS, SEED = 40, 301
"""Sets of each subject and count, and what they are drawn by."""
FLAT = 8.0
"""Sets of a larger condition number lie nearly in a plane."""
MOST_OVER = 0.03
SUBJECTS: dict[str, Callable[[], Case]] = {
    "bear": lambda: photographed("bear"),
    "cat": lambda: photographed("cat"),
    "ball": diligent_ball,
    "grey sphere": washington_sphere,
    "bunny (rendered)": rendered_bunny,
}


class Trusted(NamedTuple):
    """The mean over sets: the share of the subject that is trusted, and how much of it is over 10 degrees; the latter
    of all sets' pixels together, and of the worst set, as well. Of what was measured the shares within the claim and
    within twice, the median claim over the median error, and their correlation."""

    subject: str
    lights: int
    trusted: str
    over_10_deg: str
    of_all_pixels: str
    worst: str
    within: str
    within_twice: str
    claimed: str
    correlation: str
    bar: str
    met: bool


@dataclass(frozen=True, kw_only=True)
class _Set:
    trusted: float
    over: float
    within: float
    within_twice: float
    claimed: float
    correlation: float


def rows() -> Iterator[Trusted]:
    """Solve every set of every subject, and the mean over subjects."""
    sets = {name: {count: list(_solved(make(), count)) for count in COUNTS} for name, make in SUBJECTS.items()}
    for count in COUNTS:
        for name in SUBJECTS:
            yield _row(name, count, sets[name][count])
        yield _row("all five", count, [one for name in SUBJECTS for one in sets[name][count]])


def _solved(case: Case, count: int) -> Iterator[_Set]:
    for some in _sets(case.lit.directions, count):
        one = case.choose(some)
        found = Solving(error=True).solve(one.plates, one.lit, mask=one.mask)
        known = one.mask & (np.linalg.norm(one.truth, axis=-1) > 0.5)
        normals, claim_deg = found.normals[known], np.asarray(found.error_deg)[known]
        there = np.linalg.norm(normals, axis=-1, keepdims=True) > 0.5
        off_deg = angles_deg(np.where(there, normals, [0.0, 0.0, 1.0]), one.truth[known])
        trusted, measured = found.valid[known], np.asarray(found.source)[known] == MEASURED
        off, claim = off_deg[measured], claim_deg[measured].astype(np.float64)
        yield _Set(
            trusted=float(trusted.mean()),
            over=float(np.mean(off_deg[trusted] > 10)) if trusted.any() else 0.0,
            within=float(np.mean(off <= claim)),
            within_twice=float(np.mean(off <= 2 * claim)),
            claimed=float(np.median(claim) / np.median(off)),
            correlation=float(np.corrcoef(claim, off)[0, 1]),
        )


def _sets(directions: Doubles, count: int) -> Iterator[Integers]:
    rng, left = np.random.default_rng([SEED, count]), SETS
    while left:
        some = np.sort(rng.choice(len(directions), count, replace=False))
        if np.linalg.cond(directions[some]) <= FLAT:
            yield some
            left -= 1


def _row(name: str, count: int, sets: list[_Set]) -> Trusted:
    def mean(field: str) -> float:
        return float(np.mean([getattr(one, field) for one in sets]))

    trusted = sum(one.trusted for one in sets)
    over = sum(one.over * one.trusted for one in sets) / trusted if trusted else 0.0
    return Trusted(
        subject=name,
        lights=count,
        trusted=f"{100 * mean('trusted'):.0f} %",
        over_10_deg=f"{100 * mean('over'):.1f} %",
        of_all_pixels=f"{100 * over:.1f} %",
        worst=f"{100 * max(one.over for one in sets):.0f} %",
        within=f"{100 * mean('within'):.0f} %",
        within_twice=f"{100 * mean('within_twice'):.0f} %",
        claimed=f"{mean('claimed'):.2f}",
        correlation=f"{mean('correlation'):.2f}",
        bar=f"over 10 deg <= {100 * MOST_OVER:.0f} %",
        met=mean("over") <= MOST_OVER,
    )
