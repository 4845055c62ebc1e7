"""Pictures of one scene, one per light, in linear light: what every calibration of lights starts from.

Read here: still photographs, one per light, in a folder; and plates, a folder per light (``psvideo split`` writes such
a folder). Clips need their flashes found first: ``psvideo.runs.photographs.light_sets`` takes all three, and gives the
same record.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import demosaic, parse_range
from psvideo.clip.decode.decoders import decode, read_header
from psvideo.clip.folder import KINDS, USUAL_KINDS
from psvideo.clip.linear import linear_light
from psvideo.clip.reading import looks
from psvideo.clip.stated import relative_exposures, stated_by
from psvideo.clip.stated_curve import curve_of_pictures
from psvideo.errors import PsvideoError
from psvideo.model.arrays import Doubles
from psvideo.model.camera import Encoding
from psvideo.model.channels import mean_of_channels
from psvideo.model.rows.clipping import LOSSY_MARGIN, SATURATED
from psvideo.plates.sequence import Round

CLIPPED_FROM = SATURATED - LOSSY_MARGIN
"""From this share of the sensor's range on a pixel of a picture, which may be a JPEG, counts as clipped."""
AMBIENT_NAMES = ("ambient", "dark")
"""A picture or a folder of this name shows the scene with every light off; it is taken off the others."""
ROOM_NAMES = ("room", "outline", "ref")
"""A picture of this name shows the scene with the room light on: on it outlines show best."""
MASK_NAMES = ("mask", "Mask", "MASK")
"""A picture whose name is or ends with such a word says where the subject is; it shows no light."""


@dataclass(frozen=True, kw_only=True)
class LightPictures:
    """One picture per light of a scene that stood still.

    Attributes
    ----------
    names
        Of the lights, in the images' order.
    images
        Shape (light, row, col) or (light, row, col, 3), float32, linear, 1.0 = sensor saturation; ambient light is off
        where ``ambient`` (same shape without the light) could be measured.
    saturated
        Same shape as images, True where a value was clipped (in any of the frames that were averaged).
    seen
        Shape (light, row), False where no frame saw a row; the pictures are 0 there.
    frames
        How many pictures of each light were averaged.
    flashes_s
        For how long every light shone, its plan's full flash; None where that is not known, as of photographs.
    """

    names: tuple[str, ...]
    images: NDArray[np.float32]
    saturated: NDArray[np.bool_]
    seen: NDArray[np.bool_]
    ambient: NDArray[np.float32] | None = None
    frames: int = 1
    flashes_s: tuple[float, ...] | None = None

    @property
    def height_px(self) -> int:
        """Rows of a picture."""
        return int(self.images.shape[1])

    @property
    def width_px(self) -> int:
        """Columns of a picture."""
        return int(self.images.shape[2])

    @property
    def grey(self) -> NDArray[np.float32]:
        """The mean over channels, shape (light, row, col)."""
        return self.images if self.images.ndim == 3 else mean_of_channels(self.images)


def light_pictures(
    names: Sequence[str],
    images: Sequence[NDArray[np.float32]],
    *,
    ambient: NDArray[np.float32] | None = None,
    ambient_times: Sequence[float] | Doubles = (),
    ambient_is_off: bool = False,
    saturation: Sequence[float] | None = None,
    seen: NDArray[np.bool_] | None = None,
) -> LightPictures:
    """Return pictures of one size as a record; ``ambient`` is taken off, unless that was done before.

    ``ambient_times`` (light,) says how often each picture holds the ambient light, where they were exposed differently.

    ``saturation`` (light,) is the value from which on each picture is clipped, with ambient light on it; 1.0 left out.
    """
    stacked = np.stack(images).astype(np.float32, copy=False)
    level = np.ones(len(names)) if saturation is None else np.asarray(saturation)
    whole = stacked + ambient if ambient is not None and ambient_is_off else stacked
    clipped = whole >= (CLIPPED_FROM * level).reshape(-1, *[1] * (stacked.ndim - 1)).astype(np.float32)
    return LightPictures(
        names=tuple(names),
        images=stacked if ambient is None or ambient_is_off else _without(stacked, ambient, ambient_times),
        saturated=clipped,
        seen=np.ones(stacked.shape[:2], np.bool_) if seen is None else seen,
        ambient=ambient,
    )


def _without(
    images: NDArray[np.float32], ambient: NDArray[np.float32], times: Sequence[float] | Doubles
) -> NDArray[np.float32]:
    if not len(times):
        return images - ambient
    each = np.asarray(times, np.float32).reshape(-1, *[1] * ambient.ndim)
    less: NDArray[np.float32] = images - each * ambient
    return less


def pictures_of_round(one: Round, *, flashes_s: tuple[float, ...] | None = None) -> LightPictures:
    """Return what a round's plates show, from which ambient light was taken; rows count that all of a plate shows."""
    pictures = light_pictures(
        one.lights,
        [plate.image for plate in one.plates],
        ambient=None if one.ambient is None else one.ambient.image,
        ambient_is_off=True,
        saturation=[plate.saturation for plate in one.plates],
        seen=np.stack([plate.pixels_seen.all(axis=1) for plate in one.plates]),
    )
    return replace(pictures, flashes_s=flashes_s)


def mean_of_sets(sets: Iterable[LightPictures]) -> LightPictures:
    """Return the mean over sets of the same lights, row by row over the frames that saw it; at least one set."""
    total: LightPictures | None = None
    count = np.zeros(())
    for one in sets:
        weight = one.seen.astype(np.float32)
        shown = replace(one, images=one.images * _per_pixel(weight, one.images))
        total = shown if total is None else _sum(total, shown)
        count = count + weight
    if total is None:
        raise ValueError("there is nothing to average")
    images = total.images / _per_pixel(np.maximum(count, 1).astype(np.float32), total.images)
    return replace(total, images=images, seen=count > 0)


