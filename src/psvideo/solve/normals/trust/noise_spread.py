"""How noise spreads into normals, and what residuals say beside it: in every pixel, or at the points of a grid."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median
from psvideo.compute.spilled import let_go, lie_in_files, planes_for
from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Floats, Mask, Samples
from psvideo.model.surface import Surface
from psvideo.solve.normals.bands import BAND_PIXELS
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.light_sigmas import combined_noise, light_sigmas
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.surface_bits import bits, stored
from psvideo.solve.normals.task import LIGHTS
from psvideo.solve.normals.trust.near_spread import NearSpread
from psvideo.solve.normals.trust.spread_numbers import Spread
from psvideo.solve.normals.trust.thin_surface import ThinSurface, brightness

NOTHING, NO_DOUBT = np.zeros((0, 0), np.float32), np.zeros((2, 0, 0), np.float32)
MANY_LIGHTS = 8
"""Beyond this many lights residuals are not taken to average out."""
SURE = 2.0
"""In a single pixel residuals count from this many times what noise makes of them."""


@dataclass(frozen=True, kw_only=True)
class Spreading:
    """What is known of noise and residuals beforehand.

    fit_noise: this many times what noise makes do residuals predict of nothing but noise. (Robust solving corrects them
        for few lights, where what is not matte does not average out.)
    held: this many standard deviations hold 68 % of two-dimensional Gaussian errors (1.07, and some doubt).
    least_share: of the light, the least that any camera, lens and lamp is off by.
    """

    fit_noise: float = 1.95
    held: float = 1.15
    least_share: float = 0.001


@dataclass(frozen=True, kw_only=True)
class NoiseSpread:
    """How noise spreads into normals under all lights. ``step``: rows and columns between two points; ``of_noise``: how
    much of noise residuals hold, at most; ``typical_of_noise``: in the mean of their squares; ``of_residual``: by what
    they become degrees where they are not that already, 0 where they are."""

    step: int
    noise: Spread
    of_noise: float
    typical_of_noise: float
    of_residual: float

    @classmethod
    def of(cls, some: Surface, one: Evidence, noise: PlateNoise, how: Spreading, near: NearSpread) -> "NoiseSpread":
        """Return how the noise of a surface's plates spreads, by how it was solved: robust solving weighed lights by
        their noise and left degrees in ``error_deg``; least squares counted all alike and left residuals. ``some``: the
        surface at the points (``every_nth``)."""
        lit = one.lit
        strength, lights = lit.intensities.mean(axis=1), len(lit.intensities)
        light = _typical_light(some) * float(strength.mean())
        sigmas = light_sigmas(lit, combined_noise(noise, lit), light=light, share=how.least_share)
        matrix = lit.directions * strength[:, None]
        to_noise = matrix / sigmas[:, None]
        solving = np.linalg.pinv(matrix) * sigmas if some.error_deg is None else np.linalg.pinv(to_noise)
        channels, (_, photon_share), mean = len(lit.shares), lit.noise_shares, float(strength.mean())
        floors = [(share * mean) ** 2 for share in (how.least_share, float(LIGHTS))]
        photon = noise.photon * photon_share * float(np.sqrt(lit.shares.mean()))  # ``judge_rows`` divides by the shares
        variances = [noise.read / channels, photon * mean, *floors]
        many, free = max(lights / MANY_LIGHTS, 1), lights - 3
        plain = some.error_deg is None and free > 0  # residuals are there, which three numbers were fitted to
        told, told_noise = _told_by_residuals(matrix, sigmas) if plain else (1.0, 1.0)
        return cls(
            step=one.step_of(one.plates[0].shape),
            noise=Spread(
                shares=lit.shares.astype(np.float32),
                inverse=(solving @ solving.T).astype(np.float32),
                variances=np.array(variances, np.float32),
                scale=np.float32(np.degrees(how.held)),
                toward=(matrix.mean(axis=0) / mean).astype(np.float32),
                dim=near.dim,
                wider=near.wider,
            ),
            of_noise=how.fit_noise * float(np.sqrt(many)) * told_noise,
            typical_of_noise=how.fit_noise * float(np.sqrt(many)) * told_noise / (how.held if plain else 1.0),
            of_residual=how.fit_noise / how.held * float(np.sqrt(many * lights / free)) * told if plain else 0.0,
        )

    def fit(self, surface: Surface) -> Samples:
        """Return what residuals say of every pixel: degrees, or residuals, or nothing."""
        if surface.error_deg is not None:
            return bits(surface.error_deg)
        known = self.of_residual > 0 and surface.residual is not None
        return bits(surface.residual) if known and surface.residual is not None else NOTHING

    def points(self, some: Surface) -> ThinSurface:
        """Return every nth row and column of a surface, and what noise and residuals make of them."""
        fit, v = self.fit(some), self.noise.variances
        noise_deg, fit_deg, of_noise_deg = np.zeros((3, *some.valid.shape), np.float32)
        self.fill(some, NOTHING, self.noise, (0.0, 0.0), noise_deg)
        if fit.size:
            self.fill(some, fit, self.noise._replace(variances=np.zeros_like(v)), (0.0, 1.0), fit_deg)
            self.fill(some, NOTHING, self.noise._replace(variances=v[[0, 1, 3, 3]]), (0.0, 0.0), of_noise_deg)
        return ThinSurface(
            step=self.step,
            surface=some,
            noise_deg=noise_deg,
            fit_deg=fit_deg,
            fit_of_noise_deg=np.float32(self.typical_of_noise) * of_noise_deg,
        )

    def judged(
        self,
        surface: Surface,
        doubt: Floats,
        step: int,
        *,
        limit_deg: float,
        spare: Path | None = None,
    ) -> tuple[NDArray[np.floating], Mask]:
        """Return all errors in degrees, and whether they are within the limit."""
        trusted = np.empty(surface.valid.shape, np.bool_)
        error = planes_for(trusted.shape, surface.normals.dtype, pixels=trusted.size, folder=spare)
        factors = (SURE * self.of_noise, 1.0, limit_deg)
        self.fill(surface, self.fit(surface), self.noise, factors, error, doubt=doubt, step=step, trusted=trusted)
        return error, trusted

    def fill(
        self, surface: Surface, fit: Samples, noise: Spread, factors: tuple[float, ...], error: NDArray[np.floating], *,
        doubt: Floats = NO_DOUBT, step: int = 1, trusted: Mask | None = None,
    ) -> None:  # fmt: skip
        """Fill ``error``, and ``trusted`` where it is asked for, as ``judge_rows`` does."""
        from psvideo.solve.normals.trust.judging_kernel import judge_rows

        planes, albedo = stored(surface)
        limit_deg = factors[2] if len(factors) > 2 else 0.0
        counts = np.array([*factors[:2], self.of_residual, limit_deg], np.float32)
        kept = (np.empty(error.shape, np.bool_) if trusted is None else trusted).view(np.uint8)
        rows, cols = error.shape
        read = (*planes, *albedo, error, *([fit] if fit.size else []))
        in_files = lie_in_files(*read)

        def judge(first: int, last: int) -> None:
            judge_rows(planes, albedo, fit, noise, counts, doubt, step, bits(error), kept, first, last)
            if in_files:
                let_go(*(plane[first:last] for plane in read))

        over_ranges(judge, rows, each=BAND_PIXELS // cols)


def _told_by_residuals(matrix: NDArray[np.float64], sigmas: NDArray[np.float64]) -> tuple[float, float]:
    """Return how many times more a plain fit's residuals say of a normal that faces the camera than if all lights
    (light, 3) were equally strong, and how many times more they hold of noise then (``sigmas``, of each light beside
    the others).

    What is not matte, or a wrong rig, is off with a lamp's strength, and turns normals by strong lamps' plates; a weak
    lamp among four shows most of what is left over, and that is little as such.
    """
    strengths = np.linalg.norm(matrix, axis=1)
    strengths = strengths / strengths.mean()
    solving, left = np.linalg.pinv(matrix)[:2], np.linalg.qr(matrix, mode="complete")[0][:, 3:]
    turned, by_noise = (float(((solving * each) ** 2).sum()) for each in (strengths, sigmas))
    shown, of_noise = (float(((left.T * each) ** 2).sum()) / left.shape[1] for each in (strengths, sigmas))
    told = np.sqrt(turned / by_noise / shown)
    return float(told), float(told * np.sqrt(of_noise))


def _typical_light(some: Surface) -> float:
    """Return the albedo that is typical of the brighter half of a surface."""
    shown = brightness(some.albedo)[some.valid]
    return median(shown[shown >= median(shown)]) if shown.size else 0.0
