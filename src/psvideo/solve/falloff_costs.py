"""The cost of each assumed distance: how badly it explains what near lights show at points of the picture."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Samples
from psvideo.model.channels import mean_of_channels
from psvideo.model.irradiance.ground import Ground, every_ray
from psvideo.model.irradiance.near_light import near_field
from psvideo.model.rig import Light
from psvideo.model.rows.clipping import LOSSY_MARGIN, SATURATED
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.plate_noise import LEAST

Plates = Sequence[Samples] | Sequence[Mixture]
LEAST_LIT = 4
"""Four lights leave one number over for the distance."""
OWN_SHARE = 0.005
"""What surfaces are off by from the model where nothing is wrong."""


def light_at(plates: Plates, step: int, seen: NDArray[np.bool_] | None) -> NDArray[np.float64]:
    """Return every ``step``-th row and column of all plates, their channels' mean, (row, col, light); -1 where any of
    these is clipped, or where it was not seen. ``seen``: (light, row) or (light, row, col)."""
    light = np.stack([_thin(plate, step) for plate in plates], axis=-1).astype(np.float64)
    if seen is not None:
        shown = seen[:, ::step, None] if seen.ndim == 2 else seen[:, ::step, ::step]
        light[~np.broadcast_to(np.moveaxis(shown, 0, -1), light.shape)] = -1
    return light


def around(light: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """Return means over squares of this many rows and columns around every ``count``-th, (row, col, light): the light
    of one distance adds up whatever the surface; -1 where less than half of it is known."""
    half, known = count // 2, light >= 0
    high, wide = (-(-size // count) for size in light.shape[:2])
    fill = [(half, high * count - light.shape[0]), (half, wide * count - light.shape[1]), (0, 0)]

    def sums(planes: NDArray[np.float64]) -> NDArray[np.float64]:
        whole = np.pad(planes, fill)[: high * count, : wide * count]
        total: NDArray[np.float64] = whole.reshape(high, count, wide, count, -1).sum(axis=(1, 3))
        return total

    number = sums(known.astype(np.float64))
    return np.where(number * 2 > sums(np.ones_like(light)), sums(np.where(known, light, 0)) / np.maximum(number, 1), -1)


def falloff_costs(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], depth_m: NDArray[np.float64],
    ratios: NDArray[np.float64], *, at: NDArray[np.bool_], step: int, noise: float, least_lit: int = LEAST_LIT,
    own: float = OWN_SHARE,
) -> NDArray[np.float64]:  # fmt: skip
    """Return for the points of ``at``, row by row, how badly ``depth_m`` times each ratio explains their light.

    ``light`` (row, col, light), ``depth_m`` and ``at`` (row, col) hold every ``step``-th row and column; noise is that
    of dark light. Shape (ratio, point): about 1 where a distance explains it, 0 where fewer lights than ``least_lit``,
    and not all, reach a point.
    """
    from psvideo.solve.sweeping_kernel import SweptLamps, sweep_points

    field = near_field(lights, ground)
    x, y = every_ray(ground.focal_px, ground.principal_px, *ground.depth_m.shape)
    rays = np.empty((*at.shape, 3))
    rays[..., 0], rays[..., 1], rays[..., 2] = x[:, ::step], y[::step], -1
    strengths = [float(np.mean(one.by_channel)) for one in lights]
    sent = np.stack([np.array(strengths), field.anisotropy, field.is_near.astype(np.float64)], axis=-1)
    lamps = SweptLamps(field.positions_m, field.axes, sent)
    costs = np.empty((len(ratios), int(at.sum())))
    fewest, noise = min(least_lit, len(lights)), max(noise, LEAST)
    sweep_points(light[at], rays[at], depth_m[at], ratios, lamps, fewest, noise, own, costs)
    return costs


def _thin(plate: Samples | Mixture, step: int) -> NDArray[np.float32]:
    """Return every nth row and column of a plate, (row, col), its channels' mean; -1 where any channel is clipped."""
    some = plate.thinned(step) if isinstance(plate, Mixture) else plate[::step, ::step]
    some = np.asarray(some, np.float32)
    by_channel = some[..., None] if some.ndim == 2 else some
    clipped = (by_channel >= SATURATED - LOSSY_MARGIN).any(axis=-1)
    return np.where(clipped, np.float32(-1), some if some.ndim == 2 else mean_of_channels(some))
