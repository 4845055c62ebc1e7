"""Which flashes never fired, in words."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.model.timing import Flash
from psvideo.model.units import counted
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.tracking.misfires import first_seen

MOST_NAMED = 8
"""Frames that a sentence names."""


def _lost(flashes: Sequence[Flash], fired: Sequence[Flash]) -> list[Flash]:
    return [one for one, other in zip(flashes, fired, strict=True) if one.complete and not other.complete]


def remarks_on_unfired(
    found: ClipFit, flashes: Sequence[Flash], fired: Sequence[Flash], numbers: NDArray[np.int64]
) -> Iterator[str]:
    """Say which of a clip's complete ``flashes`` are not among those that ``fired``, by the frames' ``numbers``."""
    lost = _lost(flashes, fired)
    for lit in dict.fromkeys(flash.lit for flash in lost):
        own = [flash for flash in lost if flash.lit == lit]
        first = first_seen(found.rows, found.fit.beat, np.array([flash.start_s for flash in own]))
        frames = numbers[np.clip(np.searchsorted(found.track.index, first), 0, len(numbers) - 1)].tolist()
        last_s = max((flash.start_s for flash in fired if flash.lit == lit and flash.complete), default=-np.inf)
        shown = ", ".join(str(number) for number in frames[:MOST_NAMED]) + (" …" if len(frames) > MOST_NAMED else "")
        where = f"none after frame {frames[0]}" if len(own) > 1 and last_s < own[0].start_s else f"in frames {shown}"
        yield (
            f"{'+'.join(lit)}: {counted(len(own), 'flash')} never fired ({where}), where flashes before and after did. "
            "They are marked as incomplete and give no plate: check this light, its wiring and its power."
        )
