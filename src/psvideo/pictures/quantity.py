"""Any quantity of the table as pixels that a screen shows."""

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.errors import UsageError, check_kind, nearest
from psvideo.model.arrays import Pixels
from psvideo.model.quantities import QUANTITIES, Quantity
from psvideo.pictures.on_screen import exposure_for, normal_colours, srgb, three_channels

RANGE_PERCENT = (2, 98)
"""What false colours span where nothing else says so: noise at both ends is cut."""


def picture_of(quantity: str, image: NDArray[np.generic], *, exposure: float | None = None) -> Pixels:
    """Return a quantity as pixels for a screen, as the relighting page shows it.

    Parameters
    ----------
    quantity
        A name of the table of quantities: "normals", "albedo", "valid", "residual", "error", "depth", "position",
        "beauty", "reach", "specular", "alpha", "plate" or "ambient". It says how the image is shown: normals and
        positions as colours (128 + 127 n), light by sRGB's curve, validity in black and white, measures in false
        colours.
    image
        Shape (row, col) or (row, col, 3), as the solver or a file gives it.
    exposure
        Of light only: the factor before the curve. Left out, the brightest hundredth of the pixels lies at 0.8.

    Returns
    -------
    numpy.ndarray
        Shape (row, col, 3), uint8, R, G, B; Pillow's ``Image.fromarray(...).save("name.png")`` writes it.

    Raises
    ------
    PsvideoError
        Where the table has no such quantity, or the image has another shape than it.

    Examples
    --------
    >>> import numpy as np
    >>> import psvideo as ps
    >>> facing = np.zeros((2, 2, 3), np.float32)
    >>> facing[..., 2] = 1
    >>> ps.picture_of("normals", facing)[0, 0].tolist()
    [128, 128, 255]
    """
    check_kind("quantity", quantity, str, "the name of a quantity")
    if quantity not in QUANTITIES:
        raise UsageError(f"`quantity` is {quantity!r}; {nearest(quantity, QUANTITIES)}")
    row, array = QUANTITIES[quantity], np.asarray(image)
    if row.shown == "never":
        raise UsageError(f"`quantity` {quantity}: is for programs, and no picture to look at.")
    if array.dtype.kind not in "fiub":
        kind = type(image).__name__
        raise UsageError(f"`image` is of type {kind}, which holds no numbers; expected an array of {row.name}.")
    _check_shape(row, array)
    values = np.nan_to_num(array.astype(np.float32), nan=0.0, posinf=0.0, neginf=0.0)  # 0 is shown as missing
    if row.shown == "normals":
        return normal_colours(values)
    if row.shown == "light":
        return srgb(values, exposure=exposure_for(values) if exposure is None else exposure)
    if row.shown == "mask":
        return (255 * three_channels(np.clip(values, 0, 1)) + 0.5).astype(np.uint8)
    return _points(values) if row.shown == "position" else _false_colours(values, row)


def _check_shape(row: Quantity, image: NDArray[np.generic]) -> None:
    vectors = row.shown in ("normals", "position")
    grey, colour = image.ndim == 2 and not vectors, image.ndim == 3 and image.shape[-1] == 3
    if not (grey or (colour and len(row.channels) == 3)):
        expected = " or ".join((["(row, col)"] if not vectors else []) + (["(row, col, 3)"] * (len(row.channels) == 3)))
        raise UsageError(f"`image` has shape {image.shape}; {row.name} is expected as {expected}.")


def _points(values: NDArray[np.float32]) -> Pixels:
    """Points as colours about their middle, as many of their units as they span; black where there are none."""
    there: NDArray[np.bool_] = (values != 0).any(axis=-1)
    if not there.any():
        return np.zeros(values.shape, np.uint8)
    low, high = np.percentile(values[there], RANGE_PERCENT, axis=0)
    scaled = 0.5 + (values - (low + high) / 2) / max(float((high - low).max()), 1e-9)
    return (255 * np.clip(np.where(there[..., None], scaled, 0), 0, 1) + 0.5).astype(np.uint8)


def _false_colours(values: NDArray[np.float32], row: Quantity) -> Pixels:
    """A measure in colours of rising lightness, from 0 or from its least; what is 0 is not there, and dark."""
    there = values != 0
    low, high = np.percentile(values[there], RANGE_PERCENT) if there.any() else (0.0, 1.0)
    low = 0.0 if row.from_zero else low
    share = np.clip((values - low) / max(float(high - low), 1e-9), 0, 1)
    palette = cv2.COLORMAP_CIVIDIS if row.from_zero else cv2.COLORMAP_VIRIDIS
    coloured = cv2.applyColorMap((255 * share + 0.5).astype(np.uint8), palette)[..., ::-1]
    return np.where(there[..., None], coloured, 0).astype(np.uint8)
