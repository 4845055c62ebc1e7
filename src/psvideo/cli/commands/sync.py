"""psvideo sync: find when every flash fired, and how the clocks of cameras that saw the same ones stand."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import ClipWords, Force, OrderRig
from psvideo.cli.options.records import spread
from psvideo.cli.options.typed import parse_starts_s
from psvideo.errors import UsageError
from psvideo.model.units import counted

if TYPE_CHECKING:
    from psvideo.model.camera_clocks import CameraClocks
    from psvideo.model.timing import Timing

ClipPaths = Annotated[
    list[Path],
    typer.Argument(
        help="A clip: a folder of numbered frames with plan.toml, or a movie file. Several clips of cameras that "
        "saw the same strobe: their clocks are compared.",
        show_default=False,
    ),
]
Starts = Annotated[
    str | None,
    typer.Option(
        "--starts",
        help="Several cameras: roughly when each clip began, in seconds on one common clock: 0,1.3,2.1; needed "
        "if the marker is not coded.",
    ),
]

TimingOut = Annotated[
    Path | None,
    typer.Option(
        "-o", "--out", help="Where to write timing.json (several cameras: clocks.json); left out: only a summary."
    ),
]
PictureOut = Annotated[
    Path | None, typer.Option("--picture", help="PNG to write that shows how well the flashes were found.")
]


@spread
def sync(
    clip: ClipPaths,
    *,
    out: TimingOut = None,
    words: ClipWords,
    rig: OrderRig = None,
    picture: PictureOut = None,
    starts: Starts = None,
    force: Force = False,
    voice: Voice,
) -> None:
    """Find phase, clock offset, light order and dropped frames of a strobed clip, from the picture alone."""
    from psvideo.formats.timing_json import timing_record
    from psvideo.runs.sync import sync as find

    if len(clip) > 1:
        _refuse_of_one(**vars(words), rig=rig, picture=picture)
        _several(clip, out, starts, force, voice)
        return
    if starts is not None:
        raise UsageError("`starts` compares several cameras' clips, and one was given.")
    timing = find(
        clip[0],
        out=out,
        **vars(words),
        rig=rig,
        picture=picture,
        force=force,
        watch=voice.track,
        caller=voice.caller(),
    )
    voice.result(timing_record(timing))
    voice.say(describe_timing(timing))
    for written in (out, picture):
        if written is not None:
            voice.say(f"{written}: written.")


def _refuse_of_one(**options: object) -> None:
    for name, value in options.items():
        if value is not None:
            raise UsageError(f"`{name}` belongs to one clip, and several were given. Call sync for that clip alone.")


def _several(clips: list[Path], out: Path | None, starts: str | None, force: bool, voice: Voice) -> None:
    from psvideo.formats.clocks_json import clocks_record
    from psvideo.runs.sync_cameras import sync_cameras

    starts_s = None if starts is None else parse_starts_s(starts)
    clocks = sync_cameras(clips, out=out, starts_s=starts_s, force=force, watch=voice.track, caller=voice.caller())
    voice.result(clocks_record(clocks))
    voice.say(describe_clocks(clocks))
    if out is not None:
        voice.say(f"{out}: written.")


def describe_clocks(clocks: "CameraClocks") -> str:
    """Return how the cameras' clocks stand, a line for each."""
    first, *others = clocks.cameras
    lines = [f"{first.clip}: the reference. {NUMBERING_SENTENCE[clocks.numbering]}"]
    for camera in others:
        drift = f", drifting by {camera.drift_ppm_per_s:+.3g} ppm a second" if camera.drift_ppm_per_s else ""
        lines.append(
            f"{camera.clip}: began {camera.offset_s:+.6f} s after it, {camera.rate_ppm:+.2f} ppm{drift}; "
            f"{camera.shared} flashes shared, times known to {camera.error_s * 1e6:.2g} us."
        )
    return "\n".join(lines)


NUMBERING_SENTENCE = {
    "marker": "Which flashes are the same is known from the marker, as the clips ran at the same time.",
    "given": "Which flashes are the same is known from when the clips were said to begin.",
}


def describe_timing(timing: "Timing") -> str:
    """Return what was found and how certain it is, in a few lines for people."""
    complete = sum(flash.complete for flash in timing.flashes)
    lines = [f"{len(timing.flashes)} flashes, {complete} of them complete."]
    if timing.how_sure:
        lines.append(f"The strobe's clock is off by {timing.clock_offset_ppm:+.1f} ppm. {timing.how_sure}")
    lines.append(_order_words(timing))
    lines += [timing.order_note] if timing.order_note else []
    lines += [f"{counted(hole.count, 'frame')} missing after number {hole.after}." for hole in timing.dropped_frames]
    lines += [f"Frame {number} repeats the one before it." for number in timing.repeated_frames]
    return "\n".join(lines)


ORDER_SENTENCE = {
    "marker": "Which light is which is known from the cycle's marker.",
    "rig": "Which light is which was found from the rig's directions.",
    "given": "Which light is which was given.",
}


def _order_words(timing: "Timing") -> str:
    from psvideo.model.marker import why_guessed

    if timing.order != "guess":
        return ORDER_SENTENCE[timing.order]
    return (
        f"Which light is which is a GUESS. {why_guessed(timing.flashes)} Where you know the light of the clip's first "
        "complete flash, name it with --first-light NAME."
    )
