"""psvideo calibrate mirror-sphere: where the lights are, from their highlights on a chrome ball."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from psvideo.cli.commands.calibrate.of_takes import calibrate_all
from psvideo.cli.console import Voice
from psvideo.cli.options.calibrate import SphereWords, Transfer
from psvideo.cli.options.clip_and_run import ClipWords, Force, Sharing
from psvideo.cli.options.records import spread
from psvideo.cli.options.typed import parse_point
from psvideo.errors import UsageError
from psvideo.model.units import counted

if TYPE_CHECKING:
    from psvideo.calibrate.mirror.measured import MeasuredLight, MirrorCalibration


@spread
def mirror_sphere(
    pictures: Annotated[
        list[Path],
        typer.Argument(help="A folder of stills (one per light), of plates, or a clip; one per place of the sphere."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The rig file to write; a picture goes beside it (.png).")],
    *,
    seen: SphereWords,
    principal_px: Annotated[
        str | None, typer.Option(help="Where the lens's axis meets the picture, in pixels: x,y; left out: its middle.")
    ] = None,
    outline_picture: Annotated[
        Path | None, typer.Option(help="A picture from the same camera with the room light on, to find the outline in.")
    ] = None,
    transfer: Transfer = None,
    words: ClipWords,
    each: Annotated[
        bool,
        typer.Option(
            "--each", help="Every folder or clip is a take of its own: a rig for each goes into the folder -o."
        ),
    ] = False,
    force: Force = False,
    sharing: Sharing,
    voice: Voice,
) -> None:
    """Measure where the lights are from their highlights on one or more mirror spheres; writes rig.toml."""
    from psvideo.runs.calibrate.mirror_sphere import mirror_sphere as measure

    options: dict[str, Any] = dict(
        principal_px=None if principal_px is None else parse_point(principal_px, option="--principal-px"),
        outline_picture=outline_picture,
        transfer=transfer,
        **seen.parameters(),
        **vars(words),
    )
    common: dict[str, Any] = {"force": force, "watch": voice.track, "caller": voice.caller()}
    if each:
        calibrate_all(voice, "mirror-sphere", pictures, out=out, **vars(sharing), **common, **options)
        return
    if sharing.asked:
        raise UsageError(
            "--workers and --scheduler are for several takes. Add --each if every folder is a take of its own."
        )
    found = measure(pictures, out=out, **common, **options)
    voice.say(describe(found))
    voice.say(f"{out}: {len(found.rig.lights)} of {len(found.lights)} lights written; see {out.with_suffix('.png')}.")
    voice.result(record(found))


def describe(found: MirrorCalibration) -> str:
    """Return what was measured, for people."""
    lines = []
    for sighting in found.sightings:
        x, y, radius = sighting.outline.place[:3]
        lines.append(
            f"{sighting.where}: sphere at {x:.1f}, {y:.1f} with radius {radius:.1f} px "
            f"(+- {sighting.outline.error_px:.2f}), {counted(sighting.sets, 'frame')}"
        )
    lines += [_line(light) for light in found.lights]
    lines.append(
        "Intensities are 1 for all lights, which is not measured: a mirror's highlights clip. Next, film a white card "
        "in the same place: psvideo calibrate flat-field, with this rig."
    )
    return "\n".join(lines)


def _line(light: MeasuredLight) -> str:
    if light.fault or light.direction is None:
        return f"  {light.name:12} left out: {light.fault}"
    where = ", ".join(f"{value:+.4f}" for value in light.direction)
    if light.position_m is None:
        return f"  {light.name:12} direction {where}  +- {light.error_deg:.2f} degrees"
    at = ", ".join(f"{value:+.3f}" for value in light.position_m)
    return f"  {light.name:12} at {at} m  +- {light.position_error_m:.3f} m  (+- {light.error_deg:.2f} degrees)"


def record(found: MirrorCalibration) -> dict[str, object]:
    """Return what was measured, for machines."""
    return {
        "spheres": [
            {
                "where": sighting.where,
                "x_px": float(sighting.outline.place[0]),
                "y_px": float(sighting.outline.place[1]),
                "radius_px": sighting.outline.radius_px,
                "error_px": sighting.outline.error_px,
                "ellipticity": sighting.outline.ellipticity,
                "coverage": sighting.outline.coverage,
                "given": sighting.outline.given,
                "frames": sighting.sets,
                "highlights": {
                    one.light: None if one.place is None else [float(value) for value in one.place]
                    for one in sighting.highlights
                },
            }
            for sighting in found.sightings
        ],
        "lights": [
            {
                "name": light.name,
                "direction": None if light.direction is None else light.direction.tolist(),
                "error_deg": light.error_deg,
                "position_m": None if light.position_m is None else light.position_m.tolist(),
                "position_error_m": None if light.position_m is None else light.position_error_m,
                "fault": light.fault or None,
            }
            for light in found.lights
        ],
        "warnings": list(found.warnings),
    }
