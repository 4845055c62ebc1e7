"""How far away every part of the surface is, by how near lights fall off: the distance at which a normal explains them.

Near lights give the brightness of a point by its normal, its albedo and its distance. From five lights on more is
measured than normal and albedo, and a wrong distance leaves a residual. So distances from half to twice and a half the
rig's plane are tried on a rough grid, as space is swept in stereo (R. Collins, "A space-sweep approach to true
multi-image matching", CVPR 1996), and the best is taken: a wall behind the subject is found to be one. What stands on
the plane stays there.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.ground import Ground, every_ray, spread
from psvideo.model.near_light import near_field
from psvideo.model.rig import Light
from psvideo.plates.mixture import Mixture
from psvideo.solve.near_surface import NearSurface
from psvideo.solve.normals.plate_noise import LEAST, noise_of
from psvideo.solve.normals.task import Samples

LEAST_LIGHTS = 5
"""With four there is one number over for the distance, and nothing to see a highlight by."""
POINTS = 72
"""Points along the picture's longer side: distances are found for neighbourhoods."""
RATIOS = np.geomspace(0.5, 2.5, 25)
"""Of the plane's distance, 7 % apart; between them a parabola is laid."""
AROUND = 5
"""Costs are averaged over squares of so many points."""
OWN_SHARE = 0.005
"""What surfaces are off by from the model where nothing is wrong."""
STAY = 0.05
"""The cost of standing off the plane by a factor e, squared; little beside what tells one distance from another."""
LEAST_GAIN = 0.005
"""A distance is taken where its cost is less than the plane's by so much: about a tenth of a standard error squared."""
PLANE_HOLDS, LEAST_POINTS = 0.06, 25
"""A part of so many points that is found no farther than this share from the plane is on it: somebody measured it, and
normals say more of the relief than distances do."""
JUMP = 0.08
"""Between neighbours of a point, depth that differs by more than this share is another part's."""
SATURATED = 0.98

Plates = Sequence[Samples] | Sequence[Mixture]


def swept(
    near: NearSurface, lights: Sequence[Light], plates: Plates, *, seen: NDArray[np.bool_] | None = None
) -> NearSurface:
    """Return where the surface is by the lights' falloff; as it was with few lights, or where depth is known.

    seen: (light, row) or (light, row, col), what was seen of the plates. Plates are on a scale on which 1 is clipped.
    """
    if near.shaping.known_m is not None or sum(light.position_m is not None for light in lights) < LEAST_LIGHTS:
        return near
    found = _depth_m(near.ground, lights, plates, seen)
    if found is None:
        return near
    depth_m, apart = found
    shaping = replace(near.shaping, known_m=depth_m)
    return replace(near, ground=near.ground.with_depth(depth_m), shaping=shaping, apart=apart)


