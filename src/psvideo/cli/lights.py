"""psvideo calibrate matte-sphere, flat-field, intensities, guess: where lights are and how strong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.console import Voice, counted
from psvideo.cli.options import FirstLight, Force, Frames, Json, PlanPath, Quiet, Verbose
from psvideo.errors import PsvideoError, UsageError
from psvideo.formats.whole_files import PICTURE_MARK, refuse_existing, write_text

if TYPE_CHECKING:
    from psvideo.calibrate.light_pictures import LightPictures
    from psvideo.calibrate.matte import MatteLight
    from psvideo.model.choices import Prior
    from psvideo.runs.light_sets import Reading

Pictures = Annotated[Path, typer.Argument(help="A folder of stills (one per light), of plates, or a clip.")]
RigOut = Annotated[Path, typer.Option("-o", "--out", help="The rig file to write.")]
RigIn = Annotated[Path, typer.Option("--rig", help="The rig whose directions or positions are known.")]
Transfer = Annotated[str | None, typer.Option(help="How stills code light: linear, srgb, slog3, ...")]


def matte_sphere(
    pictures: Pictures,
    out: RigOut,
    circle: Annotated[
        str | None, typer.Option(help="The sphere's outline found by hand: x,y,radius in pixels from the top left.")
    ] = None,
    albedo: Annotated[
        float | None,
        typer.Option(help="The sphere's albedo; left out, intensities are relative, mean 1.", min=0.01, max=1),
    ] = None,
    focal_px: Annotated[float | None, typer.Option(help="Focal length in pixels.", min=1)] = None,
    transfer: Transfer = None,
    plan: PlanPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    force: Force = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure directions and intensities of lights from a matte sphere; writes rig.toml and a picture beside it."""
    from psvideo.calibrate.matte import matte_rig, measure_matte_sphere
    from psvideo.calibrate.sphere.outline import find_outlines, given_outline
    from psvideo.calibrate.sphere.sighting import Looking
    from psvideo.formats.rig_toml import SCHEMA, format_rig
    from psvideo.pictures.matte_sphere import matte_picture
    from psvideo.pictures.timing_sheet import write_sheet
    from psvideo.runs.light_sets import Reading

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    refuse_existing(out, force=force, mark=SCHEMA)
    refuse_existing(out.with_suffix(".png"), force=force, mark=PICTURE_MARK)
    found = _read(pictures, Reading(plan=plan, frames=frames, first_light=first_light, transfer=transfer), voice)
    view = Looking(focal_px=focal_px).view(width_px=found.width_px, height_px=found.height_px)
    if circle is None:
        outlines = find_outlines(found, view, surface="matte")
        if not outlines:
            raise PsvideoError(
                f"{pictures}: no sphere was found. Give its outline with --circle x,y,radius in pixels, counted from "
                "the centre of the top left one."
            )
        outline = outlines[0]
    else:
        x, y, radius = _numbers(circle, 3, "--circle", "x,y,radius")
        outline = given_outline(view, (x, y, radius))
    lights = measure_matte_sphere(found, outline, albedo=albedo)
    rig = matte_rig(lights, view)
    write_sheet(out.with_suffix(".png"), matte_picture(found, outline, lights))
    if not rig.lights:
        faults = "; ".join(f"{light.name}: {light.fault}" for light in lights[:3])
        raise PsvideoError(f"{pictures}: no light could be measured ({faults}). See {out.with_suffix('.png')}.")
    write_text(out, format_rig(rig))
    x, y, radius = outline.place[:3]
    voice.say(f"sphere at {x:.1f}, {y:.1f} with radius {radius:.1f} px (+- {outline.error_px:.2f})")
    for light in lights:
        voice.say(_matte_line(light))
        if light.fault:
            voice.warn(f"light {light.name!r} is left out of the rig: {light.fault}")
    if focal_px is None:
        voice.warn(
            "the focal length is not known, so the view is taken for orthographic, and all directions are wrong by "
            "about the angle by which the sphere stands off the lens's axis: give --focal-px"
        )
    if albedo is None:
        voice.say("Intensities are relative, their mean 1: give the sphere's --albedo to tie albedo to it.")
    voice.say(f"{out}: {len(rig.lights)} of {counted(len(lights), 'light')} written; see {out.with_suffix('.png')}.")
    voice.result({"lights": [_matte_record(light) for light in lights]})


