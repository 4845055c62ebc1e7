"""What light is left where a lamp cannot reach: in attached shadow a surface is dark, unless something else lights it.

Ambient light that nothing took off, and light by way of other surfaces, stay there, in every light's picture alike.
"""

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import quantile
from psvideo.compute.spilled import thin
from psvideo.model.arrays import Doubles
from psvideo.model.surface import Surface

FACING_AWAY = -0.15
"""The cosine from which on a surface faces away from a lamp for sure: normals may be off by 8 degrees."""
LEAST_ALBEDO = 0.2
"""Of what nine tenths of the subject stay below: where less is reflected, noise is all that is seen."""
LEAST_SAMPLES = 20
LOW = 0.25
"""Taken is what three quarters of the samples are above: highlights and normals that are off only add light."""


def shadow_light(
    bright: NDArray[np.float32], shown: NDArray[np.bool_], surface: Surface, ways: Doubles, *, step: int
) -> float | None:
    """Return the light in attached shadow, as a share of what the same surface gives when it faces the lamp; None where
    too little of the subject lies in such shadow.

    bright, shown: (light, row, col), plates by their brightest channel and what is known of them, every ``step``-th
    pixel. ways: (light, 3), the rig's directions times strengths; distant lamps.
    """
    normals = thin(surface.normals, step).astype(np.float64)
    albedo = thin(surface.albedo, step).astype(np.float64)
    albedo = albedo if albedo.ndim == 2 else albedo.max(axis=-1)
    measured = surface.measured[::step, ::step]
    if not measured.any():
        return None
    clear = measured & (albedo > LEAST_ALBEDO * quantile(albedo[measured], 0.9))
    strengths = np.linalg.norm(ways, axis=1)
    samples = []
    for plate, known, way, strength in zip(bright, shown, ways, strengths, strict=True):
        away = clear & known & (np.einsum("rcx,x->rc", normals, way) < FACING_AWAY * strength)
        samples.append(plate[away] / (albedo[away] * strength))
    light = np.concatenate(samples)
    return quantile(light, LOW) if len(light) >= LEAST_SAMPLES else None
