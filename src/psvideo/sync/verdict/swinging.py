"""Whether light grows and shrinks in a clip, and whether whole frames do, as under a camera's automatic exposure, or
flashes, as of lamps whose supply swings.

A frame of a rolling shutter mostly sees two flashes, and a flash is mostly seen by two frames. So both are told apart:
under a gain for each frame, or for each flash, the right one leaves less over. A subject that moves changes what
frames and flashes show as well, but not in all rows alike, and mostly little by little: rows are looked at in blocks of
as much light each, and a gain must explain the change in all of them together, each beside its own light.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.model.swing import Cause, Swing
from psvideo.sync.rowfit.compiled_profiles import brightnesses, compiled_flashes, predictions
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.row_model import Flashes
from psvideo.sync.rowfit.tracking.misfires import SeenFlashes, frames_seeing, seen_flashes

GAIN_RANGE, GAIN_EXPLAINS = 0.06, 0.6
"""Light is said to swing where gains differ by this much and explain this share of what is left: a bust that turns by
24 degrees comes to 0.2 to 0.3, in the rows that hold most of its light alone to 0.7; with a gain besides that swings
by 20 %, to 0.7 and more."""
GAIN_FRAMES = (9, 1)
"""Frames over which a gain is taken to be the same: exposures creep, and some jump."""
DIM = 0.05
"""Frames and flashes with less than this share of the usual light show no gain."""
TIED, TINY = 1e-3, 1e-30
"""The gains of flashes and of the room are alike by this much where frames do not tell them apart; and what keeps the
gains of black frames finite."""
CLEARLY = 1.1
"""By this factor more must be left over under the other cause, in squares, for one to be named alone."""
ROW_BLOCKS, ROWS_DIFFER = 4, 1.5
"""Blocks of rows, of as much light each: gains alike in all rows leave this many times what gains of each block do
where a subject moves (1.8 to 6 in virtual clips; 1.0 to 1.4 where lamps flicker over one that stands, noise included).
"""
ABRUPT = 0.25
"""Gains of one light jump from flash to flash where these jumps are this share of how far they stray at all: 0.03 to
0.15 where spheres cross the picture, 0.5 and more where lamps flicker or their supply swings in less than five rounds.
"""
SLOWLY_AT_MOST = 1.0
"""Lamps that creep change by no more than this share; more than that by and by is a subject that comes or goes: a face
that came in from the side, and grew brighter in all rows alike, gave a share of 96."""
MOST = 15.0
"""No camera's exposure, and no lamp's supply, changes by more within a clip: four stops. What does is a subject that
crosses a dark picture, of which frames without it show next to nothing: gains differed by shares of 1,400 to 12,800."""
TURNS = 4
"""Flashes whose tails or rows overlap share what is left; so often it is dealt out again."""
TOGETHER = 512
"""Flashes that are looked at together: long takes have 200,000, and each is seen by three pictures of rows."""


@dataclass(frozen=True, kw_only=True)
class _Seen:
    """What a clip shows, and what a fit without gains expects: ``value``, ``expected`` and ``trust``, (frame, row),
    and every row's brightnesses, ``light`` (row, unknown), fitted to what is ``unclipped`` (frame, row)."""

    plan: Plan
    rows: Profiles
    found: ClipFit
    light: Doubles
    expected: Doubles
    trust: Doubles
    unclipped: Doubles

    @property
    def change(self) -> Doubles:
        """What is left over of the profiles, (frame, row)."""
        return self.rows.value - self.expected

    @property
    def blocks(self) -> "list[_Seen]":
        """What blocks of rows show, of as much light each."""
        light = np.cumsum(np.sqrt((self.trust * self.expected**2).sum(axis=0)))
        edges = np.searchsorted(light, light[-1] * np.linspace(0.0, 1.0, ROW_BLOCKS + 1)[1:-1])
        return [self.only_rows(slice(a, b)) for a, b in pairwise([0, *edges.tolist(), len(light)]) if b > a]

    def beside_light(self, change: Doubles) -> float:
        """Return the square of a change (frame, row) as a share of that of the light."""
        light = float((self.trust * self.expected**2).sum())
        return float((self.trust * change**2).sum()) / max(light, TINY)

    def fitted_to(self, value: Doubles) -> "_Seen":
        """Return the same profiles beside what brightnesses that are fitted to others (frame, row) expect of them."""
        beat = self.found.fit.beat
        light = brightnesses(self.plan, replace(self.rows, value=value).one_window(), beat, self.unclipped)
        return replace(self, light=light, expected=predictions(self.plan, self.rows, beat, light))

    def only_rows(self, rows: slice) -> "_Seen":
        """Return what some rows show and are expected to."""
        return replace(
            self,
            rows=self.rows.only_rows(rows),
            light=self.light[rows],
            expected=self.expected[:, rows],
            trust=self.trust[:, rows],
            unclipped=self.unclipped[:, rows],
        )


