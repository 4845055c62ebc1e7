"""Points of a subject: what every light showed of them, and where lights, camera and normals point there."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from psvideo.model.arrays import Doubles, Mask

LEAST_POINTS = 50
"""To fewer no model is fitted."""


class ShownPoints(NamedTuple):
    """What compiled loops take of ``SubjectPoints``."""

    measured: Doubles
    counts: Doubles
    towards: Doubles
    half: Doubles
    to_camera: Doubles


@dataclass(frozen=True, kw_only=True)
class SubjectPoints:
    """Points of a subject under some lights.

    - ``measured`` (light, point): brightness in units of every light's strength; ``counts``: 1 where that counts, else
      0; ``seen``: 1 where it is seen and not clipped, dark or not
    - ``towards`` (light, point, 3): unit vectors to the lights; ``half``: those half way from there to the camera
    - ``to_camera`` (point, 3): unit vectors to the camera
    - ``normals`` (point, 3): as the points were solved without a model
    """

    measured: Doubles
    counts: Doubles
    seen: Doubles
    towards: Doubles
    half: Doubles
    to_camera: Doubles
    normals: Doubles

    @property
    def shown(self) -> ShownPoints:
        """What the lights show of them."""
        return ShownPoints(self.measured, self.counts, self.towards, self.half, self.to_camera)

    def only(self, known: Mask) -> "SubjectPoints":
        """Return some of the points."""
        return SubjectPoints(
            measured=self.measured[:, known],
            counts=self.counts[:, known],
            seen=self.seen[:, known],
            towards=self.towards[:, known],
            half=self.half[:, known],
            to_camera=self.to_camera[known],
            normals=self.normals[known],
        ).in_order()

    def in_order(self) -> "SubjectPoints":
        """Return the same points as compiled loops take them: numbers lie in the order of their axes."""
        return SubjectPoints(**{one.name: np.ascontiguousarray(getattr(self, one.name)) for one in fields(self)})


def joined(looks: Sequence[SubjectPoints]) -> SubjectPoints:
    """Return the points of one or several looks at a subject under the same lights."""
    if len(looks) == 1:
        return looks[0]
    return SubjectPoints(
        measured=np.concatenate([one.measured for one in looks], axis=1),
        counts=np.concatenate([one.counts for one in looks], axis=1),
        seen=np.concatenate([one.seen for one in looks], axis=1),
        towards=np.concatenate([one.towards for one in looks], axis=1),
        half=np.concatenate([one.half for one in looks], axis=1),
        to_camera=np.concatenate([one.to_camera for one in looks]),
        normals=np.concatenate([one.normals for one in looks]),
    )


def sizes_of(points: SubjectPoints) -> Doubles:
    """Return the albedo of every point with its normal, 0 where nothing was measured."""
    cosines = np.maximum((points.towards * points.normals).sum(axis=-1), 0.05)
    return _medians(points.measured / cosines, points.counts > 0)


def _medians(values: Doubles, counts: Mask) -> Doubles:
    """Return for every point the median over the lights of what counts, 0 where nothing does; (light, point) of both.

    All points at once: numpy takes longer to call than to sort so few lights.

    >>> _medians(np.array([[1.0, 5, 5], [9, 7, 5], [3, 6, 5]]), np.array([[1, 1, 0], [1, 1, 0], [1, 0, 0]], bool))
    array([3., 6., 0.])
    """
    order, number = np.sort(np.where(counts, values, np.inf), axis=0), counts.sum(axis=0)
    lower, upper = (
        np.take_along_axis(order, np.clip(place, 0, len(order) - 1)[None], axis=0)[0]
        for place in ((number - 1) // 2, number // 2)
    )
    return np.where(number > 0, (lower + upper) / 2, 0.0)
