"""What to think of measured normals: how far each may be off, and which are to be trusted.

Noise and the lights' directions say what a fit can know; how well many lights agree says how far the surface is from
matte and the rig from true. Where they disagree in the whole picture, creases are worse than that: light from
neighbouring surfaces goes into all measurements alike, and no residual shows it.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.surface import MEASURED, Misfit, Surface
from psvideo.solve.normals.bands import BAND_PIXELS
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.plate_noise import PlateNoise


@dataclass(frozen=True, kw_only=True)
class Judging:
    """How errors are predicted and when a normal is trusted.

    most_error_deg, beside_typical: a normal is trusted where its predicted error is at most this, or so many times what
        is typical of the picture where that is more: a rig that is wrong is no pixel's fault.
    least_misfit, misfit_share: what noise does not explain of a picture's light counts from the first share on, and
        whole from the second.
    residual_share, bent_share, common_deg: such a picture's normals are off by so much of what robust solving predicts
        from residuals, by this share of the angle to the mean of those around, and by so many degrees. From photographs
        of a ball, a bear and a cat (DiLiGenT), held against the others.
    unusual: residuals beyond so many times the typical ones count in every picture.
    held: so many standard deviations hold 68 % of two-dimensional Gaussian errors (1.07, and some doubt).
    reweighted: how much more noise costs where measurements are weighed by what they show.
    """

    most_error_deg: float = 6.0
    beside_typical: float = 1.25
    residual_share: float = 0.85
    bent_share: float = 0.75
    common_deg: float = 1.0
    least_misfit: float = 0.004
    misfit_share: float = 0.010
    unusual: float = 2.0
    held: float = 1.15
    reweighted: float = 1.1


LEAST_SHARE = 0.01
"""What robust solving takes for unexplained at least (``Reweighting.signal_noise``)."""
NOISY_SHARES = (0.015, 0.03)
"""From so much of the light on noise is blamed rather than the rig: it may be twice what its finest detail says."""
THIN = 4
"""What is typical is looked for in every fourth row and column."""
AROUND_PX = 9
"""Normals are held against the mean of those in a square of this width."""
MOST_BENT_DEG = 10.0
"""Angles to the mean of those around never count for more: detail is no crease."""
MOST_TYPICAL_DEG = 8.0
"""However bad a picture is as a whole, beyond this no normal is trusted."""


def judged(surface: Surface, lit: Illumination, noise: PlateNoise, *, how: Judging = Judging()) -> Surface:
    """Return the surface with ``error_deg`` of all that was solved, and ``valid`` where that is small enough.

    What robust solving predicted is in ``error_deg`` already; of least squares noise and residuals say what is known.
    """
    solved, misfit = surface.valid, surface.misfit
    error = _from_noise(surface, lit, noise, how)
    if surface.error_deg is not None and misfit is not None:
        share = _not_explained(misfit, _noise_share(surface, lit, noise), how)
        fit = np.float32(how.residual_share) * surface.error_deg.astype(np.float32)
        usual = np.float32(how.residual_share * misfit.error_deg)
        error = np.sqrt(
            (how.reweighted * error) ** 2 + (share * fit) ** 2 + np.maximum(fit - how.unusual * usual, 0) ** 2
        )
        if share > 0:
            error += share * (np.float32(how.bent_share) * _bent_deg(surface) + np.float32(how.common_deg))
        misfit = replace(misfit, share=float(share) * misfit.share)
    error *= solved
    limit_deg = how.most_error_deg
    some = error[::THIN, ::THIN][solved[::THIN, ::THIN]]
    if misfit is not None and len(some):
        typical_deg = float(np.median(some)) if misfit.share > 0 else 0.0
        limit_deg = max(limit_deg, min(how.beside_typical * typical_deg, MOST_TYPICAL_DEG))
        misfit = replace(misfit, error_deg=typical_deg)
    trusted = solved & (error <= np.float32(limit_deg))
    return replace(surface, valid=trusted, error_deg=error.astype(surface.normals.dtype), misfit=misfit)


def emptied(surface: Surface) -> Surface:
    """Return the surface with zeros where it is not valid; its memory is taken over."""
    for plane in (surface.normals, surface.albedo, surface.error_deg, surface.residual):
        if plane is not None:
            plane[~surface.valid] = 0
    return replace(surface, source=np.where(surface.valid, MEASURED, np.uint8(0)).astype(np.uint8))


def _not_explained(misfit: Misfit, noise_share: float, how: Judging) -> np.float32:
    """Return from 0 to 1 how much of what is left over in a picture neither noise nor a camera's usual faults make."""
    noise = noise_share * float(np.interp(noise_share, NOISY_SHARES, (1, 2)))
    share = np.sqrt(max(misfit.share**2 - LEAST_SHARE**2 - noise**2, 0.0))
    return np.float32(np.clip((share - how.least_misfit) / (how.misfit_share - how.least_misfit), 0, 1))


