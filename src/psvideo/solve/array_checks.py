"""Arrays that somebody hands over, checked: what came and what was expected, in words that help."""

from collections.abc import Sequence
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from psvideo.errors import PsvideoError, UsageError, check_kind
from psvideo.model.arrays import Doubles, Floats, Mask
from psvideo.model.rig import UNIT_TOLERANCE, Light

MOST_CLIPPED = 0.5
"""Where half of the pixels are clipped under every light, the scale is wrong rather than the exposure."""


def checked_images(
    images: ArrayLike | Sequence[ArrayLike], *, black_level: float | None, white_level: float | None
) -> Floats:
    """Return images as float32 (light, row, col) or (light, row, col, 3), 1.0 = white level where that is given."""
    for name, level in (("black_level", black_level), ("white_level", white_level)):
        if level is not None:
            check_kind(name, level, Real, "a code, a number")
    stack = _stacked(images)
    _check_shape(stack)
    if np.issubdtype(stack.dtype, np.integer):
        return _linear(stack, black_level, white_level)
    if not np.issubdtype(stack.dtype, np.floating):
        raise UsageError(f"`images` are of type {stack.dtype}; expected floats, linear light, 1.0 where it saturates.")
    if black_level is not None or white_level is not None:
        raise UsageError(
            f"`white_level` and `black_level` belong to integer codes, and `images` are of type {stack.dtype}. Scale "
            "them yourself, or give the codes."
        )
    _refuse_missing(stack)
    return stack.astype(np.float32)


def _stacked(images: ArrayLike | Sequence[ArrayLike]) -> NDArray[np.generic]:
    """Return pictures as one array, the light first."""
    masked = isinstance(images, np.ma.MaskedArray)
    if masked or (isinstance(images, Sequence) and any(isinstance(image, np.ma.MaskedArray) for image in images)):
        raise UsageError(
            "`images` are masked arrays, and which light a pixel lacks cannot be said that way. Give plain arrays "
            "(images.filled(0)); leave pixels out of all lights with `mask`, True where to solve."
        )
    if isinstance(images, np.ndarray):
        return images
    if not isinstance(images, Sequence) or not images or isinstance(images, str):
        more = " Give its `images`." if hasattr(images, "images") else ""
        raise UsageError(
            f"`images` are {images!r:.60}; expected an array (light, row, col[, 3]) or a list of pictures.{more} "
            "Files are read by ps.read_images(folder)."
        )
    pictures = [_picture(n, image) for n, image in enumerate(images)]
    shapes = [picture.shape for picture in pictures]
    other = next((n for n, shape in enumerate(shapes) if shape != shapes[0]), None)
    if other is not None:
        raise UsageError(
            f"`images` differ in shape: image 0 is {shapes[0]} and image {other} is {shapes[other]}. Expected pictures "
            "of one camera in one place and one mode, all of one size and all in colour or all grey."
        )
    return np.stack(pictures)


def _picture(place: int, image: ArrayLike) -> NDArray[np.generic]:
    try:
        picture = np.asarray(image)
    except ValueError:  # rows of different lengths
        picture = np.asarray(None)
    if picture.dtype.kind not in "fiubc":
        raise UsageError(
            f"`images` hold number {place} of type {type(image).__name__}, which is not a picture; expected an array "
            "(row, col[, 3]) of numbers each. Files are read by ps.read_images(folder)."
        )
    return picture


def _check_shape(stack: NDArray[np.generic]) -> None:
    expected = "Expected (light, row, col) for grey pictures or (light, row, col, 3) for colour, or a list of pictures"
    if stack.ndim == 4 and stack.shape[-1] != 3:
        advice = {1: "images[..., 0]", 4: "images[..., :3], without alpha"}.get(stack.shape[-1])
        more = f": give {advice}" if advice else ""
        raise UsageError(f"`images` have shape {stack.shape}. {expected}{more}.")
    if stack.ndim not in (3, 4):
        raise UsageError(f"`images` have shape {stack.shape}, {stack.ndim} axes. {expected}.")
    if 0 in stack.shape[1:] and len(stack):
        raise UsageError(f"`images` have shape {stack.shape}: there are no pixels. {expected}.")


def _linear(codes: NDArray[np.generic], black_level: float | None, white_level: float | None) -> Floats:
    if white_level is None:
        raise UsageError(
            f"`images` are integer codes ({codes.dtype}), and nothing says what they mean. Expected floats in linear "
            "light, 1.0 where the sensor saturates. Where the codes are linear, say the code of saturation: "
            "white_level=255 for 8 bits, 4095 for 12, 65535 for 16. Codes with a curve (sRGB, most JPEGs) must be made "
            "linear first; psvideo.read_images does that for files."
        )
    black = 0.0 if black_level is None else black_level
    if not white_level > black:
        raise UsageError(f"`white_level` {white_level:g} is not above `black_level` {black:g}; expected codes.")
    return ((codes.astype(np.float32) - np.float32(black)) / np.float32(white_level - black)).astype(np.float32)


def _refuse_missing(stack: NDArray[np.generic]) -> None:
    finite = np.isfinite(stack.astype(np.float32, copy=False))
    if not finite.all():
        light = int(np.argmin(finite.reshape(len(stack), -1).all(axis=1)))
        raise UsageError(
            f"`images` hold {int((~finite).sum())} values that are not numbers (NaN or infinity), the first in image "
            f"{light}. Expected finite numbers: put 0 there, and leave those pixels out with `mask`."
        )