def flat_field(
    pictures: Pictures,
    rig: RigIn,
    out: RigOut,
    albedo: Annotated[float, typer.Option(help="The target's albedo: white paper 0.85, a white card 0.9.")] = 0.9,
    box: Annotated[
        str | None, typer.Option(help="The target's part of the picture: left,top,right,bottom in pixels.")
    ] = None,
    flat: Annotated[
        Path | None, typer.Option(help="A file to write how light falls off over the target, for psvideo normals.")
    ] = None,
    transfer: Transfer = None,
    plan: PlanPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    force: Force = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure every light's intensity, per channel, from a matte white target that faces the camera (or lies in the
    plane that the rig gives); writes the rig with intensities."""
    import numpy as np

    from psvideo.calibrate.flat_field import Target, falloff_of, measure_flat_field, with_intensities
    from psvideo.formats.flat_toml import SCHEMA as FLAT_SCHEMA
    from psvideo.formats.flat_toml import format_falloff
    from psvideo.formats.rig_toml import SCHEMA, format_rig, read_rig
    from psvideo.runs.light_sets import Reading
    from psvideo.solve.normals.near_light import ground_of, is_near

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    refuse_existing(out, force=force, mark=SCHEMA)
    if flat is not None:
        refuse_existing(flat, force=force, mark=FLAT_SCHEMA)
    if not 0 < albedo <= 1:
        raise UsageError(f"--albedo {albedo:g}: expected a share above 0 and up to 1.")
    found = _read(pictures, Reading(plan=plan, frames=frames, first_light=first_light, transfer=transfer), voice)
    known = read_rig(rig, plan_lights=found.names)
    near = is_near(known.select(found.names))
    ground = ground_of(known, height_px=found.height_px, width_px=found.width_px) if near else None
    normal = np.array([0.0, 0.0, 1.0] if known.plane is None else known.plane[:3])
    rows, cols = _box(box, found)
    target = Target(albedo=albedo, normal=normal / np.linalg.norm(normal), rows=rows, cols=cols)
    lights = measure_flat_field(found, known, target, ground=ground)
    write_text(out, format_rig(with_intensities(known, lights)))
    if flat is not None:
        write_text(flat, format_falloff(falloff_of(lights, target, found)))
    for light in lights:
        strengths = ", ".join(f"{value:.4g}" for value in light.intensity)
        voice.say(
            f"  {light.name:12} intensity {strengths}  +- {light.intensity_error:.1%}; the target differs by "
            f"{light.falloff:.0%} beyond what the rig explains"
        )
    if flat is not None:
        left = max(light.left for light in lights)
        voice.say(f"{flat}: falloff written, which leaves {left:.1%}; give it to psvideo normals with --flat.")
    elif max(light.falloff for light in lights) > 0.1:
        voice.warn(
            "the target is not evenly lit (lens falloff, or lamps that are narrow or near): the rig file holds one "
            "intensity per light, not a map. Write the map with --flat flat.toml, and give it to psvideo normals"
        )
    voice.say(f"{out}: {counted(len(lights), 'light')} written.")
    voice.result(
        {
            "lights": [
                {
                    "name": light.name,
                    "intensity": light.intensity.tolist(),
                    "intensity_error": light.intensity_error,
                    "falloff": light.falloff,
                    "left": light.left,
                }
                for light in lights
            ]
        }
    )


def intensities(
    pictures: Pictures,
    rig: RigIn,
    out: RigOut,
    transfer: Transfer = None,
    plan: PlanPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    force: Force = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure the relative intensities of four or more distant lights of known directions from any matte scene."""
    from psvideo.calibrate.strengths import measure_strengths
    from psvideo.formats.rig_toml import SCHEMA, format_rig, read_rig
    from psvideo.model.rig import directions
    from psvideo.runs.light_sets import Reading

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    refuse_existing(out, force=force, mark=SCHEMA)
    found = _read(pictures, Reading(plan=plan, frames=frames, first_light=first_light, transfer=transfer), voice)
    known = read_rig(rig, plan_lights=found.names)
    lights = known.select(found.names)
    strengths = measure_strengths(found, directions(lights))
    measured = tuple(
        replace(light, intensity=tuple(float(f"{value:.6g}") for value in values))
        for light, values in zip(lights, strengths.intensity.tolist(), strict=True)
    )
    write_text(out, format_rig(replace(known, lights=measured)))
    for light, error in zip(measured, strengths.error, strict=True):
        voice.say(f"  {light.name:12} intensity {', '.join(f'{x:.4g}' for x in light.intensity)}  +- {error:.1%}")
    voice.say(
        f"{out}: {counted(len(measured), 'light')} written; intensities are relative, their mean 1 in every channel."
    )
    voice.result({"lights": [{"name": light.name, "intensity": light.intensity} for light in measured]})


