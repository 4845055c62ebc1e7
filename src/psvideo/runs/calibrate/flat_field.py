"""The whole of ``psvideo calibrate flat-field``: a white card in; the rig with intensities out, and a falloff map."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from psvideo.calibrate.flat_field import FlatLight, falloff_of, measure_flat_field, with_intensities
from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.white_target import Target
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import UsageError, said_of
from psvideo.formats.flat_toml import SCHEMA as FLAT_SCHEMA
from psvideo.formats.flat_toml import format_falloff
from psvideo.formats.rig_toml import format_rig, read_rig
from psvideo.formats.whole_files import check_ending, refuse_existing, write_text
from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.ground import Ground, ground_of
from psvideo.model.irradiance.near_light import is_near
from psvideo.model.rig import Rig
from psvideo.runs.calibrate.reading import check_albedo, pictures_of, reading_of, rig_out, warn_of_unmeasured
from psvideo.runs.steps.caller import PYTHON, Caller

UNEVEN = 0.1
"""A target that is lit less evenly, beyond what the rig explains, wants a map."""


@dataclass(frozen=True, kw_only=True)
class FlatFieldCalibration:
    """What a flat field showed: every light, and the rig with their intensities."""

    lights: tuple[FlatLight, ...]
    rig: Rig


def flat_field(
    pictures: Path | str,
    *,
    rig: Path | str,
    out: Path | str,
    albedo: float = 0.9,
    box: tuple[int, int, int, int] | None = None,
    flat: Path | str | None = None,
    transfer: str | None = None,
    plan: Path | str | None = None,
    frames: str | None = None,
    first_light: str | None = None,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> FlatFieldCalibration:
    """Measure every light's intensity, per channel, from a matte white target; write the rig with intensities.

    - ``pictures``: a folder of stills (one per light), of plates, or a clip: the target faces the camera, or lies in
      the plane that the rig gives. ``transfer``, ``plan``, ``frames``, ``first_light``: as for ``matte_sphere``.
    - ``rig``: whose directions or positions are known. ``out``: the rig file to write. ``flat``: a file to write how
      light falls off over the target, for ``normals``. ``force`` replaces either where it exists.
    - ``albedo``: the target's, above 0 and up to 1: white paper 0.85, a white card 0.9.
    - ``box``: the target's part of the picture: left, top, right, bottom in pixels.

    Raises UsageError where outputs exist or values cannot be, and PsvideoError where the target shows too little.
    """
    rig_path, flat_path = rig_out(out, force=force), None if flat is None else Path(flat)
    if flat_path is not None:
        if flat_path.resolve() == rig_path.resolve():
            raise UsageError(f"`out` and `flat` both name {flat_path}. Give each a file of its own.")
        check_ending(flat_path, ".toml", name="flat")
        refuse_existing(flat_path, force=force, mark=FLAT_SCHEMA)
    check_albedo(albedo)
    read_rig(Path(rig))  # its faults are said before pictures are read, or a clip's flashes are sought
    found = pictures_of(Path(pictures), reading_of(plan, frames, first_light, transfer), watch=watch, caller=caller)
    known = read_rig(Path(rig), plan_lights=found.names)
    warn_of_unmeasured(known, found.names, caller)
    target, ground = white_target(found, known, Path(rig), albedo=albedo, box=box)
    with said_of(pictures):
        lights = measure_flat_field(found, known, target, ground=ground)
    measured = with_intensities(known, [light.intensity.tolist() for light in lights], found)
    write_text(rig_path, format_rig(measured))
    if flat_path is not None:
        write_text(flat_path, format_falloff(falloff_of(lights, target, found)))
    elif max(light.falloff for light in lights) > UNEVEN:
        caller.warn(
            "the target is not evenly lit (lens falloff, or lamps that are narrow or near): the rig file holds one "
            "intensity per light, not a map. Write the map with `flat` flat.toml, and give it to psvideo normals"
        )
    return FlatFieldCalibration(lights=tuple(lights), rig=measured)


def white_target(
    found: LightPictures, known: Rig, rig_path: Path, *, albedo: float, box: tuple[int, int, int, int] | None
) -> tuple[Target, Ground | None]:
    """Return the white target of some pictures: it faces the camera, or lies in the rig's plane; and where it stands,
    where lights are near. Raises UsageError where the box is outside the picture, and PsvideoError where the rig (read
    from ``rig_path``) does not say where the surface is."""
    near = is_near(known.select(found.names))
    with said_of(rig_path):
        ground = ground_of(known, height_px=found.height_px, width_px=found.width_px) if near else None
    normal = _towards_camera((0.0, 0.0, 1.0, 1.0) if known.plane is None else known.plane)
    rows, cols = _part(box, found)
    return Target(albedo=albedo, normal=normal, rows=rows, cols=cols), ground


def _towards_camera(plane: tuple[float, float, float, float]) -> Doubles:
    """Return a plane's unit normal on the camera's side; (a, b, c, d) may have either sign."""
    normal = np.array(plane[:3]) * (-1.0 if plane[3] < 0 else 1.0)
    return np.asarray(normal / np.linalg.norm(normal))


def _part(box: tuple[int, int, int, int] | None, pictures: LightPictures) -> tuple[slice, slice]:
    if box is None:
        return slice(0, pictures.height_px), slice(0, pictures.width_px)
    left, top, right, bottom = box
    if not (0 <= left < right <= pictures.width_px and 0 <= top < bottom <= pictures.height_px):
        words = ",".join(map(str, box))
        raise UsageError(f"`box` {words}: is not inside the picture of {pictures.width_px} x {pictures.height_px}.")
    return slice(top, bottom), slice(left, right)
