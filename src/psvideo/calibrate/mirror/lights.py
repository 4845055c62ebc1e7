"""Where lights are, from their highlights on mirror spheres.

The highlight of a light is where the sphere mirrors the viewing ray into the light's direction. What is known of the
view decides how rays are taken (``sphere_view``); one or more sightings (frames, spheres, places) are joined: distant
lights as a mean direction, near ones as the point where the mirrored rays meet (``law``). Lights that are not
found are named with the reason, and left out of the rig. Highlights clip, so they show no intensity: all lights get 1.
"""

from collections.abc import Sequence

import numpy as np

from psvideo.calibrate.mirror.law import SURE_ERRORS, Crossing, Ray, crossing, mean_direction, mirrored_ray
from psvideo.calibrate.mirror.measured import MeasuredLight, MirrorCalibration
from psvideo.calibrate.mirror.mirror_doubts import doubts_of
from psvideo.calibrate.mirror.sighting import Highlight, Sighting, cut_differently, lacking_for_positions
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.rig import too_few_measured
from psvideo.model.units import counted

DISAGREE_DEG = 10.0
"""Directions from two spheres that differ by more, and do not meet in a point, cannot both be right."""
MOST_ERROR_DEG = 20.0
"""A light whose direction is less known is left out: another one of the rig may stand there."""
MOST_POSITION_ERROR = 0.15
"""Share of its distance by which a near light's position may be uncertain; beyond, it gets a direction only."""

NAMED = 3
"""Lights that could not be measured and are named, where too few are left; how many more there are is said."""


class TooFewLightsError(PsvideoError):
    """Spheres that show too few lights; ``found`` is what was taken for the spheres and their highlights."""

    def __init__(self, found: MirrorCalibration) -> None:
        super().__init__(_few(found.lights, found.sightings))
        self.found = found


def calibrate_lights(sightings: Sequence[Sighting], *, radius_m: float | None = None) -> MirrorCalibration:
    """Return every light's direction or position from one or more sightings of mirror spheres.

    ``radius_m`` is the spheres' radius; with it, a known focal length and two or more sightings in pictures of one
    size, near lights get positions. Raises TooFewLightsError where no light at all could be measured.
    """
    known_m = None if cut_differently(sightings) else radius_m
    names = list(dict.fromkeys(one.light for sighting in sightings for one in sighting.highlights))
    lights = tuple(_measured(name, sightings, known_m) for name in names)
    if all(light.fault for light in lights):
        raise TooFewLightsError(MirrorCalibration(lights=lights, sightings=tuple(sightings), warnings=()))
    doubts = doubts_of(lights, sightings, radius_m=radius_m)
    return MirrorCalibration(lights=lights, sightings=tuple(sightings), warnings=doubts)


def check_enough(found: MirrorCalibration) -> None:
    """Raise TooFewLightsError where fewer than half of the lights were measured, or fewer than the three that normals
    need, though so many were shown: then what is there is hardly a mirror, and its highlights are chance."""
    if too_few_measured(sum(not light.fault for light in found.lights), shown=len(found.lights)):
        raise TooFewLightsError(found)


def _few(lights: Sequence[MeasuredLight], sightings: Sequence[Sighting]) -> str:
    lost = [light for light in lights if light.fault]
    measured = len(lights) - len(lost)
    reasons = "; ".join(f"{light.name}: {light.fault}" for light in lost[:NAMED])
    if len(lost) > NAMED:
        reasons += f"; and {counted(len(lost) - NAMED, 'more light')}"
    told = next((f"{one.doubt.partition('. ')[0]}; " for one in sightings if one.doubt), "")
    what = f"only {measured} of {len(lights)} lights" if measured else "no light"
    return (
        f"{sightings[0].where}: {what} could be measured on the sphere ({told}{reasons}). Expected a small bright "
        "highlight of each light on a shiny sphere; a matte sphere is for psvideo calibrate matte-sphere. Look at "
        "where the sphere was taken to be, and mark it with `circle` where that was wrong."
    )


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
    can_cross = radius_m is not None and sightings[0].outline.view.focal_px is not None
    found = _joined(name, rays, can_cross=can_cross, lacking=lacking_for_positions(sightings))
    if found.error_deg > MOST_ERROR_DEG:
        return MeasuredLight(name=name, rays=found.rays, fault=_unsure(found.error_deg))
    return found


def _unsure(error_deg: float) -> str:
    known = f"known to {error_deg:.0f} degrees only" if error_deg < 90 else "not known"
    return f"its direction is {known}: where the sphere is, is not sure, or the highlight lies at its very rim"


def _ray(sighting: Sighting, place: Doubles, one: Highlight, radius_m: float | None) -> Ray | None:
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


def _joined(name: str, rays: Sequence[Ray], *, can_cross: bool, lacking: str) -> MeasuredLight:
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
        return MeasuredLight(name=name, rays=tuple(rays), fault=_apart(2 * spread, lacking))
    return MeasuredLight(name=name, rays=tuple(rays), direction=mean, error_deg=error_deg)


def _apart(spread_deg: float, lacking: str) -> str:
    return (
        f"the spheres' directions differ by up to {spread_deg:.1f} degrees: the light is near (give "
        f"{lacking} for its position), or one highlight is a wrong one"
    )


def _sideways_deg(meeting: Crossing, towards: Doubles, distance_m: float) -> float:
    """Return the angle that a position's error makes as seen from the spheres."""
    across = np.eye(3) - np.outer(towards, towards)
    return float(np.degrees(np.sqrt(np.trace(across @ meeting.covariance @ across)) / distance_m))
