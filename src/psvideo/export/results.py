"""Results as files: one EXR sequence per quantity, ``normals/<clip>_normals.<number>.exr`` and so on."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from psvideo.export.mesh import mesh_name, write_part, write_ply
from psvideo.export.plates import image_channels
from psvideo.export.png import PNG_MAX, encode_normals, write_png16
from psvideo.export.space import Space, placed, placed_points
from psvideo.export.tags import Tags
from psvideo.formats.exr_files import write_exr, write_exr_parts
from psvideo.model.surface import Surface
from psvideo.plates.beauty import Mix
from psvideo.solve.depth import Depth, mesh_of

Preview = Literal["relit", "normals", "plates", "beauty"]
Codec = Literal["vp9", "prores"]
Program = Literal["nuke", "blender", "unreal", "houdini"]
MOVIE_SUFFIXES: dict[Codec, str] = {"vp9": "mp4", "prores": "mov"}
COLOURS = frozenset({"albedo", "beauty"})
"""What is light or colour; everything else is data."""


@dataclass(frozen=True, kw_only=True)
class Delivery:
    """How results are written.

    ``half`` False stores normals as 32-bit floats; ``aovs`` may add "residual", "error", "beauty", "depth" and
    "position", the last two always in 32 bits; ``meshes`` may hold "ply" and "usd". ``plates`` writes the plates that
    were solved from besides, ``mix`` is what the beauty plate is summed with, ``previews`` are movies for eyes, and
    ``program`` is the one that a note on loading is written for.
    """

    space: Space
    half: bool = True
    aovs: tuple[str, ...] = ()
    meshes: tuple[str, ...] = ()
    png16: bool = False
    multipart: bool = False
    plates: bool = False
    mix: Mix = field(default_factory=Mix)
    previews: tuple[Preview, ...] = ()
    codec: Codec = "vp9"
    program: Program | None = None

    @property
    def needs_depth(self) -> bool:
        """Whether normals are to be integrated."""
        return bool(self.meshes) or not {"depth", "position"}.isdisjoint(self.aovs)


def result_name(clip: str, quantity: str, number: int, *, suffix: str = "exr") -> str:
    """Return a result's path below the output folder.

    >>> result_name("take3", "normals", 1001)
    'normals/take3_normals.1001.exr'
    """
    folder = quantity if suffix == "exr" else f"{quantity}_{suffix}16"
    return f"{folder}/{clip}_{quantity}.{number:04d}.{suffix}"


def bundle_name(clip: str, number: int) -> str:
    """Return the path of one instant's multipart file below the output folder."""
    return f"{clip}.{number:04d}.exr"


def is_written(folder: Path, clip: str, number: int, delivery: Delivery) -> bool:
    """Return whether all files of one instant's surface are there (each appears whole)."""
    names = [result_name(clip, quantity, number) for quantity in ("normals", "albedo", "valid", *delivery.aovs)]
    if delivery.multipart:
        names.append(bundle_name(clip, number))
    if delivery.png16:
        names += [result_name(clip, quantity, number, suffix="png") for quantity in ("normals", "valid")]
    names += [mesh_file(clip, number, kind) for kind in delivery.meshes]
    return all((folder / name).is_file() for name in names)


def mesh_file(clip: str, number: int, kind: str) -> str:
    """Return the path below the output folder of one instant's mesh; for USD it is kept there until the end only."""
    return mesh_name(clip, number) if kind == "ply" else mesh_name(clip, number, suffix="part.npz")


def write_surface(
    folder: Path,
    clip: str,
    number: int,
    time_s: float,
    surface: Surface,
    *,
    delivery: Delivery,
    tags: Tags,
    depth: Callable[[], Depth] | None = None,
    beauty: NDArray[np.floating] | None = None,
) -> None:
    """Write one instant: normals as signed unit vectors, linear albedo, validity, and the AOVs and meshes asked for.

    ``depth``, which integrates the normals, is needed where ``delivery.needs_depth``, ``beauty`` where it is an AOV.
    """
    normals = placed(surface.normals, delivery.space)
    planes = {"normals": image_channels(normals), **_planes(surface, beauty, delivery)}
    if delivery.needs_depth:
        if depth is None:
            raise ValueError("depth is to be written and was not integrated")
        shape = depth()
        planes |= _shape_planes(shape, delivery)
        _write_meshes(folder, clip, number, surface, shape, delivery)
    world = delivery.space.attributes()
    attributes = {name: tags.attributes(time_s=time_s, data=name not in COLOURS) | world for name in planes}
    for quantity, channels in planes.items():
        write_exr(
            folder / result_name(clip, quantity, number),
            channels,
            half=is_half(quantity, delivery),
            attributes=attributes[quantity],
            fps=tags.fps,
            time_code=tags.time_code(time_s),
        )
    if delivery.multipart:
        halves = {name: is_half(name, delivery) for name in planes}
        write_exr_parts(
            folder / bundle_name(clip, number),
            planes,
            half=halves,
            attributes=attributes,
            fps=tags.fps,
            time_code=tags.time_code(time_s),
        )
    if delivery.png16:
        texts = {key: str(value) for key, value in attributes["normals"].items()}
        write_png16(folder / result_name(clip, "normals", number, suffix="png"), encode_normals(normals), texts=texts)
        mask = np.where(surface.valid, np.uint16(PNG_MAX), np.uint16(0))
        write_png16(folder / result_name(clip, "valid", number, suffix="png"), mask, texts=texts)


def _planes(
    surface: Surface, beauty: NDArray[np.floating] | None, delivery: Delivery
) -> dict[str, dict[str, NDArray[np.floating]]]:
    """Return the channels of what is written but normals and shape."""
    planes = {
        "albedo": image_channels(_three_channels(surface.albedo)),
        "valid": {"Y": surface.valid.astype(np.float32)},
    }
    asked = {"residual": surface.residual, "error": surface.error_deg, "beauty": beauty}
    for name in (name for name in asked if name in delivery.aovs):
        image = asked[name]
        if image is None:
            raise ValueError(f"{name} is to be written and was not made")
        planes[name] = image_channels(_three_channels(image)) if name == "beauty" else {"Y": image}
    return planes


def is_half(quantity: str, delivery: Delivery) -> bool:
    """Return whether a quantity is stored in 16 bits: 11 binary digits are too few for a place in space."""
    return quantity not in ("depth", "position") and (delivery.half or quantity != "normals")


def _shape_planes(depth: Depth, delivery: Delivery) -> dict[str, dict[str, NDArray[np.floating]]]:
    planes: dict[str, dict[str, NDArray[np.floating]]] = {}
    if "depth" in delivery.aovs:
        planes["depth"] = {"Y": depth.depth}
    if "position" in delivery.aovs:
        points = depth.view.points(depth.depth).astype(np.float32)
        planes["position"] = image_channels(placed_points(points, delivery.space, depth.depth > 0))
    return planes


def _write_meshes(folder: Path, clip: str, number: int, surface: Surface, depth: Depth, delivery: Delivery) -> None:
    if not delivery.meshes:
        return
    mesh = mesh_of(surface, depth)
    for kind in delivery.meshes:
        write = write_ply if kind == "ply" else write_part
        write(folder / mesh_file(clip, number, kind), mesh, delivery.space)


def _three_channels(albedo: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the albedo with three channels: grey footage gives three alike."""
    return albedo if albedo.ndim == 3 else np.broadcast_to(albedo[..., None], (*albedo.shape, 3))
