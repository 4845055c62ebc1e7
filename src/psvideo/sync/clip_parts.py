"""A clip in which the strobe began again: its parts, each with a strobe of its own, and one Timing of them all."""

from collections.abc import Sequence

from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.sync.frames_taken import FramesTaken, timing_of_take
from psvideo.sync.joined import Chapter, joined, named_alike
from psvideo.sync.named_strobe import FoundStrobe, named_strobe
from psvideo.sync.restarted import found_apart, found_beside_dark, found_in_parts, found_within
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.rowfit.moved_at_breaks import between_lone_ends, moved_at_breaks
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.restarts import dark_within, may_restart, odd_somewhere
from psvideo.sync.silent import silent
from psvideo.sync.unbroken import unbroken
from psvideo.sync.verdict.believed import Verdict


def parts_of(plan: Plan, rows: Profiles, verdict: Verdict) -> list[tuple[slice, ClipFit]]:
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
    if verdict.placed:  # by one place in the cycle for all frames: what does not fit is the subject
        return []
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
    parts = found_in_parts(plan, rows, verdict.seed)
    if not parts:
        parts = found_beside_dark(plan, rows)
        if believed and len(parts) == 1 and not odd_somewhere(whole):
            return []
    return [] if believed and unbroken(plan, whole, parts) else parts


def timing_of_parts(take: FramesTaken, parts: Sequence[tuple[slice, ClipFit]], first_light: str | None) -> Timing:
    """Return one timing of a take's parts, as ``parts_of`` gives them, each strobe's flashes under its own clock.

    Raises PsvideoError where ``first_light`` cannot be right.
    """
    strobes = _named_strobes(take, parts, first_light)
    chapters = [_chapter(take, cut, one) for (cut, _), one in zip(parts, strobes, strict=True)]
    return joined(chapters, take.dropped, take.outside([cut for cut, _ in parts]))


def _named_strobes(
    take: FramesTaken, parts: Sequence[tuple[slice, ClipFit]], first_light: str | None
) -> list[FoundStrobe]:
    """Return the strobes of a clip's parts, the same light under the same name in all of them.

    ``first_light`` is the first part's, wherever that begins: the clip's first complete flash lies in it.
    """
    strobes = [
        named_strobe(take.plan, found, None if n else first_light, take.only(cut).indices, take.breaks(cut))
        for n, (cut, found) in enumerate(parts)
    ]
    named = named_alike(take.plan, [(one.found, one.order) for one in strobes])
    return [FoundStrobe(found=found, order=order) for found, order in named]


def _chapter(take: FramesTaken, cut: slice, strobe: FoundStrobe) -> Chapter:
    part, breaks = take.only(cut), take.breaks(cut)
    return Chapter(
        first=int(part.numbers[0]),
        last=int(part.numbers[-1]),
        more=int(strobe.found.track.index[-1] - part.indices[-1]),
        timing=timing_of_take(part, strobe, breaks=breaks),
    )
