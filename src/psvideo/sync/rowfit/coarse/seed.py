"""Where to start: a stretch of the clip that the plan's strobe fits, and how its frames follow one another."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Mask
from psvideo.model.plan import UNKNOWN_CLOCK_PPM, Plan
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.coarse.retime import (
    BESIDE,
    Numbering,
    as_numbered,
    fold_frames,
    inserted,
    regular_numberings,
    stood_in,
    twins,
)
from psvideo.sync.rowfit.coarse.rounds_first import search_coded
from psvideo.sync.rowfit.coarse.search import search
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import refined_beat
from psvideo.sync.rowfit.tracking.losses import frame_losses
from psvideo.sync.rowfit.unlit import copies

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
CLEARER = 0.5
"""Another numbering than the files' is believed where it leaves less than this share of what theirs leaves."""
OFTEN = 0.05
"""Share of the frames from which on repeated ones are looked at before the search, and not on the way."""
RUN_FRAMES, MOST_RUNS = 16, 24
"""The shortest stretches that are searched, and how many of them."""
FOLDS, FOLD_ROWS, FITS = 6, 12, 2
"""Regular numberings that are searched after folding, with this many rows each, and how many of those are fitted."""


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


def find_seed(plan: Plan, rows: Profiles) -> Seed:
    """Return the best seed that the files' own numbering allows, or that another one makes clearly better."""
    reach_ppm = max(plan.clock_range_ppm, LEAST_REACH_PPM)
    coarse = rows.binned(SEED_ROWS)
    seed = _best(plan, coarse, as_numbered(rows), _stretches(plan, coarse), reach_ppm)
    twin, retimed = twins(coarse), None
    if seed.share < GOOD_SEED or twin.mean() > OFTEN:
        retimed = list[Seed]()
        for other in _retimed(plan, coarse, twin, reach_ppm):
            retimed.append(other)
            if 1 - other.share < CLEARER * (1 - seed.share):
                seed = other
            if other.share > GOOD_SEED:
                break
    if seed.share <= FAIR_SEED and reach_ppm < UNKNOWN_CLOCK_PPM:
        seed = max(seed, _widely(plan, coarse), key=lambda one: one.share)
    return seed if retimed is None else replace(seed, retimed=tuple(retimed))


def _widely(plan: Plan, rows: Profiles) -> Seed:
    """Return the best seed at any clock ratio: of short stretches, which need a quarter of the clocks and of the time
    that long ones do for each; of long ones only where a short one shows something."""
    stretches = _stretches(plan, rows)
    shortest = min(frames.stop - frames.start for frames in stretches)
    short = [frames for frames in stretches if frames.stop - frames.start == shortest]
    seed = _best(plan, rows, as_numbered(rows), short, UNKNOWN_CLOCK_PPM)
    if seed.share <= FAIR_SEED or len(short) == len(stretches):
        return seed
    return _best(plan, rows, as_numbered(rows), stretches, UNKNOWN_CLOCK_PPM)


def other_seeds(plan: Plan, rows: Profiles, seed: Seed) -> Iterator[Seed]:
    """Yield seeds for clips that cannot be followed from the best one.

    The first comes from many short stretches, as frames may be missing all over, the second from regular numberings.
    """
    reach_ppm = max(plan.clock_range_ppm, LEAST_REACH_PPM)
    coarse = rows.binned(SEED_ROWS)
    runs = [_best(plan, coarse, as_numbered(rows), [run], reach_ppm) for run in _runs(plan, rows)]
    yield max(runs, key=lambda seed: seed.share)
    retimed = _retimed(plan, coarse, twins(coarse), reach_ppm) if seed.retimed is None else seed.retimed
    yield from sorted(retimed, key=lambda seed: seed.share)[-1:]


