"""Where lights are, from their highlights on mirror spheres.

The highlight of a light is where the sphere mirrors the viewing ray into the light's direction. What is known of the
view decides how rays are taken (``sphere_view``); one or more sightings (frames, spheres, places) are joined: distant
lights as a mean direction, near ones as the point where the mirrored rays meet (``law``). Lights that are not
found are named with the reason, and left out of the rig. Highlights clip, so they show no intensity: all lights get 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.calibrate.mirror.law import Crossing, Ray, crossing, mean_direction, mirrored_ray
from psvideo.calibrate.mirror.sighting import Highlight, Sighting
from psvideo.errors import PsvideoError
from psvideo.model.camera import FloatArray
from psvideo.model.rig import Light, Rig
from psvideo.solve.normals.illumination import MAX_CONDITION

DISAGREE_DEG = 10.0
"""Directions from two spheres that differ by more, and do not meet in a point, cannot both be right."""
SURE_ERRORS = 4.0
"""Excess of the rays' scatter over their errors from which on a light counts as near."""
MOST_POSITION_ERROR = 0.15
"""Share of its distance by which a near light's position may be uncertain; beyond, it gets a direction only."""
SMALL_RADIUS_PX = 60.0
USUAL_FIELDS_DEG = (25.0, 50.0)
"""Horizontal fields of view of a long and of a normal lens, to say what an unknown focal length may cost."""


@dataclass(frozen=True, kw_only=True)
class MeasuredLight:
    """What is known of one light: a direction with its standard error, and a position where rays could be crossed.

    ``error_deg`` is the root mean square angle. ``fault`` says why the light is left out of the rig.
    """

    name: str
    rays: tuple[Ray, ...] = ()
    direction: FloatArray | None = None
    error_deg: float = 0.0
    position_m: FloatArray | None = None
    position_error_m: float = 0.0
    fault: str = ""


@dataclass(frozen=True, kw_only=True)
class MirrorCalibration:
    """The lights measured on mirror spheres, the sightings that they rest on, and what is to be distrusted."""

    lights: tuple[MeasuredLight, ...]
    sightings: tuple[Sighting, ...]
    warnings: tuple[str, ...]

    @property
    def rig(self) -> Rig:
        """The rig of the lights that could be measured."""
        view = self.sightings[0].outline.view
        focal = None if view.focal_px is None else (view.focal_px, view.focal_px)
        return Rig(
            lights=tuple(_as_light(light) for light in self.lights if not light.fault),
            focal_px=focal,
            principal_px=None if focal is None else view.principal_px,
        )


def _as_light(light: MeasuredLight) -> Light:
    error_deg = round(light.error_deg, 3)
    if light.position_m is not None:
        x, y, z = (round(float(value), 5) for value in light.position_m)
        return Light(name=light.name, position_m=(x, y, z), error_deg=error_deg)
    if light.direction is None:
        raise ValueError(f"light {light.name!r} has no direction")
    across, up, towards = (float(value) for value in light.direction)
    return Light(name=light.name, direction=(across, up, towards), error_deg=error_deg)


def calibrate_lights(sightings: Sequence[Sighting], *, radius_m: float | None = None) -> MirrorCalibration:
    """Return every light's direction or position from one or more sightings of mirror spheres.

    ``radius_m`` is the spheres' radius; with it, a known focal length and two or more sightings, near lights get
    positions. Raises PsvideoError where no light at all could be measured.
    """
    names = list(dict.fromkeys(one.light for sighting in sightings for one in sighting.highlights))
    lights = tuple(_measured(name, sightings, radius_m) for name in names)
    if all(light.fault for light in lights):
        reasons = "; ".join(f"{light.name}: {light.fault}" for light in lights[:3])
        raise PsvideoError(
            f"{sightings[0].where}: no light could be measured on the sphere ({reasons}). Expected a small bright "
            "highlight of each light on a shiny sphere; a matte sphere is for psvideo calibrate matte-sphere. "
            "Look at where the sphere was taken to be, and mark it with `circle` where that was wrong."
        )
    warnings = (*_about_view(sightings), *_about_spheres(sightings), *_about_lights(lights, sightings, radius_m))
    return MirrorCalibration(lights=lights, sightings=tuple(sightings), warnings=warnings)


def _measured(name: str, sightings: Sequence[Sighting], radius_m: float | None) -> MeasuredLight:
    """Join what the sightings say of one light."""
    seen = [
        (sighting, one)
        for sighting in sightings
        for one in sighting.highlights
        if one.light == name and one.place is not None
    ]
    if not seen:
        fault = next(one.fault for sighting in sightings for one in sighting.highlights if one.light == name)
        return MeasuredLight(name=name, fault=fault)
    sure = [(sighting, one.place, one) for sighting, one in seen if not one.alike and one.place is not None]
    if not sure:
        return MeasuredLight(name=name, fault=_doubtful(seen[0][1]))
    rays = [ray for sighting, place, one in sure if (ray := _ray(sighting, place, one, radius_m)) is not None]
    if not rays:
        return MeasuredLight(name=name, fault="its highlight lies on the very rim of the sphere, or outside")
    rays += [
        ray for sighting, one in seen if one.alike and (ray := _agreeing(sighting, one, rays, radius_m)) is not None
    ]
    return _joined(name, rays, can_cross=radius_m is not None and sightings[0].outline.view.focal_px is not None)


