"""The compiled loop over light in shadow: what reaches points from lamps that do not, and how far noise spreads there.

Every point's numbers stand in planes of a block, and every choice is a number, so that the loops become vectors.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import decoded, lent
from psvideo.compute.symmetric import adjugate
from psvideo.model.arrays import Floats, Samples
from psvideo.solve.normals.evidence import Indirect, Left
from psvideo.solve.normals.loops.blocks import ABSENT, BLOCK, ONE, ZERO
from psvideo.solve.normals.loops.measuring import is_seen, samples_of
from psvideo.solve.normals.loops.near_kernel import at, lent_task, of_light, place_lights
from psvideo.solve.normals.task import LIGHTS, Task, Work

TWO = np.float32(2)
FACING = np.float32(0.05)  # the cosine up to which a light passes a surface by, where such light was not used
SHADOWED = np.float32(0.25)  # of what a light would give, below which it is hindered
MOST_WIDENED = np.float32(100)  # up to this many times the square spreads noise farther where fewer lights reach
UNSOLVED_WIDENED = np.float32(5)  # the same where so few lights seem to reach that they could not have told the normal
ROUGHLY = np.float32(1e4)  # the condition squared up to which lights are not nearly coplanar
TINIEST = np.float32(1e-12)
MOST_INDIRECT = np.float32(0.5)  # of the albedo: more is a highlight, or a wrong normal

# The planes of the working array: a point's normal and albedo, what one light shows of it and whether it is known, what
# is added up of all lights, and the equations of the lights that reach it (SOME) and of all (EVERY), six planes each.
X, Y, Z, SIZE, LEVEL, HERE, TOTAL, NUMBER, LEFT, SHOWING = (BLOCK * plane for plane in range(10))
SOME, EVERY = 10 * BLOCK, 16 * BLOCK
PICKED = 22 * BLOCK  # samples that lie apart in a row, side by side


@FUSED.kept
def indirect_rows(
    task: Task, work: Work, normals: Samples, albedo: Samples, found: Indirect, left: Left, soft: np.float32,
    first: int, last: int, step: int,
) -> None:  # fmt: skip
    """Fill ``found`` with what reaches every ``step``-th row and column from lights that do not, and by how much
    farther noise spreads without these; and ``left`` with what normals leave of all lights that show there, where its
    planes are not empty.

    normals, albedo: (3, row, col) and (channel, row, col), zeros where there is none. Planes of ``found`` and ``left``:
    (row // step, col // step). ``soft``: what the subject lets through counts as the lights' own.
    """
    t = lent_task(task, work.matrix, work.per_strength)
    n, a, w = lent(normals), lent(albedo), lent(work.planes)
    total, count, wider = lent(found.sums), lent(found.counts), lent(found.wider)
    squares, lights = lent(left.squares), lent(left.lights)
    for row in range(-(-first // step) * step, last, step):
        for col in range(0, t.cols, BLOCK):
            width = min(BLOCK, t.cols - col)
            begin = -col % step
            points = len(range(begin, width, step))
            if not _place_points(t, n, a, w, row, col + begin, step, points):
                continue
            place_lights(t.matrix, t.per_strength, t.near, row, col, width)
            for light in range(t.lights):
                _read_level(t, w, light, row, col + begin, step, points)
                _add_light(t, w, light, soft, begin, step, points)
            place, down = (col + begin) // step, row // step
            for point in range(points):
                w[PICKED + point] = _widened(w, point)
            _keep_known(w, TOTAL, points, total[down, place : place + points])
            _keep_known(w, NUMBER, points, count[down, place : place + points])
            _keep_known(w, PICKED, points, wider[down, place : place + points])
            for point in range(points if squares.size else 0):
                if w[SIZE + point] > ZERO:
                    squares[down, place + point] = w[LEFT + point]
                    lights[down, place + point] = w[SHOWING + point]


@FUSED.inlined
def _keep_known(w: Floats, plane: int, points: int, out: Floats) -> None:
    """Store a plane of a block where a point is known."""
    for point in range(points):
        out[point] = w[plane + point] if w[SIZE + point] > ZERO else out[point]


@FUSED.inlined
def _place_points(task: Task, n: Samples, a: Samples, w: Floats, row: int, col: int, step: int, points: int) -> bool:
    """Fill the planes of normals and albedos, and those of sums with zeros; return whether there is any point."""
    each, any_known = ONE / np.float32(task.tone.shape[1]), np.int32(0)
    w[SIZE : SIZE + points] = ZERO
    for channel in range(task.tone.shape[1]):
        share = each * task.shares[channel]
        for point in range(points):
            w[SIZE + point] += decoded(a[channel, row, col + point * step]) * share
    for point in range(points):
        w[X + point] = decoded(n[0, row, col + point * step])
        w[Y + point] = decoded(n[1, row, col + point * step])
        w[Z + point] = decoded(n[2, row, col + point * step])
        any_known = np.int32(any_known | (w[SIZE + point] > ZERO))
    for plane in range(TOTAL, EVERY + 6 * BLOCK, BLOCK):
        w[plane : plane + points] = ZERO
    return bool(any_known)


@FUSED.inlined
def _read_level(task: Task, w: Floats, light: int, row: int, col: int, step: int, points: int) -> None:
    """Fill the planes of what a light shows of every point, its channels together, and whether that is known: seen, and
    not saturated."""
    channels = task.tone.shape[1]
    each = ONE / np.float32(channels)
    samples = samples_of(task, light, row * task.cols + col, step * (points - 1) + 1)
    w[HERE : HERE + points], w[LEVEL : LEVEL + points] = ONE, ZERO
    for channel in range(channels):
        (gain, offset, ceiling, _), share = task.tone[light, channel], each * task.shares[channel]
        for point in range(points):
            w[PICKED + point] = np.float32(samples[point * step * channels + channel])
        for point in range(points):
            value = w[PICKED + point] * gain + offset
            w[HERE + point] = w[HERE + point] if (value < ceiling) & (value > ABSENT) else ZERO
            w[LEVEL + point] += value * share
    for point in range(points if task.seen.size else 0):
        w[HERE + point] = w[HERE + point] if is_seen(task.seen, light, row, col + point * step) else ZERO


@FUSED.inlined
def _add_light(task: Task, w: Floats, light: int, soft: np.float32, begin: int, step: int, points: int) -> None:
    """Add one light to what is summed up of all."""
    lamp, strength, scale = of_light(task.matrix, light), task.per_strength[light], task.albedo_scale
    read, photon, darkest = task.noise[light, 0], task.noise[light, 1], task.dark[light]
    facing = FACING if task.ratio > ZERO else ZERO
    for point in range(points):
        i = begin + point * step
        per, (lx, ly, lz), size = at(strength, i), at(lamp, i), w[SIZE + point]
        here = w[HERE + point]
        one = size if size > ZERO else ONE
        cosine = (lx * w[X + point] + ly * w[Y + point] + lz * w[Z + point]) * per
        level, dark = w[LEVEL + point] * (per * scale), darkest * (per * scale)
        shade = max(cosine + soft * (ONE - cosine), ZERO)
        beyond = level / one - shade
        w[LEFT + point] += beyond * beyond if here > ZERO else ZERO
        w[SHOWING + point] += here if max(level, size * cosine) > dark else ZERO
        shadowed = (cosine > facing) & (level < SHADOWED * size * shade)
        unreached = shadowed | (cosine <= facing) | (level < dark)  # or lost in noise
        share = level / one - (ZERO if shadowed else shade)  # less what grazes the surface
        share = min(max(share, -MOST_INDIRECT), MOST_INDIRECT)
        w[TOTAL + point] += share if unreached & (here > ZERO) else ZERO
        w[NUMBER + point] += here if unreached else ZERO
        weight = _by_noise(read, photon, size / (scale * per))
        _add_equations(w, EVERY + point, weight, lx, ly, lz)
        _add_equations(w, SOME + point, ZERO if unreached else weight * here, lx, ly, lz)


@FUSED.inlined
def _by_noise(read: np.float32, photon: np.float32, light: np.float32) -> np.float32:
    """Return the weight of a light's measurement where it makes so much ``light`` straight above."""
    off = LIGHTS * light
    return np.float32(ONE / max(read + photon * light + off * off, TINIEST))


@FUSED.inlined
def _add_equations(w: Floats, at: int, weight: np.float32, x: np.float32, y: np.float32, z: np.float32) -> None:
    """Add one light to a point's normal equations."""
    w[at] += weight * x * x
    w[at + BLOCK] += weight * x * y
    w[at + 2 * BLOCK] += weight * x * z
    w[at + 3 * BLOCK] += weight * y * y
    w[at + 4 * BLOCK] += weight * y * z
    w[at + 5 * BLOCK] += weight * z * z


@FUSED.inlined
def _across(w: Floats, at: int, x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Return what of the covariance lies across a normal; 0 where there is none, or that of nearly coplanar lights."""
    a, b, c, d, e, f = w[at], w[at + BLOCK], w[at + 2 * BLOCK], w[at + 3 * BLOCK], w[at + 4 * BLOCK], w[at + 5 * BLOCK]
    xx, xy, xz, yy, yz, zz, determinant = adjugate(a, b, c, d, e, f)
    sound = (determinant > ZERO) & ((a + d + f) * (xx + yy + zz) < ROUGHLY * determinant)
    along = x * x * xx + y * y * yy + z * z * zz + TWO * (x * y * xy + x * z * xz + y * z * yz)
    return np.float32((xx + yy + zz - along) / (determinant if sound else ONE) if sound else ZERO)


@FUSED.inlined
def _widened(w: Floats, point: int) -> np.float32:
    """Return by how much what lies across a normal grows from the equations of every light to those of some."""
    x, y, z = w[X + point], w[Y + point], w[Z + point]
    left, whole = _across(w, SOME + point, x, y, z), _across(w, EVERY + point, x, y, z)
    known = (left > ZERO) & (whole > ZERO)
    return np.float32(min(max(left / (whole if known else ONE), ONE), MOST_WIDENED) if known else UNSOLVED_WIDENED)
