"""Plans whose warnings the user has confirmed: their checksums in the user's state folder, one per line."""

import os
import sys
from pathlib import Path

from psvideo.errors import PsvideoError
from psvideo.formats.whole_files import write_text

KEPT = 1000


def state_folder() -> Path:
    """Return the folder in which programs keep what they remember for this user."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "psvideo"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "psvideo"
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "psvideo"


def is_confirmed(sha256: str, *, folder: Path) -> bool:
    """Return whether the warning for this plan was confirmed before."""
    return sha256 in _read(folder)


def remember(sha256: str, *, folder: Path) -> bool:
    """Remember that the warning was confirmed; False where nothing can be written, and it will be asked again."""
    known = [line for line in _read(folder) if line != sha256]
    try:
        write_text(folder / "confirmed", "\n".join([*known[-KEPT:], sha256]) + "\n")
    except PsvideoError:
        return False
    return True


def _read(folder: Path) -> list[str]:
    try:
        return (folder / "confirmed").read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        return []
