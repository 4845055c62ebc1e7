"""The loop over points of metal that finds the normal which explains a point best under known lobes.

Arrays are those of ``SubjectPoints``: (light, point), directions (light, point, 3). What is compared are square roots
of brightness, as in ``lobe_kernel``.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.model.arrays import Doubles
from psvideo.solve.normals.metal.lobe_kernel import TINY, shown_by_lobes, sort_in

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
CLEARLY_LESS = 0.5
"""A normal that is far from the best start is taken where it leaves less than this: lobes are never quite right, and by
chance the wrong side of where lamps are mirrored often leaves a little less."""


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
            table[n, light] = np.sqrt(shown_by_lobes(k, c, to_half)[0])


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
    total = 0.0
    for light in range(len(root)):
        weights[light] = counts[light, p]
    for _ in range(STEPS):
        x, y, z = normal[0], normal[1], normal[2]
        ax, ay, az = (0.0, z, -y) if abs(x) < 0.6 else (-z, 0.0, x)  # two ways across the normal
        size = np.sqrt(ax * ax + ay * ay + az * az)
        ax, ay, az = ax / size, ay / size, az / size
        bx, by, bz = y * az - z * ay, z * ax - x * az, x * ay - y * ax
        for light in range(len(root)):
            lx, ly, lz = t[light, p, 0], t[light, p, 1], t[light, p, 2]
            hx, hy, hz = h[light, p, 0], h[light, p, 1], h[light, p, 2]
            sum_, by_light, gain = shown_by_lobes(k, x * lx + y * ly + z * lz, x * hx + y * hy + z * hz)
            shown = max(np.sqrt(sum_), LEAST_ROOT)
            per = 0.5 / shown if sum_ > LEAST_ROOT * LEAST_ROOT else 0.0
            rows[light, 0] = per * (by_light * (ax * lx + ay * ly + az * lz) + gain * (ax * hx + ay * hy + az * hz))
            rows[light, 1] = per * (by_light * (bx * lx + by * ly + bz * lz) + gain * (bx * hx + by * hy + bz * hz))
            rows[light, 2] = shown
        scale = _scale(root, weights, rows)
        total = _reweigh(root, counts, p, scale, rows, weights, order)
        da, db = _step(root, weights, scale, rows)
        x, y, z = x + da * ax + db * bx, y + da * ay + db * by, z + da * az + db * bz
        size = np.sqrt(x * x + y * y + z * z)
        normal[0], normal[1], normal[2] = x / size, y / size, z / size
    return total


@FUSED.inlined
def _scale(root: Doubles, weights: Doubles, rows: Doubles) -> float:
    """Return the point's scale: what makes what is shown, in the third column of ``rows``, most like what was seen."""
    along, square = 0.0, TINY
    for light in range(len(root)):
        along += weights[light] * root[light] * rows[light, 2]
        square += weights[light] * rows[light, 2] * rows[light, 2]
    return along / square


@FUSED.inlined
def _reweigh(
    root: Doubles, counts: Doubles, p: int, scale: float, rows: Doubles, weights: Doubles, order: Doubles
) -> float:
    """Fill the weights of measurements by how far they are from what is shown; return the sum of these distances."""
    many, total = 0, 0.0
    for light in range(len(root)):
        if counts[light, p] > 0.0:
            own = abs(root[light] - scale * rows[light, 2])
            total += own
            sort_in(order, many, own)
            many += 1
    spread = 1.48 * order[min((many + 3) // 2 - 1, many - 1)] if many else 0.0
    spread = WIDTH * max(spread, LEAST_SPREAD * scale) + TINY
    for light in range(len(root)):
        share = (root[light] - scale * rows[light, 2]) / spread
        weights[light] = counts[light, p] / (1.0 + share * share)
    return total


@FUSED.inlined
def _step(root: Doubles, weights: Doubles, scale: float, rows: Doubles) -> tuple[float, float]:
    """Return the step along the two ways across the normal, at most LONGEST_STEP; ``rows`` hold what the light shown
    gains along each, and what is shown."""
    m00, m01, m02, m11, m12, m22, r0, r1, r2 = 1e-9, 0.0, 0.0, 1e-9, 0.0, 1e-9, 0.0, 0.0, 0.0
    for light in range(len(root)):
        rest, weight = root[light] - scale * rows[light, 2], weights[light]
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
    return share * da, share * db
