"""A mesh before it is placed: vertices, faces, normals, and what the mesh itself says about its colours."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import trimesh
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.synth.camera.curves import CURVES

SUFFIXES = (".obj", ".ply", ".stl", ".glb", ".gltf", ".off")

UNPAINTED_PX = 4
"""trimesh gives files with texture coordinates and no picture a grey one of two by two pixels: that is no texture."""


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A triangle mesh. ``normals`` are unit vectors per vertex, ``colours`` linear albedo per vertex.

    Shapes: vertices and normals (vertex, 3), faces (face, 3), colours (vertex, 3), uv (vertex, 2) with v upwards,
    texture (row, col, 3) linear. Edges are hard where vertices are doubled.
    """

    vertices: Doubles
    faces: NDArray[np.int32]
    normals: Doubles
    colours: NDArray[np.float32] | None = None
    uv: Doubles | None = None
    texture: NDArray[np.float32] | None = None


def make_shape(vertices: Doubles, faces: NDArray[np.integer], colours: Doubles | None = None) -> Shape:
    """Return a shape of vertices (vertex, 3), faces (face, 3) and colours (vertex, 3).

    Its normals are the area-weighted means of the faces around each vertex.
    """
    return Shape(
        vertices=np.asarray(vertices, np.float64),
        faces=np.asarray(faces, np.int32),
        normals=vertex_normals(vertices, faces),
        colours=None if colours is None else np.asarray(colours, np.float32),
    )


def merged(*shapes: Shape) -> Shape:
    """Return several shapes as one; colours stay where all of them have colours."""
    firsts = np.cumsum([0] + [len(shape.vertices) for shape in shapes[:-1]])
    colours = [shape.colours for shape in shapes if shape.colours is not None]
    return Shape(
        vertices=np.concatenate([shape.vertices for shape in shapes]),
        faces=np.concatenate([shape.faces + first for shape, first in zip(shapes, firsts, strict=True)]).astype(
            np.int32
        ),
        normals=np.concatenate([shape.normals for shape in shapes]),
        colours=np.concatenate(colours) if len(colours) == len(shapes) else None,
    )


def vertex_normals(vertices: Doubles, faces: NDArray[np.integer]) -> Doubles:
    """Return unit normals (vertex, 3): the sum of the adjoining faces' normals, each weighted by its area."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    crosses = np.cross(b - a, c - a)
    corner, crosses = faces.ravel(), np.repeat(crosses, 3, axis=0)
    sums = np.stack([np.bincount(corner, crosses[:, axis], len(vertices)) for axis in range(3)], axis=1)
    return np.asarray(sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), 1e-300))


def load_shape(path: Path) -> Shape:
    """Read a mesh file with its texture or vertex colours. Raises PsvideoError where it cannot be read."""
    if path.suffix.lower() not in SUFFIXES:
        raise PsvideoError(f"{path}: not a mesh that can be read; expected one of {', '.join(SUFFIXES)}.")
    if not path.is_file():
        raise PsvideoError(f"{path}: there is no such mesh file. Paths in a scene count from the scene file's folder.")
    try:
        mesh = trimesh.load_scene(path, process=False).to_mesh()
    except Exception as fault:  # trimesh's loaders raise what their parsers do
        raise PsvideoError(
            f"{path}: cannot be read as a mesh ({fault}). Export it again as OBJ, PLY, STL or GLB."
        ) from fault
    if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
        raise PsvideoError(f"{path}: holds no triangles with finite vertices. Export the mesh again, with its faces.")
    vertices, faces = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32)
    colours, uv, texture = _own_colours(mesh)
    return Shape(
        vertices=vertices,
        faces=faces,
        normals=_seamless_normals(vertices, faces),
        colours=colours,
        uv=uv,
        texture=texture,
    )


def _seamless_normals(vertices: Doubles, faces: NDArray[np.int32]) -> Doubles:
    """Return vertex normals that take vertices in one place for one: texture seams double them without an edge."""
    places, at = np.unique(vertices, axis=0, return_inverse=True)
    return vertex_normals(places, at.reshape(-1)[faces])[at.reshape(-1)]


def _own_colours(
    mesh: trimesh.Trimesh,
) -> tuple[NDArray[np.float32] | None, Doubles | None, NDArray[np.float32] | None]:
    visual = mesh.visual
    if isinstance(visual, trimesh.visual.ColorVisuals) and visual.kind == "vertex":
        return linear_from_srgb(np.asarray(visual.vertex_colors, np.uint8)[:, :3]), None, None
    uv = getattr(visual, "uv", None)
    material = getattr(visual, "material", None)
    if uv is None:
        return None, None, None
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    if image is None or image.width * image.height <= UNPAINTED_PX:
        return None, np.asarray(uv, np.float64), None
    return None, np.asarray(uv, np.float64), linear_from_srgb(np.asarray(image.convert("RGB")))


def load_texture(path: Path) -> NDArray[np.float32]:
    """Read an 8- or 16-bit picture as linear colours (row, col, 3); raises PsvideoError where it cannot be read."""
    picture = cv2.imread(str(path), cv2.IMREAD_UNCHANGED) if path.is_file() else None
    if picture is None or picture.dtype not in (np.uint8, np.uint16):
        raise PsvideoError(f"{path}: cannot be read as a texture; expected an 8- or 16-bit PNG, JPEG or TIFF picture.")
    if picture.ndim == 2:
        picture = np.repeat(picture[..., None], 3, axis=2)
    return linear_from_srgb(np.asarray(picture[..., 2::-1], dtype=picture.dtype))


def linear_from_srgb(codes: NDArray[Any]) -> NDArray[np.float32]:
    """Return the linear light, same shape, of sRGB codes that use the whole range of their integer type."""
    return np.asarray(CURVES["srgb"].decode(codes / np.iinfo(codes.dtype).max), np.float32)
