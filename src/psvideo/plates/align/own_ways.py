"""What no common motion explains, shown at an instant for eyes: a fade, and what the light's own flow makes of it.

Where it is not known how one plate becomes the other, the picture at an instant between them is one of several, and
their mean by how likely each is has the least square error: the fade from one to the other, and both moved along the
light's own flow, found from the earlier plate and from the later one. What stands before them stays as it is.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Flags, Floats, Image
from psvideo.model.channels import brightest_channel
from psvideo.plates.align.packed import BAND_ROWS, Packing, PutBy
from psvideo.plates.align.side_kernel import JUST_BELOW
from psvideo.plates.align.velocity.flow import pixel_places
from psvideo.plates.align.velocity.followed import Followed
from psvideo.plates.align.velocity.own_flow import FILL_PX, OwnFlow, filled
from psvideo.plates.light_plate import LightPlate

MARGIN_ROWS = 8
"""Rows beside those that ways lead to: for cubic interpolation, and for what fills gaps."""
HALF, ONE = np.float32(0.5), np.float32(1)


def along_own_ways(
    plate: LightPlate,
    ends: tuple[LightPlate, LightPlate],
    own: OwnFlow,
    motion: Followed,
    *,
    put_by: PutBy | None = None,
) -> LightPlate:
    """Return a light's ``plate`` at an instant between two, its ``ends``, with its own ways counted in where it does
    not move by ``motion``. What is clipped in either end stays as it is. ``put_by`` takes its codes."""
    ways = own.ways(motion.time_s)
    moves = cv2.resize(motion.moves.view(np.uint8), own.behind.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0
    shares = [share * ~moves for share in own.shares(ways, motion.time_s)]
    if not any(share.any() for share in shares):
        return plate
    sides = tuple(_Side(plate=end, span_s=np.float32(motion.time_s - end.time_s)) for end in ends)
    late = float(np.clip(sides[0].span_s / (sides[0].span_s - sides[1].span_s), 0, 1))
    layers = _Layers(
        plate=plate, sides=sides, counts=(1 - late, late), behind=own.behind, ways=tuple(ways), shares=tuple(shares)
    )
    packing = Packing.of(plate.shape)

    def fill(top: int, bottom: int) -> None:
        packing.put(top, layers.band(range(top, bottom)))

    over_ranges(fill, plate.shape[0], each=BAND_ROWS)
    return replace(plate, picture=packing.picture(plate.saturation, put_by))


@dataclass(frozen=True, kw_only=True)
class _Side:
    """One of the two plates, and how long before the instant it flashed."""

    plate: LightPlate
    span_s: np.float32

    def rows(self, some: range) -> tuple[Image, Flags]:
        """Return rows of the picture, and what of them its own flash showed (row, col)."""
        own = np.broadcast_to(self.plate.own, self.plate.shape[:2])
        return self.plate.picture.rows(some), own[some.start : some.stop]


@dataclass(frozen=True, kw_only=True)
class _Layers:
    """A ``plate`` at an instant, which is so far the fade of its two ``sides``, and what replaces that fade.

    What is shown is: plate + sum over ways of share x (fade of both sides moved along the way - fade of both sides).

    ``counts`` are the sides' weights in a fade, 1 together. The others have flow's resolution, below the plate's:
    ``behind`` (row, col) is which share of a pixel is not hidden by what stands before it, ``ways`` are velocities
    (2, row, col) in its pixels a second, and ``shares`` (row, col), one for each way, what the way counts.
    """

    plate: LightPlate
    sides: tuple[_Side, ...]
    counts: tuple[float, float]
    behind: Floats
    ways: tuple[Floats, ...]
    shares: tuple[Floats, ...]

    def band(self, band: range) -> Image:
        """Return rows of the plate, with its own ways in it."""
        given = self.plate.picture.rows(band)
        shares = [self._of(share, band) for share in self.shares]
        if not any(share.any() for share in shares):
            return given
        scale = [many / few for many, few in zip(self.plate.shape[1::-1], self.behind.shape[::-1], strict=True)]
        ways = [[np.float32(by) * self._of(one, band) for by, one in zip(scale, way, strict=True)] for way in self.ways]
        some = self._around(band, [way[1] for way in ways])
        pictures, known, clips = self._filled(some, scale[1])
        first, here = band.start - some.start, slice(band.start - some.start, band.stop - some.start)
        fade, image = self._mean([picture[here] for picture in pictures]), given.copy()
        for way, share in zip(ways, shares, strict=True):
            spans_s = [side.span_s for side in self.sides]
            moved = [_along(picture, way, span_s, first) for picture, span_s in zip(pictures, spans_s, strict=True)]
            image += _like(share * known[here], given) * (self._mean(moved) - fade)
        most = np.float32(self.plate.saturation) * JUST_BELOW
        return np.where(_like(clips[here], given), given, np.minimum(image, np.maximum(given, most)))

    def _of(self, values: Floats, band: range) -> Floats:
        """Return values of flow's pixels (row, col) for rows of the plate."""
        rows, cols = self.plate.shape[:2]
        x, y = pixel_places(len(band), cols)
        x = (x + HALF) * np.float32(values.shape[1] / cols) - HALF
        y = (y + np.float32(band.start) + HALF) * np.float32(values.shape[0] / rows) - HALF
        return np.asarray(cv2.remap(values, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)

    def _around(self, band: range, down: Sequence[Floats]) -> range:
        """Return the rows that a band's ways lead to, and those beside them."""
        ways = [float(side.span_s * end) for side in self.sides for one in down for end in (one.min(), one.max())]
        first, last = math.floor(-max(*ways, 0)) - MARGIN_ROWS, math.ceil(-min(*ways, 0)) + MARGIN_ROWS
        return range(max(band.start + first, 0), min(band.stop + last, self.plate.shape[0]))

    def _filled(self, some: range, scale: float) -> tuple[list[Image], Floats, Flags]:
        """Return rows of both sides without what stands, where both are known (row, col), and where either clips."""
        (one, shown), (other, shown_too) = (side.rows(some) for side in self.sides)
        full = np.float32(self.plate.saturation)
        clips = (brightest_channel(one) >= full) | (brightest_channel(other) >= full)
        weight = self._of(self.behind, some) * (shown | shown_too)
        pair = np.where(_like(shown, one), one, other), np.where(_like(shown_too, one), other, one)
        return [filled(side, weight, FILL_PX * scale) for side in pair], (shown & shown_too).astype(np.float32), clips

    def _mean(self, two: Sequence[Image]) -> Image:
        return np.asarray(np.float32(self.counts[0]) * two[0] + np.float32(self.counts[1]) * two[1], np.float32)


def _along(picture: Image, way: Sequence[Floats], span_s: np.float32, first: int) -> Image:
    """Return what a picture shows where the rows from ``first`` on were so long ago."""
    x, y = pixel_places(*way[0].shape)
    x, y = x - span_s * way[0], y + np.float32(first) - span_s * way[1]
    moved = cv2.remap(picture, x, y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(moved, np.float32).reshape(*way[0].shape, *picture.shape[2:])


def _like(values: Floats | Flags, image: Image) -> Floats | Flags:
    return values if image.ndim == 2 else values[..., None]
