"""Lights that do not reach a pixel, though it shows something of them: light that comes by way of other surfaces.

Three lights explain any three brightnesses. In a shadow that is lit from around, the normal of all three is none of the
surface's; that of the two that do reach the pixel, and of what is around it, is nearer.
"""

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Bytes, Floats, Mask
from psvideo.model.surface import Surface
from psvideo.solve.filling.tiles import AT_ONCE, THREE_LIGHTS
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.robust.reflectance import sent_to

DIM = 0.2
"""A light that gives less than this share of what the pixel's lights give in the mean does not reach it, where the
subject's shadows are lit; where it hardly shows that they are, a smaller share. (A wide crease of albedo 0.5 sends back
as much.)"""
LEAST_ERROR_DEG = 8.0
"""A normal that is predicted to be off by less is left as it was measured, trusted or not: where a lamp does graze a
surface, two lights say less than three."""
MOST_LIGHTS = 7
"""Of so many lights a byte says which are left out; more lights check each other."""


def left_out(surface: Surface, one: Evidence, *, solved: Mask) -> Bytes | None:
    """Return which lights are left out of pixels that were ``solved`` with them, (row, col): 2 to the power of a
    light's number and one, added up, and 0 where all count. None where none is left out anywhere.

    The surface has its predicted errors. Nothing is left out of what is trusted, where shadows are black, or where the
    solver leaves out what is dim; nor where four lights or more would be left, since fewer are used, nor under more
    than ``MOST_LIGHTS``.
    """
    ratio = DIM * surface.shadows_lit
    if not ratio > one.usable.shadow_ratio or surface.error_deg is None or len(one.plates) > MOST_LIGHTS:
        return None
    doubtful = solved & ~surface.valid
    doubtful &= surface.error_deg > LEAST_ERROR_DEG
    found = np.zeros(solved.shape, np.uint8)
    places = np.flatnonzero(doubtful)
    for first in range(0, len(places), AT_ONCE):
        some = places[first : first + AT_ONCE]
        rows, cols = np.divmod(some, solved.shape[1])
        found[rows, cols] = _dim_lights(
            surface.normals[rows, cols].astype(np.float32), _towards(one, rows, cols), ratio
        )
    return found if found.any() else None


def _towards(one: Evidence, rows: NDArray[np.intp], cols: NDArray[np.intp]) -> Floats:
    """Return the unit vectors to all lights, (light, pixel, 3), or (light, 1, 3) where they are the same for all."""
    if one.lit.near is None:
        return np.asarray(one.lit.directions, np.float32)[:, None]
    sent = sent_to(one.lit, (rows, cols)).astype(np.float32)
    return np.asarray(sent / np.linalg.norm(sent, axis=-1, keepdims=True))


def _dim_lights(normals: Floats, towards: Floats, ratio: float) -> Bytes:
    """Return what ``left_out`` does, of some pixels' normals (pixel, 3)."""
    shares = np.maximum((towards * normals).sum(axis=-1), 0)
    dim = shares < np.float32(ratio) * shares.mean(axis=0)
    dim &= np.count_nonzero(~dim, axis=0) <= THREE_LIGHTS
    return np.asarray((dim * (2 << np.arange(len(dim)))[:, None]).sum(axis=0).astype(np.uint8))
