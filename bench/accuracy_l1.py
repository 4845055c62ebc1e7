"""The per-pixel L1 reference: least absolute residuals, by reweighting in float64 until nothing changes."""

import numpy as np

from bench.accuracy_measure import Case
from psvideo.solve.normals.robust.huber1981 import USABLE

ROUNDS = 200


def l1_normals(case: Case, pixels: np.ndarray) -> np.ndarray:
    """Return the unit normals of chosen pixels (flat indices) that minimise the sum of absolute residuals.

    Over the measurements that robust solving may use: neither saturated nor dark beside the pixel's mean.
    """
    measured, rows = measurements(case, pixels)
    usable = usable_of(case, pixels)
    g, weights = np.zeros((len(pixels), 3)), usable.astype(float)
    for _ in range(ROUNDS):
        equations = np.einsum("pl,li,lj->pij", weights, rows, rows)
        equations += (1e-12 + 1e-10 * np.trace(equations, axis1=1, axis2=2))[:, None, None] * np.eye(3)
        g = np.linalg.solve(equations, np.einsum("pl,li,pl->pi", weights, rows, measured)[..., None])[..., 0]
        weights = usable / np.maximum(np.abs(measured - g @ rows.T), 1e-7)
    return np.asarray(g / np.maximum(np.linalg.norm(g, axis=1, keepdims=True), 1e-12))


def measurements(case: Case, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return brightnesses (pixel, light), channels weighted by their own, and intensity * direction (light, 3)."""
    strength = case.lit.intensities.mean(axis=1)
    plates = np.array([plate.reshape(-1, case.lit.intensities.shape[1])[pixels] for plate in case.plates], np.float64)
    plates *= (strength[:, None] / case.lit.intensities)[:, None]
    weight = np.maximum(plates, 0).sum(axis=0)
    weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1e-12)
    return (plates * weight).sum(axis=2).T, case.lit.directions * strength[:, None]


def usable_of(case: Case, pixels: np.ndarray) -> np.ndarray:
    """Return which measurements (pixel, light) are neither saturated nor in shadow."""
    measured, _ = measurements(case, pixels)
    plates = np.array([plate.reshape(-1, case.lit.intensities.shape[1])[pixels] for plate in case.plates])
    seen = (plates < USABLE.saturation * (1 - 1e-5)).all(axis=2).T
    bright = measured / case.lit.intensities.mean(axis=1) * case.lit.intensities.mean()
    mean = (np.maximum(bright, 0) * seen).sum(axis=1, keepdims=True) / np.maximum(seen.sum(axis=1, keepdims=True), 1)
    return np.asarray(seen & (bright > np.maximum(USABLE.dark_level, USABLE.shadow_ratio * mean)))
