"""What a plan may have got wrong by far: other shutters, readouts, flashes and frame rates, each tried on a few frames.

A fit creeps from the plan's values to true ones that are near. A shutter of 180 degrees written down as 360, a bottom
row that comes first, or 25 frames for 24 are no places that it reaches. They are few and known, so each is tried.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.coarse.search import search
from psvideo.sync.rowfit.coarse.seed import LEAST_REACH_PPM, SEED_ROWS, first_guess, gain_of, seeded
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.profiles import Profiles

SHUTTERS_DEG = (360.0, 270.0, 240.0, 216.0, 180.0, 172.8, 144.0, 120.0, 90.0, 72.0, 60.0, 45.0, 22.5, 11.25)
SHUTTERS_S = tuple(1.0 / n for n in (24, 25, 30, 48, 50, 60, 96, 100, 120, 125, 160, 200, 240, 250, 500, 1000))
FACTORS = (0.125, 0.25, 0.5, 2.0, 4.0, 8.0)
RATES_HZ = (24, 25, 30, 48, 50, 60, 96, 100, 120, 200, 240)
APART = 0.04
"""Exposures that differ by less than this share are one, and the fit's own business where one is the plan's."""
OTHER_COUNTS = 3
"""This many lights more or fewer are tried."""
LEAST_FRAMES = 24
ROUGH_ROWS = 18
"""Rows of the rough search of all rivals, which only decides what is looked at closely;"""
SCREENED = 4
"""rivals that are looked at closely after a rough search of all."""
CLEARLY, BETTER = 0.5, 0.85
"""A rival is believed where it leaves less than this share of the robust loss that the plan leaves; the second, where
the plan's own fit is out of the question and the rival's will be judged for itself."""
FAIR, GOOD = 0.4, 0.7
"""And where it takes away this share of all of it itself; the second, where no fit will judge it."""
NEARLY = 2.0
"""A rival without missing frames leaves at most this many times what a fit with some leaves of the same frames: missing
ones that are true make any other plan fit better than the one that was played, and yet badly."""

Fault = Literal["shutter", "readout", "flashes", "rate", "count"]


@dataclass(frozen=True, kw_only=True)
class Rival:
    """A plan as it may have been meant, and what is wrong then with the one that was given."""

    plan: Plan
    fault: Fault


def camera_rivals(plan: Plan) -> Iterator[Rival]:
    """Yield the plan with a readout that is to be found, and with other exposures."""
    camera = plan.camera
    if camera.readout_s is not None:
        yield Rival(plan=replace(plan, camera=replace(camera, readout_s=None)), fault="readout")
    for exposure_s in _exposures(plan):
        yield Rival(plan=replace(plan, camera=replace(camera, exposure_s=exposure_s)), fault="shutter")


def double_rivals(plan: Plan) -> Iterator[Rival]:
    """Yield the plan with other exposures and a readout that is to be found."""
    if plan.camera.readout_s is not None:
        for exposure_s in _exposures(plan):
            camera = replace(plan.camera, exposure_s=exposure_s, readout_s=None)
            yield Rival(plan=replace(plan, camera=camera), fault="shutter")


def strobe_rivals(plan: Plan) -> Iterator[Rival]:
    """Yield the plan with flashes half or twice as long, and at other frame rates."""
    for factor in (0.5, 2.0):
        flashes = tuple(replace(flash, duration_s=factor * flash.duration_s) for flash in plan.flashes)
        kept_s = plan.dark_s - (factor - 1) * min(flash.duration_s for flash in plan.flashes)
        for dark_s in (plan.dark_s, kept_s):
            if dark_s > 0:
                yield Rival(plan=replace(plan, flashes=flashes, dark_s=dark_s), fault="flashes")
    for rate in likely_rates(plan):
        period_s = float(1 / rate)
        by_angle_s = plan.camera.exposure_s / plan.camera.frame_period_s * period_s
        for exposure_s in {by_angle_s, min(plan.camera.exposure_s, period_s)}:
            camera = replace(plan.camera, fps=rate, exposure_s=exposure_s, readout_s=None)
            yield Rival(plan=replace(plan, camera=camera), fault="rate")


def count_rivals(plan: Plan) -> Iterator[Rival]:
    """Yield the plan with fewer or more lights, with a dark slot in every round and without, the shortest first."""
    lit = plan.flashes[plan.lit_slots[0]]
    dark = replace(lit, lights={})
    for count in range(max(len(plan.lit_slots) - OTHER_COUNTS, 1), len(plan.lit_slots) + OTHER_COUNTS + 1):
        flashes = tuple(replace(lit, lights={f"light {n + 1}": 1.0}) for n in range(count))
        for played in (flashes, (*flashes, dark)):
            if [flash.is_dark for flash in played] != [flash.is_dark for flash in plan.flashes] or plan.dark_every > 1:
                yield Rival(plan=replace(plan, flashes=played, dark_every=1, dark_code=0), fault="count")


def _exposures(plan: Plan) -> list[float]:
    """Return exposures that a camera may have had instead of the plan's, in seconds."""
    camera = plan.camera
    shutters_s = [angle / 360.0 * camera.frame_period_s for angle in SHUTTERS_DEG]
    found: list[float] = [camera.exposure_s]
    for exposure_s in (*(factor * camera.exposure_s for factor in FACTORS), *shutters_s, *SHUTTERS_S):
        fits = exposure_s <= camera.frame_period_s * (1 + 1e-9)
        if fits and all(abs(exposure_s / other - 1) > APART for other in found):
            found.append(exposure_s)
    return found[1:]


