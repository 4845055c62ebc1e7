"""psvideo sync: find when every flash fired."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options import ClipPath, FirstLight, Force, Frames, Json, OrderRig, PlanPath, Quiet, Verbose
from psvideo.errors import UsageError
from psvideo.formats.whole_files import PICTURE_MARK, refuse_existing, write_text

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
    from psvideo.cli.opening import open_and_tell
    from psvideo.formats.rig_toml import read_rig
    from psvideo.formats.timing_json import format_timing, timing_record
    from psvideo.runs.syncing import sync_take

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    if out is not None:
        refuse_existing(out, force=force, mark="psvideo-timing/")
    if picture is not None:
        if picture.suffix.lower() != ".png":
            raise UsageError(f"--picture {picture}: expected the name of a PNG, such as {picture.with_suffix('.png')}.")
        refuse_existing(picture, force=force, mark=PICTURE_MARK)
    take = open_and_tell(clip, voice, plan=plan, frames=frames)
    known = None if rig is None else read_rig(rig, plan_lights=take.plan.lights)
    timing = sync_take(take, first_light=first_light, rig=known, picture=picture, watch=voice.track)
    for note in timing.notes:
        voice.warn(note)
    if out is not None:
        write_text(out, format_timing(timing))
    voice.result(timing_record(timing))
    voice.say(describe_timing(timing))
    for written in (out, picture):
        if written is not None:
            voice.say(f"{written}: written.")


def describe_timing(timing: "Timing") -> str:
    """Return what was found and how sure it is, in a few lines for people."""
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
