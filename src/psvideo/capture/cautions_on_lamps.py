"""Cautions on lamps: how many and how bright they are, what they bear, and whom their flashes harm."""

import math
from collections.abc import Iterator, Sequence

from psvideo.capture.caution import Caution, warning
from psvideo.capture.request import Limits
from psvideo.model.cost.shoot_figures import SEIZURE_HZ, LightFigures, ShootFigures
from psvideo.model.plan import Plan
from psvideo.model.rig import LEAST_LIGHTS
from psvideo.model.units import no_more, show_seconds

MOST_STOPS = 6.0
"""A flash of a 64th of the exposure needs 64 times the light of a lamp that would do if it were left on."""
STOPS_ROUNDED = 1e-3
"""A wish is kept within this: the duration that is advised has four figures."""
LOW_HZ, HIGH_HZ = SEIZURE_HZ
HARMFUL = f"between {LOW_HZ:g} and {HIGH_HZ:g} Hz"
CARE = "Warn everybody on the set, let no photosensitive person stay, and keep eyes off the lights."


def about_the_lights(plan: Plan) -> Iterator[Caution]:
    """Warn of fewer lights than normals need."""
    names = plan.lights
    if len(names) < LEAST_LIGHTS:
        yield warning(
            "lights",
            f"Normals need three lights that do not lie in one plane with the subject, and the plan has {len(names)} "
            f"({', '.join(names) or 'none'}): plates and relit views come, normals do not. Add lights.",
        )


def about_the_light_of_a_flash(plan: Plan, figures: ShootFigures, limits: Limits) -> Iterator[Caution]:
    """Warn of flashes that give less light than the user wishes, or so little that noise will show."""
    worst = max(figures.slots, key=lambda slot: slot.stops or 0.0)
    stops, wished = worst.stops or 0.0, limits.max_stops
    most = MOST_STOPS if wished is None else min(MOST_STOPS, wished)
    if stops <= most + STOPS_ROUNDED:
        return
    enough_s = worst.duration_s * 2 ** (stops - most)
    is_wish = wished is not None and stops > wished + STOPS_ROUNDED
    why = (
        f"over the limit of {wished:g}"
        if is_wish
        else "noise will show in the normals unless the lamps are made for it"
    )
    advice = "or allow more stops" if is_wish else "bring the lamps closer, or film slower"
    if enough_s <= min(plan.camera.exposure_s, _longest_s(limits)):
        advice = f"flash for {show_seconds(enough_s)} and more, {advice}"
    yield warning(
        "dim",
        f"A flash of {show_seconds(worst.duration_s)} gives {worst.light_share:.2%} of the light of the same lamp left "
        f"on, {stops:.{2 if is_wish else 1}f} stops less: {why}. {advice.removeprefix('or ').capitalize()}.",
    )


def about_blur(figures: ShootFigures, limits: Limits) -> Iterator[Caution]:
    """Warn of flashes during which the subject moves farther than the user wishes."""
    worst = max(figures.slots, key=lambda slot: 0.0 if slot.is_dark else slot.blur_px or 0.0)
    if limits.max_blur_px is None or (worst.blur_px or 0.0) <= limits.max_blur_px * (1 + 1e-9):
        return
    yield warning(
        "blur",
        f"A flash of {show_seconds(worst.duration_s)} blurs {worst.blur_px:.3g} px at {limits.speed_px_s:g} px/s, over "
        f"the limit of {limits.max_blur_px:g} px. Flash for at most "
        f"{show_seconds(no_more(_longest_s(limits)))}, or slow the subject down.",
    )


def _longest_s(limits: Limits) -> float:
    """Return how long a flash may be for sharpness and the LEDs' longest pulse."""
    longest_s = math.inf if limits.max_pulse_s is None else limits.max_pulse_s
    if limits.max_blur_px is None or not limits.speed_px_s:
        return longest_s
    return min(longest_s, limits.max_blur_px / limits.speed_px_s)


