"""How far away every part of the surface is, by how near lights fall off: the distance at which a normal explains them.

Near lights give the brightness of a point by its normal, its albedo and its distance. From five lights on more is
measured than normal and albedo, and a wrong distance leaves a residual. So distances from half to twice and a half the
rig's plane are tried on a rough grid, as space is swept in stereo (R. Collins, "A space-sweep approach to true
multi-image matching", CVPR 1996), and the best is taken: a wall behind the subject is found to be one. What stands on
the plane stays there. Four lights only say where another distance would explain them as well or better, and how
far away a whole part is whose relief was integrated.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.irradiance.ground import Ground, spread
from psvideo.model.rig import Light
from psvideo.model.surface import Distances
from psvideo.solve.falloff_costs import OWN_SHARE, Plates, around, falloff_costs, light_at
from psvideo.solve.near_surface import FEW, ROUGH_PX, NearSurface
from psvideo.solve.normals.plate_noise import noise_of
from psvideo.solve.pixels_of_points import for_pixels
from psvideo.solve.swept_odds import AROUND, RATIOS, averaged, best_of, unsure_of
from psvideo.solve.swept_outlines import FINE_POINTS, outlined, sides_of

LIGHTS_FOR_SWEEPING, LIGHTS_FOR_DOUBT = FEW + 1, FEW
"""With four there is one number over for the distance, and nothing to see a highlight by: a rig that is off by 2 % puts
a part of the subject elsewhere. They say how unsure a distance is, and put nothing but whole parts whose relief is
integrated."""
POINTS = 72
"""Points along the picture's longer side: distances are found for neighbourhoods."""
EDGE = 4.0
"""Where a shadow ends no distance explains the light of a point: its best cost, squared, counts so much against it."""
PLANE_HOLDS, LEAST_POINTS = 0.06, 25
"""A part of at least this many points is on the plane where it is found no farther from it than this share: the plane
was measured, and normals say more of the relief than distances do."""
HARDLY = 0.15
"""Where distances are more unsure than that, nothing says that all is on the plane."""
RIGHT, OWN_SHARES = 0.1, OWN_SHARE * 2 ** (np.arange(8) / 2)
"""Where lamps stand and shine as the rig says, the best distance of the usual point costs at most the first. Else light
is taken to be off by the least of the second, as shares of a point's brightest, that makes it so: lamps that are 2 %
and 3 mm off put a subject elsewhere, and were sure of it."""
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
    fine = max(-(-max(rows, cols) // (ROUGH_PX if few else FINE_POINTS)), 1)
    each = max(-(-max(rows, cols) // (POINTS * fine)), 1)
    light, dark = light_at(plates, fine, seen), noise_of(plates).dark
    found = _distances(near.ground, lights, around(light, each), each * fine, noise=dark / each, few=few)
    if found is None:
        return near
    if few:
        near = replace(near, ground=replace(near.ground, unsure=found.unsure))
        if found.own > OWN_SHARE:  # lamps that are off would put parts elsewhere
            return near
        rough_m = for_pixels(found.swept_m, each, light.shape[:2])
        return replace(near, by_part=found.distances(rough_m, step=1, each=each))
    if found.on_plane:
        return replace(near, ground=replace(near.ground, unsure=found.unsure))
    closer, farther = (for_pixels(side, each * fine, (rows, cols))[::fine, ::fine] for side in sides_of(found.depth_m))
    known = for_pixels(found.reached.view(np.uint8), each * fine, (rows, cols))[::fine, ::fine] > 0
    unsure = for_pixels(found.unsure, each * fine, (rows, cols))[::fine, ::fine]
    drawn, unsure, torn = outlined(
        near.ground,
        lights,
        light,
        (closer, farther),
        step=fine,
        noise=dark,
        known=known,
        unsure=unsure,
        own=found.own,
    )
    ground = replace(near.ground, unsure=np.maximum(unsure, torn))
    depth_m = for_pixels(drawn, fine, (rows, cols))
    apart = for_pixels(_jumps(drawn).view(np.uint8), fine, (rows, cols)) > 0
    shaping = replace(near.shaping, known_m=depth_m)
    return replace(
        near,
        ground=ground.with_depth(depth_m),
        shaping=shaping,
        apart=apart,
        torn=torn,
        distances=found.distances(drawn, step=fine, each=each),
    )


@dataclass(frozen=True, kw_only=True)
class SweptPoints:
    """What the sweep found at points (row, col): ``swept_m``, the distance of each, and ``depth_m``, which is that or
    the plane's under few lights, ``unsure``, how far off its logarithm may be, which of them enough lights ``reached``,
    whether all of the surface stands on the plane, and by which share of it light is off beside noise, ``own``; and of
    single points, how badly distances explain them, ``costs`` (ratio, row, col), what that counts for, and the plane's
    distance."""

    depth_m: NDArray[np.float32]
    unsure: NDArray[np.float32]
    reached: NDArray[np.bool_]
    on_plane: bool
    own: float
    costs: NDArray[np.float32]
    weight: NDArray[np.float32]
    plane_m: NDArray[np.float32]
    swept_m: NDArray[np.float32]

    def distances(self, depth_m: NDArray[np.float32], *, step: int, each: int) -> Distances:
        """Return what falloff says, with a ``depth_m`` of every ``step``-th row and column, of whose places every
        ``each``-th is one of these points."""
        return Distances(
            depth_m=depth_m,
            step=step,
            costs=self.costs,
            weight=self.weight,
            plane_m=self.plane_m,
            logs=np.log(RATIOS),
            each=each,
        )


def _distances(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], step: int, *, noise: float, few: bool
) -> SweptPoints | None:
    """Return the distances of every ``step``-th row and column from their light (row, col, light), those of the plane
    under ``few`` lights; None where too few reach anything."""
    plane_m = ground.depth_m[::step, ::step].astype(np.float64)
    planes, sound, own = _explained(ground, lights, light, plane_m, step, noise=noise)
    costs, reached = averaged(planes, sound), sound > 0
    if not reached.any():
        return None
    found = np.where(reached, plane_m * np.exp(best_of(costs, len(lights), reached)), 0).astype(np.float32)
    swept_m = np.asarray(cv2.medianBlur(spread(found), 3), np.float32)
    deep = plane_m.astype(np.float32) if few else swept_m
    unsure = unsure_of(costs, len(lights), np.log(deep / plane_m), reached, rig_is_off=own > OWN_SHARE)
    beside = cv2.dilate(unsure * reached, np.ones((AROUND, AROUND), np.uint8))
    unsure = np.where(reached, unsure, np.maximum(unsure, beside))  # in shadow it may be any surface around
    told = bool(np.median(unsure[reached]) < HARDLY)
    on_plane = told and _on_plane(deep / plane_m, reached, _jumps(deep))
    return SweptPoints(
        depth_m=deep,
        unsure=unsure,
        reached=reached,
        on_plane=on_plane,
        own=own,
        costs=planes.astype(np.float32),
        weight=sound.astype(np.float32),
        plane_m=plane_m.astype(np.float32),
        swept_m=swept_m,
    )


def _jumps(depth_m: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return between which neighbours no surface runs."""
    logs, beside = np.log(depth_m), np.ones((3, 3), np.uint8)
    return np.asarray(cv2.dilate(logs, beside) - cv2.erode(logs, beside)) > JUMP


def _on_plane(ratio: NDArray[np.float64], reached: NDArray[np.bool_], jumps: NDArray[np.bool_]) -> bool:
    """Return whether every part has its median distance on the plane, within the sweep's own error."""
    count, parts = cv2.connectedComponents((~jumps).astype(np.uint8), connectivity=4)
    known = [ratio[reached & (parts == number)] for number in range(1, count)]
    return all(abs(float(np.log(np.median(part)))) < PLANE_HOLDS for part in known if len(part) >= LEAST_POINTS)


def _explained(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], plane_m: NDArray[np.float64], step: int, *,
    noise: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:  # fmt: skip
    """Return how badly every distance explains the points' light, (ratio, row, col), how much that counts, and which
    share of it light is off by beside noise: the least by which what is bright is explained. Of few points most lie at
    edges, which no distance explains: these do not tell."""
    bright = OWN_SHARE * light.max(axis=-1) > noise
    for own in OWN_SHARES.tolist():
        planes, sound = _costs(ground, lights, light, plane_m, step, noise=noise, own=own)
        least = averaged(planes, sound).min(axis=0)[bright & (sound > 0)]
        if least.size < LEAST_POINTS or np.median(least) < RIGHT:
            break
    return planes, sound, own


def _costs(
    ground: Ground, lights: Sequence[Light], light: NDArray[np.float64], plane_m: NDArray[np.float64], step: int, *,
    noise: float, own: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Return how badly every distance explains the points' light, (ratio, row, col), and how much that counts, 0 where
    too few lights reach a point."""
    every = np.ones(plane_m.shape, np.bool_)
    costs = falloff_costs(ground, lights, light, plane_m, RATIOS, at=every, step=step, noise=noise, own=own)
    planes = costs.reshape(len(RATIOS), *plane_m.shape)
    sound: NDArray[np.float64] = (planes[0] > 0) / (1 + EDGE * planes.min(axis=0) ** 2)
    return planes, sound
