"""What is said while there is nothing to show: that no frame comes, or why the strobe is not found in those that do."""

from dataclasses import dataclass

from psvideo.live.status import LiveState

SILENT_S = 3.0
"""A source that gives nothing for this long is said to be silent: cameras and networks pause for less."""
AGAIN_S = 10.0
"""Reasons differ a little from search to search: another one is said after this long."""


@dataclass(kw_only=True)
class Waiting:
    """Holds what is said of the source called ``name``; ``check`` is what to look at where it is silent."""

    name: str
    check: str
    words: str = ""
    _frames: int = 0
    _came_s: float = 0.0
    _said_s: float = float("-inf")

    def look(self, at_s: float, *, state: LiveState, frames: int, why: str) -> str:
        """Return what to say at a time, "" for nothing: how many frames came, and why no strobe was found in them."""
        if frames != self._frames or state == "preparing":
            self._frames, self._came_s = frames, at_s
        if at_s - self._came_s >= SILENT_S:
            self.words = self._silent()
        elif state not in ("seeking", "lost") or not why:
            self.words, self._said_s = "", float("-inf")
        elif at_s - self._said_s >= AGAIN_S:
            self.words, self._said_s = why, at_s
        return self.words

    def _silent(self) -> str:
        so_far = f" after {self._frames} of them" if self._frames else " yet"
        return (
            f"{self.name}: no frames come{so_far}. Check {self.check}. The live view goes on once they come; Ctrl-C "
            "ends it."
        )
