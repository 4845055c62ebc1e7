"""By how much normals may be off because plates that were brought to one instant do not agree."""

from dataclasses import dataclass

import cv2
import numpy as np

from psvideo.plates.align.own_means import own_mean
from psvideo.solve.normals.doubting import ThinSurface, width_of
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.task import Floats, Mask

MOST_DEG = np.float32(180)
"""What turns a normal by more is no angle: nothing is known of its plates."""


@dataclass(frozen=True, kw_only=True)
class MovingDoubt:
    """How plates before and after an instant that disagree along the motion become degrees of doubt.

    own: how much of the angle that this makes in a pixel itself.
    around_deg, around: where the mean angle over a square of such a share of the subject's size is so large, it counts
        as well, and the square of it elsewhere: where most of what is around is not explained, what fits does so by
        chance.
    torn, least_torn_deg: how much of the angle counts by which normals belong to no surface, beyond what creases and
        outlines of a painted bust at rest make of it.
    torn_around, least_around_deg, torn_around_deg: and of its mean over a square of such a share, beyond the first, the
        square over the second: what is wrong throughout (blades, a checker) is hardly torn in the middle of a facet.
    near, stirring_deg, stirring_share: all of that where anything stirs: motion turns at least such a share of a square
        so wide by more than such an angle, or is followed there.

    Fitted on a mottled ball, a painted bust and a bare box of 3, 5 and 8 lights that slide, spin and tumble by 1 to 16
    px from flash to flash: nine tenths of what is measured is off by no more than twice what is predicted. What is torn
    counts by turning fans as well; a vase, a checkered ball, a cloth and two things that cross were not looked at.
    """

    own: float = 1.6
    around_deg: float = 3.0
    around: float = 0.1
    torn: float = 1.0
    least_torn_deg: float = 3.0
    least_around_deg: float = 2.0
    torn_around: float = 0.15
    torn_around_deg: float = 2.0
    near: float = 0.3
    stirring_deg: float = 0.5
    stirring_share: float = 0.02


def moved_deg(points: ThinSurface, one: Evidence) -> Floats | None:
    """Return by which angle what is unsure of the plates turns the points' normals, in degrees; None where nothing
    moved.

    The errors of lights are taken as independent, and spread as least squares spreads them across the normal.
    """
    if one.unsure is None or not one.unsure.any():
        return None
    rows, cols = points.surface.valid.shape
    normals = points.surface.normals.astype(np.float32)
    matrix = one.lit.directions * one.lit.intensities.mean(axis=1)[:, None]
    turned = np.zeros((rows, cols), np.float32)
    for pull, plane in zip(np.linalg.pinv(matrix).T.astype(np.float32), one.unsure, strict=True):
        across = np.float32(pull @ pull) - (normals @ pull) ** 2
        off = cv2.resize(plane, (cols, rows), interpolation=cv2.INTER_LINEAR)
        turned += np.maximum(across, 0) * off * off
    albedo = points.surface.albedo
    size = albedo if albedo.ndim == 2 else albedo.mean(axis=-1)
    return np.asarray(np.degrees(np.sqrt(turned) / np.maximum(size, np.float32(1e-6))) * points.known, np.float32)


def moving_doubt_deg(
    turned_deg: Floats, torn_deg: Floats, known: Floats, moves: Mask | None = None, *, how: MovingDoubt = MovingDoubt()
) -> Floats:
    """Return by how many degrees normals may be off for motion, (row, col) of the points.

    ``torn_deg`` is by how much normals belong to no surface: where motion was followed to the wrong place, plates of
    the lights show edges beside each other, and normals between them fit nothing around. What moves and what stands
    still, on a grid of its own, ``moves``, do not speak for each other.
    """
    size, own = (width_of(known, how.around),) * 2, np.zeros(known.shape, np.bool_)
    if moves is not None:
        grown = cv2.resize(moves.astype(np.uint8), known.shape[::-1], interpolation=cv2.INTER_NEAREST)
        own = grown > 0
    tells = known * (turned_deg <= MOST_DEG)  # beyond that nothing is known, and nothing is said of what is around
    turned = own_mean(np.minimum(turned_deg, np.float32(60)) * tells, size, own)
    around = turned / np.maximum(own_mean(tells, size, own), np.float32(1e-6))
    apart = _torn_doubt(turned_deg, torn_deg, tells, own, how)
    return np.asarray(
        np.float32(how.own) * turned_deg + around * around / np.float32(how.around_deg) + apart, np.float32
    )


def _torn_doubt(turned_deg: Floats, torn_deg: Floats, known: Floats, moves: Mask, how: MovingDoubt) -> Floats:
    near, size = ((width_of(known, share),) * 2 for share in (how.near, how.torn_around))
    stirs = cv2.blur(((turned_deg > how.stirring_deg) | moves).astype(np.float32), near)
    around = cv2.blur(torn_deg * known, size) / np.maximum(cv2.blur(known, size), np.float32(1e-6))
    own = np.maximum(torn_deg - np.float32(how.least_torn_deg), 0)
    around = np.maximum(around - np.float32(how.least_around_deg), 0)
    apart = np.float32(how.torn) * own + around * around / np.float32(how.torn_around_deg)
    return np.asarray(apart * np.minimum(stirs / np.float32(how.stirring_share), 1), np.float32)
