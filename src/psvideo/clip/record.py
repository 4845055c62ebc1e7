"""A clip on disk, and one of its frames."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from psvideo.clip.decoded import Header
from psvideo.model.camera import Encoding
from psvideo.model.coded import Coded
from psvideo.model.plan import Plan
from psvideo.model.turn import Turn


@dataclass(frozen=True, kw_only=True)
class Frame:
    """One frame, in the codes in which it was read.

    ``index`` is its place in time, counted from the clip's first frame, dropped frames included; ``number`` is its
    file's number (a movie's: the index). ``coded`` is (row, col) for grey or mosaiced footage, (row, col, 3) for
    colour.
    """

    index: int
    number: int
    coded: Coded

    @property
    def image(self) -> NDArray[np.float32]:
        """The frame in linear light, made when it is asked for.

        0 is the black level, 1.0 is saturation; noise below black is kept, so values may be slightly negative.
        """
        return self.coded.light()


@dataclass(frozen=True, kw_only=True)
class Clip:
    """A strobed clip on disk, checked against its plan; its frames are read by ``read_frames``.

    ``files`` are the frames' files in order, or the one movie. ``numbers`` are the frames' numbers, with holes where
    frames were dropped. ``cfa`` is the filter pattern at the picture's top left, None where it is not mosaiced.
    ``colour`` is the colour interop id of plates and albedo made from this clip; ``encoding`` is how its codes are
    read; a movie has the frames' ``timestamps``. Where a movie's rate varies, numbers count ``places_per_frame`` places
    for every frame of the plan's rate, and ``plan`` has the rate of places. ``stills`` are photographs that were taken
    one by one, at no rate; ``exposures`` says how much more than usually each was exposed, () where all are alike.
    ``curve_doubt`` says why pictures were likely coded by another curve; ``warnings`` say what may cost accuracy or was
    guessed, ``notes`` what else was found on opening.
    """

    name: str
    path: Path
    plan: Plan
    plan_path: Path
    kind: str
    files: tuple[Path, ...]
    numbers: tuple[int, ...]
    header: Header
    colour: str
    encoding: Encoding
    timestamps: tuple[int, ...] = ()
    places_per_frame: int = 1
    stills: bool = False
    exposures: tuple[float, ...] = ()
    curve_doubt: str = ""
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def turn(self) -> Turn:
        """How frames, which lie as the sensor read them, are turned to stand upright; plates and results do."""
        return self.header.turn

    @property
    def width_px(self) -> int:
        """Columns of the upright picture."""
        return self.turn.size(self.header.width_px, self.header.height_px)[0]

    @property
    def height_px(self) -> int:
        """Rows of the upright picture; the frames' own rows are the plan's ``camera.height_px``."""
        return self.turn.size(self.header.width_px, self.header.height_px)[1]

    @property
    def dropped(self) -> tuple[tuple[int, int], ...]:
        """The holes that the numbering shows, as (number before the hole, count of missing frames); none where the
        rate varies: then places are left out between all frames."""
        return holes(self.numbers) if self.places_per_frame == 1 else ()

    @property
    def filmed_plan(self) -> Plan:
        """The plan with the rate at which it was to be filmed, also where the movie's rate varies."""
        fps = self.plan.camera.fps / self.places_per_frame
        return replace(self.plan, camera=replace(self.plan.camera, fps=fps))

    @property
    def shown_plan(self) -> Plan:
        """The plan with the size of the upright picture: for what is seen of the scene, not for the time of rows."""
        camera = replace(self.plan.camera, width_px=self.width_px, height_px=self.height_px)
        return replace(self.plan, camera=camera)

    @property
    def cfa(self) -> str | None:
        """The filter pattern at the top left pixel, row by row; None where the frames are not mosaiced."""
        return self.header.cfa or self.encoding.cfa

    @property
    def channels(self) -> int:
        """Channels of a frame once it is demosaiced: 1 or 3."""
        return 3 if self.cfa else self.header.channels

    @property
    def time_code(self) -> str | None:
        """Time code of the first frame, ``HH:MM:SS:FF``, where the file gives one."""
        return self.header.time_code

    @property
    def is_movie(self) -> bool:
        """Whether one file holds all frames."""
        return self.kind == "movie"

    def index_of(self, number: int) -> int:
        """The place in time of the frame with this number; dropped frames count."""
        return number - self.numbers[0]

    def file_of(self, number: int) -> Path:
        """The file that holds the frame with this number."""
        return self.files[0] if self.is_movie else self.files[bisect_left(self.numbers, number)]


def holes(numbers: Sequence[int]) -> tuple[tuple[int, int], ...]:
    """Return the holes in ascending frame numbers as (number before the hole, count of missing frames).

    >>> holes([7, 8, 11, 12, 14])
    ((8, 2), (12, 1))
    """
    return tuple((before, after - before - 1) for before, after in pairwise(numbers) if after - before > 1)
