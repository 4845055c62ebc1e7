"""Compiled loops that pool results over rounds at rest: votes on a pixel's class, and means of what is not trusted.

A round always decides by as many rounds as three blocks have: by those of its own block so far, by the two blocks
before, and for the rest by the share that the third one had. Blocks of 16, a pixel that was trusted in all rounds of
the three blocks before, and in none of this one and later: it has (16 - 16 / 16 * r + 32) / 48 of the votes after r
rounds, and less than half of them after 24. Near a limit that takes longer, and so does a clip's first round, which
counts as all rounds before. Values are averaged alike, over one block of rounds. What is trusted by most rounds, and
not by this one alone, shows their mean too, and claims no more than the error up to which a pixel is trusted: half of
its rounds or more predict less.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, encoded, lent
from psvideo.model.arrays import Bytes, Floats, Samples
from psvideo.solve.normals.loops.blocks import ONE, ZERO
from psvideo.solve.steady_votes import (
    ADDS,
    FORGETS,
    HAS_BEFORE,
    PER,
    ROUNDS,
    SOURCE,
    TAKES,
    VALID,
    VALUES,
    WEIGHT,
    WORK,
    ZEROES,
    add_votes,
    begin_votes,
    decide,
    forget_votes,
    turn_votes,
)  # fmt: skip

SEGMENT = 64
"""Pixels of a row that are pooled together, or not."""
TINY = np.float32(1e-6)


class SurfacePlanes(NamedTuple):
    """A surface's planes, which are changed: normals (3, row, col), albedo (channel, row, col), error (row, col) or
    empty, as floats or the bits of half floats; valid and source (row, col)."""

    normals: Samples
    albedo: Samples
    error: Samples
    valid: Bytes
    source: Bytes


class Pool(NamedTuple):
    """What is held of segments (slot, plane, pixel): votes, sums of values, the means of the block before, both in
    half floats; ``touched`` (slot,) says in which some pixel was not trusted in this block."""

    votes: Bytes
    values: NDArray[np.uint16]
    before: NDArray[np.uint16]
    touched: Bytes


class Still(NamedTuple):
    """Since how many rounds nothing changed, on a coarse grid over the picture; which round of its block this is, from
    1 on; how many make a block; which pixels were trusted in the round before; and the error, in degrees, that what is
    trusted claims at most."""

    since: Bytes
    place: int
    block: int
    trusted: Bytes
    most_deg: np.float32


@FUSED.kept
def touch_rows(result: SurfacePlanes, still: Still, touched: Bytes, first: int, last: int) -> None:
    """Note in ``touched`` (row, segment) where any pixel of the rows is not trusted, or is so no more or again."""
    valid, source, out = lent(result.valid), lent(result.source), lent(touched)
    since, trusted = lent(still.since), lent(still.trusted)
    rows, cols = valid.shape
    for row in range(first, last):
        at_row = row * since.shape[0] // rows
        for segment in range(out.shape[1]):
            begin, end = segment * SEGMENT, min((segment + 1) * SEGMENT, cols)
            doubtful, turned = np.uint8(0), np.uint8(0)
            for col in range(begin, end):
                doubtful |= np.uint8((source[row, col] > 0) & (valid[row, col] == 0))
                turned |= valid[row, col] ^ trusted[row, col]
            if turned and not doubtful:
                for col in range(begin, end):
                    stood = since[at_row, col * since.shape[1] // cols] > 0
                    doubtful |= np.uint8((valid[row, col] != trusted[row, col]) & stood)
            out[row, segment] = doubtful


@FUSED.kept
def turn_block(pool: Pool, first: int, last: int, block: int) -> None:
    """Make of slots' sums what the next block takes as the one before."""
    votes, values, before = lent(pool.votes), lent(pool.values), lent(pool.before)
    for slot in range(first, last):
        for i in range(SEGMENT):
            left = block - int(votes[slot, ROUNDS, i])  # more than 0 where the pixel changed in this block
            count = int(votes[slot, VALUES, i])
            turn_votes(votes[slot], i, left, block)
            left = left if votes[slot, HAS_BEFORE, i] else 0
            one, weight = ONE / np.float32(max(count + left, 1)), np.float32(left)
            for plane in range(values.shape[1]):
                total = decoded(values[slot, plane, i]) + weight * decoded(before[slot, plane, i])
                before[slot, plane, i] = encoded(total * one, before)
                values[slot, plane, i] = 0
            votes[slot, HAS_BEFORE, i] = count + left > 0


