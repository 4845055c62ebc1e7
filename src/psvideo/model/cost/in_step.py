"""Strobes in step with the frames: with a shutter below 360 degrees some rows then never see some lights, in any take.

A row is blind for a part of each frame. Flashes of a light fall at other places in the frame from round to round, so
that each row sees the light in some round, unless rounds last a whole number of frames, or nearly.
"""

import math
from dataclasses import replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.model.rows.recipe import LEAST_SHARE

TAKE_S = 10.0
"""How long a take is thought to be where it is not filmed yet; of longer ones more rows are shown."""
SOON_S = 1.0
"""In so short a take every row is to see every light at another dark time."""
IN_STEP = 0.02
"""A smaller share of the rows is not worth a word."""
FINEST, MOST = 1 / 200, 0.25
"""The frame periods in steps of which another dark time is looked for, and by how many it may be longer."""
MOST_FRAMES = 64


def never_shown(plan: Plan, *, lasts_s: float = TAKE_S, clock_offset_ppm: float = 0.0) -> float:
    """Return the share of the rows, in the mean over lights and first moments, that see a light in no round of a take
    of this length. 0 at 360 degrees and in synced plans."""
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


def frames_in_step(plan: Plan) -> int:
    """Return after how many frames the flashes meet the same rows again, as nearly as they do within 64 frames."""
    frames = plan.cycle_s / plan.camera.frame_period_s
    rounds = range(1, max(int(MOST_FRAMES / frames), 1) + 1)
    best = min(rounds, key=lambda n: abs(n * frames - round(n * frames)) * n)
    return round(best * frames)


def dark_s_out_of_step(plan: Plan) -> float | None:
    """Return the shortest dark time, longer than the plan's, at which every row soon sees every light; None where a
    quarter of a frame more does not help."""
    step_s = FINEST * plan.camera.frame_period_s
    for more in range(1, round(MOST / FINEST) + 1):
        dark_s = plan.dark_s + more * step_s
        if never_shown(replace(plan, dark_s=dark_s), lasts_s=SOON_S) == 0:
            return dark_s
    return None
