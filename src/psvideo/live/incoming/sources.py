"""What a user names as a source, opened: a finished clip, a folder that grows, a pipe, a stream, a device."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from psvideo.clip import Frame, open_clip
from psvideo.clip.linear import in_codes
from psvideo.clip.streams.genicam import is_genicam, read_genicam
from psvideo.clip.streams.growing_folder import read_growing
from psvideo.clip.streams.stream import STANDARD_INPUT, is_device, read_stream, stream_kind
from psvideo.errors import UsageError
from psvideo.formats.plan_toml import read_plan
from psvideo.live.incoming.live_frame import LiveFrame
from psvideo.live.incoming.source import LiveSource, plain_kind, played_clip
from psvideo.model.camera import Camera
from psvideo.model.choices import Pace
from psvideo.model.plan import Plan

PLAIN = ("gray", "rgb", "gbr")
"""Pixels, as FFmpeg calls them, that are codes as the plan explains them."""
SCHEMES = ("udp://", "rtsp://", "rtsps://", "srt://", "rtp://", "tcp://", "rtmp://", "http://", "https://")


def opened_source(
    source: str, *, plan: Path | None, pace: Pace = "own", growing: bool = False, raw: str | None = None
) -> LiveSource:
    """Return a source by what users call it: ``-``, a URL, a device, ``genicam``, a clip, with ``growing`` a folder.

    Raises UsageError where what is needed for it was not given.
    """
    if growing:
        left_out: list[str] = []
        found = _live(
            source, plan, lambda one: read_growing(Path(source), one.camera, noted=left_out.append), files=True
        )
        return replace(found, notes=left_out, check="that the recorder still writes its frames into this folder")
    if is_genicam(source):
        notes: list[str] = []
        found = _live(source, plan, lambda camera_plan: read_genicam(source, camera_plan.camera, noted=notes.append))
        explained = found.plan.camera.encoding.white_level is not None
        return replace(found, plan_path=plan if explained else None, notes=notes)
    if source == STANDARD_INPUT or is_device(source) or source.lower().startswith(SCHEMES):
        said: list[str] = []
        found = _live(source, plan, lambda one: read_stream(source, one.camera, raw=raw, noted=said.append))
        explained = raw is not None and raw.startswith(PLAIN)
        kind = in_codes(stream_kind(raw), found.plan.camera.encoding)
        found = replace(found, notes=said, plan_path=plan if explained else None, kind=kind)
        return found if raw is None else replace(found, slow_hint=_bare_bytes_hint(found.plan.camera, raw))
    if raw is not None:
        raise UsageError("`raw` says what bare bytes from standard input or the network hold; a clip's files say it.")
    return played_clip(open_clip(Path(source), plan=plan), pace=pace)


def _bare_bytes_hint(camera: Camera, raw: str) -> str:
    """Say that frames of another size, or of other pixels, would be cut wrongly: nobody sees that in bare bytes."""
    return (
        f"Or they are not {camera.width_px} x {camera.height_px} pixels of {raw}, as plan and `raw` say: bare bytes of "
        "another size are cut at the wrong places, and show no strobe."
    )


def _live(
    source: str, plan: Path | None, read: Callable[[Plan], Iterable[Frame]], *, files: bool = False
) -> LiveSource:
    """Return a source of frames that come as they are taken; ``files``: each is a file of its own, with a number."""
    if plan is None:
        raise UsageError(
            f"{source}: nothing lies beside frames that come as they are taken, so the plan must be named: `plan`."
        )
    planned = read_plan(plan)

    def frames() -> Iterator[LiveFrame]:
        for frame in read(planned):
            number = frame.number if files else None
            yield LiveFrame(index=frame.index, coded=frame.coded, came_s=time.monotonic(), number=number)

    name = "standard input" if source == STANDARD_INPUT else source
    camera = planned.camera
    return LiveSource(
        name=name,
        plan=planned,
        frames=frames,
        cfa=camera.encoding.cfa,
        first_number=1,
        kind=plain_kind(camera.encoding),
    )
