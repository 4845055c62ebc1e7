"""A ball whose normals are known exactly, delivered in every kind of file: what outside programs are tried on."""

from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

from psvideo.export.sequences.result_files import Delivery, write_surface
from psvideo.export.sequences.tags import Tags
from psvideo.export.space import Space
from psvideo.model.quantities import Aov
from psvideo.model.surface import Surface
from psvideo.solve.depth import Depth, View

SIZE = 64
NUMBERS = (1001, 1002, 1003)
FPS = Fraction(24000, 1001)
TAGS = Tags(fps=FPS, colour="lin_rec709_scene", plan_sha256="ab" * 32)


def ball(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return normals (row, col, 3) and validity (row, col) of a ball that is smaller in every number."""
    row, col = np.mgrid[:SIZE, :SIZE]
    radius = SIZE * (0.45 - 0.05 * (number - NUMBERS[0]))
    x, y = (col - (SIZE - 1) / 2) / radius, -(row - (SIZE - 1) / 2) / radius
    inside = x**2 + y**2 < 0.9
    z = np.sqrt(np.maximum(1 - x**2 - y**2, 0))
    return (np.stack([x, y, z], axis=-1) * inside[..., None]).astype(np.float32), inside


def deliver(folder: Path, space: Space, *, aovs: tuple[Aov, ...] = ("residual", "depth", "position", "beauty")) -> Path:
    """Write the ball's sequence with everything that a run can write of an instant."""
    delivery = Delivery(space=space, png16=True, multipart=True, aovs=aovs)
    for number in NUMBERS:
        normals, valid = ball(number)
        albedo = np.repeat(valid[..., None] * np.float32(0.5), 3, axis=-1)
        surface = Surface(normals=normals, albedo=albedo, valid=valid, residual=0.01 * albedo[..., 0])
        depth = partial(_depth, normals, valid)
        at = (folder, "ball", number, 0.125 * number)
        write_surface(*at, surface, delivery=delivery, tags=TAGS, depth=depth, beauty=2 * albedo)
    return folder


def _depth(normals: np.ndarray, valid: np.ndarray) -> Depth:
    """Return the ball's depth, two metres away in its middle."""
    depth = np.where(valid, 3 - normals[..., 2], 0).astype(np.float32)
    none = np.zeros_like(valid)
    return Depth(depth=depth, cut_east=none, cut_south=none, parts=1, metric=True, view=View())
