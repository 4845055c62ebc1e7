"""From highlights on mirror spheres to where lights are, with standard errors.

One sphere gives a ray: from the place on the sphere where the highlight is, mirrored, towards the light. Distant lights
take the mean direction of all rays; near lights the point nearest to two or more rays that start far enough apart.
Errors are carried through by small differences of the outline's and the highlight's numbers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.calibrate.sphere.outline import Outline
from psvideo.model.arrays import Doubles

SURE_ERRORS = 4.0
"""Excess of the rays' scatter over their errors from which on a light counts as near."""

LEAST_LEVER = 0.01
"""Sideways distance between two rays' starts, as a share of the light's distance, below which none is triangulated."""


@dataclass(frozen=True, kw_only=True)
class Ray:
    """A mirrored ray: where it starts on the sphere, its unit direction to the light, and that one's standard error
    (root mean square angle). ``start`` is in metres where the sphere's radius is known, else in the view's units."""

    start: Doubles
    direction: Doubles
    error_deg: float


def mirrored_ray(outline: Outline, highlight: Doubles, error_px: float, *, radius_m: float | None = None) -> Ray | None:
    """Return the ray from a sphere to the light whose highlight (x, y) is given; None where that lies outside."""
    hit = outline.view.mirrored(outline.place, highlight)
    if hit is None:
        return None
    start, direction = hit
    unit = 1.0 if radius_m is None else radius_m / outline.view.sphere(outline.place)[1]
    numbers = np.concatenate([outline.place, highlight])
    covariance = np.zeros((7, 7))
    covariance[:5, :5] = outline.covariance
    covariance[5:, 5:] = np.eye(2) * error_px**2
    slopes = np.zeros((3, 7))
    for n, step in enumerate((0.05, 0.05, 0.05, 1e-4, 1e-4, 0.05, 0.05)):
        moved = numbers.copy()
        moved[n] += step
        other = outline.view.mirrored(moved[:5], moved[5:])
        if other is None:
            return None
        slopes[:, n] = (other[1] - direction) / step
    variance = float(np.trace(slopes @ covariance @ slopes.T))
    return Ray(start=start * unit, direction=direction, error_deg=float(np.degrees(np.sqrt(variance))))


def mean_direction(rays: Sequence[Ray]) -> tuple[Doubles, float, float]:
    """Return the mean direction (3,) of rays, its standard error in degrees, and their scatter over their own errors.

    Where rays scatter more than their errors say, the error grows by as much.
    """
    weights = np.array([1 / ray.error_deg**2 for ray in rays])
    directions = np.array([ray.direction for ray in rays])
    mean = weights @ directions
    mean /= np.linalg.norm(mean)
    away_deg = np.degrees(np.arccos(np.clip(directions @ mean, -1, 1)))
    excess = float(np.sqrt((weights * away_deg**2).sum() / max(len(rays) - 1, 1))) if len(rays) > 1 else 0.0
    return mean, float(1 / np.sqrt(weights.sum())) * max(excess, 1.0), excess


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """Where rays nearly meet: the point in metres, its covariance (3, 3), and the rays' misses over their errors."""

    position_m: Doubles
    covariance: Doubles
    excess: float

    @property
    def error_m(self) -> float:
        """Standard error of the position, root mean square length."""
        return float(np.sqrt(np.trace(self.covariance)))


def crossing(rays: Sequence[Ray]) -> Crossing | None:
    """Return the point nearest to two or more rays, each weighted by its error at that distance.

    None where the rays are parallel within reason or meet behind a sphere.
    """
    starts, directions = np.array([ray.start for ray in rays]), np.array([ray.direction for ray in rays])
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    distance = np.ones(len(rays))
    point, matrix = np.zeros(3), np.eye(3)
    for _ in range(20):
        # the error of a ray is the root mean square of two components
        spread = np.radians([ray.error_deg for ray in rays]) / np.sqrt(2) * distance
        matrices = across / spread[:, None, None] ** 2
        matrix = matrices.sum(axis=0)
        if np.linalg.cond(matrix) > 1e12:
            return None
        point = np.linalg.solve(matrix, np.einsum("nij,nj->i", matrices, starts))
        along = np.einsum("ni,ni->n", point - starts, directions)
        if (along <= 0).any():
            return None
        distance = along
    lever = np.linalg.norm(np.einsum("ij,nj->ni", across[0], starts - starts[0]), axis=1).max()
    if lever < LEAST_LEVER * distance.max():
        return None
    miss = np.einsum("nij,nj->ni", across, point - starts)
    chi = float(((miss**2).sum(axis=1) / spread**2).sum())
    excess = float(np.sqrt(chi / (2 * len(rays) - 3)))
    covariance: Doubles = (np.linalg.inv(matrix) * max(excess, 1.0) ** 2).astype(np.float64)
    return Crossing(position_m=point, covariance=covariance, excess=excess)
