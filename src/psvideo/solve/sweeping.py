"""How far away every part of the surface is, by how near lights fall off: the distance at which a normal explains them.

Near lights give the brightness of a point by its normal, its albedo and its distance. From five lights on more is
measured than normal and albedo, and a wrong distance leaves a residual. So distances from half to twice and a half the
rig's plane are tried on a rough grid, as space is swept in stereo (R. Collins, "A space-sweep approach to true
multi-image matching", CVPR 1996), and the best is taken: a wall behind the subject is found to be one. What stands on
the plane stays there. Four lights only say where another distance would explain them as well or better.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.irradiance.ground import Ground, spread
from psvideo.model.rig import Light
from psvideo.model.surface import Distances
from psvideo.solve.falloff_costs import Plates, around, falloff_costs, light_at
from psvideo.solve.near_surface import NearSurface
from psvideo.solve.normals.plate_noise import noise_of
from psvideo.solve.pixels_of_points import for_pixels
from psvideo.solve.swept_outlines import FINE_POINTS, outlined, sides_of

LIGHTS_FOR_SWEEPING, LIGHTS_FOR_DOUBT = 5, 4
"""With four there is one number over for the distance, and nothing to see a highlight by: a rig that is off by 2 % puts
a part of the subject elsewhere. They say how unsure the plane's distance is, and no other one."""
POINTS = 72
"""Points along the picture's longer side: distances are found for neighbourhoods."""
RATIOS = np.geomspace(0.5, 2.5, 25)
"""Of the plane's distance, 7 % apart; between them a parabola is laid."""
AROUND = 5
"""Costs are averaged over squares of this many points."""
EDGE = 4.0
"""Where a shadow ends no distance explains the light of a point: its best cost, squared, counts so much against it."""
STAY = 0.05
"""The cost of standing off the plane by a factor e, squared; little beside what tells one distance from another."""
LEAST_GAIN = 0.005
"""A distance is taken where its cost is this much below the plane's: about a tenth of a standard error squared."""
PLANE_HOLDS, LEAST_POINTS = 0.06, 25
"""A part of at least this many points is on the plane where it is found no farther from it than this share: the plane
was measured, and normals say more of the relief than distances do."""
FOUND, RELIEF = 0.8, 0.1
"""The prior on distances: this share of the picture lies within about this share of distances that were found, the rest
anywhere."""
RIGHT = 0.5
"""The best distance of the usual point costs so much, where lamps stand and shine as the rig says. What is left beyond
that is the rig's own error, alike in all points: odds count in units of it."""
PRIOR = 0.5
"""The best distance is taken with so much of that prior's logarithm, in which the plane is as likely as any: several
explain a point that four lights reach, or that lies at an edge, nearly alike. With all of it, what is dim is put where
the most of the picture is."""
SURE = 0.01
"""Better than to this share no distance is known."""
JUMP = 0.08
"""Between neighbours of a point, depth that differs by more than this share is another part's."""


