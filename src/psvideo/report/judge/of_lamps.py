"""Judgements on lamps: those that give little or nothing, fail in some rounds, or flicker."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.model.marker import NOT_FIRING
from psvideo.model.rig import LEAST_LIGHTS
from psvideo.model.swing import Swing
from psvideo.model.units import listed
from psvideo.report.judge.unsteady_lamps import swings, unsteady
from psvideo.report.judgement import Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.levels import TARGET_QUANTILE
from psvideo.report.observe.observed import Observed
from psvideo.solve.normals.illumination import MAX_CONDITION

WEAK_LIGHT = 1 / 8
"""Of the brightest lamp's light."""
CHECKED_FROM = 5
"""With fewer lights than these nothing shows that one of them gives less than the rig says, and all normals lean."""
MISSED = 0.5
"""A flash that gives less than this share of its lamp's usual light did not fire as it should."""
NAMED = 4
"""This many lights or rounds are named one by one; of more, only how many."""


def lamps(
    observed: Observed, *, timed: bool = True, missed: bool = False, swing: Swing | None = None
) -> Iterator[Judgement]:
    """Judge whether every lamp gives light, always, and steadily; where flash times are not known (``timed``), only
    whether it does at all. ``missed``: the camera may be blind whenever one lamp flashes. ``swing`` is how the clip's
    light grows and shrinks: no lamp is blamed for what whole frames do."""
    facts = _known(observed)
    if not facts:
        return
    level = _levels(facts)
    usual = np.median(level, axis=0)
    relative = usual / max(float(usual.max()), 1e-12)
    known = _shown(observed)
    named = [light for light, is_known in zip(observed.lights, known, strict=True) if is_known]
    flat = _in_a_plane(observed)
    shown_as = _brightest(observed)[known], _claimed(observed)[known]
    said = list(_weak(named, relative[known], *shown_as, missed=missed, flat=flat))
    alive = observed.firing
    whole = np.array([one.unseen_share == 0 for one in facts])
    if timed and whole.any():
        shown = [one for one in facts if one.unseen_share == 0]
        said += _missed(observed.lights, shown, level[whole], usual, alive)
        if swing is None or swing.cause == "lamps":
            said += unsteady(observed.lights, shown, level[whole], usual, alive)
    if swing is not None and (swing.cause != "lamps" or not any(one.subject == "lights" for one in said)):
        said.append(swings(swing))
    yield from said
    if (
        not any(one.subject == "lights" for one in said) and relative.max() > 0
    ):  # else nothing is lit, which is said once
        always = " in every round" if timed and whole.all() else ""
        yield Judgement(subject="lights", grade="good", found=_all_fire(relative[known], len(known), always))


def weaker_than_rig(observed: Observed) -> tuple[str, ...]:
    """Return the lights of which so few normals are solved that one of them gives little, where the rig says more:
    it leans all of them."""
    facts = _known(observed)
    if not facts:
        return ()
    usual = np.median(_levels(facts), axis=0)
    weaker = _weaker(usual / max(float(usual.max()), 1e-12), _brightest(observed), _claimed(observed))
    return tuple(
        light for light, so, seen in zip(observed.lights, weaker, _shown(observed), strict=True) if so and seen
    )


def _in_a_plane(observed: Observed) -> bool:
    """Return whether the lights that fire lie so nearly in one plane that nothing is solved with them."""
    if observed.points is None or int(observed.firing.sum()) < LEAST_LIGHTS:
        return False
    ways = observed.points.vectors[:, observed.firing].mean(axis=0)
    lengths = np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
    sizes = np.linalg.svd(ways / lengths, compute_uv=False)
    return bool(sizes[0] > MAX_CONDITION * sizes[-1])


def _known(observed: Observed) -> list[InstantFacts]:
    """Return the rounds in which every lamp's light is known."""
    return [one for one in observed.facts if len(one.levels) == len(observed.lights)]


def _all_fire(relative: NDArray[np.float64], lights: int, always: str) -> str:
    """Say that all lights of which anything was seen fire, and by how much they differ."""
    if len(relative) == 1:
        return f"The {'light' if lights == 1 else f'one of {lights} lights that was seen'} fires{always}."
    seen = (
        f"All {lights} lights" if len(relative) == lights else f"The {len(relative)} of {lights} lights that were seen"
    )
    spread = abs(-np.log2(max(relative.min(), 1e-9)))
    return f"{seen} fire{always}; the weakest gives {spread:.1f} stops less than the strongest."


def _levels(facts: Sequence[InstantFacts]) -> NDArray[np.float64]:
    """Return the lamps' light in every round, (round, light), as a share of what usually saturates it: where lamps of
    several colours are taken apart, that differs from round to round, and the light does not."""
    level = np.array([one.levels for one in facts])
    if any(len(one.white) != level.shape[1] for one in facts):
        return level
    white = np.array([one.white for one in facts])
    return np.asarray(level * white / np.median(white, axis=0))


def _brightest(observed: Observed) -> NDArray[np.float64]:
    """Return the light in every lamp's brightest parts, as a share of the strongest lamp's."""
    tops = np.array([2.0 ** observed.levels(light).stops(TARGET_QUANTILE) for light in observed.lights])
    return np.asarray(tops / tops.max())


def _claimed(observed: Observed) -> NDArray[np.float64]:
    """Return what the rig says that every lamp gives at the plan's power, as a share of the strongest; zeros where that
    is not known, or where there are enough others to find out."""
    if observed.points is None or len(observed.lights) >= CHECKED_FROM:
        return np.zeros(len(observed.lights))
    strengths = np.linalg.norm(observed.points.vectors, axis=2).mean(axis=0)
    whites = [one.white for one in observed.facts if len(one.white) == len(strengths)]
    strengths = strengths / (np.median(whites, axis=0) if whites else 1.0)
    return np.asarray(strengths / max(float(strengths.max()), 1e-12))


def _shown(observed: Observed) -> NDArray[np.bool_]:
    """Return of which lights any of the subject was seen, (light,): of others nothing can be said."""
    counted = np.array([observed.levels(light).total > 0 for light in observed.lights], np.bool_)
    return counted | (not counted.any())


def _weaker(
    relative: NDArray[np.float64], brightest: NDArray[np.float64], claimed: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which lamps give light and little of it, (light,), where the rig says that they give more."""
    dim = (relative < WEAK_LIGHT) & (brightest < WEAK_LIGHT)
    return np.asarray(dim & (relative >= NOT_FIRING) & (claimed >= WEAK_LIGHT))


def _weak(
    lights: Sequence[str],
    relative: NDArray[np.float64],
    brightest: NDArray[np.float64],
    claimed: NDArray[np.float64],
    *,
    missed: bool = False,
    flat: bool = False,
) -> Iterator[Judgement]:
    """Say which lamps give little. One that comes from the side gives the subject little, and its parts enough."""
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
        yield _no_light(dead, others=others, missed=missed, flat=flat)
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


def _no_light(dead: Sequence[tuple[str, float]], *, others: int, missed: bool, flat: bool) -> Judgement:
    """Say which lamps do not fire, which is bad where too few others do, or those lie in one plane (``flat``);
    ``missed``: rows see them in no round."""
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
        named = listed([one.number for one, none in zip(facts, empty, strict=True) if none], NAMED)
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
                f"({listed(numbers, NAMED)}).",
                advice="Check its driver and supply; these rounds' normals are wrong.",
            )
