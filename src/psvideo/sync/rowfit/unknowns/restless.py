"""Subjects that move: every flash lights a row a little otherwise, and both frames that share a flash saw that one.

What a flash adds to or takes from its light's usual brightness is common to the frames that saw parts of it, in
proportion to these parts. So residuals err together: along the parts they are as large as the subject is restless,
across them as small as the noise. Generalised least squares (Aitken 1936) take that into account: rows that a flash
splits between two frames then show its time as well as if nothing moved, and rows that saw all of it count little.
"""

from dataclasses import replace

import numpy as np

from psvideo.compute.compiled import EXACT
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import compiled_flashes, compiled_rows, unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import LAST_SCALE, Fit, robust_loss
from psvideo.sync.rowfit.row_model import Flashes, Rows, lent_flashes, lent_rows, seen_of

SPLIT = 0.3
"""Each of two frames must have seen this much of a flash before what they say across its parts counts."""
WHOLE = 0.7
"""A frame that saw this much of one shows how much flashes differ."""
NEAR_ROWS = 8
"""Rows on either side that stand in for a row: few frames split a flash in any one row."""
LEAST = 24
"""Fewer samples say nothing."""
CLEARLY = 8.0
"""Flashes differ where whole ones stray by this many times the variance of split ones: shot noise alone makes it 4."""
ELSEWHERE = 8
"""Into this many parts the time from flash to flash is cut; the fit is held against all other places in it."""


def restless(plan: Plan, rows: Profiles, beat: Beat) -> Profiles:
    """Return the profiles with how much each row's flashes differ, as the residuals of a first fit show it.

    Noise is no smaller than a fit takes it for: compression leaves rows in the dark without any.
    """
    plain = replace(rows, restless=None)
    rest = unexplained(plan, plain, beat)
    whole, split = np.full(rest.shape, np.nan), np.full(rest.shape, np.nan)
    _parts(compiled_rows(plain, beat), compiled_flashes(plan, plain, beat), rest, whole, split)
    ratio, least = np.zeros(len(rows.place)), (LAST_SCALE * rows.spread) ** 2
    for row in range(len(ratio)):
        near = slice(max(row - NEAR_ROWS, 0), row + NEAR_ROWS + 1)
        noise = _variance(split[:, near])
        ratio[row] = _variance(whole[:, row]) / max(noise, float(least[row])) if noise > 0.0 else 1.0
    return replace(rows, restless=np.maximum(ratio - 1, 0.0)) if (ratio > CLEARLY).any() else plain


def across(plan: Plan, rows: Profiles, fit: Fit) -> float:
    """Return by which share less the fit leaves than flashes at other times would, 0 where no flashes differ.

    Where they differ, other times leave much in rows that a flash splits, however little they leave in whole flashes.
    """
    if rows.restless is None:
        return 0.0
    shift_s = plan.cycle_s / len(plan.cycle_slots) / ELSEWHERE
    others = [
        unexplained(plan, rows, fit.beat.with_phase(fit.beat.clock.phase_s + n * shift_s)) for n in range(1, ELSEWHERE)
    ]
    usual = float(np.median([robust_loss(rows, rest, fit.rest) for rest in others]))
    return max(1.0 - robust_loss(rows, fit.rest, fit.rest) / max(usual, 1e-30), 0.0)


def _variance(samples: Doubles) -> float:
    known = samples[np.isfinite(samples)]
    return (1.4826 * float(np.median(np.abs(known)))) ** 2 if len(known) >= LEAST else 0.0


@EXACT.kept
def _parts(rows: Rows, flashes: Flashes, rest: Doubles, whole: Doubles, split: Doubles) -> None:
    """Fill in (frame, row) the residuals of frames that saw a whole flash, and those across a flash that two saw."""
    rows, flashes = lent_rows(rows), lent_flashes(flashes)
    frames, height = rest.shape
    for row in range(height):
        k = 0
        for n in range(frames):
            open_s = rows.frame_start_s[n] + rows.row_place[row] * rows.row_time_s
            while k < len(flashes.start_s) and flashes.start_s[k] + flashes.duration_s[k] <= open_s:
                k += 1
            for j in range(k, len(flashes.start_s)):
                if flashes.start_s[j] >= open_s + rows.exposure_s:
                    break
                seen = seen_of(rows, flashes, n, row, j)
                if seen >= WHOLE:
                    whole[n, row] = rest[n, row]
                elif seen >= SPLIT and n + 1 < frames:
                    after = seen_of(rows, flashes, n + 1, row, j)
                    if after >= SPLIT:
                        split[n, row] = (seen * rest[n + 1, row] - after * rest[n, row]) / (seen**2 + after**2) ** 0.5
