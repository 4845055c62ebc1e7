"""psvideo calibrate colours: what the camera sees of coloured lights, from a white card."""

from __future__ import annotations

from math import isfinite

from psvideo.cli.commands.calibrate.of_takes import one_or_all
from psvideo.cli.console import Voice
from psvideo.cli.options.calibrate import PicturesOfTakes, RigIn, RigOut, TargetAlbedo, TargetBox, Transfer
from psvideo.cli.options.clip_and_run import ClipWords, Force, Sharing
from psvideo.cli.options.records import spread
from psvideo.cli.options.typed import parse_box
from psvideo.model.units import counted


@spread
def colours(
    pictures: PicturesOfTakes,
    rig: RigIn,
    out: RigOut,
    *,
    albedo: TargetAlbedo = 0.9,
    box: TargetBox = None,
    transfer: Transfer = None,
    words: ClipWords,
    force: Force = False,
    sharing: Sharing,
    voice: Voice,
) -> None:
    """Measure how much red, green and blue record of every coloured light, from a white card under one light at a
    time; writes the rig with colours."""
    from psvideo.runs.calibrate.colours import colours as measure

    done = one_or_all(
        voice,
        "colours",
        measure,
        pictures,
        out=out,
        force=force,
        sharing=sharing,
        rig=rig,
        albedo=albedo,
        box=None if box is None else parse_box(box),
        transfer=transfer,
        **vars(words),
    )
    if done is None:
        return
    found = done.found
    for name, seen, error in zip(found.names, found.seen, found.error, strict=True):
        shares = ", ".join(f"{value / seen.max():.4f}" for value in seen)
        voice.say(f"  {name:12} intensity {seen.max():.4g}  colour {shares}  +- {error.max():.2%}")
    how = f"condition number {found.condition:.2f}" if isfinite(found.condition) else "whose colours are the same"
    voice.say(f"Hardest to tell apart: {', '.join(found.together)}, {how}.")
    voice.say(f"{out}: {counted(len(found.names), 'light')} with colours.")
    voice.result(
        {
            "lights": [
                {"name": name, "seen": seen.tolist(), "error": error.tolist()}
                for name, seen, error in zip(found.names, found.seen, found.error, strict=True)
            ],
            "together": found.together,
            "condition": found.condition if isfinite(found.condition) else None,
        }
    )
