"""What every pixel of a light's plate at an instant is taken from: one of its two plates, or both, moved along the
motion; and by how much that may be off.

What was hidden in one of the plates is taken from the other. Blending by time also carries shading over, which changes
where a surface turns. Where nothing moves, or motion explains nothing better, the nearer plate is taken as it is.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Codes8, Flags, Floats
from psvideo.plates.align.doubt.evenly import EACH_PX, evenly_changed
from psvideo.plates.align.doubt.lone_edges import InstantSketch
from psvideo.plates.align.doubt.unsure import unsure_of
from psvideo.plates.align.velocity.brightness import light_of
from psvideo.plates.align.velocity.detail import SHADING_PX
from psvideo.plates.align.velocity.flow import comparable, noise_between, pixel_places
from psvideo.plates.align.velocity.followed import Followed, Pair, odd_width
from psvideo.plates.align.velocity.moving_kernel import AFTER, AT_REST, BEFORE, BOTH, NOWHERE

UNLIKE = 10.0
"""Plates whose detail differs by more codes along the motion do not show the same thing."""
ALIKE_PX = 5
EVENLY, BARE = 24.0, 3.0
"""Where they differ by more than the first as a whole, only what is bare does: its detail differs by no more than the
second. It turns, and its shading with it; detail and shading that both change are two things."""
DARK = 0.003
"""Light that is no shadow's edge, as a share of a sketch's white: noise makes as much."""
SHADED = 0.25
"""Parts of which one is darker, as a whole, than this share of the other do not turn: a shadow passed."""
TURNED = 40.0
"""What turns is shaded in its detail too, which differs by no more codes: both plates show it all the same."""
BLENDED, BLENDED_UNLIKE, BLENDED_ALIKE = np.float32(0.25), np.float32(0.8), np.float32(0.5)
"""Shading turns evenly: by what it differs between two plates, their blend is off this much less than the nearer one
would be; by what their detail differs, by a shadow, or by more than is even, only a little less, and half where plates
are alike: edges lie a part of a pixel beside each other there."""
REST = 3.0
"""What stands still while its shading changes by more codes is blended by time, up to the edge of its face, and where
one of the two plates is in shadow as well: a face that turns to a lamp is as bright as the blend or darker, and darker
than the later plate."""
ENOUGH = 4
"""Where this many lights are sure, other lights are left out unless they are sure as well."""
MANY = 4
"""With this many lights one must be sure; with more, half of them."""
FEWEST = 3
"""This many sure ones make a normal without the others. Fewer leave a hole, and what is filled in there was off by 36
degrees where the plates as they are were off by 19 (a bust that tumbles by 8 px from flash to flash)."""
APART_PX = 1.0
"""What moves by this much more or less from plate to plate moves by itself, and may hide other things."""
HALF, LEAST = np.float32(0.5), np.float32(1e-6)


@dataclass(frozen=True, kw_only=True)
class Taken:
    """Of one light (row, col): where its plates ``alike`` show the same along the motion, ``source``, what a pixel is
    to be taken from, and where that is ``sure``; by how much it may be off, in units of the plates' light,
    ``unsure``; what it ``shows`` at the instant; and the codes of both plates moved there, ``ends``."""

    alike: Flags
    sure: Flags
    source: Codes8
    unsure: Floats
    shows: InstantSketch
    ends: tuple[Codes8, Codes8]


@dataclass(frozen=True, kw_only=True)
class Compared:
    """Both plates of a light along the motion, in codes (row, col), and how they differ, ``apart``.

    ``shading`` is by how much they differ as a whole, in a window, and ``own_shading`` on each side of an edge alone;
    ``own_unlike`` is the square of what their detail differs there. ``evenly`` and ``own_evenly``: both show the same;
    ``shaded``: one is in shadow. ``window`` is the size of a shading's window in pixels of the grid.
    """

    before: Codes8
    after: Codes8
    apart: Floats
    shading: Floats
    own_shading: Floats
    own_unlike: Floats
    evenly: Flags
    own_evenly: Flags
    shaded: Flags
    window: tuple[int, int]


def taken_of(pair: Pair, motion: Followed, *, guessed: bool = False) -> Taken:
    """Return what every pixel of a light's plate is taken from, on the velocities' grid.

    ``guessed``: nothing is measured in it, and what changes as no motion explains is blended by time: at some time
    between the two plates it became what the later one shows, and of all guesses that is the least off.
    """
    spans_s = motion.time_s - pair.before.time_s, pair.after.time_s - motion.time_s
    ways = motion.way(spans_s[0]), motion.way(-spans_s[1])
    plates = _compared(pair, ways, motion.step)
    alike, own_alike = plates.evenly & ~plates.shaded, plates.own_evenly & ~plates.shaded
    source = _shown_by(plates, motion, nearer=BEFORE if spans_s[0] <= spans_s[1] else AFTER, guessed=guessed)
    gone = [outside(way) for way in ways]
    for covered, span_s in zip(gone, (spans_s[0], -spans_s[1]), strict=True):
        _add_hidden(covered, motion, alike, span_s, sum(spans_s))
    source[gone[0] & ~gone[1]] = AFTER
    source[gone[1] & ~gone[0]] = BEFORE
    hidden = gone[0] != gone[1]
    noise = noise_between(pair.before, pair.after)
    unsure = unsure_of(pair, plates.before, plates.after, motion, noise) * ~hidden
    unsure *= np.where(source == BOTH, _off_of_blend(plates, own_alike), 1)
    shown = _shown(plates.before, plates.after, source, spans_s)
    return Taken(
        alike=alike,
        sure=alike | hidden,
        source=source,
        unsure=unsure,
        shows=InstantSketch(codes=shown, white=pair.before.white, noise=noise),
        ends=(plates.before, plates.after),
    )


def _compared(pair: Pair, ways: tuple[Floats, Floats], step: int) -> Compared:
    """Return a light's plates brought to the instant along ``ways``, and by how much they differ there."""
    both = comparable(pair.before, pair.after)
    before, after = (_along(codes, way) for codes, way in zip(both, ways, strict=True))
    apart = np.asarray(cv2.subtract(after, before, dtype=cv2.CV_32F), np.float32)
    wide, narrow, each = ((odd_width(size_px, step),) * 2 for size_px in (SHADING_PX, ALIKE_PX, EACH_PX))
    shading = np.asarray(cv2.blur(apart, wide), np.float32)
    unlike = np.asarray(cv2.blur((apart - shading) ** 2, narrow), np.float32)
    own_shading, own_unlike = evenly_changed(apart, (shading, unlike), each, BARE)
    return Compared(
        before=before,
        after=after,
        apart=apart,
        shading=shading,
        own_shading=own_shading,
        own_unlike=own_unlike,
        evenly=_alike(shading, unlike),
        own_evenly=_alike(own_shading, own_unlike),
        shaded=_shaded(before, after, wide),
        window=wide,
    )


