"""A mask that a user painted: white where to solve, or cut out in the alpha channel."""

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from psvideo.clip.decode.decoders import decode
from psvideo.clip.folder import KINDS, USUAL_KINDS
from psvideo.clip.maps.painted_alpha import alpha_of
from psvideo.clip.stated import stated_by
from psvideo.errors import PsvideoError
from psvideo.formats.paths import path_of


def _codes(kind: str, path: Path) -> tuple[NDArray[Any], float]:
    """Decode a mask, and return which code is white.

    PNGs may be saved in any of the ways in which painting programs save black and white (1 bit, palettes). An alpha
    channel that is not the same everywhere is the mask: colours beside it are whatever was cut out.
    """
    if (alpha := alpha_of(kind, path)) is not None:
        return alpha, 1.0
    if kind == "png":
        with contextlib.suppress(OSError, Image.DecompressionBombError), Image.open(path) as painted:
            if painted.mode in ("1", "P"):
                return np.asarray(painted.convert("L")), 255.0
    picture = decode(kind, path)
    return picture.codes, 1.0 if picture.header.bits is None else 2.0**picture.header.bits - 1


def read_mask(path: Path | str, *, width_px: int | None = None, height_px: int | None = None) -> NDArray[np.bool_]:
    """Read a mask that somebody painted: white where to solve.

    Parameters
    ----------
    path
        A picture of any kind that frames may be.
    width_px, height_px
        The size that it must have; any where they are left out.

    Returns
    -------
    numpy.ndarray
        Shape (row, col), bool, True where the picture is brighter than half of its range, or, where it has an alpha
        channel that is not the same everywhere, where that is above a half; upright, as its file's EXIF says.

    Raises
    ------
    PsvideoError
        Where the file cannot be read, has another size than expected, or is black everywhere.

    Examples
    --------
    >>> import psvideo as ps
    >>> mask = ps.read_mask("take3/truth/mask.exr")
    >>> mask.shape, mask.dtype
    ((120, 160), dtype('bool'))
    """
    path = path_of("path", path)
    brightest, white = _brightest(path, width_px=width_px, height_px=height_px)
    mask: NDArray[np.bool_] = brightest > 0.5 * white
    if not mask.any():
        most = float(brightest.max())
        dim = f" (its brightest pixel is {most:.6g}, and white is {white:.6g})" if most > 0 else ""
        raise PsvideoError(f"{path}: the mask is black everywhere{dim}; paint white where normals are wanted.")
    return mask


def read_one_of_many(path: Path, *, width_px: int | None = None, height_px: int | None = None) -> NDArray[np.bool_]:
    """Read a mask of a sequence in the same way; it may be black, where there is nothing to solve."""
    brightest, white = _brightest(path, width_px=width_px, height_px=height_px)
    return np.asarray(brightest > 0.5 * white)


def _brightest(path: Path, *, width_px: int | None, height_px: int | None) -> tuple[NDArray[Any], float]:
    """Return every pixel's brightest channel, upright, and which code is white."""
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise PsvideoError(f"{path}: is not a picture that can be a mask; expected one of {', '.join(USUAL_KINDS)}.")
    if not path.is_file():
        raise PsvideoError(f"{path}: there is no such mask. Check the name.")
    codes, white = _codes(kind, path)
    brightest = stated_by(path).turn.upright(codes if codes.ndim == 2 else codes.max(axis=2))
    rows, cols = brightest.shape
    if height_px not in (rows, None) or width_px not in (cols, None):
        raise PsvideoError(
            f"{path}: the mask is {cols} x {rows} pixels, and the frames are {width_px or cols} x {height_px or rows}. "
            "Paint it over a frame or a plate of this clip."
        )
    return brightest, white