def swept(
    near: NearSurface, lights: Sequence[Light], plates: Plates, *, seen: NDArray[np.bool_] | None = None
) -> NearSurface:
    """Return where the surface is by the lights' falloff; as it was where depth is known, and with few lights, of which
    four say how unsure it is.

    seen: (light, row) or (light, row, col), what was seen of the plates. Plates are on a scale on which 1 is clipped.
    """
    if near.shaping.known_m is not None or len(lights) < LIGHTS_FOR_DOUBT:
        return near
    few = sum(light.position_m is not None for light in lights) < LIGHTS_FOR_SWEEPING
    rows, cols = near.ground.depth_m.shape
    fine = max(-(-max(rows, cols) // FINE_POINTS), 1)
    each = max(-(-max(rows, cols) // (POINTS * fine)), 1)
    light, dark = light_at(plates, fine, seen), noise_of(plates).dark
    found = _distances(near.ground, lights, around(light, each), each * fine, noise=dark / each, few=few)
    if found is None:
        return near
    if found.on_plane:
        return replace(near, ground=replace(near.ground, unsure=found.unsure))
    closer, farther = (for_pixels(side, each * fine, (rows, cols))[::fine, ::fine] for side in sides_of(found.depth_m))
    known = for_pixels(found.reached.view(np.uint8), each * fine, (rows, cols))[::fine, ::fine] > 0
    unsure = for_pixels(found.unsure, each * fine, (rows, cols))[::fine, ::fine]
    drawn, unsure, torn = outlined(
        near.ground, lights, light, (closer, farther), step=fine, noise=dark, known=known, unsure=unsure
    )
    ground = replace(near.ground, unsure=np.maximum(unsure, torn))
    depth_m = for_pixels(drawn, fine, (rows, cols))
    apart = for_pixels(_jumps(drawn).view(np.uint8), fine, (rows, cols)) > 0
    shaping = replace(near.shaping, known_m=depth_m)
    distances = Distances(
        depth_m=drawn, step=fine, costs=found.costs, weight=found.weight, plane_m=found.plane_m, logs=np.log(RATIOS),
        each=each,
    )  # fmt: skip
    return replace(
        near, ground=ground.with_depth(depth_m), shaping=shaping, apart=apart, torn=torn, distances=distances
    )


@dataclass(frozen=True, kw_only=True)
class SweptPoints:
    """What the sweep found at points (row, col): ``depth_m``, ``unsure``, how far off its logarithm may be, which
    of them enough lights ``reached``, and whether all of the surface stands on the plane; and of single points, how
    badly distances explain them, ``costs`` (ratio, row, col), what that counts for, and the plane's distance."""

    depth_m: NDArray[np.float32]
    unsure: NDArray[np.float32]
    reached: NDArray[np.bool_]
    on_plane: bool
    costs: NDArray[np.float32]
    weight: NDArray[np.float32]
    plane_m: NDArray[np.float32]


def _distances(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], step: int, *, noise: float, few: bool
) -> SweptPoints | None:
    """Return the distances of every ``step``-th row and column from their light (row, col, light), those of the plane
    under ``few`` lights; None where too few reach anything."""
    plane_m = ground.depth_m[::step, ::step].astype(np.float64)
    planes, sound = _costs(ground, lights, light, plane_m, step, noise=noise)
    costs, reached = _averaged(planes, sound), sound > 0
    if not reached.any():
        return None
    before = np.maximum(_beforehand(_best(costs)[reached]), _beforehand(np.zeros(1)))  # or on the plane, surely
    best = _best(costs - PRIOR * 2 / (len(lights) * AROUND) * before)
    found = np.where(reached, plane_m * np.exp(best), 0).astype(np.float32)
    deep = plane_m.astype(np.float32) if few else np.asarray(cv2.medianBlur(spread(found), 3), np.float32)
    on_plane = few or _on_plane(deep / plane_m, reached, _jumps(deep))
    unsure = _unsure(costs, len(lights), np.log(deep / plane_m), reached)
    beside = cv2.dilate(unsure * reached, np.ones((AROUND, AROUND), np.uint8))
    unsure = np.where(reached, unsure, np.maximum(unsure, beside))  # in shadow it may be any surface around
    return SweptPoints(
        depth_m=deep, unsure=unsure, reached=reached, on_plane=on_plane,
        costs=planes.astype(np.float32), weight=sound.astype(np.float32), plane_m=plane_m.astype(np.float32),
    )  # fmt: skip


def _beforehand(found: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the logarithm of how likely every ratio is before a point's own light is looked at, (ratio, 1, 1): a point
    stands where most of those were ``found`` that are reached, (point,), logarithms, or anywhere: a wall behind the
    subject may be as far as any part of it."""
    near = np.exp(-0.5 * ((found - np.log(RATIOS)[:, None]) / RELIEF) ** 2).mean(axis=1)
    return np.asarray(np.log(FOUND * near + (1 - FOUND) * RELIEF)[:, None, None])


def _unsure(
    costs: NDArray[np.float64], lights: int, taken: NDArray[np.float64], reached: NDArray[np.bool_]
) -> NDArray[np.float32]:
    """Return how far off the distance may be that was ``taken``, (row, col), logarithms both: the root mean square of
    how far others lie from it, by how much worse they explain the light.

    What distances leave of the light is the surface's own, and alike in neighbours: a square of points is one
    measurement per light and point of its width.
    """
    logs = np.log(RATIOS)[:, None, None]
    least = costs.min(axis=0)
    told = 0.5 * lights * AROUND / max(float(np.median(least[reached])) / RIGHT, 1.0)
    likely = np.exp(_beforehand(taken[reached]) - told * (costs - least))
    likely /= likely.sum(axis=0)
    return np.asarray(np.sqrt((likely * (logs - taken) ** 2).sum(axis=0) + SURE**2), np.float32)


def _jumps(depth_m: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return between which neighbours no surface runs."""
    logs, beside = np.log(depth_m), np.ones((3, 3), np.uint8)
    return np.asarray(cv2.dilate(logs, beside) - cv2.erode(logs, beside)) > JUMP


def _on_plane(ratio: NDArray[np.float64], reached: NDArray[np.bool_], jumps: NDArray[np.bool_]) -> bool:
    """Return whether every part has its median distance on the plane, within the sweep's own error."""
    count, parts = cv2.connectedComponents((~jumps).astype(np.uint8), connectivity=4)
    known = [ratio[reached & (parts == number)] for number in range(1, count)]
    return all(abs(float(np.log(np.median(part)))) < PLANE_HOLDS for part in known if len(part) >= LEAST_POINTS)


def _costs(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], plane_m: NDArray[np.float64], step: int, *,
    noise: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Return how badly every distance explains the points' light, (ratio, row, col), and how much that counts, 0 where
    too few lights reach a point."""
    every = np.ones(plane_m.shape, np.bool_)
    costs = falloff_costs(ground, lights, light, plane_m, RATIOS, at=every, step=step, noise=noise)
    planes = costs.reshape(len(RATIOS), *plane_m.shape)
    sound: NDArray[np.float64] = (planes[0] > 0) / (1 + EDGE * planes.min(axis=0) ** 2)
    return planes, sound


def _averaged(planes: NDArray[np.float64], sound: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return costs (ratio, row, col) averaged over neighbours, by how ``sound`` these are."""
    known = cv2.blur(sound, (AROUND, AROUND))
    each = [np.asarray(cv2.blur(plane * sound, (AROUND, AROUND))) for plane in planes]
    return np.stack(each) / np.maximum(known, 1e-9)


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
