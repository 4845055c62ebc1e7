"""What normals are solved with, read and checked before a long run begins."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import read_mask
from psvideo.near_surface import NEAR_ITERATIONS, NearSurface, near_surface_of, near_trust
from psvideo.normals.illumination import illumination
from psvideo.pipeline import (
    Take,
    lights_as_planned,
)
from psvideo.rig import Rig
from psvideo.rigfile import read_rig
from psvideo.sequence import check_separable

UNSURE_DEG = 5.0
"""A rig whose own standard error is so large is told of in the report; a guessed one says 20."""


@dataclass(frozen=True, kw_only=True)
class Lighting:
    """What is solved with, read and checked before a long run begins: the rig, for near lights where the surface is
    taken to be, and where to solve."""

    rig_path: Path
    rig: Rig
    condition: float
    near: NearSurface | None = None
    mask: NDArray[np.bool_] | None = None

    @property
    def near_iterations(self) -> int:
        """How often the surface is made anew for near lights; 0 where there are none."""
        return 0 if self.near is None else self.near.iterations

    @property
    def near_notes(self) -> tuple[str, ...]:
        """What normals depend on where lights are near, in whole sentences."""
        return () if self.near is None else (near_trust(self.near),)

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is to be distrusted about the rig itself, in whole sentences."""
        worst = max(self.rig.lights, key=lambda light: light.error_deg or 0.0)
        if (worst.error_deg or 0.0) < UNSURE_DEG:
            return ()
        return (
            f"The rig file itself says that its lights are sure to {worst.error_deg:g} degrees only "
            f"({worst.name!r}): normals are wrong by about as much. Calibrate on a sphere.",
        )

    @property
    def mask_sha256(self) -> str | None:
        """The digest of the mask, None where there is none."""
        return None if self.mask is None else hashlib.sha256(self.mask.tobytes()).hexdigest()


def read_lighting(
    take: Take, rig_path: Path, mask_path: Path | None = None, *, near_iterations: int = NEAR_ITERATIONS
) -> Lighting:
    """Read rig and mask of a take; ``near_iterations`` is how often near lights' surface is made anew.

    Raises PsvideoError where they do not fit the plan, or give no normals.
    """
    clip = take.clip
    check_separable(clip.plan)
    rig = read_rig(rig_path, plan_lights=clip.plan.lights)
    lights = lights_as_planned(rig, clip.plan)
    near = near_surface_of(rig, lights, height_px=clip.height_px, width_px=clip.width_px, iterations=near_iterations)
    lit = illumination(lights, channels=clip.channels, ground=None if near is None else near.ground)
    mask = None if mask_path is None else read_mask(mask_path, width_px=clip.width_px, height_px=clip.height_px)
    return Lighting(rig_path=rig_path, rig=rig, condition=lit.condition, near=near, mask=mask)
