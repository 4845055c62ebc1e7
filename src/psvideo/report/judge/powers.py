"""What to set each lamp's power to, so that the subject's brightest parts lie just below saturation."""

from collections.abc import Mapping, Sequence

import numpy as np

from psvideo.model.plan import Plan
from psvideo.report.judge.of_exposure import BEST_STOPS, CLEAN, ceiling_of
from psvideo.report.observe.against_noise import AgainstNoise, usual
from psvideo.report.observe.levels import STOPS, TARGET_QUANTILE, Levels
from psvideo.report.observe.observed import Observed

RIGHT = 1.12
"""A power within this factor of the right one is right: a sixth of a stop."""
ENOUGH = "power {} is enough: it stands well out of the noise. Where the sensor saturates is not known"
FAINTEST = 1 / 32
"""Lamps that give less of what they should are not told what to set: something else is wrong."""


def power_words(plan: Plan, observed: Observed) -> dict[str, str]:
    """Return for every light that was seen what to set its power to, as a sentence.

    Where a curve records a scene far beyond white and the plan does not say where the sensor saturates, the largest
    code says nothing of it: a light is right then that stands as far out of the noise as is advised.
    """
    found = {light: observed.levels(light) for light in plan.lights if light in observed.counts}
    levels = {light: one for light, one in found.items() if one.total}
    if ceiling_of(plan.camera.encoding) == "the largest code":
        return _by_noise(plan, levels, observed.closely.noises)
    whole = [one for one in levels.values() if one.clipped_share <= 1 - TARGET_QUANTILE]
    return {light: _words(max(plan.powers(light)), one.right_power(whole)) for light, one in levels.items()}


def _by_noise(plan: Plan, levels: Mapping[str, Levels], noises: Sequence[AgainstNoise]) -> dict[str, str]:
    """Return the words where only noise says what is enough; none where it is not known. Noise was measured under
    every pixel's brightest light: a weaker one needs as much more light as it gives less."""
    tops = {light: one.quantile(TARGET_QUANTILE) for light, one in levels.items()}
    if not noises or max(tops.values(), default=0.0) <= 0:
        return {}
    more = 2.0 ** usual(noises).stops_to(CLEAN)
    words = {}
    for light, top in tops.items():
        seen, planned = max(top, 2.0**-STOPS), max(plan.powers(light))
        factor = min(more * max(tops.values()), 2.0**BEST_STOPS) / seen
        words[light] = ENOUGH.format(_percent(planned)) if factor < 1 / RIGHT else _words(planned, factor)
    return words


def _words(planned: float, factor: float) -> str:
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
