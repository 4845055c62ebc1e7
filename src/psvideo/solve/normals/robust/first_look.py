"""What is typical of a picture, from a sample of its rows: by it the lights are weighed, and every pixel is judged."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Flags, Floats, Mask
from psvideo.model.surface import Misfit, Surface
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.light_sigmas import light_sigmas, root_sigmas
from psvideo.solve.normals.robust.solution import Solution
from psvideo.solve.normals.robust.sure_of_motion import standing_rows, sure_of_motion
from psvideo.solve.normals.robust.weighing import EVERYTHING_DEG, Reweighting, weights
from psvideo.solve.normals.task import LIGHTS

SAMPLE_PIXELS = 1 << 16
"""What is typical of a picture is looked for in about this many pixels: whole rows, evenly spread."""
OTHERWISE = 0.1
"""Where noise would have some light weighed otherwise by more than this share, the sample is solved again so."""
ENOUGH_STANDS = 0.1
"""What stands may speak for the picture where it is at least this share of what is known."""


def first_look(
    solution: Solution,
    lit: Illumination,
    reweighting: Reweighting,
    noise: tuple[float, float],
    unsure: Floats | None = None,
    moves: Mask | None = None,
) -> tuple[Surface, Misfit | None, int]:
    """Solve a sample of the rows: return their surface, what is typical of the picture, and how many rows apart they
    are. ``noise`` is that of a measurement, as ``combined_noise`` gives it, zeros where it is not known. Where plates
    are ``unsure`` for motion, nothing is typical: a box that tumbles before a wall would spoil the wall; nor is what
    ``moves`` (row, col, on a grid of its own) where what stands fits better.

    Lights are weighed by the root of their strength first. Where that is not what their noise says, the sample is
    solved again: residuals of lights whose noise is alike show what else there is.
    """
    looked = _Look.of(solution, lit, reweighting, noise, (unsure, moves))
    if looked.misfit is None or not noise[0] > 0:
        return looked.found, looked.misfit, looked.step
    sigmas = light_sigmas(lit, noise, light=looked.light)
    if np.abs(np.log(sigmas / root_sigmas(lit))).max() > OTHERWISE:
        looked = _Look.of(solution.balanced(sigmas), lit, reweighting, noise, (unsure, moves))
    sigmas = light_sigmas(lit, noise, light=looked.light, share=looked.share_beyond(noise))
    misfit = None if looked.misfit is None else replace(looked.misfit, sigmas=tuple(sigmas.tolist()))
    return looked.found, misfit, looked.step


@dataclass(frozen=True, kw_only=True)
class _Look:
    """Every ``step``-th row solved, and what is typical of its pixels whose measurements can contradict each other:
    None where there is no such pixel. ``light``: what a light of mean strength, straight above, makes of them;
    ``least``: what residuals are taken for at least, both in units of saturation."""

    found: Surface
    step: int
    misfit: Misfit | None = None
    light: float = 0.0
    least: float = 0.0

    @classmethod
    def of(
        cls,
        solution: Solution,
        lit: Illumination,
        reweighting: Reweighting,
        noise: tuple[float, float],
        motion: tuple[Floats | None, Mask | None],
    ) -> "_Look":
        """``motion`` is by how much plates are unsure, and what moves."""
        rows, cols = solution.shown.shape[:2]
        step, unexplained = max(rows * cols // SAMPLE_PIXELS, 1), np.zeros((rows, cols), np.float32)
        how = weights(reweighting, noise, most_error_deg=EVERYTHING_DEG, common=0.0)
        solution.run(how, unexplained=unexplained.reshape(-1), step=step)
        found, sampled = solution.surface(), unexplained[::step]
        known = sampled > 0
        if found.error_deg is None or not known.any():
            return cls(found=found, step=step)
        (unsure, moves), sampled_rows = motion, np.arange(0, rows, step)
        if unsure is not None:
            sure = known & sure_of_motion(unsure, found, sampled_rows, lit)
            known = sure if sure.any() else known
        typical = _Typical.of(found, sampled, known, step)
        stands = known if moves is None else known & standing_rows(moves, found, sampled_rows)
        if np.count_nonzero(stands) >= ENOUGH_STANDS * np.count_nonzero(known):
            typical = min(typical, _Typical.of(found, sampled, stands, step))
        return cls(
            found=found,
            step=step,
            misfit=Misfit(share=typical.share, error_deg=typical.error_deg),
            light=typical.light / float(solution.given.albedo_scale),
            least=float(how.least),
        )

    def share_beyond(self, noise: tuple[float, float]) -> float:
        """Return what of their own light typical measurements are off by beyond noise, LIGHTS at least."""
        if self.misfit is None:
            return float(LIGHTS)
        by_noise = (noise[0] + noise[1] * self.light) / self.light**2
        by_limit = (float(LIGHTS) + self.least / self.light) ** 2 - float(LIGHTS) ** 2
        return float(np.sqrt(max(self.misfit.share**2 - by_noise - by_limit, float(LIGHTS) ** 2)))


class _Typical(NamedTuple):
    """What is typical of some pixels: the ``share`` of light that is not explained, and the predicted error; and their
    ``light``, in units of albedo."""

    share: float
    error_deg: float
    light: float

    @classmethod
    def of(cls, found: Surface, unexplained: Floats, known: Flags, step: int) -> "_Typical":
        """What is typical is that of their brighter half, where noise counts less."""
        channels = found.albedo[::step][known].astype(np.float32).reshape(int(known.sum()), -1)
        light = np.linalg.norm(channels, axis=1)
        bright = light >= median(light)
        error = np.zeros((0,), np.float32) if found.error_deg is None else found.error_deg[::step][known]
        return cls(
            share=median(unexplained[known][bright]),
            error_deg=median(error.astype(np.float32)),
            light=median(light[bright]) / channels.shape[1] ** 0.5,
        )
