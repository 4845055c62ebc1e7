"""Normals and albedo by linear least squares, the classic of photometric stereo.

R. J. Woodham, "Photometric method for determining surface orientation from multiple images", Optical Engineering 19(1),
1980. A matte surface under distant light l shows I_l = E_l a (n . d_l); with three or more lights not in one plane,
a n is the least-squares solution of these equations, which minimises the plates' residual.
"""

from psvideo.model.surface import Surface
from psvideo.solve.normals.asked_surface import AskedSurface
from psvideo.solve.normals.bands import ShownPlates, check_arrays, surface_of
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.loops.blocks import working_memory
from psvideo.solve.normals.result import empty_result, let_rows_go
from psvideo.solve.normals.task import EVERYTHING, Looks, Task, Usable, Work, task

__all__ = ["EVERYTHING", "Usable", "solve"]


def solve(
    given: LitPlates,
    *,
    usable: Usable = Usable(),
    asked: AskedSurface = AskedSurface(),
    looks: Looks | None = None,
    threads: int | None = None,
) -> Surface:
    """Return the surface that explains one plate per light, without predicted errors.

    ``usable`` says which measurements count. ``looks`` looks at rows once they are solved, while their samples are
    there.

    Of three channels, one normal: each channel counts by its albedo in the pixel, and by how much of it the lights
    send; then each gets its least-squares albedo for that normal. A pixel is valid where three or more usable
    measurements remain, their lights are not nearly coplanar (Frobenius condition number at most PIXEL_CONDITION, or
    the rig's own), and the normal turns from the camera's axis by 110 degrees at most (in perspective, what is seen may
    turn by more than 90). With three lights that means: none in shadow, none saturated. What remains in a valid pixel
    is noise, and what is not matte (highlights, light from neighbouring surfaces).

    The result does not depend on ``threads``. Raises ValueError where the arrays do not belong together.
    """
    from psvideo.solve.normals.least_squares.kernel import solve_rows

    shown, lit, seen, mask = ShownPlates.of(given.plates), given.lit, given.seen, given.mask
    check_arrays(shown.samples, lit, seen, mask)
    rows, cols = shown.shape[:2]
    result = empty_result(
        rows * cols, lit.intensities.shape[1], half=asked.half, residual=asked.residual, spare=asked.spare
    )
    whole = task(shown.samples, lit, seen, mask, usable, given.black_level, given.scale)

    def memory(one: Task) -> tuple[Work, Work | None]:
        return working_memory(one), None if looks is None else looks.memory()

    def solve_band(one: Task, room: tuple[Work, Work | None], first: int, last: int) -> None:
        work, beside = room
        solve_rows(one, result, work, first, last)
        if looks is not None and beside is not None:
            looks.look(one, result, beside, first, last)
        let_rows_go(result, cols, first, last)

    shown.in_bands(solve_band, whole, memory, threads=threads)
    return surface_of(result, None, shown.shape, half=asked.half)
