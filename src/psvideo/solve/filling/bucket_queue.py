"""Pixels that wait in the order of their distance: a ring of buckets, one for each distance (R. B. Dial, "Algorithm
360: shortest-path forest with topological ordering", Communications of the ACM 12(11), 1969); compiled.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED

BUCKETS = 256  # more than the longest step
FOREVER = 1 << 30
NONE = -1  # of a queue's lists


class Queue(NamedTuple):
    """Pixels by distance: a ring of buckets, ``heads``, of lists that are linked both ways, so that a pixel that is
    nearer by another way leaves its place. ``distance`` (pixel,) is FOREVER of those that nothing has reached yet."""

    heads: NDArray[np.int32]
    following: NDArray[np.int32]
    preceding: NDArray[np.int32]
    distance: NDArray[np.int32]


def queue_for(pixels: int) -> Queue:
    """Return a queue that holds this many pixels."""
    return Queue(
        heads=np.full(BUCKETS, NONE, np.int32),
        following=np.full(pixels, NONE, np.int32),
        preceding=np.full(pixels, NONE, np.int32),
        distance=np.full(pixels, FOREVER, np.int32),
    )


@FUSED.inlined
def push(q: Queue, pixel: int, distance: int) -> None:
    """Put a pixel that waits nowhere at the head of its distance's list."""
    bucket = distance % BUCKETS
    head = q.heads[bucket]
    if head != NONE:
        q.preceding[head] = pixel
    q.distance[pixel], q.following[pixel], q.preceding[pixel], q.heads[bucket] = distance, head, NONE, pixel


@FUSED.inlined
def take_out(q: Queue, pixel: int) -> None:
    """Take a pixel that waits out of its list."""
    before, after = q.preceding[pixel], q.following[pixel]
    if before == NONE:
        q.heads[q.distance[pixel] % BUCKETS] = after
    else:
        q.following[before] = after
    if after != NONE:
        q.preceding[after] = before
