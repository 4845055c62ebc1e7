"""Light where lamps do not reach, how much farther noise spreads there, and what normals leave of plates that are
unsure, looked for while a solver has the rows: reading plates again would cost as much."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from psvideo.model.arrays import Floats
from psvideo.model.surface import Reflectance
from psvideo.solve.normals.bands import ShownPlates
from psvideo.solve.normals.evidence import Evidence, Indirect, Left
from psvideo.solve.normals.light_sigmas import combined_noise, with_noise
from psvideo.solve.normals.loops.blocks import working_memory
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.result import Result
from psvideo.solve.normals.task import Task, Work, task
from psvideo.solve.normals.trust.thin_surface import ThinSurface

OF_MOTION = np.float32(2)
"""Light up to so many times what is unsure of a plate may be of motion."""


@dataclass(frozen=True, kw_only=True)
class IndirectLook:
    """What is looked at of rows that were just solved: every ``step``-th, under the lights as they are (``given``).
    ``soft``: the share of light that the subject lets through (``Reflectance``)."""

    given: Task
    rows: int
    step: int
    found: Indirect
    left: Left
    soft: float = 0.0

    @classmethod
    def of(cls, one: Evidence, noise: PlateNoise) -> "IndirectLook":
        """Begin with a round, whose plates hold this noise."""
        samples = ShownPlates.of(one.plates).as_floats().samples
        rows, cols = samples[0].shape[:2]
        step = one.step_of((rows, cols))
        shape = -(-rows // step), -(-cols // step)
        found = Indirect(np.zeros(shape, np.float32), np.zeros(shape, np.float32), np.ones(shape, np.float32))
        left = Left(*np.zeros((2, *((0, 0) if one.unsure is None else shape)), np.float32))
        given = task(samples, one.lit, one.seen, one.mask, one.usable, one.black_level, one.scale)
        given = with_noise(given, one.lit, combined_noise(noise, one.lit))
        return cls(given=given, rows=rows, step=step, found=found, left=left)

    def memory(self) -> Work:
        """Return room for one thread."""
        return working_memory(self.given)

    def knowing(self, reflectance: Reflectance | None) -> "IndirectLook":
        """Return the same, where it is known what the subject reflects beyond n . l."""
        return self if reflectance is None else replace(self, soft=reflectance.soft)

    def look(self, shown: Task, result: Result, work: Work, first: int, last: int) -> None:
        """Look at solved rows, whose samples lie where the solver's task says."""
        from psvideo.solve.normals.trust.indirect_kernel import indirect_rows

        shape = (-1, self.rows, self.given.cols)
        planes, albedo = result.normals.reshape(shape), result.albedo.reshape(shape)
        given = self.given._replace(plates=shown.plates[: len(self.given.plates)], like=shown.like)
        soft = np.float32(self.soft)
        indirect_rows(given, work, planes, albedo, self.found, self.left, soft, first, last, self.step)


def not_of_motion(points: ThinSurface, one: Evidence, sums: Floats) -> Floats:
    """Return what reaches points from lamps that do not, ``Indirect.sums``, less what motion may have made of it: the
    blend of a face before and after it turned away from a lamp shows light there that came by way of no surface."""
    from psvideo.solve.normals.trust.indirect_kernel import FACING

    if one.unsure is None or not one.moved:
        return sums
    size, off = np.maximum(points.brightness, np.float32(1e-6)), np.zeros_like(sums)
    strengths = one.lit.intensities.mean(axis=1).astype(np.float32)
    for toward, strength, plane in zip(one.lit.directions.astype(np.float32), strengths, one.unsure, strict=True):
        unsure = cv2.resize(plane, off.shape[::-1], interpolation=cv2.INTER_LINEAR) / (size * strength)
        passes_by = np.tensordot(toward, points.planes, 1) <= FACING
        off += np.minimum(OF_MOTION * unsure, 1) * passes_by
    return np.asarray(np.minimum(sums, np.maximum(sums - off, 0)), np.float32)
