"""When another fit is taken: how much more it explains, and whether a time has clearly moved between the two."""

from dataclasses import dataclass

from psvideo.model.plan import Plan
from psvideo.sync.rowfit.coarse.seed import gain_of
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import Fit, robust_loss

CLEAR = 5.0
"""A time leaves the plan's value only when it is off by this many standard errors."""
BETTER, LEAST_GAIN = 1e-3, 30.0
"""And only where that takes away this share of the robust loss, and this much of it: a subject that moves in step with
the dark row bends errors and estimates alike."""
STILL, PLAIN = 0.95, 0.3
"""Where a fit takes away less of the robust loss than the first (a subject that moves), a time that leaves the plan's
value must take away this share of what is left; else it is as likely that the subject feigns it."""


@dataclass(frozen=True, kw_only=True)
class Freed:
    """A fit in which the plan's values are free that the picture contradicts.

    ``unsure_s`` is by how much the times are in doubt because with and without may both be right; ``soft_s`` how soft
    the edges are where that was not taken for tails, else 0.
    """

    fit: Fit
    unsure_s: float = 0.0
    soft_s: float = 0.0


def loss_of(rows: Profiles, fit: Fit) -> float:
    """Return the robust loss that a fit leaves, against its own noise."""
    return robust_loss(rows, fit.rest, fit.rest)


def taken_away(plan: Plan, rows: Profiles, before: Fit, after: Fit) -> float:
    """Return what a fit takes away of the robust loss of the one before.

    Where flashes differ, which of them count as outliers has more than one answer, and brightnesses depend on it more
    than on the times: both fits get the better of their own trust in the samples and the other's.
    """
    if rows.restless is None:
        return loss_of(rows, before) - robust_loss(rows, after.rest, before.rest)

    def least(one: Fit, other: Fit) -> float:
        as_other = unexplained(plan, rows, one.beat, other.weight)
        return min(robust_loss(rows, rest, before.rest) for rest in (one.rest, as_other))

    return least(before, after) - least(after, before)


def moved_by_s(before: Fit, after: Fit, name: str) -> float:
    """Return by how much a time differs between two fits."""
    return float(abs(getattr(after.beat, name) - getattr(before.beat, name)))


def has_moved(before: Fit, after: Fit, names: tuple[str, ...]) -> bool:
    """Return whether one of some times has moved by far more than its error."""
    return any(moved_by_s(before, after, name) > CLEAR * after.errors_s[name] for name in names)


def is_clearly_better(plan: Plan, rows: Profiles, before: Fit, after: Fit, names: tuple[str, ...]) -> bool:
    """Return whether a fit in which some more times are free takes much away, and one of them has clearly moved."""
    least = max(BETTER * loss_of(rows, before), LEAST_GAIN)
    return taken_away(plan, rows, before, after) > least and has_moved(before, after, names)


def may_be_feigned(plan: Plan, rows: Profiles, before: Fit, after: Fit) -> bool:
    """Return whether the subject moves so much that it may feign what the times that were freed explain."""
    moving = rows.restless is None and gain_of(rows, after.rest) < STILL
    return moving and taken_away(plan, rows, before, after) < PLAIN * loss_of(rows, before)
