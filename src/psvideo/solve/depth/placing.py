"""How far away each part of a surface is by near lights' falloff, held from instant to instant where nothing says that
it moved.

What was put within a hundredth or so of its distance in the clip's first instant stays there, since the falloff does
not know better; what came nearer or went away goes with it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles, Mask
from psvideo.model.surface import Distances
from psvideo.solve.depth.falloff_evidence import evidence_of
from psvideo.solve.depth.torn_surfaces import pure
from psvideo.solve.depth.view import Box, View
from psvideo.solve.pixels_of_points import for_pixels

GUESS = 0.3
"""What may be off by more than this share stays on the plane: a distance that is hardly known is no better than it."""
SAME_PLACE = 0.08
"""What is seen within this share of a distance is the surface that was there in the first instant."""
LEAST_COMMON_SHARE = 0.2
"""A part is held to the first instant's place when at least this share of it was seen then."""
STEADY, STEADIER = 0.01, 1 / 3
"""Differences between instants of less than this share, or than this part of what is unsure, are the sweep's own."""


@dataclass(frozen=True, kw_only=True)
class Placed:
    """Where a part of the surface was put: the median of its ``distance_m`` along the camera's axis, how ``unsure`` it
    is, as a share and a standard deviation, and its ``share`` of the picture."""

    distance_m: float
    unsure: float
    share: float

    @property
    def words(self) -> str:
        """The distance, and how sure it is."""
        about = max(round(100 * self.unsure), 1)
        return f"{self.distance_m:.3g} m away, " + (
            f"to about {about} %" if self.unsure < GUESS else "where the rig's plane is, for want of anything better"
        )


def placed_by(
    distances: Distances, height: Doubles, part: Callable[[Box], Mask], view: View, before_m: NDArray[np.float32] | None
) -> tuple[float, Placed]:
    """Return by how much a ``part`` of a ``height`` (row, col) is to be raised, and where it is then.

    before_m: (row, col), the first instant's depth, 0 where there is none.
    """
    focal = 1.0 if view.focal_px is None else view.focal_px[0]
    fine = slice(None, None, distances.step), slice(None, None, distances.step)
    mine, own = part(fine), height[fine] / focal
    each = slice(None, None, distances.each), slice(None, None, distances.each)
    plane = np.log(distances.plane_m)
    inside = mine[each]
    inside = inside if inside.any() else np.ones_like(inside)
    onto_plane = float(np.median((plane - own[each])[inside]))
    found = evidence_of(distances, own[each] + onto_plane, pure(mine, distances.each))
    shift = onto_plane + (found.shift if found.unsure < GUESS else 0.0)
    if before_m is not None and mine.any():
        shift = _held(shift, found.unsure, own[mine], before_m[fine][mine])
    middle = float(np.median(own[mine])) if mine.any() else 0.0
    placed = Placed(
        distance_m=float(np.exp(middle + shift)), unsure=found.unsure, share=float(np.count_nonzero(mine)) / mine.size
    )
    return shift * focal, placed


def _held(shift: float, unsure: float, own: Doubles, before_m: NDArray[np.float32]) -> float:
    """Return a part's shift, the first instant's as far as both agree within what is ``unsure``; in logarithms."""
    logs = np.log(np.maximum(before_m, 1e-9)) - own
    common = (before_m > 0) & (np.abs(logs - shift) < max(SAME_PLACE, unsure))
    if common.sum() < LEAST_COMMON_SHARE * common.size:
        return shift
    first = float(np.median(logs[common]))
    return shift + (first - shift) / (1 + ((first - shift) / max(STEADY, unsure * STEADIER)) ** 4)


def stays(distances: Distances, before_m: NDArray[np.float32]) -> Mask:
    """Return where the first instant's depth ``before_m`` (row, col) is that of the surface that is seen now."""
    here = for_pixels(distances.depth_m, distances.step, before_m.shape)
    return np.asarray((before_m > 0) & (np.abs(before_m / here - 1) < SAME_PLACE))
