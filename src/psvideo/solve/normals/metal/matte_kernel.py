"""The loop over points of metal that says what they would show if they were matte.

Arrays are those of ``SubjectPoints``: (light, point), directions (light, point, 3).
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Doubles
from psvideo.solve.normals.metal.lobe_kernel import TINY, shown_by_lobes
from psvideo.solve.normals.robust.point_sums import add_square, solve_symmetric

MOST_ALIKE, LEAST_ALIKE = 3.0, 0.1
"""What a matte surface's residual is over the metal's, between these, for the same turn of the normal."""
LEANING, LEAST_COSINE = 0.25, 0.1
"""What leans shows the camera more facets, and is brighter by a power of the cosine to it: 0 of some formulas, 1/2 of
Ward's; so is its albedo, by half of that."""


@FUSED.kept
def fill_matte(
    measured: Doubles, counts: Doubles, towards: Doubles, half: Doubles, normals: Doubles, numbers: Doubles,
    matte: Doubles,
) -> None:  # fmt: skip
    """Fill ``matte`` (light, point) with what matte points with these normals would show, as bright as the metal would
    be if it faced the camera.

    What the metal leaves unexplained stays as much of a turn of the normal as it was; least squares finds the normal
    again, for what would turn it is taken off, and the rest is enlarged as if it were still there.
    """
    lights = len(measured)
    cosines, left, m, own = np.empty(lights), np.empty(lights), np.empty(6), np.empty(3)
    for p in range(len(normals)):
        x, y, z = normals[p, 0], normals[p, 1], normals[p, 2]
        scale, facing, many = _scales(measured, counts, towards, half, normals, numbers, p, cosines)
        size = facing * max(z, LEAST_COSINE) ** LEANING
        m[:], own[:] = 0.0, 0.0
        m[0] = m[3] = m[5] = 1e-9
        for light in range(lights):
            left[light] = 0.0
            if counts[light, p] <= 0.0 or cosines[light] <= 0.0:
                continue
            lx, ly, lz = towards[light, p, 0], towards[light, p, 1], towards[light, p, 2]
            hx, hy, hz = half[light, p, 0], half[light, p, 1], half[light, p, 2]
            h = x * hx + y * hy + z * hz
            shown, by_light, gain = shown_by_lobes(numbers, cosines[light], h)
            gx = by_light * (lx - cosines[light] * x) + gain * (hx - h * x)
            gy = by_light * (ly - cosines[light] * y) + gain * (hy - h * y)
            gz = by_light * (lz - cosines[light] * z) + gain * (hz - h * z)
            turns = np.sqrt(gx * gx + gy * gy + gz * gz)
            sine = np.sqrt(max(1.0 - cosines[light] * cosines[light], 0.0))
            per = min(max(sine / max(turns, TINY), LEAST_ALIKE), MOST_ALIKE)
            left[light] = counts[light, p] * per * (measured[light, p] / max(scale, TINY) - shown)
            add_square(m, 1.0, lx, ly, lz)
            own[0] += left[light] * lx
            own[1] += left[light] * ly
            own[2] += left[light] * lz
        solve_symmetric(m, own)
        more = np.sqrt(many / max(many - 3.0, 1.0))
        for light in range(lights):
            matte[light, p] = max(measured[light, p], 0.0)
            if counts[light, p] > 0.0 and cosines[light] > 0.0:
                turned = own[0] * towards[light, p, 0] + own[1] * towards[light, p, 1] + own[2] * towards[light, p, 2]
                matte[light, p] = size * max(cosines[light] + more * (left[light] - turned), 0.0)


@FUSED.inlined
def _scales(
    measured: Doubles, counts: Doubles, towards: Doubles, half: Doubles, normals: Doubles, numbers: Doubles, p: int,
    cosines: Doubles,
) -> tuple[float, float, float]:  # fmt: skip
    """Fill a point's ``cosines`` to the lights, 0 behind it; return its scale of the lobes, the matte albedo that is as
    bright as these are where a point faces the camera, and how many lights count that shine on it."""
    along, square, straight, faced, many = 0.0, TINY, 0.0, TINY, 0.0
    for light in range(len(measured)):
        c, h = 0.0, 0.0
        for i in range(3):
            c += normals[p, i] * towards[light, p, i]
            h += normals[p, i] * half[light, p, i]
        shown = shown_by_lobes(numbers, c, h)[0]
        cosines[light] = max(c, 0.0)
        along += counts[light, p] * np.sqrt(shown * max(measured[light, p], 0.0))
        square += counts[light, p] * shown
        straight += shown_by_lobes(numbers, towards[light, p, 2], half[light, p, 2])[0]
        faced += max(towards[light, p, 2], 0.0)
        many += counts[light, p] if c > 0.0 else 0.0
    scale = (along / square) ** 2
    return scale, scale * straight / faced, many
