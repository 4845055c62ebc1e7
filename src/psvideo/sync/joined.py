"""One timing from several chapters of a clip, between which the strobe started again."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from psvideo.model.plan import Plan
from psvideo.model.timing import DroppedFrames, Flash, Order, Timing
from psvideo.sync.restarted import MIXED
from psvideo.sync.rowfit.compiled_profiles import brightnesses
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.tracking.losses import losses_of
from psvideo.sync.turns import TURN_ROWS, turned

CLEARLY = 0.5
"""Names from another chapter are sure where all others leave more than twice as much of the robust loss."""


def named_alike(plan: Plan, chapters: Sequence[tuple[ClipFit, Order]]) -> list[tuple[ClipFit, Order]]:
    """Return the chapters' fits with the same light under the same name, and how the names are known.

    A chapter whose own names are a guess takes those under which another one's brightnesses predict its frames best.
    """
    known = max(chapters, key=lambda one: (one[1] != "guess", len(one[0].rows.value)))
    named = [one if one is known or one[1] != "guess" else _named_after(plan, known[0], one[0]) for one in chapters]
    sure = known[1] if all(order != "guess" for _, order in named) else "guess"
    return [(found, sure) for found, _ in named]


def _named_after(plan: Plan, known: ClipFit, found: ClipFit) -> tuple[ClipFit, Order]:
    """Return the fit under the names under which the known fit's brightnesses predict it best; "marker" if clearly."""
    if known.fit.beat.upward != found.fit.beat.upward or len(known.rows.place) != len(found.rows.place):
        return found, "guess"
    learnt, asked = (replace(one.rows.one_window().binned(TURN_ROWS), doubt=None) for one in (known, found))
    light = brightnesses(plan, learnt, replace(known.fit.beat, beat_hz=()))
    beats = [turned(plan, found.fit.beat, turn) for turn in range(len(plan.cycle_slots))]
    losses = np.array([losses_of(plan, learnt, asked, replace(one, beat_hz=()), light).sum() for one in beats])
    best, *others = np.argsort(losses, kind="stable").tolist()
    sure = not others or losses[best] < CLEARLY * losses[others[0]]
    return replace(found, fit=replace(found.fit, beat=beats[best])), "marker" if sure else "guess"


@dataclass(frozen=True, kw_only=True)
class Chapter:
    """The timing of frames ``first`` to ``last`` by number, as if the clip's numbers were right before them.

    ``more`` is by how many frames those that follow come later than their numbers say, because of what is missing or
    repeated in this chapter.
    """

    first: int
    last: int
    more: int
    timing: Timing


def joined(
    chapters: Sequence[Chapter], dropped: Sequence[DroppedFrames], without: Sequence[tuple[int, int]] = ()
) -> Timing:
    """Return the timing of a clip from those of its chapters, in order; ``dropped`` are holes that its numbers show.

    ``without`` are the first and last numbers of stretches in which no strobe is found. What holds throughout is the
    longest chapter's, and the error the largest of theirs.
    """
    timings = [one.timing for one in chapters]
    main = max(timings, key=lambda one: len(one.flashes))
    flashes, later = list[Flash](), 0
    for one in chapters:
        later_s = later * one.timing.frame_period_s
        flashes += [replace(flash, start_s=flash.start_s + later_s) for flash in one.timing.flashes]
        later += one.more
    flashes.sort(key=lambda flash: flash.start_s)
    holes = {hole.after: hole for one in timings for hole in one.dropped_frames}
    holes = {hole.after: hole for hole in dropped} | holes
    return replace(
        main,
        phase_error_rows=max(one.phase_error_rows for one in timings),
        phase_error_s=max(one.phase_error_s or 0.0 for one in timings),
        mains=main.mains if main is timings[0] else None,
        dropped_frames=tuple(holes[after] for after in sorted(holes)),
        swing=max((one.swing for one in timings if one.swing), key=lambda swing: swing.share, default=None),
        half=next((one.half for one in timings if one.half), None),
        repeated_frames=tuple(number for one in timings for number in one.repeated_frames),
        notes=(
            *_restarts(chapters),
            *_strobeless([span for span in without if not _beside_break(span, chapters)]),
            *dict.fromkeys(note for one in timings for note in one.notes),
        ),
        flashes=tuple(replace(flash, index=n) for n, flash in enumerate(flashes)),
    )


def _restarts(chapters: Sequence[Chapter]) -> Iterator[str]:
    """Say where the strobe started again, or so many frames are missing that it looks the same (``remarks_on_frames``
    says that of holes that are found)."""
    if len(chapters) > 1:
        spans = ", ".join(f"{one.first} to {one.last}" for one in chapters)
        yield (
            "The strobe started again during the clip, at another place in its cycle, as after a restart or a missed "
            f"flash. Each part has a timing of its own: frames {spans}. Flashes beside the breaks, and frames outside "
            "of these parts, are left out. Many frames that are missing there, though the numbers do not show it, may "
            "look the same: then the same flashes lie in the same frames, but all parts behind come as much later than "
            "the times given."
        )


def _beside_break(span: tuple[int, int], chapters: Sequence[Chapter]) -> bool:
    """Return whether frames are no more than a part lacks where its strobe and the next one meet."""
    few = span[1] - span[0] < MIXED
    return few and any(one.last < span[0] and span[1] < other.first for one, other in pairwise(chapters))


def _strobeless(without: Sequence[tuple[int, int]]) -> Iterator[str]:
    """Say which frames show no strobe."""
    if without:
        spans = ", ".join(f"{first} to {last}" for first, last in without)
        yield (
            f"No strobe like the plan's is found in frames {spans}: it had not begun or had stopped, or they show "
            "something else. They are left out."
        )
