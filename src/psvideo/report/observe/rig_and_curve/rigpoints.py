"""Points of the picture at which the rig is held against the plates, for distant and for near lights."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.irradiance.light_field import Points, light_vectors
from psvideo.model.plan import Plan, PlannedFlash, reference_duration_s
from psvideo.model.rig import Rig
from psvideo.plates.sequence import Round
from psvideo.report.observe.rig_and_curve.rigfit import RigFit, rig_fit

ACROSS = 72
CHANNEL = 1
"""Colour pictures are judged by their green."""


class PointLight(NamedTuple):
    """The ``light`` of a round at points under each light's full flash, (point, light), 0 where a plate is clipped or
    was not seen, and the light at which its plates are clipped, ``white`` (light,)."""

    light: Doubles
    white: Doubles


@dataclass(frozen=True, kw_only=True)
class RigPoints:
    """Pixels (point,) as ``rows`` and ``cols``, and what the rig sends there under each light's full flash, ``vectors``
    (point or 1, light, 3). ``strengths_all_one``: the rig gives all lights the strength 1."""

    rows: NDArray[np.intp]
    cols: NDArray[np.intp]
    vectors: Doubles
    strengths_all_one: bool = False

    @property
    def near(self) -> bool:
        """Whether lights are so near that the rig sends other light to every point."""
        return len(self.vectors) > 1

    def light(self, one: Round) -> PointLight:
        """Return the light of a round at the points."""
        columns = []
        for plate in one.plates:
            needed, place = np.unique(self.rows, return_inverse=True)
            image = plate.picture.rows(needed)
            image = image if image.ndim == 2 else image[..., CHANNEL]
            value = image[place, self.cols].astype(np.float64)
            known = plate.pixels_seen[self.rows, self.cols] & (value < plate.saturation)
            columns.append(np.where(known, value, 0.0))
        return PointLight(np.stack(columns, axis=1), np.array([plate.saturation for plate in one.plates]))

    def fit(self, seen: Sequence[PointLight], firing: NDArray[np.bool_]) -> RigFit | None:
        """Judge the rig by the light of several rounds and the lights that fire, (light,)."""
        if not seen:
            return None
        vectors = self.vectors[:, firing]
        vectors = vectors if len(vectors) == 1 else np.concatenate([vectors] * len(seen))
        places = np.stack([self.cols, -self.rows], axis=1) / max(int(self.cols.max()), 1)
        light, white = (
            np.concatenate(parts)[:, firing]
            for parts in ([one.light for one in seen], [np.broadcast_to(one.white, one.light.shape) for one in seen])
        )
        return rig_fit(light, vectors, np.concatenate([places] * len(seen)), white=white)


def rig_points(plan: Plan, rig: Rig, *, height_px: int, width_px: int, channels: int) -> RigPoints:
    """Return a grid of points over the picture, and the rig's light there."""
    step = max(min(width_px // ACROSS, height_px), 1)
    rows, cols = (grid.ravel() for grid in np.mgrid[step // 2 : height_px : step, step // 2 : width_px : step])
    points = Points(
        down=(rows + 0.5) / height_px,
        across=(cols + 0.5) / width_px,
        channel=np.full(len(rows), min(CHANNEL, channels - 1), np.intp),
        channels=channels,
    )
    alone = tuple(
        PlannedFlash(lights={light: 1.0}, duration_s=reference_duration_s(plan, light)) for light in plan.lights
    )
    vectors = light_vectors(replace(plan, flashes=alone), rig, points)
    lights = rig.select(plan.lights)
    near = any(light.position_m is not None for light in lights)
    all_one = all(strength == 1.0 for light in lights for strength in light.intensity)
    return RigPoints(rows=rows, cols=cols, vectors=vectors if near else vectors[:1], strengths_all_one=all_one)
