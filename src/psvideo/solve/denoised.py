"""Surfaces averaged over several instants, where nothing moves."""

from collections.abc import Iterable, Iterator
from dataclasses import replace

from psvideo.plates.align.denoise import Average, ResultNoise, added, averaged
from psvideo.solve.instants import Instant
from psvideo.solve.normals.plate_noise import spread_of


def denoised(instants: Iterable[Instant], results: int) -> Iterator[Instant]:
    """Average every surface with those before it, up to this many ``results``, where nothing moves.

    An average begins with the block of ``results`` numbers before an instant's own, so that it depends on no others.
    """
    average: Average | None = None
    later: Average | None = None
    block = 0
    for instant in instants:
        if block != (own := instant.round.number // results):
            average, later, block = later if own == block + 1 else None, None, own
        together = later is average
        plates = instant.round.plates
        noise = ResultNoise.of(plates, spread_of([plate.picture for plate in plates]))
        average, surface = averaged(average, instant.surface, results, noise=noise)
        later = average if together else added(later, instant.surface, results, noise=noise)
        yield replace(instant, surface=surface)
        del instant, surface
