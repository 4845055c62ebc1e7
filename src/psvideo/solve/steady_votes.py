"""Compiled parts of ``steady_kernel``: rounds at rest vote on a pixel's class, and on whether it takes their mean."""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Bytes, Floats
from psvideo.model.surface import MEASURED
from psvideo.plates.sequence import VOTING_BLOCKS
from psvideo.solve.normals.loops.blocks import ONE

EARLIER = VOTING_BLOCKS
"""Votes of so many blocks before this one are held."""
ROUNDS, VALUES, HAS_BEFORE, REACHED, TRUSTED = 0, 1, 2, 3, 4 + EARLIER
"""The planes of votes: how many of this block's rounds vote, those since the pixel changed; how many values were added
up; whether there is a mean from before; the sum of the lights that reach it, and, one plane after the other, the same
of the blocks before, the latest first, as if of whole ones; and likewise of whether it was trusted."""
VOTES = 5 + 2 * EARLIER
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
    _always(votes, i, int(OF_SOURCE[source]), valid, block)
    votes[REACHED, i], votes[TRUSTED, i], votes[VALUES, i] = 0, 0, 0
    votes[HAS_BEFORE, i] = (source > 0) & (valid == 0)


@FUSED.inlined
def begin_votes(votes: Bytes, i: int, rounds: int, trusted: int, block: int) -> None:
    """Begin with a pixel that was the same all the time, trusted or without a normal."""
    _always(votes, i, trusted * int(ALL), trusted, block)
    votes[REACHED, i], votes[TRUSTED, i] = (rounds - 1) * trusted * ALL, (rounds - 1) * trusted
    votes[VALUES, i], votes[HAS_BEFORE, i] = 0, 0


@FUSED.inlined
def _always(votes: Bytes, i: int, reached: int, trusted: int, block: int) -> None:
    """Let a pixel have been the same in all blocks before."""
    for n in range(1, EARLIER + 1):
        votes[REACHED + n, i], votes[TRUSTED + n, i] = reached * block, trusted * block


@FUSED.inlined
def turn_votes(votes: Bytes, i: int, left: int, block: int) -> None:
    """Let this block's votes become those of the latest one before, of whose rounds ``left`` cast none."""
    for now in (REACHED, TRUSTED):
        latest = int(votes[now, i]) + left * int(votes[now + 1, i]) // block
        for n in range(EARLIER, 1, -1):
            votes[now + n, i] = votes[now + n - 1, i]
        votes[now + 1, i], votes[now, i] = latest, 0
    votes[ROUNDS, i], votes[VALUES, i] = 0, 0


@FUSED.inlined
def add_votes(votes: Bytes, i: int, rounds: int, source: int, valid: int, changed: bool, work: Floats) -> None:
    """Add a round's votes, and say whether its values are added."""
    reached = OF_SOURCE[source]
    votes[ROUNDS, i] = rounds
    votes[REACHED, i] += reached
    votes[TRUSTED, i] += valid
    adds = reached > 0
    votes[VALUES, i] += adds
    work[ADDS, i], work[FORGETS, i] = adds, changed


@FUSED.inlined
def decide(votes: Bytes, i: int, own: int, valid: int, block: int, work: Floats) -> None:
    """Give a pixel the class that most rounds give it, and say whether it takes their mean.

    own, valid: what this round gives it by itself, as in ``Surface.source`` and ``Surface.valid``. block: how many
    rounds a block has. A class that only a mean could show, where there is none of as many lights, is not taken; what
    most rounds trust has one where any round measured it.
    """
    count = int(votes[VALUES, i])
    before = max(block - count, 0) if votes[HAS_BEFORE, i] else 0  # rounds for which the mean from before stands
    has_mean = count + before > 0
    reached, trusts = _mean_vote(votes, REACHED, i, block), _mean_vote(votes, TRUSTED, i, block) >= HALF
    source = MEASURED if trusts else SOURCES[min(int(reached + HALF), 4)]
    measured = _is_measured(votes, i, reached) | (trusts & (count + before > 1))
    shown = source == own or source == 0 or (has_mean and (source != MEASURED or measured))
    if not shown:
        source = own
    trusted = (source == MEASURED) & trusts
    work[SOURCE, i], work[VALID, i] = source, trusted
    work[ZEROES, i] = source == 0
    work[TAKES, i] = has_mean and source != 0 and not (trusted and own == MEASURED and valid)
    work[WEIGHT, i], work[PER, i] = before, ONE / np.float32(max(count + before, 1))


@FUSED.inlined
def _mean_vote(votes: Bytes, now: int, i: int, block: int) -> np.float32:
    """Return the mean vote of a pixel over as many rounds as the blocks before have: those of this block so far,
    ``now``, which take the place of as many of the earliest block's."""
    left = block - int(votes[ROUNDS, i])
    total = int(votes[now, i]) * block + left * int(votes[now + EARLIER, i])
    for n in range(1, EARLIER):
        total += block * int(votes[now + n, i])
    return np.float32(np.float32(total) / np.float32(EARLIER * block * block))


@FUSED.inlined
def _is_measured(votes: Bytes, i: int, reached: np.float32) -> bool:
    """Return whether nearly all rounds that a pixel's mean is of measured it, by three lights or more: those of this
    block, or with a mean from before all that vote."""
    here = np.float32(votes[REACHED, i]) >= SURELY * np.float32(int(votes[ROUNDS, i]))
    return bool(here or (votes[HAS_BEFORE, i] > 0 and reached >= SURELY))
