"""A few rounds, spread over a take, for what all of its rounds share: only the frames around them are decoded."""

from collections import Counter
from collections.abc import Iterator, Sequence

from psvideo.clip import Take
from psvideo.compute.progress import Watch, unwatched
from psvideo.model.rows.shutter import frames_touched
from psvideo.model.timing import Timing, places_in_time, timed_camera
from psvideo.plates.align.rounds import Aligning
from psvideo.plates.ambient.ambient_shown import ambient_near
from psvideo.plates.gather import gather
from psvideo.plates.part import Part
from psvideo.plates.sequence import FIRST_NUMBER, Round, round_numbers
from psvideo.plates.used_flashes import used_of

EACH, MOST = 16, 4
"""One round of this many is looked at, and at most this many in all, so that what comes in or turns later is seen."""


def spread_over(rounds: Sequence[int]) -> tuple[int, ...]:
    """Return which of a take's rounds to look at, the middles of equal parts.

    >>> spread_over(range(1001, 1008)), spread_over(range(1001, 1101))
    ((1004,), (1013, 1038, 1063, 1088))
    """
    count = min(-(-len(rounds) // EACH), MOST)
    return tuple(rounds[(2 * k + 1) * len(rounds) // (2 * count)] for k in range(count))


def rounds_spread(
    take: Take, timing: Timing, *, aligning: Aligning, start_number: int = FIRST_NUMBER, watch: Watch = unwatched
) -> Iterator[Round]:
    """Yield a few of a take's complete rounds, aligned as if the take began with each; none where it has only one.

    They depend on the take and its timing alone, never on which part of it is worked on.
    """
    numbers = round_numbers(timing.flashes, start=start_number)
    whole = _whole(take, timing, numbers)
    if len(whole) < 2:
        return
    chosen = spread_over(whole)
    for number in watch(chosen, total=len(chosen), what="looking at the subject", unit="rounds"):
        first = number if number < whole[-1] else number - 1  # aligning wants a second round
        part = _part(take, timing, [n for n, own in enumerate(numbers) if first <= own <= first + 1])
        rounds = gather(take, timing, aligning=aligning, with_ambient=False, start_number=start_number, part=part)
        one = next(rounds, None)
        del rounds  # ends its threads
        if one is not None:
            yield one
        del one


def _whole(take: Take, timing: Timing, numbers: Sequence[int]) -> list[int]:
    """Return the rounds of which every light's flashes lie in the take: as many as in any."""
    flashes = zip(used_of(take, timing).flashes, numbers, strict=True)
    lit = Counter(number for flash, number in flashes if flash.complete and flash.lit)
    return [number for number, count in lit.items() if count == max(lit.values())]


def _part(take: Take, timing: Timing, flashes: Sequence[int]) -> Part:
    """Return the frames that flashes are seen in, with those that lend rows, and the ambient light before them."""
    camera, places = timed_camera(take.plan, timing), places_in_time(timing, take.clip.numbers)
    begin, end = frames_touched(camera, timing.start_s[flashes], timing.duration_s[flashes])
    least, most = int(begin.min()), int(end.max())
    numbers = tuple(number for number in take.numbers if least <= places.get(number, -1) <= most)
    return Part(numbers=numbers, ambient=ambient_near(take, timing, flashes[0]))
