"""Points of a subject from which it is found how the subject reflects light beyond n . l, the same for all of it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Mask, Samples
from psvideo.model.irradiance.near_light import near_vectors
from psvideo.model.surface import Reflectance, Surface
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates
from psvideo.solve.normals.noise_samples import rows_of
from psvideo.solve.normals.robust.reflectance_fit import fitted
from psvideo.solve.normals.robust.subject_points import LEAST_POINTS, SubjectPoints, joined
from psvideo.solve.normals.robust.sure_of_motion import sure_of_motion
from psvideo.solve.normals.task import Usable

LIGHTS_FOR_REFLECTANCE = 5
ROWS, POINTS, FEWEST, MEASUREMENTS = 24, 400, 200, 4800
"""The model is fitted to this many points of this many rows, to fewer under many lights."""


def reflectance_of(looks: Sequence[SubjectPoints]) -> Reflectance | None:
    """Return what a subject reflects beyond n . l, from one look at it or several; None where that explains little of
    what is left over."""
    return fitted(joined(looks)) if looks else None


def points_of(given: LitPlates, found: Surface, usable: Usable, *, step: int) -> SubjectPoints | None:
    """Return points of a subject solved in every ``step``-th row; None where they or the lights are too few. Arguments
    are those of ``huber1981.solve``; what is ``unsure`` of the plates is passed over."""
    plates, lit, unsure = given.plates, given.lit, given.unsure
    if len(plates) < LIGHTS_FOR_REFLECTANCE:
        return None
    solved = np.arange(0, found.valid.shape[0], step)
    solved = solved[found.valid[solved].any(axis=1)]
    rows = solved[np.unique(np.linspace(0, len(solved) - 1, ROWS).astype(np.intp))] if len(solved) else solved
    known = found.valid[rows] if unsure is None else found.valid[rows] & sure_of_motion(unsure, found, rows, lit)
    where, cols = np.nonzero(known)
    if len(where) < LEAST_POINTS:
        return None
    few = max(min(POINTS, MEASUREMENTS // len(plates)), FEWEST)
    chosen = np.linspace(0, len(where) - 1, min(few, len(where))).astype(np.intp)
    at = (rows[where[chosen]], cols[chosen])
    normals = found.normals[at].astype(np.float64)
    return points_at(
        plates, lit, at, usable, normals, seen=given.seen, black_level=given.black_level, scale=given.scale
    )


def points_at(
    plates: Sequence[Samples] | Sequence[Mixture], lit: Illumination, at: tuple[NDArray[np.intp], NDArray[np.intp]],
    usable: Usable, normals: Doubles, *, seen: Mask | None, black_level: float, scale: float,
) -> SubjectPoints:  # fmt: skip
    """Return what was measured at some rows and columns of the picture, where these are the normals (point, 3); few
    rows are read once each."""
    rows, where = np.unique(at[0], return_inverse=True)
    samples = np.stack([rows_of(plate, rows)[where, at[1]] for plate in plates]).astype(np.float64)
    here = np.ones(samples.shape[:2], bool) if seen is None else _seen(seen, at)
    to_camera = lit.view.towards_camera(at, *plates[0].shape[:2])
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    return _points((samples - black_level) * scale, lit, at, here, usable, unit, to_camera)


def _seen(seen: Mask, at: tuple[NDArray[np.intp], NDArray[np.intp]]) -> Mask:
    return np.asarray(seen[:, at[0]] if seen.ndim == 2 else seen[:, at[0], at[1]])


def _points(
    samples: Doubles, lit: Illumination, at: tuple[NDArray[np.intp], NDArray[np.intp]], seen: Mask, usable: Usable,
    normals: Doubles, to_camera: Doubles,
) -> SubjectPoints:  # fmt: skip
    samples = samples.reshape(*samples.shape[:2], -1)
    sent = sent_to(lit, at)
    size = np.linalg.norm(sent, axis=-1)
    here = seen & (samples.max(axis=-1) < usable.saturation)
    each = samples / (size[..., None] * lit.intensities[:, None, : samples.shape[-1]])
    colour = (np.maximum(each, 0) * here[..., None]).sum(axis=0) * lit.shares[: samples.shape[-1]]
    measured = (each * colour).sum(axis=-1) / np.maximum(colour.sum(axis=-1), 1e-9)
    mean = (np.maximum(measured, 0) * here).sum(axis=0) / np.maximum(here.sum(axis=0), 1)
    dark = usable.dark_level * (lit.noisiness / lit.intensities.mean(axis=1))[:, None] / size
    least = np.maximum(dark, usable.shadow_ratio * mean)
    towards = sent / size[..., None]
    half = towards + to_camera
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    return SubjectPoints(
        measured=measured,
        counts=(here & (measured > least)).astype(float),
        seen=here.astype(float),
        towards=towards,
        half=half,
        to_camera=to_camera,
        normals=normals,
    )


def sent_to(lit: Illumination, at: tuple[NDArray[np.intp], NDArray[np.intp]]) -> Doubles:
    """Return what lights of the same intensities send to points at rows and columns of the picture: direction times
    share, (light, point, 3)."""
    field = lit.near
    if field is None:
        return np.repeat(lit.directions[:, None], len(at[0]), axis=1)
    ground = field.ground
    depth = ground.depth_m[at].astype(np.float64)
    x = (at[1] - ground.principal_px[0]) / ground.focal_px[0] * depth
    y = -(at[0] - ground.principal_px[1]) / ground.focal_px[1] * depth
    where = np.stack([x, y, -depth], axis=-1)
    sent = [
        near_vectors(where, place, axis=axis, anisotropy=float(mu)) / gain if near else np.tile(place, (len(where), 1))
        for place, axis, mu, gain, near in zip(
            field.positions_m, field.axes, field.anisotropy, field.middle_gain, field.is_near, strict=True
        )
    ]
    return np.stack(sent)
