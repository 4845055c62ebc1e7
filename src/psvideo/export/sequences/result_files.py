"""Results as files: one EXR sequence per quantity, ``normals/<clip>_normals.<number>.exr`` and so on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.export.mesh_files import mesh_name, write_part, write_ply
from psvideo.export.sequences.planes import InstantPictures, bundled, planes_of
from psvideo.export.sequences.png_maps import PNG_MAX, encode_normals, write_png16
from psvideo.export.sequences.tags import Tags
from psvideo.export.space import Space
from psvideo.formats.exr_files import write_exr, write_exr_parts
from psvideo.model.choices import USUAL_COMPRESSION, Codec, Compression, MovieCodec, Preview, Program
from psvideo.model.quantities import ALWAYS, AOVS, QUANTITIES, SOURCES, Aov, is_half
from psvideo.model.surface import Surface
from psvideo.plates.beauty import Mix
from psvideo.solve.depth import Depth, mesh_of
from psvideo.solve.passes.asked_passes import Passes

MOVIE_SUFFIXES: dict[Codec, str] = {"vp9": "mp4", "prores": "mov"}


@dataclass(frozen=True, kw_only=True)
class Delivery:
    """How results are written.

    ``half`` False stores normals as 32-bit floats; ``aovs`` are written as well; ``meshes`` may hold "ply" and "usd".
    ``plates`` also writes the plates that were solved from, ``mix`` is what the beauty plate is summed with,
    ``previews`` are movies for eyes, and ``program`` is the one that a note on loading is written for.
    """

    space: Space
    half: bool = True
    aovs: tuple[Aov, ...] = ()
    meshes: tuple[str, ...] = ()
    png16: bool = False
    multipart: bool = False
    plates: bool = False
    mix: Mix = field(default_factory=Mix)
    previews: tuple[Preview, ...] = ()
    codec: MovieCodec = "both"
    program: Program | None = None
    compression: Compression = USUAL_COMPRESSION

    @property
    def needs_depth(self) -> bool:
        """Whether normals are to be integrated."""
        return bool(self.meshes) or any(QUANTITIES[name].of == "depth" for name in self.aovs)

    @property
    def bundle(self) -> tuple[str, ...]:
        """The parts of a multipart file in order: the sum of the plates first, which viewers show."""
        first = [name for name in self.quantities if name == "beauty"]
        return (*first, *(name for name in self.quantities if name != "beauty"))

    @property
    def quantities(self) -> tuple[str, ...]:
        """The names of what is written of every instant: what the solver gives, then the plates' sum, then shape."""
        wanted = (*ALWAYS, *(name for name in AOVS if name in self.aovs))
        return tuple(sorted(wanted, key=lambda name: SOURCES.index(QUANTITIES[name].of)))


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
    names = [result_name(clip, quantity, number) for quantity in delivery.quantities]
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
    age_s: NDArray[np.float64] | None = None,
    passes: Passes | None = None,
    motion: Callable[[], NDArray[np.floating]] | None = None,
) -> None:
    """Write one instant: normals as signed unit vectors, linear albedo, validity, and the AOVs and meshes asked for.

    ``depth``, which integrates the normals, is needed where ``delivery.needs_depth``, ``beauty`` and ``motion``, which
    makes the vectors, where they are AOVs.
    """
    shape = _integrated(depth) if delivery.needs_depth else None
    if shape is not None:
        _write_meshes(folder, clip, number, surface, shape, delivery)
    pictures = InstantPictures(
        surface=surface,
        space=delivery.space,
        beauty=beauty,
        depth=shape,
        age_s=age_s,
        passes=passes or Passes(),
        motion=motion,
        program=delivery.program,
    )
    _write_pictures(folder, clip, number, time_s, pictures, delivery=delivery, tags=tags)


def _integrated(depth: Callable[[], Depth] | None) -> Depth:
    if depth is None:
        raise ValueError("depth is to be written and was not integrated")
    return depth()


def _write_pictures(
    folder: Path, clip: str, number: int, time_s: float, pictures: InstantPictures, *, delivery: Delivery, tags: Tags
) -> None:
    """Write an instant's picture of each sequence, and the bundle and maps that were asked for beside them."""
    halves = {name: is_half(name, asked=delivery.half) for name in delivery.quantities}
    world = delivery.space.attributes()
    attributes = {name: tags.attributes(time_s=time_s, data=not QUANTITIES[name].colour) | world for name in halves}
    for name in delivery.quantities:  # one after the other: what is made for one file is gone before the next
        write_exr(
            folder / result_name(clip, name, number),
            planes_of(name, pictures),
            half=halves[name],
            attributes=attributes[name],
            fps=tags.fps,
            time_code=tags.time_code(time_s),
            compression=delivery.compression,
        )
    if delivery.multipart:
        write_exr_parts(
            folder / bundle_name(clip, number),
            {name: bundled(name, pictures) for name in delivery.bundle},
            half=halves,
            attributes=attributes,
            fps=tags.fps,
            time_code=tags.time_code(time_s),
            compression=delivery.compression,
        )
    if delivery.png16:
        _write_maps(folder, clip, number, pictures, {key: str(value) for key, value in attributes["normals"].items()})


def _write_maps(folder: Path, clip: str, number: int, pictures: InstantPictures, texts: Mapping[str, str]) -> None:
    """Write normals and validity as 16-bit PNG files, with what EXR files say in their headers as texts."""
    planes = planes_of("normals", pictures)
    normals = encode_normals(np.stack([planes[channel] for channel in "RGB"], axis=-1))
    write_png16(folder / result_name(clip, "normals", number, suffix="png"), normals, texts=texts)
    mask = np.where(pictures.surface.valid, np.uint16(PNG_MAX), np.uint16(0))
    write_png16(folder / result_name(clip, "valid", number, suffix="png"), mask, texts=texts)


def _write_meshes(folder: Path, clip: str, number: int, surface: Surface, depth: Depth, delivery: Delivery) -> None:
    if not delivery.meshes:
        return
    mesh = mesh_of(surface, depth)
    for kind in delivery.meshes:
        write = write_ply if kind == "ply" else write_part
        write(folder / mesh_file(clip, number, kind), mesh, delivery.space)
