"""psvideo calibrate matte-sphere: where lights are and how strong, from their shading on a matte sphere."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.commands.calibrate.of_takes import one_or_all
from psvideo.cli.console import Voice
from psvideo.cli.options.calibrate import FocalPx, PicturesOfTakes, RigOut, Transfer
from psvideo.cli.options.clip_and_run import ClipWords, Force, Sharing
from psvideo.cli.options.records import spread
from psvideo.cli.options.typed import parse_circle
from psvideo.model.units import counted

if TYPE_CHECKING:
    from psvideo.calibrate.matte import MatteLight

NEAR = 0.01
"""A lamp at 100 radii of the sphere and farther is far away."""


@spread
def matte_sphere(
    pictures: PicturesOfTakes,
    out: RigOut,
    *,
    circle: Annotated[
        str | None, typer.Option(help="The sphere's outline found by hand: x,y,radius in pixels from the top left.")
    ] = None,
    albedo: Annotated[
        float | None,
        typer.Option(help="The sphere's albedo; left out, intensities are relative, mean 1.", min=0.01, max=1),
    ] = None,
    focal_px: FocalPx = None,
    transfer: Transfer = None,
    words: ClipWords,
    force: Force = False,
    sharing: Sharing,
    voice: Voice,
) -> None:
    """Measure directions and intensities of lights from a matte sphere; writes rig.toml and a picture beside it."""
    from psvideo.runs.calibrate.matte_sphere import matte_sphere as measure

    found = one_or_all(
        voice,
        "matte-sphere",
        measure,
        pictures,
        out=out,
        force=force,
        sharing=sharing,
        circle=None if circle is None else parse_circle(circle),
        albedo=albedo,
        focal_px=focal_px,
        transfer=transfer,
        **vars(words),
    )
    if found is None:
        return
    x, y, radius = found.outline.place[:3]
    voice.say(f"sphere at {x:.1f}, {y:.1f} with radius {radius:.1f} px (+- {found.outline.error_px:.2f})")
    for light in found.lights:
        voice.say(_matte_line(light))
    if albedo is None:
        voice.say("Intensities are relative, their mean 1: give the sphere's --albedo to tie albedo to it.")
    voice.say(f"{out}: {len(found.rig.lights)} of {counted(len(found.lights), 'light')} written; see {found.picture}.")
    voice.result({"lights": [_matte_record(light) for light in found.lights]})


def _matte_line(light: MatteLight) -> str:
    if light.fault:
        return f"  {light.name:12} left out: {light.fault}"
    where = ", ".join(f"{value:+.4f}" for value in light.direction)
    strengths = ", ".join(f"{value:.4g}" for value in light.intensity)
    near = f"; {1 / light.nearness:.0f} radii of the sphere away" if light.nearness > NEAR else ""
    return (
        f"  {light.name:12} direction {where}  +- {light.error_deg:.2f} degrees; intensity {strengths}  "
        f"+- {light.intensity_error:.1%}{near}"
    )


def _matte_record(light: MatteLight) -> dict[str, object]:
    return {
        "name": light.name,
        "direction": light.direction.tolist(),
        "error_deg": light.error_deg,
        "intensity": light.intensity.tolist(),
        "intensity_error": light.intensity_error,
        "distance_radii": 1 / light.nearness if light.nearness > NEAR else None,
        "fault": light.fault or None,
    }
