"""Pictures of the relit movie: the surface under a light that goes round the lens, small and in linear light.

They are made while an instant's surface is in memory, and lie beside the results until the movie is made of them: to
read results back takes four times as long. Where one is missing it is made from the files, to the same bytes.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decode import exr
from psvideo.compute.halves import halves_of
from psvideo.export.space import Space, placed
from psvideo.formats.whole_files import whole_file
from psvideo.model.arrays import Doubles, Halves
from psvideo.model.irradiance.light_field import Points, light_vectors
from psvideo.model.plan import Plan, PlannedFlash, reference_duration_s
from psvideo.model.rig import Rig
from psvideo.model.surface import Surface
from psvideo.pictures.relit_kernel import relit
from psvideo.plates.sequence import Round

TURN_S = 4.0
"""The light goes round once in this many seconds of playing."""
TILT = 0.6
"""How far the light goes round from the camera's axis: the sine of the angle."""
WIDTH_PX = 1280
"""Pictures of movies are at most this wide."""
KEPT = "preview/.relit"
"""The folder of pictures that wait for their movie."""


def keep_relit(
    folder: Path, number: int, surface: Surface, space: Space, fps: Fraction, blur: NDArray[np.float32] | None = None
) -> None:
    """Keep the picture of one instant of a run that writes into ``folder``; ``blur`` is added, as ``blur_of`` gives."""
    said = space.attributes() | {"psvideo:y": space.y}
    picture = _relit(_planes(placed(surface.normals, space)), _planes(surface.albedo), _light(number, fps, said))
    if blur is not None:
        blurred = np.maximum(picture.astype(np.float32) + blur, np.float32(0))
        picture = halves_of(blurred.reshape(len(blurred), -1))[0].reshape(blurred.shape)
    with whole_file(relit_file(folder, number)) as beside, beside.open("wb") as file:
        np.save(file, picture)


def read_relit(normals: Path, albedo: Path, number: int, fps: Fraction) -> Halves:
    """Return an instant's picture from its files."""
    of_normals, of_albedo = exr.read_halves(normals), exr.read_halves(albedo)
    return _relit(of_normals.planes, of_albedo.planes, _light(number, fps, of_normals.attributes))


def blur_of(one: Round, plan: Plan, rig: Rig, fps: Fraction) -> NDArray[np.float32] | None:
    """Return what an open shutter adds to an instant's picture, as large as that, None where it adds nothing.

    A matte surface under one more light is a sum of its plates, with the weights by which their lights add up to that
    one: what the shutter changes in the plates, it changes in that sum.
    """
    pairs = list(zip(one.plates, one.open_plates, strict=False))
    if all(wide.picture is sharp.picture for sharp, wide in pairs):
        return None
    weights = _weights(one, plan, rig, _from(one.number, fps))
    factor = -(-one.plates[0].shape[1] // WIDTH_PX)
    rows, cols = (size // factor for size in one.plates[0].shape[:2])
    added = np.zeros((rows, cols, 3), np.float32)
    for (sharp, wide), weight in zip(pairs, weights, strict=True):
        if wide.picture is not sharp.picture:
            change = (wide.image - sharp.image)[: rows * factor, : cols * factor]
            small = cv2.resize(change, (cols, rows), interpolation=cv2.INTER_AREA)
            added += np.atleast_3d(small) * weight
    return added


def _weights(one: Round, plan: Plan, rig: Rig, light: Doubles) -> NDArray[np.float32]:
    """Return by which weights a round's lights add up to another, in the middle of the picture, (light, channel)."""
    alone = tuple(
        PlannedFlash(lights={plate.light: 1.0}, duration_s=reference_duration_s(plan, plate.light))
        for plate in one.plates
    )
    middle = Points(down=np.full(3, 0.5), across=np.full(3, 0.5), channel=np.arange(3), channels=3)
    vectors = light_vectors(replace(plan, flashes=alone), rig, middle)
    return np.stack([np.linalg.pinv(lit.T) @ light for lit in vectors], axis=1).astype(np.float32)


def relit_file(folder: Path, number: int) -> Path:
    """Return where an instant's picture is kept below the output folder."""
    return folder / KEPT / f"{number}.npy"


def _planes(image: NDArray[np.floating]) -> tuple[NDArray[np.floating], ...]:
    """Return the channels of a picture (row, col[, channel])."""
    return (image,) if image.ndim == 2 else tuple(image[..., channel] for channel in range(image.shape[2]))


def _relit(
    normals: tuple[NDArray[np.floating], ...], albedo: tuple[NDArray[np.floating], ...], light: NDArray[np.float32]
) -> Halves:
    factor = -(-normals[0].shape[1] // WIDTH_PX)
    return relit(tuple(map(_half, normals)), tuple(map(_half, albedo)), light, factor)


def _half(plane: NDArray[np.floating]) -> Halves:
    """Return a channel as files store it."""
    return plane if plane.dtype == np.float16 else halves_of(plane.astype(np.float32))[0]


def _from(number: int, fps: Fraction) -> Doubles:
    """Return the light's direction at an instant, in the camera's frame."""
    angle = 2 * math.pi * number / float(fps) / TURN_S
    return np.array([TILT * math.cos(angle), TILT * math.sin(angle), math.sqrt(1 - TILT**2)])


def _light(number: int, fps: Fraction, said: Mapping[str, object]) -> NDArray[np.float32]:
    """Return the light's direction at an instant, in the frame that a file of normals says it is in."""
    light = _from(number, fps)
    matrix = said.get("psvideo:camera_to_world")
    if isinstance(matrix, str):
        light = np.array(matrix.split(), np.float64).reshape(4, 4)[:3, :3] @ light
    return (light * (1, -1, 1) if said.get("psvideo:y") == "down" else light).astype(np.float32)
