"""Strobes in step with the frames: with a shutter below 360 degrees some rows then never see some lights, in any take.

A row is blind for a part of each frame. Flashes of a light fall at other places in the frame from round to round, so
that each row sees the light in some round, unless rounds last a whole number of frames, or nearly.
"""

import math
from dataclasses import replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.model.rows.recipe import LEAST_SHARE

TAKE_S, TAKE_CYCLES = 10.0, 64
"""How long a take is thought to be where it is not filmed yet, the longer of the two: slow cameras film longer."""
SOON_S, SOON_CYCLES = 1.0, 8
"""In so short a take, the longer of the two, every row is to see every light at another dark time."""
LONG_CYCLES, SAME_SHARE = 1000, 0.005
"""What stays within this share for so many cycles does not drift: it holds however long a take is."""
IN_STEP = 0.02
"""A smaller share of the rows is not worth a word."""
FINEST, MOST = 1 / 200, 0.25
"""The frame periods in steps of which another dark time is looked for, and by how many it may be longer."""
MOST_FRAMES = 64


def usual_take_s(plan: Plan) -> float:
    """Return how long a take of this plan is thought to be where it is not filmed yet."""
    return max(TAKE_S, TAKE_CYCLES * plan.cycle_s)


def never_shown(plan: Plan, *, lasts_s: float | None = None, clock_offset_ppm: float = 0.0) -> float:
    """Return the share of the rows, in the mean over lights and first moments, that see a light in no round of a take
    of this length, or of a usual one. 0 at 360 degrees and in synced plans."""
    lasts_s = usual_take_s(plan) if lasts_s is None else lasts_s
    period_s = plan.camera.frame_period_s
    if plan.mode == "synced" or plan.camera.exposure_s >= period_s:
        return 0.0
    rate = 1 + clock_offset_ppm * 1e-6
    count = max(math.ceil(lasts_s / (plan.cycle_s * rate)), 1) * len(plan.cycle_slots)
    train = plan.train(0, count)
    shares = []
    for light in plan.lights:
        mine = np.array([light in plan.flashes[slot].lit for slot in train.slot], np.bool_)
        shown_s = plan.camera.exposure_s + (1 - 2 * LEAST_SHARE) * float(train.duration_s[mine].max()) * rate
        places_s = np.sort((train.start_s[mine] * rate) % period_s)
        gaps_s = np.diff(np.append(places_s, places_s[0] + period_s))
        shares.append(float(np.maximum(gaps_s - shown_s, 0.0).sum() / period_s))
    return float(np.mean(shares))


def blind_share(plan: Plan, *, clock_offset_ppm: float = 0.0) -> float:
    """Return the share of the rows that do not see a flash of their own round, in the mean over lights and over where
    in the frame flashes fall: they lie in the pause between two exposures. 0 at 360 degrees."""
    period_s, rate = plan.camera.frame_period_s, 1 + clock_offset_ppm * 1e-6
    pause_s = period_s - plan.camera.exposure_s
    shown_s = [(1 - 2 * LEAST_SHARE) * flash.duration_s * rate for flash in plan.flashes if flash.lit]
    return float(np.mean([max(pause_s - one_s, 0.0) / period_s for one_s in shown_s]))


def stays_in_step(plan: Plan, never: float) -> bool:
    """Tell whether no more rows see a light in far longer takes than in a usual one, where ``never`` see none."""
    return never_shown(plan, lasts_s=LONG_CYCLES * plan.cycle_s) >= never - SAME_SHARE


def frames_in_step(plan: Plan) -> int:
    """Return after how many frames the flashes meet the same rows again, as nearly as they do within 64 frames."""
    frames = plan.cycle_s / plan.camera.frame_period_s
    rounds = range(1, max(int(MOST_FRAMES / frames), 1) + 1)
    best = min(rounds, key=lambda n: abs(n * frames - round(n * frames)) * n)
    return round(best * frames)


def dark_s_out_of_step(plan: Plan) -> float | None:
    """Return the shortest dark time, longer than the plan's, at which every row soon sees every light; None where a
    quarter of a frame more does not help, and in half-rate plans, which last two frames a flash at no other."""
    if plan.mode != "rolling":
        return None
    soon_s = max(SOON_S, SOON_CYCLES * plan.cycle_s)
    step_s = FINEST * plan.camera.frame_period_s
    for more in range(1, round(MOST / FINEST) + 1):
        dark_s = plan.dark_s + more * step_s
        if never_shown(replace(plan, dark_s=dark_s), lasts_s=soon_s) == 0:
            return dark_s
    return None
