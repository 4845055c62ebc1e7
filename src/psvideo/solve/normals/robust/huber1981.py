"""Normals that hold where the surface is not matte: highlights and cast shadows weigh little, and doubt is measured.

Iteratively reweighted least squares (P. J. Huber, "Robust Statistics", 1981) per pixel, with Cauchy's or Tukey's
weights. What physics says of the measurements comes first: a saturated one, or one that is dark beside the pixel's
others (shadow, or light that grazes), is left out; highlights only ever add light, so the start is least squares
without the brightest few.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from psvideo.model.surface import Misfit, Subject, Surface
from psvideo.solve.normals.asked_surface import AskedSurface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.light_sigmas import combined_noise
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.robust.first_look import first_look
from psvideo.solve.normals.robust.reflectance import points_of, reflectance_of
from psvideo.solve.normals.robust.solution import Solution
from psvideo.solve.normals.robust.subject_points import SubjectPoints
from psvideo.solve.normals.robust.weighing import Reweighting, limit_deg, weights
from psvideo.solve.normals.task import Looks, Usable

USABLE = Usable(shadow_ratio=0.4)
"""Least squares needs every measurement; here one that is dark beside the others may go sooner."""


def solve(
    given: LitPlates,
    *,
    usable: Usable = USABLE,
    reweighting: Reweighting = Reweighting(),
    asked: AskedSurface = AskedSurface(),
    misfit: Misfit | None = None,
    subject: Subject | None = None,
    plate_noise: PlateNoise | None = None,
    looks: Looks | None = None,
    threads: int | None = None,
) -> Surface:
    """Return the surface that explains most of the plates, one per light.

    ``usable`` and ``looks`` are as for ``woodham1980.solve``. ``misfit`` is what is typical of the picture; left out,
    it is found first, from a sample of the picture's rows. ``subject`` is what rounds of a take share; left out, it is
    found from these plates alone, where they are not ``unsure`` for motion. What ``moves`` is not typical where what
    stands fits better. Where ``plate_noise`` is known, what plain least squares explains to the noise is left to it:
    nothing is better there.

    Of a pixel's usable measurements: five or more are reweighted; of four that contradict each other the likeliest
    highlight is left out; three are taken as they are, and nothing shows whether one of them is a highlight.

    A pixel is valid where the predicted standard error of its normal is at most ``reweighting.most_error_deg``, or
    ``reweighting.beside_typical`` times what is typical of the picture where that is more, and the normal turns from
    the camera's axis by 110 degrees at most. The prediction knows noise, highlights, shadows and how the usable lights
    stand. A rig that is wrong spoils all pixels alike: that is the surface's ``misfit``, and no pixel's fault. The
    residual is over the usable measurements.

    The result does not depend on ``threads``. Raises ValueError where the arrays do not belong together.
    """
    noise, reweighting = _noise_of(plate_noise, given.lit), _dimmed(reweighting, plate_noise)
    solution = Solution.of(given, usable, noise, asked, threads=threads)
    if misfit is None:
        found, misfit, step = first_look(solution, given.lit, reweighting, noise, given.unsure, given.moves)
        if misfit is not None and subject is None:
            points = points_of(given, found, usable, step=step)
            subject = Subject(reflectance=None if points is None else reflectance_of([points]))
        if misfit is not None and subject is not None:
            misfit = replace(misfit, reflectance=subject.reflectance)
    if misfit is not None and misfit.sigmas:
        solution = solution.balanced(np.array(misfit.sigmas))
    model = None if misfit is None else misfit.reflectance
    how = weights(
        reweighting,
        noise,
        most_error_deg=limit_deg(reweighting, misfit),
        common=0.0 if misfit is None else misfit.share,
        model=model,
        unit=1 / float(solution.given.albedo_scale),
    )
    knowing = None if looks is None else looks.knowing(model)
    solution.run(how, error=asked.error, reflecting=model is not None, looks=knowing)
    return replace(solution.surface(error=asked.error), misfit=misfit)


def look(
    given: LitPlates,
    *,
    usable: Usable = USABLE,
    reweighting: Reweighting = Reweighting(),
    plate_noise: PlateNoise | None = None,
    spare: Path | None = None,
) -> SubjectPoints | None:
    """Return points of the subject, as ``solve`` finds its reflectance from; None where they or the lights are too few.

    Arguments are those of ``solve``.
    """
    noise, reweighting = _noise_of(plate_noise, given.lit), _dimmed(reweighting, plate_noise)
    solution = Solution.of(given, usable, noise, AskedSurface(residual=False, spare=spare))
    found, misfit, step = first_look(solution, given.lit, reweighting, noise, given.unsure, given.moves)
    return None if misfit is None else points_of(given, found, usable, step=step)


def _noise_of(plate_noise: PlateNoise | None, lit: Illumination) -> tuple[float, float]:
    """Return the variance of the channels' combined noise in the dark, and per unit of light; 0 where unknown."""
    return (0.0, 0.0) if plate_noise is None else combined_noise(plate_noise, lit)


def _dimmed(reweighting: Reweighting, plate_noise: PlateNoise | None) -> Reweighting:
    """Return the settings with the least noise of a picture whose light is as little as is known of it."""
    if plate_noise is None:
        return reweighting
    return replace(reweighting, noise=reweighting.noise * plate_noise.dimness)
