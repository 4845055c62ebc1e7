"""Ambient light taken off the plates, interpolated between the dark slots before and after them."""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from psvideo.model.rows.ripple import Exposures, Ripple
from psvideo.model.timing import Timing
from psvideo.plates.ambient.ambient_followed import Ambient, first_ripple, update
from psvideo.plates.mixing.mixture import shown_level
from psvideo.plates.split import Plate


def with_darks_ahead(
    plates: Iterator[Plate], timing: Timing, *, beyond: int = -1
) -> tuple[Iterator[Plate], Iterator[Plate]]:
    """Return a clip's plates, and the dark slots among them ahead of the others, which wait meanwhile: those after the
    flash with the index ``beyond``.

    Both read one stream, and whoever asks first pulls for the other, too. Flashes a, b and dark slots D, when
    ``subtract`` has given a1 and wants the dark slot after b1:

        pulled:   a1 b1 a2 b2 D2    (the second: D2 was wanted, and b1 a2 b2 came with it)
        coming:   a1, next is b1    (``waiting``: b1 a2 b2 D2; the dark slot passes once more, in its place)
        darks:    D2                (``unseen`` holds dark slots that ``coming`` pulled)

    No plate is made for waiting: it holds the frames that it will be made of.
    """
    waiting: deque[Plate] = deque()
    unseen: deque[Plate] = deque()
    complete = [flash.index for flash in timing.flashes if flash.is_dark and flash.complete]
    last = max(complete, default=-1)

    def pull() -> bool:
        plate = next(plates, None)
        if plate is None:
            return False
        waiting.append(plate)
        unseen.extend([plate] if plate.flash.is_dark and plate.flash.index > beyond else [])
        return True

    def coming() -> Iterator[Plate]:
        while waiting or pull():
            yield waiting.popleft()

    def darks() -> Iterator[Plate]:
        found = beyond
        while found < last:
            while not unseen:
                if not pull():
                    return
            found = unseen[0].flash.index
            yield unseen.popleft()

    return coming(), darks()


def subtract(
    plates: Iterable[Plate],
    *,
    darks: Iterable[Plate] = (),
    waits: bool = True,
    known: Ambient | None = None,
    ripple: Ripple | None = None,
) -> Iterator[Plate]:
    """Yield the plates with ambient light taken off the lit ones; dark slots pass as the average at their moment.

    ``darks`` are the clip's dark slots, read ahead of the plates: no further than the one after the current plate.
    ``waits`` False: not even that while the light is steady, so that few frames are held; then the next dark slot is
    read when it passes. Before the first and after the last, its light is taken as it is. Without any, plates keep
    theirs. ``known`` is what dark slots showed before the first plate, where ``darks`` begin after these;
    ``ripple`` is what the clip's timing found of the mains.
    """
    coming = iter(darks)
    before = after = known
    for plate in plates:
        while after is None or _is_stale(after, plate, waits=waits or not after.steady):
            dark = next(coming, None)
            if dark is None:
                before = after
                break
            before = None
            later = update(after, dark, ripple=ripple)
            alone = after is None or later.steady or first_ripple(after.mains, later.mains)
            before = later if alone else after
            after = later
            del dark, later  # pictures are held only as long as they are needed
        if after is not None and not plate.flash.is_dark:
            plate = _without(plate, before or after, after)
        elif after is not None:
            plate = replace(plate, picture=shown_level(after.level), seen=after.known)
        yield plate
        del plate


def _is_stale(after: Ambient, plate: Plate, *, waits: bool) -> bool:
    """Return whether a plate asks for a later dark slot: for the next one, or, where none waits, for itself."""
    return after.index < plate.flash.index and (plate.flash.is_dark or waits)


def _without(plate: Plate, before: Ambient, after: Ambient) -> Plate:
    """Take the ambient light of every exposure off, interpolated in time.

    Rows in which the ambient light is not known are no longer seen.
    """
    opened = Exposures(shares=plate.shares, middles_s=plate.middles_s)
    gap_s = after.middle_s - before.middle_s
    late = np.clip((opened.middle_s - before.middle_s) / np.where(gap_s > 0, gap_s, np.inf), 0, 1)
    late = np.where(before.known, np.where(after.known, late, 0.0), 1.0)
    ripple = after.mains.ripple
    exposures = plate.exposures * (1.0 if ripple is None else ripple.swing(opened))
    seen = plate.seen & (before.known | after.known)
    if before is after:
        picture = plate.picture.without((after.level,), exposures[None])
    else:
        picture = plate.picture.without((before.level, after.level), np.stack([1 - late, late]) * exposures)
    return replace(plate, picture=picture.within(seen), shares=np.zeros_like(plate.shares), seen=seen)
