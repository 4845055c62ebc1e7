"""What a solver hands over beside normals, albedo and validity, and where that lies."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class AskedSurface:
    """``half`` floats instead of float32; the ``residual``; the predicted standard ``error``, of solvers that predict
    one. ``spare`` is a folder in whose files large pictures are worked on; without one they lie in memory."""

    half: bool = False
    residual: bool = True
    error: bool = True
    spare: Path | None = None
