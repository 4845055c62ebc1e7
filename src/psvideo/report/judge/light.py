"""Judgements on light: exposure, clipping, lamps that fail or flicker, and what else lit the set."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.model.marker import NOT_FIRING
from psvideo.report.judgement import Judgement
from psvideo.report.observe.levels import TARGET_QUANTILE, Levels
from psvideo.report.observe.observed import InstantFacts, Observed
from psvideo.solve.normals.solving import ROBUST_FROM_LIGHTS

DIM_STOPS, DARK_STOPS = -3.5, -6.0
"""A take whose brightest lamp's brightest parts stay so far below saturation is noisy, or lost in noise."""
BEST_STOPS = -0.5
MISPLACED = 16.0
"""A mask beyond which the picture is so many times brighter than within lies beside the subject: a dark subject before
a white wall differs by a photograph's contrast, some 8 times."""
MOST_CLIPPED, LOST_CLIPPED = 0.02, 0.1
"""Shares of the subject that one lamp may clip: more costs normals there, and with three lamps all of them."""
SPARE_CLIPPED = 0.25
"""With more lamps than three the others still give the normal; where enough for robust solving clip less, always."""
MEASURED, FAINT_AMBIENT = 0.8, 0.02
"""Without a dark slot: the share of the picture that must stand still, unless there is less ambient light than this."""
MOST_AMBIENT, LOST_AMBIENT = 0.1, 0.5
IN_SHADOW = 0.03
"""Of a lamp's light, what may be left in attached shadow: up to 0.016 on photographs in a dark room; ambient light of
5 % leaves 0.02 to 0.06, and 10 % 0.03 to 0.1."""
NOTICED, MOST_SWING = 0.05, 0.1
"""Ambient light of more than the first share that changes from dark slot to dark slot by more than the second."""
WEAK_LIGHT = 1 / 8
"""Of the brightest lamp's light."""
LEAST_LIGHTS = 3
"""Where so many others fire, one that does not is missed by what they do not reach; shadow and it look the same."""
CHECKED_FROM = 5
"""With fewer lights than these nothing shows that one of them gives less than the rig says, and all normals lean."""
MISSED = 0.5
"""A flash that gives less than this share of its lamp's usual light did not fire as it should."""
UNSTEADY = 0.02
NAMED = 4


def exposure(observed: Observed) -> Iterator[Judgement]:
    """Judge how bright the brightest lamp's plates are, and how much each lamp clips."""
    levels = {light: observed.levels(light) for light in observed.lights if light in observed.counts}
    if not any(one.total for one in levels.values()):
        yield Judgement(subject="exposure", grade="bad", found="Nothing in the picture is lit.", advice=MORE_LIGHT)
        return
    if observed.beyond_mask and min(observed.beyond_mask) > MISPLACED:
        yield Judgement(
            subject="mask",
            grade="bad",
            found=f"The mask leaves out what is lit: beyond it the picture is {min(observed.beyond_mask):.0f} times as "
            "bright as within.",
            advice="Paint white where normals are wanted, and black elsewhere; the mask may be inverted.",
        )
    clipped = list(_clipping(levels))
    top = max(one.stops(TARGET_QUANTILE) for one in levels.values())
    worst = max(one.clipped_share for one in levels.values())
    if top < DIM_STOPS:
        yield Judgement(
            subject="exposure",
            grade="bad" if top < DARK_STOPS else "doubtful",
            found=f"The picture is dark: its brightest parts under the brightest light are {-top:.1f} stops below "
            "saturation, so noise is large.",
            advice=f"Open the aperture by about {_half(BEST_STOPS - top)}, or flash longer or stronger.",
        )
    elif not clipped:
        yield Judgement(
            subject="exposure",
            grade="good",
            found=f"The brightest parts are {-top:.1f} stops below saturation, and at most {100 * worst:.1f} % of the "
            "subject is clipped.",
        )
    yield from clipped


MORE_LIGHT = (
    "Check that the lights fire, that the lens is open, and that plan.toml's black_level and transfer are right."
)


