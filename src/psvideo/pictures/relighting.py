"""Relighting a surface under lights that were never there."""

from numbers import Real

import numpy as np

from psvideo.errors import UsageError, check_kind
from psvideo.model.arrays import Image
from psvideo.model.rig import Vector, three_numbers
from psvideo.model.surface import Surface, check_surface
from psvideo.pictures.on_screen import three_channels


def relight(
    surface: Surface,
    direction: Vector,
    *,
    strength: float = 1.0,
    colour: Vector = (1.0, 1.0, 1.0),
    gloss: float = 0.0,
    shininess: float = 30.0,
) -> Image:
    """Return the surface under a new distant light: albedo * strength * max(0, n . l).

    Parameters
    ----------
    surface
        What was solved, or read.
    direction
        From the surface to the light, of any length, in the camera's frame: x right, y up, z towards the camera.
    strength, colour
        Of the light; 1 and white give back what the rig's lights of intensity 1 showed.
    gloss, shininess
        Add a highlight (Blinn 1977) of that strength; the larger the exponent, the smaller the highlight. The camera
        looks along -z.

    Returns
    -------
    numpy.ndarray
        Shape (row, col, 3), float32, linear light; 0 where the surface is not valid. Pictures under several lights add
        up.

    Raises
    ------
    PsvideoError
        Where ``surface`` is none, the direction is not three numbers or has no length, or the colour is not three.

    Examples
    --------
    >>> import numpy as np
    >>> import psvideo as ps
    >>> normals = np.zeros((2, 2, 3), np.float32)
    >>> normals[..., 2] = 1
    >>> surface = ps.Surface(normals=normals, albedo=np.full((2, 2), 0.5), valid=np.ones((2, 2), bool))
    >>> ps.relight(surface, (0, 0.6, 0.8), colour=(1.0, 0.5, 0.25))[0, 0].round(3).tolist()
    [0.4000000059604645, 0.20000000298023224, 0.10000000149011612]
    """
    check_surface(surface)
    towards = three_numbers("direction", direction, "(x, y, z) from the surface to the light")
    length = float(np.linalg.norm(towards))
    if not 0 < length < np.inf:
        raise UsageError(f"`direction` is {direction!r}; expected (x, y, z) from the surface to the light.")
    tint = three_numbers("colour", colour, "(red, green, blue) of the light, 1.0 each for white").astype(np.float32)
    for name, number in (("strength", strength), ("gloss", gloss), ("shininess", shininess)):
        check_kind(name, number, Real, "a number")
        if not 0 <= number < np.inf:
            raise UsageError(f"`{name}` is {number!r}; expected a number of 0 or more.")
    light = (towards / length).astype(np.float32)
    normals = surface.normals.astype(np.float32)
    facing = np.maximum(normals @ light, 0.0)[..., None]
    shade = three_channels(surface.albedo.astype(np.float32)) * facing
    if gloss:
        half = (light + np.array([0, 0, 1])).astype(np.float32)
        half /= np.float32(np.linalg.norm(half))
        shade = shade + gloss * np.maximum(normals @ half, 0.0)[..., None] ** shininess * (facing > 0)
    lit: Image = (np.float32(strength) * shade * tint).astype(np.float32)
    return lit
