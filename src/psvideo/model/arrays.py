"""Short names for numpy arrays, by what they hold. Shapes stand in the docstrings of the functions."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Halves = NDArray[np.float16]
Flags = NDArray[np.bool_]
Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]
Places = NDArray[np.intp]
"""Where things are in another array, as numpy's own indices."""
Indices = NDArray[np.uint32]
"""The same in half the memory, for kernels."""
Codes8 = NDArray[np.uint8]
"""Brightness in the codes of eight bits."""
Codes16 = NDArray[np.uint16]
"""Brightness in the codes of sixteen bits, as cameras and movies store it."""
Samples = NDArray[Any]
"""Numbers of float32, or half floats as the bits of uint16; of plates, also codes of uint16."""
Image = NDArray[np.float32]
"""A picture, linear: (rows, columns) or (rows, columns, channels)."""
Mask = NDArray[np.bool_]
"""Which pixels are meant: (rows, columns)."""
Pixels = NDArray[np.uint8]
"""A picture for the screen, sRGB: (rows, columns, 3), or (rows, columns) in grey."""