@FUSED.kept
def steady_rows(
    result: SurfacePlanes, pool: Pool, slots: NDArray[np.int32], fresh: Bytes, still: Still, first: int, last: int
) -> None:
    """Add the rows' results to the pool and take from it what is steadier than they are.

    slots: (row, segment), where a segment is held, -1 where it is not. fresh: (slot,), 1 of those that were not before.
    """
    r = SurfacePlanes(
        lent(result.normals), lent(result.albedo), lent(result.error), lent(result.valid), lent(result.source)
    )
    p = Pool(lent(pool.votes), lent(pool.values), lent(pool.before), lent(pool.touched))
    where, new, since, trusted = lent(slots), lent(fresh), lent(still.since), lent(still.trusted)
    block, place, most_deg = still.block, still.place, still.most_deg
    rows, cols = r.valid.shape
    work, made = np.zeros((WORK, SEGMENT), np.float32), np.zeros((p.values.shape[1], SEGMENT), np.float32)
    for row in range(first, last):
        at_row = row * since.shape[0] // rows
        for segment in range(where.shape[1]):
            slot, begin = where[row, segment], segment * SEGMENT
            width = min(SEGMENT, cols - begin)
            if slot >= 0:
                busy = False
                for i in range(width):
                    col = begin + i
                    stood = int(since[at_row, col * since.shape[1] // cols])
                    rounds, source, valid = min(place, stood + 1), r.source[row, col], r.valid[row, col]
                    votes = p.votes[slot]
                    if stood == 0:
                        forget_votes(votes, i, source, valid, block)
                    elif new[slot]:
                        begin_votes(votes, i, rounds, trusted[row, col], block)
                    trusted[row, col] = valid
                    add_votes(votes, i, rounds, source, valid, stood == 0, work)
                    decide(votes, i, source, valid, block, work)
                    busy |= work[ADDS, i] + work[TAKES, i] + work[ZEROES, i] + work[FORGETS, i] > ZERO
                if busy:
                    _add_values(r, p, row, begin, width, slot, work, made)
                    _take_means(r, row, begin, width, most_deg, work, made)
                for i in range(width):
                    r.source[row, begin + i] = np.uint8(work[SOURCE, i])
                    r.valid[row, begin + i] = np.uint8(work[VALID, i])
            else:
                for col in range(begin, begin + width):
                    trusted[row, col] = r.valid[row, col]


@FUSED.called
def _add_values(
    r: SurfacePlanes, p: Pool, row: int, begin: int, width: int, slot: int, work: Floats, means: Floats
) -> None:
    """Add a segment's values to its sums, and take the means."""
    for plane in range(p.values.shape[1]):
        shown = _plane(r, plane, row)
        sums, before = p.values[slot, plane], p.before[slot, plane]
        for i in range(width):
            value, changed = decoded(shown[begin + i]), work[FORGETS, i] > ZERO
            total = (ZERO if changed else decoded(sums[i])) + (value if work[ADDS, i] > ZERO else ZERO)
            mean = value if changed else decoded(before[i])
            sums[i], before[i] = encoded(total, sums), encoded(mean, before)
            means[plane, i] = (total + work[WEIGHT, i] * mean) * work[PER, i]


@FUSED.called
def _take_means(
    r: SurfacePlanes, row: int, begin: int, width: int, most_deg: np.float32, work: Floats, means: Floats
) -> None:
    """Give the pixels of a segment that take them their means, normals of length 1, and of trusted ones an error of at
    most ``most_deg``."""
    for i in range(width):
        square = means[0, i] * means[0, i] + means[1, i] * means[1, i] + means[2, i] * means[2, i]
        one = ONE / max(np.sqrt(square), TINY)
        for plane in range(3):
            means[plane, i] *= one
    errors = 3 + len(r.albedo)
    for plane in range(len(means)):
        shown = _plane(r, plane, row)
        for i in range(width):
            value = means[plane, i] if work[TAKES, i] > ZERO else decoded(shown[begin + i])
            if plane == errors and work[VALID, i] > ZERO:
                value = min(value, most_deg)
            shown[begin + i] = encoded(ZERO if work[ZEROES, i] > ZERO else value, shown)


@FUSED.inlined
def _plane(r: SurfacePlanes, plane: int, row: int) -> Any:
    """A row of one of a surface's planes."""
    if plane < 3:
        return r.normals[plane, row]
    if plane < 3 + len(r.albedo):
        return r.albedo[plane - 3, row]
    return r.error[row]
