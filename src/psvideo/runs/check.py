"""The check on the set: in seconds, from a few dozen frames, whether a take can be used. Nothing is written."""

import tempfile
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path

from psvideo.clip import Clip, Kept, Take, keeping_near
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import NoStrobeError, UsageError
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.rig_folder import rig_of_take
from psvideo.formats.rig_toml import read_rig
from psvideo.model.timing import Timing
from psvideo.plates.naming import named_by_rig
from psvideo.report.judge.of_frames import exposure_of_frames
from psvideo.report.judgement import Judgement
from psvideo.runs.instants.checked_rounds import lines_of
from psvideo.runs.steps.caller import PYTHON, Caller
from psvideo.runs.steps.checked import Check, write_checks_page
from psvideo.runs.steps.checked_frames import (
    frames_to_check,
    later_light,
    later_numbers,
    light_of_frames,
    more_frames,
    too_short,
    with_later_holes,
)
from psvideo.runs.steps.saturation import saturation_of
from psvideo.sync.open_take import open_take
from psvideo.sync.take_timing import find_timing

EXPOSED_FRAMES = 12
"""About this many frames show how a clip without a strobe is exposed."""
MOST_KEPT_BYTES = 1_500_000_000
"""Larger windows are decoded twice: temporary folders may lie in memory."""


def check(
    clip: Path | str,
    *,
    plan: Path | str | None = None,
    rig: Path | str | None = None,
    first_light: str | None = None,
    report: Path | str | None = None,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> Check:
    """Judge a take in seconds by frames from its start and a few from the rest, one line for each thing.

    - ``clip``: a folder of numbered frames with plan.toml, or a movie file. ``plan`` names the plan where it does not
      lie beside the footage.
    - ``rig``: where the lights are, to find their order where there is no marker; the plates are compared with it.
      ``first_light`` names the light of the clip's first complete flash, for plans without a marker.
    - ``report``: a page (HTML) to write of the check, outside of the footage. Nothing else is written.

    ``watch`` is handed every long loop, and ``caller`` says how parameters are spelled.

    Returns
    -------
    Check
        What was found: ``judgements``, each with ``subject``, ``grade``, ``found`` and ``advice``; ``usable`` says
        whether the take can be used, ``verdict`` is the sentence that sums the lines up.

    Raises
    ------
    UsageError
        Where the report would lie among the footage.
    PsvideoError
        Where the footage or its plan cannot be read, or there are too few frames to judge.

    Examples
    --------
    >>> import psvideo as ps
    >>> found = ps.check("take3/")
    >>> [line.subject for line in found.judgements if line.grade == "bad"]
    []
    """
    page, path = path_if_given("report", report), path_of("clip", clip)
    refuse_inside(page, path)
    found = judged_take(
        path,
        plan=path_if_given("plan", plan),
        rig=path_if_given("rig", rig),
        first_light=first_light,
        watch=watch,
        caller=caller,
    )
    if page is not None:
        write_checks_page(page, [found], {})
    return found


def refuse_inside(report: Path | None, footage: Path) -> None:
    """Raise UsageError where a page of checks would lie among footage: nothing is ever written there."""
    folder = footage if footage.is_dir() else footage.parent
    if report is not None and report.resolve().is_relative_to(folder.resolve()):
        raise UsageError(f"`report` {report}: lies among the footage of {folder}. Name a file somewhere else.")


def judged_take(
    path: Path,
    *,
    plan: Path | None,
    rig: Path | None,
    first_light: str | None,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> Check:
    """Judge a take, and write nothing. Raises PsvideoError as ``check`` does."""
    began = time.monotonic()
    whole = open_take(path, plan=plan)
    clip = whole.clip
    known = None if rig is None else read_rig(rig_of_take(rig, path), plan_lights=clip.plan.lights)
    window = frames_to_check(clip.plan, clip.numbers)
    later = later_numbers(clip, window)
    with _store(clip, window) as kept:
        take = replace(whole, numbers=window, kept=kept)
        try:
            take, timing = _timed(take, first_light, watch)
        except NoStrobeError as fault:
            if too_short(clip.plan, window):
                raise
            lines: tuple[Judgement, ...] = (
                _unseen(str(fault)),
                saturation_of(take) or exposure_of_frames(light_of_frames(take, EXPOSED_FRAMES)),
            )
            judged, notes = "", tuple[str, ...]()
        else:
            timing = timing if known is None else named_by_rig(take, timing, known)
            timing = with_later_holes(timing, clip)
            later = tuple(number for number in later if number > take.numbers[-1])
            lines = (*lines_of(take, timing, known, watch=watch), *later_light(take, later))
            judged = clip.curve_doubt
            said = {one.sentence for one in (timing.swing, timing.half) if one}
            notes = tuple(note for note in timing.notes if note not in said)
    return Check(
        clip=clip.name,
        path=path,
        frames=len(clip.numbers),
        looked_at=len(take.numbers) + len(later),
        seconds=time.monotonic() - began,
        judgements=tuple(one.spelled(caller.spell) for one in lines),
        warnings=tuple(caller.spell(one) for one in clip.warnings if one != judged),
        notes=tuple(map(caller.spell, (*clip.notes, *notes))),
    )


def _timed(take: Take, first_light: str | None, watch: Watch) -> tuple[Take, Timing]:
    """Return when a take's flashes fired, and the take with the frames that showed it: as many again, up to a bound,
    where the first ones are too few, as beside frames that are missing. Raises NoStrobeError where neither show it."""
    try:
        return take, find_timing(take, first_light=first_light, watch=watch)
    except NoStrobeError:
        more = more_frames(take)
        if not more:
            raise
        wider = replace(take, numbers=more)
        with suppress(NoStrobeError):
            return wider, find_timing(wider, first_light=first_light, watch=watch)
        raise


def _store(clip: Clip, window: Sequence[int]) -> AbstractContextManager[Kept | None]:
    """Return a store for the frames looked at, off the footage's disk; none where they would fill a small one."""
    samples = clip.width_px * clip.height_px * (1 if clip.cfa else clip.channels)
    if 2 * samples * len(window) > MOST_KEPT_BYTES:
        return nullcontext(None)
    return keeping_near(Path(tempfile.gettempdir()) / "psvideo-check")


def _unseen(reason: str) -> Judgement:
    return Judgement(subject="strobe", grade="bad", found=reason)
