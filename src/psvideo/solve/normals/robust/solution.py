"""A picture's task for the robust solver, and where its solution goes as the loops run over its rows."""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.compute.spilled import let_go, planes_for
from psvideo.model.arrays import Doubles, Floats, Samples
from psvideo.model.surface import Surface
from psvideo.solve.normals.asked_surface import AskedSurface
from psvideo.solve.normals.bands import ShownPlates, check_arrays, surface_of
from psvideo.solve.normals.light_sigmas import root_sigmas, with_noise
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.result import Result, empty_result, let_rows_go
from psvideo.solve.normals.robust.weighing import Weights
from psvideo.solve.normals.task import FEW, Looks, Task, Usable, Work, task


@dataclass(frozen=True, kw_only=True)
class Solution:
    """A picture's task, and where its solution and ``predicted`` errors (pixel,) go as the loops run over its rows.

    as_it_is: the task in the plates' units; given: the same, its lights balanced.
    """

    shown: ShownPlates
    as_it_is: Task
    given: Task
    result: Result
    predicted: Samples
    asked: AskedSurface
    threads: int | None

    @classmethod
    def of(
        cls,
        plates: LitPlates,
        usable: Usable,
        noise: tuple[float, float],
        asked: AskedSurface,
        *,
        threads: int | None = None,
    ) -> "Solution":
        """Make room for the solution of plates; arguments are those of ``solve``, ``noise`` that of a measurement, its
        channels combined: in the dark, and what a unit of light adds, as variances."""
        shown, lit, seen, mask = ShownPlates.of(plates.plates), plates.lit, plates.seen, plates.mask
        check_arrays(shown.samples, lit, seen, mask)
        shown = shown.as_floats()  # one kind of samples, and so one loop to compile
        (rows, cols), channels = shown.shape[:2], lit.intensities.shape[1]  # which are combined
        pixels, half, spare = rows * cols, asked.half, asked.spare
        read = task(shown.samples, lit, seen, mask, usable, plates.black_level, plates.scale)
        as_it_is = with_noise(read, lit, noise)
        return cls(
            shown=shown,
            as_it_is=as_it_is,
            given=_balanced(as_it_is, root_sigmas(lit)),
            result=empty_result(pixels, channels, half=half, residual=asked.residual, spare=spare),
            predicted=planes_for((pixels,), np.uint16 if half else np.float32, pixels=pixels, folder=spare),
            asked=asked,
            threads=threads,
        )

    def balanced(self, sigmas: Doubles) -> "Solution":
        """Return the same with lights whose measurements are off by ``sigmas`` (light,), beside each other."""
        return replace(self, given=_balanced(self.as_it_is, sigmas))

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
        from psvideo.solve.normals.robust.handing_out import as_bytes

        cols, result, predicted = self.shown.shape[1], self.result, self.predicted
        out, into = as_bytes(result), (predicted if error else predicted[:0]).view(np.uint8)
        left = np.zeros(0, np.float32) if unexplained is None else unexplained

        def memory(one: Task) -> tuple[kernel.Memory, Work | None]:
            own = kernel.working_memory(one, reflecting=reflecting, residual=self.asked.residual)
            return own, None if looks is None else looks.memory()

        def band(one: Task, room: tuple[kernel.Memory, Work | None], first: int, last: int) -> None:
            own, beside = room
            kernel.solve_rows(one, out, self.asked.half, into, left, own, how, first, last, step)
            if looks is not None and beside is not None:
                looks.look(one, result, beside, first, last)
            let_rows_go(result, cols, first, last)
            let_go(predicted[first * cols : last * cols])

        self.shown.in_bands(band, self.given, memory, threads=self.threads, step=step)

    def surface(self, *, error: bool = True) -> Surface:
        """Return what was solved as a surface, in the same memory."""
        return surface_of(self.result, self.predicted if error else None, self.shown.shape, half=self.asked.half)


def _balanced(given: Task, sigmas: Doubles) -> Task:
    """Return the task in units in which residuals of strong and of weak lights compare, which medians and thresholds
    need: each light's measurements over what they are off by.

    From four distant lights on, up to FEW are filled up with lights that weigh nothing, for which there is a faster
    way.
    """
    factor = (1 / sigmas[:, None]).astype(np.float32)
    tone = given.tone.copy()
    tone[: given.lights, :, :3] *= factor[..., None]
    tone[: given.lights, :, 3] /= factor
    dark = given.dark.copy()
    dark[: given.lights] *= factor[:, 0]
    matrix, per_strength = given.matrix.copy(), given.per_strength.copy()
    matrix[: given.lights] *= factor
    per_strength[: given.lights] /= factor[:, 0]
    noise = given.noise.copy()
    noise[: given.lights] *= np.concatenate([factor**2, factor], axis=1)
    strengths = given.near.strengths.copy()  # empty where all lights are distant
    strengths[: given.lights] *= factor[: len(strengths), 0]
    near = given.near._replace(strengths=strengths)
    more = max(FEW - len(tone), 0) if given.lights > 3 and not given.near.depth.size else 0
    return given._replace(
        tone=np.pad(tone, ((0, more), (0, 0), (0, 0)), mode="edge"),
        matrix=np.pad(matrix, ((0, more), (0, 0))),
        per_strength=np.pad(per_strength, (0, more), mode="edge"),
        dark=np.pad(dark, (0, more), mode="edge"),
        noise=np.pad(noise, ((0, more), (0, 0))),
        near=near,
    )