def guess(
    pictures: Pictures,
    out: RigOut,
    prior: Annotated[
        str | None,
        typer.Option(
            help="equal-lights (six or more of one strength) or equal-albedo; left out: by how many there are."
        ),
    ] = None,
    transfer: Transfer = None,
    plan: PlanPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    force: Force = False,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Guess directions of distant lights from pictures of a matte, rounded subject, where nothing was calibrated."""
    from psvideo.calibrate.guess import ERROR_DEG, guess_rig
    from psvideo.formats.rig_toml import SCHEMA, format_rig
    from psvideo.runs.light_sets import Reading

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    refuse_existing(out, force=force, mark=SCHEMA)
    if prior not in (None, "equal-lights", "equal-albedo"):
        raise UsageError(f"--prior {prior!r}: expected equal-lights or equal-albedo.")
    chosen: Prior | None = "equal-lights" if prior == "equal-lights" else "equal-albedo" if prior else None
    found = _read(pictures, Reading(plan=plan, frames=frames, first_light=first_light, transfer=transfer), voice)
    made = guess_rig(found, prior=chosen)
    said = (
        f"A GUESS: directions from the pictures alone ({made.prior}, and a subject that bulges to the camera). Expect "
        f"them to be wrong by {ERROR_DEG:g} degrees, and hollow may stand for bulging. Calibrate on a sphere."
    )
    write_text(out, f"# {said}\n{format_rig(made.rig)}")
    for light in made.rig.lights:
        where = ", ".join(f"{value:+.2f}" for value in light.direction or ())
        voice.say(f"  {light.name:12} direction {where}  intensity {light.intensity[0]:.3f}")
    voice.say(
        f"A matte surface explains {made.explained:.1%} of the pictures; {made.prior} holds to {made.spread:.1%}."
    )
    voice.warn(said)
    voice.say(f"{out}: {counted(len(made.rig.lights), 'light')} written.")
    voice.result({"guess": True, "prior": made.prior, "explained": made.explained, "spread": made.spread})


def _read(path: Path, reading: Reading, voice: Voice) -> LightPictures:
    from psvideo.calibrate.light_pictures import averaged
    from psvideo.runs.light_sets import open_light_sets

    opened = open_light_sets(path, reading, watch=voice.track)
    for warning in opened.warnings:
        voice.warn(warning)
    for note in opened.notes:
        voice.detail(note)
    return averaged(opened.sets)


def _box(text: str | None, pictures: LightPictures) -> tuple[slice, slice]:
    if text is None:
        return slice(0, pictures.height_px), slice(0, pictures.width_px)
    left, top, right, bottom = (int(value) for value in _numbers(text, 4, "--box", "left,top,right,bottom"))
    if not (0 <= left < right <= pictures.width_px and 0 <= top < bottom <= pictures.height_px):
        raise UsageError(f"--box {text!r}: is not inside the picture of {pictures.width_px} x {pictures.height_px}.")
    return slice(top, bottom), slice(left, right)


def _numbers(text: str, count: int, option: str, form: str) -> tuple[float, ...]:
    try:
        values = tuple(float(word) for word in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count or (count == 3 and values[2] <= 0):
        raise UsageError(f"{option} {text!r}: expected {form}, numbers in pixels with commas between them.")
    return values


def _matte_line(light: MatteLight) -> str:
    if light.fault:
        return f"  {light.name:12} left out: {light.fault}"
    where = ", ".join(f"{value:+.4f}" for value in light.direction)
    strengths = ", ".join(f"{value:.4g}" for value in light.intensity)
    return (
        f"  {light.name:12} direction {where}  +- {light.error_deg:.2f} degrees; intensity {strengths}  "
        f"+- {light.intensity_error:.1%}"
    )


def _matte_record(light: MatteLight) -> dict[str, object]:
    return {
        "name": light.name,
        "direction": light.direction.tolist(),
        "error_deg": light.error_deg,
        "intensity": light.intensity.tolist(),
        "intensity_error": light.intensity_error,
        "fault": light.fault or None,
    }
