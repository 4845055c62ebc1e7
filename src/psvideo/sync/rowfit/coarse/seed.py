"""A seed: a stretch of the clip that the plan's strobe fits, searched under one numbering of its frames."""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.coarse.retime import Numbering
from psvideo.sync.rowfit.coarse.rounds_first import search_coded
from psvideo.sync.rowfit.coarse.search import search
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import refined_beat
from psvideo.sync.rowfit.tracking.losses import frame_losses

SEARCH_ROWS = 36
SEED_ROWS = 144
SEED_FRAMES = 48
LEAST_REACH_PPM = 1100.0
"""The search reaches this far at least, so that a frame rate misnamed by 1.001 is found."""
GOOD_SEED, FAIR_SEED = 0.7, 0.3
"""A seed that takes away this share of the robust loss is taken at once; one that takes away less calls for a wider
search."""
SLIPPED = 1.2
"""A seed whose clock has left the searched range so far behind has found nothing."""


@dataclass(frozen=True, kw_only=True)
class Seed:
    """A beat that fits the ``frames`` among those that a numbering keeps; ``share`` of the robust loss goes with it.

    ``retimed`` are the seeds under other numberings than the files', where those were looked for.
    """

    beat: Beat
    frames: slice
    numbering: Numbering
    share: float
    retimed: "tuple[Seed, ...] | None" = None


def renumbered(rows: Profiles, numbering: Numbering) -> Profiles:
    """Return the frames that a numbering keeps, at the places in time that it gives them."""
    if numbering.index is rows.index:
        return rows
    kept = numbering.kept
    each = max(len(rows.value) // len(rows.window_start), 1)
    return replace(
        rows,
        value=np.ascontiguousarray(rows.value[kept]),
        index=numbering.index,
        doubt=None if rows.doubt is None else np.ascontiguousarray(rows.doubt[kept]),
    ).windowed(each)


def best_seed(plan: Plan, rows: Profiles, numbering: Numbering, stretches: list[slice], reach_ppm: float) -> Seed:
    """Search stretches until one fits well; return the seed of the one that fits best."""
    kept = renumbered(rows, numbering)
    best: Seed | None = None
    for frames in stretches:
        beat, share = seeded(plan, kept.take(frames), first_guess(plan), reach_ppm)
        if best is None or share > best.share:
            best = Seed(beat=beat, frames=frames, numbering=numbering, share=share)
        if best.share > GOOD_SEED:
            break
    assert best is not None  # noqa: S101
    return best


def stretch_length(plan: Plan, rows: Profiles) -> int:
    """Return how many frames a stretch has: half as long again as it takes to see the marker."""
    return min(len(rows.value), max(SEED_FRAMES, int(1.5 * plan.marker_s / rows.period_s) + 2))


def stretches_of(plan: Plan, rows: Profiles) -> list[slice]:
    """Return the stretches to look at: at the beginning, in the middle and at the end, then shorter ones."""
    frames = len(rows.value)
    length = stretch_length(plan, rows)
    starts = [0, (frames - length) // 2, frames - length]
    short = min(frames, max(24, length // 2))
    more = [(frames - short) // 4, (frames - short) * 3 // 4, 0]
    spans = [(start, length) for start in starts] + [(start, short) for start in more]
    return [slice(start, start + count) for start, count in dict.fromkeys(spans)]


def seeded(plan: Plan, rows: Profiles, guess: Beat, range_ppm: float) -> tuple[Beat, float]:
    """Search one stretch and sharpen the best places found; return the best and what it explains."""
    known = plan.camera.readout_s is not None
    turned = rows.turned() if guess.upward else rows
    look = search_coded if plan.dark_code else search
    places = look(plan, turned.binned(SEARCH_ROWS), range_ppm=range_ppm, start=guess, readout_known=known, keep=3)
    free = () if known else ("row_time_s",)
    tried = []
    for place in places:
        if place.loss > 1.5 * places[0].loss:
            continue
        part = (rows.turned() if place.beat.upward else rows).binned(SEED_ROWS)
        beat = refined_beat(plan, part, place.beat, free=free, steps=6)
        slipped = abs(beat.clock.offset_ppm) > SLIPPED * range_ppm
        tried.append((0.0 if slipped else gain_of(part, unexplained(plan, part, beat)), beat))
    share, beat = max(tried, key=lambda pair: pair[0])
    return beat, share


def first_guess(plan: Plan) -> Beat:
    """Return the shutter's times and the LEDs' tails as the plan gives them, with a clock that starts at 0."""
    camera = plan.camera
    readout_s = camera.readout_s or 0.0
    return Beat(
        clock=FoundClock(phase_s=0.0, offset_ppm=0.0),
        row_time_s=abs(readout_s) / camera.height_px,
        exposure_s=camera.exposure_s,
        upward=readout_s < 0,
        rise_s=plan.rise_s,
        fall_s=plan.fall_s,
    )


def gain_of(rows: Profiles, rest: Doubles) -> float:
    """Return which share of the robust loss that each row's mean leaves in every window a fit takes away."""
    bounds = np.append(rows.window_start, len(rows.value))
    means = np.repeat(
        np.add.reduceat(rows.value, rows.window_start) / np.diff(bounds)[:, None], np.diff(bounds), axis=0
    )
    before = float(frame_losses(rows, rows.value - means).mean())
    return 1.0 - float(frame_losses(rows, rest).mean()) / max(before, 1e-12)