def _shown_by(plates: Compared, motion: Followed, *, nearer: int, guessed: bool) -> Codes8:
    """Return which plate shows each pixel, as if nothing were hidden in either."""
    detail = np.where(plates.own_unlike < np.float32(TURNED**2), BOTH, nearer)
    source = np.where(motion.moves, detail, AT_REST).astype(np.uint8)
    source[~motion.moves & _turns(plates, ~motion.moves)] = BOTH
    if guessed:
        source[~motion.moves & (np.abs(plates.apart) > REST)] = BOTH
    return source


def _turns(plates: Compared, still: Flags) -> Flags:
    """Return what turns where it stands (``still``): it changes evenly over a whole window, or on its own side of an
    edge, and by as much as what does so around it.

    What changes by another amount than its surroundings is what an edge passed.
    """
    evenly = plates.evenly & still
    even = evenly.astype(np.float32)
    share = np.asarray(cv2.blur(even, plates.window), np.float32)
    around = np.asarray(cv2.blur(plates.shading * even, plates.window), np.float32) / np.maximum(share, LEAST)
    beside = plates.own_evenly & (share > LEAST) & (np.abs(plates.own_shading - around) < np.float32(BARE))
    changes = np.where(beside, plates.own_shading, np.where(evenly, plates.shading, 0))
    return np.asarray(np.abs(changes) > np.float32(REST))


def _alike(shading: Floats, unlike: Floats) -> Flags:
    """Return where plates show the same: by how much they differ as a whole, and the square of what their detail
    does."""
    return np.asarray(unlike < np.where(np.abs(shading) < EVENLY, np.float32(UNLIKE**2), np.float32(BARE**2)))


def _shown(before: Codes8, after: Codes8, source: Codes8, spans_s: tuple[float, float]) -> Codes8:
    """Return the sketch of what is taken of two plates, moved to the instant."""
    share = float(np.clip(spans_s[0] / (spans_s[0] + spans_s[1]), 0, 1))
    nearer = before if spans_s[0] <= spans_s[1] else after
    shown = np.where(source == BOTH, cv2.addWeighted(before, 1 - share, after, share, 0), nearer)
    shown = np.where(source == BEFORE, before, shown)
    return np.asarray(np.where(source == AFTER, after, shown), np.uint8)


