"""Normals that hold where the surface is not matte: highlights and cast shadows weigh little, and doubt is measured.

Iteratively reweighted least squares (P. J. Huber, "Robust Statistics", 1981) per pixel, with Cauchy's or Tukey's
weights. What physics says of the measurements comes first: a saturated one, or one that is dark beside the pixel's
others (shadow, or light that grazes), is left out; highlights only ever add light, so the start is least squares
without the brightest few.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from psvideo.compute.spilled import let_go, planes_for
from psvideo.model.surface import Misfit, Subject, Surface
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.bands import ShownPlates, check_arrays, surface_of
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.robust.reflectance import points_of, reflectance_of
from psvideo.solve.normals.robust.reflectance_fit import SubjectPoints
from psvideo.solve.normals.robust.weighing import EVERYTHING_DEG, Reweighting, limit_deg, weights
from psvideo.solve.normals.task import (
    FEW,
    Floats,
    Looks,
    Mask,
    Result,
    Samples,
    Task,
    Usable,
    Weights,
    Work,
    empty_result,
    let_rows_go,
    task,
)

USABLE = Usable(shadow_ratio=0.4)
"""Least squares needs every measurement; here one that is dark beside the others may go sooner."""


SAMPLE_PIXELS = 1 << 16
"""What is typical of a picture is looked for in about this many pixels: whole rows, evenly spread."""


def solve(
    plates: Sequence[Samples] | Sequence[Mixture],
    lit: Illumination,
    *,
    seen: Mask | None = None,
    mask: Mask | None = None,
    usable: Usable = USABLE,
    reweighting: Reweighting = Reweighting(),
    black_level: float = 0.0,
    scale: float = 1.0,
    half: bool = False,
    residual: bool = True,
    error: bool = True,
    misfit: Misfit | None = None,
    subject: Subject | None = None,
    plate_noise: PlateNoise | None = None,
    spare: Path | None = None,
    unsure: Floats | None = None,
    looks: Looks | None = None,
    threads: int | None = None,
) -> Surface:
    """Return the surface that explains most of the plates, one per light.

    Arguments are those of ``woodham1980.solve``. ``error`` asks for the predicted standard error as well. ``misfit`` is
    what is typical of the picture; left out, it is found first, from a sample of the picture's rows. ``subject`` is
    what rounds of a take share; left out, it is found from these plates alone, where they are not ``unsure`` for motion
    (light, row, col of a grid of its own). Where ``plate_noise`` is known, what
    plain least squares explains to the noise is left to it: nothing is better there.

    Of a pixel's usable measurements: five or more are reweighted; of four that contradict each other the likeliest
    highlight is left out; three are taken as they are, and nothing shows whether one of them is a highlight.

    A pixel is valid where the predicted standard error of its normal is at most ``reweighting.most_error_deg``, or
    ``reweighting.beside_typical`` times what is typical of the picture where that is more, and the normal turns from
    the camera's axis by 110 degrees at most. The prediction knows noise, highlights, shadows and how the usable lights
    stand. A rig that is wrong spoils all pixels alike: that is the surface's ``misfit``, and no pixel's fault. The
    residual is over the usable measurements.

    The result does not depend on ``threads``. Raises ValueError where the arrays do not belong together.
    """
    solution = _Solution.of(
        plates, lit, seen, mask, usable, black_level, scale, half=half, residual=residual, spare=spare, threads=threads
    )
    noise, reweighting = _noise_of(plate_noise, solution), _dimmed(reweighting, plate_noise)
    if misfit is None:
        found, misfit, step = _first_look(solution, reweighting, noise)
        if misfit is not None and subject is None:
            points = points_of(
                plates, lit, found, usable, step=step, seen=seen, black_level=black_level, scale=scale, unsure=unsure
            )
            subject = Subject(reflectance=None if points is None else reflectance_of([points]))
        if misfit is not None and subject is not None:
            misfit = replace(misfit, reflectance=subject.reflectance)
    model = None if misfit is None else misfit.reflectance
    how = weights(
        reweighting,
        noise,
        most_error_deg=limit_deg(reweighting, misfit),
        common=0.0 if misfit is None else misfit.share,
        model=model,
        unit=1 / float(solution.given.albedo_scale),
    )
    solution.run(how, error=error, reflecting=model is not None, looks=looks)
    return replace(solution.surface(error=error), misfit=misfit)


def look(
    plates: Sequence[Samples] | Sequence[Mixture],
    lit: Illumination,
    *,
    seen: Mask | None = None,
    mask: Mask | None = None,
    usable: Usable = USABLE,
    reweighting: Reweighting = Reweighting(),
    plate_noise: PlateNoise | None = None,
    spare: Path | None = None,
    unsure: Floats | None = None,
) -> SubjectPoints | None:
    """Return points of the subject, as ``solve`` finds its reflectance from; None where they or the lights are too few.

    Arguments are those of ``solve``.
    """
    solution = _Solution.of(plates, lit, seen, mask, usable, 0.0, 1.0, half=False, residual=False, spare=spare)
    noise, reweighting = _noise_of(plate_noise, solution), _dimmed(reweighting, plate_noise)
    found, misfit, step = _first_look(solution, reweighting, noise)
    if misfit is None:
        return None
    return points_of(plates, lit, found, usable, step=step, seen=seen, black_level=0.0, scale=1.0, unsure=unsure)


@dataclass(frozen=True, kw_only=True)
class _Solution:
    """A picture's task, and where its solution and ``predicted`` errors (pixel,) go as the loops run over its rows."""

    shown: ShownPlates
    given: Task
    result: Result
    predicted: Samples
    half: bool
    residual: bool
    threads: int | None

    @classmethod
    def of(
        cls, plates: Sequence[Samples] | Sequence[Mixture], lit: Illumination, seen: Mask | None, mask: Mask | None,
        usable: Usable, black_level: float, scale: float,
        *, half: bool, residual: bool, spare: Path | None, threads: int | None = None,
    ) -> "_Solution":  # fmt: skip
        """Make room for the solution of plates; arguments are those of ``solve``."""
        shown = ShownPlates.of(plates)
        check_arrays(shown.samples, lit, seen, mask)
        shown = shown.as_floats()  # one kind of samples, and so one loop to compile
        (rows, cols), channels = shown.shape[:2], lit.intensities.shape[1]  # which are combined
        return cls(
            shown=shown,
            given=_balanced(task(shown.samples, lit, seen, mask, usable, black_level, scale)),
            result=empty_result(rows * cols, channels, half=half, residual=residual, spare=spare),
            predicted=planes_for((rows * cols,), np.uint16 if half else np.float32, pixels=rows * cols, folder=spare),
            half=half,
            residual=residual,
            threads=threads,
        )

    def run(
        self,
        how: Weights,
        *,
        error: bool = True,
        unexplained: Floats | None = None,
        step: int = 1,
        reflecting: bool = False,
        looks: Looks | None = None,
    ) -> None:
        """Solve every ``step``-th row. ``error`` asks for predicted errors; ``unexplained`` (pixel,) takes the share of
        its light that each pixel's lights leave unexplained. ``looks`` looks at each band while it is in memory."""
        from psvideo.solve.normals.robust import robust_kernel as kernel

        cols, result, predicted = self.shown.shape[1], self.result, self.predicted
        into = (predicted if error else predicted[:0]).view(np.uint8)
        left = np.zeros(0, np.float32) if unexplained is None else unexplained

        def memory(one: Task) -> tuple[kernel.Memory, Work | None]:
            own = kernel.working_memory(one, reflecting=reflecting, residual=self.residual)
            return own, None if looks is None else looks.memory()

        def band(one: Task, room: tuple[kernel.Memory, Work | None], first: int, last: int) -> None:
            own, beside = room
            kernel.solve_rows(one, kernel.as_bytes(result), self.half, into, left, own, how, first, last, step)
            if looks is not None and beside is not None:
                looks.look(one, result, beside, first, last)
            let_rows_go(result, cols, first, last)
            let_go(predicted[first * cols : last * cols])

        self.shown.in_bands(band, self.given, memory, threads=self.threads, step=step)

    def surface(self, *, error: bool = True) -> Surface:
        """Return what was solved as a surface, in the same memory."""
        return surface_of(self.result, self.predicted if error else None, self.shown.shape, half=self.half)


