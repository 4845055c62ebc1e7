"""Pictures of a blinking LED as row profiles: from a movie, a folder of frames or single image files, without a plan.

Code values are taken as they are: a transfer curve bends the stripes' shape and leaves their period.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import parse_range
from psvideo.clip.decode.decoders import decode
from psvideo.clip.decode.movies.movie import index_movie
from psvideo.clip.decode.movies.movie_frames import read_movie
from psvideo.clip.decoded import CodedPicture
from psvideo.clip.folder import KINDS, MOVIES, find_sequence
from psvideo.clip.reading import looks
from psvideo.errors import PsvideoError, UsageError
from psvideo.model.arrays import Doubles

MOST_FRAMES = 24
"""This many frames are read where the user names none: more would hardly make the result better."""
MOST_BLOCKS = 8
FEWEST_COLUMNS = 16


@dataclass(frozen=True, kw_only=True)
class LedPictures:
    """Pictures of one size. ``profiles`` (frame, channel, block, row) are means over blocks of columns, in code values.

    ``places`` are the frames' places in time, None for stills that have none; ``rate_hz`` is a movie's own.
    """

    name: str
    profiles: Doubles
    width_px: int
    places: tuple[int, ...] | None
    rate_hz: float | None = None

    @property
    def height_px(self) -> int:
        """Rows of a picture."""
        return int(self.profiles.shape[3])


def read_led_pictures(
    paths: Sequence[Path], *, columns: tuple[int, int] | None = None, frames: str | None = None
) -> LedPictures:
    """Read a movie, a folder of numbered frames, or image files.

    ``columns`` are the first one and one past the last one to use; ``frames`` names numbers of a folder's or movie's
    frames. Raises PsvideoError or UsageError where there is nothing to read or the pictures are not alike.
    """
    path = paths[0]
    rate_hz = None
    if len(paths) == 1 and path.is_dir():
        sequence = find_sequence(path)
        by_number = dict(zip(sequence.numbers, sequence.files, strict=True))
        places: tuple[int, ...] | None = _chosen(sequence.numbers, frames)
        pictures = _decoded([by_number[number] for number in places or ()])
    elif len(paths) == 1 and path.suffix.lower() in MOVIES and path.is_file():
        movie = index_movie(path)
        places, rate_hz = _chosen(movie.places, frames), movie.place_rate_hz
        stamps = dict(zip(movie.places, movie.timestamps, strict=True))
        pictures = ((f"{path}, frame {place}", found) for place, found in _filmed(path, stamps, places))
    else:
        _refuse_others(paths, frames)
        places, pictures = None, _decoded(paths)
    profiles, width_px = _profiles(pictures, columns)
    name = str(path) if len(paths) == 1 else f"{path} and {len(paths) - 1} more"
    return LedPictures(name=name, profiles=profiles, width_px=width_px, places=places, rate_hz=rate_hz)


def exact_rate(rate_hz: float) -> Fraction:
    """Return the broadcast or whole rate that a movie's timestamps mean.

    >>> exact_rate(29.97), exact_rate(25.0001)
    (Fraction(30000, 1001), Fraction(25, 1))
    """
    whole = round(rate_hz)
    near = (Fraction(whole), Fraction(whole * 1000, 1001), Fraction(rate_hz).limit_denominator(1001))
    return next((rate for rate in near if abs(rate / rate_hz - 1) < 1e-4), near[-1])


def _chosen(numbers: Sequence[int], frames: str | None) -> tuple[int, ...]:
    return tuple(numbers[:MOST_FRAMES]) if frames is None else parse_range(frames, numbers)


def _filmed(path: Path, stamps: dict[int, int], places: Sequence[int]) -> Iterator[tuple[int, CodedPicture]]:
    return zip(places, read_movie(path, [stamps[place] for place in places], places), strict=True)


def _refuse_others(paths: Sequence[Path], frames: str | None) -> None:
    """Refuse what is neither a folder, nor a movie, nor only image files."""
    if frames is not None:
        raise UsageError("`frames` chooses from a folder's or a movie's frames; name the image files that are meant.")
    for path in paths:
        if not path.exists():
            raise PsvideoError(f"{path}: is not there. Name a movie, a folder of numbered frames, or image files.")
        if path.is_dir() or path.suffix.lower() not in KINDS:
            known = ", ".join(sorted((*KINDS, *MOVIES)))
            raise PsvideoError(
                f"{path}: is not a picture that is read ({known}). Name one movie, one folder of numbered frames, or "
                "any number of image files."
            )


def _decoded(files: Sequence[Path]) -> Iterator[tuple[str, CodedPicture]]:
    return ((str(file), decode(KINDS[file.suffix.lower()], file)) for file in files)


def _profiles(pictures: Iterator[tuple[str, CodedPicture]], columns: tuple[int, int] | None) -> tuple[Doubles, int]:
    """Return the profiles of all pictures and their width; raise PsvideoError where they are not alike."""
    found: list[Doubles] = []
    first: tuple[str, str] | None = None
    width_px = 0
    for name, picture in pictures:
        look, width_px = looks(picture.header), picture.header.width_px
        first = first or (name, look)
        if look != first[1]:
            raise PsvideoError(
                f"{name}: is {look}, and {first[0]} is {first[1]}. Measure the pictures of one mode of one camera."
            )
        begin, end = columns or (0, width_px)
        if end > width_px:
            raise UsageError(f"`columns` {begin}-{end}: {name} has columns 0-{width_px} only.")
        found.append(_blocks(in_colours(picture), begin, end))
    return np.array(found), width_px


def in_colours(picture: CodedPicture) -> NDArray[Any]:
    """Return codes (row, col, channel): of a mosaic the green ones, which every row has in every second column."""
    codes, cfa = picture.codes, picture.header.cfa
    codes = codes.astype(np.float32) if codes.dtype == np.float16 else codes  # means are taken of them
    if cfa is None:
        return codes.reshape(*codes.shape[:2], -1)
    even, odd = (np.repeat(codes[row::2, cfa.index("G", 2 * row) % 2 :: 2], 2, axis=1) for row in (0, 1))
    width, height = min(even.shape[1], odd.shape[1]), codes.shape[0]
    green = np.empty((height, width, 1), codes.dtype)
    green[0::2, :, 0], green[1::2, :, 0] = even[:, :width], odd[:, :width]
    return green


def _blocks(codes: NDArray[Any], begin: int, end: int) -> Doubles:
    """Return means over blocks of columns, shape (channel, block, row)."""
    count = int(np.clip((end - begin) // FEWEST_COLUMNS, 1, MOST_BLOCKS))
    edges = np.linspace(begin, end, count + 1).astype(np.int64)
    means = [codes[:, left:right].mean(axis=1, dtype=np.float64).T for left, right in pairwise(edges)]
    return np.stack(means, axis=1)
