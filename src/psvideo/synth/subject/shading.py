"""Light on what the camera sees: plates under one flash, and what the ambient light gives.

``plate = albedo * intensity * max(0, n . direction)`` holds exactly for Lambertian pixels that no shadow falls on, at
power 1 and the light's reference duration.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Floats
from psvideo.model.rig import Light, Rig
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.scene_tables import AmbientTable
from psvideo.synth.subject.material import colour
from psvideo.synth.subject.render import Hits, SeenScene, unit_vectors

LIFT = 1e-5
"""Shadow rays start this fraction of the scene's size above the surface, so that no triangle shadows itself."""


def flash_plate(
    view: SeenScene, rig: Rig, lights: Mapping[str, float], duration_s: float, emission: Emission
) -> NDArray[np.float32]:
    """Return what a row records that sees a whole flash of the given powers and length, (row, col, 3)."""
    collected = np.zeros_like(view.hits.albedo)
    for light in rig.lights:
        power = lights.get(light.name, 0.0)
        if power > 0:
            reference_s = light.reference_duration_s or duration_s
            energy = power * emission.whole(duration_s) / emission.whole(reference_s)
            collected += np.float32(energy) * light_collected(view, light)
    return view.hits.image(collected)


def light_collected(view: SeenScene, light: Light) -> Floats:
    """Return each hit's light under one lamp at full power and its reference duration, (hit, 3)."""
    hits = view.hits
    direction, distance_m, strength = irradiance(light, hits.point_m)
    cosine = np.maximum(np.einsum("ij,ij->i", hits.normal, direction), 0.0)
    cosine[_shadowed(view, direction, distance_m, cosine > 0)] = 0.0
    reflected = hits.albedo + _highlight(hits, direction)[:, None]
    return np.asarray(reflected * strength * cosine.astype(np.float32)[:, None], np.float32)


def irradiance(light: Light, points_m: Doubles) -> tuple[Doubles, Doubles, Floats]:
    """Return per point the unit direction to the light, the distance in metres (inf where distant), the irradiance."""
    strength = np.broadcast_to(np.asarray(light.by_channel, np.float32), (3,))
    if light.direction is not None:
        direction = np.broadcast_to(np.asarray(light.direction, np.float64), points_m.shape)
        return direction, np.full(len(points_m), np.inf), np.broadcast_to(strength, points_m.shape)
    towards = np.asarray(light.position_m, np.float64) - points_m
    distance_m = np.linalg.norm(towards, axis=1)
    direction = towards / distance_m[:, None]
    falloff = 1.0 / distance_m**2
    if light.anisotropy and light.axis is not None:
        falloff = falloff * np.maximum(-direction @ np.asarray(light.axis, np.float64), 0.0) ** light.anisotropy
    return direction, distance_m, strength * falloff.astype(np.float32)[:, None]


def _shadowed(view: SeenScene, direction: Doubles, distance_m: Doubles, lit: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return for each hit whether something stands between it and the light; only asked where the light could reach."""
    shadowed = np.zeros(len(lit), bool)
    if view.shadows is not None and lit.any():
        origins = lifted(view)[lit]
        shadowed[lit] = view.shadows.blocked(origins, direction[lit], distance_m[lit])
    return shadowed


def lifted(view: SeenScene) -> Doubles:
    """Return the hits' points (hit, 3) a little above their surface, where rays towards lights start."""
    size_m = view.shadows.size_m if view.shadows is not None else 0.0
    return np.asarray(view.hits.point_m + LIFT * size_m * view.hits.facet)


def _highlight(hits: Hits, direction: Doubles) -> NDArray[np.float32]:
    """Return the normalised Blinn-Phong lobe, in units of albedo: strength * (exponent + 8) / 8 * (n . h)^exponent."""
    strength, exponent = hits.gloss[:, 0], hits.gloss[:, 1]
    if not strength.any():
        return np.zeros(len(strength), np.float32)
    half = direction + hits.to_camera
    half = half / np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-300)
    cosine = np.maximum(np.einsum("ij,ij->i", hits.normal, half), 0.0)
    return np.asarray(strength * (exponent + 8.0) / 8.0 * cosine**exponent, np.float32)


def ambient_plate(view: SeenScene, table: AmbientTable) -> NDArray[np.float32]:
    """Return what one whole exposure collects of the light that does not flash, (row, col, 3)."""
    hits = view.hits
    sky = 1.0 - table.sky * 0.5 * (1.0 - hits.normal[:, 1])
    open_share = sky * _openness(view, table.occlusion_rays)
    return hits.image(hits.albedo * colour(table.level) * open_share.astype(np.float32)[:, None])


def _openness(view: SeenScene, rays: int) -> Doubles:
    """Return the cosine-weighted share of the sky that each hit sees, from a fixed spiral of directions."""
    hits = view.hits
    if rays == 0 or view.shadows is None:
        return np.ones(len(hits.sample))
    side = unit_vectors(np.cross(hits.normal, np.where(np.abs(hits.normal[:, :1]) > 0.9, [[0.0, 1, 0]], [[1.0, 0, 0]])))
    other = np.cross(hits.normal, side)
    origins, reach_m = lifted(view), np.full(len(hits.sample), np.inf)
    blocked = np.zeros(len(hits.sample))
    for index in range(rays):
        sine, angle = np.sqrt((index + 0.5) / rays), index * 2.399963
        direction = sine * (np.cos(angle) * side + np.sin(angle) * other) + np.sqrt(1 - sine**2) * hits.normal
        blocked += view.shadows.blocked(origins, direction, reach_m)
    return np.asarray(1.0 - blocked / rays)
