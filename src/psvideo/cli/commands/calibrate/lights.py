"""psvideo calibrate matte-sphere, flat-field, colours, intensities, guess: where lights are and how strong."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from psvideo.cli.commands.calibrate.of_takes import one_or_all
from psvideo.cli.console import Voice
from psvideo.cli.options.calibrate import FocalPx, Pictures, PicturesOfTakes, RigIn, RigOut, Transfer
from psvideo.cli.options.clip_and_run import (
    FirstLight,
    Force,
    Frames,
    Json,
    PlanPath,
    Quiet,
    Scheduler,
    Verbose,
    Workers,
)
from psvideo.cli.options.typed import parse_box, parse_circle
from psvideo.model.choices import Prior
from psvideo.model.units import counted

if TYPE_CHECKING:
    from psvideo.calibrate.flat_field import FlatLight
    from psvideo.calibrate.matte import MatteLight


def matte_sphere(
    pictures: PicturesOfTakes,
    out: RigOut,
    circle: Annotated[
        str | None, typer.Option(help="The sphere's outline found by hand: x,y,radius in pixels from the top left.")
    ] = None,
    albedo: Annotated[
        float | None,
        typer.Option(help="The sphere's albedo; left out, intensities are relative, mean 1.", min=0.01, max=1),
    ] = None,
    focal_px: FocalPx = None,
    transfer: Transfer = None,
    plan: PlanPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    force: Force = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure directions and intensities of lights from a matte sphere; writes rig.toml and a picture beside it."""
    from psvideo.runs.calibrate.matte_sphere import matte_sphere as measure

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    found = one_or_all(
        voice,
        "matte-sphere",
        measure,
        pictures,
        out=out,
        force=force,
        workers=workers,
        scheduler=scheduler,
        circle=None if circle is None else parse_circle(circle),
        albedo=albedo,
        focal_px=focal_px,
        transfer=transfer,
        plan=plan,
        frames=frames,
        first_light=first_light,
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


def flat_field(
    pictures: PicturesOfTakes,
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
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure every light's intensity, per channel, from a matte white target that faces the camera (or lies in the
    plane that the rig gives); writes the rig with intensities."""
    from psvideo.runs.calibrate.flat_field import flat_field as measure

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    found = one_or_all(
        voice,
        "flat-field",
        measure,
        pictures,
        out=out,
        force=force,
        workers=workers,
        scheduler=scheduler,
        rig=rig,
        albedo=albedo,
        box=None if box is None else parse_box(box),
        flat=flat,
        transfer=transfer,
        plan=plan,
        frames=frames,
        first_light=first_light,
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


def colours(
    pictures: PicturesOfTakes,
    rig: RigIn,
    out: RigOut,
    albedo: Annotated[float, typer.Option(help="The card's albedo: white paper 0.85, a white card 0.9.")] = 0.9,
    box: Annotated[
        str | None, typer.Option(help="The card's part of the picture: left,top,right,bottom in pixels.")
    ] = None,
    transfer: Transfer = None,
    plan: PlanPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    force: Force = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure what red, green and blue see of every coloured light, from a white card that one light at a time lights;
    writes the rig with colours."""
    from psvideo.runs.calibrate.colours import colours as measure

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    done = one_or_all(
        voice,
        "colours",
        measure,
        pictures,
        out=out,
        force=force,
        workers=workers,
        scheduler=scheduler,
        rig=rig,
        albedo=albedo,
        box=None if box is None else parse_box(box),
        transfer=transfer,
        plan=plan,
        frames=frames,
        first_light=first_light,
    )
    if done is None:
        return
    found = done.found
    for name, seen, error in zip(found.names, found.seen, found.error, strict=True):
        shares = ", ".join(f"{value / seen.max():.4f}" for value in seen)
        voice.say(f"  {name:12} intensity {seen.max():.4g}  colour {shares}  +- {error.max():.2%}")
    voice.say(f"Hardest to tell apart: {', '.join(found.together)}, condition number {found.condition:.2f}.")
    voice.say(f"{out}: {counted(len(found.names), 'light')} with colours.")
    voice.result(
        {
            "lights": [
                {"name": name, "seen": seen.tolist(), "error": error.tolist()}
                for name, seen, error in zip(found.names, found.seen, found.error, strict=True)
            ],
            "together": found.together,
            "condition": found.condition,
        }
    )


def intensities(
    pictures: PicturesOfTakes,
    rig: RigIn,
    out: RigOut,
    transfer: Transfer = None,
    plan: PlanPath = None,
    frames: Frames = None,
    first_light: FirstLight = None,
    force: Force = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Measure the relative intensities of four or more distant lights of known directions from any matte scene."""
    from psvideo.runs.calibrate.intensities import intensities as measure

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    found = one_or_all(
        voice,
        "intensities",
        measure,
        pictures,
        out=out,
        force=force,
        workers=workers,
        scheduler=scheduler,
        rig=rig,
        transfer=transfer,
        plan=plan,
        frames=frames,
        first_light=first_light,
    )
    if found is None:
        return
    lights = found.rig.lights
    for light, error in zip(lights, found.error, strict=True):
        voice.say(f"  {light.name:12} intensity {', '.join(f'{x:.4g}' for x in light.intensity)}  +- {error:.1%}")
    voice.say(
        f"{out}: {counted(len(lights), 'light')} written; intensities are relative, their mean 1 in every channel."
    )
    voice.result({"lights": [{"name": light.name, "intensity": light.intensity} for light in lights]})


def guess(
    pictures: Pictures,
    out: RigOut,
    prior: Annotated[
        Prior | None,
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
    from psvideo.runs.calibrate.guess import guess as guess_lights

    voice = Voice(json=json, verbose=verbose, quiet=quiet)
    made = guess_lights(
        pictures,
        out=out,
        prior=prior,
        transfer=transfer,
        plan=plan,
        frames=frames,
        first_light=first_light,
        force=force,
        watch=voice.track,
        caller=voice.caller(),
    )
    for light in made.rig.lights:
        where = ", ".join(f"{value:+.2f}" for value in light.direction or ())
        voice.say(f"  {light.name:12} direction {where}  intensity {light.intensity[0]:.3f}")
    voice.say(
        f"A matte surface explains {made.explained:.1%} of the pictures; {made.prior} holds to {made.spread:.1%}."
    )
    voice.say(f"{out}: {counted(len(made.rig.lights), 'light')} written.")
    voice.result({"guess": True, "prior": made.prior, "explained": made.explained, "spread": made.spread})


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


def _flat_record(light: FlatLight) -> dict[str, object]:
    return {
        "name": light.name,
        "intensity": light.intensity.tolist(),
        "intensity_error": light.intensity_error,
        "falloff": light.falloff,
        "left": light.left,
    }
