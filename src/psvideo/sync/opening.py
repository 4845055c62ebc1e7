"""Opening a take: the clip, the plan that its strobe played, and the frames that are to be used."""

from dataclasses import replace
from pathlib import Path

from psvideo.clip import Clip, Take, open_clip, parse_range
from psvideo.strobe.runlog import as_played


def open_take(path: Path, *, plan: Path | None = None, frames: str | None = None) -> Take:
    """Open a clip; ``frames`` is a range of file numbers such as ``1-100``.

    Where the strobe's log (strobe.json) lies beside the plan, the plan takes the times and powers that were played.
    """
    clip = _as_played(open_clip(path, plan=plan))
    numbers = clip.numbers if frames is None else parse_range(frames, clip.numbers)
    return Take(clip=clip, numbers=numbers)


def _as_played(clip: Clip) -> Clip:
    played = as_played(clip.plan, clip.plan_path)
    warnings = clip.warnings if played.warning is None else (*clip.warnings, played.warning)
    notes = clip.notes if played.note is None else (*clip.notes, played.note)
    return replace(clip, plan=played.plan, warnings=warnings, notes=notes)