def _retimed(plan: Plan, rows: Profiles, twin: Mask, reach_ppm: float) -> Iterator[Seed]:
    """Yield seeds under other numberings than the files': repeated frames left out, frames missing regularly."""
    again = copies(rows)
    odd = [again] if again.any() and (again != twin).any() else []
    for mask in [*odd, twin] if twin.mean() > OFTEN else []:
        for numbering in (stood_in(rows, mask), inserted(rows, mask)):
            yield _best(plan, rows, numbering, _stretches(plan, renumbered(rows, numbering)), reach_ppm)
    bases = (as_numbered(rows), inserted(rows, twin)) if twin.mean() > OFTEN else (as_numbered(rows),)
    length = min(fold_frames(plan, rows), len(rows.value))
    for start in dict.fromkeys((0, (len(rows.value) - length) // 2)):
        for base in bases:
            if base.kept[start : start + length].sum() > 2 * BESIDE:
                yield from _folded(plan, rows, base, slice(start, start + length), reach_ppm)


def _folded(plan: Plan, rows: Profiles, base: Numbering, frames: slice, reach_ppm: float) -> Iterator[Seed]:
    """Yield the seeds of the regular numberings under which some frames fold to the cycle best, and better in a quick
    search than under the files' own."""
    distinct = renumbered(rows, base)
    among = _among(base.kept, frames)
    tried: list[tuple[float, int, slice, Numbering]] = []
    for numbering in (
        as_numbered(rows),
        *regular_numberings(plan, distinct, base, among, range_ppm=reach_ppm, keep=FOLDS),
    ):
        first = _among(numbering.kept, frames).start
        stretch = slice(first, min(first + _length(plan, rows), len(numbering.index)))
        tried.append(
            (_coarse_loss(plan, renumbered(rows, numbering).take(stretch), reach_ppm), len(tried), stretch, numbering)
        )
    plain = tried[0][0]
    for loss, _, stretch, numbering in sorted(tried[1:], key=lambda one: one[:2])[:FITS]:
        if loss < plain:
            yield _best(plan, rows, numbering, [stretch], reach_ppm)


def _coarse_loss(plan: Plan, rows: Profiles, reach_ppm: float) -> float:
    """Return the loss of the best place that a quick search finds."""
    guess = first_guess(plan)
    turned = (rows.turned() if guess.upward else rows).binned(FOLD_ROWS)
    known = plan.camera.readout_s is not None
    return search(plan, turned, range_ppm=reach_ppm, start=guess, readout_known=known)[0].loss


def _among(kept: Mask, frames: slice) -> slice:
    """Return where some of the clip's frames stand among those that are kept."""
    return slice(int(kept[: frames.start].sum()), int(kept[: frames.stop].sum()))


def _best(plan: Plan, rows: Profiles, numbering: Numbering, stretches: list[slice], reach_ppm: float) -> Seed:
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


def _length(plan: Plan, rows: Profiles) -> int:
    """Return how many frames a stretch has: half as long again as it takes to see the marker."""
    return min(len(rows.value), max(SEED_FRAMES, int(1.5 * plan.marker_s / rows.period_s) + 2))


def _stretches(plan: Plan, rows: Profiles) -> list[slice]:
    """Return the stretches to look at: at the beginning, in the middle and at the end, then shorter ones."""
    frames = len(rows.value)
    length = _length(plan, rows)
    starts = [0, (frames - length) // 2, frames - length]
    short = min(frames, max(24, length // 2))
    more = [(frames - short) // 4, (frames - short) * 3 // 4, 0]
    spans = [(start, length) for start in starts] + [(start, short) for start in more]
    return [slice(start, start + count) for start, count in dict.fromkeys(spans)]


def _runs(plan: Plan, rows: Profiles) -> list[slice]:
    """Return short stretches all over the clip: where frames are missing here and there, one of them may have none."""
    frames = len(rows.value)
    length = min(frames, max(RUN_FRAMES, 3 * (len(plan.lit_slots) + 1)))
    starts = np.linspace(0, frames - length, min(MOST_RUNS, max((frames - length) // 4, 1)), dtype=np.int64)
    return [slice(start, start + length) for start in starts.tolist()]


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
