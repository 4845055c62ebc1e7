"""Frames that are black though flashes lit them: lost on the way to the file, with whatever the lights did.

A flash that never fired leaves the other light of its frames as it is, and shows in every frame that would have seen
it; a black frame lacks the room's light and a part of every flash that it saw.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Integers
from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Flash
from psvideo.sync.flashes_seen import fitted_camera
from psvideo.sync.rowfit import row_model
from psvideo.sync.rowfit.compiled_profiles import brightnesses, compiled_flashes, compiled_rows, predictions
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles

ROWS = 60
BLACK, LIT = 0.1, 0.1
"""A black frame has less than the first share, in every row on an average, of what it should show, which is at least
the second share of what frames show."""
CLEARER = 0.5
"""A frame is black where that leaves less than this share of what the best flash to leave out does."""
MEMORY, BESIDE = 24, 2
"""Frames on either side from which it is known what flashes give, and that may see some of the same flash."""
MOST_NAMED = 8
"""Frames that a sentence names."""


def black_frames(plan: Plan, found: ClipFit) -> Integers:
    """Return the places in time of the frames that are black though flashes lit them, shape (black frame,)."""
    rest = found.fit.rest
    rows = replace(found.rows.one_window(), doubt=None, restless=None)
    expected = rows.value - rest
    shown, due = (np.sqrt((values**2).mean(axis=1)) for values in (rows.value, expected))
    suspect = (shown < BLACK * due) & (due > LIT * np.median(due))
    few = rows.binned(ROWS)
    black = [n for n in np.flatnonzero(suspect).tolist() if _is_black(plan, few, found, n)]
    return rows.index[black]


def _is_black(plan: Plan, rows: Profiles, found: ClipFit, frame: int) -> bool:
    """Return whether a black frame explains the frames around it better than any one flash that never fired."""
    near = slice(max(frame - MEMORY, 0), frame + MEMORY + 1)
    part, at = rows.take(near), frame - near.start
    around = slice(max(at - BESIDE, 0), at + BESIDE + 1)
    trust = np.ones_like(part.value)
    trust[around] = 1e-6
    beat = found.fit.beat
    light = brightnesses(plan, part, beat, trust)
    black = predictions(plan, part, beat, light)
    black[at] = 0.0
    flashes = compiled_flashes(plan, part, beat)
    span_s = rows.period_s * (1 + BESIDE)
    beside = np.abs(flashes.start_s - part.frame_start_s[at]) < span_s
    unfired = [_without(part, found, flashes, int(n), light) for n in np.flatnonzero(beside & (flashes.unknown > 0))]
    left = [float(((part.value - made)[around] ** 2).sum()) for made in (black, *unfired)]
    return left[0] < CLEARER * min(left[1:], default=np.inf)


def _without(rows: Profiles, found: ClipFit, flashes: row_model.Flashes, one: int, light: Doubles) -> Doubles:
    unknown = flashes.unknown.copy()
    unknown[one] = 0
    made = np.empty_like(rows.value)
    seen = compiled_rows(rows, found.fit.beat)
    row_model.predictions(seen, flashes._replace(unknown=unknown), light, 0, rows.value.shape[1], made)
    return made


def marked(plan: Plan, found: ClipFit, flashes: Sequence[Flash], spoilt: Integers) -> tuple[Flash, ...]:
    """Return flashes with those marked as incomplete of which spoilt frames, by their places in time, saw any."""
    if not len(spoilt):
        return tuple(flashes)
    start_s, duration_s = (np.array([getattr(one, name) for one in flashes]) for name in ("start_s", "duration_s"))
    first, last = frames_touched(fitted_camera(plan, found.fit), start_s, duration_s)
    saw = np.searchsorted(spoilt, first) < np.searchsorted(spoilt, last, side="right")
    return tuple(
        replace(one, complete=one.complete and not lost) for one, lost in zip(flashes, saw.tolist(), strict=True)
    )


def remarks_on_black(found: ClipFit, black: Integers, numbers: NDArray[np.int64]) -> Iterator[str]:
    """Say which frames are black, by their ``numbers``."""
    if not len(black):
        return
    frames = numbers[np.searchsorted(found.track.index, black)].tolist()
    shown = ", ".join(str(number) for number in frames[:MOST_NAMED]) + (" …" if len(frames) > MOST_NAMED else "")
    what = (
        f"Frame {shown} is black though flashes lit it: it was"
        if len(frames) == 1
        else (f"{len(frames)} frames are black though flashes lit them ({shown}): they were")
    )
    yield f"{what} lost on the way to the file. Flashes that fell into them are marked as incomplete and give no plate."
