"""A picture as OpenCV reads it, which psvideo's own decoders have no part in."""

from pathlib import Path
from typing import Any

import cv2
from numpy.typing import NDArray


def read_picture(path: Path, how: int = cv2.IMREAD_COLOR) -> NDArray[Any]:
    """Return a picture (row, col[, BGR]). Raises FileNotFoundError where none can be read."""
    picture = cv2.imread(str(path), how)
    if picture is None:
        raise FileNotFoundError(path)
    return picture
