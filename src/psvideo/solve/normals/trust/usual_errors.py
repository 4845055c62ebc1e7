"""What errors are typical of a picture: by these it is judged as a whole, and they are what a report says of it."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from psvideo.model.arrays import Floats
from psvideo.model.surface import Misfit
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.trust.near_spread import NearSpread
from psvideo.solve.normals.trust.thin_surface import ThinSurface

MOST_USUAL_DEG = 30.0
FEWEST = 5
"""Robust solving needs so many lights."""
SPREAD_OF_FITTED, POWER, OF_SIX, OF_FIVE = 26.0, 1 / 3, 1 / 2, 1.0
"""What one light is off by turns normals so much, as a trace times the number of lights (9 under lights that lie evenly
around, 14 on a ring 35 degrees from the axis): lights as they were photographed, by which doubts were fitted, spread it
26 to 40 times. What is not matte turns normals less under lights that stand farther apart, and residuals show as much
of it: with these powers of it, under seven lights and more, under six and under five. Of 600 virtual takes nothing else
went with what was said over what was true so clearly: 1.9 times under five lights that spread it 10 times, 1.1 to 1.2
where they do 33 times, virtual or photographed. How evenly residuals lie, and how much of a doubt torn normals are,
told a quarter of that or nothing on takes that nothing was chosen on."""


class UsualErrors(NamedTuple):
    """The mean error, of bright points more than of dim ones: ``whole_deg``, and ``by_noise_deg`` alone. In the share
    ``unknown_share`` of the points near lights' distance is unknown, which then say nothing of the others."""

    whole_deg: float
    by_noise_deg: float
    unknown_share: float

    @classmethod
    def of(
        cls, points: ThinSurface, at_points: Floats, by_noise_deg: Floats, near: NearSpread, *, most_deg: float
    ) -> "UsualErrors":
        """``at_points`` are the points' errors, ``by_noise_deg`` what noise makes of them; near lights' distance is
        unknown where it turns normals by more than ``most_deg``."""
        albedo = points.brightness * points.known  # what is bright shows more of the subject
        unknown = np.zeros_like(points.known)
        if near.doubt_deg.size:
            unknown = points.known & (near.doubt_deg > most_deg)
        if not unknown.all(where=points.known):
            albedo = albedo * ~unknown
        share = float(np.count_nonzero(unknown) / np.count_nonzero(points.known))
        return cls(usual(at_points, albedo), usual(by_noise_deg, albedo), share)

    @property
    def beyond_noise_deg(self) -> float:
        """What is left without noise."""
        return float(np.sqrt(max(self.whole_deg**2 - self.by_noise_deg**2, 0.0)))

    def likely_deg(self, lit: Illumination, *, plain: bool, explained: float) -> float:
        """Return how far off normals are likely to be beyond noise; of ``plain`` least squares, whose constant was
        fitted to four lights as they stand, that is what errors say, and so it is as far as it is known of what they
        come, ``explained``."""
        unknown = 1.0 if plain else beside_fitted(lit)
        return self.beyond_noise_deg * (unknown + explained * (1 - unknown))

    def misfit(self, found: Misfit) -> Misfit:
        """Return a misfit that says what is typical of the points."""
        return replace(
            found,
            error_deg=self.beyond_noise_deg,
            noise_deg=self.by_noise_deg,
            distance_share=self.unknown_share,
        )


def beside_fitted(lit: Illumination) -> float:
    """Return how much less than the lights that doubts were fitted under these turn normals by what is not matte, 1
    where they stand no farther apart."""
    ways = lit.directions
    spread = len(ways) * float(np.trace(np.linalg.inv(ways.T @ ways)))
    power = {FEWEST: OF_FIVE, FEWEST + 1: OF_SIX}.get(len(ways), POWER)
    return float(min(spread / SPREAD_OF_FITTED, 1.0) ** power)


def usual(errors_deg: Floats, weights: Floats) -> float:
    """Return the mean error; where hardly anything is known it counts as MOST_USUAL_DEG."""
    each = np.minimum(errors_deg.astype(np.float32), np.float32(MOST_USUAL_DEG))
    return float((each * weights).sum(dtype=np.float64) / max(float(weights.sum(dtype=np.float64)), 1e-12))