def _noise_share(surface: Surface, lit: Illumination, noise: PlateNoise) -> float:
    """Return the noise of a typical pixel as a share of its light."""
    levels = surface.albedo[::THIN, ::THIN][surface.valid[::THIN, ::THIN]].astype(np.float32)
    if not levels.size:
        return 0.0
    level = float(np.median(levels) * lit.intensities.mean())
    return float(noise.at(level / 2) / (level * np.sqrt(_channels(surface))))


def _channels(surface: Surface) -> int:
    return 1 if surface.albedo.ndim == 2 else int(surface.albedo.shape[-1])


def _from_noise(surface: Surface, lit: Illumination, noise: PlateNoise, how: Judging) -> NDArray[np.float32]:
    """Return the error that noise makes of least squares under all lights, and residuals where there are any."""
    strength = lit.intensities.mean(axis=1)
    matrix = lit.directions * strength[:, None]
    inverse = np.linalg.inv(matrix.T @ matrix).astype(np.float32)
    error = np.zeros(surface.valid.shape, np.float32)
    from psvideo.solve.normals.judging_kernel import judge_rows

    planes, albedo = np.moveaxis(surface.normals, -1, 0), surface.albedo
    albedo = albedo[None] if albedo.ndim == 2 else np.moveaxis(albedo, -1, 0)
    checks = surface.residual is not None and surface.error_deg is None and len(strength) > 3
    residual = surface.residual if surface.residual is not None and checks else error[:0]
    scale = np.float32(np.degrees(how.held))
    variances = np.array([noise.read, noise.photon * strength.mean() / 2], np.float32) / np.float32(len(albedo))
    rows, cols = surface.valid.shape

    def judge(first: int, last: int) -> None:
        judge_rows(_bits(planes), _bits(albedo), _bits(residual), inverse, variances, scale, error, first, last)

    over_ranges(judge, rows, each=BAND_PIXELS // cols)
    return error


def _bits(planes: NDArray[np.floating]) -> NDArray[np.generic]:
    return planes.view(np.uint16) if planes.dtype == np.float16 else planes


def _bent_deg(surface: Surface) -> NDArray[np.float32]:
    """Return the angle between every normal and the mean of those around it, large ones shortened."""
    planes = [surface.normals[..., axis].astype(np.float32) for axis in range(3)]
    means = [cv2.blur(plane, (AROUND_PX, AROUND_PX)) for plane in planes]
    along = planes[0] * means[0] + planes[1] * means[1] + planes[2] * means[2]
    length = np.sqrt(means[0] ** 2 + means[1] ** 2 + means[2] ** 2)
    cosine = along / np.maximum(length, np.float32(1e-6))
    bent = np.degrees(np.sqrt(np.maximum(2 - 2 * cosine, 0)))
    return np.asarray(bent / (1 + bent / MOST_BENT_DEG), np.float32)
