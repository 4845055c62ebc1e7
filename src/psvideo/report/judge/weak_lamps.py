"""Lamps that give little or no light, beside the others and beside what the rig says of them."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.model.marker import NOT_FIRING
from psvideo.model.rig import LEAST_LIGHTS
from psvideo.model.units import listed
from psvideo.report.judgement import NAMED, Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.levels import TARGET_QUANTILE
from psvideo.report.observe.observed import Observed

WEAK_LIGHT = 1 / 8
"""Of the brightest lamp's light."""
CHECKED_FROM = 5
"""With fewer lights than these nothing shows that one of them gives less than the rig says, and all normals lean."""


def weaker_than_rig(observed: Observed) -> tuple[str, ...]:
    """Return the lights of which so few normals are solved that one of them gives little, where the rig says more:
    it leans all of them."""
    facts = known_rounds(observed)
    if not facts:
        return ()
    usual = np.median(light_by_round(facts), axis=0)
    weaker = _weaker(usual / max(float(usual.max()), 1e-12), brightest_parts(observed), claimed_by_rig(observed))
    return tuple(
        light for light, so, seen in zip(observed.lights, weaker, seen_lights(observed), strict=True) if so and seen
    )


def weak_lamps(
    lights: Sequence[str],
    relative: NDArray[np.float64],
    brightest: NDArray[np.float64],
    claimed: NDArray[np.float64],
    *,
    missed: bool = False,
    flat: bool = False,
    guessed: bool = False,
) -> Iterator[Judgement]:
    """Say which lamps give little. One that comes from the side gives the subject little, and its parts enough.
    ``guessed``: which light is which is a guess."""
    dim = (relative < WEAK_LIGHT) & (brightest < WEAK_LIGHT)
    weak = [light for light, share, is_dim in zip(lights, relative, dim, strict=True) if is_dim and share >= NOT_FIRING]
    if len(weak) > NAMED:
        yield Judgement(
            subject="lights",
            grade="doubtful",
            found=f"{len(weak)} of {len(lights)} lights are weak: less than {100 * WEAK_LIGHT:.0f} % of the strongest "
            f"({listed([repr(light) for light in weak], NAMED)}).",
            advice="Raise their power or their flash duration, or move them nearer.",
        )
    if relative.max() <= 0:  # nothing is lit, which is said once
        return
    others = int((relative >= NOT_FIRING).sum())
    dead = [(light, share) for light, share in zip(lights, relative, strict=True) if share < NOT_FIRING]
    if dead:
        yield _no_light(dead, others=others, missed=missed, flat=flat, guessed=guessed)
    weaker = _weaker(relative, brightest, claimed)
    for light, share, is_dim, is_weaker, says in zip(lights, relative, dim, weaker, claimed, strict=True):
        if is_weaker:
            yield _weaker_than_rig(light, share, says, lights=len(lights))
        elif is_dim and share >= NOT_FIRING and len(weak) <= NAMED:
            yield Judgement(
                subject="lights",
                grade="doubtful",
                found=f"The light {light!r} is weak: {100 * share:.0f} % of the strongest.",
                advice="Raise its power or its flash duration, or move it nearer.",
            )


def _weaker_than_rig(light: str, share: float, says: float, *, lights: int) -> Judgement:
    """Say that a light gives little where the rig, which normals are solved with, says that it gives more."""
    return Judgement(
        subject="lights",
        grade="bad",
        found=f"The light {light!r} is weak: {100 * share:.0f} % of the strongest, where the rig says "
        f"{100 * says:.0f} %. With {lights} lights all normals lean away from it.",
        advice="Raise its power, or measure the lights' strengths again.",
    )


def _no_light(dead: Sequence[tuple[str, float]], *, others: int, missed: bool, flat: bool, guessed: bool) -> Judgement:
    """Say which lamps do not fire, which is bad where too few others do, or those lie in one plane (``flat``);
    ``missed``: rows see them in no round, ``guessed``: their names are a guess."""
    enough = others >= LEAST_LIGHTS
    rest = f"; normals come from the other {others}." if enough else "."
    if flat:
        rest = f"; the other {others} lie in one plane with the subject, and do not show how normals tilt across it."
    named = listed([repr(light) for light, _ in dead], NAMED)
    most = f"{100 * max(0.0, *(share for _, share in dead)):.1f} % of the strongest"
    one = len(dead) == 1
    what = f"The light {named} gives no light ({most})"
    if not one:
        what = f"{len(dead)} lights give no light ({named}; at most {most})"
    if guessed:
        rest += f" As the order is a guess, {'it may be another one' if one else 'they may be others'}."
    return Judgement(
        subject="lights",
        grade="doubtful" if enough and not flat else "bad",
        found=what + rest,
        advice="Take the strobe out of step with the frames (see the line on rows): "
        f"{'it' if one else 'they'} may flash while the shutter is closed."
        if missed
        else f"Check {'its cable, driver and line' if one else 'their cables, drivers and lines'}, and that the plan "
        f"names {'it' if one else 'them'} as the board does.",
    )


def _weaker(
    relative: NDArray[np.float64], brightest: NDArray[np.float64], claimed: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which lamps give light and little of it, (light,), where the rig says that they give more."""
    dim = (relative < WEAK_LIGHT) & (brightest < WEAK_LIGHT)
    return np.asarray(dim & (relative >= NOT_FIRING) & (claimed >= WEAK_LIGHT))


def known_rounds(observed: Observed) -> list[InstantFacts]:
    """Return the rounds in which every lamp's light is known."""
    return [one for one in observed.facts if len(one.levels) == len(observed.lights)]


def light_by_round(facts: Sequence[InstantFacts]) -> NDArray[np.float64]:
    """Return the lamps' light in every round, (round, light), as a share of what usually saturates it: where lamps of
    several colours are taken apart, that differs from round to round, and the light does not."""
    level = np.array([one.levels for one in facts])
    if any(len(one.white) != level.shape[1] for one in facts):
        return level
    white = np.array([one.white for one in facts])
    return np.asarray(level * white / np.median(white, axis=0))


def seen_lights(observed: Observed) -> NDArray[np.bool_]:
    """Return of which lights any of the subject was seen, (light,): of others nothing can be said."""
    counted = np.array([observed.levels(light).total > 0 for light in observed.lights], np.bool_)
    return counted | (not counted.any())


def brightest_parts(observed: Observed) -> NDArray[np.float64]:
    """Return the light in every lamp's brightest parts, as a share of the strongest lamp's."""
    tops = np.array([2.0 ** observed.levels(light).stops(TARGET_QUANTILE) for light in observed.lights])
    return np.asarray(tops / tops.max())


def claimed_by_rig(observed: Observed) -> NDArray[np.float64]:
    """Return what the rig says that every lamp gives at the plan's power, as a share of the strongest; zeros where that
    is not known, or where there are enough others to find out."""
    if observed.points is None or len(observed.lights) >= CHECKED_FROM:
        return np.zeros(len(observed.lights))
    strengths = np.linalg.norm(observed.points.vectors, axis=2).mean(axis=0)
    whites = [one.white for one in observed.facts if len(one.white) == len(strengths)]
    strengths = strengths / (np.median(whites, axis=0) if whites else 1.0)
    return np.asarray(strengths / max(float(strengths.max()), 1e-12))
