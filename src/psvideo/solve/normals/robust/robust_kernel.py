"""The compiled loops of the robust solver, block by block: plain least squares, what that does not explain, the error.

Blocks and planes are those of ``blocks.py``; symbols: m = L g per pixel, as in ``kernel.py``. What these loops add lies
in a second working array ``v`` and in ``e`` (light, pixel): brightnesses first, then residuals.
"""

from typing import NamedTuple

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import lent
from psvideo.model.arrays import Bytes, Floats, Indices
from psvideo.solve.normals.loops.blocks import BLOCK, COUNT, LIMIT, ONE, ZERO, X, Y, Z
from psvideo.solve.normals.loops.colour_kernel import solve_colours
from psvideo.solve.normals.loops.measuring import all_seen, any_asked, read_usable
from psvideo.solve.normals.loops.near_kernel import at, lent_task, place_lights
from psvideo.solve.normals.loops.storing import store_block
from psvideo.solve.normals.result import Result, empty_result
from psvideo.solve.normals.robust.apart import fill_up, put_side_by_side
from psvideo.solve.normals.robust.equations import DOUBT, fill_sent, fill_view
from psvideo.solve.normals.robust.explained import list_unexplained, solve_plainly
from psvideo.solve.normals.robust.handing_out import hand_out
from psvideo.solve.normals.robust.predicted_error import NO_ERROR, UNEXPLAINED, predict_error
from psvideo.solve.normals.robust.reflected_light import find_ways
from psvideo.solve.normals.robust.robust_weights import solve_reweighted, weigh
from psvideo.solve.normals.robust.room import Room, memory_for_block
from psvideo.solve.normals.robust.weighing import Weights
from psvideo.solve.normals.task import FEW, LIGHTS, Task

STEP = 128  # pixels that are solved together: few enough that all of their planes stay in the nearest cache
LEAST_CHECKED = 5  # usable measurements from which on residuals show how well the lights explain a pixel
MOST_APART = 1 / 2  # of a block's pixels; where more are unexplained, it is as quick to solve all of them robustly


class Memory(NamedTuple):
    """What one call of ``solve_rows`` works in; no two calls at a time may share it."""

    whole: Room  # of the block
    apart: Room  # of those of its pixels that plain least squares does not explain
    listed: Indices  # which they are in the block,
    places: Indices  # and in the picture
    block: Result  # of one block, in float32


def working_memory(task: Task, *, reflecting: bool, residual: bool) -> Memory:
    """Return memory for one thread; ``reflecting`` where the subject's reflectance is known, ``residual`` where
    residuals are wanted."""
    return Memory(
        whole=memory_for_block(task, reflecting=reflecting),
        apart=memory_for_block(task, reflecting=reflecting),
        listed=np.zeros(BLOCK, np.uint32),
        places=np.zeros(BLOCK, np.uint32),
        block=empty_result(BLOCK, task.tone.shape[1], half=False, residual=residual),
    )


