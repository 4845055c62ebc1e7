"""Compiled parts of ``steady_kernel``: rounds at rest vote on a pixel's class, and on whether it takes their mean."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Bytes, Floats
from psvideo.model.surface import MEASURED
from psvideo.solve.normals.loops.blocks import ONE

REACHED, TRUSTED, REACHED_BEFORE, TRUSTED_BEFORE, ROUNDS, VALUES, HAS_BEFORE = range(7)
"""The planes of votes: the sums, over this block's rounds since the pixel changed, of the lights that reach it and of
whether it was trusted; the same of the block before, as if of a whole one; how many rounds this block's are of; how
many values were added up; and whether there is a mean from before."""
VOTES = 7
OF_SOURCE = np.array([0, 4, 3, 2, 1], np.uint8)  # by Surface.source: three lights or more count 4, none 1
SOURCES = np.array([0, 4, 3, 2, 1], np.uint8)  # the way back
ALL = np.uint8(OF_SOURCE[MEASURED])
HALF, SURELY = np.float32(0.5), np.float32(3.5)
ADDS, FORGETS, TAKES, ZEROES, WEIGHT, PER, SOURCE, VALID = range(8)
"""The planes of the working array: whether a pixel's values are added, what was held of it is forgotten, it takes the
mean, or zeros; what the mean from before weighs, and by what sums become means; and its class."""
WORK = 8


@FUSED.inlined
def forget_votes(votes: Bytes, i: int, source: int, valid: int, block: int) -> None:
    """Begin again with a pixel that changed, as if it had always been as it is."""
    votes[REACHED, i], votes[TRUSTED, i], votes[VALUES, i] = 0, 0, 0
    votes[REACHED_BEFORE, i], votes[TRUSTED_BEFORE, i] = OF_SOURCE[source] * block, valid * block
    votes[HAS_BEFORE, i] = (source > 0) & (valid == 0)


@FUSED.inlined
def begin_votes(votes: Bytes, i: int, rounds: int, trusted: int, block: int) -> None:
    """Begin with a pixel that was the same all the time, trusted or without a normal."""
    votes[REACHED, i], votes[TRUSTED, i] = (rounds - 1) * trusted * ALL, (rounds - 1) * trusted
    votes[REACHED_BEFORE, i], votes[TRUSTED_BEFORE, i] = block * trusted * ALL, block * trusted
    votes[VALUES, i], votes[HAS_BEFORE, i] = 0, 0


@FUSED.inlined
def add_votes(votes: Bytes, i: int, rounds: int, source: int, valid: int, changed: bool, work: Floats) -> None:
    """Add a round's votes, and say whether its values are added."""
    reached = OF_SOURCE[source]
    votes[ROUNDS, i] = rounds
    votes[REACHED, i] += reached
    votes[TRUSTED, i] += valid
    adds = (reached > 0) & ((valid == 0) | (votes[VALUES, i] > 0))
    votes[VALUES, i] += adds
    work[ADDS, i], work[FORGETS, i] = adds, changed


@FUSED.inlined
def decide(votes: Bytes, i: int, own: int, valid: int, block: int, work: Floats) -> None:
    """Give a pixel the class that most rounds give it, and say whether it takes their mean.

    own, valid: what this round gives it by itself, as in ``Surface.source`` and ``Surface.valid``. block: how many
    rounds vote. A class that only a mean could show, where there is none of as many lights, is not taken.
    """
    count = int(votes[VALUES, i])
    before = max(block - count, 0) if votes[HAS_BEFORE, i] else 0  # rounds for which the mean from before stands
    has_mean = count + before > 0
    reached = _mean_vote(votes, REACHED, REACHED_BEFORE, i, block)
    source = SOURCES[min(int(reached + HALF), 4)]
    shown = source == own or source == 0 or (has_mean and (source != MEASURED or _is_measured(votes, i, reached)))
    if not shown:
        source = own
    trusted = (source == MEASURED) & (_mean_vote(votes, TRUSTED, TRUSTED_BEFORE, i, block) >= HALF)
    work[SOURCE, i], work[VALID, i] = source, trusted
    work[ZEROES, i] = source == 0
    work[TAKES, i] = has_mean and source != 0 and not (trusted and own == MEASURED and valid)
    work[WEIGHT, i], work[PER, i] = before, ONE / np.float32(max(count + before, 1))


@FUSED.inlined
def _mean_vote(votes: Bytes, now: int, then: int, i: int, block: int) -> np.float32:
    """Return the mean vote of a pixel over a block of rounds: those of this block so far, ``now``, and for the rest the
    mean of the block before, ``then``."""
    left = block - int(votes[ROUNDS, i])
    return np.float32(np.float32(int(votes[now, i]) * block + left * int(votes[then, i])) / np.float32(block * block))


@FUSED.inlined
def _is_measured(votes: Bytes, i: int, reached: np.float32) -> bool:
    """Return whether nearly all rounds that a pixel's mean is of measured it, by three lights or more: those of this
    block, or with a mean from before all that vote."""
    here = np.float32(votes[REACHED, i]) >= SURELY * np.float32(int(votes[ROUNDS, i]))
    return bool(here or (votes[HAS_BEFORE, i] > 0 and reached >= SURELY))