def _sum(one: LightPictures, other: LightPictures) -> LightPictures:
    """Return the sum of pictures; of ambient light, which is averaged already, the mean weighted by frames."""
    ambient = None
    if one.ambient is not None and other.ambient is not None:
        share = np.float32(other.frames / (one.frames + other.frames))
        ambient = one.ambient * (1 - share) + other.ambient * share
    return replace(
        one,
        images=one.images + other.images,
        saturated=one.saturated | other.saturated,
        ambient=ambient,
        frames=one.frames + other.frames,
    )


def _per_pixel(rows: NDArray[np.float32], images: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what stands per row (light, row) in a shape that goes with pictures."""
    return rows.reshape(*rows.shape, *[1] * (images.ndim - 2))


@dataclass(frozen=True, kw_only=True)
class LightFiles:
    """Which files show which light. ``by_light`` holds for every light one file per set (per round).

    ``ambient`` holds one file per set, a single one for all sets, or none; ``room`` is a picture under room light.
    ``left_aside`` are pictures that are none of these.
    """

    folder: Path
    by_light: Mapping[str, tuple[Path, ...]]
    ambient: tuple[Path, ...] = ()
    ambient_is_off: bool = False
    room: Path | None = None
    left_aside: tuple[Path, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The lights' names, in order."""
        return tuple(self.by_light)

    @property
    def sets(self) -> int:
        """How many pictures there are of each light."""
        return min(len(files) for files in self.by_light.values())

    def ambient_at(self, place: int) -> Path:
        """Return the picture of the ambient light that belongs to a set."""
        return self.ambient[min(place, len(self.ambient) - 1)]

    def ambient_times(self, place: int) -> tuple[float, ...]:
        """Return how often each light's picture of a set holds the ambient light of its dark one, by the exposures that
        the files state; nothing where all are alike, or they do not say."""
        if not self.ambient or self.ambient_is_off:
            return ()
        lights = [stated_by(paths[place]) for paths in self.by_light.values()]
        relative = relative_exposures(lights, [stated_by(self.ambient_at(place))])
        return () if relative is None else tuple((relative[:-1] / relative[-1]).tolist())

    def curve(self) -> tuple[str, str]:
        """Return the name of the curve by which the first picture of every light codes light, and why: as they say,
        else sRGB for JPEG, and light itself for all other kinds, which calibration is for.

        Raises PsvideoError where one cannot be read, or where they say different things.
        """
        first = [paths[0] for paths in self.by_light.values()]
        kind = KINDS[first[0].suffix.lower()]
        header, stated = read_header(kind, first[0]), [stated_by(file) for file in first]
        if kind != "jpeg" and not header.transfer and not any(one.transfer for one in stated):
            return "linear", f"the usual meaning of {kind.upper()} pictures of lights: they say nothing themselves"
        return curve_of_pictures(first, kind, header, stated)


def read_sets(
    files: LightFiles, *, encoding: Encoding = Encoding(), frames: str | None = None, most: int | None = None
) -> Iterator[LightPictures]:
    """Read one set of pictures after the other; ``encoding`` says how the files code light.

    ``frames`` chooses sets by number, counted from 1; ``most`` reads the first this many. Raises PsvideoError where a
    picture cannot be read, or is not of the first one's size.
    """
    chosen = parse_range(frames, range(1, files.sets + 1)) if frames else tuple(range(1, files.sets + 1))
    shape: tuple[str, str] | None = None
    for number in chosen[:most]:
        images = []
        for paths in files.by_light.values():
            image, look = read_picture(paths[number - 1], encoding)
            shape = shape or (look, str(paths[number - 1]))
            if look != shape[0]:
                raise PsvideoError(
                    f"{paths[number - 1]}: is {look}, and {shape[1]} is {shape[0]}. Pictures of all lights must come "
                    "from one camera in one place and one mode: take this one again, or move it elsewhere."
                )
            images.append(image)
        dark = None
        if files.ambient:
            dark, _ = read_picture(files.ambient_at(number - 1), encoding)
            if dark.shape != images[0].shape:
                raise PsvideoError(
                    f"{files.ambient[0]}: shows the ambient light and is not of the size and channels of the other "
                    f"pictures ({shape[0] if shape else ''}). Take it with the same camera and mode."
                )
        times = files.ambient_times(number - 1)
        yield light_pictures(
            files.names, images, ambient=dark, ambient_times=times, ambient_is_off=files.ambient_is_off
        )


def read_picture(path: Path, encoding: Encoding = Encoding()) -> tuple[NDArray[np.float32], str]:
    """Return a picture in linear light, (row, col) or (row, col, 3), upright as its file says that it lies, and its
    size, channels and depth in words.

    Raises PsvideoError where it cannot be read.
    """
    if path.suffix.lower() not in KINDS or not path.is_file():
        raise PsvideoError(f"{path}: is no picture that can be read; expected one of {', '.join(USUAL_KINDS)}.")
    picture = decode(KINDS[path.suffix.lower()], path)
    image = linear_light(picture, encoding)
    if not np.isfinite(image).all():
        raise PsvideoError(f"{path}: holds values that are no numbers (NaN or infinity). Write it again.")
    cfa = picture.header.cfa
    turn = stated_by(path).turn if picture.header.turn.is_none else picture.header.turn
    said = looks(picture.header) if turn.is_none else f"{looks(picture.header)}, {turn}"
    return turn.upright(image if cfa is None else demosaic(image, cfa)), said
