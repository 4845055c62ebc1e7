"""Frames at either end of a clip that change by nothing but noise, which neighbouring rows do not share: no flash that
shows lights them, whether the strobe had not begun, the lens was covered, or lights are too weak."""

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.sync.rowfit.profiles import Profiles

ROWS = 36
"""Rows that noise is judged by: averaged to these, single pixels of a texture hardly count."""
NOISE = 0.15
"""Correlation of neighbouring rows' changes below which there is nothing but noise."""
DARKER = 0.5
"""And they are dark that lie below the others' mean by this share of their spread, since flashes only add light,"""
ERRORS, FLOOR = 3.0, 0.02
"""and above the others' darkest by no more than so many times their noise and this share of that spread."""
LEAST = 6
"""Fewer frames in a row say little: by chance alone their rows are as much alike."""


def likeness(changes: Doubles) -> float:
    """Return the correlation of neighbouring rows' changes (frame, row) from frame to frame."""
    if changes.shape[1] < 2:
        return 1.0
    above, below = changes[:, :-1], changes[:, 1:]
    together = float(np.sqrt((above**2).sum() * (below**2).sum()))  # 0 where but the first or the last row changes
    return float((above * below).sum()) / together if together else 0.0


def loud_part(rows: Profiles) -> slice:
    """Return the frames between those at the clip's first and last that are dark and show nothing but noise; all where
    none are, or where nothing else shows."""
    value = rows.binned(ROWS).value
    first, count = _quiet_first(value), len(value)
    last = _quiet_first(value[::-1])
    if first + last >= count:
        return slice(0, count)
    loud = value[first : count - last]
    first = first if _is_dark(value[:first], loud) else 0
    last = last if _is_dark(value[count - last :], loud) else 0
    return slice(first, count - last)


def _is_dark(quiet: Doubles, loud: Doubles) -> bool:
    """Return whether some frames are as dark as others (frame, row) are between flashes: lights that are alike may
    change nothing from one frame to the next either, and what is brighter is another picture."""
    if not len(quiet):
        return False
    level, spread = quiet.mean(axis=0), float(loud.std(axis=0).mean())
    below = float((loud.mean(axis=0) - level).mean())
    above = float((level - loud.min(axis=0)).mean())
    return below > DARKER * spread and above < ERRORS * float(quiet.std(axis=0).mean()) + FLOOR * spread


def _quiet_first(value: Doubles) -> int:
    """Return how many frames at the beginning of some (frame, row) change by noise alone; 0 for a few."""
    changes = np.diff(value, axis=0)
    above, below = changes[:, :-1], changes[:, 1:]
    both = np.cumsum((above * below).sum(axis=1))
    sizes = np.sqrt(np.cumsum((above**2).sum(axis=1)) * np.cumsum((below**2).sum(axis=1)))
    alike = both > NOISE * sizes
    # judged by longer and longer runs: a first flash among frames of noise is far larger than these
    loud = np.flatnonzero(alike[LEAST - 2 :])
    count = len(value) if not len(loud) else int(loud[0]) + LEAST - 1
    return count if count >= LEAST else 0
