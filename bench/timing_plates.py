"""Plates rebuilt with a timing, against their truth, least squares that know the true timing, and Algorithm 1."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solveh_banded

from psvideo.model.camera import Camera
from psvideo.model.coded import Coded
from psvideo.model.plan import Plan
from psvideo.model.timing import Timing
from psvideo.plates import hudon2015
from psvideo.plates.ambient.ambient_off import subtract
from psvideo.plates.split import Plate, split
from psvideo.synth import TrueFlash
from psvideo.synth.camera.sensor import seen_share
from psvideo.synth.lamps.emission import Emission
from psvideo.synth.lamps.true_flashes import row_opens_s

Picture = np.ndarray
LEAST_SHARE = 0.05
"""Rows that saw less of a flash in all frames are not compared."""
UNCLIPPED = 0.95
"""Nor are pixels that come nearer to saturation."""
TOUCHED = 5
"""Frames that a flash may touch, a LED's tail included."""


@dataclass(frozen=True)
class HeldFrame:
    """A frame in memory."""

    index: int
    image: Picture

    @property
    def coded(self) -> Coded:
        """The picture in codes: light as it is."""
        return Coded(codes=np.ascontiguousarray(self.image, np.float32))


@dataclass(frozen=True, kw_only=True)
class PlateErrors:
    """RMS errors as a share of the plates' own RMS; ``left_out`` is the share of rows that could have been rebuilt."""

    ours: float
    oracle: float
    algorithm1: float
    left_out: float


def plate_errors(
    plan: Plan,
    timing: Timing,
    frames: Sequence[HeldFrame],
    *,
    claimed: Camera,
    true_frames: Mapping[int, Picture],
    flashes: Sequence[TrueFlash],
    plate_of: Callable[[TrueFlash], Picture],
    ambient: float,
    scale: float,
) -> PlateErrors:
    """Rebuild a clip's plates and compare them. ``frames`` stand where the timing says, ``true_frames`` where they are.

    ``plan`` is the true one and ``claimed`` the camera as plan.toml has it, whose seconds are ``scale`` times as long.
    """
    camera = replace(claimed, exposure_s=timing.exposure_s, readout_s=timing.row_time_s * plan.camera.height_px)
    ours = _without_ambient(list(split(iter(frames), camera, timing)), timing)
    by_algorithm_1 = _without_ambient(list(hudon2015.split(frames, camera, timing)), timing)
    published = {plate.flash.index: plate for plate in by_algorithm_1}
    shares, solved = oracle(plan, flashes, true_frames)
    true_s = np.array([flash.start_s for flash in flashes]) * scale
    sums = np.zeros(5)
    rows = np.zeros(2)
    for plate in ours:
        if plate.flash.is_dark:
            continue
        k = int(np.abs(true_s - plate.flash.start_s).argmin())
        truth = plate_of(flashes[k])
        possible = shares[k] >= LEAST_SHARE
        rows += possible.sum(), (possible & ~plate.seen).sum()
        mask = (possible & plate.seen)[:, None] & (truth + ambient < UNCLIPPED)
        sums[:3] += [((p - truth)[mask] ** 2).sum() for p in (np.zeros_like(truth), plate.image, solved[k])]
        if plate.flash.index in published:
            sums[3] += (truth[mask] ** 2).sum()
            sums[4] += ((published[plate.flash.index].image - truth)[mask] ** 2).sum()
    return PlateErrors(
        ours=float(np.sqrt(sums[1] / sums[0])),
        oracle=float(np.sqrt(sums[2] / sums[0])),
        algorithm1=float(np.sqrt(sums[4] / max(sums[3], 1e-30))),
        left_out=float(rows[1] / rows[0]),
    )


def _without_ambient(plates: list[Plate], timing: Timing) -> list[Plate]:
    """Take the ambient light off between the dark slots before and after, as the pipeline does."""
    darks = [plate for plate in plates if plate.flash.is_dark]
    return list(subtract(plates, darks=darks, ripple=timing.mains if darks else None))


def oracle(plan: Plan, flashes: Sequence[TrueFlash], frames: Mapping[int, Picture]) -> tuple[np.ndarray, np.ndarray]:
    """Solve all plates of a clip by least squares with the true timing, one constant ambient picture where dark slots
    show it; return what share of each flash each row saw, (flash, row), and the plates, (flash, row, col)."""
    weights, first = _true_weights(plan, flashes, frames)
    indices = np.array(sorted(frames))
    pictures = np.stack([frames[n] for n in indices]).astype(np.float64)
    place = np.searchsorted(indices, first[:, None] + np.arange(TOUCHED))
    lit = [k for k, flash in enumerate(flashes) if not flash.is_dark]
    solved = np.zeros((len(flashes), *pictures.shape[1:]))
    with_ambient = len(lit) < len(flashes)
    at = np.clip(place, 0, len(indices) - 1)
    for row in range(pictures.shape[1]):
        solved[lit, row] = _solve_row(weights[lit, :, row], at[lit], first[lit], pictures[:, row], with_ambient)
    return weights.sum(axis=1), solved


def _true_weights(plan: Plan, flashes: Sequence[TrueFlash], frames: Iterable[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return what every row saw of every flash, (flash, TOUCHED, row), and the frames from which on, (flash,)."""
    camera, emission = plan.camera, Emission(rise_s=plan.rise_s, fall_s=plan.fall_s)
    spread_s = float(row_opens_s(camera).max()) + camera.exposure_s
    present = set(frames)
    first = np.array([int(np.floor((flash.start_s - spread_s) / camera.frame_period_s)) + 1 for flash in flashes])
    weights = np.zeros((len(flashes), TOUCHED, camera.height_px))
    for k, flash in enumerate(flashes):
        for step in range(TOUCHED):
            if first[k] + step in present:
                weights[k, step] = seen_share(camera, emission, flash, int(first[k]) + step)
    return weights, first


def _solve_row(
    weights: np.ndarray, at: np.ndarray, first: np.ndarray, values: np.ndarray, with_ambient: bool
) -> np.ndarray:
    """Solve one row's normal equations, whose flashes meet only their neighbours; ambient light borders them."""
    count, cols = len(weights), values.shape[1]
    bands = np.zeros((TOUCHED, count))
    for near in range(TOUCHED):
        for a in range(TOUCHED):
            for_b = first[: count - near] + a - first[near:]
            inside = (for_b >= 0) & (for_b < TOUCHED)
            k = np.flatnonzero(inside)
            bands[near, k] += weights[k, a] * weights[k + near, for_b[k]]
    bands[0] += 1e-9
    right = np.einsum("ka,kac->kc", weights, values[at])
    if not with_ambient:
        return np.asarray(solveh_banded(bands, right, lower=True))
    border = weights.sum(axis=1)
    both = solveh_banded(bands, np.column_stack([right, border]), lower=True)
    rest = len(values) - border @ both[:, cols]
    ambient = (values.sum(axis=0) - border @ both[:, :cols]) / rest
    return np.asarray(both[:, :cols] - both[:, cols:] * ambient)