def _noise_of(plate_noise: PlateNoise | None, solution: _Solution) -> tuple[float, float]:
    """Return the variance of the channels' combined noise in the dark, and per unit of light; 0 where unknown."""
    channels = len(solution.result.albedo)
    return (0.0, 0.0) if plate_noise is None else (plate_noise.read / channels, plate_noise.photon / channels)


def _dimmed(reweighting: Reweighting, plate_noise: PlateNoise | None) -> Reweighting:
    """Return the settings with the least noise of a picture whose light is as little as is known of it."""
    if plate_noise is None:
        return reweighting
    return replace(reweighting, noise=reweighting.noise * plate_noise.dimness)


def _first_look(
    solution: _Solution, reweighting: Reweighting, noise: tuple[float, float]
) -> tuple[Surface, Misfit | None, int]:
    """Solve a sample of the rows: return their surface, what is typical of the picture, and how many rows apart they
    are."""
    rows, cols = solution.shown.shape[:2]
    step, unexplained = max(rows * cols // SAMPLE_PIXELS, 1), np.zeros(rows * cols, np.float32)
    how = weights(reweighting, noise, most_error_deg=EVERYTHING_DEG, common=0.0)
    solution.run(how, unexplained=unexplained, step=step)
    found = solution.surface()
    return found, _typical(found, unexplained.reshape(rows, cols), step), step


def _typical(found: Surface, unexplained: Floats, step: int) -> Misfit | None:
    """Return what is typical of the pixels in every ``step``-th row whose measurements can contradict each other.

    The share is that of their brighter half, where noise counts less. None where there is no such pixel.
    """
    sampled = unexplained[::step]
    known = sampled > 0
    if found.error_deg is None or not known.any():
        return None
    light = np.linalg.norm(found.albedo[::step][known].astype(np.float32).reshape(int(known.sum()), -1), axis=1)
    bright = light >= np.median(light)
    return Misfit(
        share=float(np.median(sampled[known][bright])), error_deg=float(np.median(found.error_deg[::step][known]))
    )


def _balanced(given: Task) -> Task:
    """Return the task in units in which residuals of strong and of weak lights compare, which thresholds need.

    Photon noise grows with the root of a light's strength, highlights and shadows with the strength itself: dividing
    by the root is right for the first, and between noise that is alike in all plates and the second. From four distant
    lights on, up to FEW are filled up with lights that weigh nothing, for which there is a faster way.
    """
    factor = np.sqrt(given.per_strength)[: given.lights, None]
    tone = given.tone.copy()
    tone[: given.lights, :, :3] *= factor[..., None]
    tone[: given.lights, :, 3] /= factor
    matrix, per_strength = given.matrix.copy(), given.per_strength.copy()
    matrix[: given.lights] *= factor
    per_strength[: given.lights] /= factor[:, 0]
    strengths = given.near.strengths.copy()  # empty where all lights are distant
    strengths[: given.lights] *= factor[: len(strengths), 0]
    near = given.near._replace(strengths=strengths)
    more = max(FEW - len(tone), 0) if given.lights > 3 and not given.near.depth.size else 0
    return given._replace(
        tone=np.pad(tone, ((0, more), (0, 0), (0, 0)), mode="edge"),
        matrix=np.pad(matrix, ((0, more), (0, 0))),
        per_strength=np.pad(per_strength, (0, more), mode="edge"),
        near=near,
    )
