"""Lamps that flicker from round to round or drift in the course of a take, and light that all of them share."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Flags
from psvideo.model.swing import Swing
from psvideo.report.judgement import Judgement
from psvideo.report.observe.facts import InstantFacts

UNSTEADY = 0.02
DRIFTS, STEADILY = 0.05, 3.0
"""A lamp drifts that gives so much more or less in the last third of a take than in the first, by itself and beside
what the others do, and so many times more than it changes from round to round: one that flickers does not."""
FEW_ROUNDS = 9
"""In fewer rounds a third of them is one or two, which flicker apart by chance: all steps must be the same way then."""
ALIKE = 0.6
"""Lamps whose light changes together have this correlation from round to round; two that flicker have it by chance in
one of eight takes of five rounds, three in one of thirty, four in one of a hundred."""


def unsteady(
    lights: Sequence[str],
    facts: Sequence[InstantFacts],
    level: NDArray[np.float64],
    usual: NDArray[np.float64],
    alive: NDArray[np.bool_],
) -> Iterator[Judgement]:
    """Say which lamps change from round to round while nothing moves, as far as that is known."""
    still = np.array([one.moving_share == 0 for one in facts[1:]], bool)
    steps = np.abs(np.diff(level, axis=0))[still]
    if len(steps) < 4:
        return
    share = level / np.maximum(usual, 1e-9)
    change = np.median(steps, axis=0) / np.maximum(usual, 1e-9)
    beside = share / _common(share, alive)[:, None]
    drift, own = _grown(beside), _grown(share)
    beyond = np.maximum(DRIFTS, STEADILY * np.median(np.abs(np.diff(beside, axis=0)), axis=0))
    drifts = alive & still.all() & _one_way(beside) & (np.abs(drift) > beyond) & (own * np.sign(drift) > DRIFTS)
    for light, by in zip(np.array(lights)[drifts].tolist(), drift[drifts].tolist(), strict=True):
        yield _drifting(light, by)
    flicker = alive & (change > UNSTEADY) & ~drifts
    if flicker.sum() > 1 and _together(share[:, flicker], still):
        yield swings(Swing(share=float(change[flicker].mean()), cause="either"))
        return
    for light, by, flickers in zip(lights, change, flicker, strict=True):
        if flickers:
            yield Judgement(
                subject="lights",
                grade="doubtful",
                found=f"The light {light!r} flickers: its level changes by {100 * by:.1f} % from round to round.",
                advice="Check its driver and supply, and that no dimmer (PWM) is in its line.",
            )


def _common(share: Doubles, alive: Flags) -> Doubles:
    """Return the course that lamps have in common, (round,): as under the camera's gain. It is that of lamps which give
    in the end what they gave at first, where there are any: a gain that grew would show in them. Else that of all.
    ``share`` (round, light) is of a lamp's usual light."""
    steady = alive & (np.abs(_grown(share)) <= UNSTEADY)
    of = steady if steady.any() else alive if alive.any() else np.ones_like(alive)
    return np.asarray(np.maximum(np.median(share[:, of], axis=1), 1e-9))


def _grown(share: Doubles) -> Doubles:
    """Return by which part each lamp, (light,), gives more in the last third of the rounds than in the first."""
    third = max(len(share) // 3, 1)
    return np.asarray(np.median(share[-third:], axis=0) / np.maximum(np.median(share[:third], axis=0), 1e-9) - 1)


def _one_way(share: Doubles) -> Flags:
    """Return which lamps grow, or fade, from each of a few rounds to the next: ``share`` (round, light); all of them
    where rounds are many."""
    steps = np.diff(share, axis=0)
    return np.asarray((steps > 0).all(axis=0) | (steps < 0).all(axis=0) | (len(share) >= FEW_ROUNDS))


def _drifting(light: str, by: float) -> Judgement:
    """Say that a lamp grows or fades in the course of a take, while the others stay."""
    return Judgement(
        subject="lights",
        grade="doubtful",
        found=f"The light {light!r} {'grows' if by > 0 else 'fades'} by {100 * abs(by):.0f} % in the course of the "
        "take, beside the others: it warms up, or its battery runs down. The rig's strengths hold for a part of it.",
        advice="Let lamps flash for some minutes before a take, and feed them from a supply that holds its voltage.",
    )


def _together(level: Doubles, still: Flags) -> bool:
    """Return whether lamps change together, as under another gain of the camera, and not each for itself: ``level``
    (round, light) is what each gives of its usual light, ``still`` (round - 1,) between which rounds nothing moves."""
    steps = np.diff(level, axis=0)[still]
    each, mean = (steps**2).mean(), (steps.mean(axis=1) ** 2).mean()
    apart = 1 / level.shape[1]
    return bool(mean > (apart + (1 - apart) * ALIKE) * each)


def swings(swing: Swing) -> Judgement:
    """Return the line on light that grows and shrinks, whoever's doing it is."""
    subject = "lights" if swing.cause == "lamps" else "gain"
    return Judgement(subject=subject, grade="doubtful", found=swing.found, advice=swing.advice)