def checked_lights(directions: ArrayLike, intensities: ArrayLike | None, stack: Floats) -> tuple[Light, ...]:
    """Return lights named by their place from unit vectors (light, 3) and strengths, one for each image."""
    vectors = _floats("lights", directions)
    if vectors.ndim != 2 or vectors.shape[-1] != 3:
        turned = " The axes are the other way round: give directions.T." if vectors.shape[:1] == (3,) else ""
        raise UsageError(
            f"`lights` have shape {vectors.shape}; expected (light, 3), one unit vector to its light for each of the "
            f"{len(stack)} images, or a Rig.{turned}"
        )
    check_count(len(vectors), stack)
    if not len(vectors):
        raise UsageError("There are no images, and no lights. Expected three of each at least.")
    lengths = np.linalg.norm(vectors, axis=1)
    if not lengths.all():
        raise UsageError(
            f"`lights` number {int(np.argmin(lengths))} is (0, 0, 0), which is no direction; expected the unit vector "
            "from the surface to the light."
        )
    worst = int(np.argmax(np.abs(lengths - 1)))
    if abs(lengths[worst] - 1) > UNIT_TOLERANCE:
        raise UsageError(
            f"`lights` are unit vectors, and number {worst} has length {lengths[worst]:.4g}. Divide each by its "
            "length; how strong a light is belongs into `intensities`."
        )
    strengths = _strengths(intensities, stack)
    return tuple(
        Light(name=str(place), direction=(x, y, z), intensity=tuple(strength))
        for place, ((x, y, z), strength) in enumerate(
            zip((vectors / lengths[:, None]).tolist(), strengths.tolist(), strict=True)
        )
    )


def check_lit(stack: Floats) -> None:
    """Raise UsageError where no image holds any light."""
    brightest = float(stack.max())
    if brightest <= 0:
        raise UsageError(
            f"`images` hold no light: the brightest of their values is {brightest:g}. Expected linear light above 0; "
            "was too much taken off as black level or ambient light?"
        )


def check_count(lights: int, stack: Floats) -> None:
    """Raise UsageError where there is not one light for each image."""
    if lights == len(stack):
        return
    more = ""
    if stack.ndim == 3 and lights == stack.shape[-1]:
        more = " The last axis of the images has that length: give np.moveaxis(images, -1, 0)."
    raise UsageError(
        f"There are {len(stack)} images (shape {stack.shape}, the light first) and {lights} lights. Expected one light "
        f"for each image, in the same order.{more}"
    )


def _strengths(intensities: ArrayLike | None, stack: Floats) -> Doubles:
    if intensities is None:
        return np.ones((len(stack), 1))
    strengths = _floats("intensities", intensities)
    channels = 1 if stack.ndim == 3 else 3
    expected = {(len(stack),), (len(stack), 1), (len(stack), channels)}
    if strengths.shape not in expected:
        shapes = " or ".join(map(str, sorted(expected, key=len)))
        raise UsageError(f"`intensities` have shape {strengths.shape}; expected {shapes}: numbers above 0.")
    return strengths.reshape(len(stack), -1)


def _floats(name: str, given: ArrayLike) -> Doubles:
    try:
        values = np.asarray(given, np.float64)
    except (TypeError, ValueError):
        more = " A file is read by ps.read_rig(path)." if isinstance(given, str) else ""
        more = " Lights go into ps.Rig(lights=[...])." if isinstance(given, (Light, list, tuple)) else more
        raise UsageError(f"`{name}` are not an array of numbers ({type(given).__name__}).{more}") from None
    if not np.isfinite(values).all():
        raise UsageError(f"`{name}` hold values that are not numbers (NaN or infinity).")
    return values


def checked_mask(mask: ArrayLike, shape: tuple[int, int]) -> Mask:
    """Return where to solve, (row, col)."""
    where = np.asarray(mask)
    if where.dtype != np.bool_ or where.shape != shape:
        advice = "" if where.dtype == np.bool_ else " Compare it: mask > 0."
        raise UsageError(
            f"`mask` has shape {where.shape} and type {where.dtype}; expected {shape} of bool, True where to "
            f"solve.{advice}"
        )
    if not where.any():
        raise UsageError("`mask` is False everywhere, so there is nothing to solve.")
    return where


def checked_saturation(saturation: float, stack: Floats, mask: Mask | None) -> np.float32:
    """Return the unit in which images are solved, so that samples are clipped from 1.0 on."""
    check_kind("saturation", saturation, Real, "the value from which on samples are clipped, a number")
    if not saturation > 0:
        raise UsageError(f"`saturation` is {saturation}; expected the value above 0 from which on samples are clipped.")
    if np.isinf(saturation):
        return np.float32(max(2 * float(stack.max(initial=0.0)), 1e-6))
    least = stack.min(axis=0) if stack.ndim == 3 else stack.max(axis=3).min(axis=0)
    clipped = least >= saturation
    share = float((clipped if mask is None else clipped[mask]).mean())
    if share > MOST_CLIPPED:
        raise PsvideoError(
            f"{share:.0%} of the pixels are at or above {saturation:g} under every light (the largest value is "
            f"{float(stack.max()):g}), and what is clipped says nothing. Divide the images by their white level (255 "
            "for codes of 8 bits), or say with `saturation` where they clip (float('inf'): nowhere)."
        )
    return np.float32(saturation)
