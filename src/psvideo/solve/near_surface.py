"""Normals under near lights where the surface is not known yet: solve, integrate the depth, solve again.

Near lights need the surface's depth, and depth comes from normals. The rig's [surface] plane is a first guess that is
off by the relief of the subject; from its normals depth is integrated, each part put onto the plane by its median, and
serves as the next guess. What no integration can find is how far away the whole subject is: a plane at a wrong distance
stays wrong. Depth that is known from elsewhere takes the plane's place, for each instant its own where there is more
than one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.clip import DepthMaps
from psvideo.model.irradiance.ground import Ground, ground_of
from psvideo.model.irradiance.near_light import is_near
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Distances, Surface
from psvideo.solve.depth import Shaping, View, depth_of, view_of
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.swept_odds import averaged, unsure_of

ROUGH_PX = 480
"""Depth for the lights' sake is integrated on a picture of at most this many pixels along its longer side."""
MOST_OFF = 0.12
"""Integrated depth that is off by more than this share of what the lights' falloff says is not believed."""
OF_PART = 1.5
"""A distance is at most so many times as unsure as the median of its part."""
FEW = 4
"""Of so few near lights each leaves one number over for the distance: they put whole parts, and no single point."""
TELLING = 3
"""How unsure parts are is asked as if one of the four said nothing, and as if the rig were off: with all four, a lamp
that is 2 % too strong put a seventh of a wall elsewhere and was sure of it; with half of them, a fifth of what moves on
a belt was lost."""
STAYED = 0.03
"""What was put within this share of the plane is no more unsure than the plane, which was measured."""
LEAST_COVERED = 0.5
"""Share of a rough pixel's normals that must be there."""


@dataclass(frozen=True, kw_only=True)
class NearSurface:
    """Where near lights find the surface: the first ``ground``, and how often it is made again from the normals.

    known_m: the depth (row, col) known of the instant with a number, 0 where unknown; it comes before the ground's.
    apart: (row, col), pixels through which no surface runs, so that what lies beside them is integrated by itself.
    torn: how far off the logarithm of distances may be because pixels may belong to another surface, (row, col) as
        what the ground is unsure of.
    distances: what the lights' falloff says of the whole picture; None where it was not asked, or the plane holds.
    by_part: what it says under few lights, on the grid on which depth is integrated for the lights' sake.
    """

    ground: Ground
    shaping: Shaping
    iterations: int = 0
    known_m: Callable[[int], NDArray[np.float32]] | None = None
    apart: NDArray[np.bool_] | None = None
    torn: NDArray[np.float32] | None = None
    distances: Distances | None = None
    by_part: Distances | None = None

    def at(self, number: int) -> "NearSurface":
        """Return where the surface is at the instant with this number."""
        if self.known_m is None:
            return self
        known_m = self.known_m(number)
        return replace(
            self, ground=self.ground.with_depth(known_m), shaping=replace(self.shaping, known_m=known_m), known_m=None
        )


def near_surface_of(
    rig: Rig,
    lights: Sequence[Light],
    *,
    height_px: int,
    width_px: int,
    iterations: int = 0,
    depths: DepthMaps | None = None,
) -> NearSurface | None:
    """Return where near lights find the surface, None where all lights are distant; ``depths`` is what is known of it.

    Raises PsvideoError where the rig does not say where the surface or the camera's axis is.
    """
    if not is_near(lights):
        return None
    known_m = None if depths is None else depths.first
    ground = ground_of(rig, height_px=height_px, width_px=width_px, known_m=known_m)
    return NearSurface(
        ground=ground,
        shaping=Shaping(view=view_of(rig), plane=rig.plane, known_m=known_m),
        iterations=iterations,
        known_m=None if depths is None or depths.still is not None else depths.at,
    )


def solve_near(
    near: NearSurface, light: Callable[[Ground], Illumination], solve: Callable[[Illumination], Surface]
) -> Surface:
    """Return the surface that ``solve`` finds under the lights that ``light`` gives for the last ground."""
    ground = near.ground
    surface = solve(light(ground))
    for _ in range(near.iterations):
        shown = surface if near.apart is None else _cut(surface, near.apart)
        depth_m = _rough_depth_m(near.shaping, shown, near.by_part)
        if near.apart is not None:  # what was integrated across an edge that nobody saw is far from what was swept
            swept_m = near.ground.depth_m
            depth_m[np.abs(depth_m - swept_m) > MOST_OFF * swept_m] = 0
            ground = near.ground
        if near.by_part is not None:
            ground = replace(ground, unsure=_unsure_of_parts(near.ground.unsure, depth_m, near.by_part))
        ground = _held_by_parts(ground, depth_m, near).with_depth(depth_m)
        surface = solve(light(ground))
    return surface if near.distances is None else replace(surface, distances=near.distances)


