"""Flashes that did not fire: frames that are badly predicted because of them stand where their numbers put them.

A frame in the dark, where a flash was due, looks like a dark slot's, or like the dark frame before it: holes and
repeated frames would explain it, and a strobe that started elsewhere in its cycle. That a flash is missing does as
well, and moves nothing.
"""

from typing import NamedTuple

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.model.rows.shutter import Pulse
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import compiled_flashes, predictions
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.losses import frame_losses

COST = 0.5
"""What a flash that did not fire costs, in mean losses of a frame."""
NONE = 0.2
"""A flash of which the picture shows less than this share did not fire."""
MOST = 8
"""Where more flashes in a row give no light, the strobe has stopped, or something hides it."""


class SeenFlashes(NamedTuple):
    """What frames see of flashes: of each the frames ``at`` (flash, touched) that may see it, as many for all, and the
    ``share`` (flash, touched, row) of it that their rows see, 0 where a frame is missing."""

    at: Integers
    share: Doubles


def first_seen(rows: Profiles, beat: Beat, start_s: Doubles) -> Integers:
    """Return the first place in time at which any row sees any of each flash, shape (flash,)."""
    spread_s = rows.place.max() * beat.row_time_s + beat.exposure_s
    first: Integers = np.floor((start_s - spread_s) / rows.period_s).astype(np.int64) + 1
    return first


def seen_flashes(rows: Profiles, beat: Beat, start_s: Doubles, duration_s: Doubles, *, touched: int) -> SeenFlashes:
    """Return what rows see of flashes in this many frames from the first that may see any; frames in order of time."""
    places = first_seen(rows, beat, start_s)[:, None] + np.arange(touched)
    at = np.minimum(np.searchsorted(rows.index, places), len(rows.index) - 1)
    since_s = places[:, :, None] * rows.period_s + rows.place * beat.row_time_s - start_s[:, None, None]
    pulse, lasts_s = Pulse(rise_s=beat.rise_s, fall_s=beat.fall_s), duration_s[:, None, None]
    share = pulse.given_off(since_s + beat.exposure_s, lasts_s) - pulse.given_off(since_s, lasts_s)
    return SeenFlashes(at=at, share=share * (rows.index[at] == places)[:, :, None])


def frames_seeing(rows: Profiles, beat: Beat, duration_s: Doubles) -> int:
    """Return how many frames may see any of one flash."""
    spread_s = rows.place.max() * beat.row_time_s + beat.exposure_s + float(duration_s.max())
    return int(spread_s / rows.period_s) + 2


def losses_but_for_misfires(
    plan: Plan, reference: Profiles, rows: Profiles, beat: Beat, light: Doubles, *, beyond: tuple[bool, bool]
) -> Doubles:
    """Return how badly known brightnesses predict frames, shape (frame,), as ``losses_of`` does, once flashes that did
    not fire are left out; each costs ``COST`` in the frame that sees it first. ``beyond``: whether the clip has frames
    before these, and after: at its ends a strobe that gives no light had not begun, or has stopped."""
    rest = rows.value - predictions(plan, rows, beat, light)
    flashes = compiled_flashes(plan, rows, beat)
    lit = np.flatnonzero(flashes.unknown)
    loss, cost = frame_losses(reference, rest), np.zeros(len(rest))
    if not len(lit):
        return loss
    start_s, duration_s = flashes.start_s[lit], flashes.duration_s[lit]
    seen = seen_flashes(rows, beat, start_s, duration_s, touched=frames_seeing(rows, beat, duration_s))
    own = seen.share * light.T[flashes.unknown[lit]][:, None, :]
    for n in np.flatnonzero(_may_be_out(own, rest, seen.at, beyond)).tolist():
        touched = np.unique(seen.at[n][own[n].any(axis=1)])
        without = rest[touched]
        for frame, share in zip(seen.at[n], own[n], strict=True):
            without[touched == frame] += share
        better = frame_losses(reference, without)
        if loss[touched].sum() - better.sum() > COST:
            rest[touched], loss[touched] = without, better
            cost[touched[0]] += COST
    total: Doubles = loss + cost
    return total


def _may_be_out(own: Doubles, rest: Doubles, at: Integers, beyond: tuple[bool, bool]) -> Mask:
    """Return which flashes the picture shows hardly any of, shape (flash,), unless too many in a row."""
    power = (own**2).sum(axis=(1, 2))
    seen = np.flatnonzero(power > 0.0)
    out = 1.0 + (own * rest[at]).sum(axis=(1, 2))[seen] / power[seen] < NONE
    edges = np.flatnonzero(np.diff(np.concatenate([[0], out.astype(np.int64), [0]])))
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        amid = (first > 0 or beyond[0]) and (end < len(out) or beyond[1])
        out[first:end] = amid and end - first <= MOST
    found = np.zeros(len(power), np.bool_)
    found[seen] = out
    return found
