"""What near lights' falloff says of how far away a whole part of the surface is, whose shape is known.

A single point's light may be explained by a wrong distance as well, where lamps are a little off. Normals give the
shape of a part, so that all of its points have one distance to find together: how badly each explains them is added up.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles, Mask
from psvideo.model.surface import Distances

SHIFTS = np.linspace(-1.2, 1.2, 241)
"""Logarithms of the factors by which a part's distance is tried to differ from the plane's."""
PER_MISFIT = 8.0
"""How much more likely one distance is than another: the logarithm of the odds, twice, for a cost that is larger by as
much as the best distance leaves. What is left is the rig's own error, alike in all points, so that more of them do not
make it surer."""
LEAST_MISFIT = 0.15
"""Better than to this cost nothing is explained."""
ON_PLANE, ANYWHERE = 0.05, 0.7
"""Before its light is looked at, a part is thought to stand on the plane, to about the first share, for that was
measured, or as likely elsewhere, within about the second."""
SURE = 0.01
"""Better than to this share no distance is known."""
LEAST_WEIGHT = 4.0
"""What fewer sound points say is not asked."""


@dataclass(frozen=True, kw_only=True)
class DistanceEvidence:
    """How badly distances explain a part's light: ``cost``, summed over points, for each of ``SHIFTS``, and what the
    points count for, ``weight``. Parts whose heights belong together have the sums of both."""

    cost: Doubles
    weight: float

    def __add__(self, other: "DistanceEvidence") -> "DistanceEvidence":
        return DistanceEvidence(cost=self.cost + other.cost, weight=self.weight + other.weight)

    @property
    def told(self) -> bool:
        """Whether there is enough to go by."""
        return self.weight >= LEAST_WEIGHT

    @property
    def mean(self) -> Doubles:
        """The mean cost of a point, for each shift."""
        mean: Doubles = self.cost / max(self.weight, 1e-9)
        return mean

    @property
    def misfit(self) -> float:
        """What the best distance leaves."""
        return max(float(self.mean.min()), LEAST_MISFIT)

    @property
    def odds(self) -> Doubles:
        """The logarithm of how likely each shift is, over that of the likeliest."""
        before = sum(np.exp(-0.5 * (SHIFTS / width) ** 2) / width for width in (ON_PLANE, ANYWHERE))
        told = -0.5 * PER_MISFIT * self.mean / self.misfit if self.told else np.zeros(len(SHIFTS))
        logs = told + np.log(before)
        return np.asarray(logs - logs.max())

    @property
    def shift(self) -> float:
        """The likeliest shift; a parabola lies between two."""
        odds = self.odds
        place = int(np.clip(np.argmax(odds), 1, len(odds) - 2))
        before, here, after = odds[place - 1 : place + 2]
        bent = min(before - 2 * here + after, -1e-12)
        return float(SHIFTS[place] + np.clip(0.5 * (before - after) / bent, -0.5, 0.5) * (SHIFTS[1] - SHIFTS[0]))

    @property
    def unsure(self) -> float:
        """How far the logarithm of the distance may be off: the root mean square of how far others lie, by how likely
        they are."""
        likely = np.exp(self.odds)
        return float(np.sqrt((likely * (SHIFTS - self.shift) ** 2).sum() / likely.sum() + SURE**2))


def evidence_of(distances: Distances, logs_m: Doubles, part: Mask) -> DistanceEvidence:
    """Return what the points (row, col) of ``distances.costs`` that are a ``part``'s say of its distance.

    logs_m: (row, col), the logarithm of the part's depth but for one factor; a shift of 0 has it as it is here.
    """
    some = part & (distances.weight > 0)
    costs, weight = distances.costs[:, some].astype(np.float64), distances.weight[some].astype(np.float64)
    apart = distances.logs[1] - distances.logs[0]
    base = logs_m[some] - np.log(distances.plane_m[some]) - distances.logs[0]
    point, sums = np.arange(len(weight)), np.empty(len(SHIFTS))
    for n, shift in enumerate(SHIFTS):
        place = np.clip((base + shift) / apart, 0, len(distances.logs) - 1.001)
        below = place.astype(np.int64)
        share = place - below
        sums[n] = ((costs[below, point] * (1 - share) + costs[below + 1, point] * share) * weight).sum()
    return DistanceEvidence(cost=sums, weight=float(weight.sum()))
