"""How a camera's view ties depth to normals: orthographic, or the perspective of a pinhole.

Both cases become one equation per pixel and direction, ``facing * (step to the neighbour) = slope``, in a *height* that
a least-squares solver takes as it is (X. Cao et al., Bilateral Normal Integration, ECCV 2022, section 3, after J.-D.
Durou's logarithm of depth). Orthographic: height is depth in pixels. Perspective: height is focal length * log(depth),
so a step is a slope in pixels here as well, and a shift of the height is a scale of the depth.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.model.rig import Rig

Box = tuple[slice, slice]
"""A rectangle of a picture: its rows, its columns."""
LEAST_FACING = 0.1
"""Cosine (84 degrees) beyond which a surface is taken to turn away no further: there a pixel mixes near and far."""


@dataclass(frozen=True, kw_only=True)
class View:
    """The camera's view: focal lengths (x, y) and principal point (col, row) in pixels; both None: orthographic."""

    focal_px: tuple[float, float] | None = None
    principal_px: tuple[float, float] | None = None

    @property
    def perspective(self) -> bool:
        """Whether the view is a pinhole's."""
        return self.focal_px is not None

    def middle_px(self, rows: int, cols: int) -> tuple[float, float]:
        """Return the principal point (col, row): where nobody said it, the middle of the picture."""
        return self.principal_px or ((cols - 1) / 2, (rows - 1) / 2)

    def thinned(self, step: int, shape: tuple[int, ...]) -> "View":
        """Return the view of every ``step``-th row and column of a picture of this shape."""
        if self.focal_px is None or step == 1:
            return self
        x, y = (middle / step for middle in self.middle_px(*shape))
        return View(focal_px=(self.focal_px[0] / step, self.focal_px[1] / step), principal_px=(x, y))

    def rays(self, rows: int, cols: int) -> tuple[Doubles, Doubles]:
        """Return x, shape (col,), and y, shape (row, 1), of the ray (x, y, -1) through every pixel's centre.

        Orthographic: all rays are parallel to the axis, and both are 0.
        """
        if self.focal_px is None:
            return np.zeros(cols), np.zeros((rows, 1))
        centre = self.middle_px(rows, cols)
        x: Doubles = (np.arange(cols, dtype=np.float64) - centre[0]) / self.focal_px[0]
        y: Doubles = -(np.arange(rows, dtype=np.float64) - centre[1])[:, None] / self.focal_px[1]
        return x, y

    def towards_camera(self, at: tuple[NDArray[np.intp], NDArray[np.intp]], rows: int, cols: int) -> Doubles:
        """Return unit vectors (point, 3) to the camera from what is seen at rows and columns of a picture."""
        x, y = self.rays(rows, cols)
        towards = np.stack([-x[at[1]], -y[at[0], 0], np.ones(len(at[0]))], axis=-1)
        unit: Doubles = towards / np.linalg.norm(towards, axis=-1, keepdims=True)
        return unit

    def points(self, depth: NDArray[np.floating]) -> Doubles:
        """Return the points (row, col, 3) in the camera frame for depths along the axis; (0, 0, 0) where depth is 0.

        Orthographic: x and y are in the unit of the depth, of which the picture is one wide, from its middle.
        """
        rows, cols = depth.shape
        points = np.empty((rows, cols, 3))
        if self.focal_px is None:
            points[..., 0] = (np.arange(cols) - (cols - 1) / 2) / cols
            points[..., 1] = -(np.arange(rows)[:, None] - (rows - 1) / 2) / cols
        else:
            x, y = self.rays(rows, cols)
            points[..., 0], points[..., 1] = x * depth, y * depth
        points[..., 2] = -depth
        points[depth == 0] = 0
        return points


def view_of(rig: Rig) -> View:
    """Return the rig's view: perspective where it gives the focal length."""
    return View(focal_px=rig.focal_px, principal_px=rig.principal_px)


class Slopes(NamedTuple):
    """What normals say of the height: ``facing * d height / d col = across``, ``facing * d height / d row = down``.

    All of shape (row, col), about 1 at most. ``facing`` is the cosine towards the camera times the ray's length;
    0 with the others where not valid. ``aspect`` is what the row direction's facing is times the col direction's.
    """

    facing: NDArray[np.floating]
    across: NDArray[np.floating]
    down: NDArray[np.floating]
    aspect: float | np.float32 = 1.0


def slopes_of(
    normals: NDArray[np.floating], valid: NDArray[np.bool_], view: View, box: Box = (slice(None), slice(None))
) -> Slopes:
    """Return the slopes of a surface, or of a rectangle of it, from its normals (row, col, 3) in the camera frame.

    They are as exact as the normals, but for half floats, of which 32 bits are made.
    """
    shown, exact = valid[box], np.result_type(normals.dtype, np.float32)
    nx, ny, facing = (np.where(shown, normals[..., axis][box], 0).astype(exact) for axis in range(3))
    if view.perspective:
        x, y = (rays.astype(exact) for rays in view.rays(*valid.shape))
        facing -= x[box[1]] * nx
        facing -= y[box[0]] * ny
    np.maximum(facing, LEAST_FACING, out=facing)
    facing *= shown
    aspect = 1.0 if view.focal_px is None else view.focal_px[1] / view.focal_px[0]
    return Slopes(facing=facing, across=nx, down=np.negative(ny, out=ny), aspect=aspect)
