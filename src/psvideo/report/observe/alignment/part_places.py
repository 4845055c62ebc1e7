"""By how far pictures of one scene that were taken under one light each lie off in a part of the picture.

Under distant lights a matte surface sends every lamp its direction times one vector per pixel, so that of more than
three lights what cannot be so is left over. Of a picture that lies ``d`` off, that is ``-g . d``, ``g`` being the
slopes of its brightness: linear least squares over many pixels gives every picture's place, but for what is common to
all (B. Lucas and T. Kanade, "An iterative image registration technique", IJCAI 1981, with the surface as the template).
Only fine detail is asked: shading, gloss and light by way of other surfaces are broad. Detail of one size sees no
more than its own width, so that what lies farther off is looked for in pictures that are made smaller.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Doubles
from psvideo.plates.light_plate import LightPlate
from psvideo.report.observe.rig_and_curve.rigpoints import CHANNEL, RigPoints

PARTS, PART_PX = 4, 160
"""Parts down and across the subject, and the pixels of each that are looked at."""
FINE_PX, BROAD_PX = 1.0, 4.0
"""Detail is what a blur of the first (standard deviation) leaves and one of the second does not."""
LIT, DARK = 0.06, 0.03
"""A lamp reaches a pixel that has this share of what the brightest gives it, by their strengths, and a pixel counts
that has this share of the picture's brightest hundredth."""
CLEAR_PX = 9
"""No edge of a shadow is so near (half of a square of this side): it moves with the lamp."""
LEAST_PIXELS = 150
SLACK = 1e-3
"""What is common to all pictures is not known: it is taken for none."""


@dataclass(frozen=True, kw_only=True)
class PartPlaces:
    """Where pictures lie in one part of them, in pixels of the looked-at (reduced) pictures, columns and rows.

    ``middle`` (2,) is the part's; ``found`` (light, 2) are their places from the mean of all; ``square`` and ``right``
    the normal equations these come from, columns of all lights first; ``left`` what the rig cannot explain as they
    lie (sum of squares), and ``agreement`` (light,) the correlation of each picture's detail with what the others
    make of it.
    """

    middle: Doubles
    found: Doubles
    square: Doubles
    right: Doubles
    left: float
    agreement: Doubles

    def explained(self, places: Doubles) -> float:
        """Return the share of ``left`` that pictures at some ``places`` (light, 2) would explain."""
        flat = places.T.ravel()
        return float(flat @ (2 * self.right - self.square @ flat)) / max(self.left, 1e-30)


def places_of_parts(
    plates: Sequence[LightPlate], points: RigPoints, lights: Sequence[int], box: tuple[slice, slice], *, reduced: int
) -> list[PartPlaces]:
    """Return what parts of ``box`` (rows, columns) say of some ``lights``' plates, of pictures ``reduced`` times."""
    asked = [plates[light] for light in lights]
    found = (
        _places(asked, part, _vectors_at(points, part)[list(lights)], reduced=reduced)
        for part in _parts(box, side_px=PART_PX * reduced)
    )
    return [one for one in found if one is not None]


