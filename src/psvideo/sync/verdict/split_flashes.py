"""Whether light adds up where a row splits a flash between two frames: it does not where it was read by another curve.

At 360 degrees a row's openings follow each other without a gap. So what two frames saw of one flash is all of it,
however slowly its LED glows and wherever in it the row closed. Light that was read as its power g gives parts a and b
of which a^(1/g) + b^(1/g) is 1; no exposure that a frame holds makes a + b more, and a shorter one makes it less by as
much for all parts.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.compute.ranks import median, quantile
from psvideo.model.arrays import Doubles, Flags, Integers
from psvideo.model.half_flash import HalfFlash
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.compiled_profiles import compiled_flashes
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.row_model import Flashes

WHOLE_SHUTTER, NEARLY = 0.98, 0.999
"""Shares of the frame that is exposed, and of the exposure that flashes must be apart, for parts to add up."""
MOST_FLASHES = 400
LEAST_LIGHT, STEADY = 0.15, 0.04
"""Rows count that a light gives this share of the brightest row's, and that change by less than this share."""
PART = (0.05, 0.97)
"""Parts that are smaller or larger say little of the curve."""
LEAST_PARTS = 20
STRAIGHT = (0.8, 1.25)
"""Powers between which curves are taken for the plan's: right ones give 0.99 to 1.01 where the subject stands, and 0.89
to 1.12 under LED tails and mains ripple; rec709, sRGB and S-Log3 that are read as others 0.52 to 0.56."""
CLEARER = 0.6
"""Of what one sum for all parts leaves over, a power leaves at most this share where it is one."""
MORE_THAN_ALL = 1.25
"""Nor is there need of parts of all sizes where they come to more than this: nothing else but clipped light does."""
UNCLIPPED = 0.02
"""Rows count of whose light saturated pixels may hide less than this share in every frame."""
POWERS = np.geomspace(0.05, 8.0, 200)


def half_flash(plan: Plan, found: ClipFit) -> HalfFlash | None:
    """Return how bright half of a flash looks; None where that is half of all of it, or where the clip does not show
    it. The fit knows it where it read the rows by another curve; else it does not show below 360 degrees, without a
    dark slot, where rows hold two flashes, or where too little stands still."""
    if found.reading is not None:
        return HalfFlash(share=found.reading.half)
    beat = found.fit.beat
    exposure_s = plan.camera.exposure_s  # another one may have been found for the curve's sake
    exposed = exposure_s >= WHOLE_SHUTTER * plan.camera.frame_period_s
    if not (exposed and plan.dark_s * beat.clock.rate >= NEARLY * exposure_s and beat.row_time_s > 0.0):
        return None
    power = power_of_parts(_parts(plan, found))
    return None if power is None else HalfFlash(share=float(0.5**power))


def power_of_parts(parts: Doubles) -> float | None:
    """Return as which power of it light was read, by the shares of flashes that two frames saw, (part, 2); None where
    it adds up, or where parts do not show it."""
    if len(parts) < LEAST_PARTS:
        return None
    raised = (parts[:, :, None] ** (1 / POWERS)).sum(axis=1)
    powers = POWERS[np.abs(raised - 1).argmin(axis=1)]
    power, sums = median(powers), parts.sum(axis=1)
    bent = quantile(powers, 0.9) < STRAIGHT[0] or quantile(powers, 0.1) > STRAIGHT[1]
    left = median(np.abs((parts ** (1 / power)).sum(axis=1) - 1))
    one_power = left < CLEARER * median(np.abs(sums - median(sums)))
    return power if bent and (one_power or quantile(sums, 0.1) > MORE_THAN_ALL) else None


@dataclass(frozen=True, kw_only=True)
class _SplitFlashes:
    """What two frames in a row saw of flashes, (flash, row), NaN where a frame is missing.

    light: (flash,) which unknown each flash is, 0 for a dark slot. first: what the frame shows that is open when the
    flash starts; second: what the next one shows. split: the row closed while the flash was on, so that both saw a part
    of it. whole: the first one saw all of it.
    """

    light: Integers
    first: Doubles
    second: Doubles
    split: Flags
    whole: Flags