def _clipping(levels: dict[str, Levels]) -> Iterator[Judgement]:
    over = {light: one for light, one in levels.items() if one.clipped_share > MOST_CLIPPED}
    lost = SPARE_CLIPPED if len(levels) > LEAST_LIGHTS else LOST_CLIPPED
    few = sum(one.clipped_share <= lost for one in levels.values()) < ROBUST_FROM_LIGHTS
    if len(over) == len(levels) > 1:
        power = min(one.right_power() for one in over.values())
        shares = [one.clipped_share for one in over.values()]
        yield Judgement(
            subject="clipping",
            grade="bad" if max(shares) > lost else "doubtful",
            found=f"Every light clips: {100 * min(shares):.0f} to {100 * max(shares):.0f} % of the subject.",
            advice=f"Close the aperture by about {_half(-np.log2(power))}, or lower all powers to "
            f"{_percent(power)}, and look again.",
        )
        return
    whole = [one for one in levels.values() if one.clipped_share <= 1 - TARGET_QUANTILE]
    if len(over) > NAMED:
        yield Judgement(
            subject="clipping",
            grade="bad" if few and max(one.clipped_share for one in over.values()) > lost else "doubtful",
            found=f"{len(over)} of {len(levels)} lights clip: "
            f"{first_of({light: one.clipped_share for light, one in over.items()})} of the subject.",
            advice="Lower their powers (or durations) to about "
            f"{_percent(min(one.right_power(whole) for one in over.values()))}, or close the aperture.",
        )
        return
    for light, one in over.items():
        yield Judgement(
            subject="clipping",
            grade="bad" if few and one.clipped_share > lost else "doubtful",
            found=f"The flash of {light!r} is clipped in {100 * one.clipped_share:.0f} % of the subject.",
            advice=f"Lower its power (or its duration) to about {_percent(one.right_power(whole))}.",
        )


def first_of(shares: Mapping[str, float]) -> str:
    """Return the lights with the largest shares in per cent, and how many more there are.

    >>> first_of({"a": 0.2, "b": 0.5, "c": 0.1, "d": 0.3, "e": 0.05})
    "'b' 50 %, 'd' 30 %, 'a' 20 %, 'c' 10 % and 1 more"
    """
    largest = sorted(shares.items(), key=lambda named: -named[1])
    more = f" and {len(largest) - NAMED} more" if len(largest) > NAMED else ""
    return ", ".join(f"{light!r} {100 * share:.0f} %" for light, share in largest[:NAMED]) + more


def _half(stops: float) -> str:
    halves = max(round(2 * float(stops)), 1)
    return f"{halves / 2:g} {'stop' if halves <= 2 else 'stops'}"


def _percent(power: float) -> str:
    return f"{max(5 * int(20 * power), 5)} %"


def lamps(observed: Observed, *, timed: bool = True) -> Iterator[Judgement]:
    """Judge whether every lamp gives light, always, and steadily; where flash times are not known (``timed``), only
    whether it does at all."""
    facts = [one for one in observed.facts if len(one.levels) == len(observed.lights)]
    if not facts:
        return
    level = np.array([one.levels for one in facts])
    usual = np.median(level, axis=0)
    relative = usual / max(float(usual.max()), 1e-12)
    known = _shown(observed)
    named = [light for light, is_known in zip(observed.lights, known, strict=True) if is_known]
    said = list(_weak(named, relative[known], _brightest(observed)[known], _claimed(observed)[known]))
    alive = observed.firing
    whole = np.array([one.unseen_share == 0 for one in facts])
    if timed and whole.any():
        shown = [one for one in facts if one.unseen_share == 0]
        said += _missed(observed.lights, shown, level[whole], usual, alive)
        said += _unsteady(observed.lights, shown, level[whole], usual, alive)
    yield from said
    if not said:
        spread = -np.log2(max(relative[known].min(), 1e-9))
        yield Judgement(
            subject="lights",
            grade="good",
            found=f"All {len(observed.lights)} lights fire{' in every round' if timed else ''}; the weakest gives "
            f"{spread:.1f} stops less than the strongest.",
        )


