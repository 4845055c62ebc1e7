"""Where live frames come from: what is known of a source before its first frame, and the frames as they come."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from psvideo.clip import Clip, read_frames
from psvideo.clip.decoded import CodedPicture, Header
from psvideo.clip.linear import in_codes
from psvideo.errors import PsvideoError
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.model.camera import Encoding
from psvideo.model.choices import Pace
from psvideo.model.coded import Coded
from psvideo.model.plan import Plan

PLAIN = ("png", "tiff")
"""Kinds of files that say nothing of their codes: the plan does."""


@dataclass(frozen=True, kw_only=True)
class LiveSource:
    """A source of frames. ``frames`` gives them, each with its place in time by the source's own count or time stamps.

    ``kind`` is a few pixels as its frames are likely to be coded.
    ``first_number`` is what the first frame is called by, where it does not say so itself. ``cfa`` is the filter
    pattern of a mosaic. ``channels`` is how many its pictures have once they are demosaiced, None where only its frames
    will tell.
    ``plan_path`` is the plan's file where the frames are plain codes that it explains. ``paced``: frames come
    when they are due, and not as soon as somebody wants them. ``warnings`` say what is odd about it, ``notes``
    what happened to it on the way; ``check`` what to look at where no frames come, ``slow_hint`` what else it may mean
    that they come slowly.
    """

    name: str
    plan: Plan
    frames: Callable[[], Iterator[LiveFrame]]
    kind: Coded
    cfa: str | None = None
    channels: int | None = None
    first_number: int = 0
    plan_path: Path | None = None
    paced: bool = True
    warnings: tuple[str, ...] = ()
    notes: list[str] = field(default_factory=list)
    slow_hint: str = ""
    check: str = "that the camera or the sender runs, its cable, and the address and port that it sends to"


FEW_PX = 2
BYTE = 255


def plain_kind(encoding: Encoding) -> Coded:
    """Return a few pixels as a camera is likely to code them: grey, of 8 bits where the plan says that 255 is white."""
    bits = 8 if encoding.white_level is not None and encoding.white_level <= BYTE else 16
    header = Header(width_px=FEW_PX, height_px=FEW_PX, channels=1, bits=bits, cfa=encoding.cfa)
    codes = np.zeros((FEW_PX, FEW_PX), f"u{bits // 8}")
    return in_codes(CodedPicture(header=header, codes=codes), encoding)


def _kind(clip: Clip) -> Coded:
    """Return a few pixels of a clip's first frame."""
    coded = next(iter(read_frames(clip, clip.numbers[:1]))).coded
    return Coded(codes=np.asarray(coded.codes[:FEW_PX])[:, :FEW_PX], tone=coded.tone)


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
        kind=_kind(clip),
        frames=frames,
        cfa=clip.cfa,
        channels=clip.channels,
        first_number=clip.numbers[0],
        plan_path=clip.plan_path if clip.kind in PLAIN and clip.header.bits in (8, 16) else None,
        paced=pace == "own",
        warnings=clip.warnings,
    )