def likely_rates(plan: Plan) -> list[Fraction]:
    """Return the usual frame rates that people mix up with the plan's."""
    fps = plan.camera.fps
    usual = [Fraction(rate) for rate in RATES_HZ] + [2 * fps, fps / 2]
    near = [rate for rate in usual if abs(float(rate / fps) - 1) > 0.01 and 0.45 < rate / fps < 2.2]
    return [rate for n, rate in enumerate(near) if all(abs(rate / other - 1) > 0.005 for other in near[:n])]


def best_rival(
    plan: Plan,
    rows: Profiles,
    rivals: Sequence[Rival],
    *,
    least: float = GOOD,
    leaves: float = CLEARLY,
    beside: ClipFit | None = None,
) -> Rival | None:
    """Return the rival that explains a stretch of the clip best, or None where the plan is as good as any.

    ``rows`` are laid out from the picture's top row. A rival must explain the share ``least`` of the robust loss, and
    leave less than the share ``leaves`` of what the plan leaves where no frames are missing; and nearly as little as
    the plan's fit ``beside``, with its missing frames, leaves of that stretch.
    """
    frames = _liveliest(plan, rows)
    part = rows.take(frames).one_window()
    rough = sorted((_rough_loss(rival, part), n) for n, rival in enumerate(rivals))
    best: tuple[float, int] | None = None
    for _, n in rough[:SCREENED]:
        share = _share(rivals[n].plan, part)
        if best is None or share > best[0]:
            best = share, n
    if best is None or best[0] < least or 1 - best[0] > leaves * (1 - _share(plan, part)):
        return None
    if beside and 1 - best[0] > NEARLY * (1 - _share_of_fit(plan, rows, frames, beside)):
        return None
    return rivals[best[1]]


def _share_of_fit(plan: Plan, rows: Profiles, frames: slice, found: ClipFit) -> float:
    """Return which share of the robust loss of some frames a fit of all takes away."""
    beat = replace(found.fit.beat, beat_hz=(), blur_s=0.0)
    part = replace(rows.turned() if beat.upward else rows, index=found.track.index).take(frames).one_window()
    few = part.binned(SEED_ROWS)
    return gain_of(few, unexplained(plan, few, beat))


def _liveliest(plan: Plan, rows: Profiles) -> slice:
    """Return the stretch of frames, long enough to separate plans, that changes most from one to the next."""
    count = len(rows.value)
    length = min(count, max(LEAST_FRAMES, int(1.2 * plan.marker_s / rows.period_s) + 2))
    change = np.append(0.0, np.cumsum(np.abs(np.diff(rows.value, axis=0)).mean(axis=1)))
    starts = np.unique(np.linspace(0, count - length, 5).astype(int))
    first = max(starts.tolist(), key=lambda start: float(change[start + length - 1] - change[start]))
    return slice(first, first + length)


def _at_rate_of(plan: Plan, rows: Profiles) -> Profiles:
    return replace(rows, period_s=plan.camera.frame_period_s)


def _rough_loss(rival: Rival, rows: Profiles) -> float:
    plan = rival.plan
    guess, known = first_guess(plan), plan.camera.readout_s is not None
    part = _at_rate_of(plan, rows.turned() if guess.upward else rows).binned(ROUGH_ROWS)
    reach = max(plan.clock_range_ppm, LEAST_REACH_PPM)
    return search(plan, part, range_ppm=reach, start=guess, readout_known=known)[0].loss


def _share(plan: Plan, rows: Profiles) -> float:
    """Return which share of the robust loss the plan takes away at its best place."""
    reach = max(plan.clock_range_ppm, LEAST_REACH_PPM)
    return seeded(plan, _at_rate_of(plan, rows), first_guess(plan), reach)[1]