def _brightest(observed: Observed) -> NDArray[np.float64]:
    """Return the light in every lamp's brightest parts, as a share of the strongest lamp's."""
    tops = np.array([2.0 ** observed.levels(light).stops(TARGET_QUANTILE) for light in observed.lights])
    return np.asarray(tops / tops.max())


def _claimed(observed: Observed) -> NDArray[np.float64]:
    """Return what the rig says that every lamp gives, as a share of the strongest; zeros where that is not known, or
    where there are enough others to find out."""
    if observed.points is None or len(observed.lights) >= CHECKED_FROM:
        return np.zeros(len(observed.lights))
    strengths = np.linalg.norm(observed.points.vectors, axis=2).mean(axis=0)
    return np.asarray(strengths / max(float(strengths.max()), 1e-12))


def _shown(observed: Observed) -> NDArray[np.bool_]:
    """Return of which lights any of the subject was seen, (light,): of others nothing can be said."""
    counted = np.array([observed.levels(light).total > 0 for light in observed.lights], np.bool_)
    return counted | (not counted.any())


def _weak(
    lights: Sequence[str],
    relative: NDArray[np.float64],
    brightest: NDArray[np.float64],
    claimed: NDArray[np.float64],
) -> Iterator[Judgement]:
    """Say which lamps give little. One that comes from the side gives the subject little, and its parts enough."""
    dim = (relative < WEAK_LIGHT) & (brightest < WEAK_LIGHT)
    weak = [light for light, share, is_dim in zip(lights, relative, dim, strict=True) if is_dim and share >= NOT_FIRING]
    if len(weak) > NAMED:
        yield Judgement(
            subject="lights",
            grade="doubtful",
            found=f"{len(weak)} of {len(lights)} lights are weak: less than {100 * WEAK_LIGHT:.0f} % of the strongest "
            f"({', '.join(map(repr, weak[:NAMED]))} and {len(weak) - NAMED} more).",
            advice="Raise their power or their flash duration, or move them nearer.",
        )
    if relative.max() <= 0:  # nothing is lit, which is said once
        return
    for light, share, is_dim, says in zip(lights, relative, dim, claimed, strict=True):
        if share < NOT_FIRING:
            others = int((relative >= NOT_FIRING).sum())
            enough = others >= LEAST_LIGHTS
            yield Judgement(
                subject="lights",
                grade="doubtful" if enough else "bad",
                found=f"The light {light!r} gives no light ({100 * max(share, 0):.1f} % of the strongest)"
                + (f"; normals come from the other {others}." if enough else "."),
                advice="Check its cable, driver and line, and that the plan names it as the board does.",
            )
        elif is_dim and says >= WEAK_LIGHT:
            yield Judgement(
                subject="lights",
                grade="bad",
                found=f"The light {light!r} is weak: {100 * share:.0f} % of the strongest, where the rig says "
                f"{100 * says:.0f} %. With {len(lights)} lights all normals lean away from it.",
                advice="Raise its power, or measure the lights' strengths again.",
            )
        elif is_dim and len(weak) <= NAMED:
            yield Judgement(
                subject="lights",
                grade="doubtful",
                found=f"The light {light!r} is weak: {100 * share:.0f} % of the strongest.",
                advice="Raise its power or its flash duration, or move it nearer.",
            )


def _missed(
    lights: Sequence[str],
    facts: Sequence[InstantFacts],
    level: NDArray[np.float64],
    usual: NDArray[np.float64],
    alive: NDArray[np.bool_],
) -> Iterator[Judgement]:
    """Say which lamps failed in which rounds; where nothing is lit under any of them, no single one is blamed."""
    missed = level < MISSED * usual
    empty = missed[:, alive].all(axis=1) & (alive.sum() > 1)
    if empty.any():
        named = _numbers([one.number for one, none in zip(facts, empty, strict=True) if none])
        yield Judgement(
            subject="lights",
            grade="doubtful",
            found=f"Nothing is lit in {int(empty.sum())} of {len(facts)} rounds ({named}): the subject left the "
            "picture, or no light fired. Their results are empty.",
            advice="Leave these frames out, or look at the strobe's log.",
        )
    for k, light in enumerate(lights):
        numbers = [one.number for one, gone in zip(facts, missed[:, k] & ~empty, strict=True) if gone]
        if alive[k] and numbers:
            yield Judgement(
                subject="lights",
                grade="bad" if len(numbers) > 0.1 * len(facts) else "doubtful",
                found=f"The light {light!r} failed or was covered in {len(numbers)} of {len(facts)} rounds "
                f"({_numbers(numbers)}).",
                advice="Check its driver and supply; these rounds' normals are wrong.",
            )


