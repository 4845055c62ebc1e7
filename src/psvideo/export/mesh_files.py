"""Meshes as files: one PLY per instant, in the camera's frame (y up, metres where the depth is) or in the world's.

Colours in a PLY are 8-bit sRGB, which is what viewers take them for: the linear albedo, clipped at 1, never stretched.
"""

import io
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.export.space import Space, placed, placed_points
from psvideo.formats.whole_files import whole_file
from psvideo.model.srgb import srgb_share
from psvideo.solve.depth.mesh import Mesh

KEPT = tuple(field.name for field in fields(Mesh))
"""What of a mesh is kept until the animation is put together: all of it."""


def mesh_name(clip: str, number: int, *, suffix: str = "ply") -> str:
    """Return a mesh's path below the output folder.

    >>> mesh_name("take3", 1001)
    'mesh/take3_mesh.1001.ply'
    """
    return f"mesh/{clip}_mesh.{number:04d}.{suffix}"


def animation_name(clip: str) -> str:
    """Return the path of the animated mesh below the output folder.

    >>> animation_name("take3")
    'mesh/take3_mesh.usdc'
    """
    return f"mesh/{clip}_mesh.usdc"


def in_space(mesh: Mesh, space: Space) -> Mesh:
    """Return a mesh placed in world space where that is asked for.

    y stays as it is for any ``space.y``: meshes are right-handed, and flipping one axis would mirror them.
    """
    kept = replace(space, y="up")
    points = placed_points(mesh.points, kept, np.ones(len(mesh.points), np.bool_))
    return replace(mesh, points=points.astype(np.float32), normals=placed(mesh.normals, kept).astype(np.float32))


def write_ply(path: Path, mesh: Mesh, space: Space) -> None:
    """Write one mesh as a binary PLY with normals and vertex colours, whole or not at all.

    One without points is a file, too, so that the sequence has no hole.
    """
    placed_mesh = in_space(mesh, space)
    import trimesh  # only where meshes are asked for: it takes 0.3 s and 40 MB

    some = len(mesh.points) > 0  # trimesh 4 cannot export colours or normals of no point
    shape = trimesh.Trimesh(
        vertices=placed_mesh.points,
        faces=placed_mesh.triangles,
        vertex_normals=placed_mesh.normals if some else None,
        vertex_colors=srgb_codes(placed_mesh.colours) if some else None,
        process=False,
    )
    with whole_file(path) as beside:
        beside.write_bytes(trimesh.exchange.ply.export_ply(shape, encoding="binary", vertex_normal=some))


def srgb_codes(linear: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return linear light as 8-bit sRGB codes with full opacity, (vertex, 4)."""
    codes = np.full((len(linear), 4), 255, np.uint8)
    codes[:, :3] = srgb_share(linear) * 255 + 0.5
    return codes


def write_part(path: Path, mesh: Mesh, space: Space) -> None:
    """Keep one instant's mesh for the animation that is put together when all are there."""
    stream = io.BytesIO()
    part = in_space(mesh, space)
    np.savez(stream, **{name: getattr(part, name) for name in KEPT})
    with whole_file(path) as beside:
        beside.write_bytes(stream.getbuffer())


def read_part(path: Path) -> Mesh:
    """Read what ``write_part`` kept."""
    with np.load(path) as held:
        return Mesh(**{name: held[name] for name in KEPT})
