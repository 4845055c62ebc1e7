"""What plates show of their noise: how samples differ from those beside them, and from those farther away."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median, quantile
from psvideo.model.arrays import Doubles, Samples
from psvideo.plates.mixing.mixture import Mixture

APART_PX = 4
"""Demosaicing and filters make neighbours alike: over less than this. It is even, for mosaics repeat after two."""
FEWER = 3
"""Of large pictures so many times fewer rows are looked at for what is apart, and more of each."""
ROWS = 24
"""Noise is looked for around about this many rows of every plate, evenly spread: of small pictures around more."""
CODE_SAMPLES, LEAST_CODES, ALIKE, COARSEST, FINEST = 1 << 12, 5, 1.25, 0.025, 0.0003
"""This many samples of a plate show whether it holds a file's codes: it then has few values, but at least LEAST_CODES,
which most samples share, and half of the gaps between neighbouring ones are alike up to this factor. Codes of eight
bits are no farther apart, whatever their curve (HLG: 0.021 at the top). Gaps that are all finer are no codes."""
LOW_SHARE, LOW_OF_VARIANCE = 0.25, 0.1015
"""Noise comes from the lowest quarter of squared differences, for up to three quarters of a picture may be detail: the
quarter's border as a share of the mean, for one Gaussian number (chi squared)."""


@dataclass(frozen=True, kw_only=True)
class Differences:
    """Second differences at some places of plates, (..., place).

    detail: their squares are as large as the variance, where noise is white. level: of the light there. rounding: the
    squared distance of codes, 0 where there are none.
    """

    detail: Doubles
    level: Doubles
    rounding: Doubles

    @classmethod
    def of_all(cls, plates: "Sequence[Differences]") -> "Differences":
        """Return the differences of plates of one size together, (plate, place)."""
        detail, level, rounding = (
            np.stack(each) for each in zip(*((one.detail, one.level, one.rounding) for one in plates), strict=True)
        )
        return cls(detail=detail, level=level, rounding=rounding)

    @cached_property
    def of_codes(self) -> bool:
        """Whether any plate holds codes."""
        return bool(self.rounding.any())

    def variance(self, where: NDArray[np.intp]) -> float:
        """Return the variance of samples at some places (in one line), as large as rounding makes it at least: a
        twelfth of what blurred the codes is none of the samples'."""
        found = quantile(self.detail.ravel()[where] ** 2, LOW_SHARE) / LOW_OF_VARIANCE
        rounded = median(self.rounding.ravel()[where]) / 12 if self.of_codes else 0.0
        return max(found - rounded, rounded)


@dataclass(frozen=True, kw_only=True)
class NoiseSamples:
    """``beside``: how neighbours differ in one channel, or in the mean of all. ``apart``: how the mean differs over
    APART_PX. Means are times the root of the channels' number: as much as one, where noise is white and every channel
    has its own of the same size. Small pictures have no places apart; ``look_apart`` reads them once they are asked
    for."""

    beside: Differences
    look_apart: Callable[[], Differences]

    @cached_property
    def apart(self) -> Differences:
        """How the mean differs over APART_PX."""
        return self.look_apart()


