"""Pictures as arrays in, the surface out: for people who have neither a clip nor a plan."""

from collections.abc import Sequence
from dataclasses import replace
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from psvideo.errors import UsageError, nearest
from psvideo.model.choices import NEAR_ITERATIONS, Solver
from psvideo.model.irradiance.ground import Ground
from psvideo.model.rig import Rig
from psvideo.model.surface import Surface
from psvideo.solve.array_checks import (
    check_count,
    check_lit,
    checked_images,
    checked_lights,
    checked_mask,
    checked_saturation,
)
from psvideo.solve.depth import view_of
from psvideo.solve.near_surface import near_surface_of, solve_near
from psvideo.solve.normals.illumination import Illumination, illumination
from psvideo.solve.normals.solving import Solving
from psvideo.solve.sweeping import swept


def solve_images(
    images: ArrayLike | Sequence[ArrayLike],
    lights: ArrayLike | Rig,
    *,
    intensities: ArrayLike | None = None,
    mask: ArrayLike | None = None,
    saturation: float = 1.0,
    black_level: float | None = None,
    white_level: float | None = None,
    solver: Solver = "auto",
    fill: bool = True,
) -> Surface:
    """Return the surface that explains photographs of a still scene, one per light.

    Parameters
    ----------
    images
        Shape (light, row, col) or (light, row, col, 3), or a list of pictures; linear light as floats, with ambient
        light taken off. Integer codes are taken where ``white_level`` says what they mean.
    lights
        Shape (light, 3): for each image the unit vector from the surface to its light, in the camera's frame (x right,
        y up, z towards the camera). Or a Rig, whose lights stand in the order of the images
        (``rig.ordered(names)`` puts them so).
    intensities
        Shape (light,) or (light, channel): how strong each light is, above 0; 1 left out. A Rig has its own.
    mask
        Shape (row, col), bool: True where to solve; everywhere left out.
    saturation
        The value from which on a sample is clipped and says nothing; ``inf`` where nothing clips.
    black_level, white_level
        Of integer codes: the code of no light (0 left out) and that of saturation. The codes must be linear.
    solver
        "robust" weighs highlights and shadows down, "least-squares" takes the surface as matte, "auto" is robust from
        five lights on.
    fill
        Give what fewer than three lights reach a best estimate, which is not valid; else it is 0.

    Returns
    -------
    Surface
        ``normals`` (row, col, 3), ``albedo`` (row, col[, 3]), ``valid`` (row, col), where normals were measured and are
        to be trusted, ``residual`` (row, col), and ``error_deg`` (row, col), the predicted error of every normal in
        degrees. ``source`` (row, col) says where a normal is from: 1 three lights or more, 2 two lights, 3 one light,
        4 its surroundings; where it is 0, so are the others. Without ``fill`` all are 0 where ``valid`` is False.

    Raises
    ------
    PsvideoError
        Where shapes do not belong together, numbers are missing (NaN), codes have no meaning, there are fewer than
        three lights, or they lie in one plane with the surface. The message says what came and what was expected.

    Examples
    --------
    A grey wall that faces the camera, under three lights:

    >>> import numpy as np
    >>> import psvideo as ps
    >>> directions = np.array([[0.6, 0, 0.8], [-0.6, 0, 0.8], [0, 0.6, 0.8]])
    >>> images = 0.5 * directions[:, 2, None, None] * np.ones((3, 4, 5))
    >>> surface = ps.solve_images(images, directions)
    >>> surface.normals[0, 0].round(3) + 0.0
    array([0., 0., 1.], dtype=float32)
    >>> round(float(surface.albedo[0, 0]), 3), bool(surface.valid.all())
    (0.5, True)
    """
    if solver not in get_args(Solver):
        raise UsageError(f"`solver` is {solver!r}; {nearest(str(solver), get_args(Solver))}")
    stack = checked_images(images, black_level=black_level, white_level=white_level)
    rows, cols, channels = stack.shape[1], stack.shape[2], 1 if stack.ndim == 3 else 3
    rig = lights if isinstance(lights, Rig) else Rig(lights=checked_lights(lights, intensities, stack))
    if rig is lights:
        _refuse_second_strengths(intensities)
        check_count(len(rig.lights), stack)
    _refuse_behind(rig)
    where = None if mask is None else checked_mask(mask, (rows, cols))
    unit = checked_saturation(saturation, stack, where)
    check_lit(stack)
    plates = [image / unit for image in stack]
    solving = Solving(solver=solver, residual=True, error=True, fill=fill)

    def light(ground: Ground | None = None) -> Illumination:
        return illumination(rig.lights, channels=channels, ground=ground, view=view_of(rig))

    def solve(lit: Illumination) -> Surface:
        return solving.solve(plates, lit, mask=where)

    near = near_surface_of(rig, rig.lights, height_px=rows, width_px=cols, iterations=NEAR_ITERATIONS)
    surface = solve(light()) if near is None else solve_near(swept(near, rig.lights, plates), light, solve)
    return _in_units(surface, unit)


def _refuse_behind(rig: Rig) -> None:
    """Raise UsageError where all lights lie behind what the camera sees: the sign of z is another."""
    if all(light.direction is not None and light.direction[2] < 0 for light in rig.lights):
        raise UsageError(
            "`lights` all have z < 0, behind what the camera sees. Expected unit vectors from the surface to the "
            "light, x right, y up, z towards the camera: change the sign of z."
        )


def _refuse_second_strengths(intensities: ArrayLike | None) -> None:
    if intensities is not None:
        raise UsageError(
            "`intensities` were given beside a Rig, which has its own. Leave them out, or give the directions as an "
            "array."
        )


def _in_units(surface: Surface, unit: np.float32) -> Surface:
    """Return a surface that was solved from pictures divided by ``unit`` as that of the pictures themselves."""
    residual = None if surface.residual is None else surface.residual * unit
    return replace(surface, albedo=surface.albedo * unit, residual=residual)
