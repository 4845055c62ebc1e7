"""What is typical around every point, where outliers and noise count for little."""

from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Floats
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.trust.thin_surface import ThinSurface, blurred, line

OUTLYING, TURNS, LEAST_LEVEL_DEG = np.float32(1.5), 4, np.float32(0.05)
"""What is around counts up to this many times its typical size, found in this many turns: edges of shadows and creases
are their own, and of no more than a few of the points."""
OUTLYING_OF_ONE, OUTLYING_OF_MORE = 4, 2
"""An outlier counts up to this many times the square of what noise makes of it, of one Gaussian number (which has the
longest tail) or of more: 96 and 95 % of their squares stay. With less, noise took more from a misfit than it added."""
CERTAIN = np.float32(1)
"""A misfit is certain beyond this many standard errors of the mean square that noise makes of so few points."""
UNSURE_OF_NOISE = np.float32(1.2)
"""Noise is known to a tenth, and its square to a fifth: what is less beyond it is not surely a misfit, but likely."""


@dataclass(frozen=True, kw_only=True)
class Surroundings:
    """What is typical around every point, over squares ``width`` points wide.

    ``shown``, each point's albedo up to the mean, is its weight, and ``weight`` the mean of it around: a little stray
    light, or what is lost in a file's codes, turns the normals of black cloth far, and says nothing of the subject
    before it. ``noise`` is what noise alone would make of squares; ``outlying`` times that is none of an outlier's.
    ``by_chance`` is what chance could leave of it over as many points, and ``margin`` what was taken off since it is
    known no better.
    """

    width: int
    shown: Floats
    weight: Floats
    noise: Floats
    outlying: int
    by_chance: Floats
    margin: Floats

    @classmethod
    def both(cls, points: ThinSurface, noise: Floats, albedo: Floats, one: Evidence) -> "list[Surroundings]":
        """Look around the points, near and far; ``albedo``, zeros where nothing is known, becomes ``shown``."""
        from psvideo.solve.normals.trust.signs_kernel import fill_levels, fill_weighed

        if one.indirect is None:
            raise ValueError("`indirect` expected in the evidence: see indirect.py")
        lights, plain = len(one.plates), points.surface.error_deg is None
        bright = albedo * albedo
        common = (noise * bright).sum() / max(bright.sum(), 1e-9)  # black cloth is nothing but noise
        most = albedo.sum() / max(np.count_nonzero(points.known), 1)  # glare is no more than the rest
        weighed, counts = np.empty((4, *noise.shape), np.float32), line(one.indirect.counts)
        fill_weighed(
            line(noise), line(albedo), counts, lights, plain, float(most), float(common), weighed.reshape(4, -1)
        )
        found = []
        for width in points.widths:
            levels, unsure = np.empty((3, *noise.shape), np.float32), float(UNSURE_OF_NOISE - 1)
            means = blurred(weighed, width).reshape(4, -1)
            fill_levels(means, float(width**2), float(CERTAIN), unsure, levels.reshape(3, -1))
            weight, by_chance, margin = levels
            found.append(
                cls(
                    width=width,
                    shown=albedo,
                    weight=weight,
                    noise=noise,
                    outlying=OUTLYING_OF_ONE if lights == 4 else OUTLYING_OF_MORE,
                    by_chance=by_chance,
                    margin=margin,
                )
            )
        return found

    def typical(self, squares: Floats) -> Floats:
        """Return the typical ``squares``, of which the caller has taken off the mean that noise makes, times the
        weight. Outliers count as OUTLYING times what is typical."""
        from psvideo.solve.normals.trust.signs_kernel import fill_limited

        limited = squares * self.shown
        means = blurred(limited, self.width)
        given = line(squares), line(self.shown), line(self.noise), line(self.weight)
        limits = float(OUTLYING**2), float(self.outlying), float(LEAST_LEVEL_DEG**2)
        for _ in range(TURNS):
            fill_limited(*given, line(means), *limits, line(limited))
            means = blurred(limited, self.width, means)
        return means


def roots(squares: Floats, surroundings: list[Surroundings]) -> tuple[Floats, Floats]:
    """Return the root of what is typical near or far, whichever is more: what is more than chance, and what is likely,
    with the margin back that was taken off for noise."""

    from psvideo.solve.normals.trust.signs_kernel import raise_to_roots

    surely, likely = np.zeros((2, *squares.shape), np.float32)
    for each in surroundings:
        means = line(each.typical(squares))
        raise_to_roots(means, line(each.weight), line(each.by_chance), line(each.margin), line(surely), line(likely))
    return surely, likely