def _unsure_of_parts(
    on_plane: NDArray[np.float32] | None, depth_m: NDArray[np.float32], by_part: Distances
) -> NDArray[np.float32] | None:
    """Return how unsure depth is where few lights put whole parts, on the grid of what was unsure ``on_plane``, which
    stays where no depth was integrated or these lights tell nothing."""
    if on_plane is None:
        return None
    rows, cols = (np.arange(many) * full // many for many, full in zip(on_plane.shape, depth_m.shape, strict=True))
    here, told = depth_m[np.ix_(rows, cols)], by_part.weight > 0
    told &= here > 0
    if not told.any():
        return on_plane
    logs = np.log(np.where(told, here, by_part.plane_m) / by_part.plane_m)
    costs = averaged(by_part.costs, by_part.weight)
    unsure = unsure_of(costs, TELLING, logs, told, rig_is_off=True)
    unsure = np.where(np.abs(logs) < STAYED, np.minimum(unsure, on_plane), unsure)
    return np.where(told, unsure, on_plane)


def _held_by_parts(ground: Ground, depth_m: NDArray[np.float32], near: NearSurface) -> Ground:
    """Return the ground with distances that are hardly more unsure than the median of their part: the relief of a part
    is integrated, and only the distance of the whole is left to find."""
    if ground.unsure is None:
        return ground
    rows, cols = (np.arange(size) * full // size for size, full in zip(ground.unsure.shape, depth_m.shape, strict=True))
    whole = depth_m > 0 if near.apart is None else (depth_m > 0) & ~near.apart
    count, parts = cv2.connectedComponents(whole[np.ix_(rows, cols)].view(np.uint8), connectivity=4)
    in_order = ground.unsure.ravel()[np.lexsort((ground.unsure.ravel(), parts.ravel()))]
    many = np.bincount(parts.ravel(), minlength=count)
    of_part = OF_PART * in_order[np.minimum(np.cumsum(many) - many + many // 2, in_order.size - 1)]
    of_part[0] = np.inf
    unsure = np.minimum(ground.unsure, of_part[parts])
    unsure = unsure if near.torn is None else np.maximum(unsure, near.torn)
    return replace(ground, unsure=np.asarray(unsure, np.float32))


def _cut(surface: Surface, apart: NDArray[np.bool_]) -> Surface:
    """Return a surface without some of its pixels."""
    shown = surface.shown & ~apart
    normals = np.where(shown[..., None], surface.normals, np.float32(0))
    return Surface(normals=normals, albedo=shown.astype(np.float32), valid=shown)


def _rough_depth_m(shaping: Shaping, surface: Surface, by_part: Distances | None) -> NDArray[np.float32]:
    """Return a surface's depth, 0 where it has none, from normals averaged down to ROUGH_PX: lights see no detail."""
    rows, cols = surface.valid.shape
    step = max(int(np.ceil(max(rows, cols) / ROUGH_PX)), 1)
    if step == 1:
        return depth_of(shaping, replace(surface, distances=by_part)).depth
    high, wide = -(-rows // step), -(-cols // step)
    margin = ((0, high * step - rows), (0, wide * step - cols), (0, 0))
    blocks = np.pad(surface.normals.astype(np.float32), margin).reshape(high, step, wide, step, 3)
    mean = blocks.mean(axis=(1, 3))
    length = np.linalg.norm(mean, axis=-1)
    valid = length > LEAST_COVERED
    normals = np.where(valid[..., None], mean / np.maximum(length, LEAST_COVERED)[..., None], 0)
    small = Surface(normals=normals, albedo=valid.astype(np.float32), valid=valid, distances=by_part)
    known_m = None if shaping.known_m is None else _every(shaping.known_m, step, (high, wide))
    depth = depth_of(replace(shaping, view=_smaller(shaping.view, step), known_m=known_m), small).depth
    size = (wide * step, high * step)
    known = cv2.resize((depth > 0).astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
    whole = cv2.resize(depth, size, interpolation=cv2.INTER_LINEAR) / np.maximum(known, 1e-6)
    rough: NDArray[np.float32] = np.where(known > 0, whole, 0)[:rows, :cols].astype(np.float32)
    return rough


def _every(known_m: NDArray[np.float32], step: int, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Return the known depth in the middle of every rough pixel; a mean would mix near and far."""
    rows, cols = (
        np.minimum(np.arange(n) * step + step // 2, size - 1) for n, size in zip(shape, known_m.shape, strict=True)
    )
    return known_m[np.ix_(rows, cols)]


def _smaller(view: View, step: int) -> View:
    """Return the view of a picture of which each pixel is ``step`` by ``step`` of the whole one's."""
    if view.focal_px is None or view.principal_px is None:
        raise ValueError("near lights need a perspective view")
    x, y = ((middle + 0.5) / step - 0.5 for middle in view.principal_px)
    return View(focal_px=(view.focal_px[0] / step, view.focal_px[1] / step), principal_px=(x, y))


def near_trust(near: NearSurface) -> str:
    """Return in a whole sentence what a valid normal under near lights depends on."""
    middle = f"{-near.ground.middle_m[2]:.3g} m away in the picture's middle"
    source = f"the rig's [surface] plane is, {middle}, or with four near lights and more where falloff puts it"
    source = source if near.shaping.known_m is None else f"the depth that was given says, {middle}"
    return (
        f"The lights are near, and the subject is taken to be where {source}. Were the lights' distances wrong by a "
        "tenth, normals would be off by about 3 degrees."
    )
