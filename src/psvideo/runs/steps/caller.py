"""Who calls a run, Python or the command line: where its messages go, and how parameters are spelled in them."""

import logging
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from psvideo.clip import Clip, Kept
from psvideo.formats.rig_folder import rig_of_take
from psvideo.model.timing import Timing

_LOG = logging.getLogger("psvideo")


def as_in_python(text: str) -> str:
    """Return a sentence as it is: parameters stand in it as Python calls them."""
    return text


@dataclass(frozen=True, kw_only=True)
class Caller:
    """What a run says beside its result, and to whom; by default to Python's log under the name ``psvideo``.

    ``say`` takes what people wait for, ``warn`` what a result is to be distrusted for, ``detail`` what is good to know:
    whole sentences, as they come. ``spell`` puts a sentence that names parameters (`` `first_light` ``) into the
    caller's own words, for what is written into files. ``command`` is what was typed, for the report; empty in
    Python.
    """

    say: Callable[[str], None] = _LOG.info
    warn: Callable[[str], None] = _LOG.warning
    detail: Callable[[str], None] = _LOG.info
    spell: Callable[[str], str] = as_in_python
    command: str = ""


PYTHON = Caller()
"""Somebody's own Python."""


def say_of_clip(clip: Clip, caller: Caller) -> None:
    """Hand on what is odd about a clip."""
    for warning in clip.warnings:
        caller.warn(warning)
    for note in clip.notes:
        caller.detail(note)


def said_rig(named: Path | None, clip: Path, say: Callable[[str], None]) -> Path:
    """Return the rig that was named, or the one beside the footage, of which ``say`` hears. Raises UsageError as
    ``rig_of_take`` does."""
    path = rig_of_take(named, clip)
    if named is None:
        say(f"The lights stand where {path} says.")
    return path


def said_timing(timing: Timing, caller: Caller) -> Timing:
    """Hand on what a timing is to be distrusted for; return it in the caller's words, for files."""
    spelled = timing.spelled(caller.spell)
    for note in spelled.notes:
        caller.warn(note)
    return spelled


def say_kept(kept: Kept | None, caller: Caller) -> None:
    """Say how much disk decoded frames and moved plates took, and which frames found no room there."""
    if kept is None:
        return
    which = f"{len(kept)} decoded frames ({kept.bytes_held / 1e9:.2f} GB) were kept in"
    if kept.bytes_held and not len(kept):
        which = f"Decoded frames, or plates that were moved, ({kept.bytes_held / 1e9:.2f} GB at a time) passed through"
    caller.detail(f"{which} a temporary file beside the output; the file is gone.")
    if kept.missed:
        caller.warn(
            f"{kept.missed} decoded frames found no room on the output's disk, half of whose free space may be taken, "
            "and were decoded again where they were needed. Make room there, or name an output on another disk."
        )