class _FlashGains(NamedTuple):
    """The gains of those flashes of which enough was seen, against the whole clip's brightnesses, (flash,) in order of
    time, and whose ``light`` each is (flash,); what gains of all flashes have ``left`` (frame, row), and its square."""

    gain: Doubles
    light: Integers
    left: Doubles
    rest: float


def swing_of(plan: Plan, found: ClipFit) -> Swing | None:
    """Return how a clip's light grows and shrinks, None where it does not. ``found`` holds those frames only whose
    flashes all fired."""
    seen = _seen(plan, found)
    blocks = seen.blocks
    for frames_each in GAIN_FRAMES:
        gains, _ = _frame_gains(seen, frames_each=frames_each)
        if _explained(blocks, gains[0]) > GAIN_EXPLAINS and min(map(_range, gains)) > GAIN_RANGE:
            each, rest_of_frames = _frames_apart(seen)
            flashes = _flashes_apart(seen)
            cause = _cause(rest_of_frames, flashes.rest)
            share = _range(flashes.gain if cause == "lamps" else each)
            moves = cause == "lamps" and _rows_differ(blocks, flashes.rest)
            comes = cause == "lamps" and share > SLOWLY_AT_MOST
            if (moves or comes) and not _abrupt(flashes):
                return None
            if share == 0.0:  # some give none at all, which are named as black or unfired
                return None
            if share > MOST or (share > SLOWLY_AT_MOST and cause != "lamps" and _frames_differ(blocks)):
                return None
            return Swing(share=share, cause="either" if moves else cause)
    return None


def _cause(under_frames: float, under_flashes: float) -> Cause:
    """Return whose doing a swing is, by what is left over under gains of frames and of flashes."""
    if under_flashes > CLEARLY * under_frames:
        return "camera"
    return "lamps" if under_frames > CLEARLY * under_flashes else "either"


def _frames_apart(seen: _Seen) -> tuple[Doubles, float]:
    """Return every frame's gain and the square left over, rows' brightnesses fitted again under such gains: those that
    were fitted without hold the gains of the frames in which a row saw its light."""
    (gain, _), _ = _frame_gains(seen, frames_each=1)
    (gain, _), rest = _frame_gains(seen.fitted_to(seen.rows.value / np.maximum(gain, DIM)[:, None]), frames_each=1)
    return gain, rest


def _flashes_apart(seen: _Seen) -> _FlashGains:
    """Return every flash's gain likewise."""
    before = _flash_gains(seen)
    return _flash_gains(seen.fitted_to(seen.expected + before.left))


def _explained(blocks: Sequence[_Seen], gain: Doubles) -> float:
    """Return which share of what is left over the gains (frame,) of all rows explain, each block's beside its light."""
    before = sum(block.beside_light(block.change) for block in blocks)
    under = sum(block.beside_light(block.rows.value - gain[:, None] * block.expected) for block in blocks)
    return 1 - under / max(before, TINY)


def _rows_differ(blocks: Sequence[_Seen], rest: float) -> bool:
    """Return whether gains of flashes in each of the blocks of rows leave clearly less than ``rest``, the square that
    those of all rows leave, as where a subject moves: lamps change all rows alike."""
    return rest > ROWS_DIFFER * sum(_flash_gains(block).rest for block in blocks)


def _frames_differ(blocks: Sequence[_Seen]) -> bool:
    """Return whether gains of frames that are the same in all blocks of rows leave clearly more than each block's own,
    as where a subject crosses some rows after others: a camera's gain changes all rows alike."""
    gains = [_frame_gains(block, frames_each=1)[0][0] for block in blocks]
    power = [(block.trust * block.expected**2).sum(axis=1) for block in blocks]
    common = sum(p * gain for p, gain in zip(power, gains, strict=True)) / np.maximum(sum(power), TINY)
    own = sum(
        block.beside_light(block.rows.value - g[:, None] * block.expected)
        for block, g in zip(blocks, gains, strict=True)
    )
    alike = sum(block.beside_light(block.rows.value - common[:, None] * block.expected) for block in blocks)
    return alike > ROWS_DIFFER * own


def _abrupt(flashes: "_FlashGains") -> bool:
    """Return whether gains of one light jump from each of its flashes to the next, and do not grow or shrink slowly."""
    gains = [flashes.gain[flashes.light == light] for light in np.unique(flashes.light)]
    jumps = np.concatenate([np.diff(one, n=2) for one in gains]) / np.sqrt(6.0)  # as large as gains that know nothing
    strays = np.concatenate([one - np.median(one) for one in gains])  # of one another
    return len(jumps) > 0 and bool(np.median(np.abs(jumps)) > ABRUPT * np.mean(np.abs(strays)))


