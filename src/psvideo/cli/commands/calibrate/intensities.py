"""psvideo calibrate intensities: how strong lights of known directions are, from any matte scene."""

from __future__ import annotations

from psvideo.cli.commands.calibrate.of_takes import one_or_all
from psvideo.cli.console import Voice
from psvideo.cli.options.calibrate import PicturesOfTakes, RigIn, RigOut, Transfer
from psvideo.cli.options.clip_and_run import ClipWords, Force, Sharing
from psvideo.cli.options.records import spread
from psvideo.model.units import counted


@spread
def intensities(
    pictures: PicturesOfTakes,
    rig: RigIn,
    out: RigOut,
    *,
    transfer: Transfer = None,
    words: ClipWords,
    force: Force = False,
    sharing: Sharing,
    voice: Voice,
) -> None:
    """Measure the relative intensities of four or more distant lights of known directions from any matte scene."""
    from psvideo.runs.calibrate.intensities import intensities as measure

    found = one_or_all(
        voice,
        "intensities",
        measure,
        pictures,
        out=out,
        force=force,
        sharing=sharing,
        rig=rig,
        transfer=transfer,
        **vars(words),
    )
    if found is None:
        return
    lights = found.rig.lights
    for light, error in zip(lights, found.error, strict=True):
        voice.say(f"  {light.name:12} intensity {', '.join(f'{x:.4g}' for x in light.by_channel)}  +- {error:.1%}")
    voice.say(
        f"{out}: {counted(len(lights), 'light')} written; intensities are relative, their mean 1 in every channel."
    )
    voice.result({"lights": [{"name": light.name, "intensity": light.by_channel} for light in lights]})
