"""The colours of LEDs: what the camera's channels see of each on a white card, one LED flashed at a time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.white_target import Target, on_target, parts_of
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.colours import (
    CHANNELS,
    MOST_COLOUR_CONDITION,
    colour_condition,
    most_alike,
    unmixing_of,
)
from psvideo.model.irradiance.ground import Ground
from psvideo.model.irradiance.intensity import with_measured
from psvideo.model.irradiance.led_lamps import lamps_of
from psvideo.model.plan import Plan
from psvideo.model.rig import Light, Rig

LEAST_SHARE = 0.98
"""Of the card that may not be clipped: where the brightest channel is cut off, the others seem to see more."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LedColours:
    """What was measured: ``seen`` (light, channel) is intensity times colour, ``error`` its standard error in shares of
    the light's brightest channel; ``condition`` belongs to ``together``, those of the lights that flash at once whose
    colours are the hardest to tell apart; where it is not ``known`` which flash at once, of all that might.
    ``flashes_s`` is for how long each light shone, where that is known.
    """

    names: tuple[str, ...]
    seen: Doubles
    error: Doubles
    together: tuple[str, ...]
    condition: float
    known: bool
    flashes_s: tuple[float, ...] | None = None


def measure_led_colours(
    pictures: LightPictures, rig: Rig, target: Target, *, ground: Ground | None = None, plan: Plan | None = None
) -> LedColours:
    """Measure the matrix of lights and channels on a white card. ``plan`` is that of the shoot, where it is known: it
    says which lights flash together; else those that stand in one place do; else nothing is known of that.

    Raises PsvideoError where the pictures are grey, the card clips or is black under a light, or the colours of lights
    that flash together cannot be separated.
    """
    if pictures.images.ndim == 3:
        raise PsvideoError(
            "The pictures are grey: a monochrome camera cannot tell colours apart. Film in colour, or flash one light "
            "at a time, with lights of any colour."
        )
    lights = rig.select(pictures.names)
    found = [_measured(light, n, pictures, target, ground) for n, light in enumerate(lights)]
    seen, error = (np.stack([one[part] for one in found]) for part in (0, 1))
    groups, known = _together(lights, seen, plan)
    conditions = [colour_condition(seen[[pictures.names.index(name) for name in group]]) for group in groups]
    worst = int(np.argmax(conditions))
    colours = LedColours(
        names=pictures.names,
        seen=seen,
        error=error,
        together=groups[worst],
        condition=conditions[worst],
        known=known,
        flashes_s=pictures.flashes_s,
    )
    if plan is not None and known and _flashed_together(plan):
        unmixing_of(plan, with_colours(rig, colours), channels=CHANNELS)
    elif known and colours.condition > MOST_COLOUR_CONDITION:
        raise _inseparable(colours)
    return colours


def with_colours(rig: Rig, found: LedColours) -> Rig:
    """Return the rig with the measured colours, the brightest channel 1, and the intensity there."""
    flashes_s = found.flashes_s or [None] * len(found.names)
    measured = {
        name: partial(with_measured, seen=seen, flash_s=flash_s, coloured=True)
        for name, seen, flash_s in zip(found.names, found.seen.tolist(), flashes_s, strict=True)
    }
    return replace(rig, lights=tuple(measured[one.name](one) if one.name in measured else one for one in rig.lights))


def _measured(
    light: Light, n: int, pictures: LightPictures, target: Target, ground: Ground | None
) -> tuple[Doubles, Doubles]:
    flat, usable = on_target(light, n, pictures, target, ground, least_share=LEAST_SHARE)
    level = np.median(flat[usable], axis=0)
    if level.max() <= 0:
        raise PsvideoError(f"Light {light.name!r}: the white card is black under it. Check that it was flashed.")
    medians = [np.median(flat[part][usable[part]], axis=0) for part in parts_of(flat.shape) if usable[part].any()]
    shares = np.array([one / max(one.max(), 1e-12) for one in medians])
    return np.maximum(level, 0.0), shares.std(axis=0) / np.sqrt(max(len(medians) - 1, 1))


def _together(lights: Sequence[Light], seen: Doubles, plan: Plan | None) -> tuple[tuple[tuple[str, ...], ...], bool]:
    """Return the lights whose colours must differ, in groups, and True: those of each flash of the plan, else of each
    lamp. Where neither is known, three lights or fewer, or of more the two that are most alike, and False."""
    names = tuple(light.name for light in lights)
    flashed = () if plan is None else _flashed_together(plan)
    lamps = tuple(lamp for lamp in lamps_of(lights) if len(lamp) > 1)
    if flashed or lamps:
        return flashed or lamps, True
    alike = names if len(names) <= CHANNELS else tuple(names[place] for place in most_alike(seen))
    return (alike,), False


def _flashed_together(plan: Plan) -> tuple[tuple[str, ...], ...]:
    """Return the lights of each flash in which several shine; none of a plan that flashes one light at a time."""
    return tuple(tuple(flash.lights) for flash in plan.flashes if len(flash.lights) > 1)


def _inseparable(found: LedColours) -> PsvideoError:
    seen = found.seen[[found.names.index(name) for name in found.together]]
    one, other = most_alike(seen)
    return PsvideoError(
        f"The colours of {', '.join(found.together)} cannot be separated: their condition number is "
        f"{found.condition:.3g} (at most {MOST_COLOUR_CONDITION:g} is accepted), and {found.together[one]} and "
        f"{found.together[other]} are most alike. Take LEDs of other colours (red, green and blue are told apart with "
        "about 1.5), check that each picture shows one LED alone, and that the pictures' curve is named by `transfer`."
    )