def noise_samples(plate: Samples | Mixture, number: int, pixels: int, *, grey: bool = False) -> NoiseSamples | None:
    """Return what about so many pixels of a plate show, None of one that is smaller than 3 x 3; ``grey``: of the mean
    of channels also beside.

    Differences of codes are few and far between: codes are blurred by their distance first, evenly, every plate's
    (``number``) in its own way.
    """
    rows, cols = plate.shape[:2]
    if min(rows, cols) < 3:
        return None
    step = max((rows - 2) // max(ROWS, pixels // (cols - 2)), 1)
    firsts = np.arange(0, rows - 2, step)
    each, rng = max(len(firsts) * (cols - 2) // pixels, 1), np.random.default_rng(number)
    fewer = min(each, FEWER)
    wide = firsts[firsts < rows - 2 * APART_PX][::fewer] if cols > 2 * APART_PX else firsts[:0]

    def lines(firsts: NDArray[np.intp], px: int) -> NDArray[np.floating]:
        """Return lines that lie ``px`` apart, three by three, (channel, 3, line, col)."""
        part = rows_of(plate, (firsts + px * np.arange(3)[:, None]).ravel())
        part = part.astype(np.result_type(part, np.float32), copy=False)
        return np.moveaxis(part.reshape(3, len(firsts), cols, *plate.shape[2:] or (1,)), -1, 0)

    def of_mean(channels: NDArray[np.floating], px: int, each: int) -> Differences:
        blurred, gaps = zip(*(_blurred(channel, rng) for channel in channels), strict=True)
        squares = [np.square(one) for one in gaps if one is not None]
        gap = np.sqrt(reduce(np.add, squares) / len(gaps)) if squares else None
        found = _differences(reduce(np.add, blurred) / np.float32(len(blurred)), gap, px, each)
        return replace(found, detail=found.detail * np.sqrt(len(blurred)))

    channels = lines(firsts, 1)
    one = channels[min(1, len(channels) - 1)]
    beside = of_mean(channels, 1, each) if grey else _differences(*_blurred(one, rng), 1, each)
    return NoiseSamples(beside=beside, look_apart=lambda: of_mean(lines(wide, APART_PX), APART_PX, each // fewer))


def _differences(lines: NDArray[np.floating], gaps: Doubles | None, px: int, each: int) -> Differences:
    """Return of ``lines`` (3, line, col), of which three lie ``px`` apart, the second differences over that distance,
    of every ``each``-th place; ``gaps`` are between codes, None where there are none."""
    top, middle, bottom = lines
    down, three = top - 2 * middle + bottom, top + middle + bottom
    fine = down[:, : -2 * px] - 2 * down[:, px:-px] + down[:, 2 * px :]
    level = three[:, : -2 * px] + three[:, px:-px] + three[:, 2 * px :]  # white noise is in both, and not correlated
    detail = fine.ravel()[::each] / np.float64(6)
    return Differences(
        detail=detail,
        level=level.ravel()[::each] / np.float64(9),
        rounding=np.zeros(detail.shape) if gaps is None else gaps[1, :, px:-px].ravel()[::each] ** 2,
    )


def _blurred(lines: NDArray[np.floating], rng: np.random.Generator) -> tuple[NDArray[np.floating], Doubles | None]:
    """Return a channel's lines with their codes blurred, and how far these are from each other, None without codes."""
    codes = _codes_in(lines)
    if codes is None:
        return lines, None
    fine = lines.astype(np.float64)
    gaps = _gaps_between(codes, fine)
    return fine + gaps * (rng.random(lines.shape) - 0.5), gaps


def _codes_in(values: NDArray[np.floating]) -> Doubles | None:
    """Return the codes that values are, in rising order, or None where they are none that a file rounded."""
    some = values.ravel()[:: max(values.size // CODE_SAMPLES, 1)]
    codes = np.unique(some).astype(np.float64)
    if not LEAST_CODES <= len(codes) <= len(some) / 2:
        return None
    gaps = np.diff(codes)
    ratios = gaps[1:] / gaps[:-1]
    fine_or_none = gaps.max() < FINEST or median(gaps) > COARSEST
    if fine_or_none or np.mean((ratios < ALIKE) & (ratios > 1 / ALIKE)) < 0.5:
        return None
    return codes


def _gaps_between(codes: Doubles, values: Doubles) -> Doubles:
    """Return how far from each other codes are at every value."""
    gaps = np.diff(codes)
    beside = np.pad(gaps, 1, mode="edge")
    gaps = np.minimum(gaps, np.minimum(beside[:-2], beside[2:]))  # some codes may not occur
    return np.asarray(np.interp(values, codes[:-1] + gaps / 2, gaps))


def rows_of(plate: Samples | Mixture, rows: NDArray[np.intp]) -> Samples:
    """Return some rows of a plate, made or not."""
    return plate.rows(rows) if isinstance(plate, Mixture) else plate[rows]
