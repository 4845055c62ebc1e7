"""Find when every flash fired, from the picture alone: row profiles in, Timing out.

One global fit over many frames instead of a search for each frame's darkest row (``rowfit``): the strobe's phase and
the ratio of the two clocks are searched, the brightness of every row under every light is eliminated. A coarse grid
over a few dozen frames finds the place in the cycle; from there the clip is tracked, frames that were dropped or
repeated without a word are found, and a robust fit over all frames sharpens the clock, its drift, and what the plan
does not know exactly: readout, exposure, the LEDs' tails. The cycle's marker shows which light is which.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import NoStrobeError, PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.first_light import TOGETHER, check_first_light, first_lit, is_called
from psvideo.model.plan import HasLights, Plan
from psvideo.model.timing import DroppedFrames, Order, Timing
from psvideo.model.units import counted
from psvideo.sync.black_frames import remarks_on_black
from psvideo.sync.flashes_seen import flashes_of_fit, synced_timing, timing_of_fit
from psvideo.sync.joined import Chapter, joined, named_alike
from psvideo.sync.marks import marks_of
from psvideo.sync.restarted import found_apart, found_beside_dark, found_in_parts, found_within
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.moved_at_breaks import between_lone_ends, moved_at_breaks
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.restarts import dark_within, may_restart, odd_somewhere
from psvideo.sync.rowfit.tracking.course import window_frames
from psvideo.sync.silent import silent
from psvideo.sync.turns import turns
from psvideo.sync.unbroken import unbroken
from psvideo.sync.unfired import only_fired, remarks_on_unfired
from psvideo.sync.verdict.believed import Verdict, believed_fit
from psvideo.sync.verdict.frame_remarks import remarks_on_frames
from psvideo.sync.verdict.refusal import (
    clock_too_far,
    in_step_with_frames,
    nothing_to_find,
    other_times_as_well,
    shows_the_same,
    why_not,
)
from psvideo.sync.verdict.remarks import remarks, remarks_on_lights

ADVICE = (
    "Check that plan.toml is the plan that the strobe played (frame rate, flash durations, dark time), that the lights "
    "flashed brightly enough, and that the exposure was fixed."
)


def timing_from_rows(
    plan: Plan,
    indices: NDArray[np.int64],
    profiles: Doubles,
    *,
    clip: str = "clip",
    first_light: str | None = None,
    dropped: Sequence[DroppedFrames] = (),
    numbers: Sequence[int] | None = None,
    doubt: NDArray[np.floating] | None = None,
) -> Timing:
    """Return when every flash of a clip fired.

    ``indices`` (frame,) are the frames' places in time by their numbering and ``profiles`` (frame, row) their row
    means in linear light; ``doubt`` (frame, row) is by how much a mean may be wrong beyond noise (saturated pixels).
    ``numbers`` (frame,) are the frames' own numbers, by which dropped and repeated ones are reported (left out: the
    indices). Raises PsvideoError where the profiles do not look like the plan's strobe.
    """
    check_first_light(plan, first_light)
    if plan.mode == "synced":
        return synced_timing(plan, indices, clip=clip, dropped=dropped, first_light=first_light)
    rows = _to_fit(plan, indices, profiles, doubt, clip=clip)
    verdict = believed_fit(plan, rows)
    _refuse_where_others_fit(plan, verdict, clip)  # of their parts, shorter ones show even less
    take = _Take(
        plan=plan,
        clip=clip,
        indices=np.asarray(indices, np.int64),
        numbers=np.asarray(indices if numbers is None else numbers, np.int64),
        dropped=tuple(dropped),
    )
    parts = _parts(plan, rows, verdict)
    if parts:
        strobes = _named_strobes(take, parts, first_light)
        chapters = [_chapter(take, cut, one) for (cut, _), one in zip(parts, strobes, strict=True)]
        return joined(chapters, take.dropped, take.outside([cut for cut, _ in parts]))
    _refuse_unless_believed(plan, rows, verdict, clip)
    return _timing(take, _strobe(plan, verdict.found, first_light, take.indices))


@dataclass(frozen=True, kw_only=True)
class _Take:
    """The frames (frame,) that were looked at, by their places in time and their numbers, and what is known of them."""

    plan: Plan
    clip: str
    indices: NDArray[np.int64]
    numbers: NDArray[np.int64]
    dropped: tuple[DroppedFrames, ...]

    def only(self, frames: slice) -> "_Take":
        """Return some consecutive frames of the take, with the holes that their numbers show."""
        numbers = self.numbers[frames]
        dropped = tuple(hole for hole in self.dropped if numbers[0] <= hole.after < numbers[-1])
        return replace(self, indices=self.indices[frames], numbers=numbers, dropped=dropped)

    def breaks(self, frames: slice) -> tuple[bool, bool]:
        """Return whether some consecutive frames begin, and whether they end, elsewhere than the take."""
        return frames.start > 0, frames.stop < len(self.numbers)

    def outside(self, parts: Sequence[slice]) -> list[tuple[int, int]]:
        """Return the first and last numbers of the stretches of frames that lie in none of some parts, in order."""
        edges = [0, *(edge for part in parts for edge in (part.start, part.stop)), len(self.numbers)]
        gaps = zip(edges[::2], edges[1::2], strict=True)
        return [(int(self.numbers[first]), int(self.numbers[end - 1])) for first, end in gaps if end > first]


def _parts(plan: Plan, rows: Profiles, verdict: Verdict) -> list[tuple[slice, ClipFit]]:
    """Return the parts of a clip in which the strobe is found, nothing where the clip is one (or nothing is found).

    Six ways out, the first that holds; the first five with a fit of the whole clip that is believed:

    1. It fits everywhere, no frames are missing (``may_restart``), and none lie in the dark amid others: one clip.
    2. It fits by missing frames or across a pause, but the strobe moved by what they do not explain
       (``moved_at_breaks``): the parts between those breaks. Where it did not, and there is only the pause: one clip.
    3. Missing frames part a frame or two at an end from the others, as where the strobe stopped within a frame: the
       parts that are found among the others.
    4. No parts are found by themselves, but for one beside the dark, and the whole fits no frames worse than others:
       one clip.
    5. Parts are found, and the whole's strobe is that of each (``unbroken``): one clip.
    6. Else the parts that were found, or the one beside the dark; none where there are none, and then it is the whole
       fit that is believed or refused.
    """
    whole, believed = verdict.found, verdict.believed
    may = may_restart(plan, rows, whole)
    if believed and not may and not dark_within(whole):
        return []
    apart = found_apart(plan, rows, moved_at_breaks(plan, whole, silent(plan, whole))) if believed else []
    if len(apart) > 1:
        return apart
    if believed and not may:
        return []
    inner = between_lone_ends(whole) if believed else None
    within = found_within(plan, rows, inner) if inner else []
    if within:
        return within
    parts = found_in_parts(plan, rows)
    if not parts:
        parts = found_beside_dark(plan, rows)
        if believed and len(parts) == 1 and not odd_somewhere(whole):
            return []
    return [] if believed and unbroken(plan, whole, parts) else parts


def _named_strobes(take: _Take, parts: Sequence[tuple[slice, ClipFit]], first_light: str | None) -> list["FoundStrobe"]:
    """Return the strobes of a clip's parts, the same light under the same name in all of them.

    ``first_light`` is the first part's, wherever that begins: the clip's first complete flash lies in it.
    """
    strobes = [
        _strobe(take.plan, found, None if n else first_light, take.only(cut).indices, take.breaks(cut))
        for n, (cut, found) in enumerate(parts)
    ]
    named = named_alike(take.plan, [(one.found, one.order) for one in strobes])
    return [FoundStrobe(found=found, order=order) for found, order in named]


def _chapter(take: _Take, cut: slice, strobe: "FoundStrobe") -> Chapter:
    part, breaks = take.only(cut), take.breaks(cut)
    return Chapter(
        first=int(part.numbers[0]),
        last=int(part.numbers[-1]),
        more=int(strobe.found.track.index[-1] - part.indices[-1]),
        timing=_timing(part, strobe, breaks=breaks),
    )


def _timing(take: _Take, strobe: "FoundStrobe", *, breaks: tuple[bool, bool] = (False, False)) -> Timing:
    """Return the timing of a take, or of a part of one; ``breaks``: whether it begins and ends where the strobe did."""
    plan, found, beat = take.plan, strobe.found, strobe.found.fit.beat
    timing = timing_of_fit(
        plan,
        found,
        order=strobe.order,
        clip=take.clip,
        dropped=_all_dropped(take.dropped, take.numbers, take.indices, found.track.index),
        repeated=tuple(int(number) for number in take.numbers[found.track.repeated]),
    )
    marks = marks_of(plan, found, timing.flashes, take.indices, breaks)
    black, seen, unfired, fired = marks.black, marks.seen, marks.unfired, marks.fired
    notes = (
        *remarks(plan, found, steady=only_fired(found, seen, unfired)),
        *remarks_on_lights(plan, found, beat, named=strobe.order != "guess"),
        *remarks_on_frames(plan, found, take.indices),
        *remarks_on_black(found, black, take.numbers),
        *remarks_on_unfired(found, seen, fired, take.numbers),
    )
    return replace(timing, flashes=fired, notes=notes)


@dataclass(frozen=True, kw_only=True)
class FoundStrobe:
    """The fit of a clip whose beat names every flash, and how these names are known."""

    found: ClipFit
    order: Order


def find_strobe(
    plan: Plan,
    indices: NDArray[np.int64],
    profiles: Doubles,
    *,
    clip: str = "clip",
    first_light: str | None = None,
    doubt: NDArray[np.floating] | None = None,
    most_rows: int | None = None,
) -> FoundStrobe:
    """Return the strobe's clock against the camera's, from row profiles as ``timing_from_rows`` takes them.

    Neighbouring rows are averaged to ``most_rows`` where there are more: less time, and a little less sure. Raises
    NoStrobeError where the profiles do not look like the plan's strobe.
    """
    rows = _to_fit(plan, indices, profiles, doubt, clip=clip)
    rows = rows if most_rows is None else rows.binned(most_rows)
    verdict = believed_fit(plan, rows)
    _refuse_unless_believed(plan, rows, verdict, clip)
    return _strobe(plan, verdict.found, first_light, indices)


def _to_fit(
    plan: Plan,
    indices: NDArray[np.int64],
    profiles: Doubles,
    doubt: NDArray[np.floating] | None,
    *,
    clip: str,
) -> Profiles:
    rows = _as_profiles(plan, indices, profiles, doubt)
    hopeless = nothing_to_find(plan, rows)
    if hopeless:
        raise NoStrobeError(f"{clip}: {hopeless}")
    return rows


def _refuse_unless_believed(plan: Plan, rows: Profiles, verdict: Verdict, clip: str) -> None:
    _refuse_where_others_fit(plan, verdict, clip)
    if not verdict.believed:
        raise NoStrobeError(_not_found(plan, rows, verdict.found, clip))


def _refuse_where_others_fit(plan: Plan, verdict: Verdict, clip: str) -> None:
    if verdict.other is not None:
        raise NoStrobeError(f"{clip}: {other_times_as_well(plan, verdict.found, verdict.other)}")


def _strobe(
    plan: Plan,
    found: ClipFit,
    first_light: str | None,
    indices: NDArray[np.int64],
    breaks: tuple[bool, bool] = (False, False),
) -> FoundStrobe:
    beat, order, apart_s = _order_of_lights(plan, found, first_light, indices, breaks)
    error_s = float(np.hypot(found.fit.shift_error_s, apart_s))
    return FoundStrobe(found=replace(found, fit=replace(found.fit, beat=beat, shift_error_s=error_s)), order=order)


def _not_found(plan: Plan, rows: Profiles, found: ClipFit, clip: str) -> str:
    if shows_the_same(plan, found.rows, found.fit.beat):
        return f"{clip}: {in_step_with_frames(plan)}"
    reason = why_not(plan, rows) or clock_too_far(plan, found)
    explained = f"explains {100 * max(found.fit.explained, 0):.0f} % of the rows' changes from frame to frame"
    if found.steps:
        explained = (
            f"{explained}, but only if frames are missing or repeated at {counted(found.steps, 'place')} that their "
            "numbers do not show"
        )
    return f"{clip}: no strobe like the plan's was found in the picture: the best fit {explained}. {reason or ADVICE}"


def _as_profiles(
    plan: Plan, indices: NDArray[np.int64], values: Doubles, doubt: NDArray[np.floating] | None
) -> Profiles:
    """Lay out the profiles for fitting, rows in the order in which they open as far as that is known."""
    height = values.shape[1]
    rows = Profiles(
        value=np.ascontiguousarray(values, np.float64),
        index=np.asarray(indices, np.int64),
        period_s=plan.camera.frame_period_s,
        place=np.arange(height, dtype=np.float64),
        window_start=np.zeros(1, np.int64),
        doubt=None if doubt is None else np.ascontiguousarray(doubt, np.float64),
    )
    return rows.windowed(window_frames(plan))


def _order_of_lights(
    plan: Plan, found: ClipFit, first_light: str | None, indices: NDArray[np.int64], breaks: tuple[bool, bool]
) -> tuple[Beat, Order, float]:
    """Return the beat whose names are right, how they are known, and by how much times are wrong if they are not."""
    if len(plan.cycle_slots) == 1:
        return found.fit.beat, "given", 0.0
    candidates = turns(plan, found.rows, found.fit.beat)
    if first_light is not None:
        firsts = [_first_complete(plan, found, beat, indices, breaks) for beat in candidates.beats]
        return _given_order(candidates.beats, firsts, first_light), "given", 0.0
    return candidates.beats[0], "marker" if candidates.sure else "guess", candidates.apart_s


def _given_order(alike: Sequence[Beat], firsts: Sequence[HasLights | None], first_light: str) -> Beat:
    for beat, first in zip(alike, firsts, strict=True):
        if first is not None and is_called(first, first_light):
            return beat
    seen = firsts[0]
    raise PsvideoError(
        f"`first_light` {first_light} does not fit the footage: by the cycle's marker the clip's first complete flash "
        f"is {TOGETHER.join(seen.lit) if seen else 'none'}'s. Leave the option out, or check that plan.toml is the plan"
        " that the strobe played."
    )


def _first_complete(
    plan: Plan, found: ClipFit, beat: Beat, indices: NDArray[np.int64], breaks: tuple[bool, bool]
) -> HasLights | None:
    """Return the first lit flash that the timing will call complete, if the beat's names are right."""
    named = replace(found, fit=replace(found.fit, beat=beat))
    marks = marks_of(plan, named, flashes_of_fit(plan, found, beat), indices, breaks)
    return first_lit(flash for flash in marks.fired if flash.complete)


def _all_dropped(
    holes: Sequence[DroppedFrames], numbers: NDArray[np.int64], indices: NDArray[np.int64], index: NDArray[np.int64]
) -> tuple[DroppedFrames, ...]:
    """Return the holes that the numbering shows with those that only the picture shows."""
    counts = {hole.after: hole.count for hole in holes}
    for n in np.flatnonzero(np.diff(index) > np.maximum(np.diff(indices), 1)):
        more = int(index[n + 1] - index[n] - max(indices[n + 1] - indices[n], 1))
        counts[int(numbers[n])] = counts.get(int(numbers[n]), 0) + more
    return tuple(DroppedFrames(after=after, count=count) for after, count in sorted(counts.items()))
