"""Opening a take: the clip, the plan that its strobe played, and the frames that are to be used."""

from dataclasses import replace
from pathlib import Path

from psvideo.clip import Clip, Take, open_clip, parse_range
from psvideo.clip.record import holes
from psvideo.errors import PsvideoError
from psvideo.formats.paths import path_if_given, path_of
from psvideo.strobe.as_played import as_played

MOST_MISSING, MOST_MISSING_SHARE = 10_000, 100
"""Where more frames are missing in a row than the first, and than this many times those that are there, it is not one
take: every flash in between would be counted."""


def open_take(path: Path | str, *, plan: Path | str | None = None, frames: str | None = None) -> Take:
    """Open a clip with its plan; frames are decoded later, when something looks at them.

    Parameters
    ----------
    path
        A folder of numbered frames with plan.toml, or a movie file.
    plan
        The plan, where it does not lie beside the footage. Where the strobe's log (strobe.json) lies beside it, the
        plan takes the times and powers that were played.
    frames
        File numbers to use, such as ``"1-100"`` or ``"1-100x2"``; left out, all.

    Returns
    -------
    Take
        ``plan``, a Plan; ``clip``, with ``width_px``, ``height_px`` and ``warnings`` about the footage; ``numbers`` of
        the frames to use.

    Raises
    ------
    PsvideoError
        Where there is no footage or no plan, or they do not fit together.

    Examples
    --------
    >>> import psvideo as ps
    >>> take = ps.open_take("take3/")
    >>> take.plan.lights, take.clip.width_px, len(take.numbers)
    (('key', 'left', 'top'), 160, 12)
    """
    clip = _as_played(open_clip(path_of("path", path), plan=path_if_given("plan", plan)))
    numbers = clip.numbers if frames is None else parse_range(frames, clip.numbers)
    _refuse_gulf(clip, numbers)
    return Take(clip=clip, numbers=numbers)


def _refuse_gulf(clip: Clip, numbers: tuple[int, ...]) -> None:
    """Raise PsvideoError where numbers are so far apart that they cannot be of one take."""
    most = max(MOST_MISSING, MOST_MISSING_SHARE * len(numbers))
    for before, count in holes(numbers):
        if count > most:
            raise PsvideoError(
                f"{clip.path}: after number {before} there are {count} missing, and {len(numbers)} frames are there. "
                "Expected the frames of one take: move the others elsewhere, or say with `frames` which are meant."
            )


def _as_played(clip: Clip) -> Clip:
    played = as_played(clip.plan, clip.plan_path)
    warnings = clip.warnings if played.warning is None else (*clip.warnings, played.warning)
    notes = clip.notes if played.note is None else (*clip.notes, played.note)
    return replace(clip, plan=played.plan, warnings=warnings, notes=notes)
