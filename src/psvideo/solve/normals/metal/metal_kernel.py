"""Loops over points of metal: what lobes show, the normal that explains a point best, and what it would show matte.

Arrays are those of ``SubjectPoints``: (light, point), directions (light, point, 3). What is compared
are square roots of brightness, of which shot noise is as large in the dark as in a highlight: of light itself,
highlights alone would count. A point's own scale is free.
"""

import numpy as np

from psvideo.compute.compiled import EXACT, FUSED
from psvideo.model.arrays import Doubles
from psvideo.solve.normals.robust.reflectance_kernel import solve_symmetric

LOBES = 8
"""Of h^2, h^4 and so on, each the square of the one before."""
ALIKE = 32
"""So many neighbours share one table of what the starts show: the lights' and the camera's directions hardly differ."""
LEAST_ROOT = 0.02
"""Of the square root of what is shown: darker than this its gradient says nothing."""
STEPS, LONGEST_STEP = 8, 0.12
"""Of Gauss and Newton from a start, and the longest of them in radians: starts lie half as far apart."""
BESIDE = 0.978
"""The cosine of 12 degrees: starts nearer than this come to the same."""
WIDTH, LEAST_SPREAD = 2.5, 0.01
"""Cauchy's width in standard deviations of a point's own residuals, which are at least this share of its light."""
MOST_ALIKE, LEAST_ALIKE = 3.0, 0.1
"""What a matte surface's residual is over the metal's, between these, for the same turn of the normal."""
LEFT_OUT_OF = 6
"""One of so many measurements is left out where it is asked how well points are explained."""
CLEARLY_LESS = 0.5
"""A normal that is far from the best start is taken where it leaves less than this: lobes are never quite right, and by
chance the wrong side of where lamps are mirrored often leaves a little less."""
LEANING, LEAST_COSINE = 0.25, 0.1
"""What leans shows the camera more facets, and is brighter by a power of the cosine to it: 0 of some formulas, 1/2 of
Ward's; so is its albedo, by half of that."""
TINY = 1e-12


@FUSED.inlined
def _shown(numbers: Doubles, c: float, h: float) -> tuple[float, float, float]:
    """Return what a light shows at cosines to it and to half way, and what that gains with either."""
    if c <= 0.0:
        return 0.0, 0.0, 0.0
    least = max(h, 1e-3)
    power, plain, by_plain, shaded, by_shaded, number = least * least, 0.0, 0.0, numbers[0], 0.0, 2.0
    for k in range(1, LOBES + 1):
        one, other = numbers[k] * power, numbers[LOBES + k] * power
        plain += one
        by_plain += number * one
        shaded += other
        by_shaded += number * other
        power *= power
        number *= 2.0
    return plain + c * shaded, shaded, (by_plain + c * by_shaded) / least


@EXACT.kept
def fill_shown(normals: Doubles, towards: Doubles, half: Doubles, parts: Doubles) -> None:
    """Fill ``parts`` (1 + 2 LOBES, light, point) with n . l, the lobes, and the lobes times n . l of points with these
    normals (point, 3)."""
    for p in range(len(normals)):
        x, y, z = normals[p, 0], normals[p, 1], normals[p, 2]
        for light in range(len(towards)):
            c = x * towards[light, p, 0] + y * towards[light, p, 1] + z * towards[light, p, 2]
            h = x * half[light, p, 0] + y * half[light, p, 1] + z * half[light, p, 2]
            power = max(h, 1e-3) ** 2
            parts[0, light, p] = max(c, 0.0)
            for k in range(1, LOBES + 1):
                parts[k, light, p] = power if c > 0.0 else 0.0
                parts[LOBES + k, light, p] = power * max(c, 0.0)
                power *= power


