"""What is written of every instant besides the surface: its camera, its plates, their sum, and passes."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Clip
from psvideo.compute.halves import halves_of
from psvideo.compute.spilled import bands, let_go, room_of_planes
from psvideo.export.sequences.plate_files import plate_name, write_light, write_plate
from psvideo.export.sequences.result_files import Delivery, write_surface
from psvideo.export.sequences.tags import Tags
from psvideo.model.choices import Compression
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.align.velocity.vectors import fill_per_s
from psvideo.plates.beauty import beauty_of
from psvideo.plates.light_plate import LightPlate
from psvideo.plates.sequence import AMBIENT, Round
from psvideo.runs.delivery.relit import keep_relit
from psvideo.solve.depth import Depth
from psvideo.solve.instants import Instant
from psvideo.solve.passes.asked_passes import AskedPasses, Passes


def plates_of(one: Round) -> Iterator[LightPlate]:
    """Yield what a round's sequences of plates show: every light, and ambient light where the round has it."""
    yield from one.open_plates or one.plates
    if one.ambient is not None and AMBIENT not in one.lights:
        yield replace(one.ambient, number=one.number)


def write_plates(
    folder: Path,
    clip: str,
    one: Round,
    tags: Tags,
    *,
    compression: Compression,
    resume: bool,
    write: Callable[[Callable[[], None]], None],
) -> None:
    """Hand a round's plates to the writing threads, which let only few wait, so that memory is bounded."""
    for plate in plates_of(one):
        if not (resume and (folder / plate_name(clip, plate.light, plate.number)).is_file()):
            write(partial(write_plate, folder, clip, plate, tags, compression=compression))


def surface_job(
    folder: Path,
    clip: Clip,
    instant: Instant,
    delivery: Delivery,
    tags: Tags,
    *,
    depth: Callable[[], Depth] | None,
    ambient: LightPlate | None,
    blur: NDArray[np.float32] | None = None,
) -> Callable[[], None]:
    """Return what writes one instant's surface: it holds the surface and the plates' sum, but no plate.

    ``depth`` integrates the normals, ``ambient`` is as for ``beauty_of``, and ``blur`` as for ``keep_relit``.
    """
    one = instant.round
    there = replace(delivery, space=delivery.space.at(one.time_s, one.number, clip.filmed_plan.camera.fps))
    beauty = None
    if "beauty" in delivery.aovs:
        image = beauty_of(one, delivery.mix, ambient).image
        beauty = halves_of(image.reshape(len(image), -1))[0].reshape(image.shape)
    job = partial(write_surface, folder, clip.name, one.number, one.time_s, instant.surface)
    age_s = one.age_s if "age" in delivery.aovs else None
    written = partial(
        job,
        delivery=there,
        tags=tags,
        depth=depth,
        beauty=beauty,
        age_s=age_s,
        passes=_whole_picture(instant.passes),
        motion=partial(motion_of, one.motion, one.plates[0].shape, tags.fps, folder)
        if "motion" in delivery.aovs
        else None,
    )
    if "relit" not in delivery.previews:
        return written

    shown = partial(keep_relit, folder, one.number, instant.surface, there.space, tags.fps, blur)
    return partial(_in_turn, shown, written)


def _in_turn(*jobs: Callable[[], None]) -> None:
    for job in jobs:
        job()


def motion_of(
    motion: Followed | None, shape: tuple[int, ...], fps: Fraction, spare: Path | None = None
) -> NDArray[np.float32]:
    """Return where every pixel is a delivered frame later and earlier, x right and y up, (row, col, 4), in pixels; each
    of the four lies in a plane of its own, as files are written. Large ones lie in a file in the folder ``spare``: at
    1080p they take 33 MB, while the next round is followed."""
    rows, cols = shape[:2]
    ways = room_of_planes(4, rows, cols, np.float32, spare)
    fill_per_s(motion, ways[:2])
    for ahead, back, per in zip(ways[:2], ways[2:], (1 / fps, -1 / fps), strict=True):
        for first, last in bands(rows):
            ahead[first:last] *= np.float32(per)
            np.negative(ahead[first:last], out=back[first:last])
            let_go(ahead[first:last], back[first:last])
    return np.moveaxis(ways, 0, -1)


def _whole_picture(passes: Passes | None) -> Passes | None:
    """Return an instant's passes without what is written light by light."""
    return None if passes is None else replace(passes, specular_of=())


def passes_asked(delivery: Delivery) -> AskedPasses:
    """Return what a delivery asks of the plates beside the surface; light by light where plates are written too."""
    aovs = delivery.aovs
    return AskedPasses(
        reach="reach" in aovs,
        specular="specular" in aovs,
        alpha="alpha" in aovs,
        each=delivery.plates,
        weights=dict(delivery.mix.weights),
    )


def write_specular(
    folder: Path,
    clip: str,
    instant: Instant,
    tags: Tags,
    *,
    compression: Compression,
    write: Callable[[Callable[[], None]], None],
) -> None:
    """Hand what exceeds the diffuse model under each light to the writing threads."""
    if instant.passes is None:
        return
    for plate, image in zip(instant.round.plates, instant.passes.specular_of, strict=False):
        write(partial(write_light, folder, clip, plate, image, tags, compression=compression))
