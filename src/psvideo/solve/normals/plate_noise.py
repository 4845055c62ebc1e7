"""How noisy plates are, from the plates themselves: what their finest detail says where the picture has least of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median, quantile, rising_parts
from psvideo.model.arrays import Doubles
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.task import Samples

LEAST = 0.0003
"""No camera is believed to be less noisy than this, in units of saturation: half a code of ten bits."""
WELL_LIT = 0.25
"""LEAST is that of a picture whose brightest parts reach this. A darker one is as much less noisy at least: twelve bits
that lie low in files of sixteen never come near what their files can hold, and are as good as elsewhere."""
ROWS, SAMPLES = 24, 1 << 16
"""Noise is looked for in about this many rows of every plate, evenly spread, and this many samples of all: of small
pictures in more rows."""
LEVELS, LEAST_PIXELS, BRIGHT = 12, 512, 0.25
"""What is brighter than this share of the brightest level shows how noise grows with light."""
CODE_SAMPLES, LEAST_CODES, ALIKE, COARSEST = 1 << 12, 5, 1.25, 0.025
"""This many samples of a plate show whether it holds a file's codes: it then has few values, but at least LEAST_CODES,
which most samples share, and half of the gaps between neighbouring ones are alike up to this factor. Codes of eight
bits are no farther apart, whatever their curve (HLG: 0.021 at the top)."""
LOW_SHARE, LOW_OF_VARIANCE = 0.25, 0.1015
"""Noise comes from the lowest quarter of squared differences, for up to three quarters of a picture may be detail: the
quarter's border as a share of the mean, for one Gaussian number (chi squared)."""


@dataclass(frozen=True, kw_only=True)
class PlateNoise:
    """The variance of a plate's sample at a level (1.0 = saturation): read + photon * level.

    dimness: what the least noises that cameras are believed to have are multiplied by, less than 1 where the picture
    is dark as a whole.
    """

    read: float
    photon: float
    dimness: float = 1.0

    @property
    def least(self) -> float:
        """The least standard deviation that is believed of such a picture."""
        return LEAST * self.dimness

    @property
    def dark(self) -> float:
        """The standard deviation where there is no light."""
        return float(np.sqrt(self.read))

    def at(self, level: float) -> float:
        """Return the standard deviation at a level."""
        return float(np.sqrt(self.read + self.photon * max(level, 0.0)))


def noise_of(
    plates: Sequence[Samples] | Sequence[Mixture],
    lit: Illumination | None = None,
    *,
    black_level: float = 0.0,
    scale: float = 1.0,
) -> PlateNoise:
    """Return the noise of one channel of plates as ``solve`` takes them, one per light.

    Second differences along columns and rows (J. Immerkaer, "Fast noise variance estimation", CVIU 1996) leave hardly
    anything of smooth surfaces; the lowest quarter of them at each level leaves edges and texture out. Plates that hold
    a file's codes are never less noisy than rounding makes them: a twelfth of the codes' squared distance at the level.

    Where more than three lights are known (``lit``), what no normal and albedo explains of the differences is looked at
    as well, and the lesser counts: paint, hair and the grain of a surface obey its lights, and noise does not.
    """
    pixels = SAMPLES // len(plates)
    found = (_fine(plates[n], n, black_level, scale, pixels) for n in range(len(plates)))
    detail, level, rounding = map(np.stack, zip(*found, strict=True))
    if detail.size < LEAST_PIXELS:
        return PlateNoise(read=LEAST**2, photon=0.0)
    at, variances = _by_level(detail, level, rounding)
    alone = _line(at, variances)
    if lit is None or len(plates) <= 3:
        return alone
    channel = min(1, lit.intensities.shape[1] - 1)
    left = _left_over(lit.directions * lit.intensities[:, channel, None])
    sums = (np.einsum("sl,lp->sp", each, of) for each, of in ((left, detail), (left**2, level), (left**2, rounding)))
    dark_share = float(np.clip(1 - at.min() / max(BRIGHT * at.max(), 1e-9), 0, 1))
    return _lesser(alone, *_by_level(*sums), dark_share=dark_share)


def _left_over(matrix: Doubles) -> Doubles:
    """Return the sums of the lights' measurements, (sum, light), to which a normal and an albedo add nothing: unit
    vectors at right angles, so that each holds the noise of one measurement, at the mean level by its squares."""
    return np.asarray(np.linalg.qr(matrix, mode="complete")[0][:, 3:].T)


