"""Where live frames come from: what is known of a source before its first frame, and the frames as they come."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from psvideo.clip import Clip, read_frames
from psvideo.errors import PsvideoError
from psvideo.live.chain import LiveFrame
from psvideo.model.choices import Pace
from psvideo.model.plan import Plan

PLAIN = ("png", "tiff")
"""Kinds of files that say nothing of their codes: the plan does."""


@dataclass(frozen=True, kw_only=True)
class LiveSource:
    """A source of frames. ``frames`` gives them, each with its place in time by the source's own count or time stamps.

    ``first_number`` is what the first frame's file is called by, where there is one. ``cfa`` is the filter pattern of a
    mosaic. ``plan_path`` is the plan's file where the frames are plain codes that it explains. ``paced``: frames come
    when they are due, and not as soon as somebody wants them. ``warnings`` say what is odd about it, ``notes``
    what happened to it on the way.
    """

    name: str
    plan: Plan
    frames: Callable[[], Iterator[LiveFrame]]
    cfa: str | None = None
    first_number: int = 0
    plan_path: Path | None = None
    paced: bool = True
    warnings: tuple[str, ...] = ()
    notes: list[str] = field(default_factory=list)


def played_clip(clip: Clip, *, pace: Pace = "own") -> LiveSource:
    """Return a finished clip as a source: at its own pace, or as fast as it is taken.

    Raises PsvideoError where its frames lie on their side.
    """
    if clip.turn.transposed:
        raise PsvideoError(
            f"{clip.path}: its frames are to be turned by a quarter, and the live view shows frames as the sensor read "
            "them. Use psvideo normals and psvideo view for this clip."
        )

    def frames() -> Iterator[LiveFrame]:
        period_s, began_s = clip.plan.camera.frame_period_s, None
        for frame in read_frames(clip, ahead=8):
            if pace == "own":
                began_s = time.monotonic() if began_s is None else began_s
                due_s = began_s + frame.index * period_s
                time.sleep(max(due_s - time.monotonic(), 0.0))
            yield LiveFrame(index=frame.index, coded=frame.coded, came_s=time.monotonic())

    return LiveSource(
        name=clip.name,
        plan=clip.plan,
        frames=frames,
        cfa=clip.cfa,
        first_number=clip.numbers[0],
        plan_path=clip.plan_path if clip.kind in PLAIN and clip.header.bits in (8, 16) else None,
        paced=pace == "own",
        warnings=clip.warnings,
    )
