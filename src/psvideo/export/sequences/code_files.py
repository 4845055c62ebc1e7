"""Frames as files in the codes in which they came: uncompressed TIFF, which any disk takes as fast as it can."""

from pathlib import Path
from typing import Any

import tifffile
from numpy.typing import NDArray


def write_codes(path: Path, codes: NDArray[Any]) -> None:
    """Write codes of 8 or 16 bits, (row, col) or (row, col, 3), to a new file. Raises OSError where that fails."""
    photometric = "rgb" if codes.ndim == 3 else "minisblack"
    tifffile.imwrite(path, codes, photometric=photometric, metadata=None, software="psvideo live")
