"""Flashes of several colours at once, and how a camera's channels tell them apart.

Channel c of flash k is ``sum_l mixing[k, l] * M[l, c] * albedo_c * max(0, n . l)``, with M the lights' spectra as the
channels see them: intensity times colour. Lights that stand in one place are one lamp (``led_lamps.py``).

Where lamps change their colours between flashes, every channel has a matrix of its own, (flash, lamp), whose inverse
gives each lamp's plate in that channel, whatever the surface's colour (De Decker et al., "Capturing multiple
illumination conditions using time and color multiplexing", CVPR 2009). One flash alone gives as many lights as there
are channels, where the surface's colour is known (Hernandez et al., "Non-rigid photometric stereo with colored lights",
ICCV 2007).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.intensity import lights_as_planned
from psvideo.model.irradiance.led_lamps import lamp_names, lamp_places
from psvideo.model.plan import Plan, PlannedFlash, mixing_matrix
from psvideo.model.rig import Light, Rig, Vector, intensities

CHANNELS = 3
MOST_COLOUR_CONDITION = 20.0
"""Colours that are told apart by less raise noise more than lights that nearly lie in one plane may."""
WHITE: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class OneFlash:
    """What one flash shows by itself: ``lights`` are the shown lights that shine in it, ``inverse`` (light, channel)
    gives each from the channels, once these are divided by the surface's colour."""

    lights: tuple[int, ...]
    inverse: Doubles


@dataclass(frozen=True, kw_only=True, eq=False)
class Unmixing:
    """How flashes of several colours are separated into plates under white light of intensity 1.

    Attributes
    ----------
    shown
        The plan as results show it: its lights are lamps, where colours are exchanged between flashes.
    rig
        The shown lights, white, of intensity 1.
    shares
        (light, lit slot, channel): of a round's flashes, what gives a lamp's plate in every channel. None where colours
        are not exchanged.
    alone
        What every lit slot shows by itself; of exchanged colours empty where a flash alone does not show every lamp.
    surface_colour
        The subject's colour, where it is given.
    condition
        Of the matrices that are inverted, the worst; 1 is best.
    """

    shown: Plan
    rig: Rig
    shares: Doubles | None
    alone: tuple[OneFlash, ...]
    surface_colour: Vector | None
    condition: float


def unmixing_of(plan: Plan, rig: Rig, *, channels: int) -> Unmixing | None:
    """Return how a plan's flashes are separated, None where the rig knows of no colours, or where every flash is one
    light and every lamp, too: they are apart, and solvers count their channels by what they send.

    Raises PsvideoError where some lights have a colour and others none, the pictures are grey, or the colours cannot be
    separated: it names the lights and the condition number.
    """
    chosen = rig.select(plan.lights)
    if all(light.colour is None for light in chosen):
        return None
    _check_colours(chosen, channels)
    lights = lights_as_planned(rig, plan)
    if len(lamp_places(lights)) == len(lights) and all(len(plan.flashes[slot].lit) < 2 for slot in plan.lit_slots):
        return None
    seen = mixing_matrix(plan)[:, :, None] * intensities(lights, CHANNELS)  # (slot, light, channel)
    lamps = lamp_places(lights)
    by_lamp = np.stack([seen[:, list(lamp)].sum(axis=1) for lamp in lamps], axis=1)
    condition = max(condition_of(by_lamp[..., channel]) for channel in range(CHANNELS))
    if condition <= MOST_COLOUR_CONDITION:
        return _exchanged(plan, rig, lamps, by_lamp, condition)
    return _one_by_one(plan, rig, seen, condition)


def condition_of(matrix: Doubles) -> float:
    """Return by how much a matrix's inverse raises noise at most: 1 at best, infinite where columns cannot be told
    apart."""
    values = np.linalg.svd(matrix, compute_uv=False)
    if len(matrix) < matrix.shape[1] or values[-1] <= 1e-12 * values[0]:
        return float("inf")
    return float(values[0] / values[-1])


def colour_condition(seen: Doubles) -> float:
    """Return the condition number of lights' colours, (light, channel), whatever their strengths."""
    length = np.linalg.norm(seen, axis=1, keepdims=True)
    return condition_of((seen / np.maximum(length, 1e-300)).T)


def most_alike(seen: Doubles) -> tuple[int, int]:
    """Return which two lights' colours, (light, channel), are most alike."""
    unit = seen / np.maximum(np.linalg.norm(seen, axis=1, keepdims=True), 1e-300)
    alike = unit @ unit.T - 2 * np.eye(len(seen))
    first, second = np.unravel_index(int(alike.argmax()), alike.shape)
    return min(int(first), int(second)), max(int(first), int(second))


