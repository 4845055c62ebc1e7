"""Lights that seem not to have fired, or all at once, in words."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from psvideo.model.cost.in_step import IN_STEP, never_shown
from psvideo.model.plan import Plan
from psvideo.model.rig import LEAST_LIGHTS
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import brightnesses
from psvideo.sync.rowfit.fit import ClipFit

UNFIRED = 0.01
"""Share of the brightest light's level below which a light is said not to have fired."""
ALIKE = 0.01
"""Share of their level by which lights that flash one at a time differ at least, in some rows."""


def remarks_on_lights(plan: Plan, found: ClipFit, beat: Beat, *, named: bool) -> tuple[str, ...]:
    """Return sentences on lights that seem not to have fired, or all at once.

    ``beat`` is the fit's, its cycle turned to where the lights' names are; ``named``: these are not a guess.
    """
    lit = plan.lit_slots
    drive_s = np.array([sum(plan.flashes[slot].lights.values()) * plan.flashes[slot].duration_s for slot in lit])
    rows = found.rows.one_window()
    light = brightnesses(plan, rows, beat, rows.unclipped)[:, 1 : len(lit) + 1] / drive_s
    level = light.mean(axis=0)
    if level.min() < -UNFIRED * level.max():
        return ()  # no flash takes light away: the names are wrong, and not the lights
    off = [slot for slot, one in zip(lit, level, strict=True) if one < UNFIRED * level.max()]
    if off:
        dark = ", ".join(dict.fromkeys("+".join(plan.flashes[slot].lit) for slot in off))
        unless = "" if named else " If the order guessed here is not the true one, it is another light."
        told = f"{dark}: no light is seen from there, less than {100 * UNFIRED:.0f} % of the brightest."
        missed = _missed_share(plan, found, beat)
        if missed > IN_STEP:
            return (
                f"{told} These lights may fire unseen: the strobe keeps step with the frames, and the closed shutter "
                f"misses {100 * missed:.0f} % of the rows' flashes in every round of this clip. Then times are known "
                f"less well than is said. Plan another dark time (`dark_s`), or open the shutter longer.{unless}",
            )
        return (f"{told} Check that it fires, and that it reaches what the camera sees.{unless}",)
    if len({frozenset(plan.flashes[slot].lit) for slot in lit}) < LEAST_LIGHTS:
        return ()
    if any(len(plan.flashes[slot].lit) > 1 for slot in lit):
        return ()  # flashes of several colours that are exchanged are alike on what is grey
    size = float(np.sqrt((light**2).mean()))
    apart = [float(np.sqrt(((light[:, a] - light[:, b]) ** 2).mean())) for a, b in combinations(range(len(lit)), 2)]
    if max(apart) > ALIKE * size:
        return ()
    return (
        f"All lights give the same picture to within {100 * max(apart) / size:.1g} %: they seem to flash together, "
        "not one after the other. Check the wiring and that each light listens to its own line.",
    )


def _missed_share(plan: Plan, found: ClipFit, beat: Beat) -> float:
    """Return the share of the rows that see a light in no round of the clip, in the mean over lights: 0 where the
    shutter is open all the time, or flashes come at other places in the frame from round to round."""
    start_s = found.rows.frame_start_s
    as_found = replace(plan, camera=replace(plan.camera, exposure_s=beat.exposure_s))
    lasts_s = float(start_s[-1] - start_s[0]) + found.rows.period_s
    return never_shown(as_found, lasts_s=lasts_s, clock_offset_ppm=beat.clock.mean_offset_ppm())
