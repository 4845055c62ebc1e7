"""Judgements on exposure: how bright the subject is, what clips, and a mask that lies beside it."""

from collections.abc import Iterator, Mapping
from typing import Literal

import numpy as np

from psvideo.clip.transfer import records_scene
from psvideo.model.camera import Encoding
from psvideo.model.units import listed
from psvideo.report.judgement import NAMED, Grade, Judgement
from psvideo.report.observe.against_noise import AgainstNoise, usual
from psvideo.report.observe.levels import STOPS, TARGET_QUANTILE, Levels
from psvideo.report.observe.observed import Observed
from psvideo.report.observe.thinned import slips

DIM_STOPS, DARK_STOPS = -3.5, -6.0
"""A take whose brightest lamp's brightest parts stay so far below saturation is noisy, or lost in noise."""
BEST_STOPS = -0.5
NOISY, LOST, CLEAN = 15.0, 4.0, 30.0
"""How many times its noise a subject's light is, where a curve reaches far beyond it; CLEAN is what is advised. Of a
bust in LogC3 under five lights, 38 degrees from the axis, normals were off by 1.4 degrees at 25 times the noise, 3.1 at
12.5, and 13 at 2.6, where none was trusted."""
LIFTED = 2.58
"""Of an even surface, noise lifts the level below which TARGET_QUANTILE lies by so many standard deviations (Gauss)."""
Ceiling = Literal["saturation", "the sensor's saturation", "the largest code"]
"""What light is below: where it is not ``saturation`` itself, the curve records a scene far beyond its white, and light
is judged by its noise."""
MISPLACED = 16.0
"""A mask lies beside the subject where the picture is this many times brighter outside of it than within: a dark
subject before a white wall differs by a photograph's contrast, some 8 times."""
MOST_CLIPPED, LOST_CLIPPED = 0.02, 0.25
"""Shares of the subject. More than the first, clipped by one lamp, costs accuracy there, and where it leaves fewer
than three lamps, the normal; a take that loses more than the second so is not usable. (A bust under five lamps that
clip 6 to 32 % of it each: 5 % are left with fewer than three, and trusted normals are 0.9 degrees off. Under four
lamps, one of which clips 69 %: 14 % and 0.4 degrees. Under four that clip 30 to 63 % each: 83 %, and 92 % of the
normals are lost.)"""
LEAST_SPOILT = 0.005
"""Less is said as hardly anything."""
MORE_LIGHT = (
    "Check that the lights fire, that the lens is open, and that plan.toml's black_level and transfer are right."
)

FEWER_BITS = (
    "Where files hold fewer bits than they have room for (12 in 16), plan.toml's white_level says so instead, "
    "and `white_level` of photographs."
)


def ceiling_of(encoding: Encoding) -> Ceiling:
    """Return what light is below in footage that is coded so."""
    if not records_scene(encoding.transfer):
        return "saturation"
    return "the largest code" if encoding.white_level is None else "the sensor's saturation"


def exposure(observed: Observed, *, under: Ceiling = "saturation") -> Iterator[Judgement]:
    """Judge how bright the brightest lamp's plates are, and how much each lamp clips; ``under`` is what they are below,
    and by which they are judged."""
    levels = {light: observed.levels(light) for light in observed.lights if light in observed.counts}
    if not any(one.total for one in levels.values()):
        yield _too_small_a_mask() if _mask_slips(observed) else _unlit()
        return
    if observed.beyond_mask and min(observed.beyond_mask) > MISPLACED:
        yield _misplaced_mask(min(observed.beyond_mask))
    spoilt = [one.spoilt_share for one in observed.facts]
    clipped = list(_clipping(levels, float(np.median(spoilt)) if spoilt else 0.0))
    top_stops = max(one.stops(TARGET_QUANTILE) for one in levels.values())
    share = max(one.clipped_share for one in levels.values())
    noise = usual(observed.closely.noises) if under != "saturation" and observed.closely.noises else None
    without_noise = top_stops if noise is None else _without_noise(top_stops, noise)
    if without_noise < DIM_STOPS and noise is not None and noise.ratio < NOISY:
        yield _noisy(without_noise, noise, under)
    elif top_stops < DIM_STOPS and under == "saturation":
        yield _dark(top_stops)
    elif not clipped:
        yield _bright_enough(top_stops, share, under, noise)
    yield from clipped


def _unlit() -> Judgement:
    return Judgement(subject="exposure", grade="bad", found="Nothing in the picture is lit.", advice=MORE_LIGHT)


def _too_small_a_mask() -> Judgement:
    return Judgement(
        subject="mask",
        grade="doubtful",
        found="The mask is too small to be judged: this report looks at every fourth row and column, or fewer of "
        "large pictures, and none of its points lies in the mask.",
        advice="Look at the results themselves, or paint the mask wider.",
    )


def _misplaced_mask(times_as_bright: float) -> Judgement:
    return Judgement(
        subject="mask",
        grade="bad",
        found=f"The mask leaves out what is lit: beyond it the picture is {times_as_bright:.0f} times as bright as "
        "within.",
        advice="Paint white where normals are wanted, and black elsewhere; the mask may be inverted.",
    )


