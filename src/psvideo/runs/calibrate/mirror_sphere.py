"""The whole of ``psvideo calibrate mirror-sphere``: pictures of mirror spheres in, a rig file and a picture out."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from psvideo.calibrate.mirror.lights import TooFewLightsError, calibrate_lights, check_enough
from psvideo.calibrate.mirror.measured import MirrorCalibration
from psvideo.calibrate.mirror.sighting import Sighting, SphereNotFoundError, sight_spheres
from psvideo.calibrate.picture_sets import read_picture
from psvideo.calibrate.sphere.sphere_view import Looking
from psvideo.compute.progress import Watch, unwatched
from psvideo.errors import PsvideoError, UsageError, check_within
from psvideo.formats.rig_toml import format_rig
from psvideo.formats.screen_pictures import write_png
from psvideo.formats.whole_files import write_text
from psvideo.pictures.mirror_sphere import faulty_picture, sphere_picture
from psvideo.runs.calibrate.reading import picture_beside, picture_of_failure, reading_of, rig_out
from psvideo.runs.photographs.light_sets import sets_of
from psvideo.runs.photographs.opened_sets import Reading
from psvideo.runs.steps.caller import PYTHON, Caller

LEAST_RADIUS_MM, LARGEST_RADIUS_MM = 1.0, 1000.0
LONGEST_MM, LARGEST_SENSOR_MM = 20_000.0, 1000.0


def mirror_sphere(
    pictures: Sequence[Path | str],
    *,
    out: Path | str,
    circle: Sequence[tuple[float, float, float]] = (),
    spheres: int = 1,
    focal_px: float | None = None,
    focal_mm: float | None = None,
    sensor_mm: float | None = None,
    principal_px: tuple[float, float] | None = None,
    radius_mm: float | None = None,
    outline_picture: Path | str | None = None,
    transfer: str | None = None,
    plan: Path | str | None = None,
    frames: str | None = None,
    first_light: str | None = None,
    force: bool = False,
    watch: Watch = unwatched,
    caller: Caller = PYTHON,
) -> MirrorCalibration:
    """Measure where the lights are from their highlights on mirror spheres; write the rig and a picture (.png).

    - ``pictures``: one folder of stills (one per light), of plates, or clip, for each place of the sphere.
      ``transfer``, ``plan``, ``frames``, ``first_light``: as for ``matte_sphere``.
    - ``out``: the rig file to write; ``force`` replaces it and the picture where they exist, unless this fails.
    - ``circle``: outlines found by hand: x, y and radius in pixels. ``spheres``: how many each picture holds.
      ``outline_picture``: a picture from the same camera, room light on, on which the outline shows.
    - ``focal_px``: the focal length in pixels; or ``focal_mm`` with ``sensor_mm``, the width of the sensor's part that
      the picture shows. ``principal_px``: where the lens's axis meets the picture; left out: its middle.
    - ``radius_mm``: the spheres' radius, 1 to 1000: with two or more, near lights get positions.

    Raises UsageError where parameters do not fit together or an output exists, and PsvideoError where no sphere is
    found, fewer than half of the lights are measured, or fewer than three of three and more (a picture shows what was
    looked at), or nothing can be measured.
    """
    rig_path = rig_out(out, force=force)
    picture, of_failure = picture_beside(rig_path, force=force), picture_of_failure(rig_path)
    looking = replace(looking_for(spheres, circle, focal_px, focal_mm, sensor_mm), principal_px=principal_px)
    radius_m = radius_in_m(radius_mm)
    reading = reading_of(plan, frames, first_light, transfer)
    room = None if outline_picture is None else Path(outline_picture)
    try:
        sightings = _sightings([Path(path) for path in pictures], reading, looking, room, watch, caller)
    except SphereNotFoundError as fault:
        write_png(of_failure, faulty_picture(fault.picture))
        raise PsvideoError(f"{fault} See {of_failure}.") from None
    try:
        found = calibrate_lights(sightings, radius_m=radius_m)
        check_enough(found)
    except TooFewLightsError as fault:
        write_png(of_failure, sphere_picture(fault.found))
        raise PsvideoError(f"{fault} See {of_failure}.") from None
    write_png(picture, sphere_picture(found))
    write_text(rig_path, format_rig(found.rig))
    for warning in found.warnings:
        caller.warn(warning)
    return found


def _sightings(
    pictures: Sequence[Path], reading: Reading, looking: Looking, room: Path | None, watch: Watch, caller: Caller
) -> list[Sighting]:
    sightings: list[Sighting] = []
    for path in pictures:
        opened = sets_of(path, reading, watch=watch, caller=caller)
        lit = opened.room if room is None else read_picture(room)[0]
        sightings += sight_spheres(opened.sets, looking, where=str(path), room=lit)
    return sightings


def looking_for(
    spheres: int,
    circle: Sequence[tuple[float, float, float]],
    focal_px: float | None,
    focal_mm: float | None,
    sensor_mm: float | None,
) -> Looking:
    """Return how spheres are looked for, from the parameters of that name. Raises UsageError where they are at odds or
    cannot be meant."""
    if focal_px is not None and focal_mm is not None:
        raise UsageError("`focal_px` and `focal_mm` both say the focal length; give one of them.")
    if (focal_mm is None) != (sensor_mm is None):
        raise UsageError("`focal_mm` and `sensor_mm` go together: the focal length, and the width of the sensor.")
    if focal_mm is not None and sensor_mm is not None:
        check_within("focal_mm", focal_mm, 0.1, LONGEST_MM, unit="mm")
        check_within("sensor_mm", sensor_mm, 0.1, LARGEST_SENSOR_MM, unit="mm")
    widths = None if focal_mm is None or sensor_mm is None else focal_mm / sensor_mm
    return Looking(spheres=spheres, circles=tuple(circle), focal_px=focal_px, focal_widths=widths)


def radius_in_m(radius_mm: float | None) -> float | None:
    """Return a sphere's radius in metres; raises UsageError where it cannot be meant."""
    if radius_mm is None:
        return None
    if not LEAST_RADIUS_MM <= radius_mm <= LARGEST_RADIUS_MM:
        raise UsageError(
            f"`radius_mm` {radius_mm:g}: no such sphere; expected the radius in millimetres, from {LEAST_RADIUS_MM:g} "
            f"to {LARGEST_RADIUS_MM:g}. (Metres? Then multiply by 1000.)"
        )
    return radius_mm / 1000
