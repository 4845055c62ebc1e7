"""Plates as files: ``<light>/<clip>_<light>.<number>.exr``, half float, one sequence per light."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.export.sequences.tags import Tags
from psvideo.formats.exr_files import write_exr
from psvideo.model.choices import USUAL_COMPRESSION, Compression
from psvideo.model.quantities import QUANTITIES
from psvideo.model.turn import UPRIGHT, Turn
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.split import Plate

PLATE = QUANTITIES["plate"]


def plate_name(clip: str, light: str, number: int) -> str:
    """Return a plate's path below the plates' folder.

    >>> plate_name("take3", "key", 1001)
    'key/take3_key.1001.exr'
    """
    return f"{light}/{clip}_{light}.{number:04d}.exr"


def write_plate(
    folder: Path, clip: str, plate: LightPlate, tags: Tags, *, compression: Compression = USUAL_COMPRESSION
) -> None:
    """Write one plate: channels R, G, B or Y, and ``valid`` where rows are missing."""
    write_light(folder, clip, plate, plate.image, tags, compression=compression)


def write_light(
    folder: Path,
    clip: str,
    plate: LightPlate,
    image: NDArray[np.floating],
    tags: Tags,
    *,
    compression: Compression = USUAL_COMPRESSION,
) -> None:
    """Write what an image says of a plate's light, as the plate itself is written."""
    path = folder / plate_name(clip, plate.light, plate.number)
    channels = _with_validity(image, plate.pixels_seen)
    write_exr(
        path,
        channels,
        attributes=tags.attributes(time_s=plate.time_s, data=not PLATE.colour),
        fps=tags.fps,
        time_code=tags.time_code(plate.time_s),
        compression=compression,
    )


def write_flash(
    folder: Path,
    clip: str,
    plate: Plate,
    tags: Tags,
    *,
    turn: Turn = UPRIGHT,
    compression: Compression = USUAL_COMPRESSION,
) -> None:
    """Write what one flash showed by itself, turned upright: ``flashes/<clip>_flash.<index>.exr``."""
    seen = np.array(np.broadcast_to(plate.seen[:, None], plate.picture.shape[:2]))
    path = folder / "flashes" / f"{clip}_flash.{plate.flash.index:04d}.exr"
    lights = " ".join(f"{name}={power:g}" for name, power in plate.flash.lights.items()) or "dark"
    attributes = tags.attributes(time_s=plate.time_s, data=not PLATE.colour) | {"psvideo:lights": lights}
    write_exr(
        path,
        _with_validity(turn.upright(plate.image), turn.upright(seen)),
        attributes=attributes,
        fps=tags.fps,
        time_code=tags.time_code(plate.time_s),
        compression=compression,
    )


def _with_validity(image: NDArray[np.floating], seen: NDArray[np.bool_]) -> dict[str, NDArray[np.floating]]:
    channels = _channels(image)
    if not seen.all():
        channels["valid"] = seen.astype(np.float32)
    return channels


def _channels(image: NDArray[np.floating]) -> dict[str, NDArray[np.floating]]:
    """Return a plate's channels by their names in a file: one for a grey camera's."""
    if image.ndim == 2:
        return {"Y": image}
    return {name: image[..., place] for place, name in enumerate(PLATE.channels)}
