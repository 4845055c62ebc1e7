"""What was followed, as a timing: of a stretch while it runs, and of everything once it is over."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from psvideo.live.following.follow import Follower
from psvideo.live.following.light_names import guess_words, order_of
from psvideo.live.following.phase_filter import smoothed
from psvideo.model.timing import DroppedFrames, Flash, Timing
from psvideo.sync.flashes_seen import flashes_seen
from psvideo.sync.rowfit.beat import Beat, FoundClock

KNOT_S = 0.2
"""Between knots so far apart the clock runs straight."""


def timing_now(follower: Follower, span: tuple[int, int]) -> Timing:
    """Return the flashes that some frames saw, from the first to the last of ``span``, as the clock is known now."""
    beat = replace(follower.beat, clock=follower.clock)
    known = (span[0] if follower.span is None else max(span[0], follower.span[0])), span[1]
    flashes = flashes_seen(follower.plan, beat, follower.lock.camera, span, trusted=known)
    return _timing(follower, flashes, beat, clip="live")


def timing_of(
    followed: Sequence[Follower],
    *,
    clip: str,
    dropped: Sequence[DroppedFrames] = (),
    repeated: Sequence[int] = (),
    first_light: str | None = None,
) -> Timing:
    """Return the timing of all that was followed, one lock after the other; every moment by all that was measured.

    ``dropped`` and ``repeated`` are the clip's frames, by its files' numbers; ``first_light`` is what named the first
    lock's lights, where anybody did. Raises ValueError where nothing was followed.
    """
    flashes: list[Flash] = []
    beat = followed[-1].beat
    for one in followed:
        if one.span is None:
            continue
        beat = replace(one.beat, clock=_clock_of(one))
        known = one.span[0], one.span[1] if one.doubted_from is None else one.doubted_from - 1
        seen = flashes_seen(one.plan, beat, one.lock.camera, known if one.state == "lost" else one.span, trusted=known)
        flashes += [flash for flash in seen if not flashes or flash.start_s > flashes[-1].start_s + flash.duration_s]
    numbered = tuple(replace(flash, index=number) for number, flash in enumerate(flashes))
    return replace(
        _timing(followed[-1], numbered, beat, clip=clip),
        dropped_frames=tuple(dropped),
        repeated_frames=tuple(repeated),
        order=order_of(followed),
        order_note=guess_words(followed, first_light=first_light),
    )


def _timing(follower: Follower, flashes: tuple[Flash, ...], beat: Beat, *, clip: str) -> Timing:
    camera = follower.lock.camera
    return Timing(
        clip=clip,
        frame_period_s=camera.frame_period_s,
        exposure_s=camera.exposure_s,
        row_time_s=camera.row_time_s,
        clock_offset_ppm=beat.clock.mean_offset_ppm(),
        phase_error_rows=follower.error_rows,
        rise_s=beat.rise_s,
        fall_s=beat.fall_s,
        order=follower.lock.order,
        flashes=flashes,
    )


def _clock_of(follower: Follower) -> FoundClock:
    """Return the lock's clock, bent to what all windows say."""
    base, points, trims = follower.lock.beat.clock, follower.measured, follower.trims
    if len(points) < 2:
        return follower.clock
    late_s = smoothed(points)
    at_s = np.array([point.at_s for point in points])
    knots = np.unique(
        np.concatenate([[0], np.searchsorted(at_s, np.arange(at_s[0], at_s[-1], KNOT_S)), [len(at_s) - 1]])
    )
    knot_s = np.union1d(at_s[knots], trims.at_s)
    return base.bent(knot_s, np.interp(knot_s, at_s[knots], late_s[knots]) + trims.late_s(knot_s))
