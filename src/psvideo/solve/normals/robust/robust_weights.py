"""Compiled part of the robust solver: from a trimmed start, by weights that follow what is left over (IRLS).

A pixel's result does not depend on which pixels lie beside it.
"""

import numpy as np

from psvideo.compute.compiled import FUSED
from psvideo.compute.memory import flattened
from psvideo.model.arrays import Floats
from psvideo.solve.normals.robust.any_lights import add_start, add_weighted, choose_start, fill_weights, find_scale
from psvideo.solve.normals.robust.equations import solve_equations
from psvideo.solve.normals.robust.few_lights import begin_few, reweigh_few
from psvideo.solve.normals.robust.odd_of_four import TWO, drop_odd_of_four
from psvideo.solve.normals.robust.reflecting import reflect, weigh_reflecting
from psvideo.solve.normals.robust.room import Room
from psvideo.solve.normals.robust.weighing import Weights
from psvideo.solve.normals.task import Task

SOUND_SQUARED = np.float32(1e4)  # while weights change, the last solution is kept where they leave a worse condition


@FUSED.called
def solve_reweighted(task: Task, sent: Floats, per: Floats, weights: Weights, room: Room, few: bool, n: int) -> None:
    """Leave g in the planes X, Y, Z, and in DOUBT what four measurements say against each other.

    sent, per: the lights of all pixels where they are ``few``.
    """
    w, v, m, e = room.planes, room.more, room.measurements, room.errors
    if few:
        begin_few(sent, per, weights.darkest, weights.brightest, w, flattened(m), n)
    else:
        choose_start(task, weights, w, v, m, e, n)
        add_start(task, w, v, m, e, n)
    solve_equations(w, n, SOUND_SQUARED, False)
    drop_odd_of_four(task, weights, w, v, m, e, n)
    for _ in range(weights.rounds):
        _reweigh(task, sent, weights.noise, weights.signal_noise, weights.tukey, weights.width, False, few, room, n)
        solve_equations(w, n, SOUND_SQUARED, True)


@FUSED.called
def weigh(
    task: Task, sent: Floats, weights: Weights, share: np.float32, modelled: bool, room: Room, few: bool, n: int
) -> None:
    """SCALE, the weighted normal equations of solved pixels, and these weights in ``errors``; before, where they are to
    be ``modelled``, they are solved again under the subject's model, and their samples left without what that adds.

    share: of a pixel's light, what is left over at least.
    """
    if modelled:
        reflect(room, task.lights, weights, n)
        weigh_reflecting(room, task.lights, weights, share, n)
    else:
        _reweigh(task, sent, weights.least, share, False, TWO, True, few, room, n)
        if few:
            fill_weights(task.matrix, TWO, room.planes, room.more, room.measurements, room.errors, n)


@FUSED.inlined
def _reweigh(
    task: Task, sent: Floats, noise: np.float32, share: np.float32, tukey: bool, width: np.float32, last: bool,
    few: bool, room: Room, n: int,
) -> None:  # fmt: skip
    """SCALE and the normal equations, every measurement weighed by how well the last solution explains it."""
    w, v, m, e = room.planes, room.more, room.measurements, room.errors
    if few:
        reweigh_few(sent, tukey, width, noise, share, w, v, flattened(m), n)
    else:
        find_scale(task.matrix, noise, share, w, v, m, e, n)
        add_weighted(task.matrix, tukey, width, last, w, v, m, e, n)
