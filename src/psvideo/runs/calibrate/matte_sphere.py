"""The whole of ``psvideo calibrate matte-sphere``: pictures of a matte sphere in, a rig file and a picture out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.matte import MatteLight, matte_rig, measure_matte_sphere
from psvideo.calibrate.sphere.marked import held_against_picture
from psvideo.calibrate.sphere.outline import Outline, find_outlines, given_outline
from psvideo.calibrate.sphere.sphere_view import Looking, SphereView
from psvideo.compute.progress import Watch, unwatched
from psvideo.compute.ranks import median
from psvideo.errors import PsvideoError, said_of
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.screen_pictures import write_png
from psvideo.formats.whole_files import write_text
from psvideo.model.rig import Rig, too_few_measured
from psvideo.model.units import counted
from psvideo.pictures.matte_sphere import matte_picture
from psvideo.runs.calibrate.reading import (
    check_albedo,
    picture_beside,
    picture_of_failure,
    pictures_of,
    reading_of,
    rig_out,
)
from psvideo.runs.steps.caller import PYTHON, Caller

FLATTER_DEG = 2.0
"""From here on shading that is flatter than a matte sphere's is warned of."""


NAMED = 3
"""Lights that could not be measured and are named, where all fail; how many more there are is said."""


@dataclass(frozen=True, kw_only=True)
class MatteCalibration:
    """What a matte sphere showed: its outline, every light (those with a ``fault`` are left out of the rig), the rig,
    and the picture of it all."""

    outline: Outline
    lights: tuple[MatteLight, ...]
    rig: Rig
    picture: Path


def matte_sphere(
    pictures: Path | str,
    *,
    out: Path | str,
    circle: tuple[float, float, float] | None = None,
    albedo: float | None = None,
    focal_px: float | None = None,
    transfer: str | None = None,
    plan: Path | str | None = None,
    frames: str | None = None,
    first_light: str | None = None,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> MatteCalibration:
    """Measure directions and intensities of lights from a matte sphere; write the rig and a picture beside it (.png).

    - ``pictures``: a folder of stills (one per light), of plates, or a clip. ``transfer``: how stills code light
      ("linear", "srgb", "slog3", ...). ``plan``, ``frames``, ``first_light``: as for ``normals``.
    - ``out``: the rig file to write; ``force`` replaces it where it exists.
    - ``circle``: the sphere's outline found by hand: x, y and radius in pixels, from the centre of the top left one.
    - ``albedo``: the sphere's, above 0 and up to 1; left out, intensities are relative, their mean 1.
    - ``focal_px``: the focal length in pixels; left out, the view is assumed orthographic.

    Raises UsageError where an output exists or a number cannot be meant, and PsvideoError where no sphere is found or
    too few lights can be measured (fewer than half, or than the three that normals need).
    """
    rig_path = rig_out(out, force=force)
    picture, of_failure = picture_beside(rig_path, force=force), picture_of_failure(rig_path)
    looking = Looking(focal_px=focal_px, circles=() if circle is None else (circle,))
    if albedo is not None:
        check_albedo(albedo)
    reading = reading_of(plan, frames, first_light, transfer)
    found = pictures_of(Path(pictures), reading, watch=watch, caller=caller)
    view = looking.view(width_px=found.width_px, height_px=found.height_px)
    outline, doubt = (
        (_found(Path(pictures), found, view), "")
        if circle is None
        else held_against_picture(found, given_outline(view, circle), surface="matte")
    )
    with said_of(pictures):
        lights = measure_matte_sphere(found, outline, albedo=albedo)
    rig = matte_rig(lights, view)
    shown = matte_picture(found, outline, lights)
    too_few = too_few_measured(len(rig.lights), shown=len(lights))
    write_png(of_failure if too_few else picture, shown)
    if too_few:
        raise PsvideoError(f"{pictures}: {_few(lights, doubt)} See {of_failure}.")
    write_text(rig_path, format_rig(rig))
    if doubt:
        caller.warn(f"{pictures}: {doubt}")
    for caution in _cautions(lights, lens_known=focal_px is not None):
        caller.warn(caution)
    return MatteCalibration(outline=outline, lights=tuple(lights), rig=rig, picture=picture)


def _cautions(lights: Sequence[MatteLight], *, lens_known: bool) -> Iterator[str]:
    """Yield what the lights' directions are to be distrusted for: lights left out, other light, no focal length."""
    for light in lights:
        if light.fault:
            yield f"light {light.name!r} is left out of the rig: {light.fault}"
    flatter_deg = median(np.array([light.flatter_deg for light in lights if not light.fault]))
    if flatter_deg > FLATTER_DEG:
        yield (
            f"the sphere fades less towards its shadow than a matte one does under one lamp, which may turn directions "
            f"by about {flatter_deg:.0f} degrees: light in the room that was not taken off (a picture with all lamps "
            "off, named ambient, does it), pictures under another curve than `transfer` says, or rough paint"
        )
    if not lens_known:
        yield (
            "the focal length is not known, so the view is assumed orthographic, and all directions are wrong by "
            "about the angle by which the sphere stands off the lens's axis: give `focal_px`"
        )


def _few(lights: Sequence[MatteLight], doubt: str) -> str:
    lost = [light for light in lights if light.fault]
    measured = len(lights) - len(lost)
    what = f"only {measured} of {len(lights)} lights" if measured else "no light"
    more = f"; and {counted(len(lost) - NAMED, 'more light')}" if len(lost) > NAMED else ""
    faults = doubt or "; ".join(f"{light.name}: {light.fault}" for light in lost[:NAMED]) + more
    return (
        f"{what} could be measured ({faults}). Expected a matte sphere of one colour, lit by one lamp in each picture, "
        "in a dark room or with a picture named ambient that takes the room's light off."
    )


def _found(path: Path, pictures: LightPictures, view: SphereView) -> Outline:
    outlines = find_outlines(pictures, view, surface="matte")
    if not outlines:
        raise PsvideoError(
            f"{path}: no sphere was found. Give its outline with `circle` x,y,radius in pixels, counted from the "
            "centre of the top left one."
        )
    return outlines[0]