def _by_level(detail: Doubles, level: Doubles, rounding: Doubles) -> tuple[Doubles, Doubles]:
    """Return LEVELS levels, and the variance there that differences show, each as large as noise at its level makes it;
    ``rounding`` is the squared distance of codes."""
    detail, level, rounding = detail.ravel() ** 2, level.ravel(), rounding.ravel() / 12
    parts = rising_parts(level, LEVELS)
    at = np.array([(level[part[(len(part) - 1) // 2]] + level[part[len(part) // 2]]) / 2 for part in parts])  # medians
    found = np.array([quantile(detail[part], LOW_SHARE) / LOW_OF_VARIANCE for part in parts])
    if not rounding.any():
        return at, found
    rounded = np.array([median(rounding[part]) for part in parts])
    return at, np.maximum(found - rounded, rounded)  # of the samples a twelfth is what blurred the codes


def _line(at: Doubles, found: Doubles) -> PlateNoise:
    """Return the noise that grows with light as variances at levels do."""
    bright, darkest = at > BRIGHT * at.max(), int(np.argmin(at))
    if at.max() <= 0:  # no light anywhere
        return PlateNoise(read=max(float(found[darkest]), LEAST**2), photon=0.0)
    dimness = min(float(at.max()) / WELL_LIT, 1.0)
    rise = (found - found[darkest]) / np.maximum(at - at[darkest], 1e-6)
    photon = max(median(rise[bright]), 0.0)
    read = max(float(found[darkest]) - photon * max(float(at[darkest]), 0.0), (LEAST * dimness) ** 2)
    return PlateNoise(read=read, photon=photon, dimness=dimness)


def _lesser(alone: PlateNoise, at: Doubles, found: Doubles, *, dark_share: float) -> PlateNoise:
    """Return the noise under light of single plates, or of what is left over of all (``found`` at the levels ``at``)
    where that is less: detail only ever adds to it.

    In the dark single plates count, as far as a picture has any (``dark_share``): there is no paint, and noise of an
    ambient picture that was taken off all plates is alike in all of them, which a normal and an albedo explain. Where
    levels are much alike, no line through them shows the dark: less than the share that is left of the single plates'
    is not believed.
    """
    bright = at > BRIGHT * at.max()
    if at.max() <= 0 or not bright.any():
        return alone
    level = median(at[bright])
    share = median(found[bright]) / alone.at(level) ** 2
    left = min(alone.read, max(_line(at, found).read, share * alone.read))
    read = left + (alone.read - left) * dark_share
    photon = median(np.maximum(found[bright] - left, 0) / at[bright])
    photon = min(photon, max(alone.at(level) ** 2 - read, 0.0) / level)
    return replace(alone, read=read, photon=photon)


def _fine(
    plate: Samples | Mixture, number: int, black_level: float, scale: float, pixels: int
) -> tuple[Doubles, Doubles, Doubles]:
    """Return second differences, whose squares white noise makes as large as its variance, the level there, and the
    squared distance of the plate's codes, 0 where it holds none.

    Differences of codes are few and far between: codes are blurred by their distance first, evenly, every plate's
    (``number``) in its own way.
    """
    rows, cols = plate.shape[:2]
    if rows < 3 or cols < 3:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    step = max((rows - 2) // max(ROWS, pixels // (cols - 2)), 1)
    firsts = np.arange(0, rows - 2, step)
    part = rows_of(plate, (firsts + np.arange(3)[:, None]).ravel())
    part = part[..., min(1, plate.shape[2] - 1)] if len(plate.shape) == 3 else part
    each = max(len(firsts) * (cols - 2) // pixels, 1)
    lines = part.reshape(3, len(firsts), cols) - np.float32(black_level)
    lines *= np.float32(scale)
    codes = _codes_in(lines)
    if codes is None:
        fine, level = _differences(lines, each)
        return fine, level, np.zeros_like(level)
    blurred = lines.astype(np.float64)
    gaps = _gaps_between(codes, blurred)
    blurred += gaps * (np.random.default_rng(number).random(lines.shape) - 0.5)
    fine, level = _differences(blurred, each)
    return fine, level, gaps[1, :, 1:-1].ravel()[::each] ** 2


def _differences(lines: NDArray[np.floating], each: int) -> tuple[Doubles, Doubles]:
    """Return of ``lines`` (3, line, col), of which three lie beside each other, the second differences as their squares
    hold the variance, and the levels there; of every ``each``-th place."""
    top, middle, bottom = lines
    down, three = top - 2 * middle + bottom, top + middle + bottom
    fine = down[:, :-2] - 2 * down[:, 1:-1] + down[:, 2:]
    level = three[:, :-2] + three[:, 1:-1] + three[:, 2:]  # the same noise is in both, and not correlated
    return fine.ravel()[::each] / np.float64(6), level.ravel()[::each] / np.float64(9)


def _codes_in(values: NDArray[np.floating]) -> Doubles | None:
    """Return the codes that values are, in rising order, or None where they are none that a file rounded."""
    some = values.ravel()[:: max(values.size // CODE_SAMPLES, 1)]
    codes = np.unique(some).astype(np.float64)
    if not LEAST_CODES <= len(codes) <= len(some) / 2:
        return None
    gaps = np.diff(codes)
    ratios = gaps[1:] / gaps[:-1]
    fine_or_none = gaps.max() < LEAST or median(gaps) > COARSEST
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
