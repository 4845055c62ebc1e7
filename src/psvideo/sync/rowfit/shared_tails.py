"""How long tails may be by what frames that share a flash say, whatever brightness does: flashes' edges stay sharp.

A row that opens or closes just as a flash begins or ends leaves one frame next to nothing of it and the next one all
the rest. Under tails that one would see more, however bright the flash was there.
"""

from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import compiled_flashes
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY
from psvideo.sync.rowfit.shared_light import without_ambient
from psvideo.sync.rowfit.tracking.misfires import SeenFlashes, frames_seeing, seen_flashes

MOST_FLASHES = 256
"""So many flashes are looked at, from all over the clip."""
NEAR, FAINT = 0.05, 1e-3
"""Rows count that see more than the second of a flash in either frame under tails of this share of the shortest;"""
WHOLE, BRIGHT = 0.8, 0.1
"""where both frames together see this much of it, and it is brighter than this share of the brightest."""
OUT_OF_QUESTION = 20.0
"""Tails that add so much to the robust loss end the search: longer ones add more."""
LEAST = 100
"""Fewer rows say nothing."""
OUTLIER = 5.0
"""Rows contradict each other by no more standard deviations than this."""


def with_tails(beat: Beat, tail_s: float) -> Beat:
    """Return a beat whose flashes rise and fall more slowly, and start as much earlier: as rows see it, they are where
    they were."""
    earlier = beat.with_phase(beat.clock.phase_s - tail_s)
    return replace(earlier, rise_s=beat.rise_s + tail_s, fall_s=beat.fall_s + tail_s)


def shared_tails(plan: Plan, rows: Profiles, beat: Beat, lengths_s: Doubles) -> Doubles:
    """Return what tails beyond the beat's add to the robust loss of what frames that share a flash contradict, by their
    length (length,); 0 where too few frames share one, or no dark slot shows the ambient light."""
    more = np.zeros(len(lengths_s))
    if len(plan.lit_slots) == len(plan.flashes):
        return more
    rows = without_ambient(plan, replace(rows.one_window(), doubt=None, restless=None), beat)
    flashes = compiled_flashes(plan, rows, beat)
    lit = np.flatnonzero(flashes.unknown)
    if not len(lit):
        return more
    some = lit[np.unique(np.linspace(0, len(lit) - 1, MOST_FLASHES).astype(np.int64))]
    start_s, duration_s = flashes.start_s[some], flashes.duration_s[some]

    def seen(tail_s: float) -> SeenFlashes:
        """Return what frames see of the flashes under longer tails; one frame more than may see any."""
        slower = with_tails(beat, tail_s)
        touched = frames_seeing(rows, slower, duration_s) + 1
        return seen_flashes(rows, slower, start_s - tail_s, duration_s, touched=touched)

    sharp = seen(0.0)
    kept = _kept(rows, sharp, seen(NEAR * plan.shortest_flash_s))
    if kept.sum() < LEAST:
        return more
    apart = _apart(rows, sharp)[kept]
    usual = 1.4826 * float(np.median(np.abs(apart)))
    scale = CAUCHY * max(float(np.sqrt(np.mean(np.minimum(np.abs(apart), OUTLIER * usual) ** 2))), 1e-30)
    before = float(np.log1p((apart / scale) ** 2).sum())
    for n, tail_s in enumerate(lengths_s.tolist()):
        left = _apart(rows, seen(tail_s))[kept]
        more[n] = float(np.log1p((left / scale) ** 2).sum()) - before
        if more[n] > OUT_OF_QUESTION:
            more[n + 1 :] = np.inf
            break
    return more


def _apart(rows: Profiles, seen: SeenFlashes) -> Doubles:
    """Return by how much two frames contradict each other on a flash, (flash, touched - 1, row)."""
    value, (one, other) = rows.value[seen.at], (seen.share[:, :-1], seen.share[:, 1:])
    size = np.maximum(np.hypot(one, other), 0.5 * WHOLE)
    contradicted: Doubles = (value[:, :-1] * other - value[:, 1:] * one) / size
    return contradicted


def _kept(rows: Profiles, sharp: SeenFlashes, near: SeenFlashes) -> Mask:
    """Return which pairs of frames (flash, touched - 1, row) share a flash that is bright there, near its edges too."""
    value, both = rows.value[sharp.at], sharp.share[:, :-1] + sharp.share[:, 1:]
    light = np.where(both > WHOLE, (value[:, :-1] + value[:, 1:]) / np.maximum(both, WHOLE), 0.0)
    split = (both > WHOLE) & (np.minimum(near.share[:, :-1], near.share[:, 1:]) > FAINT)
    kept: Mask = split & (light > BRIGHT * np.percentile(light[split], 98)) if split.any() else split
    return kept
