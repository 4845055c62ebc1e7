"""A round of plates as the solver takes it: on one scale, evened where light falls off, with what of it counts."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Masks
from psvideo.model.arrays import Floats, Mask
from psvideo.model.irradiance.intensity import image_evened, image_per_saturation
from psvideo.plates.sequence import Round
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.lit_plates import LitPlates, Plates
from psvideo.solve.steady import SHOWN


@dataclass(frozen=True, kw_only=True)
class GivenRound:
    """A round as ``LitPlates`` but for their light, which near lights' change as the surface is found. ``seen`` is what
    every light shows, ``shown`` the same, or None where that is all."""

    plates: Plates
    seen: Mask
    shown: Mask | None
    mask: Mask | None
    unsure: Floats | None
    moves: Mask | None
    steadied: bool
    arc_deg: Floats | None = None

    @classmethod
    def of(cls, one: Round, *, masks: Masks | None, shares: Sequence[NDArray[np.float32]] | None) -> "GivenRound":
        """``masks`` say where to solve; ``shares`` (row, col), one per light, which part of its light arrives where."""
        whole = all(plate.seen.ndim == 1 for plate in one.plates)
        seen = np.stack([plate.seen if whole else plate.pixels_seen for plate in one.plates])
        return cls(
            plates=_pictures(one, shares),
            seen=seen,
            shown=None if seen.all() else seen,
            mask=None if masks is None else masks.at(one.number),
            unsure=_unsure(one, shares),
            moves=None if one.motion is None else one.motion.moves,
            steadied=one.motion is not None and one.motion.steadied,
            arc_deg=None if one.motion is None else one.motion.arc_deg,
        )

    def under(self, lit: Illumination) -> LitPlates:
        """Return the plates as this light shows them."""
        return LitPlates(
            self.plates,
            lit,
            seen=self.shown,
            mask=self.mask,
            unsure=self.unsure,
            moves=self.moves,
            steadied=self.steadied,
            arc_deg=self.arc_deg,
        )

    @property
    def shown_by_all(self) -> Mask:
        """The rows and columns that every light showed at least a part of, (row, col) or (row, 1) or (1, 1): frames
        that are missing lack whole ones, motion hides parts."""
        if self.shown is None:
            return SHOWN
        if self.shown.ndim == 2:
            return np.asarray(np.logical_and.reduce(self.shown), np.bool_)[:, None]
        rows, cols = (np.any(self.shown, axis=axis, keepdims=True).all(axis=0) for axis in (2, 1))
        return np.asarray(rows & cols)


def _pictures(one: Round, shares: Sequence[NDArray[np.float32]] | None) -> Plates:
    """Return a round's plates on a scale on which they are clipped at 1.0, and evened; made only where that asks it."""
    if shares is None and all(plate.saturation == 1.0 for plate in one.plates):
        return [plate.picture for plate in one.plates]
    plates = [image_per_saturation(plate.image, plate.saturation) for plate in one.plates]
    if shares is None:
        return plates
    return [image_evened(plate, share) for plate, share in zip(plates, shares, strict=True)]


def _unsure(one: Round, shares: Sequence[NDArray[np.float32]] | None) -> NDArray[np.float32] | None:
    """Return by how much a round's plates may be off for motion, on the scale of ``_pictures``."""
    if one.unsure is None:
        return None
    each = [plane / np.float32(plate.saturation) for plane, plate in zip(one.unsure, one.plates, strict=True)]
    if shares is not None:
        size = one.unsure.shape[:0:-1]
        small = [np.asarray(cv2.resize(share, size, interpolation=cv2.INTER_AREA), np.float32) for share in shares]
        each = [image_evened(plane, share) for plane, share in zip(each, small, strict=True)]
    return np.stack(each)