def _parts(plan: Plan, found: ClipFit) -> Doubles:
    """Return what two frames in a row saw of flashes that they split, (part, 2), as shares of all of it; no part
    without a dark slot, since room light is not known then."""
    flashes = compiled_flashes(plan, found.rows, found.fit.beat)
    seen = _seen(flashes, found)
    if len(np.unique(seen.light)) < flashes.unknowns:
        return np.zeros((0, 2))
    dark, flash_alone, spread = _levels(seen, flashes.unknowns)
    steady = _steady(flash_alone, spread, found.rows)
    light = seen.light
    counts = seen.split & steady[light] & (light[:, None] > 0) & np.isfinite(seen.first + seen.second)
    parts = np.stack([(one - dark)[counts] / flash_alone[light][counts] for one in (seen.first, seen.second)], axis=1)
    return np.asarray(parts[(parts.min(axis=1) > PART[0]) & (parts.max(axis=1) < PART[1])])


def _seen(flashes: Flashes, found: ClipFit) -> _SplitFlashes:
    """Return what frames saw of up to ``MOST_FLASHES`` flashes, evenly over the clip."""
    rows = found.rows
    some = np.unique(np.linspace(0, len(flashes.start_s) - 1, MOST_FLASHES).astype(np.int64))
    start_s, lasts_s = flashes.start_s[some, None], flashes.duration_s[some, None]
    opens_s = rows.place * found.fit.beat.row_time_s
    frame = np.floor((start_s - lasts_s / 2 - opens_s) / rows.period_s).astype(np.int64)  # open just before the flash
    ends_s = (frame + 1) * rows.period_s + opens_s - start_s  # when it closes, after the flash's start
    return _SplitFlashes(
        light=flashes.unknown[some],
        first=_at(found, frame),
        second=_at(found, frame + 1),
        split=ends_s < 1.5 * lasts_s,
        whole=(ends_s > 2 * lasts_s) & (ends_s - rows.period_s < -lasts_s),
    )


def _levels(seen: _SplitFlashes, unknowns: int) -> tuple[Doubles, Doubles, Doubles]:
    """Return what rows show in the dark (row,), how much more by a whole flash of each unknown, and by how much that
    changes from flash to flash, (unknown, row) both: medians over the flashes that one frame saw whole."""

    def by_unknown(values: Doubles) -> list[Doubles]:
        alike = [seen.light == one for one in range(unknowns)]
        return [_middle(np.where(seen.whole[some], values[some], np.nan)) for some in alike]

    every = by_unknown(seen.first)
    dark, flash_alone = every[0], np.stack([one - every[0] for one in every])
    strays = np.abs(seen.first - dark - flash_alone[seen.light])
    return dark, flash_alone, np.stack(by_unknown(strays))


def _steady(flash_alone: Doubles, spread: Doubles, rows: Profiles) -> Flags:
    """Return which rows of which unknown are bright enough, hardly change and hide hardly any light in saturated
    pixels, (unknown, row)."""
    bright = np.nan_to_num(flash_alone)
    hidden = 0.0 if rows.doubt is None else rows.doubt.max(axis=0)
    return np.asarray(
        (bright > LEAST_LIGHT * bright.max()) & (spread < STEADY * bright) & (hidden <= UNCLIPPED * bright)
    )


def _at(found: ClipFit, place: Integers) -> Doubles:
    """Return what rows show in the frames at places in time (flash, row); NaN where there is none."""
    rows = found.rows
    at = np.minimum(np.searchsorted(rows.index, place), len(rows.index) - 1)
    return np.where(rows.index[at] == place, rows.value[at, np.arange(rows.value.shape[1])], np.nan)


def _middle(values: Doubles) -> Doubles:
    """Return each column's median of what is no NaN, the lower one of two; NaN where nothing is."""
    middle = np.maximum(np.isfinite(values).sum(axis=0) - 1, 0) // 2
    return np.asarray(np.take_along_axis(np.sort(values, axis=0), middle[None], axis=0)[0])