def _ray(sighting: Sighting, place: FloatArray, one: Highlight, radius_m: float | None) -> Ray | None:
    return mirrored_ray(sighting.outline, place, one.error_px, radius_m=radius_m)


def _doubtful(one: Highlight) -> str:
    places = " and ".join(f"{spot.place[0]:.0f},{spot.place[1]:.0f}" for spot in one.alike)
    here = "" if one.place is None else f"{one.place[0]:.0f},{one.place[1]:.0f}"
    return (
        f"several bright spots could be its highlight, at {here} and {places}: cover what mirrors the light a second "
        "time, or show a second sphere"
    )


def _agreeing(sighting: Sighting, one: Highlight, rays: Sequence[Ray], radius_m: float | None) -> Ray | None:
    """Return the ray of the spot, out of several alike ones, that agrees with what other sightings say for certain."""
    mean, _, _ = mean_direction(rays)
    places = [spot.place for spot in one.alike] + ([] if one.place is None else [one.place])
    made = [ray for place in places if (ray := _ray(sighting, place, one, radius_m)) is not None]
    nearest = max(made, key=lambda ray: float(ray.direction @ mean), default=None)
    if nearest is None or nearest.direction @ mean < np.cos(np.radians(DISAGREE_DEG)):
        return None
    return nearest


def _joined(name: str, rays: Sequence[Ray], *, can_cross: bool) -> MeasuredLight:
    """Return a light as a position where its rays cross well, else as their mean direction."""
    mean, error_deg, excess = mean_direction(rays)
    meeting = crossing(rays) if can_cross and len(rays) > 1 else None
    if meeting is not None and excess > max(SURE_ERRORS, 2 * meeting.excess):
        middle = np.mean([ray.start for ray in rays], axis=0)
        away = meeting.position_m - middle
        distance_m = float(np.linalg.norm(away))
        if meeting.error_m < MOST_POSITION_ERROR * distance_m:
            towards = away / distance_m
            return MeasuredLight(
                name=name,
                rays=tuple(rays),
                direction=towards,
                error_deg=_sideways_deg(meeting, towards, distance_m),
                position_m=meeting.position_m,
                position_error_m=meeting.error_m,
            )
    spread = max(float(np.degrees(np.arccos(np.clip(ray.direction @ mean, -1, 1)))) for ray in rays)
    if 2 * spread > DISAGREE_DEG and excess > SURE_ERRORS and not can_cross:
        return MeasuredLight(name=name, rays=tuple(rays), fault=_apart(2 * spread))
    return MeasuredLight(name=name, rays=tuple(rays), direction=mean, error_deg=error_deg)


def _apart(spread_deg: float) -> str:
    return (
        f"the spheres' directions differ by up to {spread_deg:.1f} degrees: the light is near (give `radius_mm` and "
        "`focal_px` for its position), or one highlight is a wrong one"
    )


def _sideways_deg(meeting: Crossing, towards: FloatArray, distance_m: float) -> float:
    """Return the angle that a position's error makes as seen from the spheres."""
    across = np.eye(3) - np.outer(towards, towards)
    return float(np.degrees(np.sqrt(np.trace(across @ meeting.covariance @ across)) / distance_m))


def _about_view(sightings: Sequence[Sighting]) -> list[str]:
    """Say what an unknown focal length costs."""
    view = sightings[0].outline.view
    if view.focal_px is not None:
        return []
    outline = max((sighting.outline for sighting in sightings), key=lambda one: view.off_axis_deg(one.place, 1000.0))
    width = 2 * view.principal_px[0] + 1
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


def _about_spheres(sightings: Sequence[Sighting]) -> list[str]:
    said = []
    for sighting in sightings:
        outline = sighting.outline
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
    said = [f"light {light.name!r} is left out of the rig: {light.fault}" for light in lights if light.fault]
    good = [light for light in lights if not light.fault and light.direction is not None]
    excess = [light for light in good if len(light.rays) > 1 and mean_direction(light.rays)[2] > SURE_ERRORS]
    distant = [light.name for light in excess if light.position_m is None]
    if distant:
        cause = (
            "their rays do not cross well enough for a position: put the spheres further apart"
            if radius_m is not None and sightings[0].outline.view.focal_px is not None
            else "they stand near: give `radius_mm` and the focal length to get positions"
        )
        said.append(f"the spheres see the lights {', '.join(distant)} in different directions; {cause}")
    large = [
        one.light
        for sighting in sightings
        for one in sighting.highlights
        if one.clipped and one.radius_px > 0.1 * sighting.outline.radius_px
    ]
    if large:
        said.append(
            f"the highlights of {', '.join(dict.fromkeys(large))} are clipped in all channels over a tenth of the "
            "sphere's radius; their middle is known only roughly. Expose less, or dim the lights"
        )
    if len(good) >= 3:
        values = np.linalg.svd(np.array([light.direction for light in good]), compute_uv=False)
        condition = float(values[0] / max(values[2], 1e-12))
        if condition > MAX_CONDITION:
            said.append(
                f"the lights lie nearly in one plane with the sphere (condition number {condition:.3g}, at most "
                f"{MAX_CONDITION:g} is solved with): normals across that plane would be noise. Move one out of it"
            )
    return said
