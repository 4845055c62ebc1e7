"""Row profiles: the mean of every row of every frame, all that finding the timing needs to know of a clip."""

from collections.abc import Iterable
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.camera import FloatArray
from psvideo.model.clipping import SATURATED

LOST = 1.0
"""Light, as a share of saturation, that a clipped sample may well have lost: one that two lights clip loses as much."""


class LinearFrame(Protocol):
    """What this step needs of a frame: its place in time and its linear picture."""

    @property
    def index(self) -> int:
        """The frame's place in time, counted from the clip's first frame, holes included."""

    @property
    def image(self) -> NDArray[np.float32]:
        """Linear light, (row, col) or (row, col, channel)."""


def row_profile(image: NDArray[np.float32]) -> FloatArray:
    """Return the mean over columns and channels of a picture, shape (row,)."""
    flat = image.reshape(image.shape[0], -1)
    return cv2.reduce(flat, 1, cv2.REDUCE_AVG, dtype=cv2.CV_64F)[:, 0].astype(np.float64)


def collect(frames: Iterable[LinearFrame]) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the frames' indices, shape (frame,), and their profiles, shape (frame, row)."""
    indices: list[int] = []
    profiles: list[FloatArray] = []
    for frame in frames:
        indices.append(frame.index)
        profiles.append(row_profile(frame.image))
    return np.array(indices, np.int64), np.array(profiles, np.float64)


def collect_with_doubt(
    frames: Iterable[LinearFrame],
) -> tuple[NDArray[np.int64], FloatArray, NDArray[np.float32] | None]:
    """Return the frames' indices and profiles, and by how much every row mean (frame, row) may be wrong.

    Pixels that saturate lose an unknown amount of light; the doubt is None where none did.
    """
    indices: list[int] = []
    profiles: list[FloatArray] = []
    doubts: list[NDArray[np.float32]] = []
    for frame in frames:
        indices.append(frame.index)
        profiles.append(row_profile(frame.image))
        doubts.append((LOST * clipped_share(frame.image)).astype(np.float32))
    doubt = np.array(doubts)
    return np.array(indices, np.int64), np.array(profiles, np.float64), doubt if doubt.any() else None


def clipped_share(image: NDArray[np.float32]) -> FloatArray:
    """Return the share of each row's samples that are saturated, shape (row,)."""
    flat = image.reshape(image.shape[0], -1)
    if cv2.minMaxLoc(flat)[1] < SATURATED:
        return np.zeros(image.shape[0])
    clipped = cv2.threshold(flat, SATURATED, 1.0, cv2.THRESH_BINARY)[1]
    return cv2.reduce(clipped, 1, cv2.REDUCE_AVG, dtype=cv2.CV_64F)[:, 0].astype(np.float64)
