"""psvideo calibrate mirror-sphere: where the lights are, from their highlights on a chrome ball."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice
from psvideo.cli.options import FirstLight, Force, Frames, Json, PlanPath, Quiet, Verbose
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.whole_files import PICTURE_MARK, refuse_existing, write_text

if TYPE_CHECKING:
    from psvideo.calibrate.mirror.lights import MeasuredLight, MirrorCalibration
    from psvideo.calibrate.sphere.sighting import Sighting

LEAST_RADIUS_MM, LARGEST_RADIUS_MM = 1.0, 1000.0


def mirror_sphere(
    pictures: Annotated[
        list[Path],
        typer.Argument(help="A folder of stills (one per light), of plates, or a clip; one per place of the sphere."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="The rig file to write; a picture goes beside it (.png).")],
    circle: Annotated[
        list[str] | None,
        typer.Option(help="A sphere's outline found by hand: x,y,radius in pixels from the top left. Repeatable."),
    ] = None,
    spheres: Annotated[int, typer.Option(help="How many spheres each picture holds.", min=1, max=8)] = 1,
    focal_px: Annotated[float | None, typer.Option(help="Focal length in pixels.", min=1)] = None,
    focal_mm: Annotated[float | None, typer.Option(help="Focal length in mm; needs --sensor-mm.", min=0.1)] = None,
    sensor_mm: Annotated[
        float | None, typer.Option(help="Width in mm of the sensor's part that the picture shows.", min=0.1)
    ] = None,
    principal_px: Annotated[
        str | None, typer.Option(help="Where the lens's axis meets the picture, in pixels: x,y; left out: its middle.")
    ] = None,
    radius_mm: Annotated[
        float | None, typer.Option(help="The spheres' radius in mm: with two or more, near lights get positions.")
    ] = None,
    outline_picture: Annotated[
        Path | None, typer.Option(help="A picture from the same camera, room light on, on which the outline shows.")
    ] = None,
    transfer: Annotated[str | None, typer.Option(help="How stills code light: linear, srgb, slog3, ...")] = None,
    plan: PlanPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    force: Force = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure where the lights are from their highlights on one or more mirror spheres; writes rig.toml."""
    from psvideo.calibrate.light_pictures import read_picture
    from psvideo.calibrate.mirror.lights import calibrate_lights
    from psvideo.calibrate.sphere.sighting import Looking, SphereNotFoundError, sight_spheres
    from psvideo.formats.rig_toml import SCHEMA, format_rig
    from psvideo.pictures.mirror_sphere import faulty_picture, sphere_picture
    from psvideo.pictures.timing_sheet import write_sheet
    from psvideo.runs.light_sets import Reading, open_light_sets

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    refuse_existing(out, force=force, mark=SCHEMA)
    picture_path = _picture_path(out, force=force)
    circles = tuple(_numbers(text, 3, "--circle", "x,y,radius") for text in circle or ())
    middle = None if principal_px is None else _numbers(principal_px, 2, "--principal-px", "x,y")
    looking = Looking(
        spheres=spheres,
        circles=tuple((x, y, radius) for x, y, radius in circles),
        focal_px=focal_px,
        focal_widths=_focal_widths(focal_px, focal_mm, sensor_mm),
        principal_px=None if middle is None else (middle[0], middle[1]),
    )
    reading = Reading(plan=plan, frames=frames, first_light=first_light, transfer=transfer)
    sightings: list[Sighting] = []
    try:
        for path in pictures:
            opened = open_light_sets(path, reading, watch=voice.track)
            for warning in opened.warnings:
                voice.warn(warning)
            for note in opened.notes:
                voice.detail(note)
            room = opened.room if outline_picture is None else read_picture(outline_picture)[0]
            sightings += sight_spheres(opened.sets, looking, where=str(path), room=room)
    except SphereNotFoundError as fault:
        write_sheet(picture_path, faulty_picture(fault.picture))
        raise PsvideoError(f"{fault} See {picture_path}.") from None
    found = calibrate_lights(sightings, radius_m=_radius_m(radius_mm))
    write_sheet(picture_path, sphere_picture(found))
    write_text(out, format_rig(found.rig))
    for warning in found.warnings:
        voice.warn(warning)
    voice.say(describe(found))
    voice.say(f"{out}: {len(found.rig.lights)} of {len(found.lights)} lights written; see {picture_path}.")
    voice.result(record(found))


def _picture_path(out: Path, *, force: bool) -> Path:
    path = out.with_suffix(".png")
    refuse_existing(path, force=force, mark=PICTURE_MARK)
    return path


def _numbers(text: str, count: int, option: str, form: str) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or (count == 3 and values[2] <= 0):
        raise UsageError(f"{option} {text!r}: expected {form}, numbers in pixels with commas between them.")
    return values


def _focal_widths(focal_px: float | None, focal_mm: float | None, sensor_mm: float | None) -> float | None:
    """Return the focal length in widths of the picture, where it is given in millimetres."""
    if focal_px is not None and focal_mm is not None:
        raise UsageError("--focal-px and --focal-mm both say the focal length; give one of them.")
    if (focal_mm is None) != (sensor_mm is None):
        raise UsageError("--focal-mm and --sensor-mm go together: the focal length, and the width of the sensor.")
    return None if focal_mm is None or sensor_mm is None else focal_mm / sensor_mm


def _radius_m(radius_mm: float | None) -> float | None:
    if radius_mm is None:
        return None
    if not LEAST_RADIUS_MM <= radius_mm <= LARGEST_RADIUS_MM:
        raise UsageError(
            f"--radius-mm {radius_mm:g}: no such sphere; expected the radius in millimetres, from {LEAST_RADIUS_MM:g} "
            f"to {LARGEST_RADIUS_MM:g}. (Metres? Then multiply by 1000.)"
        )
    return radius_mm / 1000


def describe(found: MirrorCalibration) -> str:
    """Return what was measured, for people."""
    lines = []
    for sighting in found.sightings:
        x, y, radius = sighting.outline.place[:3]
        lines.append(
            f"{sighting.where}: sphere at {x:.1f}, {y:.1f} with radius {radius:.1f} px "
            f"(+- {sighting.outline.error_px:.2f}), {sighting.sets} frame(s)"
        )
    lines += [_line(light) for light in found.lights]
    lines.append(
        "Intensities are 1 for all lights: a mirror's highlights clip. A matte sphere or a flat field measures them."
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
