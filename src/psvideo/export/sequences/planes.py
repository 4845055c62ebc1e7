"""The planes of an instant's files: for each quantity of the table, its picture, and its channels by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from psvideo.export.space import Space, placed, placed_points
from psvideo.model.arrays import Doubles
from psvideo.model.choices import Program
from psvideo.model.quantities import QUANTITIES
from psvideo.model.surface import Surface
from psvideo.solve.depth import Depth
from psvideo.solve.passes.asked_passes import Passes

Image = NDArray[np.floating]
Planes = dict[str, Image]


@dataclass(frozen=True, kw_only=True)
class InstantPictures:
    """What an instant's files are written from; ``beauty``, ``depth``, ``age_s`` and what ``passes`` hold are None
    where nothing asks for them. ``age_s``, of rows or of pixels, is how far in time from the instant what a row shows
    was lit. ``motion`` makes, (row, col, 4), in pixels, x right and y up, where every pixel is one delivered frame
    later, and one earlier, seen from where it is: it is the largest of all, and there only while its file is written.
    It is named and signed as ``program`` wants it."""

    surface: Surface
    space: Space
    beauty: Image | None = None
    depth: Depth | None = None
    age_s: Doubles | None = None
    passes: Passes = field(default_factory=Passes)
    motion: Callable[[], Image] | None = None
    program: Program | None = None

    @property
    def age(self) -> Image | None:
        """The age of every pixel in seconds, (row, col)."""
        if self.age_s is None:
            return None
        age_s = self.age_s if self.age_s.ndim == 2 else self.age_s[:, None]
        return np.broadcast_to(age_s.astype(np.float32), self.surface.valid.shape)

    @property
    def position(self) -> Image | None:
        """The place of every pixel's surface point (row, col, 3) in the delivered space; 0 where there is none."""
        if self.depth is None:
            return None
        points = self.depth.view.points(self.depth.depth).astype(np.float32)
        return placed_points(points, self.space, self.depth.valid)


def ones_of(mask: NDArray[np.bool_]) -> NDArray[np.float16]:
    """Return a mask as half floats, 1 where it is true: their bits, which takes no conversion."""
    one = np.float16(1).view(np.uint16)
    return (np.ascontiguousarray(mask).view(np.uint8) * one).view(np.float16)


def _as_floats(image: NDArray[np.integer] | None) -> Image | None:
    return None if image is None else image.astype(np.float32)


PICTURES: Mapping[str, Callable[[InstantPictures], Image | None]] = {
    "normals": lambda pictures: placed(pictures.surface.normals, pictures.space),
    "albedo": lambda pictures: pictures.surface.albedo,
    "valid": lambda pictures: ones_of(pictures.surface.valid),
    "residual": lambda pictures: pictures.surface.residual,
    "error": lambda pictures: pictures.surface.error_deg,
    "source": lambda pictures: _as_floats(pictures.surface.source),
    "beauty": lambda pictures: pictures.beauty,
    "depth": lambda pictures: None if pictures.depth is None else pictures.depth.depth,
    "position": lambda pictures: pictures.position,
    "age": lambda pictures: pictures.age,
    "reach": lambda pictures: _as_floats(pictures.passes.reach),
    "specular": lambda pictures: pictures.passes.specular,
    "alpha": lambda pictures: pictures.passes.alpha,
    "motion": lambda pictures: None if pictures.motion is None else pictures.motion(),
}
"""What computes the picture of each quantity that belongs to an instant; None where it was not made."""


BLENDER_VECTOR = (("X", 2, 1.0), ("Y", 3, 1.0), ("Z", 0, -1.0), ("W", 1, -1.0))
"""Of Blender's vector pass: channel, place in ``InstantPictures.motion``, sign. X and Y lead from here to where it was,
Z and W from where it will be to here (Cycles, primitive_motion_vector)."""


def planes_of(name: str, pictures: InstantPictures) -> Planes:
    """Return a quantity's channels, each (row, col), by their names in a file; grey fills three channels alike.

    Raises ValueError where the picture was not made.
    """
    image = PICTURES[name](pictures)
    if image is None:
        raise ValueError(f"{name} is to be written and was not made")
    if name == "motion" and pictures.program == "blender":
        return {f"psvideo.Vector.{name}": _signed(image[..., place], sign) for name, place, sign in BLENDER_VECTOR}
    channels = QUANTITIES[name].channels
    return {channel: image[..., place] if image.ndim == 3 else image for place, channel in enumerate(channels)}


def _signed(plane: Image, sign: float) -> Image:
    return plane if sign > 0 else -plane


def bundled(name: str, pictures: InstantPictures) -> Planes:
    """Return a quantity's channels in a multipart file: beauty has A too, the matte where it was made, else valid."""
    planes = planes_of(name, pictures)
    if name == "beauty":
        planes["A"] = ones_of(pictures.surface.valid) if pictures.passes.alpha is None else pictures.passes.alpha
    return planes
