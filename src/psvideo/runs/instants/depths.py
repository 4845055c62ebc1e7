"""The depth of a run's instants, of which the first is integrated at once, because it fixes the scale of the others."""

import threading
from collections.abc import Callable
from functools import partial

from psvideo.compute.heap import give_back
from psvideo.model.surface import Surface
from psvideo.runs.steps.lighting import Lighting
from psvideo.solve.depth import Depth, Shaping, begun, depth_of
from psvideo.solve.instants import Instant

INTEGRATING = threading.Lock()
"""Integrating takes about 45 bytes a pixel, as much as a round of frames: never two instants side by side."""


def shape_of(
    shaping: Shaping | None, lighting: Lighting, instant: Instant
) -> tuple[Shaping | None, Callable[[], Depth] | None]:
    """Return the clip's shaping, begun with its first instant, and what integrates this one when it is called.

    Both are None where no depth is asked for. The first instant's depth is there already and not found twice. Where
    something moves, so is this one's: following the next round takes as much memory as integrating, on both cores.
    """
    if shaping is None:
        return None, None
    give_back()  # what solving this instant left free would lie beside what integrates one
    number, surface = instant.round.number, instant.surface
    if shaping.first is None:
        shaping = begun(lighting.shaping_at(shaping, number), surface)
        return shaping, partial(_first, shaping)
    if instant.round.motion is None:
        return shaping, partial(_later, lighting, shaping, number, surface)
    depth = _later(lighting, shaping, number, surface)
    give_back()
    return shaping, lambda: depth


def _first(shaping: Shaping) -> Depth:
    if shaping.first is None:
        raise ValueError("the shaping has not begun")
    return shaping.first


def _later(lighting: Lighting, shaping: Shaping, number: int, surface: Surface) -> Depth:
    with INTEGRATING:
        return depth_of(lighting.shaping_at(shaping, number), surface)