def _dark(top_stops: float) -> Judgement:
    return Judgement(
        subject="exposure",
        grade="bad" if top_stops < DARK_STOPS else "doubtful",
        found="The picture is dark: its brightest parts under the brightest light are "
        f"{-top_stops:.1f} stops below saturation, so noise is large.",
        advice=f"Open the aperture by about {_half(BEST_STOPS - top_stops)}, or flash longer or stronger. {FEWER_BITS}",
    )


def _without_noise(top_stops: float, noise: AgainstNoise) -> float:
    """Return where the brightest parts lie without the noise that lifts them."""
    return float(np.log2(max(2.0**top_stops - LIFTED * noise.sigma, 2.0**-STOPS)))


def _noisy(top_stops: float, noise: AgainstNoise, under: Ceiling) -> Judgement:
    """Say that a subject drowns in noise, where its distance from what is above it says little."""
    more, lost = min(noise.stops_to(CLEAN), BEST_STOPS - top_stops), noise.ratio < LOST
    return Judgement(
        subject="exposure",
        grade="bad" if lost else "doubtful",
        found=f"The picture is dark: under its brightest light the subject is {noise.ratio:.1f} times as bright as its "
        f"noise, and its brightest parts are {-top_stops:.1f} stops below {under}.",
        advice=f"Open the aperture by {'at least' if lost else 'about'} {_half(more)}, or flash longer or stronger. "
        + FEWER_BITS,
    )


def _bright_enough(top_stops: float, clipped_share: float, under: Ceiling, noise: AgainstNoise | None) -> Judgement:
    clear = "" if noise is None else f", the subject is {noise.ratio:.0f} times as bright as its noise"
    return Judgement(
        subject="exposure",
        grade="good",
        found=f"The brightest parts {_reach(top_stops, under)}{clear}, and at most {100 * clipped_share:.1f} % of the "
        "subject is clipped.",
    )


def _mask_slips(observed: Observed) -> bool:
    """Whether the first round's mask lies between the points that are looked at."""
    return observed.masks is not None and bool(observed.facts) and slips(observed.masks.at(observed.facts[0].number))


def _reach(top_stops: float, under: str) -> str:
    """Say how near to what is above them the brightest parts come."""
    return f"reach {under}" if top_stops > -0.05 else f"are {-top_stops:.1f} stops below {under}"


def _clipping(levels: dict[str, Levels], spoilt: float) -> Iterator[Judgement]:
    """Judge what lamps clip, by which share of the subject is ``spoilt`` by it."""
    over = {light: one for light, one in levels.items() if one.clipped_share > MOST_CLIPPED}
    grade: Grade = "bad" if spoilt > LOST_CLIPPED else "doubtful"
    left = _left(spoilt)
    if len(over) == len(levels) > 1:
        power = min(one.right_power() for one in over.values())
        shares = [one.clipped_share for one in over.values()]
        yield Judgement(
            subject="clipping",
            grade=grade,
            found=f"Every light clips: {100 * min(shares):.0f} to {100 * max(shares):.0f} % of the subject.{left}",
            advice=f"Close the aperture by about {_half(-np.log2(power))}, or lower all powers to "
            f"{_percent(power)} of what they are, and look again.",
        )
        return
    whole = [one for one in levels.values() if one.clipped_share <= 1 - TARGET_QUANTILE]
    if len(over) > NAMED:
        yield Judgement(
            subject="clipping",
            grade=grade,
            found=f"{len(over)} of {len(levels)} lights clip parts of the subject: "
            f"{first_of({light: one.clipped_share for light, one in over.items()})}.{left}",
            advice="Lower their powers (or durations) to about "
            f"{_percent(min(one.right_power(whole) for one in over.values()))} of what they are, or close the "
            "aperture.",
        )
        return
    for light, one in over.items():
        yield Judgement(
            subject="clipping",
            grade=grade,
            found=f"The flash of {light!r} is clipped in {100 * one.clipped_share:.0f} % of the subject.{left}",
            advice=f"Lower its power (or its duration) to about {_percent(one.right_power(whole))} of what it is.",
        )


def _left(spoilt: float) -> str:
    """Say of how much of the subject clipping leaves too few lights."""
    if spoilt < LEAST_SPOILT:
        return " Hardly anywhere does that leave fewer than three lights."
    return f" That leaves fewer than three lights on {100 * spoilt:.0f} % of it, where no normal is measured."


def first_of(shares: Mapping[str, float]) -> str:
    """Return the lights with the largest shares in per cent, and how many more there are.

    >>> first_of({"a": 0.2, "b": 0.5, "c": 0.1, "d": 0.3, "e": 0.05})
    "'b' 50 %, 'd' 30 %, 'a' 20 %, 'c' 10 % and 1 more"
    """
    largest = sorted(shares.items(), key=lambda named: -named[1])
    return listed([f"{light!r} {100 * share:.0f} %" for light, share in largest], NAMED)


def _half(stops: float) -> str:
    halves = max(round(2 * float(stops)), 1)
    return f"{halves / 2:g} {'stop' if halves <= 2 else 'stops'}"


def _percent(power: float) -> str:
    return f"{max(5 * int(20 * power), 5)} %"
