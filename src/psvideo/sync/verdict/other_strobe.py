"""Which other strobe, or other frame rate, a picture shows in which none like the plan's was found."""

from dataclasses import replace

import numpy as np

from psvideo.model.plan import Plan
from psvideo.model.units import counted
from psvideo.sync.rowfit.coarse.search import GridPlace, search
from psvideo.sync.rowfit.coarse.seed import first_guess, gain_of
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.verdict.rivals import CLEARLY, Rival, best_rival, count_rivals, likely_rates, strobe_rivals

WRONG_PERIOD_GAIN = 0.6
OTHER_PERIOD = 0.02
"""Share by which the time from flash to flash must be off to be called another one."""
LITTLE_MORE = 2.0
"""Times the robust loss that more lights leave, which fewer may."""
PERIOD_FRAMES, PERIOD_ROWS = 14, 8
LEAST_GAP, LONGEST = 0.25, 2.5
"""Periods are tried from this share of a frame's period after a flash to this many of them."""
MOST_PERIODS = LONGEST - LEAST_GAP


def other_plan(plan: Plan, rows: Profiles) -> str:
    """Say which other durations, frame rate or number of lights the picture fits, and what to do; or nothing."""
    meant = best_rival(plan, rows, list(strobe_rivals(plan)))
    if meant is not None:
        return _described(plan, meant)
    played = _other_count(plan, rows)
    if played is not None:
        return (
            f"The picture fits {_round_words(played)} in turn, and the plan has {_round_words(plan)}: the strobe "
            "played another plan. Put the plan that it played beside the clip."
        )
    return ""


def _described(plan: Plan, rival: Rival) -> str:
    if rival.fault == "rate":
        rate, planned = float(rival.plan.camera.fps), float(plan.camera.fps)
        return (
            f"The picture fits a camera that ran at {rate:.6g} frames a second, and the plan says {planned:.6g}: put "
            f"the true frame rate (and the shutter that goes with it) into plan.toml, or film at {planned:.6g}."
        )
    meant = rival.plan
    parts = [
        f"{name} {other * 1e3:.4g} ms (plan: {planned * 1e3:.4g} ms)"
        for name, other, planned in (
            ("flashes of", meant.flashes[meant.lit_slots[0]].duration_s, plan.flashes[plan.lit_slots[0]].duration_s),
            ("dark times of", meant.dark_s, plan.dark_s),
        )
        if abs(other - planned) > 1e-9 * other
    ]
    return (
        f"The picture fits {' and '.join(parts)} far better: the strobe played another plan, or its durations were "
        "doubled or halved on the way. Put the plan that it played beside the clip."
    )


def _other_count(plan: Plan, rows: Profiles) -> Plan | None:
    """Return the plan with the number of lights that the picture fits. Two rounds fit as one, and a dark slot as one
    more light: of those that leave little more, it is one with fewer lights."""
    rivals = list(count_rivals(plan))
    meant = best_rival(plan, rows, rivals)
    if meant is None:
        return None
    length, lights = len(meant.plan.flashes), len(meant.plan.lights)
    simpler = [one for one in rivals if length % len(one.plan.flashes) == 0 and len(one.plan.lights) < lights]
    simplest = best_rival(meant.plan, rows, simpler, leaves=LITTLE_MORE) if simpler else None
    return (simplest or meant).plan


def _round_words(plan: Plan) -> str:
    dark = "a dark slot" if any(flash.is_dark for flash in plan.flashes) else "no dark slot"
    rare = f" in one round of {plan.dark_every}" if plan.dark_every > 1 else ""
    return f"{counted(len(plan.lit_slots), 'light')} and {dark}{rare}"


def other_strobe(plan: Plan, rows: Profiles) -> str:
    """Say at which other period the picture shows a strobe, and what to do; or nothing."""
    if max(flash.duration_s for flash in plan.flashes) > MOST_PERIODS * rows.period_s:
        return ""  # no period that is tried has room for such a flash
    period_s, gain, planned = other_period(plan, rows)
    flash_s = plan.flashes[plan.lit_slots[0]].duration_s
    planned_s = plan.dark_s + flash_s
    if gain < WRONG_PERIOD_GAIN or abs(period_s / planned_s - 1) < OTHER_PERIOD:
        return ""
    if 1 - gain > CLEARLY * (1 - planned):
        return ""
    words = (
        f"The picture looks like a strobe that flashes every {period_s * 1e3:.4g} ms, and not every "
        f"{planned_s * 1e3:.4g} ms as planned"
    )
    for rate in likely_rates(plan):
        if abs(period_s / planned_s * float(plan.camera.fps / rate) - 1) < 0.5 * OTHER_PERIOD:
            return (
                f"{words}, as if the camera had run at {float(rate):.6g} frames a second instead of the plan's "
                f"{float(plan.camera.fps):.6g}. Check the frame rate, and the plan that the strobe played."
            )
    if period_s - flash_s < plan.camera.exposure_s * (1 - OTHER_PERIOD):
        words += (
            f"; its dark time is then shorter than the exposure of {plan.camera.exposure_s * 1e3:.4g} ms, so that rows "
            "hold two flashes mixed"
        )
    return f"{words}. Put the plan that it played beside the clip, or let it play this one."


def other_period(plan: Plan, rows: Profiles) -> tuple[float, float, float]:
    """Return the time from flash to flash that explains the picture best, how much of the loss it takes away, and how
    much the plan's own takes away of the same few frames."""
    part = rows.take(slice(0, min(PERIOD_FRAMES, len(rows.value)))).binned(PERIOD_ROWS).one_window()
    longest_s = max(flash.duration_s for flash in plan.flashes)
    step_s = longest_s / len(part.value)

    def best(dark_s: float) -> GridPlace:
        tried = replace(plan, dark_s=dark_s)
        return search(tried, part, range_ppm=0.0, start=first_guess(plan), readout_known=True)[0]

    def gain(dark_s: float) -> float:
        return gain_of(part, unexplained(replace(plan, dark_s=dark_s), part, best(dark_s).beat))

    periods_s = np.arange(longest_s + LEAST_GAP * rows.period_s, LONGEST * rows.period_s, step_s).tolist()
    period_s = min(periods_s, key=lambda one_s: best(one_s - longest_s).loss)
    return period_s, gain(period_s - longest_s), gain(plan.dark_s)
