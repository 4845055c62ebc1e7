"""Normals and albedo by linear least squares, the classic of photometric stereo.

R. J. Woodham, "Photometric method for determining surface orientation from multiple images", Optical Engineering 19(1),
1980. A matte surface under distant light l shows I_l = E_l a (n . d_l); with three or more lights not in one plane,
a n is the least-squares solution of these equations, which minimises the plates' residual.
"""

from collections.abc import Sequence
from pathlib import Path

from psvideo.model.arrays import Mask
from psvideo.model.surface import Surface
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.bands import ShownPlates, check_arrays, surface_of
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.loops.blocks import working_memory
from psvideo.solve.normals.task import EVERYTHING, Looks, Samples, Task, Usable, Work, empty_result, let_rows_go, task

__all__ = ["EVERYTHING", "Usable", "solve"]


def solve(
    plates: Sequence[Samples] | Sequence[Mixture],
    lit: Illumination,
    *,
    seen: Mask | None = None,
    mask: Mask | None = None,
    usable: Usable = Usable(),
    black_level: float = 0.0,
    scale: float = 1.0,
    half: bool = False,
    residual: bool = True,
    spare: Path | None = None,
    looks: Looks | None = None,
    threads: int | None = None,
) -> Surface:
    """Return the surface that explains one plate per light.

    plates: one per light of ``lit``, in its order, each (row, col) or (row, col, 3), all of one type: float32 with
        1.0 = saturation, or uint16 codes, for which (code - ``black_level``) * ``scale`` is that; or pictures that are
        not made yet, of which no more than a band of rows ever is.
    seen: True where a plate's rows were exposed, shape (light, row) or (light, row, col); by default all.
    mask: True where to solve, shape (row, col); by default everywhere.
    half: give half floats instead of float32.
    spare: a folder in whose files large pictures are worked on.
    looks: what else looks at rows once they are solved, while their samples are there.

    Of three channels, one normal: each channel counts by its albedo in the pixel, and by how much of it the lights
    send; then each gets its least-squares albedo for that normal. A pixel is valid where three or more usable
    measurements remain, their lights are not nearly coplanar (Frobenius condition number at most PIXEL_CONDITION, or
    the rig's own), and the normal turns from the camera's axis by 110 degrees at most (in perspective, what is seen may
    turn by more than 90). With three lights that means: none in shadow, none saturated. What remains in a valid pixel
    is noise, and what is not matte (highlights, light from neighbouring surfaces).

    The result does not depend on ``threads``. Raises ValueError where the arrays do not belong together.
    """
    from psvideo.solve.normals.least_squares.kernel import solve_rows

    shown = ShownPlates.of(plates)
    check_arrays(shown.samples, lit, seen, mask)
    rows, cols = shown.shape[:2]
    result = empty_result(rows * cols, lit.intensities.shape[1], half=half, residual=residual, spare=spare)
    given = task(shown.samples, lit, seen, mask, usable, black_level, scale)

    def memory(one: Task) -> tuple[Work, Work | None]:
        return working_memory(one), None if looks is None else looks.memory()

    def solve_band(one: Task, room: tuple[Work, Work | None], first: int, last: int) -> None:
        work, beside = room
        solve_rows(one, result, work, first, last)
        if looks is not None and beside is not None:
            looks.look(one, result, beside, first, last)
        let_rows_go(result, cols, first, last)

    shown.in_bands(solve_band, given, memory, threads=threads)
    return surface_of(result, None, shown.shape, half=half)