def _depth_m(
    ground: Ground, lights: Sequence[Light], plates: Plates, seen: NDArray[np.bool_] | None
) -> tuple[NDArray[np.float32], NDArray[np.bool_]] | None:
    """Return the depth (row, col), and where it jumps; None where all of the surface stands on the plane."""
    rows, cols = ground.depth_m.shape
    step = max(-(-max(rows, cols) // POINTS), 1)
    light = np.stack([_thin(plate, step) for plate in plates], axis=-1).astype(np.float64)
    light[light >= SATURATED] = -1
    if seen is not None:
        shown = seen[:, ::step, None] if seen.ndim == 2 else seen[:, ::step, ::step]
        light[~np.broadcast_to(np.moveaxis(shown, 0, -1), light.shape)] = -1
    plane_m = ground.depth_m[::step, ::step].astype(np.float64)
    costs, reached = _costs(ground, lights, light, plane_m, step, noise=noise_of(plates).dark)
    if not reached.any():
        return None
    found = np.where(reached, plane_m * np.exp(_best(costs)), 0).astype(np.float32)
    deep = cv2.medianBlur(spread(found), 3)
    logs, beside = np.log(deep), np.ones((3, 3), np.uint8)
    jumps = np.asarray(cv2.dilate(logs, beside) - cv2.erode(logs, beside)) > JUMP
    if _on_plane(deep / plane_m, reached, jumps):
        return None
    return _wide(deep, step, (rows, cols)), _wide(jumps.view(np.uint8), step, (rows, cols)) > 0


def _on_plane(ratio: NDArray[np.float64], reached: NDArray[np.bool_], jumps: NDArray[np.bool_]) -> bool:
    """Tell whether every part has its median distance on the plane, within the sweep's own error."""
    count, parts = cv2.connectedComponents((~jumps).astype(np.uint8), connectivity=4)
    known = [ratio[reached & (parts == number)] for number in range(1, count)]
    return all(abs(float(np.log(np.median(part)))) < PLANE_HOLDS for part in known if len(part) >= LEAST_POINTS)


def _wide(points: NDArray[Any], step: int, shape: tuple[int, int]) -> NDArray[Any]:
    """Return a plane of points for all pixels: a point stands for the ``step`` by ``step`` pixels around it."""
    size = (points.shape[1] * step, points.shape[0] * step)
    wide = cv2.resize(points, size, interpolation=cv2.INTER_NEAREST)
    half = step // 2
    padded = np.pad(wide, ((half, 0), (half, 0)), mode="edge")
    return np.ascontiguousarray(padded[: shape[0], : shape[1]])


def _thin(plate: Samples | Mixture, step: int) -> NDArray[np.float32]:
    """Return every so many rows and columns of a plate, (row, col), its channels' mean."""
    some = plate.thinned(step) if isinstance(plate, Mixture) else plate[::step, ::step]
    some = np.asarray(some, np.float32)
    return some if some.ndim == 2 else some.mean(axis=-1)


def _costs(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], plane_m: NDArray[np.float64], step: int, *,
    noise: float,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:  # fmt: skip
    """Return how badly every distance explains the points' light, (ratio, row, col), averaged over neighbours, and
    which points enough lights reach."""
    from psvideo.solve.sweeping_kernel import sweep_points

    field = near_field(lights, ground)
    x, y = every_ray(ground.focal_px, ground.principal_px, *ground.depth_m.shape)
    rays = np.empty((*plane_m.shape, 3))
    rays[..., 0], rays[..., 1], rays[..., 2] = x[:, ::step], y[::step], -1
    strengths = [float(np.mean(light.by_channel)) for light in lights]
    lamps = np.stack([np.array(strengths), field.anisotropy, field.is_near.astype(np.float64)], axis=-1)
    costs = np.empty((len(RATIOS), plane_m.size))
    dark = max(noise, LEAST)
    sweep_points(
        light.reshape(-1, len(lights)), rays.reshape(-1, 3), plane_m.ravel(), RATIOS, field.positions_m, field.axes,
        lamps, dark, OWN_SHARE, costs,
    )  # fmt: skip
    planes = costs.reshape(len(RATIOS), *plane_m.shape)
    reached = planes[0] > 0
    known = cv2.blur(reached.astype(np.float64), (AROUND, AROUND))
    each = [np.asarray(cv2.blur(plane, (AROUND, AROUND))) for plane in planes]
    return np.stack(each) / np.maximum(known, 1e-9), reached


def _best(costs: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the logarithm of the best ratio of every point, 0 where the plane is as good."""
    logs = np.log(RATIOS)
    apart = logs[1] - logs[0]
    held = costs + STAY * logs[:, None, None] ** 2 * apart
    place = np.clip(np.argmin(held, axis=0), 1, len(RATIOS) - 2)[None]
    before, here, after = (np.take_along_axis(held, place + shift, axis=0)[0] for shift in (-1, 0, 1))
    bent = np.maximum(before - 2 * here + after, 1e-12)
    found = logs[place[0]] + np.clip(0.5 * (before - after) / bent, -0.5, 0.5) * apart
    plane = held[int(np.argmin(np.abs(logs)))]
    return np.asarray(np.where(plane - here > LEAST_GAIN, found, 0))
