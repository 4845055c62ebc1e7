"""Plates of metal, as a matte surface with the same normals would show them."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import let_go, planes_for
from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Doubles, Floats, Mask, Samples
from psvideo.model.surface import Metal, Surface
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.metal.lobe_fit import FARTHEST_DEG, directions
from psvideo.solve.normals.noise_samples import rows_of
from psvideo.solve.normals.robust.reflectance import points_at
from psvideo.solve.normals.robust.subject_points import SubjectPoints
from psvideo.solve.normals.task import Usable

MOST_LEFT = 0.5
"""A pixel is metal where metal leaves at most this share of what a matte one leaves: a machine has other parts too."""
FARTHER = 1.3
"""The truth may be so many times as far as what is as likely as the best."""
LEAST_DOUBT_DEG = 2.0
"""Where likely lobes agree, normals are still so far off."""
USUAL, MOST_DEG, TINY_DEG = 0.8, 20.0, 1e-6
"""Where likely lobes happen to agree, normals are doubted by this much of what they differ by all over the subject,
root mean square: what lobes are not known to be is wrong everywhere. No pixel counts for more than MOST_DEG there."""
APART_DEG = 10.0
"""Between the normals from which each pixel's is looked for."""
SURELY_MATTE = 2.0
"""Where metal leaves more than this beside a matte surface, it is none."""
BAND, ROWS = 64, 4
"""Rows that are read at a time, and of these solved in one call."""


def matte_plates(
    plates: Sequence[Samples] | Sequence[Mixture], lit: Illumination, metal: Metal, solved: Surface, usable: Usable,
    *, seen: Mask | None, mask: Mask | None, spare: Path | None = None,
) -> list[Floats]:  # fmt: skip
    """Return plates (row, col) or (row, col, channel) in which metal is replaced by what a matte surface with its
    normals would show, and the rest is as it was. ``solved`` is what solving the plates as they are gave; large ones
    lie in files of the folder ``spare``.

    Clipped and dark samples stay as they are: they do not count."""
    count, pixels = solved.valid.shape[0], solved.valid.size
    made = [planes_for(plate.shape, np.float32, pixels=pixels, folder=spare) for plate in plates]
    starts, numbers = directions(APART_DEG, FARTHEST_DEG), np.array(metal.shown)
    dark = usable.dark_level * lit.noisiness

    def change(top: int, first: int, last: int) -> None:
        at = _asked(solved, mask, top + first, top + last)
        if not len(at[0]):
            return
        normals = solved.normals[at].astype(np.float64)
        points = points_at(made, lit, at, usable, normals, seen=seen, black_level=0.0, scale=1.0).in_order()
        most = np.stack([plate[at] if plate.ndim == 2 else plate[at].max(axis=1) for plate in made])
        factors = _factors(points, points.seen * (most > dark[:, None]), starts, numbers)
        for plate, factor in zip(made, factors.astype(np.float32), strict=True):
            plate[at] *= factor if plate.ndim == 2 else factor[:, None]

    for top in range(0, count, BAND):
        end = min(top + BAND, count)
        for number, new in enumerate(made):
            new[top:end] = rows_of(plates[number], np.arange(top, end))
        over_ranges(partial(change, top), end - top, each=ROWS)
        let_go(*(new[top:end] for new in made))
    return made


