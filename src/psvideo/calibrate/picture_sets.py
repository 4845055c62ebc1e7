"""Pictures of lights in files, one per light and set: read into linear light, all of one size and mode."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.calibrate.light_pictures import LightPictures, light_pictures
from psvideo.clip import demosaic, parse_range
from psvideo.clip.decode.decoders import decode, read_header
from psvideo.clip.folder import KINDS, USUAL_KINDS
from psvideo.clip.linear import linear_light
from psvideo.clip.reading import looks
from psvideo.clip.stated import relative_exposures, stated_by
from psvideo.clip.stated_curve import curve_of_pictures
from psvideo.errors import PsvideoError
from psvideo.model.camera import Encoding


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
