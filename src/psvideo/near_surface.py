"""Normals under near lights where the surface is not known yet: solve, integrate the depth, solve again.

Near lights need the surface's depth, and depth comes from normals. The rig's [surface] plane is a first guess that is
off by the relief of the subject; from its normals depth is integrated, each part put onto the plane by its median, and
serves as the next guess. What no integration can tell is how far away the whole subject is: a plane at a wrong distance
stays wrong.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from psvideo.integrate import Shaping, depth_of, view_of
from psvideo.normals.illumination import Illumination
from psvideo.normals.near_light import Ground, ground_of, is_near
from psvideo.rig import Light, Rig
from psvideo.surface import Surface

NEAR_ITERATIONS = 1
"""How often the surface is made anew unless the user says otherwise: one leaves what the plane's distance costs."""
MOST_ITERATIONS = 10


@dataclass(frozen=True, kw_only=True)
class NearSurface:
    """Where near lights find the surface: the first ``ground``, and how often it is made anew from the normals."""

    ground: Ground
    shaping: Shaping
    iterations: int = 0


def near_surface_of(
    rig: Rig, lights: Sequence[Light], *, height_px: int, width_px: int, iterations: int = 0
) -> NearSurface | None:
    """Return where near lights find the surface, None where all lights are distant.

    Raises PsvideoError where the rig does not say where the surface or the camera's axis is.
    """
    if not is_near(lights):
        return None
    ground = ground_of(rig, height_px=height_px, width_px=width_px)
    return NearSurface(ground=ground, shaping=Shaping(view=view_of(rig), plane=rig.plane), iterations=iterations)


def solve_near(
    near: NearSurface, light: Callable[[Ground], Illumination], solve: Callable[[Illumination], Surface]
) -> Surface:
    """Return the surface that ``solve`` finds under the lights that ``light`` gives for the last ground."""
    ground = near.ground
    surface = solve(light(ground))
    for _ in range(near.iterations):
        ground = ground.with_depth(depth_of(near.shaping, surface).depth)
        surface = solve(light(ground))
    return surface


def near_trust(near: NearSurface) -> str:
    """Return in a whole sentence what a valid normal under near lights depends on."""
    distance_m = -near.ground.middle_m[2]
    return (
        f"The lights are near, and the subject is taken to be where the rig's [surface] plane is: {distance_m:.3g} m "
        "away in the picture's middle. Were the lights' distances wrong by a tenth, normals would be off by about 3 "
        "degrees."
    )
