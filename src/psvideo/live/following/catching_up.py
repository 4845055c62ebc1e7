"""A lock is found in frames that lie a moment back: the follower gets them first, and then those that came since."""

from collections.abc import Sequence

from psvideo.live.following.first_shown import first_shown
from psvideo.live.following.follow import Follower, following
from psvideo.live.following.frame_places import FramePlaces
from psvideo.live.following.lock import Lock
from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan


def caught_up(
    plan: Plan,
    lock: Lock,
    values: Sequence[Doubles],
    doubts: Sequence[Doubles | None] | None = None,
    *,
    numbers: Sequence[int] | None = None,
) -> Follower:
    """Return what follows the strobe after the frames that the lock was found in, whose profiles these are.

    ``numbers`` are the frames' own (left out: their places in time): where the lock has frames come later than these
    say, and later than those before, frames are missing, as where the follower finds it; a frame that has the place of
    the one before repeats it. What is followed begins at the first frame in which the strobe is seen.
    """
    follower, true_places = following(plan, lock), lock.places.tolist()
    doubts = doubts or [None] * len(values)
    numbers = true_places if numbers is None else numbers
    late = true_places[0] - numbers[0]
    follower.places = FramePlaces(late=late)
    for number, place, value, doubt in zip(numbers, true_places, values, doubts, strict=True):
        follower.places = _placed(follower.places, number, place - number - late)
        late = place - number
        follower.add(number, value, doubt)
    follower.begin_at(first_shown(plan, lock, values, doubts))
    return follower


def _placed(places: FramePlaces, number: int, more: int) -> FramePlaces:
    """Return the places with a numbered frame that the lock has by so many later than the one before it."""
    if more > 0:
        return places.with_hole(number, more)
    return places.with_repeats(number, -more) if more else places
