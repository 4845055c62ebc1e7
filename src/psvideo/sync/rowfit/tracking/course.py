"""A clip's whole course, followed from a seed across holes, repeated frames and drift to its very ends."""

from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Integers
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import FoundClock
from psvideo.sync.rowfit.coarse.retime import regular_step
from psvideo.sync.rowfit.coarse.seed import Seed, gain_of, renumbered
from psvideo.sync.rowfit.coarse.seed_choice import CLEARER, other_seeds
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.ends import ends
from psvideo.sync.rowfit.tracking.false_holes import without_false_holes
from psvideo.sync.rowfit.tracking.holes import NEAR, settled, with_repeats
from psvideo.sync.rowfit.tracking.instead import without_false_repeats
from psvideo.sync.rowfit.tracking.track import FrameTrack, from_first_frame, track

TRACK_ROWS = 60
GOOD_COURSE = 0.9
"""A course through the clip that takes away this share of the robust loss is not tried again from elsewhere."""
TO_DECIMALS = 9
"""Of seconds: anchors that are nearer than that to one another are one, which rounding alone sets apart."""
MOST_STEPS, MOST_STEPS_SHARE = 3, 0.04
"""Frames before which others may be missing (or a share of all frames) until only an excellent fit is believed."""
MOST_STRAYED_SHARE = 0.2
"""And frames that may be missing altogether: holes that grow and grow follow a subject, not a strobe."""


@dataclass(frozen=True, kw_only=True)
class Course:
    """Where a clip's frames are in time, as followed from a seed.

    ``trusted`` are the first and the last place in time at which frames fit, ``unsure`` (frame,) places beside holes
    whose frames may as well lie on the other side; ``share`` of the robust loss goes with the course.
    ``steps``: at how many places frames do not follow one another as their numbers say; ``strayed``: by how many frames
    in all.
    """

    track: FrameTrack
    trusted: tuple[int, int]
    unsure: Integers
    steps: int
    strayed: int
    share: float


def followed(plan: Plan, rows: Profiles, seed: Seed) -> Course:
    """Follow the strobe from the seed, and from another one where frames seem to be missing all over."""
    course = _followed(plan, rows, seed)
    if course.share > GOOD_COURSE or not too_many(course.steps, 0, len(rows.value)):
        return course
    for other in other_seeds(plan, rows.turned() if seed.beat.upward else rows, seed):
        again = _followed(plan, rows, other) if other.beat.upward == seed.beat.upward else course
        course = again if 1 - again.share < CLEARER * (1 - course.share) else course
        if course.share > GOOD_COURSE:
            break
    return course


def too_many(steps: int, strayed: int, frames: int) -> bool:
    """Return whether so many frames seem to be missing, or at so many places, that it takes an excellent fit."""
    return steps > max(MOST_STEPS, MOST_STEPS_SHARE * frames) or strayed > MOST_STRAYED_SHARE * frames


def _followed(plan: Plan, rows: Profiles, seed: Seed) -> Course:
    numbering = seed.numbering
    kept = renumbered(rows, numbering)
    tracked = track(plan, kept, seed.beat, seed.frames, memory=memory_frames(plan, rows))
    tracked = without_false_holes(plan, kept, tracked, seed.frames)
    tracked = replace(tracked, beat=replace(tracked.beat, clock=clock_through(plan, tracked)))
    # numbers that go on one by one but for holes: the seed only guessed where those lie, and they are settled anew
    numbered = kept.index if regular_step(kept.index, numbering.plain) != 1 else numbering.plain
    index, unsure = settled(plan, replace(kept, index=numbered), tracked.index, tracked.beat)
    placed = ends(plan, kept, index, tracked.beat)
    tracked = from_first_frame(kept, replace(tracked, index=placed.index))
    index = tracked.index
    there = replace(kept, index=index)
    every = without_false_repeats(plan, rows, with_repeats(plan, rows, tracked, numbering.kept))
    stray = np.diff(every.index[numbering.kept]) - np.diff(numbering.plain)
    return Course(
        track=every,
        unsure=_beside_steps(rows, every, index[unsure]),
        trusted=(int(index[placed.lost_first]), int(index[len(index) - 1 - placed.lost_last])),
        steps=int((stray != 0).sum()),
        strayed=int(np.abs(stray).sum()),
        share=gain_of(there, unexplained(plan, there, tracked.beat)),
    )


def _beside_steps(rows: Profiles, tracked: FrameTrack, places: Integers) -> Integers:
    """Return those places in time that lie near a hole or a repeat, which may have been taken back since."""
    odd = tracked.index[:-1][np.diff(tracked.index) != np.diff(rows.index)]
    near: Integers = places[(np.abs(places[:, None] - odd) <= NEAR).any(axis=1)]
    return near


def window_frames(plan: Plan) -> int:
    """Return how many frames see every light several times."""
    return max(24, 6 * (len(plan.lit_slots) + 1))


def memory_frames(plan: Plan, rows: Profiles) -> int:
    """Return how many frames predict the next ones: they see every light several times, and the marker."""
    return max(window_frames(plan), int(1.2 * plan.marker_s / rows.period_s))


def clock_through(plan: Plan, tracked: FrameTrack) -> FoundClock:
    """Return a straight clock through the track's anchors, or a bent one where they stray from it."""
    clock = tracked.beat.clock
    # frames that are repeated throughout end where others do, and the seed's middle may be that of later frames
    at_s, first = np.unique(tracked.at_s.round(TO_DECIMALS), return_index=True)
    late_s = tracked.late_s[first]
    if len(at_s) < 2:
        return clock
    line = np.polyfit(at_s, late_s, 1)
    stray_s = late_s - np.polyval(line, at_s)
    pivot_s = float(at_s.mean())
    straight = clock.shifted(float(np.polyval(line, pivot_s)), 1e6 * float(line[0]), pivot_s=pivot_s)
    shortest_s = plan.shortest_flash_s
    if np.median(np.abs(stray_s)) < 0.02 * shortest_s:
        return straight
    return straight.bent(at_s, stray_s)
