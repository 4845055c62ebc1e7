"""Judgements on lamps: those that give little or nothing, fail in some rounds, or flicker."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Flags
from psvideo.model.rig import LEAST_LIGHTS
from psvideo.model.swing import Swing
from psvideo.model.units import listed
from psvideo.report.judge.unsteady_lamps import swings, unsteady
from psvideo.report.judge.weak_lamps import (
    brightest_parts,
    claimed_by_rig,
    known_rounds,
    light_by_round,
    seen_lights,
    weak_lamps,
)
from psvideo.report.judgement import NAMED, Judgement
from psvideo.report.observe.facts import InstantFacts
from psvideo.report.observe.observed import Observed
from psvideo.solve.normals.illumination import MAX_CONDITION

MISSED = 0.5
"""A flash that gives less than this share of its lamp's usual light did not fire as it should."""
AT_ONCE, GONE, OTHERS_STAY = 0.5, 0.1, 1.3
"""Where the subject moves, lamps light more or less of it. One that fails beside that gives less than the first times
what it does in the round before or after, while none of the others changes by more than the last, as a factor; or less
than the second, whatever the others do. (A face that came into the picture from one side, at 1 px a flash: one lamp
grew from 2 % of its usual light by 1.1 to 2.5 times a round.)"""


def lamps(
    observed: Observed,
    *,
    timed: bool = True,
    missed: bool = False,
    guessed: bool = False,
    swing: Swing | None = None,
) -> Iterator[Judgement]:
    """Judge whether every lamp gives light, always, and steadily; where flash times are not known (``timed``), only
    whether it does at all. ``missed``: the camera may be blind whenever one lamp flashes; ``guessed``: which light is
    which is a guess. ``swing`` is how the clip's light grows and shrinks: no lamp is blamed for what whole frames
    do."""
    facts = known_rounds(observed)
    if not facts:
        return
    level = light_by_round(facts)
    usual = np.median(level, axis=0)
    relative = usual / max(float(usual.max()), 1e-12)
    known = seen_lights(observed)
    named = [light for light, is_known in zip(observed.lights, known, strict=True) if is_known]
    flat = _in_a_plane(observed)
    shown_as = brightest_parts(observed)[known], claimed_by_rig(observed)[known]
    said = list(weak_lamps(named, relative[known], *shown_as, missed=missed, flat=flat, guessed=guessed))
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


def _in_a_plane(observed: Observed) -> bool:
    """Return whether the lights that fire lie so nearly in one plane that nothing is solved with them."""
    if observed.points is None or int(observed.firing.sum()) < LEAST_LIGHTS:
        return False
    ways = observed.points.vectors[:, observed.firing].mean(axis=0)
    lengths = np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
    sizes = np.linalg.svd(ways / lengths, compute_uv=False)
    return bool(sizes[0] > MAX_CONDITION * sizes[-1])


def _all_fire(relative: NDArray[np.float64], lights: int, always: str) -> str:
    """Say that all lights of which anything was seen fire, and by how much they differ."""
    if len(relative) == 1:
        return f"The {'light' if lights == 1 else f'one of {lights} lights that was seen'} fires{always}."
    seen = (
        f"All {lights} lights" if len(relative) == lights else f"The {len(relative)} of {lights} lights that were seen"
    )
    spread = abs(-np.log2(max(relative.min(), 1e-9)))
    return f"{seen} fire{always}; the weakest gives {spread:.1f} stops less than the strongest."


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
    moving = np.array([bool(one.moving_share) for one in facts], np.bool_)
    for k, light in enumerate(lights):
        failed = _by_itself(
            missed[:, k] & ~empty, level[:, k], np.delete(level, k, axis=1)[:, np.delete(alive, k)], moving
        )
        numbers = [one.number for one, gone in zip(facts, failed, strict=True) if gone]
        if alive[k] and numbers:
            yield Judgement(
                subject="lights",
                grade="bad" if len(numbers) > 0.1 * len(facts) else "doubtful",
                found=f"The light {light!r} failed or was covered in {len(numbers)} of {len(facts)} rounds "
                f"({listed(numbers, NAMED)}).",
                advice="Check its driver and supply; these rounds' normals are wrong.",
            )


def _by_itself(missed: Flags, level: Doubles, others: Doubles, moving: Flags) -> Flags:
    """Return in which of the rounds that a lamp seems to have ``missed`` (round,) the lamp is to blame: all in which
    nothing moves, and those that begin or end at once, as no subject does. ``level`` (round,) is its light, ``others``
    (round, light) that of the lamps that fire."""
    blamed = missed.copy()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missed, [False]])))
    for first, after in edges.reshape(-1, 2).tolist():
        steps = [(first, first - 1), (after - 1, after)]
        at_once = any(_at_once(level, others, *step) for step in steps if 0 <= step[1] < len(level))
        blamed[first:after] = at_once or not moving[max(first - 1, 0) : after + 1].any()
    return blamed


def _at_once(level: Doubles, others: Doubles, inside: int, beside: int) -> bool:
    """Return whether a lamp's light breaks off between two rounds that follow each other, and no other's does."""
    kept = level[inside] / max(level[beside], 1e-12)
    changes = np.log(np.maximum(others[inside], 1e-12) / np.maximum(others[beside], 1e-12))
    return bool(kept < GONE or (kept < AT_ONCE and (np.abs(changes) < np.log(OTHERS_STAY)).all()))
