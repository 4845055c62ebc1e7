"""Albedo over a surface: procedural patterns in the object's own space, vertex colours, and textures."""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Floats
from psvideo.synth.scene_tables import AlbedoTable, Colour

Keys = NDArray[np.uint64]

PLAIN = 0.7
"""The albedo of a mesh that is asked for colours of its own and has none."""
KEYS = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
"""What a step along each axis adds to the key of a lattice node, modulo 2^64."""


def colour(value: Colour) -> Floats:
    """Return a scene file's colour, one number or three, as (3,)."""
    return np.broadcast_to(np.asarray(value, np.float32), (3,))


def pattern_albedo(table: AlbedoTable, points_m: Doubles) -> Floats:
    """Return the albedo at points of the object's own space, shape (point, 3)."""
    share = _share(table, points_m).astype(np.float32)[:, None]
    return colour(table.colour) + share * (colour(table.second) - colour(table.colour))


def _share(table: AlbedoTable, points_m: Doubles) -> Doubles:
    """Return how much of the second colour each point has, 0 to 1."""
    along = points_m @ (np.asarray(table.axis, np.float64) / (np.linalg.norm(table.axis) or 1.0))
    cells = points_m / table.size_m
    if table.pattern == "noise":
        return np.clip(0.5 + 0.9 * layered_noise(cells), 0.0, 1.0)
    if table.pattern == "marble":
        return np.asarray(np.clip(1.0 - 6.0 * np.abs(layered_noise(cells)), 0.0, 1.0) ** 3)
    if table.pattern == "stripes":
        return (np.floor(along / table.size_m) % 2).astype(np.float64)
    if table.pattern == "checker":
        return np.asarray(np.floor(cells + 1e-9).sum(axis=1) % 2)
    if table.pattern == "bands":
        inside = [(along >= low) & (along < high) for low, high in table.bands_m]
        return np.any(inside, axis=0).astype(np.float64) if inside else np.zeros(len(points_m))
    return np.zeros(len(points_m))


def layered_noise(cells: Doubles, octaves: int = 4) -> Doubles:
    """Return fractal value noise (point,) at points (point, 3) in units of its largest cells, about -1 to 1.

    It is the same on every machine.
    """
    total = np.zeros(len(cells))
    for octave in range(octaves):
        total += 0.5**octave * _value_noise(cells * 2.0**octave + 17.3 * octave)
    return total


def _value_noise(points: Doubles) -> Doubles:
    """Return smooth noise between random values at the integer lattice, -1 to 1."""
    along = np.ascontiguousarray(points.T)  # axis by axis: numpy is slow along a short last axis
    base = np.floor(along)
    part = along - base
    part = part * part * (3.0 - 2.0 * part)
    key = base.astype(np.int64).astype(np.uint64) * KEYS[:, None]
    sides = [((1.0 - here, first), (here, first + step)) for here, first, step in zip(part, key, KEYS, strict=True)]
    total = np.zeros(len(points))
    for (x, at_x), (y, at_y), (z, at_z) in product(*sides):
        total += x * y * z * _lattice(at_x + at_y + at_z)
    return total


def _lattice(mixed: Keys) -> Doubles:
    """Return a fixed random value for the key of each lattice node, -1 to 1 (the mixing steps of splitmix64)."""
    mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return np.asarray((mixed >> np.uint64(11)).astype(np.float64) * (2.0 / 2**53) - 1.0)


def sample_texture(texture: Floats, uv: Doubles) -> Floats:
    """Return the texture's colours at (u, v), bilinear and repeating; v runs upwards."""
    rows, cols = texture.shape[:2]
    x = uv[:, 0] * cols - 0.5
    y = (1.0 - uv[:, 1]) * rows - 0.5
    col, row = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    right, down = (x - col).astype(np.float32)[:, None], (y - row).astype(np.float32)[:, None]
    left_col, right_col, top, bottom = col % cols, (col + 1) % cols, row % rows, (row + 1) % rows
    upper = texture[top, left_col] * (1 - right) + texture[top, right_col] * right
    lower = texture[bottom, left_col] * (1 - right) + texture[bottom, right_col] * right
    return np.asarray(upper * (1 - down) + lower * down, np.float32)
