"""Which seed a fit begins with: the files' own numbering is searched first, then others, then every clock ratio."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Mask
from psvideo.model.plan import UNKNOWN_CLOCK_PPM, Plan
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
from psvideo.sync.rowfit.coarse.search import search
from psvideo.sync.rowfit.coarse.seed import (
    FAIR_SEED,
    GOOD_SEED,
    LEAST_REACH_PPM,
    SEED_ROWS,
    Seed,
    best_seed,
    first_guess,
    renumbered,
    stretch_length,
    stretches_of,
)
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.unlit import copies

CLEARER = 0.5
"""Another numbering than the files' is believed where it leaves less than this share of what theirs leaves."""
OFTEN = 0.05
"""Share of the frames from which on repeated ones are looked at before the search, and not on the way."""
RUN_FRAMES, MOST_RUNS = 16, 24
"""The shortest stretches that are searched, and how many of them."""
FOLDS, FOLD_ROWS, FITS = 6, 12, 2
"""Regular numberings that are searched after folding, with this many rows each, and how many of those are fitted."""


def find_seed(plan: Plan, rows: Profiles) -> Seed:
    """Return the best seed that the files' own numbering allows, or that another one makes clearly better."""
    reach_ppm = max(plan.clock_range_ppm, LEAST_REACH_PPM)
    coarse = rows.binned(SEED_ROWS)
    seed = best_seed(plan, coarse, as_numbered(rows), stretches_of(plan, coarse), reach_ppm)
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
    stretches = stretches_of(plan, rows)
    shortest = min(frames.stop - frames.start for frames in stretches)
    short = [frames for frames in stretches if frames.stop - frames.start == shortest]
    seed = best_seed(plan, rows, as_numbered(rows), short, UNKNOWN_CLOCK_PPM)
    if seed.share <= FAIR_SEED or len(short) == len(stretches):
        return seed
    return best_seed(plan, rows, as_numbered(rows), stretches, UNKNOWN_CLOCK_PPM)


def other_seeds(plan: Plan, rows: Profiles, seed: Seed) -> Iterator[Seed]:
    """Yield seeds for clips that cannot be followed from the best one.

    The first comes from many short stretches, as frames may be missing all over, the second from regular numberings.
    """
    reach_ppm = max(plan.clock_range_ppm, LEAST_REACH_PPM)
    coarse = rows.binned(SEED_ROWS)
    runs = [best_seed(plan, coarse, as_numbered(rows), [run], reach_ppm) for run in _runs(plan, rows)]
    yield max(runs, key=lambda seed: seed.share)
    retimed = _retimed(plan, coarse, twins(coarse), reach_ppm) if seed.retimed is None else seed.retimed
    yield from sorted(retimed, key=lambda seed: seed.share)[-1:]


def _retimed(plan: Plan, rows: Profiles, twin: Mask, reach_ppm: float) -> Iterator[Seed]:
    """Yield seeds under other numberings than the files': repeated frames left out, frames missing regularly."""
    again = copies(rows)
    odd = [again] if again.any() and (again != twin).any() else []
    for mask in [*odd, twin] if twin.mean() > OFTEN else []:
        for numbering in (stood_in(rows, mask), inserted(rows, mask)):
            yield best_seed(plan, rows, numbering, stretches_of(plan, renumbered(rows, numbering)), reach_ppm)
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
        stretch = slice(first, min(first + stretch_length(plan, rows), len(numbering.index)))
        tried.append(
            (_coarse_loss(plan, renumbered(rows, numbering).take(stretch), reach_ppm), len(tried), stretch, numbering)
        )
    plain = tried[0][0]
    for loss, _, stretch, numbering in sorted(tried[1:], key=lambda one: one[:2])[:FITS]:
        if loss < plain:
            yield best_seed(plan, rows, numbering, [stretch], reach_ppm)


def _coarse_loss(plan: Plan, rows: Profiles, reach_ppm: float) -> float:
    """Return the loss of the best place that a quick search finds."""
    guess = first_guess(plan)
    turned = (rows.turned() if guess.upward else rows).binned(FOLD_ROWS)
    known = plan.camera.readout_s is not None
    return search(plan, turned, range_ppm=reach_ppm, start=guess, readout_known=known)[0].loss


def _among(kept: Mask, frames: slice) -> slice:
    """Return where some of the clip's frames stand among those that are kept."""
    return slice(int(kept[: frames.start].sum()), int(kept[: frames.stop].sum()))


def _runs(plan: Plan, rows: Profiles) -> list[slice]:
    """Return short stretches all over the clip: where frames are missing here and there, one of them may have none."""
    frames = len(rows.value)
    length = min(frames, max(RUN_FRAMES, 3 * (len(plan.lit_slots) + 1)))
    starts = np.linspace(0, frames - length, min(MOST_RUNS, max((frames - length) // 4, 1)), dtype=np.int64)
    return [slice(start, start + length) for start in starts.tolist()]
