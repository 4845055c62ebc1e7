"""How rows of frames add up to a flash's plate: coefficients from timing and camera alone, never from pixels.

``plate[i] = sum_n coefficients[n, i] * frame[n, i]`` shows what row i would have recorded of the whole flash, and holds
the ambient light of ``exposures[i]`` exposures. Flash by flash, never frame by frame: where one frame holds all
of a flash in a row, that frame is taken alone, because others would add only noise; where a row is split over two
frames, they are summed (Hudon et al. 2015, eq. 10), which is the best estimate under photon noise, and divided by the
share that they saw together, which is 1 at 360 degrees.

Rows in which the frames also saw some of a neighbouring flash (an LED's tail, or a dark time that is too short) have it
taken off: with the weights W (flash, frame) and these first coefficients C (flash, frame) of the flashes around, the
sums hold ``C W^T`` of the plates, so ``(C W^T)^-1 C`` holds each alone. The coefficients of the neighbours' frames are
small and negative. Frames that saw hardly any of a flash take no part in its sum: they would bring in later flashes, of
which nothing is known here.
"""

from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles, Flags
from psvideo.model.camera import Camera
from psvideo.model.rows.shutter import Pulse, frames_touched, row_weights
from psvideo.model.timing import Flash, Timing

WHOLE = 1.0 - 1e-9
"""A row that saw this share of a square flash saw all of it."""
WHOLE_BUT_TAIL = 1.0 - 1e-3
"""A row that saw this share of a flash with tails, which never quite end, saw all of it."""
LEAST_SHARE = 0.12
"""A row that saw less of a flash than this is unseen: dividing by it brings up noise, and another round may show it."""
LEAST_PART = 1e-3
"""A frame's row that saw less of a flash than this takes no part in its sum: tails never quite end."""
NO_FOREIGN = 1e-5
"""Less of another flash in a row is below the last bit of a code."""
MOST_FOREIGN = 0.3
"""A frame's row into which more of other flashes was mixed than this is not used."""
CLEAN = 0.01
"""A dark slot's exposures that saw less of other flashes are enough by themselves where there are any; a flash's where
they saw less of others than this share of what they saw of itself."""
MOST_LEFT = 0.01
"""Of other flashes that cannot be taken off this much may be left in a row; with more it is unseen."""
MOST_GAIN = 2.5
"""Taking neighbours off may raise noise (as its square) this many times at most."""
LEAST_DETERMINANT = 1e-3
"""Sums that hold the same mixture of flashes cannot be separated."""
NEIGHBOURS, FARTHEST = 2, 4
"""So many flashes before and after may reach into a flash's rows, and so many more into the rows of these."""


@dataclass(frozen=True, kw_only=True)
class FlashRecipe:
    """How one flash's plate is made.

    frames: indices of the frames that take part, ascending. coefficients: (frame, row). seen: (row,), False where the
    frames that are there saw too little of the flash; its coefficients are 0.
    """

    frames: tuple[int, ...]
    coefficients: Doubles
    seen: Flags

    @property
    def exposures(self) -> Doubles:
        """How many exposures' worth of ambient light the plate holds, shape (row,)."""
        total: Doubles = self.coefficients.sum(axis=0)
        return total


def frames_of(camera: Camera, timing: Timing, flash: Flash) -> range:
    """Return the frames that a flash's recipe may use: those that saw it, and those that saw what must be taken off."""
    near = _around(timing, flash) if _may_mix(camera, timing) else (flash,)
    start_s, duration_s = _times(near)
    first, last = frames_touched(camera, start_s, duration_s, pulse=timing.pulse)
    return range(int(first.min()), int(last.max()) + 1)


def flash_recipe(camera: Camera, timing: Timing, flash: Flash, there: range | frozenset[int]) -> FlashRecipe:
    """Return how to make a flash's plate of the frames that are ``there`` (indices); dark slots are averaged.

    A neighbour whose own frames are not there cannot be taken off: where it reaches into a row, only frames that saw
    hardly any of it are used, and the row is unseen where there are none.
    """
    frames = frames_of(camera, timing, flash)
    present = np.array([index in there for index in frames])
    near = [one for one in _around(timing, flash) if not one.is_dark and one.index != flash.index]
    start_s, duration_s = _times((flash, *near))
    weights = row_weights(camera, start_s, duration_s, frames=frames, pulse=timing.pulse)
    if flash.is_dark:  # nothing shines in it, so nothing has a tail
        weights[0] = row_weights(camera, start_s[:1], duration_s[:1], frames=frames)[0]
    beyond = _beyond(camera, timing, flash, frames)
    weights[:, ~present], beyond[~present] = 0.0, 0.0
    coefficients, seen = _separated(weights, beyond, whole=_whole(timing.pulse), dark=flash.is_dark)
    used = np.flatnonzero(coefficients.any(axis=1))
    return FlashRecipe(frames=tuple(frames[n] for n in used), coefficients=coefficients[used], seen=seen)


def _may_mix(camera: Camera, timing: Timing) -> bool:
    """Whether any row can see light of two flashes: LEDs have tails, or the dark time is shorter than the exposure."""
    if timing.pulse.fall_s > 0:
        return True
    return bool(timing.shortest_gap_s < camera.exposure_s + np.ptp(camera.within_row_s()))


