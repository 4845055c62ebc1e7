"""What near lights do to errors from place to place, for a surface that faces the camera.

What is farther is dimmer and sees the lights closer together, so that noise turns its normals more; and where nobody
knows exactly how far the surface is, lights come from other directions than is thought. All of it is smooth in the
picture, and found at points of a coarse grid.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Floats
from psvideo.model.irradiance.ground import every_ray
from psvideo.model.irradiance.near_light import NearField, near_vectors
from psvideo.solve.normals.illumination import Illumination

POINTS = 160
"""Points along the picture's longer side."""
EVERYWHERE = np.zeros((0, 0), np.float32)
"""Distant lights are the same for all pixels."""
FACING = np.array([0.0, 0.0, 1.0])
LEAST = 1e-4
"""Of the middle's light: what gets less is in the dark."""
FARTHER = 1.05
"""By this depth is multiplied to see how normals turn with it."""
TINY = 1e-12


@dataclass(frozen=True, kw_only=True)
class NearSpread:
    """Over the picture, (row, col) of a grid, empty under distant lights.

    dim: the lights' mean irradiance over that in the surface's middle. wider: by how much greater the variance of a
    normal is for the lights' directions. doubt_deg: by how far normals may be off for the surface's distance; empty too
    where that is taken as given.
    """

    dim: Floats
    wider: Floats
    doubt_deg: Floats


def near_spread(lit: Illumination, shape: tuple[int, ...]) -> NearSpread:
    """Return what near lights do to errors, on a grid of this shape (row, col)."""
    if lit.near is None:
        return NearSpread(dim=EVERYWHERE, wider=EVERYWHERE, doubt_deg=EVERYWHERE)
    field, strength = lit.near, lit.intensities.mean(axis=1)
    step = max(-(-max(field.ground.depth_m.shape) // POINTS), 1)
    lamps = _lamps(field, strength, step)
    received = np.linalg.norm(lamps, axis=-1).mean(axis=-1)
    here = _variance(lamps / np.maximum(received, TINY)[..., None, None])
    middle = _variance(lit.directions * (strength / strength.mean())[:, None])
    dim = np.maximum(received / strength.mean(), LEAST)
    doubt_deg = EVERYWHERE
    if field.ground.unsure is not None:
        unsure = cv2.resize(field.ground.unsure, dim.shape[::-1], interpolation=cv2.INTER_AREA)
        doubt_deg = _resized(unsure * _turned_deg(lamps, _lamps(field, strength, step, farther=FARTHER)), shape)
    return NearSpread(dim=_resized(dim, shape), wider=_resized(here / middle, shape), doubt_deg=doubt_deg)


def _resized(plane: NDArray[np.floating], shape: tuple[int, ...]) -> Floats:
    return np.asarray(cv2.resize(plane.astype(np.float32), shape[1::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def _lamps(field: NearField, strength: NDArray[np.floating], step: int, *, farther: float = 1.0) -> Doubles:
    """Return at every ``step``-th row and column direction times irradiance of all lamps, (row, col, light, 3)."""
    ground = field.ground
    x, y = every_ray(ground.focal_px, ground.principal_px, *ground.depth_m.shape)
    depth_m = farther * ground.depth_m[::step, ::step].astype(np.float64)
    points_m = np.stack([x[:, ::step] * depth_m, y[::step] * depth_m, -depth_m], axis=-1)
    return np.stack([_lamp(field, k, points_m) * strength[k] for k in range(len(strength))], axis=-2)


def _lamp(field: NearField, k: int, points_m: Doubles) -> Doubles:
    """Return direction times irradiance of a lamp at the points, whose irradiance in the middle is 1."""
    if not field.is_near[k]:
        return np.broadcast_to(field.positions_m[k] / np.linalg.norm(field.positions_m[k]), points_m.shape)
    axis, mu = field.axes[k], float(field.anisotropy[k])
    return np.asarray(near_vectors(points_m, field.positions_m[k], axis=axis, anisotropy=mu) / field.middle_gain[k])


def _inverse(lamps: Doubles) -> Doubles:
    """Return the inverses of the normal equations of lamps (..., light, 3); lamps in one line count as a little off."""
    equations = np.swapaxes(lamps, -1, -2) @ lamps
    return np.asarray(np.linalg.inv(equations + TINY * np.eye(3)), np.float64)


def _variance(lamps: Doubles) -> NDArray[np.float64]:
    """Return what least squares makes across FACING of noise of 1 in every light, for lamps (..., light, 3)."""
    inverse = _inverse(lamps)
    return np.asarray(np.trace(inverse, axis1=-2, axis2=-1) - FACING @ inverse @ FACING, np.float64)


def _turned_deg(lamps: Doubles, moved: Doubles) -> NDArray[np.float64]:
    """Return by how many degrees a normal turns where depth is off by a factor e, from the lamps there and at FARTHER:
    what FACING shows under the first is solved by the second."""
    shown = lamps @ FACING
    solved = (_inverse(moved) @ (np.swapaxes(moved, -1, -2) @ shown[..., None]))[..., 0]
    away = np.linalg.norm(np.cross(solved, FACING), axis=-1)
    turned = np.degrees(np.arctan2(away, solved @ FACING)) / np.log(FARTHER)
    return np.asarray(turned, np.float64)
