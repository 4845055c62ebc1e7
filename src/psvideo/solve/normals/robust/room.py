"""Compiled part of the robust solver: the memory in which a block of pixels is solved, and what its planes hold."""

from typing import NamedTuple

import numpy as np

from psvideo.model.arrays import Floats
from psvideo.solve.normals.loops.blocks import BLOCK, MISSING, PLANES
from psvideo.solve.normals.robust.equations import OUT, PLANES_OF_V, VIEW_X, VIEW_Z
from psvideo.solve.normals.task import Task

# The planes of ``Room.kept``: g as a matte surface would have it and before a step; residuals summed up without the
# model and with it, and what they are shares of; how far the model holds.
MATTE_X, MATTE_Y, MATTE_Z, BEFORE, AFTER, SPREAD, HOLDS, OLD_X, OLD_Y, OLD_Z = (BLOCK * k for k in range(10))
# The unit normal, 1 / |g|, what samples are divided by and shine that is taken off them; the way to the camera.
UNIT_X, UNIT_Y, UNIT_Z, PER_SIZE, GAIN, SHINE = (BLOCK * k for k in range(10, 16))
TO_X, TO_Y, TO_Z, FACING = (BLOCK * k for k in range(16, 20))
KEPT, OF_LIGHT = 20, 4
"""So many planes it has of a block, then so many per light, its gradient and its shine."""


class Room(NamedTuple):
    """What a block of pixels is solved in; planes are BLOCK long."""

    planes: Floats  # those of ``blocks.py``
    more: Floats  # those of ``equations.py``
    values: Floats  # (light * channel, pixel)
    measurements: Floats  # (light, pixel): the channels combined
    errors: Floats  # (light, pixel)
    matrix: Floats  # (light, 3, pixel): what lights send to every pixel
    per_strength: Floats  # (light, pixel)
    ways: Floats  # (light, 6, pixel) where the subject's reflectance is known, else of no light
    matte: Floats  # (light, pixel): measurements without highlights
    kept: Floats  # planes of what the subject's model makes of every pixel, then of every light


def memory_for_block(task: Task, *, reflecting: bool) -> Room:
    """Return memory for one thread; ``reflecting`` where the subject's reflectance is known."""
    lights, channels = task.tone.shape[:2]
    values = np.full((lights * channels, BLOCK), MISSING, np.float32)
    modelled = lights if reflecting else 0
    more = np.ones(PLANES_OF_V * BLOCK, np.float32)
    more[VIEW_X:VIEW_Z] = 0  # a lens that is known changes it with the block
    return Room(
        planes=np.zeros(PLANES * BLOCK, np.float32),
        more=more,
        values=values,
        measurements=values if channels == 1 else np.full((lights, BLOCK), MISSING, np.float32),
        errors=np.full((lights, BLOCK), OUT, np.float32),
        matrix=np.repeat(task.matrix[..., None], BLOCK, axis=-1),  # near lights' change with the block
        per_strength=np.repeat(task.per_strength[:, None], BLOCK, axis=-1),
        ways=np.zeros((modelled, 6, BLOCK), np.float32),
        matte=np.full((modelled, BLOCK), MISSING, np.float32),
        kept=np.zeros(BLOCK * (KEPT + OF_LIGHT * lights) if reflecting else 0, np.float32),
    )