def _parts(box: tuple[slice, slice], *, side_px: int) -> Iterator[tuple[slice, slice]]:
    """Yield the middles of equal parts of a box."""
    edges = [np.linspace(side.start, side.stop, PARTS + 1).astype(int) for side in box]
    downs, acrosses = (
        [slice(max(a, (a + b - side_px) // 2), min(b, (a + b + side_px) // 2)) for a, b in pairwise(side.tolist())]
        for side in edges
    )
    parts = ((down, across) for down in downs for across in acrosses)
    yield from (part for part in parts if all(side.start < side.stop for side in part))


def _vectors_at(points: RigPoints, part: tuple[slice, slice]) -> Doubles:
    """Return what the rig sends to the middle of a part, (light, 3)."""
    if len(points.vectors) == 1:
        return np.asarray(points.vectors[0], np.float64)
    row, col = ((side.start + side.stop) / 2 for side in part)
    nearest = int(np.hypot(points.rows - row, points.cols - col).argmin())
    return np.asarray(points.vectors[nearest], np.float64)


def _places(
    plates: Sequence[LightPlate], part: tuple[slice, slice], vectors: Doubles, *, reduced: int
) -> PartPlaces | None:
    """Return where each plate lies in a part of the picture; None where too little is lit by all lamps."""
    if min(side.stop - side.start for side in part) < reduced * CLEAR_PX:
        return None
    light, whole = (np.stack(each) for each in zip(*(_cut(plate, part, reduced) for plate in plates), strict=True))
    clear = _clear(light, whole, vectors)
    if clear.sum() < LEAST_PIXELS:
        return None
    fine = [cv2.GaussianBlur(one, (0, 0), FINE_PX) - cv2.GaussianBlur(one, (0, 0), BROAD_PX) for one in light]
    slopes = [np.gradient(one, axis=axis)[clear] for axis in (1, 0) for one in fine]
    explained = vectors @ np.linalg.pinv(vectors)
    left_of = np.eye(len(plates)) - explained
    detail = np.stack([one[clear] for one in fine]).astype(np.float64)
    left = left_of @ detail
    every = np.stack(slopes).astype(np.float64)
    square = np.tile(left_of, (2, 2)) * (every @ every.T)
    right = -(every * np.tile(left, (2, 1))).sum(axis=1)
    found = np.linalg.solve(square + SLACK * np.trace(square) / len(square) * np.eye(len(square)), right)
    places = found.reshape(2, -1).T
    others = detail - left / np.maximum(1 - np.diag(explained), 1e-9)[:, None]
    return PartPlaces(
        middle=np.array([(side.start + side.stop) / 2 / reduced for side in part[::-1]]),
        found=np.asarray(places - places.mean(axis=0)),
        square=square,
        right=right,
        left=float((left**2).sum()),
        agreement=_correlations(detail, others),
    )


def _correlations(one: Doubles, other: Doubles) -> Doubles:
    one, other = (each - each.mean(axis=1, keepdims=True) for each in (one, other))
    size = np.sqrt((one**2).sum(axis=1) * (other**2).sum(axis=1))
    return np.asarray((one * other).sum(axis=1) / np.maximum(size, 1e-30))


def _cut(plate: LightPlate, part: tuple[slice, slice], reduced: int) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Return a part of a plate, made smaller, and where nothing of it is clipped."""
    down, across = part
    rows = plate.picture.rows(range(down.start, down.stop))[:, across]
    light = np.ascontiguousarray(rows if rows.ndim == 2 else rows[..., CHANNEL], np.float32)
    whole = light < plate.saturation
    if reduced == 1:
        return light, whole
    share = _smaller(whole.astype(np.float32), reduced)
    return _smaller(light, reduced), share > 1 - 0.5 / reduced**2


def _smaller(image: NDArray[np.float32], times: int) -> NDArray[np.float32]:
    height, width = (side // times for side in image.shape)
    whole = image[: height * times, : width * times]
    return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), np.float32)


def _clear(light: NDArray[np.float32], whole: NDArray[np.bool_], vectors: Doubles) -> NDArray[np.bool_]:
    """Return where every lamp shines and clips nothing, with room to the nearest edge of a shadow."""
    strengths = np.linalg.norm(vectors, axis=1).astype(np.float32)
    even = light / np.maximum(strengths, np.float32(1e-9))[:, None, None]
    top = even.max(axis=0)
    good = (whole & (even > LIT * top)).all(axis=0) & (top > DARK * np.percentile(top, 99))
    eroded = cv2.erode(good.astype(np.uint8), np.ones((CLEAR_PX, CLEAR_PX), np.uint8), borderValue=0)
    return np.asarray(eroded > 0)
