"""Several cameras that saw one strobe: how their clocks stand to each other (Wilburn et al. 2004, but by light)."""

from dataclasses import dataclass, field
from typing import Literal

from psvideo.model.camera import FloatArray

Numbering = Literal["marker", "given"]
"""How it is known which flashes are the same: by the plan's marker alone, or with when the clips began roughly."""


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

    def reference_s(self, camera_s: FloatArray) -> FloatArray:
        """Return times on this camera's clock as times on the first camera's, same shape."""
        turned: FloatArray = self.rate_ppm * camera_s + 0.5 * self.drift_ppm_per_s * camera_s**2
        return self.offset_s + camera_s + 1e-6 * turned


@dataclass(frozen=True, kw_only=True)
class CameraClocks:
    """The clocks of several cameras, the first of which is the reference; ``notes`` say what to distrust."""

    cameras: tuple[CameraClock, ...]
    numbering: Numbering
    cycle_s: float
    notes: tuple[str, ...] = field(default=(), compare=False)
