"""Relighting a surface, and how linear light, normals and masks become pixels that a screen shows."""

from collections.abc import Callable
from numbers import Real

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import quantile
from psvideo.compute.spilled import let_go
from psvideo.errors import UsageError, check_kind
from psvideo.model.rig import Vector, three_numbers
from psvideo.model.surface import Surface, check_surface

Image = NDArray[np.float32]
Pixels = NDArray[np.uint8]
BAND_ROWS = 256
"""About this many rows are averaged at a time."""


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


def smaller(image: NDArray[np.floating], width_px: int) -> Image:
    """Return a picture (row, col[, channel]) averaged down to at most this width, for showing it."""

    def read(first: int, last: int) -> NDArray[np.floating]:
        let_go(image[:first])
        return image[first:last]

    return smaller_by_rows(read, image.shape, width_px)


def smaller_by_rows(read: Callable[[int, int], NDArray[np.floating]], shape: tuple[int, ...], width_px: int) -> Image:
    """Return a picture at most this wide, averaged down, of which ``read(first, last)`` gives rows.

    Only a band of rows is held: whole pictures in float32 are large.
    """
    rows, cols = shape[:2]
    if cols <= width_px:
        return np.asarray(read(0, rows), np.float32)
    factor = min(cols // width_px, rows)
    band, last = factor * max(BAND_ROWS // factor, 1), rows // factor * factor
    coarse = [_averaged(read(first, min(first + band, last)), factor) for first in range(0, last, band)]
    size = (width_px, max(round(rows * width_px / cols), 1))
    planes = [cv2.resize(plane, size, interpolation=cv2.INTER_AREA) for plane in np.concatenate(coarse, axis=1)]
    return np.stack(planes, axis=-1).astype(np.float32).reshape(size[1], size[0], *shape[2:])


def _averaged(band: NDArray[np.floating], factor: int) -> Image:
    """Average squares of a whole number of pixels, which OpenCV does several times faster; (channel, row, col)."""
    rows, cols = (size // factor for size in band.shape[:2])
    if band.flags.c_contiguous and band.dtype == np.float32:
        small = cv2.resize(band[: rows * factor, : cols * factor], (cols, rows), interpolation=cv2.INTER_AREA)
        return np.moveaxis(np.asarray(small, np.float32).reshape(rows, cols, -1), -1, 0)
    channels = np.moveaxis(band[: rows * factor, : cols * factor].reshape(rows * factor, cols * factor, -1), -1, 0)
    squares = (np.ascontiguousarray(channel, np.float32) for channel in channels)
    return np.stack([cv2.resize(one, (cols, rows), interpolation=cv2.INTER_AREA) for one in squares])


def three_channels(image: Image) -> Image:
    """Return a grey picture as three equal channels; a colour picture as it is."""
    return image if image.ndim == 3 else np.repeat(image[..., None], 3, axis=2)


def srgb(linear: Image, *, exposure: float = 1.0) -> Pixels:
    """Return linear light (row, col[, 3]) as 8-bit sRGB pixels (row, col, 3), IEC 61966-2-1; above 1 is white."""
    pixels: Pixels = (255 * srgb_share(three_channels(linear) * np.float32(exposure)) + 0.5).astype(np.uint8)
    return pixels


def srgb_share(linear: Image) -> Image:
    """Return linear light as a share of the largest sRGB code, same shape, 0 to 1."""
    light = np.clip(linear, 0.0, 1.0)
    coded: Image = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return coded


def normal_colours(normals: NDArray[np.floating]) -> Pixels:
    """Return normals (row, col, 3) in the usual colours, 128 + 127 n; grey where there are none."""
    coded: Pixels = (127.5 * (normals.astype(np.float32) + 1.0) + 0.5).clip(0, 255).astype(np.uint8)
    return coded


def exposure_for(image: Image, *, white: float = 0.8) -> float:
    """Return the factor that puts the brightest hundredth of a picture's pixels at ``white``, for showing it only."""
    bright = quantile(image, 0.99)
    return white / bright if bright > 1e-6 else 1.0