def _asked(solved: Surface, mask: Mask | None, first: int, last: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of those pixels of some rows that have a normal."""
    known = solved.normals[first:last].any(axis=-1)
    rows, cols = np.nonzero(known if mask is None else known & mask[first:last])
    return rows + first, cols


def _factors(points: SubjectPoints, bright: Doubles, starts: Doubles, numbers: Doubles) -> Doubles:
    """Return for every measurement (light, point) what a matte surface would show over what is there; 1 where it is not
    ``bright`` (0 or 1), and in pixels that are no metal."""
    from psvideo.solve.normals.metal.matte_kernel import fill_matte

    ways = points.towards, points.half
    normals, left = _as_metal(points, starts, numbers)
    shown = np.empty_like(points.measured)
    fill_matte(points.measured, bright, *ways, normals, numbers, shown)
    wanted = (left <= MOST_LEFT) & (bright > 0) & (points.measured > 0)
    return np.asarray(np.where(wanted, shown / np.maximum(points.measured, 1e-9), 1.0))


def _as_metal(points: SubjectPoints, starts: Doubles, numbers: Doubles) -> tuple[Doubles, Doubles]:
    """Return the normals of points as metal, and what metal leaves of them over what a matte surface does."""
    from psvideo.solve.normals.metal.lobe_kernel import fill_sums, fill_unlike
    from psvideo.solve.normals.metal.metal_normals import find_normals

    ways = points.measured, points.seen, points.towards, points.half
    normals, lambert = np.empty_like(points.normals), np.zeros_like(numbers)
    lambert[0] = 1.0
    matte, metal = np.empty(len(normals)), np.empty(len(normals))
    find_normals(*ways, starts, numbers, normals)
    for found, facing, one in ((matte, points.normals, lambert), (metal, normals, numbers)):
        shown = np.empty_like(points.measured)
        fill_sums(facing, points.towards, points.half, one, shown)
        fill_unlike(points.measured, points.seen, shown, found)
    return normals, metal / np.maximum(matte, 1e-9)


def metal_doubt_deg(
    plates: Sequence[Samples] | Sequence[Mixture], lit: Illumination, metal: Metal, solved: Surface, usable: Usable,
    *, seen: Mask | None, step: int,
) -> Floats:  # fmt: skip
    """Return by how many degrees normals may be off because what metal shows is not known better, in every ``step``-th
    row and column of the picture; 0 where there is no metal."""
    rows, cols = (np.arange(0, size, step) for size in solved.valid.shape)
    found = np.zeros((2, len(rows), len(cols)))
    starts = directions(APART_DEG, FARTHEST_DEG)
    for n, row in enumerate(rows):
        known = np.flatnonzero(solved.normals[row, cols].any(axis=-1))
        if len(known):
            at = (np.full(len(known), row), cols[known])
            normals = solved.normals[at].astype(np.float64)
            points = points_at(plates, lit, at, usable, normals, seen=seen, black_level=0.0, scale=1.0).in_order()
            found[:, n, known] = _rivals_and_either_deg(points, starts, metal)
    by_rivals, either = found
    is_metal = by_rivals > 0
    usual = np.sqrt(np.mean(np.minimum(by_rivals[is_metal], MOST_DEG) ** 2)) if is_metal.any() else 0.0
    own = np.where(is_metal, np.hypot(FARTHER * np.maximum(by_rivals, USUAL * usual), LEAST_DOUBT_DEG), either)
    return np.asarray(own, np.float32)


def _rivals_and_either_deg(points: SubjectPoints, starts: Doubles, metal: Metal) -> tuple[Doubles, Doubles]:
    """Return of points how far normals under rival lobes are from those under the best, times how likely these are, and
    above 0, where they are metal; and the angle to the matte normal where metal explains about as much."""
    own, left = _as_metal(points, starts, np.array(metal.shown))
    most = np.full(len(own), TINY_DEG)
    for rival in metal.rivals:
        most = np.maximum(most, rival.likely * _between_deg(own, _as_metal(points, starts, np.array(rival.shown))[0]))
    either = (left > MOST_LEFT) & (left < SURELY_MATTE)
    return np.where(left <= MOST_LEFT, most, 0.0), np.where(either, _between_deg(own, points.normals), 0.0)


def _between_deg(some: Doubles, others: Doubles) -> Doubles:
    """Return the angles between unit vectors (vector, 3)."""
    return np.asarray(np.degrees(np.arccos(np.clip((some * others).sum(axis=1), -1, 1))))
