"""A frame as a source gives it."""

from dataclasses import dataclass

from psvideo.model.coded import Coded


@dataclass(frozen=True, kw_only=True)
class LiveFrame:
    """A frame as a source gives it: its place in time by the source's numbers, and when it came, by this machine.

    ``number`` is what its file is called by, where it has a file whose number nobody knew before.
    """

    index: int
    coded: Coded
    came_s: float
    number: int | None = None
