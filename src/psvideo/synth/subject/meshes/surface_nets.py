"""A mesh from an implicit surface: where a function of space is zero (naive surface nets, Gibson 1998).

Every grid cell that the surface crosses gets one vertex, every grid edge that it crosses one quad. The function is
asked coarsely first, and finely only near the surface.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles

Field = Callable[[Doubles], Doubles]
"""A signed distance, negative inside: points (point, 3) to (point,)."""

COARSE = 4
"""Fine cells along a coarse cell's edge."""
POINTS = 1 << 15
"""This many points are asked for at a time: what a field of many parts holds of them stays in the processor's cache."""


def extract_surface(field: Field, low: Doubles, high: Doubles, cell_m: float) -> tuple[Doubles, NDArray[np.int32]]:
    """Return vertices (vertex, 3) and triangles (face, 3) of the surface inside a box, at cells of ``cell_m``.

    The surface must stay inside the box. Features thinner than a coarse cell are found only where the field's values
    are true distances.
    """
    counts = np.maximum(np.ceil((high - low) / (cell_m * COARSE)).astype(int), 2)
    values = _sampled(partial(_by_parts, field), low, counts, cell_m)
    inside = values < 0
    cells, vertices = _cell_vertices(values, inside)
    faces = _faces(inside, cells)
    points = low + vertices * cell_m
    return _pulled(partial(_by_parts, field), points, cell_m), faces


def _by_parts(field: Field, points: Doubles) -> Doubles:
    """Return the field at points, asked for POINTS at a time."""
    return np.concatenate([field(points[first : first + POINTS]) for first in range(0, len(points), POINTS)])


def _sampled(field: Field, low: Doubles, counts: NDArray[np.integer], cell_m: float) -> NDArray[np.float32]:
    """Return the field at the fine grid's nodes; far from the surface, the coarse values stand for it."""
    step = COARSE * cell_m
    coarse_nodes = np.stack(np.meshgrid(*(np.arange(n + 1) for n in counts), indexing="ij"), axis=-1)
    coarse = field(low + coarse_nodes.reshape(-1, 3) * step).reshape(counts + 1)
    fine = np.empty(counts * COARSE + 1, np.float32)
    index = [np.minimum((np.arange(n * COARSE + 1) + COARSE // 2) // COARSE, n) for n in counts]
    fine[...] = coarse[np.ix_(*index)]
    near = np.argwhere(np.abs(fine) < 1.25 * step)
    fine[tuple(near.T)] = field(low + near * cell_m)
    return fine


def _cell_vertices(values: NDArray[np.float32], inside: NDArray[np.bool_]) -> tuple[NDArray[np.intp], Doubles]:
    """Return each crossed cell's vertex number (cell grid, -1 = none) and the vertices in grid units."""
    shape = np.array(values.shape) - 1
    count = np.zeros(shape, np.int8)
    for corner in np.ndindex(2, 2, 2):
        count += inside[_window(corner, shape)]
    cell = np.argwhere((count > 0) & (count < 8))
    number = np.full(shape, -1, np.intp)
    number[tuple(cell.T)] = np.arange(len(cell))
    total, hits = np.zeros((len(cell), 3)), np.zeros(len(cell))
    for axis in range(3):
        for first in np.ndindex(2, 2):
            start = np.insert(np.array(first), axis, 0)
            a = values[tuple((cell + start).T)].astype(np.float64)
            b = values[tuple((cell + start + np.eye(3, dtype=int)[axis]).T)].astype(np.float64)
            crossed = (a < 0) != (b < 0)
            place = np.tile(start.astype(float), (len(cell), 1))
            place[:, axis] = np.divide(a, a - b, out=np.zeros_like(a), where=crossed)
            total += np.where(crossed[:, None], place, 0.0)
            hits += crossed
    return number, cell + total / hits[:, None]


def _window(corner: tuple[int, ...], shape: NDArray[np.integer]) -> tuple[slice, ...]:
    return tuple(slice(first, first + size) for first, size in zip(corner, shape, strict=True))


def _faces(inside: NDArray[np.bool_], number: NDArray[np.intp]) -> NDArray[np.int32]:
    """Return two triangles for every grid edge with one end inside, facing outwards."""
    triangles = []
    for axis in range(3):
        side, other = (axis + 1) % 3, (axis + 2) % 3
        here = np.moveaxis(inside, axis, 0)
        edge = np.argwhere(np.moveaxis(here[:-1] != here[1:], 0, axis))
        edge = edge[(edge[:, side] > 0) & (edge[:, other] > 0)]
        edge = edge[(edge[:, side] < number.shape[side]) & (edge[:, other] < number.shape[other])]
        a, b = np.eye(3, dtype=int)[side], np.eye(3, dtype=int)[other]
        quad = np.stack([number[tuple((edge - shift).T)] for shift in (a + b, b, 0 * a, a)], axis=1)
        outward = inside[tuple(edge.T)]
        quad = np.where(outward[:, None], quad, quad[:, ::-1])
        triangles += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
    return np.concatenate(triangles).astype(np.int32)


def _pulled(field: Field, points: Doubles, cell_m: float) -> Doubles:
    """Move points onto the surface along the field's gradient, at most half a cell."""
    reach = 0.25 * cell_m
    value = field(points)
    slope = np.stack([(field(points + step) - value) / reach for step in reach * np.eye(3)], axis=1)
    steepness = np.maximum(np.einsum("ij,ij->i", slope, slope), 0.05)
    move = np.clip(value / steepness, -0.5 * cell_m, 0.5 * cell_m)
    return np.asarray(points - move[:, None] * slope)
