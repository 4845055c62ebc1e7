"""Row profiles: the mean of every row of every frame, all that finding the timing needs to know of a clip."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import REORDERED
from psvideo.model.arrays import Doubles, Image
from psvideo.model.coded import Coded, CodedFrame
from psvideo.model.rows.clipping import SATURATED

LOST = 1.0
"""Light, as a share of saturation, that a clipped sample may well have lost: one that two lights clip loses as much."""


def collect(frames: Iterable[CodedFrame]) -> tuple[NDArray[np.int64], Doubles]:
    """Return the frames' indices, shape (frame,), and their profiles, shape (frame, row)."""
    index, profiles, _ = collect_with_doubt(frames)
    return index, profiles


def collect_with_doubt(
    frames: Iterable[CodedFrame],
) -> tuple[NDArray[np.int64], Doubles, NDArray[np.float32] | None]:
    """Return the frames' indices and profiles, and by how much every row mean (frame, row) may be wrong.

    Pixels that saturate lose an unknown amount of light; the doubt is None where none did.
    """
    indices: list[int] = []
    profiles: list[Doubles] = []
    doubts: list[NDArray[np.float32]] = []
    for frame in frames:
        mean, clipped = row_light(frame.coded)
        indices.append(frame.index)
        profiles.append(mean)
        doubts.append((LOST * clipped).astype(np.float32))
    doubt = np.array(doubts)
    return np.array(indices, np.int64), np.array(profiles, np.float64), doubt if doubt.any() else None


def row_light(picture: Coded) -> tuple[Doubles, Doubles]:
    """Return the mean light of every row of a picture in codes, and the share of its samples that clip, (row,) each."""
    rows, tone = picture.shape[0], picture.tone
    mean, clipped = np.empty(rows), np.empty(rows)
    flat = np.ascontiguousarray(picture.codes).reshape(rows, -1)
    _sum_rows(flat, tone.table, tone.zero, tone.gain, np.float32(tone.most), mean, clipped)
    return mean, clipped


@REORDERED.kept
def _sum_rows(
    codes: NDArray[np.generic],
    table: Image,
    zero: Doubles,
    gain: Doubles,
    most: np.float32,
    mean: Doubles,
    clipped: Doubles,
) -> None:
    """One loop over the codes; what a position's black and white levels make of their sum comes after it."""
    rows, samples = codes.shape
    for row in range(rows):
        mean[row], clipped[row] = 0.0, 0.0
        for col in range(zero.shape[1]):
            black, scale = zero[row % zero.shape[0], col], gain[row % zero.shape[0], col]
            limit = np.float32(SATURATED / scale + black)
            total, above, count = 0.0, 0, len(range(col, samples, zero.shape[1]))
            if table.size:
                for sample in range(col, samples, zero.shape[1]):
                    value = table[np.intp(codes[row, sample])]
                    total += np.float64(value)
                    above += int(value >= limit)
            elif zero.shape[1] > 1:
                for sample in range(col, samples, zero.shape[1]):
                    value = min(np.float32(codes[row, sample]), most)
                    total += np.float64(value)
                    above += int(value >= limit)
            else:
                for sample in range(samples):
                    value = min(np.float32(codes[row, sample]), most)
                    total += np.float64(value)
                    above += int(value >= limit)
            mean[row] += (total - count * black) * scale / samples
            clipped[row] += above / samples
