"""How many frames came, and how many a source left out by its own numbers."""

from dataclasses import dataclass, replace

from psvideo.live.incoming.live_frame import LiveFrame


@dataclass(frozen=True, kw_only=True)
class NumberGap:
    """Numbers that no frame had: ``count`` of them after the frame that was numbered ``after``."""

    after: int
    count: int


@dataclass(frozen=True, kw_only=True)
class FrameCount:
    """All frames so far: how many, the first one's and the last one's number, and the numbers that never came.

    ``first_file`` is what the first frame's file is called by, where only the frame itself said so.
    """

    seen: int = 0
    first: int = 0
    last: int = 0
    gaps: tuple[NumberGap, ...] = ()
    first_file: int | None = None

    @property
    def missing(self) -> int:
        """How many numbers no frame had."""
        return sum(gap.count for gap in self.gaps)

    def after(self, frame: LiveFrame) -> "FrameCount":
        """Return the count with one more frame."""
        index = frame.index
        if not self.seen:
            return FrameCount(seen=1, first=index, last=index, first_file=frame.number)
        skipped = index - self.last - 1
        gaps = (*self.gaps, NumberGap(after=self.last, count=skipped)) if skipped > 0 else self.gaps
        return replace(self, seen=self.seen + 1, last=index, gaps=gaps)
