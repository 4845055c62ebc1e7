"""The worst instants of a run, each with a small picture of its normals and of where they are valid."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import thin
from psvideo.model.surface import Surface
from psvideo.report.observe.steadiness import Change

KEPT = 4
WIDTH_PX = 280
LEAST_BADNESS = 0.02
"""Better instants are not worth a picture."""


class Facts(Protocol):
    """What makes one instant worse than another; ``InstantFacts`` says what each means."""

    @property
    def number(self) -> int:
        """The instant's number."""

    @property
    def valid_share(self) -> float | None:
        """Of the subject, what has a normal to be trusted."""

    @property
    def clipped_share(self) -> float:
        """Of the subject, what is saturated, in the mean over the lights."""

    @property
    def unseen_share(self) -> float:
        """Of the rows, those that no frame saw."""

    @property
    def change(self) -> Change | None:
        """What differs from the result before, at rest."""


@dataclass(frozen=True, kw_only=True)
class Thumbnail:
    """A small instant: ``normals`` (row, col, 3), ``valid`` (row, col), how bad it is, and why in a few words."""

    number: int
    badness: float
    why: str
    normals: NDArray[np.float16]
    valid: NDArray[np.bool_]


def badness(facts: Facts) -> tuple[float, str]:
    """Return how bad an instant is, and the gravest reason."""
    level = 0.0 if facts.change is None else abs(facts.change.level_percent) / 100
    valid = 1.0 if facts.valid_share is None else facts.valid_share
    reasons = [
        (1 - valid, f"{100 * valid:.0f} % valid"),
        (facts.clipped_share, f"{100 * facts.clipped_share:.1f} % saturated"),
        (facts.unseen_share, f"{100 * facts.unseen_share:.0f} % of the rows unseen"),
        (level, f"{100 * level:.1f} % brighter or darker than the one before"),
    ]
    return sum(share for share, _ in reasons), max(reasons)[1]


class Worst:
    """Keeps the few worst instants of those that it is offered."""

    def __init__(self, kept: Iterable[Thumbnail] = ()) -> None:
        self._kept = [*kept]

    @property
    def thumbnails(self) -> tuple[Thumbnail, ...]:
        """Those that are bad enough, the worst first."""
        return tuple(self._kept)

    def offer(self, facts: Facts, surface: Surface) -> None:
        """Keep an instant if it is among the worst so far; only then is its picture made."""
        bad, why = badness(facts)
        if bad < LEAST_BADNESS or (len(self._kept) == KEPT and bad <= self._kept[-1].badness):
            return
        step = max(surface.valid.shape[1] // WIDTH_PX, 1)
        small = Thumbnail(
            number=facts.number,
            badness=bad,
            why=why,
            normals=thin(surface.normals, step).astype(np.float16),
            valid=surface.valid[::step, ::step].copy(),
        )
        self._kept = sorted([*self._kept, small], key=lambda one: -one.badness)[:KEPT]

    def join(self, later: "Worst") -> None:
        """Keep the worst of these and of later ones."""
        self._kept = sorted([*self._kept, *later.thumbnails], key=lambda one: -one.badness)[:KEPT]
