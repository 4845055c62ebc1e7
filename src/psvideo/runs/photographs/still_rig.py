"""Where the lights of photographs are: from a list or a rig, or from mirror spheres under the same lights."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from psvideo.calibrate.light_files import pictures_in
from psvideo.calibrate.mirror.lights import calibrate_lights, check_enough
from psvideo.calibrate.mirror.sighting import Sighting, cut_differently, sight_spheres, size_px
from psvideo.calibrate.sphere.sphere_view import Looking
from psvideo.calibrate.still_places import Place, grouped_pictures
from psvideo.clip.stated import Stated, stated_by
from psvideo.compute.progress import Watch
from psvideo.errors import PsvideoError
from psvideo.formats.light_lists.light_list_reader import pictures_named_by
from psvideo.formats.rig_toml import read_rig
from psvideo.model.rig import Rig
from psvideo.runs.photographs.light_sets import open_photographs, sets_of
from psvideo.runs.photographs.opened_sets import Reading
from psvideo.runs.steps.caller import Caller

SAME_LENS = 1.01
"""A zoom that was not touched states the same; prime lenses always do."""


@dataclass(frozen=True, kw_only=True)
class KnownLights:
    """Lights before they are paired with pictures. ``called`` are the names by which pictures may be found, ``own``
    whether the lights have names of their own to keep, ``whose`` what messages call the source. ``size_px`` (width,
    height) are the pictures of spheres: in photographs of another size the lens's axis lies elsewhere."""

    rig: Rig
    called: tuple[str, ...]
    own: bool
    whose: str
    size_px: tuple[int, int] | None = None
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def named(self) -> bool:
        """Whether there is anything to pair by."""
        return len(self.called) == len(self.rig.lights)

    def at(self, places: Sequence[int], names: Sequence[str]) -> Rig:
        """Return the rig of the lights at these places, under these names."""
        lights = tuple(replace(self.rig.lights[place], name=name) for place, name in zip(places, names, strict=True))
        return replace(self.rig, lights=lights)


def listed_lights(path: Path) -> KnownLights:
    """Read a rig or a list of lights, with the pictures that it names. Raises PsvideoError where it cannot be used."""
    rig, pictures = read_rig(path), pictures_named_by(path)
    own = path.suffix == ".toml"
    if pictures and len(pictures) != len(rig.lights):
        raise PsvideoError(
            f"{path}: names {len(pictures)} pictures and holds {len(rig.lights)} directions. Expected one name in "
            "every line, or none in any."
        )
    return KnownLights(rig=rig, called=rig.names if own else pictures, own=own, whose=path.name)


def sphere_lights(
    spheres: Sequence[Path],
    looking: Looking,
    *,
    radius_m: float | None,
    transfer: str | None,
    watch: Watch,
    caller: Caller,
) -> KnownLights:
    """Measure the lights on mirror spheres, one folder of pictures for each place; near where radius and lens say so.

    With near lights the surface is taken to be as far away as the spheres. Raises PsvideoError where no sphere is
    found, one is cut off, or too few of the lights are measured.
    """
    places = grouped_pictures(spheres)
    looking, notes = _through_its_lens(looking, places)
    sightings = _sighted(places, looking, transfer=transfer, watch=watch, caller=caller)
    found = calibrate_lights(sightings, radius_m=radius_m)
    check_enough(found)
    rig = found.rig
    if any(light.position_m is not None for light in rig.lights):
        rig = replace(rig, plane=plane_of(sightings, radius_m or 0.0))
    near = sum(light.position_m is not None for light in rig.lights)
    what = f"{near} near, with positions" if near else _why_directions(sightings, radius_m)
    note = f"{len(rig.lights)} of {len(found.lights)} lights were measured on {_spheres(len(sightings))}, {what}."
    whose = ", ".join(Path(one.called).name if isinstance(one, Place) else one.name for one in places)
    return KnownLights(
        rig=rig,
        called=rig.names,
        own=False,
        whose=whose,
        size_px=size_px(sightings[0]),
        notes=(*notes, note),
        warnings=tuple(found.warnings),
    )


def plane_of(sightings: Sequence[Sighting], radius_m: float) -> tuple[float, float, float, float]:
    """Return the plane across the view in which the spheres' middles lie, on the mean."""
    away_m = [-radius_m * one.outline.view.sphere(one.outline.place)[0][2] for one in sightings]
    return (0.0, 0.0, 1.0, float(np.mean(away_m)))


def _through_its_lens(looking: Looking, places: Sequence[Path | Place]) -> tuple[Looking, tuple[str, ...]]:
    """Return how the camera looks, by the focal length that EXIF states where none is known, and a note of it."""
    if looking.focal_px is not None or looking.focal_widths is not None:
        return looking, ()
    lens_px = lens_stated([stated_by(file) for place in places for file in _files_of(place)])
    if lens_px is None:
        return looking, ()
    note = f"The spheres were seen through a lens of {lens_px:.6g} pixels, as their EXIF says."
    return replace(looking, focal_px=lens_px), (note,)


def _sighted(
    places: Sequence[Path | Place], looking: Looking, *, transfer: str | None, watch: Watch, caller: Caller
) -> list[Sighting]:
    """Return the spheres of all places. Raises PsvideoError where places show other lights than the first."""
    sightings: list[Sighting] = []
    names: tuple[str, ...] = ()
    first = ""
    reading = Reading(transfer=transfer)
    for place in places:
        path = place.called if isinstance(place, Place) else str(place)
        if isinstance(place, Place):
            opened = open_photographs(place, reading)
        else:
            opened = sets_of(place, reading, watch=watch, caller=caller)
        if names and opened.names != names:
            raise PsvideoError(
                f"{path}: shows the lights {', '.join(opened.names[:3])}, …, and {first} "
                f"{', '.join(names[:3])}, …. Expected the same names in every folder of sphere pictures, one for each "
                "light."
            )
        names, first = opened.names, first or path
        sightings += sight_spheres(opened.sets, looking, where=path, room=opened.room)
    return sightings


def _why_directions(sightings: Sequence[Sighting], radius_m: float | None) -> str:
    """Return why lights seen on these spheres have no positions."""
    if len(sightings) < 2 or cut_differently(sightings):
        return "as directions"
    lacking = ["`radius_mm`"] if radius_m is None else []
    if sightings[0].outline.view.focal_px is None:
        lacking.append("the lens (`focal_px`, or `focal_mm` with `sensor_mm`)")
    if lacking:
        return f"as directions; {' and '.join(lacking)} would give those that stand near a position"
    return "as directions, as no light is so near that its rays cross in one point"


def lens_stated(stated: Sequence[Stated]) -> float | None:
    """Return the focal length in pixels that pictures say by their EXIF, None where one says none or another."""
    found = [one.focal_px for one in stated]
    known = [one for one in found if one is not None]
    return known[0] if len(known) == len(found) > 0 and max(known) < SAME_LENS * min(known) else None


def _files_of(place: Path | Place) -> Sequence[Path]:
    if isinstance(place, Place):
        return place.files
    return pictures_in(place) if place.is_dir() else ()


def _spheres(count: int) -> str:
    return "1 sphere" if count == 1 else f"{count} spheres"
