"""The timing of a whole run: all that its chain followed, by the numbers of the files."""

from psvideo.live.chain import Chain
from psvideo.live.following.history import timing_of
from psvideo.model.timing import DroppedFrames, Timing


def followed_timing(chain: Chain, *, clip: str, first_number: int) -> Timing:
    """Return the timing of all that was followed, frames named by their files' numbers; ``clip`` is their name.

    ``first_number`` is that of the first frame's file. Raises ValueError where nothing was followed.
    """
    missing = {gap.after: gap.count for gap in chain.count.gaps}
    came_before = {gap.after + gap.count: gap.after for gap in chain.count.gaps}
    for follower in chain.followed:
        for hole in follower.places.holes:
            after = came_before.get(hole.before - 1, hole.before - 1)
            missing[after] = missing.get(after, 0) + hole.count
    dropped = [DroppedFrames(after=at + first_number, count=count) for at, count in sorted(missing.items())]
    repeated = sorted(number + first_number for follower in chain.followed for number in follower.places.repeated)
    return timing_of(chain.followed, clip=clip, dropped=dropped, repeated=repeated, first_light=chain.first_light)
