"""psvideo sync: find when every flash fired."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options.clip_and_run import (
    ClipPath,
    FirstLight,
    Force,
    Frames,
    Json,
    OrderRig,
    PlanPath,
    Quiet,
    Verbose,
)

if TYPE_CHECKING:
    from psvideo.model.timing import Timing

TimingOut = Annotated[
    Path | None, typer.Option("-o", "--out", help="Where to write timing.json; left out: only a summary is printed.")
]
PictureOut = Annotated[
    Path | None, typer.Option("--picture", help="PNG to write that shows how well the flashes were found.")
]


def sync(
    clip: ClipPath,
    out: TimingOut = None,
    plan: PlanPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    rig: OrderRig = None,
    picture: PictureOut = None,
    force: Force = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Find phase, clock offset, light order and dropped frames of a strobed clip, from the picture alone."""
    from psvideo.formats.timing_json import timing_record
    from psvideo.runs.sync import sync as find

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    timing = find(
        clip,
        out=out,
        plan=plan,
        frames=frames,
        first_light=first_light,
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


def describe_timing(timing: "Timing") -> str:
    """Return what was found and how certain it is, in a few lines for people."""
    complete = sum(flash.complete for flash in timing.flashes)
    lines = [f"{len(timing.flashes)} flashes, {complete} of them complete."]
    if timing.how_sure:
        lines.append(f"The strobe's clock is off by {timing.clock_offset_ppm:+.1f} ppm. {timing.how_sure}")
    lines.append(ORDER_SENTENCE[timing.order])
    lines += [timing.order_note] if timing.order_note else []
    lines += [f"{hole.count} frame(s) missing after number {hole.after}." for hole in timing.dropped_frames]
    lines += [f"Frame {number} repeats the one before it." for number in timing.repeated_frames]
    return "\n".join(lines)


ORDER_SENTENCE = {
    "marker": "Which light is which is known from the cycle's marker.",
    "rig": "Which light is which was found from the rig's directions.",
    "given": "Which light is which was given.",
    "guess": "Which light is which is a GUESS: the picture shows no marker. Name the light of the clip's first "
    "complete flash with --first-light NAME.",
}