def _check_colours(lights: Sequence[Light], channels: int) -> None:
    plain = [light.name for light in lights if light.colour is None]
    if plain:
        raise PsvideoError(
            f"The rig gives colours to some lights, and none to {', '.join(plain)}. Measure all of them: psvideo "
            "calibrate colours; a white light's colour is [1, 1, 1]."
        )
    if channels != CHANNELS:
        raise PsvideoError(
            "The rig's lights have colours, and the pictures are grey: a monochrome camera cannot tell colours apart. "
            "Flash one light at a time, and take `colour` out of the rig; or film in colour."
        )


def _exchanged(plan: Plan, rig: Rig, lamps: Sequence[tuple[int, ...]], by_lamp: Doubles, condition: float) -> Unmixing:
    names = lamp_names(plan.lights, lamps)
    home = {plan.lights[light]: name for lamp, name in zip(lamps, names, strict=True) for light in lamp}
    shares = np.stack([np.linalg.pinv(by_lamp[..., channel]) for channel in range(CHANNELS)], axis=-1)
    alone = [_one_flash(by_lamp[slot]) for slot in range(len(by_lamp))]
    return Unmixing(
        shown=replace(plan, flashes=tuple(_renamed(flash, home) for flash in plan.flashes)),
        rig=_white(rig, {name: plan.lights[lamp[0]] for lamp, name in zip(lamps, names, strict=True)}),
        shares=shares,
        alone=tuple(one for one in alone if one is not None) if all(_shows_all(one, lamps) for one in alone) else (),
        surface_colour=rig.surface_colour,
        condition=condition,
    )


def _shows_all(flash: OneFlash | None, lamps: Sequence[tuple[int, ...]]) -> bool:
    return flash is not None and len(flash.lights) == len(lamps)


def _one_by_one(plan: Plan, rig: Rig, seen: Doubles, condition: float) -> Unmixing:
    alone = []
    for row, slot in enumerate(plan.lit_slots):
        one = _one_flash(seen[row])
        if one is None:
            raise _inseparable(plan, slot, seen[row], condition)
        alone.append(one)
    return Unmixing(
        shown=plan,
        rig=_white(rig, {name: name for name in plan.lights}),
        shares=None,
        alone=tuple(alone),
        surface_colour=rig.surface_colour,
        condition=max(colour_condition(seen[row][list(one.lights)]) for row, one in enumerate(alone)),
    )


def _one_flash(seen: Doubles) -> OneFlash | None:
    """Return what a flash of these lights (light, channel) shows by itself, None where that is too little."""
    lit = np.flatnonzero(seen.any(axis=1))
    if len(lit) > CHANNELS or colour_condition(seen[lit]) > MOST_COLOUR_CONDITION:
        return None
    return OneFlash(lights=tuple(int(place) for place in lit), inverse=np.linalg.pinv(seen[lit].T).astype(np.float64))


def _inseparable(plan: Plan, slot: int, seen: Doubles, between: float) -> PsvideoError:
    lit = np.flatnonzero(seen.any(axis=1))
    names = [plan.lights[place] for place in lit]
    if len(lit) > CHANNELS:
        what = f"{len(names)} lights of {CHANNELS} colours at most can be told apart in one flash"
    else:
        one, other = most_alike(seen[lit])
        what = (
            f"the condition number of their colours is {colour_condition(seen[lit]):.3g} (at most "
            f"{MOST_COLOUR_CONDITION:g} is accepted), and those of {names[one]} and {names[other]} are most alike"
        )
    return PsvideoError(
        f"Flash {slot + 1} of the plan lights {', '.join(names)} together, and their colours cannot be separated: "
        f"{what}. Nor do lamps exchange their colours between the flashes of a round so that all can be told apart "
        f"(condition number {between:.3g}). Take LEDs of other colours (red, green and blue), flash fewer together, or "
        "measure them again with psvideo calibrate colours."
    )


def _renamed(flash: PlannedFlash, home: dict[str, str]) -> PlannedFlash:
    powers: dict[str, float] = {}
    for name in flash.lit:
        powers[home[name]] = max(powers.get(home[name], 0.0), flash.lights[name])
    return replace(flash, lights=powers)


def _white(rig: Rig, source: dict[str, str]) -> Rig:
    """Return the rig with lights of these names, each where another stands, white and of intensity 1."""
    lights = [
        replace(rig.select([led])[0], name=name, intensity=(1.0,), colour=None, reference_duration_s=None)
        for name, led in source.items()
    ]
    return replace(rig, lights=tuple(lights))