@FUSED.kept
def solve_rows(
    task: Task, result: Result, half: bool, error: Bytes, misfit: Floats, memory: Memory, weights: Weights,
    first: int, last: int, step: int,
) -> None:  # fmt: skip
    """Solve the rows from ``first`` up to ``last``; no two calls may share rows, and any number may run at once.

    Only every ``step``-th row of the picture is solved. ``error`` (pixel,) or empty takes the predicted error in
    degrees, ``misfit`` (pixel,) or empty the share of a pixel's light that its lights leave unexplained, 0 where
    too few are usable to judge. ``result`` and ``error`` are the bytes of half floats, or of float32, so that one loop,
    compiled once, writes both.
    """
    whole, apart, listed = (_lent_room(memory.whole), _lent_room(memory.apart), lent(memory.listed))
    t = lent_task(task, memory.whole.matrix, memory.whole.per_strength)
    t_apart = lent_task(task, memory.apart.matrix, memory.apart.per_strength)
    out = Result(lent(result.normals), lent(result.albedo), lent(result.valid), lent(result.residual))
    predicted, unexplained = lent(error), lent(misfit)
    w, v = whole.planes, whole.more
    block = Result(
        lent(memory.block.normals), lent(memory.block.albedo), lent(memory.block.valid), lent(memory.block.residual)
    )
    sent, per = lent(task.matrix), lent(task.per_strength)
    distant, lens = t.near.depth.size == 0, t.near.pinhole.size > 0
    for room in (whole, apart):
        find_ways(room, BLOCK)  # through a lens they change
    places = lent(memory.places)
    for row in range(-(-first // step) * step, last, step):
        waiting = 0
        for col in range(0, t.cols, STEP):
            n = min(STEP, t.cols - col)
            start, summed, weighed, odd = row * t.cols + col, False, False, 0
            if t.mask.size and not any_asked(t.mask, row, col, n):
                w[X : X + n], w[Y : Y + n], w[Z : Z + n] = ZERO, ZERO, ZERO
                v[DOUBT : DOUBT + n], v[UNEXPLAINED : UNEXPLAINED + n] = NO_ERROR, ZERO
            else:
                summed, weighed, odd = _solve_block(t, sent, per, weights, whole, listed, row, col, n)
            for k in range(odd):
                places[waiting + k] = start + listed[k]
            put_side_by_side(whole, listed, odd, distant, lens, apart, waiting)
            waiting += odd
            values, m, e = whole.values, whole.measurements, whole.errors
            store_block(t, block, w, values, m, e, 0, n, summed, weighed)
            for i in range(n):
                listed[i] = start + i
            hand_out(block, v, out, predicted, unexplained, half, listed, n)
            if waiting and (waiting >= STEP or col + STEP >= t.cols):
                n = fill_up(apart, waiting, distant, lens, listed)
                _solve_apart(t_apart, sent, per, weights, apart, n)
                values, m, e = apart.values, apart.measurements, apart.errors
                store_block(t_apart, block, apart.planes, values, m, e, 0, n, False, True)
                hand_out(block, apart.more, out, predicted, unexplained, half, places, waiting)
                waiting = 0


@FUSED.inlined
def _lent_room(room: Room) -> Room:
    return Room(
        lent(room.planes), lent(room.more), lent(room.values), lent(room.measurements), lent(room.errors),
        lent(room.matrix), lent(room.per_strength), lent(room.ways), lent(room.matte), lent(room.kept),
    )  # fmt: skip


@FUSED.inlined
def _solve_block(
    task: Task, sent: Floats, per: Floats, weights: Weights, room: Room, listed: Indices, row: int, col: int, n: int
) -> tuple[bool, bool, int]:
    """Leave g in the planes X, Y, Z, all 0 where the normal is not to be trusted, and the error in DOUBT.

    Returned is whether three channels' sums are left as well (``colour_kernel.py``), of what counts in every pixel;
    whether ``errors`` holds weights by which all were solved; and how many pixels are listed because they are to be
    solved apart.
    """
    w, v, m = room.planes, room.more, room.measurements
    distant, modelled = task.near.depth.size == 0, room.ways.size > 0
    summed = _measure(task, room, distant, row, col, n)
    few, known = len(m) == FEW and distant, task.noise[0, 0] > ZERO
    odd, share = n, LIGHTS if known else weights.signal_noise
    if known:
        if not summed:
            solve_plainly(task, w, m, room.errors, n)
        odd = list_unexplained(task, w, m, listed, n)
        odd = n if weights.soft > ZERO else odd  # such a subject's normals are turned though they explain its light
        v[DOUBT : DOUBT + n] = ZERO
    whole = odd > n * MOST_APART
    if whole:
        solve_reweighted(task, sent, per, weights, room, few, n)
    weigh(task, sent, weights, share, whole and modelled, room, few, n)
    predict_error(weights, min(task.lights, LEAST_CHECKED), w, v, n)
    apart = 0 if whole else odd
    if task.mask.size:
        for i in range(n):
            inside = ONE if task.mask[row, col + i] else ZERO
            w[X + i], w[Y + i], w[Z + i] = (w[X + i] * inside, w[Y + i] * inside, w[Z + i] * inside)
        apart = _only_inside(task, listed, apart, row, col)
    return summed and not whole, whole, apart


@FUSED.inlined
def _only_inside(task: Task, listed: Indices, count: int, row: int, col: int) -> int:
    """Leave those of the listed pixels that lie in the mask, and return how many they are."""
    inside = 0
    for k in range(count):
        listed[inside] = listed[k]
        inside += 1 if task.mask[row, col + listed[k]] else 0
    return inside


@FUSED.called
def _solve_apart(task: Task, sent: Floats, per: Floats, weights: Weights, room: Room, n: int) -> None:
    """Solve pixels robustly that plain least squares does not explain."""
    few = len(room.measurements) == FEW and task.near.depth.size == 0
    solve_reweighted(task, sent, per, weights, room, few, n)
    weigh(task, sent, weights, LIGHTS, room.ways.size > 0, room, few, n)
    predict_error(weights, min(task.lights, LEAST_CHECKED), room.planes, room.more, n)


@FUSED.inlined
def _least_lit(task: Task) -> np.float32:
    """What every usable measurement is brighter than, relative to its light, where lights are distant."""
    least = task.dark[0] * at(task.per_strength[0], 0)
    for light in range(1, task.lights):
        least = min(least, task.dark[light] * at(task.per_strength[light], 0))
    return np.float32(least)


@FUSED.inlined
def _measure(task: Task, room: Room, distant: bool, row: int, col: int, n: int) -> bool:
    """Read a block's usable measurements; where all are, plain least squares has solved it, and True is returned."""
    w, values, m = room.planes, room.values, room.measurements
    if not distant:
        place_lights(task.matrix, task.per_strength, task.near, row, col, n)
        fill_sent(task.per_strength, task.lights, room.more, n)
    if task.near.pinhole.size:
        fill_view(task.near.pinhole, row, col, room.more, n)
        find_ways(room, n)
    plain = distant and task.tone.shape[1] == 3 and all_seen(task.seen, row, col, n)
    summed = plain and solve_colours(task, w, values, m, row * task.cols + col, n)
    if summed:
        w[COUNT : COUNT + n], w[LIMIT : LIMIT + n] = np.float32(task.lights), _least_lit(task)
    else:
        read_usable(task, w, values, m, row, col, n, plain)
    return summed