def _off_of_blend(plates: Compared, alike: Flags) -> Floats:
    """Return by which share of what two plates differ their blend may be off, ``alike`` where they show the same."""
    unlike = np.maximum(plates.own_unlike, np.float32(0))  # sums that run along rows round
    level = plates.own_shading * plates.own_shading
    detail = np.where(alike, BLENDED_ALIKE, BLENDED_UNLIKE)
    squares = (BLENDED**2 * level + detail**2 * unlike) / np.maximum(level + unlike, LEAST)
    plain = plates.shaded | (np.abs(plates.own_shading) > EVENLY)
    return np.asarray(np.where(plain & ~alike, BLENDED_UNLIKE, np.sqrt(squares)), np.float32)


def without_doubtful(
    shown: Sequence[Taken], motion: Followed, others: int, better: Callable[[Flags], Flags] | None = None
) -> tuple[list[Codes8], Flags]:
    """Return the sources of all lights under which something moves, without what is doubtful where enough is sure; and
    where nothing is known, though it is shown as it is: more than half of many lights show that something moved, and no
    motion explains it.

    ``others`` is the number of lights under which nothing moves. ``better`` says of the lights that are used, (light,
    row, col) of ``shown``, where a normal of them is better than one of all; left out, it is everywhere.
    """
    sure = np.sum([one.sure for one in shown], axis=0, dtype=np.int16)
    left_out, puzzling = sure + others >= ENOUGH, np.zeros(sure.shape, np.bool_)
    if len(shown) >= MANY:
        puzzling = ~motion.moves & (sure < min(len(shown) // 2, len(shown) - MANY + 1))
        left_out |= puzzling & (sure + others >= FEWEST)
    if better is not None:
        left_out &= better(np.stack([one.sure | ~left_out for one in shown]))
    return [np.where(left_out & ~one.sure, np.uint8(NOWHERE), one.source) for one in shown], puzzling & ~left_out


def _shaded(before: Codes8, after: Codes8, window: tuple[int, int]) -> Flags:
    """Return where one of two plates is in shadow as a whole."""
    one, other = (light_of(cv2.blur(codes, window).astype(np.float32)) for codes in (before, after))
    return np.asarray(np.minimum(one, other) < np.float32(SHADED) * np.maximum(one, other) - np.float32(DARK))


def _along(codes: Codes8, way: Floats) -> Codes8:
    x, y = pixel_places(*way.shape[1:])
    high, wide = (np.float32(many / few) for many, few in zip(codes.shape, way.shape[1:], strict=True))
    x, y = (x - way[0] + HALF) * wide - HALF, (y - way[1] + HALF) * high - HALF
    return np.asarray(cv2.remap(codes, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))


def outside(way: Floats) -> Flags:
    """Return what came from beyond the picture, by how far every pixel went, (2, row, col)."""
    rows, cols = way.shape[1:]
    x, y = pixel_places(rows, cols)
    x, y = x - way[0], y - way[1]
    return np.asarray((x < -0.5) | (x > cols - 0.5) | (y < -0.5) | (y > rows - 0.5))


def _add_hidden(hidden: Flags, motion: Followed, alike: Flags, span_s: float, round_s: float) -> None:
    """Add to ``hidden`` what something else covers in a plate, a time before the instant: what its place there is
    better explained by, which moves otherwise."""
    rows, cols = np.nonzero(~alike)
    own = motion.velocity[:, rows, cols]
    there = _places_from(rows, cols, -np.float32(span_s) * own, hidden.shape)
    others = np.where(motion.moves[rows, cols], motion.velocity[:, there[0], there[1]], motion.nearby[:, rows, cols])
    back = _places_from(*there, np.float32(span_s) * others, hidden.shape)
    again = motion.velocity[:, back[0], back[1]]
    per = round_s * motion.step
    apart_px, missed_px = (np.hypot(*(pair[0] - pair[1])) * per for pair in ((others, own), (again, others)))
    hidden[rows, cols] |= (apart_px > APART_PX) & (missed_px <= APART_PX) & alike[back]


def _places_from(
    rows: NDArray[np.intp], cols: NDArray[np.intp], way: Floats, shape: tuple[int, ...]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    row, col = np.rint(rows + way[1]).astype(np.intp), np.rint(cols + way[0]).astype(np.intp)
    return np.clip(row, 0, shape[0] - 1), np.clip(col, 0, shape[1] - 1)
