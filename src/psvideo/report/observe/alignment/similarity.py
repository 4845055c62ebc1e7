"""What parts of pictures say of their places, put together: each picture's shift, turn and scale.

A tripod that is knocked, a lens that breathes as it focuses and a camera that rolls move parts of a picture by
different amounts, so that no shift is common to them. Where parts say different things even so, shape or shine
speaks and no motion: what they differ by gives the standard error, and parts that differ much count little (least
absolute distances, by weights that are found again in every pass).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.report.observe.alignment.part_places import PartPlaces

PASSES, LEAST_WEIGHED = 30, 0.3
"""How often weights are found again, and the distance, in standard deviations, below which all count the same."""
FEWER = 1.25
"""The standard error of a median over that of a mean."""
OF_MEDIAN = 1 / np.sqrt(2 * np.log(2))
"""The standard deviation of one coordinate over the median distance, of two that are alike."""
UNKNOWNS = 4


@dataclass(frozen=True, kw_only=True)
class Similarities:
    """Where pictures lie over the parts asked, from the mean of all.

    ``shift_px`` (light, 2), ``zoom`` and ``turn`` (light,), the latter in radians clockwise; ``off_px`` (light,) what
    all of that moves parts by, and ``uneven_px`` what turn and zoom do, as root mean squares over the parts, with
    their standard errors; ``explained`` is the share of what the rig leaves that it explains.
    """

    shift_px: Doubles
    zoom: Doubles
    turn: Doubles
    off_px: Doubles
    off_error_px: Doubles
    uneven_px: Doubles
    uneven_error_px: Doubles
    explained: float


def similarities(parts: Sequence[PartPlaces]) -> Similarities:
    """Return every picture's shift, turn and scale as parts say them."""
    middles = np.array([part.middle for part in parts])
    away = middles - middles.mean(axis=0)
    basis = np.zeros((len(parts), 2, UNKNOWNS))
    basis[:, 0, 0] = basis[:, 1, 1] = 1
    basis[:, :, 2] = away
    basis[:, :, 3] = np.stack([-away[:, 1], away[:, 0]], axis=1)
    places = np.array([part.found for part in parts])
    solved = [_solved(basis, places[:, light]) for light in range(places.shape[1])]
    found, spread = (np.array(each) for each in zip(*solved, strict=True))
    covariance = np.linalg.inv(np.einsum("pij,pik->jk", basis, basis))
    fitted = np.einsum("pij,lj->lpi", basis, found)
    off_px, uneven_px = (_root_mean_square(fitted), _root_mean_square(fitted - found[:, None, :2]))
    even, uneven = (
        np.sqrt(np.einsum("pij,jk,pik->", basis[..., some], covariance[some, some], basis[..., some]) / len(parts))
        for some in (slice(None), slice(2, None))
    )
    return Similarities(
        shift_px=found[:, :2],
        zoom=found[:, 2],
        turn=found[:, 3],
        off_px=off_px,
        off_error_px=even * spread,
        uneven_px=uneven_px,
        uneven_error_px=uneven * spread,
        explained=float(
            np.median([part.explained(one) for part, one in zip(parts, fitted.transpose(1, 0, 2), strict=True)])
        ),
    )


def _root_mean_square(moved: Doubles) -> Doubles:
    return np.asarray(np.sqrt((moved**2).sum(axis=2).mean(axis=1)))


def _solved(basis: Doubles, places: Doubles) -> tuple[Doubles, float]:
    """Return one picture's unknowns by its ``places`` (part, 2), and the standard error of a part's coordinate."""
    weights = np.ones(len(places))
    for _ in range(PASSES):
        square = np.einsum("pij,p,pik->jk", basis, weights, basis)
        found = np.linalg.solve(square, np.einsum("pij,p,pi->j", basis, weights, places))
        apart = np.linalg.norm(places - basis @ found, axis=1)
        spread = max(OF_MEDIAN * float(np.median(apart)), 1e-9)
        weights = 1 / np.maximum(apart / spread, LEAST_WEIGHED)
    free = 2 * len(places) / max(2 * len(places) - UNKNOWNS, 1)
    return found, FEWER * spread * float(np.sqrt(free))
