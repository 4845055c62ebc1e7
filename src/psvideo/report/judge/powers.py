"""What to set each lamp's power to, so that the subject's brightest parts lie just below saturation."""

import numpy as np

from psvideo.model.plan import Plan
from psvideo.report.observe.levels import TARGET_QUANTILE, Levels
from psvideo.report.observe.observed import Observed

RIGHT = 1.12
"""A power within this factor of the right one is right: a sixth of a stop."""
FAINTEST = 1 / 32
"""Lamps that give less of what they should are not told what to set: something else is wrong."""


def power_words(plan: Plan, observed: Observed) -> dict[str, str]:
    """Return for every light that was seen what to set its power to, as a sentence."""
    found = {light: observed.levels(light) for light in plan.lights if light in observed.counts}
    levels = {light: one for light, one in found.items() if one.total}
    whole = [one for one in levels.values() if one.clipped_share <= 1 - TARGET_QUANTILE]
    return {light: _words(max(plan.powers(light)), one, whole) for light, one in levels.items()}


def _words(planned: float, levels: Levels, whole: list[Levels]) -> str:
    factor = levels.right_power(whole)
    wanted = planned * factor
    if factor > 1 / FAINTEST:
        return "gives hardly any light: does it fire?"
    if 1 / RIGHT <= factor <= RIGHT:
        return f"power {_percent(planned)} is right"
    if wanted <= 1:
        return f"set its power to {_percent(wanted)} (now {_percent(planned)})"
    more = f"bring it nearer or open the aperture by {np.log2(wanted):.1f} stops"
    return more if planned == 1 else f"set its power to 100 % (now {_percent(planned)}), and {more}"


def _percent(power: float) -> str:
    """Return a power in per cent, never rounded to nothing.

    >>> _percent(0.62), _percent(0.096), _percent(0.004)
    ('62 %', '9.6 %', '0.4 %')
    """
    return f"{100 * power:.0f} %" if power >= 0.1 else f"{100 * power:.2g} %"
