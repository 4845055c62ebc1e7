"""Several cameras that saw one strobe: how their clocks stand to each other (Wilburn et al. 2004, but by light)."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from psvideo.errors import UsageError
from psvideo.model.arrays import Doubles

Numbering = Literal["marker", "given"]
"""How it is known which flashes are the same: by the plan's marker alone, or with when the clips began roughly."""

STEPS = 8
"""Of the inverse, each of which leaves a ten-thousandth or so of the error: clocks differ by ppm."""


@dataclass(frozen=True, kw_only=True)
class CameraClock:
    """One camera's clock against the first camera's.

    Attributes
    ----------
    clip
        The clip's name.
    first_flash
        The number of this clip's flash 0 among the flashes that the first clip counts; negative: before it.
    offset_s, rate_ppm, drift_ppm_per_s
        A time t on this camera's clock is ``offset_s + t + 1e-6 * (rate_ppm * t + 0.5 * drift_ppm_per_s * t ** 2)`` on
        the first camera's.
    shared
        How many flashes both clips saw, over which this was fitted.
    error_s
        The standard error of a time that is carried over.
    """

    clip: str
    first_flash: int
    offset_s: float
    rate_ppm: float
    drift_ppm_per_s: float
    shared: int
    error_s: float

    def reference_s(self, camera_s: Doubles | np.float64) -> Doubles:
        """Return times on this camera's clock as times on the first camera's, same shape."""
        at_s = np.asarray(camera_s)
        turned: Doubles = self.rate_ppm * at_s + 0.5 * self.drift_ppm_per_s * at_s**2
        return self.offset_s + at_s + 1e-6 * turned

    def camera_s(self, reference_s: Doubles | np.float64) -> Doubles:
        """Return times on the first camera's clock as times on this camera's: the inverse, same shape."""
        since_s: Doubles = np.asarray(reference_s) - self.offset_s
        camera_s = since_s
        for _ in range(STEPS):
            camera_s = since_s - 1e-6 * (self.rate_ppm * camera_s + 0.5 * self.drift_ppm_per_s * camera_s**2)
        return camera_s


@dataclass(frozen=True, kw_only=True)
class CameraClocks:
    """The clocks of several cameras, the first of which is the reference; ``notes`` say what to distrust.

    ``first_instant_s`` is the middle of the reference's first frame: from there on, on its clock, instants that all
    cameras share are counted.
    """

    cameras: tuple[CameraClock, ...]
    numbering: Numbering
    cycle_s: float
    first_instant_s: float
    notes: tuple[str, ...] = field(default=(), compare=False)

    def of(self, clip: str) -> CameraClock:
        """Return the clock of the camera that took a clip. Raises UsageError where these are the clocks of others."""
        found = [camera for camera in self.cameras if camera.clip == clip]
        if len(found) != 1:
            names = ", ".join(camera.clip for camera in self.cameras)
            odd = "are named alike" if found else "are others"
            raise UsageError(
                f"`resync`: the clocks are those of {names}, which {odd}; expected one of this clip, {clip!r}. "
                "Compare all cameras' clips again with psvideo sync, each under a name of its own."
            )
        return found[0]