@FUSED.kept
def find_normals(
    measured: Doubles, counts: Doubles, towards: Doubles, half: Doubles, starts: Doubles, numbers: Doubles,
    found: Doubles,
) -> None:  # fmt: skip
    """Fill ``found`` (point, 3) with the normals that explain what was measured best: steps of reweighted Gauss and
    Newton from two of the ``starts`` (start, 3), the best and the best of those that are far from it."""
    lights = len(measured)
    table, scores, rows = np.empty((len(starts), lights)), np.empty(len(starts)), np.empty((lights, 3))
    root, weights, order, normal, other = np.empty(lights), np.empty(lights), np.empty(lights), np.empty(3), np.empty(3)
    for p in range(len(found)):
        if p % ALIKE == 0:
            _fill_table(starts, towards, half, numbers, min(p + ALIKE // 2, len(found) - 1), table)
        for light in range(lights):
            root[light] = np.sqrt(max(measured[light, p], 0.0))
        _fill_scores(table, root, counts, p, scores)
        best = _best_start(starts, scores, -1)
        far = _best_start(starts, scores, best)
        for i in range(3):
            normal[i], other[i] = starts[best, i], starts[far, i]
        left = _descended(root, counts, towards, half, numbers, p, normal, rows, weights, order)
        there = _descended(root, counts, towards, half, numbers, p, other, rows, weights, order)
        for i in range(3):
            found[p, i] = other[i] if there < CLEARLY_LESS * left else normal[i]


@FUSED.inlined
def _fill_table(s: Doubles, t: Doubles, h: Doubles, k: Doubles, p: int, table: Doubles) -> None:
    """Fill the square roots of what a point would show with every start as its normal (start, light)."""
    for n in range(len(s)):
        for light in range(len(t)):
            c = s[n, 0] * t[light, p, 0] + s[n, 1] * t[light, p, 1] + s[n, 2] * t[light, p, 2]
            to_half = s[n, 0] * h[light, p, 0] + s[n, 1] * h[light, p, 1] + s[n, 2] * h[light, p, 2]
            table[n, light] = np.sqrt(_shown(k, c, to_half)[0])


@FUSED.inlined
def _fill_scores(table: Doubles, root: Doubles, counts: Doubles, p: int, scores: Doubles) -> None:
    """Fill how well every start explains a point, in whatever scale."""
    for n in range(len(table)):
        along, square = 0.0, TINY
        for light in range(len(root)):
            along += counts[light, p] * root[light] * table[n, light]
            square += counts[light, p] * table[n, light] * table[n, light]
        scores[n] = along * along / square


@FUSED.inlined
def _best_start(s: Doubles, scores: Doubles, but: int) -> int:
    """Return the start with the best score, of those that are far from one (-1: of all)."""
    best, most = 0, -1.0
    for n in range(len(scores)):
        if scores[n] > most:
            if but >= 0 and s[n, 0] * s[but, 0] + s[n, 1] * s[but, 1] + s[n, 2] * s[but, 2] > BESIDE:
                continue
            best, most = n, scores[n]
    return best


@FUSED.inlined
def _descended(
    root: Doubles, counts: Doubles, t: Doubles, h: Doubles, k: Doubles, p: int, normal: Doubles,
    rows: Doubles, weights: Doubles, order: Doubles,
) -> float:  # fmt: skip
    """Take the steps from a normal, in place, and return the sum of what it leaves before the last one."""
    lights, total = len(root), 0.0
    for light in range(lights):
        weights[light] = counts[light, p]
    for _ in range(STEPS):
        x, y, z = normal[0], normal[1], normal[2]
        ax, ay, az = (0.0, z, -y) if abs(x) < 0.6 else (-z, 0.0, x)  # two ways across the normal
        size = np.sqrt(ax * ax + ay * ay + az * az)
        ax, ay, az = ax / size, ay / size, az / size
        bx, by, bz = y * az - z * ay, z * ax - x * az, x * ay - y * ax
        along, square = 0.0, TINY
        for light in range(lights):
            lx, ly, lz = t[light, p, 0], t[light, p, 1], t[light, p, 2]
            hx, hy, hz = h[light, p, 0], h[light, p, 1], h[light, p, 2]
            sum_, by_light, gain = _shown(k, x * lx + y * ly + z * lz, x * hx + y * hy + z * hz)
            shown = max(np.sqrt(sum_), LEAST_ROOT)
            per = 0.5 / shown if sum_ > LEAST_ROOT * LEAST_ROOT else 0.0
            rows[light, 0] = per * (by_light * (ax * lx + ay * ly + az * lz) + gain * (ax * hx + ay * hy + az * hz))
            rows[light, 1] = per * (by_light * (bx * lx + by * ly + bz * lz) + gain * (bx * hx + by * hy + bz * hz))
            rows[light, 2] = shown
            along += weights[light] * root[light] * shown
            square += weights[light] * shown * shown
        scale = along / square
        many, total = 0, 0.0
        for light in range(lights):
            if counts[light, p] > 0.0:
                place, own = many, abs(root[light] - scale * rows[light, 2])
                total += own
                while place > 0 and order[place - 1] > own:
                    order[place] = order[place - 1]
                    place -= 1
                order[place] = own
                many += 1
        spread = 1.48 * order[min((many + 3) // 2 - 1, many - 1)] if many else 0.0
        spread = WIDTH * max(spread, LEAST_SPREAD * scale) + TINY
        m00, m01, m02, m11, m12, m22, r0, r1, r2 = 1e-9, 0.0, 0.0, 1e-9, 0.0, 1e-9, 0.0, 0.0, 0.0
        for light in range(lights):
            rest = root[light] - scale * rows[light, 2]
            share = rest / spread
            weight = counts[light, p] / (1.0 + share * share)
            weights[light] = weight
            u, v, w = scale * rows[light, 0], scale * rows[light, 1], rows[light, 2]
            m00, m01, m02 = m00 + weight * u * u, m01 + weight * u * v, m02 + weight * u * w
            m11, m12, m22 = m11 + weight * v * v, m12 + weight * v * w, m22 + weight * w * w
            r0, r1, r2 = r0 + weight * u * rest, r1 + weight * v * rest, r2 + weight * w * rest
        # the scale goes out first, and a little is added along both ways: what nothing shows stays
        n00, n01, n11 = m00 - m02 * m02 / m22, m01 - m02 * m12 / m22, m11 - m12 * m12 / m22
        q0, q1 = r0 - m02 * r2 / m22, r1 - m12 * r2 / m22
        more = 1e-4 * (n00 + n11) + TINY
        n00, n11 = n00 + more, n11 + more
        determinant = n00 * n11 - n01 * n01
        da, db = (n11 * q0 - n01 * q1) / determinant, (n00 * q1 - n01 * q0) / determinant
        share = min(1.0, LONGEST_STEP / max(np.sqrt(da * da + db * db), TINY))
        da, db = share * da, share * db
        x, y, z = x + da * ax + db * bx, y + da * ay + db * by, z + da * az + db * bz
        size = np.sqrt(x * x + y * y + z * z)
        normal[0], normal[1], normal[2] = x / size, y / size, z / size
    return total


@FUSED.kept
def fill_sums(normals: Doubles, towards: Doubles, half: Doubles, numbers: Doubles, shown: Doubles) -> None:
    """Fill ``shown`` (light, point) with what points with these normals (point, 3) show, in their own scale."""
    for p in range(len(normals)):
        for light in range(len(towards)):
            c, h = 0.0, 0.0
            for i in range(3):
                c += normals[p, i] * towards[light, p, i]
                h += normals[p, i] * half[light, p, i]
            shown[light, p] = _shown(numbers, c, h)[0]


@FUSED.kept
def fill_unlike(measured: Doubles, counts: Doubles, shown: Doubles, unlike: Doubles) -> None:
    """Fill ``unlike`` (point,) with the share of what was measured (light, point), as square roots, that is not what is
    ``shown``, in any scale: 0 is all of it, 1 nothing. The worst few measurements are left out, as a cast shadow's edge
    is."""
    lights = len(measured)
    order, bright, root = np.empty(lights), np.empty(lights), np.empty(lights)
    for p in range(len(unlike)):
        along, square, there, many = 0.0, TINY, TINY, 0
        for light in range(lights):
            bright[light], root[light] = np.sqrt(max(shown[light, p], 0.0)), np.sqrt(max(measured[light, p], 0.0))
            along += counts[light, p] * root[light] * bright[light]
            square += counts[light, p] * bright[light] * bright[light]
            there += counts[light, p] * root[light] * root[light]
        for _ in range(2):
            scale, many = along / square, 0
            for light in range(lights):
                if counts[light, p] > 0.0:
                    place, own = many, abs(root[light] - scale * bright[light])
                    while place > 0 and order[place - 1] > own:
                        order[place] = order[place - 1]
                        place -= 1
                    order[place] = own
                    many += 1
            most = order[max(many - 1 - many // LEFT_OUT_OF, 0)] if many else 0.0
            along, square = 0.0, TINY
            for light in range(lights):
                if counts[light, p] > 0.0 and abs(root[light] - scale * bright[light]) <= most:
                    along += root[light] * bright[light]
                    square += bright[light] * bright[light]
        total = 0.0
        for k in range(many - many // LEFT_OUT_OF):
            total += order[k] * order[k]
        unlike[p] = total / there


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
        along, square, straight, faced, many = 0.0, TINY, 0.0, TINY, 0.0
        for light in range(lights):
            c, h = 0.0, 0.0
            for i in range(3):
                c += normals[p, i] * towards[light, p, i]
                h += normals[p, i] * half[light, p, i]
            shown = _shown(numbers, c, h)[0]
            cosines[light] = max(c, 0.0)
            along += counts[light, p] * np.sqrt(shown * max(measured[light, p], 0.0))
            square += counts[light, p] * shown
            straight += _shown(numbers, towards[light, p, 2], half[light, p, 2])[0]
            faced += max(towards[light, p, 2], 0.0)
            many += counts[light, p] if c > 0.0 else 0.0
        scale = (along / square) ** 2
        size = scale * straight / faced * max(z, LEAST_COSINE) ** LEANING
        m[:], own[:] = 0.0, 0.0
        m[0] = m[3] = m[5] = 1e-9
        for light in range(lights):
            left[light] = 0.0
            if counts[light, p] <= 0.0 or cosines[light] <= 0.0:
                continue
            lx, ly, lz = towards[light, p, 0], towards[light, p, 1], towards[light, p, 2]
            hx, hy, hz = half[light, p, 0], half[light, p, 1], half[light, p, 2]
            h = x * hx + y * hy + z * hz
            shown, by_light, gain = _shown(numbers, cosines[light], h)
            gx = by_light * (lx - cosines[light] * x) + gain * (hx - h * x)
            gy = by_light * (ly - cosines[light] * y) + gain * (hy - h * y)
            gz = by_light * (lz - cosines[light] * z) + gain * (hz - h * z)
            turns = np.sqrt(gx * gx + gy * gy + gz * gz)
            sine = np.sqrt(max(1.0 - cosines[light] * cosines[light], 0.0))
            per = min(max(sine / max(turns, TINY), LEAST_ALIKE), MOST_ALIKE)
            left[light] = counts[light, p] * per * (measured[light, p] / max(scale, TINY) - shown)
            m[0] += lx * lx
            m[1] += lx * ly
            m[2] += lx * lz
            m[3] += ly * ly
            m[4] += ly * lz
            m[5] += lz * lz
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