def _around(timing: Timing, flash: Flash) -> tuple[Flash, ...]:
    return timing.flashes[max(flash.index - NEIGHBOURS, 0) : flash.index + NEIGHBOURS + 1]


def _beyond(camera: Camera, timing: Timing, flash: Flash, frames: range) -> Doubles:
    """Return how much the frames' rows saw of flashes that are not taken off, (frame, row)."""
    none: Doubles = np.zeros((len(frames), camera.height_px))
    if not _may_mix(camera, timing):
        return none
    near = range(flash.index - NEIGHBOURS, flash.index + NEIGHBOURS + 1)
    around = timing.flashes[max(near.start - FARTHEST, 0) : near.stop + FARTHEST]
    others = tuple(one for one in around if not one.is_dark and one.index not in near)
    return row_weights(camera, *_times(others), frames=frames, pulse=timing.pulse).sum(axis=0) if others else none


def _times(flashes: tuple[Flash, ...]) -> tuple[Doubles, Doubles]:
    return np.array([one.start_s for one in flashes]), np.array([one.duration_s for one in flashes])


def _whole(pulse: Pulse) -> float:
    return WHOLE_BUT_TAIL if pulse.fall_s > 0 else WHOLE


def _separated(weights: Doubles, beyond: Doubles, *, whole: float, dark: bool) -> tuple[Doubles, Flags]:
    """Return the coefficients (frame, row) of the first of the flashes, and which rows are seen.

    ``weights`` is (flash, frame, row); ``beyond`` (frame, row) is what is not taken off. Where a neighbour cannot be
    taken off, or only at the price of noise, the frames that saw hardly any of it must do.
    """
    foreign = weights.sum(axis=0) + beyond - weights
    some = weights * (foreign <= MOST_FOREIGN)
    first = np.stack([_first(*one, whole=whole, dark=False) for one in zip(some, foreign, strict=True)])
    if dark:
        first[0] = _first(some[0], foreign[0], whole=whole, dark=True)
    own = first[0].copy()
    mixed = np.einsum("fr,kfr->kr", own, weights[1:])  # what the first sum holds of the other flashes
    rows = np.flatnonzero((np.abs(mixed) > NO_FOREIGN).any(axis=0) | ((own * beyond).sum(axis=0) > NO_FOREIGN))
    if rows.size:
        own[:, rows], kept = _taken_off(first[:, :, rows], weights[:, :, rows], dark=dark)
        others = np.concatenate([weights[1:, :, rows], beyond[None, :, rows]])
        kept &= (np.abs(np.einsum("fr,kfr->kr", own[:, rows], others)) <= MOST_LEFT).all(axis=0)
        kept &= (own[:, rows] ** 2).sum(axis=0) <= MOST_GAIN * (first[0][:, rows] ** 2).sum(axis=0)
        most = CLEAN if dark else CLEAN * weights[0]
        clean = _first(weights[0] * (foreign[0] <= most), foreign[0], whole=whole, dark=dark)
        own[:, rows[~kept]] = clean[:, rows[~kept]]
    return own, np.asarray(own.any(axis=0))


def _first(seen: Doubles, foreign: Doubles, *, whole: float, dark: bool) -> Doubles:
    """Return the coefficients (frame, row) of a flash of which so much was ``seen`` as if there were no other: one
    whole frame alone, else all that saw some; of a dark slot the mean of the exposures that fell into it."""
    if dark:
        clean = (seen > 0) & (foreign <= CLEAN)
        used = np.where(clean.any(axis=0), clean, seen > 0)
        mean: Doubles = used / np.maximum(used.sum(axis=0), 1)
        return mean
    full = seen >= whole
    alone = full & (np.cumsum(full, axis=0) == 1)
    used = np.where(full.any(axis=0), alone, seen > LEAST_PART)
    share = (seen * used).sum(axis=0)
    coefficients: Doubles = used * np.where(share >= LEAST_SHARE, 1.0 / np.maximum(share, LEAST_SHARE), 0.0)
    return coefficients


def _taken_off(first: Doubles, weights: Doubles, *, dark: bool) -> tuple[Doubles, Flags]:
    """Return the first flash's coefficients (frame, row) with the others taken off, and the rows where sums can be
    separated. A flash of which no frame there saw enough is not taken off."""
    holds = np.einsum("jfr,kfr->rjk", first, weights)  # what the sum for flash j holds of flash k
    known: Flags = np.asarray(first.any(axis=1))  # (flash, row)
    matrix = np.where(known.T[:, :, None], holds, np.eye(len(weights)))
    if dark:
        matrix[:, :, 0], matrix[:, 0, 0] = 0.0, 1.0
    separable: Flags = np.abs(np.linalg.det(matrix)) > LEAST_DETERMINANT
    matrix[~separable] = np.eye(len(weights))
    inverse = np.linalg.inv(matrix)
    own: Doubles = np.einsum("rj,jfr->fr", inverse[:, 0, :], first)
    return own, separable
