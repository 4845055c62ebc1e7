"""What every pixel sees: one ray per pixel centre (or a grid of rays) against the posed scene."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Floats
from psvideo.synth.scene_tables import CameraTable
from psvideo.synth.subject.body import Body
from psvideo.synth.subject.rays import Caster, barycentric


@dataclass(frozen=True, kw_only=True)
class Hits:
    """The points that rays hit, in rising order of ``sample`` (row-major over the grid of rays).

    ``normal`` is what is shaded (smooth or flat), ``facet`` the triangle's own, both towards the camera; ``to_camera``
    is the unit vector back along the ray; ``gloss`` holds the specular strength and exponent, shape (hit, 2).
    """

    size: tuple[int, int, int]
    sample: NDArray[np.intp]
    point_m: Doubles
    normal: Doubles
    facet: Doubles
    to_camera: Doubles
    albedo: Floats
    gloss: NDArray[np.float32]

    def image(self, values: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return values per hit, (hit,) or (hit, channel), as an image; the mean over each pixel's rays, 0 beside."""
        height, width, rays = self.size
        grid = np.zeros((height * rays * width * rays, *values.shape[1:]), np.float32)
        grid[self.sample] = values
        grid = grid.reshape(height, rays, width, rays, *values.shape[1:])
        return np.asarray(grid[:, 0, :, 0] if rays == 1 else grid.mean(axis=(1, 3)), np.float32)


@dataclass(frozen=True, kw_only=True)
class SeenScene:
    """The scene at one instant: what the camera hits, and the triangles that can shadow it."""

    hits: Hits
    shadows: Caster | None


def camera_rays(camera: CameraTable, far_m: float) -> tuple[Doubles, Doubles]:
    """Return origins and unit directions of all rays, each (ray, 3); orthographic rays start at z = ``far_m``."""
    rows, cols, rays = camera.height_px, camera.width_px, camera.rays
    offsets = (np.arange(rays) + 0.5) / rays - 0.5
    middle_x, middle_y = camera.principal
    y = middle_y - (np.arange(rows)[:, None] + offsets).ravel()
    x = (np.arange(cols)[:, None] + offsets).ravel() - middle_x
    plane = np.stack(np.broadcast_arrays(x[None, :], y[:, None]), axis=-1).reshape(-1, 2)
    if camera.view == "orthographic":
        pixel_m = camera.width_m / cols
        origins = np.column_stack([plane * pixel_m, np.full(len(plane), far_m)])
        return origins, np.broadcast_to([0.0, 0.0, -1.0], origins.shape)
    directions = np.column_stack([plane / (camera.focal_px or 1.0), np.full(len(plane), -1.0)])
    return np.zeros_like(directions), directions / np.linalg.norm(directions, axis=1, keepdims=True)


def cast_rays(bodies: Sequence[Body], camera: CameraTable, time_s: float) -> SeenScene:
    """Pose the bodies at a time on the camera's clock and cast the camera's rays at them."""
    poses = [body.pose(time_s) for body in bodies]
    vertices = np.concatenate([vertices for vertices, _ in poses])
    normals = np.concatenate([normals for _, normals in poses])
    firsts = np.cumsum([0] + [len(body.rest_m) for body in bodies])
    faces = np.concatenate([body.shape.faces + first for body, first in zip(bodies, firsts[:-1], strict=True)])
    owner = np.repeat(np.arange(len(bodies)), [len(body.shape.faces) for body in bodies])
    caster = Caster(vertices, faces.astype(np.int32))
    origins, directions = camera_rays(camera, far_m=float(vertices[:, 2].max()) + 1.0)
    face = caster.first(origins, directions)
    sample = np.flatnonzero(face >= 0)
    face, origins, directions = face[sample], origins[sample], directions[sample]
    corners = vertices[faces[face]]
    distance, weights = barycentric(origins, directions, corners)
    facet = unit_vectors(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    smooth = unit_vectors(np.einsum("pcx,pc->px", normals[faces[face]], weights))
    flat = np.array([body.table.shading == "flat" for body in bodies])[owner[face]]
    normal = np.where(flat[:, None], facet, smooth)
    back = np.einsum("ij,ij->i", facet, directions) > 0
    facet, normal = np.where(back[:, None], -facet, facet), np.where(back[:, None], -normal, normal)
    local = faces[face] - firsts[owner[face]][:, None]
    hits = Hits(
        size=(camera.height_px, camera.width_px, camera.rays),
        sample=sample,
        point_m=origins + distance[:, None] * directions,
        normal=normal,
        facet=facet,
        to_camera=-directions,
        albedo=_albedo(bodies, owner[face], local, weights),
        gloss=np.array([_gloss(body) for body in bodies], np.float32)[owner[face]],
    )
    return SeenScene(hits=hits, shadows=_shadow_caster(bodies, vertices, faces, owner, caster))


def unit_vectors(vectors: Doubles) -> Doubles:
    """Return vectors (point, 3) of length 1 that point the same way; those without a length stay zero."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300))


def _albedo(bodies: Sequence[Body], owner: NDArray[np.intp], corners: NDArray[np.intp], weights: Doubles) -> Floats:
    albedo = np.zeros((len(owner), 3), np.float32)
    for index, body in enumerate(bodies):
        own = owner == index
        albedo[own] = body.albedo(corners[own], weights[own])
    return albedo


def _gloss(body: Body) -> tuple[float, float]:
    """Return a body's specular strength and Blinn-Phong exponent: 2 / roughness^4 - 2 (Walter et al. 2007)."""
    lobe = body.table.specular
    return (0.0, 1.0) if lobe is None else (lobe.strength, max(2.0 / lobe.roughness**4 - 2.0, 0.0))


def _shadow_caster(
    bodies: Sequence[Body], vertices: Doubles, faces: NDArray[np.integer], owner: NDArray[np.intp], caster: Caster
) -> Caster | None:
    casts = np.array([body.table.casts_shadow for body in bodies])
    if casts.all():
        return caster
    kept = faces[casts[owner]]
    return Caster(vertices, kept.astype(np.int32)) if len(kept) else None
