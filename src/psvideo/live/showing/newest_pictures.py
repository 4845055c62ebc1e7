"""The newest pictures for pages: packed once for all who ask for them, and never an older one.

What was asked for of the one before is packed before the new one is shown: two threads in turn take longer.
"""

import threading
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from psvideo.live.showing.newest_result import NewestRound
from psvideo.model.camera import Camera
from psvideo.model.coded import Coded
from psvideo.model.rows.shutter import row_weights
from psvideo.page.picture import Look, PagePicture, halves, picked, picture_block, shown

LARGE, SMALL = Look(width_px=640), Look(width_px=320, quick=True)
BRIGHT = 0.8
"""The brightest hundredth of a picture is shown at this share of white."""
REMEMBERED = 64
"""Results of which it is known when they came, and drawn pictures that are counted."""
LIT = 0.5
"""A row that saw less of every flash is part of the dark row."""


@dataclass(kw_only=True)
class NewestPictures:
    """Holds the newest result; ``number`` counts them. May be asked by several threads."""

    number: int = 0
    _newest: NewestRound | None = None
    _camera: Camera | None = None
    _packed: dict[str, bytes] = field(default_factory=dict)
    _asked: set[str] = field(default_factory=set)
    _came_s: dict[int, float] = field(default_factory=dict)
    _drawn: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    _changed: threading.Condition = field(default_factory=threading.Condition)

    def put(self, newest: NewestRound, camera: Camera) -> None:
        """Take the place of what was newest; ``camera`` is that of the small frames."""
        with self._changed:
            asked, self._asked = self._asked, set()
        packed = {
            name: picture_block(_picture(name, newest, camera))
            for name in dict.fromkeys(name for plate in sorted(asked) for name in _names(newest, plate))
        }
        with self._changed:
            self._newest, self._camera, self._packed = newest, camera, packed
            self.number += 1
            self._came_s[self.number] = newest.came_s
            self._came_s.pop(self.number - REMEMBERED, None)
            self._changed.notify_all()

    def wait(self, seen: int, most_s: float) -> int:
        """Return the newest number, once it is not the one that was seen, or after a while."""
        with self._changed:
            self._changed.wait_for(lambda: self.number != seen, most_s)
            return self.number

    def drawn(self, number: int, at_s: float) -> None:
        """Note that a page has drawn a result, at a time of this machine's clock."""
        with self._changed:
            if number in self._came_s:
                self._drawn.append((at_s, at_s - self._came_s[number]))

    def drawn_ages_s(self, since_s: float) -> list[float]:
        """Return how old results were when pages had drawn them, of all that were drawn since a time."""
        with self._changed:
            return [age_s for at_s, age_s in self._drawn if at_s > since_s]

    def packed(self, plate: str) -> tuple[int, list[bytes]]:
        """Return the newest number and its pictures as blocks: normals and albedo, one light's plate, the frame."""
        with self._changed:
            newest, camera, number, kept = self._newest, self._camera, self.number, self._packed
            self._asked.add(plate)
        if newest is None or camera is None:
            return number, []
        return number, [
            kept[name] if name in kept else kept.setdefault(name, picture_block(_picture(name, newest, camera)))
            for name in _names(newest, plate)
        ]


def _names(newest: NewestRound, plate: str) -> list[str]:
    """Return the names of the pictures that whoever looks at a light's plate gets."""
    surface = ["normals", "albedo"] if newest.surface is not None else []
    return [*surface, f"plate {plate}", "frame"]


def _picture(name: str, newest: NewestRound, camera: Camera) -> PagePicture:
    surface = newest.surface
    if surface is not None and name == "normals":
        return PagePicture(pixels=_pixels(surface.normals, LARGE, directions=True), facts={"id": "normals"})
    if surface is not None and name == "albedo":
        return _light("albedo", surface.albedo, LARGE, {})
    if name == "frame":
        facts = {"rows": lit_rows(newest, camera), "place": newest.place, "ended": newest.ended}
        return _light("frame", _thinned(newest.frame).light(), SMALL, facts)
    asked = name.removeprefix("plate ")
    plate = next((one for one in newest.round.plates if one.light == asked), newest.round.plates[0])
    return _light("plate", plate.image, SMALL, {"light": plate.light})


def _thinned(frame: Coded) -> Coded:
    """Return the pixels of a frame that are shown; a mosaic of levels is made light first."""
    if frame.shape[1] <= SMALL.width_px or frame.tone.zero.size > 1:
        return frame
    return Coded(codes=picked(np.asarray(frame.codes), SMALL.width_px), tone=frame.tone)


def _light(name: str, image: NDArray[np.float32], look: Look, facts: Mapping[str, object]) -> PagePicture:
    bright = float(np.percentile(image[::8, ::8], 99))
    exposure = BRIGHT / bright if bright > 1e-6 else 1.0
    return PagePicture(pixels=_pixels(image, look), facts={"id": name, "exposure": exposure} | dict(facts))


def _pixels(image: NDArray[np.float32], look: Look, *, directions: bool = False) -> NDArray[np.floating]:
    """Return a picture as it is shown: as it is, or made smaller where it is wider than is looked at."""
    if image.shape[1] > look.width_px and look.quick:
        return halves(picked(image, look.width_px))
    if image.shape[1] > look.width_px:
        planes = [image] if image.ndim == 2 else [image[..., channel] for channel in range(image.shape[2])]
        return shown(planes, look, directions=directions)
    return halves(image)


def lit_rows(newest: NewestRound, camera: Camera) -> list[tuple[int, int, str]]:
    """Return which rows of the newest frame which light reached, as (first, last + 1, light): "" for the dark row.

    Rows are counted in the frame as it is shown.
    """
    flashes = [flash for flash in newest.timing.flashes if not flash.is_dark]
    starts, lengths = (np.array([getattr(one, name) for one in flashes]) for name in ("start_s", "duration_s"))
    weights = row_weights(camera, starts, lengths, frames=range(newest.place, newest.place + 1))[:, 0]
    best = np.where(weights.max(axis=0) > LIT, weights.argmax(axis=0), -1)
    edges = [0, *(np.flatnonzero(np.diff(best)) + 1).tolist(), len(best)]
    share = shown([np.zeros(newest.frame.shape[:2], np.float32)], SMALL).shape[0] / len(best)
    return [
        (round(first * share), round(last * share), "+".join(flashes[best[first]].lit) if best[first] >= 0 else "")
        for first, last in pairwise(edges)
    ]
