"""Results held steady over rounds in which nothing moved: noise must not make classes and filled values flicker.

Rounds are pooled in blocks of fixed numbers. A pixel's class is what most of the last rounds say, as many as
VOTING_BLOCKS hold, and what is not trusted by most of them, or not by this one, shows the mean of one block of them;
what is trusted by both stays as it was measured. As a block goes on, its rounds take the place of the earliest, one
after the other, so that nothing jumps. Where the picture changed, a pixel begins again: nothing is smeared. It does so
in the next round once more, for plates are made of two flashes each, and that round's still of what was there before.
So a result depends on its block and VOTING_BLOCKS before, and on no other round.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from psvideo.compute.spilled import in_file, let_go
from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Bytes, Flags
from psvideo.model.surface import Surface
from psvideo.plates.sequence import POOLED_ROUNDS
from psvideo.solve.normals.bands import BAND_PIXELS
from psvideo.solve.normals.surface_bits import bits, stored
from psvideo.solve.steady_kernel import SEGMENT, Pool, Still, SurfacePlanes, steady_rows, touch_rows, turn_block
from psvideo.solve.steady_votes import VOTES

SHOWN = np.ones((1, 1), np.bool_)
MOST_SINCE, ONCE_MORE = 255, np.uint8(1)
EACH = 4
"""Where something moved is held for this many rows and columns of the grid that motion is found on together."""
EACH_SLOT = 256
FIRST, LEARNT = 2, 0.05
"""In so many rounds after the first one more is learnt of noise, by what repeats: where the pixels that are trusted are
by more than this share fewer or more for it, all begin again. (A bust in HEVC under five lights: 72 % in the first
round, 91 in the second. Noise alone changes the share by 1 %.)"""
IN_FILES_FROM = 1 << 22
"""This many votes or values and more lie in files: every pixel of a clip that noise lets nobody trust would be held."""


@dataclass(kw_only=True)
class Steady:
    """What is held between rounds of segments of rows where any pixel is not trusted, and in the block after.

    ``number`` is the last round's, and ``rounds`` how many there were. ``slots`` (row, segment) says where in ``pool``
    a segment is, -1 where it is not; ``used`` of its slots are.
    ``since`` counts rounds at rest on a coarse grid, and the first one, before which nothing is known to have changed;
    ``trusted`` (row, col) is the last round's, and ``shown`` where all lights showed the picture in it, on a grid.
    ``spare`` is a folder in whose files large pools lie, None where they lie in memory.
    """

    number: int
    rounds: int
    slots: NDArray[np.int32]
    pool: Pool
    used: int
    since: Bytes
    trusted: Bytes
    shown: Flags
    spare: Path | None = None

    @classmethod
    def beginning(cls, surface: Surface, number: int, spare: Path | None) -> "Steady":
        """Return what is held before the first round: nothing."""
        rows, cols = surface.valid.shape
        planes = 3 + len(stored(surface)[1]) + (surface.error_deg is not None)
        return cls(
            number=number - 1,
            rounds=0,
            slots=np.full((rows, -(-cols // SEGMENT)), -1, np.int32),
            pool=_room(0, planes, None),
            used=0,
            since=np.zeros((1, 1), np.uint8),
            trusted=np.zeros((rows, cols), np.uint8),
            shown=SHOWN,
            spare=spare,
        )


def steadied(
    held: Steady | None,
    surface: Surface,
    number: int,
    stood: Flags | None,
    shown: Flags = SHOWN,
    *,
    moved: Flags | None = None,
    most_deg: float = math.inf,
    spare: Path | None = None,
) -> Steady:
    """Hold a round's surface steady, in its own memory, and return what is held for the next one.

    held: what was returned of the round before, None at first; it is taken over.
    number: the round's.
    stood: on a grid over the picture (any rows and columns), True where nothing changed since the round before; None
        where that is not known, and all begins again.
    shown: on a grid, False where frames were missing that some light showed the picture in: what is not there has no
        vote, and where it was not the round before, a pixel begins again.
    moved: on a grid, True where the round's plates were made with motion; None where nothing moved. What is held begins
        there once more after a first round, of which nobody knows what changed before.
    most_deg: the error up to which a pixel is trusted, where errors hold nothing but what trust goes by: what most
        rounds trust claims no more.
    spare: a folder in whose files much of what is held lies; left out, in memory.
    """
    if held is None or stood is None or number != held.number + 1:
        held = Steady.beginning(surface, number, spare)
        stood = np.ones((1, 1), np.bool_) if moved is None else ~_coarse(moved)
    held.number = number
    held.since = _counted(_counted(held.since, stood), held.shown & shown, more=0)
    held.shown = shown
    if 0 < held.rounds <= FIRST and _is_learnt(held.trusted, surface.valid, held.since > 0):
        held.since = np.minimum(held.since, ONCE_MORE)
    held.rounds += 1
    place = number % POOLED_ROUNDS + 1
    if place == 1:
        _turn(held)
    still = Still(np.maximum(held.since, 1) - ONCE_MORE, place, POOLED_ROUNDS, held.trusted, np.float32(most_deg))
    planes, albedo = stored(surface)
    error = np.zeros((0, 0), planes.dtype) if surface.error_deg is None else bits(surface.error_deg)
    if surface.source is None:
        raise ValueError("a surface with `source` expected, as Solving gives it")
    result = SurfacePlanes(planes, albedo, error, surface.valid.view(np.uint8), surface.source)
    fresh = _touch(held, result, still)
    rows, cols = surface.valid.shape

    def hold(first: int, last: int) -> None:
        steady_rows(result, held.pool, held.slots, fresh, still, first, last)
        let_go(*(plane[first:last] for plane in (*planes, *albedo)))
        _let_slots_go(held, held.slots[first:last])

    over_ranges(hold, rows, each=max(BAND_PIXELS // cols, 1))
    return held


def _is_learnt(trusted: Bytes, valid: Flags, stood: Flags) -> bool:
    """Return whether of pixels that ``stood`` (on a grid) far fewer or more are trusted than in the round before, for
    what was learnt since."""
    row, col = (np.arange(size) * each // size for size, each in zip(valid.shape, stood.shape, strict=True))
    there = stood[np.ix_(row, col)]
    before, now = (np.count_nonzero(one & there) for one in (trusted.view(np.bool_), valid))
    return bool(abs(now - before) > LEARNT * max(now, before))


def _coarse(moved: Flags) -> Flags:
    """Return where anything moved, on a grid with a point for every EACH by EACH points."""
    high, wide = (-(-size // EACH) for size in moved.shape)
    whole = np.pad(moved, [(0, many * EACH - size) for many, size in zip((high, wide), moved.shape, strict=True)])
    return np.asarray(whole.reshape(high, EACH, wide, EACH).any(axis=(1, 3)), np.bool_)


def _counted(since: Bytes, stood: Flags, more: int = 1) -> Bytes:
    """Return since how many rounds nothing changed, one more where nothing did; of two grids, the finer one."""
    shape = np.maximum(since.shape, stood.shape)
    row, col = (np.arange(size) for size in shape)
    wide = (part[np.ix_(row * part.shape[0] // shape[0], col * part.shape[1] // shape[1])] for part in (since, stood))
    before, rests = wide
    return np.where(rests, np.minimum(before, MOST_SINCE - more) + more, 0).astype(np.uint8)


def _turn(held: Steady) -> None:
    """Begin a block, and let go of segments that were trusted throughout the one before."""
    kept = np.flatnonzero(held.pool.touched[: held.used])
    place = np.full(held.used + 1, -1, np.int32)
    place[kept] = np.arange(len(kept), dtype=np.int32)
    held.slots, held.used = place[held.slots], len(kept)
    held.pool = pool = _moved(held.pool, kept, len(kept), held.spare)
    pool.touched[:] = 0

    def turn(first: int, last: int) -> None:
        turn_block(pool, first, last, POOLED_ROUNDS)
        let_go(*(part[first:last] for part in pool))

    over_ranges(turn, len(kept), each=EACH_SLOT)


def _touch(held: Steady, result: SurfacePlanes, still: Still) -> Bytes:
    """Note which segments hold what is not trusted, and make room for those that are new; return which slots are."""
    rows, cols = result.valid.shape
    touched = np.zeros(held.slots.shape, np.uint8)
    over_ranges(
        lambda first, last: touch_rows(result, still, touched, first, last), rows, each=max(BAND_PIXELS // cols, 1)
    )
    new = (touched > 0) & (held.slots < 0)
    before, held.used = held.used, held.used + int(new.sum())
    held.slots[new] = np.arange(before, held.used, dtype=np.int32)
    if held.used > len(held.pool.touched):
        held.pool = _moved(held.pool, np.arange(before), max(held.used, 2 * before), held.spare)
    held.pool.touched[held.slots[touched > 0]] = 1
    fresh = np.zeros(len(held.pool.touched), np.uint8)
    fresh[before : held.used] = 1
    return fresh


def _let_slots_go(held: Steady, slots: NDArray[np.int32]) -> None:
    """Let go of what is held in slots, where it lies in files."""
    if (used := slots[slots >= 0]).size:
        let_go(*(part[used.min() : used.max() + 1] for part in held.pool))


def _moved(pool: Pool, kept: NDArray[np.intp], slots: int, spare: Path | None) -> Pool:
    """Return a pool with room for this many slots, the first of which are another's ``kept`` ones, in rising order."""
    room = _room(slots, pool.values.shape[1], spare)
    for first in range(0, len(kept), EACH_SLOT):
        some, into = kept[first : first + EACH_SLOT], slice(first, min(first + EACH_SLOT, len(kept)))
        parts: Iterator[tuple[NDArray[Any], NDArray[Any]]] = zip(pool, room, strict=True)
        for old, new in parts:
            new[into] = old[some]
            let_go(new[into], old[some[0] : some[-1] + 1])
    return room


def _room(slots: int, planes: int, spare: Path | None) -> Pool:
    def part(planes: int, kind: DTypeLike) -> NDArray[Any]:
        shape = (slots, planes, SEGMENT)
        if spare is None or slots * planes * SEGMENT < IN_FILES_FROM:
            return np.zeros(shape, kind)
        return in_file(shape, kind, spare)

    return Pool(
        votes=part(VOTES, np.uint8),
        values=part(planes, np.uint16),
        before=part(planes, np.uint16),
        touched=np.zeros(slots, np.uint8),
    )
