"""Long takes: what holds for the whole clip is fitted to some stretches of it, the clock to all frames.

Exposure, readout, tails, and whether anything moves are as sure from a few hundred thousand row means as from millions;
their fits take some hundred passes. How the clock runs is then read from all frames, chapter by chapter: in one piece
that would take time and memory with the square of the take's length.
"""

from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, FoundClock
from psvideo.sync.rowfit.compiled_profiles import unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, Fit, errors_of_residuals, explained
from psvideo.sync.rowfit.unknowns.bend import fitted, late_s

LONG, ENOUGH_SAMPLES = 1_000_000, 250_000
"""Takes of more row means are long; the second is enough for what holds throughout, and for the clock of a chapter."""
STRETCHES, LEAST_WINDOWS = 6, 4
"""What is enough is cut into this many stretches, lest all of it be dark, or the subject stand in all of it; each has
this many windows at least."""
SURE, FAR = 0.05, 0.3
"""Shares of the shortest flash that the error of a chapter's clock, and its way from the one followed roughly, may not
exceed; else it is bridged from chapter to chapter, as where nothing is lit for a while."""


def stretches(rows: Profiles) -> Profiles:
    """Return the frames of some stretches that are spread evenly over a long take; any other clip as it is."""
    window = rows.window_frames
    each = max(ENOUGH_SAMPLES // (STRETCHES * len(rows.place) * window), LEAST_WINDOWS) * window
    if rows.value.size <= LONG or STRETCHES * each > len(rows.value) // 2:
        return rows
    middles = ((np.arange(STRETCHES) + 0.5) * len(rows.value) / STRETCHES).astype(np.int64)
    frames = (middles[:, None] + np.arange(each) - each // 2).ravel()
    part = replace(
        rows,
        value=np.ascontiguousarray(rows.value[frames]),
        index=rows.index[frames],
        doubt=None if rows.doubt is None else np.ascontiguousarray(rows.doubt[frames]),
    )
    return part.windowed(window)


def throughout(
    plan: Plan, rows: Profiles, part: Profiles, fit: Fit, rough: Beat, *, follow: bool
) -> tuple[Profiles, Fit]:
    """Return a long take's ``rows`` in windows as long as those of the ``part`` that was fitted, and its fit as theirs.

    The ``rough`` beat's clock follows the strobe through the whole take to within a fraction of a flash; ``follow``
    says whether the picture shows more than that.
    """
    rows = rows.windowed(part.window_frames)
    start = replace(fit.beat, clock=_through(rough, fit.beat, part.ends_s))
    beat, error_s = clocks_of_chapters(plan, replace(rows, restless=part.restless), start) if follow else (start, 0.0)
    rest = unexplained(plan, rows, beat)
    scale = errors_of_residuals(rows, rest, 0.0)
    weight = 1.0 / (1.0 + (rest / (CAUCHY * scale)) ** 2) / scale**2
    rest = unexplained(plan, rows, beat, weight)
    return rows, replace(
        fit,
        beat=beat,
        rest=rest,
        weight=weight,
        shift_error_s=max(fit.shift_error_s, error_s),
        explained=explained(rows, rest),
    )


def _through(rough: Beat, beat: Beat, at_s: Doubles) -> FoundClock:
    """Return a rough clock moved and turned to another that is known at some times, as tails move all flashes."""
    line = np.polyfit(at_s, late_s(rough, beat, at_s), 1)
    pivot_s = float(at_s.mean())
    return rough.clock.shifted(float(np.polyval(line, pivot_s)), 1e6 * float(line[0]), pivot_s=pivot_s)


def clocks_of_chapters(plan: Plan, rows: Profiles, start: Beat) -> tuple[Beat, float]:
    """Return the beat with every chapter's own clock, from one that is near, and the root mean square of their errors.

    A chapter that does not show its clock is bridged from those beside it.
    """
    shortest_s = plan.shortest_flash_s
    at_s, bend_s, squares = list[Doubles](), list[Doubles](), list[float]()
    for chapter in _chapters(rows):
        part = rows.take(chapter)
        ends_s = part.ends_s
        own = fitted(plan, part, replace(start, clock=start.clock.bent(ends_s, np.zeros_like(ends_s))), ())
        ends_s[-1] -= 0.5 * rows.period_s  # where the next chapter begins is the next chapter's
        moved_s = late_s(start, own.beat, ends_s)
        sure = own.shift_error_s < SURE * shortest_s and float(np.abs(moved_s).max()) < FAR * shortest_s
        squares.append((own.shift_error_s if sure else SURE * shortest_s) ** 2)
        if sure:
            at_s.append(ends_s)
            bend_s.append(start.clock.bend(ends_s) + moved_s)
    error_s = float(np.sqrt(np.mean(squares)))
    if not at_s:
        return start, error_s
    knot_s, bends_s = (tuple(np.concatenate(one).tolist()) for one in (at_s, bend_s))
    return replace(start, clock=replace(start.clock, knot_s=knot_s, bend_s=bends_s)), error_s


def _chapters(rows: Profiles) -> list[slice]:
    """Return consecutive chapters of about as many row means as are enough for one, each of whole windows."""
    count = -(-rows.value.size // ENOUGH_SAMPLES)
    first = rows.window_start[np.arange(count) * len(rows.window_start) // count]
    return [slice(a, b) for a, b in zip(first.tolist(), [*first[1:].tolist(), len(rows.value)], strict=True)]
