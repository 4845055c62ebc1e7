"""Normals that hold where the surface is not matte: highlights and cast shadows weigh little, and doubt is measured.

Iteratively reweighted least squares (P. J. Huber, "Robust Statistics", 1981) per pixel, with Cauchy's or Tukey's
weights. What physics says of the measurements comes first: a saturated one, or one that is dark beside the pixel's
others (shadow, or light that grazes), is left out; highlights only ever add light, so the start is least squares
without the brightest few.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from psvideo.normals.bands import check_arrays, in_bands, surface_of
from psvideo.normals.illumination import Illumination
from psvideo.normals.task import Mask, Samples, Task, Usable, empty_result, task
from psvideo.surface import Surface

USABLE = Usable(shadow_ratio=0.4)
"""Least squares needs every measurement; here one that is dark beside the others may go sooner."""


@dataclass(frozen=True, kw_only=True)
class Reweighting:
    """How measurements are weighed; ``noise`` and ``signal_noise`` are the least that any camera's residuals have.

    rounds: how often weights are taken anew.
    loss: "cauchy" weighs everything a little, "tukey" leaves what is far off out entirely.
    width: the residual, over the pixel's own median residual as a standard deviation, where Cauchy's weight is a half
        and Tukey's becomes 0 at that times ``TUKEY_WIDTH``.
    noise: in units of sensor saturation.
    signal_noise: as a share of the pixel's albedo under one light, as lights and lenses are never known better.
    darkest, brightest: the shares of the measurements that the start leaves out.
    contradiction: four measurements contradict each other beyond so many times the noise.
    most_error_deg: a normal whose predicted standard error is larger is not valid.
    """

    rounds: int = 3
    loss: Literal["cauchy", "tukey"] = "cauchy"
    width: float = 0.4
    noise: float = 0.0005
    signal_noise: float = 0.01
    darkest: float = 0.2
    brightest: float = 0.4
    contradiction: float = 3.0
    most_error_deg: float = 6.0


TUKEY_WIDTH = 4.685  # beside Cauchy's, as far as weights go: so wide, Tukey's keeps 95 % of what Gaussian noise holds


def solve(
    plates: Sequence[Samples],
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
    threads: int | None = None,
) -> Surface:
    """Return the surface that explains most of the plates, one per light.

    Arguments are those of ``woodham1980.solve``. ``error`` asks for the predicted standard error besides.

    Of a pixel's usable measurements: five or more are reweighted; of four that contradict each other the likeliest
    highlight is left out; three are taken as they are, and nothing tells whether one of them is a highlight. A pixel is
    valid where the predicted standard error of its normal is at most ``reweighting.most_error_deg`` and the normal
    turns from the camera's axis by 110 degrees at most. The prediction knows noise, highlights, shadows and how the
    usable lights stand; it cannot know a rig that is wrong. The residual is over the usable measurements.

    The result does not depend on ``threads``. Raises ValueError where the arrays do not belong together.
    """
    check_arrays(plates, lit, seen, mask)
    from psvideo.normals import robust_kernel as kernel  # numba takes long to import: only where it is used

    samples = [np.ascontiguousarray(plate) for plate in plates]
    rows, cols = samples[0].shape[:2]
    result = empty_result(rows * cols, lit.intensities.shape[1], half=half, residual=residual)
    predicted = np.empty(rows * cols if error else 0, np.uint16 if half else np.float32)
    given = _balanced(task(samples, lit, seen, mask, usable, black_level, scale))
    how = kernel.Weights(
        rounds=reweighting.rounds,
        tukey=reweighting.loss == "tukey",
        width=np.float32(reweighting.width * (TUKEY_WIDTH if reweighting.loss == "tukey" else 1.0)),
        noise=np.float32(reweighting.noise),
        signal_noise=np.float32(reweighting.signal_noise),
        darkest=np.float32(reweighting.darkest),
        brightest=np.float32(reweighting.brightest),
        contradiction=np.float32(reweighting.contradiction),
        most_error_deg=np.float32(reweighting.most_error_deg),
    )
    in_bands(
        lambda first, last: kernel.solve_rows(given, result, predicted, kernel.working_memory(given), how, first, last),
        rows=rows,
        cols=cols,
        threads=threads,
    )
    return surface_of(result, predicted, plates[0].shape, half=half)


def _balanced(given: Task) -> Task:
    """Return the task in units in which residuals of strong and of weak lights compare, which thresholds need.

    Photon noise grows with the root of a light's strength, highlights and shadows with the strength itself: dividing
    by the root is right for the first, and between noise that is alike in all plates and the second.
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
    return given._replace(tone=tone, matrix=matrix, per_strength=per_strength, near=near)