def _numbers(numbers: Sequence[int]) -> str:
    more = f" and {len(numbers) - NAMED} more" if len(numbers) > NAMED else ""
    return ", ".join(map(str, numbers[:NAMED])) + more


def _unsteady(
    lights: Sequence[str],
    facts: Sequence[InstantFacts],
    level: NDArray[np.float64],
    usual: NDArray[np.float64],
    alive: NDArray[np.bool_],
) -> Iterator[Judgement]:
    """Say which lamps change from round to round while nothing moves."""
    still = np.array([not one.moving_share for one in facts[1:]], bool)
    steps = np.abs(np.diff(level, axis=0))[still]
    if len(steps) < 4:
        return
    swing = np.median(steps, axis=0) / np.maximum(usual, 1e-9)
    for light, share, lives in zip(lights, swing, alive, strict=True):
        if lives and share > UNSTEADY:
            yield Judgement(
                subject="lights",
                grade="doubtful",
                found=f"The light {light!r} flickers: its level changes by {100 * share:.1f} % from round to round.",
                advice="Check its driver and supply, and that no dimmer (PWM) is in its line.",
            )


def _without_dark(observed: Observed) -> Judgement:
    """Judge ambient light by what is left in attached shadow, where no dark slot shows it."""
    left = float(np.median(observed.in_shadow)) if observed.in_shadow else 0.0
    if left > IN_SHADOW:
        return Judgement(
            subject="ambient",
            grade="doubtful",
            found=f"Where a light cannot reach, {100 * left:.0f} % of what it gives elsewhere is left: ambient light "
            "that nothing took off, or light by way of other surfaces. Normals lean towards the camera for it.",
            advice="Add a dark slot to the plan, or a picture with all lights off; darken the room, and keep bright "
            "things away from the subject.",
        )
    return Judgement(
        subject="ambient",
        grade="unknown",
        found="Ambient light is not known: the plan has no dark slot, or none was complete."
        + (" Where a light cannot reach, it is dark." if observed.in_shadow else ""),
    )


def ambient(observed: Observed) -> Judgement:
    """Judge how much of what is recorded is light that is always there."""
    shares = [one.ambient for one in observed.facts if one.ambient is not None]
    swing = float(np.std(shares)) / max(float(np.mean(shares)), 1e-9) if len(shares) > 2 else 0.0
    if not shares:
        return _without_dark(observed)
    share = float(np.median(shares))
    found = f"Ambient light is {100 * share:.0f} % of the signal."
    if observed.ambient_measured:
        measured = min(observed.ambient_measured.values())
        found = (
            f"{found[:-1]}, found without a dark slot in the {100 * measured:.0f} % of the picture that stood still."
        )
        if measured < MEASURED and share > FAINT_AMBIENT:
            return Judgement(
                subject="ambient",
                grade="doubtful",
                found=f"{found} Elsewhere it is a guess from what is around.",
                advice="Add a dark slot to the plan, which measures it everywhere.",
            )
    if share > NOTICED and swing > MOST_SWING:
        found = f"{found[:-1]} and flickers or changes by {100 * swing:.0f} % (mains light, a screen, the sun)."
    elif share <= MOST_AMBIENT:
        return Judgement(subject="ambient", grade="good", found=found)
    return Judgement(
        subject="ambient",
        grade="bad" if share > LOST_AMBIENT else "doubtful",
        found=f"{found} It is taken off, but its noise stays, and less room is left below saturation.",
        advice="Cover windows and switch room light and screens off, or flash stronger with a smaller aperture.",
    )
