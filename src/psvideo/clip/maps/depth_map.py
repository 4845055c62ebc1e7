"""Depth that is known from elsewhere: one picture, or one per instant, of distances along the camera's axis.

A depth camera, a laser scan, a renderer or an earlier run of this program may have written it. A number that is no
distance (0, negative, infinite, not a number, a PNG's largest code) says that nothing is known there.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decode.decoders import decode, guarded
from psvideo.clip.decode.exr import decode_channels
from psvideo.clip.folder import KINDS, find_sequence
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Floats
from psvideo.model.irradiance.ground import FARTHEST_M

DEPTH_NAMES = ("Z", "depth", "distance", "Y", "V", "L", "R")
"""Channels of an EXR that may hold depth, the likeliest first; R only where the picture is grey."""
BACKGROUND = 1e6
"""Renderers write a number beyond this where they saw nothing."""
NEAREST_M = 0.01
"""Between this and FARTHEST_M lies the middle of any scene that near lights can light."""
MILLIMETRE_M = 1e-3


@dataclass(frozen=True, kw_only=True)
class DepthMaps:
    """Known depth of a clip: a ``still``, (row, col) float32 in metres, 0 where unknown, or a file per instant."""

    path: Path
    width_px: int
    height_px: int
    metres_per_unit: float | None
    still: Floats | None = None
    files: Mapping[int, Path] = field(default_factory=dict)

    def at(self, number: int) -> Floats:
        """Return the depth of the instant with this number; raises PsvideoError where there is none."""
        if self.still is not None:
            return self.still
        if number not in self.files:
            raise PsvideoError(
                f"{self.path}: has no depth for instant {number}; its files are numbered {min(self.files)} to "
                f"{max(self.files)}. Expected one per result, numbered as the results are (see `start_number`), or a "
                "single file that holds for all."
            )
        return _read(self.files[number], self)

    @property
    def first(self) -> Floats:
        """The still, or the first file's depth."""
        return self.at(min(self.files, default=0))

    @property
    def identity(self) -> tuple[object, ...]:
        """What distinguishes these files from others, without reading them again."""
        files = tuple(self.files.values()) or (self.path,)
        states = [file.stat() for file in files]
        return (
            self.metres_per_unit,
            *((str(f.resolve()), s.st_size, s.st_mtime_ns) for f, s in zip(files, states, strict=True)),
        )


def open_depth(path: Path, *, width_px: int, height_px: int, metres_per_unit: float | None = None) -> DepthMaps:
    """Return the depth in a file, or in a folder of numbered ones; the first is read and checked.

    ``metres_per_unit`` left out: floating point is metres, whole numbers are millimetres. Raises PsvideoError where
    a file cannot be read, has another size than the frames, knows nothing, or cannot be in this unit.
    """
    maps = DepthMaps(path=path, width_px=width_px, height_px=height_px, metres_per_unit=metres_per_unit)
    if path.is_dir():
        sequence = find_sequence(path)
        files = dict(zip(sequence.numbers, sequence.files, strict=True))
        _read(sequence.files[0], maps)
        return replace(maps, files=files)
    return replace(maps, still=_read(path, maps))


def _read(path: Path, maps: DepthMaps) -> Floats:
    """Read one picture in metres."""
    kind = KINDS.get(path.suffix.lower())
    if kind not in ("exr", "png", "tiff"):
        raise PsvideoError(f"{path}: is not a picture that can hold depth; expected .exr, .tif or a 16-bit .png.")
    if not path.is_file():
        raise PsvideoError(f"{path}: there is no such depth file. Check the name.")
    codes = guarded(_decode_exr, path) if kind == "exr" else decode(kind, path).codes
    if codes.shape[:2] != (maps.height_px, maps.width_px):
        raise PsvideoError(
            f"{path}: the depth is {codes.shape[1]} x {codes.shape[0]} pixels, and the frames are {maps.width_px} x "
            f"{maps.height_px}. Render or resample it through the same lens and crop as the clip."
        )
    if codes.ndim == 3:
        raise PsvideoError(f"{path}: is a picture in colour; expected one channel of distances, in metres (EXR).")
    whole = np.issubdtype(codes.dtype, np.integer)
    if codes.dtype == np.uint8:
        raise PsvideoError(f"{path}: has 8 bits, too few for depth. Expected EXR in metres, or 16 bits in millimetres.")
    none = codes == np.iinfo(codes.dtype).max if whole else ~(np.abs(codes) < BACKGROUND)
    values = np.where(none | ~(codes > 0), 0, codes).astype(np.float32)
    scale = maps.metres_per_unit or (MILLIMETRE_M if whole else 1.0)
    if not values.any():
        sign = (
            " Negative ones are there: expected distances, which count up from the lens." if (codes < 0).any() else ""
        )
        raise PsvideoError(f"{path}: holds no depth above 0 in any pixel.{sign}")
    middle_m = float(np.median(values[values > 0])) * scale
    if not NEAREST_M < middle_m < FARTHEST_M:
        raise PsvideoError(
            f"{path}: its median depth would be {middle_m:.4g} m, which cannot be meant. Say how many metres one unit "
            "of the file is: `depth_scale=0.001` for millimetres, 0.01 for centimetres."
        )
    return values * np.float32(scale)


def _decode_exr(path: Path) -> NDArray[np.floating]:
    """Decode the channel that holds depth."""
    grey = decode_channels(path, lambda found: _depth_channel(path, found)).codes.astype(np.float32, copy=False)
    if grey.ndim == 3:
        alike = bool((grey[..., 0] == grey[..., 1]).all() and (grey[..., 0] == grey[..., 2]).all())
        return grey[..., 0] if alike else grey
    return grey


def _depth_channel(path: Path, parts: list[list[str]]) -> tuple[int, tuple[str, ...]]:
    """Choose Z before Y and their like, but no Z that is one of the three numbers of a position or a normal."""
    free = [(part, name) for part, found in enumerate(parts) for name in _lone(found)]
    for wanted in DEPTH_NAMES:
        these = [(part, name) for part, name in free if name.rpartition(".")[2].lower() == wanted.lower()]
        if len(these) == 1:
            part, name = these[0]
            siblings = tuple(f"{name[:-1]}{other}" for other in "RGB")
            return part, siblings if wanted == "R" and set(siblings) <= set(parts[part]) else (name,)
        if these:
            break
    found = ", ".join(sorted(name for part in parts for name in part))
    raise PsvideoError(
        f"{path}: it is not clear which channel is depth (channels {found}). Expected one named Z, "
        "or a picture of one channel. Write such a file from the layer that is meant."
    )


def _lone(found: list[str]) -> list[str]:
    """Return the names that are of no vector."""
    vectors = {name.rpartition(".")[0] for name in found if name.rpartition(".")[2].upper() == "X"}
    return [name for name in found if name.rpartition(".")[0] not in vectors]
