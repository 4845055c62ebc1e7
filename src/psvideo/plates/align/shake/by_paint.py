"""Where the picture was at every flash, as paint and outlines show it: lights that follow each other share them."""

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Floats
from psvideo.plates.align.shake.registered import correlation, registered, shifted

SAME_PX, OTHER_PX, SMOOTH_PX = 0.05, 0.15, 3.0
"""Shifts are known to the first between plates of one light, to the second between those of two that are wholly alike,
and change by the third from flash to flash: less under a hand, so that this decides only where nothing else does."""
LEAST_ALIKE = 0.2
"""Lights whose pictures correlate by less say nothing of a shift."""
AGREE, PAINTED = 0.1, 0.5
"""Lights that follow each other must correlate by the first more along the path than as they are, and by the second:
less is shading. Photographs of painted things and of plaster come to 0.57 to 0.9, a bare ball to 0.45."""


def places_by_paint(
    times: Doubles, details: Sequence[Floats], firsts: NDArray[np.intp], shifts: Doubles
) -> tuple[Doubles, bool]:
    """Return the places of all flashes, (flash, 2), that fit what plates of one light show, ``shifts`` (light, 2) from
    its first one on, and those of two that follow each other; and whether those show paint that lies on itself so."""
    links = [(int(a), int(b)) for a, b in itertools.pairwise(np.argsort(times, kind="stable"))]
    between = over_ranges(lambda n, _: registered(*(details[at] for at in links[n])), len(links), each=1)
    rows, wanted = [], []
    for first, after, px in zip(firsts, [*firsts[1:], len(times)], shifts, strict=True):
        if after - first > 1:
            rows.append(_from_to(len(times), first, first + 1) / SAME_PX)
            wanted.append(px / SAME_PX)
    for (first, last), shift in zip(links, between, strict=True):
        weight = shift.alike / OTHER_PX if shift.alike > LEAST_ALIKE else 0.0
        rows.append(_from_to(len(times), first, last) * weight)
        wanted.append(shift.px * weight)
    bends = _bends(times, links) / SMOOTH_PX
    square = np.concatenate([rows, bends])
    found = np.linalg.lstsq(square, np.concatenate([wanted, np.zeros((len(bends), 2))]), rcond=None)[0]
    places = np.asarray(found, np.float64)
    along = np.mean([_alike(details[a], details[b], places[b] - places[a]) for a, b in links])
    as_they_are = np.mean([_alike(details[a], details[b], np.zeros(2)) for a, b in links])
    return places, float(along) > max(float(as_they_are) + AGREE, PAINTED)


def _bends(times: Doubles, links: Sequence[tuple[int, int]]) -> Doubles:
    """Return the rows that give by how much the way from flash to flash changes, of places."""
    steps = [_from_to(len(times), a, b) / (times[b] - times[a]) for a, b in links]
    flash_s = float(np.median([times[b] - times[a] for a, b in links]))
    return np.asarray(np.diff(steps, axis=0) * flash_s, np.float64)


def _from_to(count: int, first: int, last: int) -> Doubles:
    row = np.zeros(count)
    row[first], row[last] = -1, 1
    return row


def _alike(one: Floats, other: Floats, px: Doubles) -> float:
    """Return how alike two pictures are, the other one shifted back: a correlation."""
    return correlation(one, shifted(other, -px))
