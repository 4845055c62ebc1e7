"""The check on the set: in seconds, from a few dozen frames, whether a take can be used. Nothing is written."""

import tempfile
import time
from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path

from psvideo.clip import Clip, Kept, keeping_near
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import UsageError
from psvideo.formats.paths import path_if_given, path_of
from psvideo.formats.rig_folder import rig_beside
from psvideo.formats.rig_toml import read_rig
from psvideo.plates.naming import named_by_rig
from psvideo.report.judge.of_frames import FrameLight, exposure_of_frames
from psvideo.report.judgement import Judgement
from psvideo.runs.instants.checked_rounds import lines_of
from psvideo.runs.steps.caller import PYTHON, Caller, said_rig
from psvideo.runs.steps.checked import Check, write_checks_page
from psvideo.runs.steps.checked_frames import (
    frames_to_check,
    later_light,
    later_numbers,
    light_by_number,
    light_of_frames,
    with_later_holes,
)
from psvideo.runs.steps.saturation import saturation_of
from psvideo.runs.steps.where_to_look import LookedAt, in_vain_words, look, where_words
from psvideo.sync.open_take import open_take

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

    Where the start shows no strobe, or far less light than the rest, that part is judged which shows most of it, and a
    note says which.

    - ``clip``: a folder of numbered frames with plan.toml, or a movie file. ``plan`` names the plan where it does not
      lie beside the footage.
    - ``rig``: where the lights are, to find their order where there is no marker; the plates are compared with it. Of a
      folder of rigs the one is taken that is named after the clip. Left out, rig.toml beside the footage; a note says
      so. ``first_light`` names the light of the clip's first complete flash, for plans without a marker.
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
    beside, said_of_rig = rig is not None or rig_beside(path) is not None, list[str]()
    known = read_rig(said_rig(rig, path, said_of_rig.append), plan_lights=clip.plan.lights) if beside else None
    window = frames_to_check(clip.plan, clip.numbers)
    with _store(clip, window) as kept:
        start = replace(whole, numbers=window, kept=kept)
        late = light_by_number(start, later_numbers(clip, window))
        looked = look(start, late.values(), first_light=first_light, watch=watch)
        take, timing = looked.take, looked.timing
        if timing is None:
            lines, judged, notes = _without_strobe(looked, late.values()), "", tuple[str, ...]()
        else:
            timing = timing if known is None else named_by_rig(take, timing, known)
            timing = with_later_holes(timing, clip)
            rest = [light for number, light in late.items() if number not in take.numbers]
            lines = (*lines_of(take, timing, known, watch=watch), *later_light(take, rest, elsewhere=looked.moved))
            judged = clip.curve_doubt
            said = {one.sentence for one in (timing.swing, timing.half) if one}
            notes = (*where_words(looked), *(note for note in timing.notes if note not in said))
    return Check(
        clip=clip.name,
        path=path,
        frames=len(clip.numbers),
        looked_at=len({*looked.numbers, *late}),
        judged=(take.numbers[0], take.numbers[-1]),
        seconds=time.monotonic() - began,
        judgements=tuple(one.spelled(caller.spell) for one in lines),
        warnings=tuple(caller.spell(one) for one in clip.warnings if one != judged),
        notes=tuple(map(caller.spell, (*said_of_rig, *clip.notes, *notes))),
    )


def _without_strobe(looked: LookedAt, late: Iterable[FrameLight]) -> tuple[Judgement, ...]:
    """Judge a take in which no strobe was found, at none of the parts that were looked at."""
    lights = [
        *light_of_frames(looked.take, EXPOSED_FRAMES),
        *late,
        *(one for at in looked.glances for one in at.lights),
    ]
    return (
        Judgement(subject="strobe", grade="bad", found=in_vain_words(looked)),
        saturation_of(looked.take) or exposure_of_frames(lights),
    )


def _store(clip: Clip, window: Sequence[int]) -> AbstractContextManager[Kept | None]:
    """Return a store for the frames looked at, off the footage's disk; none where they would fill a small one."""
    samples = clip.width_px * clip.height_px * (1 if clip.cfa else clip.channels)
    if 2 * samples * len(window) > MOST_KEPT_BYTES:
        return nullcontext(None)
    return keeping_near(Path(tempfile.gettempdir()) / "psvideo-check")