def about_seizures(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    """Warn of rates at which flashing light can harm photosensitive people."""
    yield from _of_the_whole_scene(figures)
    yield from _of_single_lights(figures)
    yield from _of_dark_slots(plan, figures)


def _of_the_whole_scene(figures: ShootFigures) -> Iterator[Caution]:
    if LOW_HZ <= figures.flash_rate_hz <= HIGH_HZ:
        yield warning(
            "flicker",
            f"The whole scene flickers at {figures.flash_rate_hz:.1f} Hz, {HARMFUL}. {CARE} A frame rate of over "
            f"{HIGH_HZ:g} fps helps.",
        )


def _of_single_lights(figures: ShootFigures) -> Iterator[Caution]:
    slow = [light for light in figures.lights if LOW_HZ <= light.rate_hz <= HIGH_HZ]
    if slow:
        names = "Each light" if len(slow) == len(figures.lights) else ", ".join(light.name for light in slow)
        rates = sorted({f"{light.rate_hz:.1f}" for light in slow})
        yield warning(
            "flicker",
            f"{names} by itself flashes at {' to '.join(rates[:: max(len(rates) - 1, 1)])} Hz, {HARMFUL}: a person who "
            "sees one light more than the others sees that, though the scene as a whole is lit "
            f"{figures.flash_rate_hz:.1f} times a second. {CARE}",
        )


def _of_dark_slots(plan: Plan, figures: ShootFigures) -> Iterator[Caution]:
    often = f"Dark slots come {figures.dark_slot_rate_hz:.1f} times a second"
    if LOW_HZ <= figures.dark_slot_rate_hz <= HIGH_HZ:
        rarer = (
            "A larger `dark_every` makes them rarer, up to what a board holds; two a second are enough, and `marker` "
            "long needs none."
        )
        if plan.dark_code:
            rarer = "A code needs that many: where one camera films, `marker` dark makes do with two a second."
        yield warning("flicker", f"{often}, a flicker of the whole scene {HARMFUL}. {CARE} {rarer}")
    elif figures.pattern_hz is not None and figures.pattern_hz <= HIGH_HZ:
        yield warning(
            "flicker",
            f"{often}, but unevenly: their pattern repeats {1 / figures.cycle_s:.3g} times a second, and the whole "
            f"scene flickers at multiples of that, of which {figures.pattern_hz:.1f} Hz and more lie {HARMFUL}. {CARE}",
        )


def about_the_leds(plan: Plan, figures: ShootFigures, limits: Limits) -> Iterator[Caution]:
    """Warn of pulses that are longer, or come more often, than the LEDs bear."""
    too_long: dict[float, list[str]] = {}
    too_often: dict[float, list[LightFigures]] = {}
    for light in figures.lights:
        if limits.max_pulse_s is not None and light.longest_pulse_s > limits.max_pulse_s * (1 + 1e-9):
            too_long.setdefault(light.longest_pulse_s, []).append(light.name)
        if limits.max_duty is not None and light.duty > limits.max_duty * (1 + 1e-9):
            too_often.setdefault(light.duty, []).append(light)
    for pulse_s, names in too_long.items():
        limit = show_seconds(no_more(limits.max_pulse_s or 0.0))
        text = f"{_and(names)}: flashes of {show_seconds(pulse_s)}, over the limit of {limit}. Give at most that."
        yield warning("pulse", text)
    for duty, lights in too_often.items():
        limit_share = limits.max_duty or 1.0
        fits_s = _flash_for_duty_s(plan, lights[0], limit_share)
        yield warning(
            "duty",
            f"{_and([light.name for light in lights])}: on for {duty:.2%} of the time, over the limit of "
            f"{limit_share:.2%}. "
            f"Flashes of {show_seconds(no_more(fits_s))} for every light would fit; more lights in the round help too.",
        )


def _flash_for_duty_s(plan: Plan, light: LightFigures, duty: float) -> float:
    """Return the flash at which the light's duty is met if all lights take it: in rolling plans the dark times stay, in
    others the time from flash to flash. Dark slots as long as a flash may become shorter with it."""
    slots = plan.cycle_slots
    own = sum(light.name in plan.flashes[slot].lit for slot in slots)
    if plan.mode != "rolling":
        return duty * len(slots) * plan.camera.frame_period_s * (2 if plan.mode == "half-rate" else 1) / own
    dark_slots_s = [plan.flashes[slot].duration_s for slot in slots if plan.flashes[slot].is_dark]
    lit, dark_s = len(slots) - len(dark_slots_s), len(slots) * plan.dark_s
    ends = ((lit, dark_s + sum(dark_slots_s)), (len(slots), dark_s))
    fits = [duty * stays_s / (own - duty * grows) for grows, stays_s in ends if own > duty * grows]
    return min(*fits, light.longest_pulse_s) if fits else light.longest_pulse_s


def _and(names: Sequence[str]) -> str:
    return " and ".join((", ".join(names[:-1]), names[-1])) if len(names) > 1 else names[0]
