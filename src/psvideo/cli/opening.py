"""What every command that reads a clip does first: open it, and say what is odd about it."""

from pathlib import Path

from psvideo.cli.console import Voice
from psvideo.clip import Take
from psvideo.runs.opening import open_take


def open_and_tell(clip: Path, voice: Voice, *, plan: Path | None, frames: str | None) -> Take:
    """Open a clip; its warnings are printed, and its notes where -v asks for them."""
    take = open_take(clip, plan=plan, frames=frames)
    for warning in take.clip.warnings:
        voice.warn(warning)
    for note in take.clip.notes:
        voice.detail(note)
    return take