def _seen(plan: Plan, found: ClipFit) -> _Seen:
    rows, unclipped = replace(found.rows, doubt=None), found.rows.unclipped
    found = replace(found, fit=replace(found.fit, beat=replace(found.fit.beat, beat_hz=())))
    trust = unclipped * found.fit.weight / found.fit.weight.max(axis=0)
    nothing = np.zeros_like(rows.value)
    without = _Seen(
        plan=plan, rows=rows, found=found, light=nothing[:0], expected=nothing, trust=trust, unclipped=unclipped
    )
    return without.fitted_to(rows.value)


def _range(gain: Doubles) -> float:
    """Return by which share the larger gains exceed the smaller ones; 0 where some are none."""
    low, high = np.percentile(gain, [2, 98]) if len(gain) else (0.0, 0.0)
    return float(high / low - 1) if low > 0 else 0.0


def _frame_gains(seen: _Seen, *, frames_each: int) -> tuple[tuple[Doubles, Doubles], float]:
    """Return every frame's gain (frame,) against the whole clip's brightnesses, and of its flashes alone; and the
    square that the first leaves over. Of frames that see hardly any light it is that of those before and after them.
    The light of the room may change where the camera's gain and the flashes do not.
    """
    rows, expected, change, trust = seen.rows, seen.expected, seen.change, seen.trust
    room = np.broadcast_to(seen.light[:, 0], expected.shape)

    def around(one: Doubles, other: Doubles) -> Doubles:
        sums, width = (trust * one * other).sum(axis=1), min(frames_each, len(rows.value))
        return np.convolve(np.pad(sums, width // 2, mode="edge"), np.ones(width), mode="valid")[: len(sums)]

    power = around(expected, expected)
    lit = power > DIM * np.median(power)
    gain = 1 + _filled(around(expected, change) / np.maximum(power, TINY), lit)
    parts = (expected - room, room)
    hessian = np.moveaxis(np.array([[around(one, other) for one in parts] for other in parts]), -1, 0)
    tied = TIED * np.trace(hessian, axis1=1, axis2=2)[:, None, None] * np.array([[1.0, -1.0], [-1.0, 1.0]])
    scores = np.stack([around(one, change) for one in parts], axis=-1)
    alone = np.linalg.solve(hessian + tied + TINY * np.eye(2), scores[..., None])[:, 0, 0]
    rest = float((trust * (rows.value - gain[:, None] * expected) ** 2).sum())
    return (gain, 1 + np.where(lit, alone, 0.0)), rest


def _filled(values: Doubles, known: Mask) -> Doubles:
    """Return values (frame,) with those that are not known between their neighbours; 0 where none is."""
    at = np.flatnonzero(known)
    return np.interp(np.arange(len(values)), at, values[at]) if len(at) else np.zeros_like(values)


def _flash_gains(seen: _Seen) -> _FlashGains:
    flashes, rest = compiled_flashes(seen.plan, seen.rows, seen.found.fit.beat), seen.change
    lit = np.flatnonzero(flashes.unknown)
    parts = np.array_split(lit, -(-len(lit) // TOGETHER)) if len(lit) else []
    gain, power = np.ones(len(flashes.unknown)), np.zeros(len(flashes.unknown))
    for _ in range(TURNS):
        for some in parts:
            at, own = _own_light(seen, flashes, some)
            trust = seen.trust[at]
            power[some] = (trust * own**2).sum(axis=(1, 2))
            known = power[some] > DIM * np.median(power[some])
            move = np.where(known, (trust * own * rest[at]).sum(axis=(1, 2)) / np.maximum(power[some], TINY), 0.0)
            gain[some] += move
            np.subtract.at(rest, at, move[:, None, None] * own)
    enough = lit[power[lit] > DIM * np.median(power[lit])] if len(lit) else lit
    return _FlashGains(gain[enough], flashes.unknown[enough], rest, float((seen.trust * rest**2).sum()))


def _own_light(seen: _Seen, flashes: Flashes, some: Integers) -> SeenFlashes:
    """Return the light of some flashes by their place in the train, as the frames that may see any of it do."""
    rows, beat, duration_s = seen.rows, seen.found.fit.beat, flashes.duration_s[some]
    touched = frames_seeing(rows, beat, duration_s)
    at, share = seen_flashes(rows, beat, flashes.start_s[some], duration_s, touched=touched)
    return SeenFlashes(at=at, share=share * seen.light.T[flashes.unknown[some]][:, None, :])
