"""Sphere, box, plane, cylinder, and the lathe that turns outlines into vessels."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from psvideo.model.arrays import Doubles
from psvideo.synth.subject.shape import Shape, make_shape, merged

Paint = tuple[float, float, float]


def grid_faces(rows: int, cols: int, *, wrap: bool = False) -> NDArray[np.int32]:
    """Return the triangles of a grid of vertices (row-major); ``wrap`` joins the last column to the first.

    Faces look along (along the row) x (down the rows).
    """
    row = np.arange(rows - 1)[:, None]
    col = np.arange(cols if wrap else cols - 1)[None, :]
    right = (col + 1) % cols
    a, b = row * cols + col, row * cols + right
    c, d = (row + 1) * cols + col, (row + 1) * cols + right
    quads = np.stack(np.broadcast_arrays(a, b, d, c), axis=-1).reshape(-1, 4)
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)


def sphere(columns: int = 256) -> Shape:
    """A unit-diameter sphere whose normals are exact at the vertices."""
    rows = columns // 2 + 1
    down, around = np.meshgrid(np.linspace(0, np.pi, rows), 2 * np.pi * np.arange(columns) / columns, indexing="ij")
    normals = np.stack([np.sin(down) * np.sin(around), np.cos(down), np.sin(down) * np.cos(around)], -1).reshape(-1, 3)
    faces = grid_faces(rows, columns, wrap=True)[:, ::-1]
    return Shape(vertices=0.5 * normals, faces=faces, normals=normals)


def plane(cells: int = 1) -> Shape:
    """A unit square in x and y that faces +z."""
    steps = np.linspace(-0.5, 0.5, cells + 1)
    y, x = np.meshgrid(-steps, steps, indexing="ij")
    vertices = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    return make_shape(vertices, grid_faces(cells + 1, cells + 1)[:, ::-1])


def box() -> Shape:
    """A unit cube with hard edges."""
    face = plane()
    sides = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = np.roll([0.0, 0.0, sign], axis + 1)
            right = np.roll([sign, 0.0, 0.0], axis + 1)
            turn = np.stack([right, np.roll([0.0, 1.0, 0.0], axis + 1), normal], axis=1)
            vertices = (face.vertices + np.array([0.0, 0.0, 0.5])) @ turn.T
            sides.append(make_shape(vertices, face.faces))
    return merged(*sides)


def cylinder() -> Shape:
    """A cylinder of diameter and height 1 about the y axis, with hard edges."""
    return lathe([(0, 0.5), (0.5, 0.5), None, (0.5, 0.5), (0.5, -0.5), None, (0.5, -0.5), (0, -0.5)])


def lathe(outline: Sequence[tuple[float, float] | None], *, columns: int = 160, paints: Sequence[Paint] = ()) -> Shape:
    """Turn an outline of (radius, y) points about the y axis, from top to bottom; None marks a hard edge.

    ``paints`` gives the albedo of each piece between hard edges.
    """
    pieces: list[list[tuple[float, float]]] = [[]]
    for point in outline:
        if point is None:
            pieces.append([])
        else:
            pieces[-1].append(point)
    turned = [_turned(np.array(piece), columns) for piece in pieces]
    if not paints:
        return merged(*turned)
    return merged(*(painted(piece, paint) for piece, paint in zip(turned, paints, strict=True)))


def _turned(points: Doubles, columns: int) -> Shape:
    around = 2 * np.pi * np.arange(columns) / columns
    radius, y = points[:, :1], points[:, 1:]
    ring = np.stack(np.broadcast_arrays(radius * np.sin(around), y, radius * np.cos(around)), axis=-1).reshape(-1, 3)
    return make_shape(ring, grid_faces(len(points), columns, wrap=True)[:, ::-1])


def painted(shape: Shape, paint: Paint) -> Shape:
    """Return a shape with one albedo all over."""
    return dataclasses.replace(shape, colours=np.tile(np.asarray(paint, np.float32), (len(shape.vertices), 1)))


def tube(path: ArrayLike, radius: float, *, closed: bool = False, sides: int = 8) -> Shape:
    """Sweep a circle along a path of points (point, 3), open at its ends or closed to a ring."""
    points = np.asarray(path, np.float64)
    ahead = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    if not closed:
        ahead[0], ahead[-1] = points[1] - points[0], points[-1] - points[-2]
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    guide = np.where(np.abs(ahead[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[0.0, 1.0, 0.0]])
    side = np.cross(ahead, guide)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    other = np.cross(side, ahead)
    angle = 2 * np.pi * np.arange(sides) / sides
    outwards = np.cos(angle)[:, None] * side[:, None] + np.sin(angle)[:, None] * other[:, None]
    rings = points[:, None] + radius * outwards
    if closed:
        rings = np.concatenate([rings, rings[:1]])
    return make_shape(rings.reshape(-1, 3), grid_faces(len(rings), sides, wrap=True)[:, ::-1])
