"""One round as the solvers take it, for those who look at it again: what is judged and what is filled."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import NamedTuple

from psvideo.model.arrays import Floats, Mask
from psvideo.solve.normals.bands import ShownPlates
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.loops.blocks import working_memory
from psvideo.solve.normals.task import Task, Usable, Work, task

GRID_PX = 480
"""The points at which surfaces are judged are at most this many along the longer side."""


class Indirect(NamedTuple):
    """Light that comes by way of other surfaces, as far as it shows: at every point at which a surface is judged, the
    light of lamps that do not reach it, in units of albedo, summed, and their number; and by how much the square of
    what noise makes of a normal is ``wider`` there than if all lamps reached it."""

    sums: Floats
    counts: Floats
    wider: Floats


class Left(NamedTuple):
    """What normals leave of the plates, at every point at which a surface is judged: of all lights the squares of what
    their plates show beyond a matte surface, in units of albedo, summed, and how many lights show there."""

    squares: Floats
    lights: Floats


@dataclass(frozen=True, kw_only=True)
class Evidence(LitPlates):
    """Plates, lights, and which samples to look at; ``spare``, a folder in whose files large pictures are worked on.

    ``indirect`` is what the solver saw on its way, and ``left``, where
    plates are unsure. ``metal_deg`` is by how much normals of metal may be off because what it shows is not known
    better, at these points. ``grid_px`` is how many points there are at most along the longer side.
    """

    usable: Usable
    indirect: Indirect | None = None
    left: Left | None = None
    metal_deg: Floats | None = None
    spare: Path | None = None
    grid_px: int = GRID_PX

    @classmethod
    def of(cls, given: LitPlates, usable: Usable, *, spare: Path | None, grid_px: int) -> "Evidence":
        """Return the evidence that plates give before a solver has seen them."""
        shown = {field.name: getattr(given, field.name) for field in fields(LitPlates)}
        return cls(**shown, usable=usable, spare=spare, grid_px=grid_px)

    def step_of(self, shape: tuple[int, ...]) -> int:
        """Return how many rows and columns of a picture lie between two points at which it is judged."""
        return max(-(-max(shape[:2]) // self.grid_px), 1)

    def in_bands(
        self,
        run: Callable[[Task, Work, int, int], None],
        threads: int | None = None,
        *,
        step: int = 1,
        needed: Mask | None = None,
    ) -> None:
        """Call ``run(task, work, first, last)`` for bands of rows, of which it needs every ``step``-th, and of these
        those ``needed`` (row,); pictures that are not made are made band by band."""
        shown = ShownPlates.of(self.plates)
        given = task(shown.samples, self.lit, self.seen, self.mask, self.usable, self.black_level, self.scale)
        shown.in_bands(run, given, working_memory, threads=threads, step=step, needed=needed)
