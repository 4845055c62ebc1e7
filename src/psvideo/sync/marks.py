"""Which of a fit's flashes give plates: those in black or doubtful frames, or that never fired, give none."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Integers
from psvideo.model.plan import Plan
from psvideo.model.timing import Flash
from psvideo.sync.beside_breaks import doubted_places
from psvideo.sync.black_frames import black_frames, marked
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.unfired import Unfired, incomplete, unfired_of


@dataclass(frozen=True, kw_only=True)
class Marks:
    """Flashes of a clip, in order: ``fired`` with those marked as incomplete that give no plate, ``seen`` but for those
    that never fired; which those are; and frames that are ``black`` (frame,)."""

    black: Integers
    seen: tuple[Flash, ...]
    unfired: Unfired
    fired: tuple[Flash, ...]


def marks_of(
    plan: Plan, found: ClipFit, flashes: Sequence[Flash], indices: NDArray[np.int64], breaks: tuple[bool, bool]
) -> Marks:
    """Return the marks of a fit's ``flashes``, in order, under the lights' names; ``indices`` (frame,) are the frames'
    places in time by their numbers, ``breaks`` as in ``unfired_of``."""
    black = black_frames(plan, found)
    spoilt = np.union1d(black, doubted_places(found, indices))
    seen = marked(plan, found, flashes, spoilt)
    unfired = unfired_of(plan, found, seen, breaks=breaks)
    seen = incomplete(seen, unfired.beside)
    return Marks(black=black, seen=seen, unfired=unfired, fired=incomplete(seen, unfired.never))
