"""What is to be distrusted of lights that were measured on mirror spheres, in sentences."""

from collections.abc import Sequence

import numpy as np

from psvideo.calibrate.mirror.law import SURE_ERRORS, mean_direction
from psvideo.calibrate.mirror.measured import MeasuredLight
from psvideo.calibrate.mirror.sighting import Sighting, cut_differently, lacking_for_positions, size_px
from psvideo.solve.normals.illumination import MAX_CONDITION

SMALL_RADIUS_PX = 60.0
USUAL_FIELDS_DEG = (25.0, 50.0)
"""Horizontal fields of view of a long and of a normal lens, to say what an unknown focal length may cost."""


def doubts_of(
    lights: Sequence[MeasuredLight], sightings: Sequence[Sighting], *, radius_m: float | None
) -> tuple[str, ...]:
    """Return what an unknown lens, small or moving spheres, and each light's highlights leave open; ``radius_m`` as for
    ``calibrate_lights``."""
    return (
        *_about_view(sightings),
        *_about_sizes(sightings, radius_m),
        *_about_spheres(sightings),
        *_about_lights(lights, sightings, radius_m),
    )


def _about_view(sightings: Sequence[Sighting]) -> list[str]:
    """Say what an unknown focal length costs."""
    view = sightings[0].outline.view
    if view.focal_px is not None:
        return []
    outline = max((sighting.outline for sighting in sightings), key=lambda one: view.off_axis_deg(one.place, 1000.0))
    width, _ = size_px(sightings[0])
    long_deg, normal_deg = (
        view.off_axis_deg(outline.place, width / 2 / np.tan(np.radians(field / 2))) for field in USUAL_FIELDS_DEG
    )
    stretched = np.degrees(np.arccos(1 / (1 + outline.ellipticity)))
    seen = (
        f" Its outline is {outline.ellipticity:.1%} longer than wide, as at {stretched:.0f} degrees off the axis."
        if outline.ellipticity > 0.004
        else ""
    )
    return [
        "the focal length is not known, so the view is assumed orthographic, and all directions are wrong by about "
        f"the angle by which the sphere stands off the lens's axis: {long_deg:.1f} degrees with a lens of "
        f"{USUAL_FIELDS_DEG[0]:.0f} degrees field of view, {normal_deg:.1f} with {USUAL_FIELDS_DEG[1]:.0f}.{seen} Give "
        "`focal_px`, or `focal_mm` and `sensor_mm`. The standard errors leave this out."
    ]


def _about_sizes(sightings: Sequence[Sighting], radius_m: float | None) -> list[str]:
    """Say what pictures of several sizes cost."""
    cut = cut_differently(sightings)
    if not cut or (radius_m is None and sightings[0].outline.view.focal_px is None):
        return []
    return [
        f"the pictures of the spheres are {cut} pixels, so they were cropped, and where the lens's axis is in them is "
        "not known: lights get directions, wrong by about the angle by which a crop's middle is off the axis, and no "
        "positions. Give whole pictures"
    ]


def _about_spheres(sightings: Sequence[Sighting]) -> list[str]:
    said = []
    for sighting in sightings:
        outline = sighting.outline
        if sighting.doubt:
            said.append(f"{sighting.where}: {sighting.doubt}")
        if outline.radius_px < SMALL_RADIUS_PX:
            said.append(
                f"{sighting.where}: the sphere's radius is {outline.radius_px:.0f} pixels; below {SMALL_RADIUS_PX:.0f} "
                "half a pixel costs more than 2 degrees. Go nearer"
            )
        if sighting.moved_px > max(3 * outline.error_px, 1.0):
            said.append(
                f"{sighting.where}: the outline moves by {sighting.moved_px:.1f} pixels from frame to frame; the "
                "sphere or the camera did not stand still"
            )
    return said


def _about_lights(lights: Sequence[MeasuredLight], sightings: Sequence[Sighting], radius_m: float | None) -> list[str]:
    good = [light for light in lights if not light.fault and light.direction is not None]
    left_out = [f"light {light.name!r} is left out of the rig: {light.fault}" for light in lights if light.fault]
    can_cross = radius_m is not None and sightings[0].outline.view.focal_px is not None
    lacking = "" if can_cross and not cut_differently(sightings) else lacking_for_positions(sightings)
    return [*left_out, *_disagreeing(good, lacking=lacking), *_clipped(sightings), *_in_a_plane(good)]


def _disagreeing(good: Sequence[MeasuredLight], *, lacking: str) -> list[str]:
    """Name the lights that several spheres see in different directions, and that got no position."""
    excess = [light for light in good if len(light.rays) > 1 and mean_direction(light.rays)[2] > SURE_ERRORS]
    distant = [light.name for light in excess if light.position_m is None]
    if not distant:
        return []
    cause = (
        f"they stand near: give {lacking} to get positions"
        if lacking
        else "their rays do not cross well enough for a position: put the spheres further apart"
    )
    return [f"the spheres see the lights {', '.join(distant)} in different directions; {cause}"]


def _clipped(sightings: Sequence[Sighting]) -> list[str]:
    """Name the lights whose highlights are clipped over much of a sphere."""
    large = [
        one.light
        for sighting in sightings
        for one in sighting.highlights
        if one.clipped and one.radius_px > 0.1 * sighting.outline.radius_px
    ]
    if not large:
        return []
    return [
        f"the highlights of {', '.join(dict.fromkeys(large))} are clipped in all channels over a tenth of the "
        "sphere's radius; their middle is known only roughly. Expose less, or dim the lights"
    ]


def _in_a_plane(good: Sequence[MeasuredLight]) -> list[str]:
    """Say where the lights lie nearly in one plane with the sphere."""
    if len(good) < 3:
        return []
    values = np.linalg.svd(np.array([light.direction for light in good]), compute_uv=False)
    condition = float(values[0] / max(values[2], 1e-12))
    if condition <= MAX_CONDITION:
        return []
    return [
        f"the lights lie nearly in one plane with the sphere (condition number {condition:.3g}, at most "
        f"{MAX_CONDITION:g} is solved with): normals across that plane would be noise. Move one out of it"
    ]
