"""psvideo calibrate flat-field: how strong lights are, from a white target."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.commands.calibrate.of_takes import one_or_all
from psvideo.cli.console import Voice
from psvideo.cli.options.calibrate import PicturesOfTakes, RigIn, RigOut, TargetAlbedo, TargetBox, Transfer
from psvideo.cli.options.clip_and_run import ClipWords, Force, Sharing
from psvideo.cli.options.records import spread
from psvideo.cli.options.typed import parse_box
from psvideo.model.units import counted

if TYPE_CHECKING:
    from psvideo.calibrate.flat_field import FlatLight


@spread
def flat_field(
    pictures: PicturesOfTakes,
    rig: RigIn,
    out: RigOut,
    *,
    albedo: TargetAlbedo = 0.9,
    box: TargetBox = None,
    flat: Annotated[
        Path | None, typer.Option(help="File for the lights' fall-off over the target, for psvideo normals --flat.")
    ] = None,
    transfer: Transfer = None,
    words: ClipWords,
    force: Force = False,
    sharing: Sharing,
    voice: Voice,
) -> None:
    """Measure every light's intensity, per channel, from a matte white target that faces the camera (or lies in the
    plane that the rig gives); writes the rig with intensities."""
    from psvideo.runs.calibrate.flat_field import flat_field as measure

    found = one_or_all(
        voice,
        "flat-field",
        measure,
        pictures,
        out=out,
        force=force,
        sharing=sharing,
        rig=rig,
        albedo=albedo,
        box=None if box is None else parse_box(box),
        flat=flat,
        transfer=transfer,
        **vars(words),
    )
    if found is None:
        return
    for light in found.lights:
        strengths = ", ".join(f"{value:.4g}" for value in light.intensity)
        voice.say(
            f"  {light.name:12} intensity {strengths}  +- {light.intensity_error:.1%}; the target differs by "
            f"{light.falloff:.0%} beyond what the rig explains"
        )
    if flat is not None:
        left = max(light.left for light in found.lights)
        voice.say(f"{flat}: falloff written, which leaves {left:.1%}; give it to psvideo normals with --flat.")
    voice.say(f"{out}: {counted(len(found.lights), 'light')} written.")
    voice.result({"lights": [_flat_record(light) for light in found.lights]})


def _flat_record(light: FlatLight) -> dict[str, object]:
    return {
        "name": light.name,
        "intensity": light.intensity.tolist(),
        "intensity_error": light.intensity_error,
        "falloff": light.falloff,
        "left": light.left,
    }
