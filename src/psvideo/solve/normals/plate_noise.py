"""How noisy plates are, from the plates themselves: what their finest detail says where the picture has least of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.compute.ranks import median, rising_parts
from psvideo.model.arrays import Doubles, Samples
from psvideo.plates.mixing.mixture import Mixture
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.noise_samples import Differences, noise_samples

LEAST = 0.0003
"""No camera is believed to be less noisy than this, in units of saturation: half a code of ten bits."""
WELL_LIT = 0.25
"""LEAST is that of a picture whose brightest parts reach this. A darker one is as much less noisy at least: twelve bits
that lie low in files of sixteen never come near what their files can hold, and are as good as elsewhere."""
SAMPLES = 1 << 16
"""Noise is looked for at about this many samples of all plates."""
LEVELS, LEAST_PIXELS, BRIGHT = 12, 512, 0.25
"""What is brighter than this share of the brightest level shows how noise grows with light."""
DARK = 2.0
"""What is darker than this many standard deviations of the noise between neighbours shows noise without the picture."""
LIT, LIT_SHARE, LIT_PIXELS = 6.0, 0.02, 64
"""A small subject before black is what is brighter than this many such deviations (by chance no dark place is) and than
this share of the brightest place. Every level of it is seen at this many places at least."""
LEAST_SPREAD, MOST_SPREAD = 1.3, 1e4
"""Chance, and the edges of what is lit, make differences from farther away larger by up to the first. No demosaic and
no filter spreads noise by the second: a codec left nothing between neighbours, and steps between its blocks. (H.264 at
a rate factor of 26: noise of 43 times saturation was found in one round, and all of it lost.)"""
TEXTURE = 0.3
"""What little light is there may differ from place to place by this share of itself: paint and cloth have less."""


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


def noise_of(plates: Sequence[Samples] | Sequence[Mixture], lit: Illumination | None = None) -> PlateNoise:
    """Return the noise of plates as ``solve`` takes them, one per light: of one channel, so that its variance over the
    number of channels is that of their mean.

    Second differences along columns and rows (J. Immerkaer, "Fast noise variance estimation", CVIU 1996) leave hardly
    anything of smooth surfaces; the lowest quarter of them at each level leaves edges and texture out. Plates that hold
    a file's codes are never less noisy than rounding makes them: a twelfth of the codes' squared distance at the level.

    Noise that a demosaic or a filter spread is alike in neighbours and in channels: it differs more from farther away
    (4 px), and in the mean of channels. By how much is seen in the dark, where there is no picture, and holds in
    light as far as it shows there.

    Where more than three lights are known (``lit``), what no normal and albedo explains of the differences is looked at
    as well, and the lesser counts: paint, hair and the grain of a surface obey its lights, and noise does not.
    """
    pixels = SAMPLES // len(plates)
    each = (noise_samples(plates[n], n, pixels) for n in range(len(plates)))
    found = [one for one in each if one is not None]
    if sum(one.beside.detail.size for one in found) < LEAST_PIXELS:
        return PlateNoise(read=LEAST**2, photon=0.0)
    beside = Differences.of_all([one.beside for one in found])
    at, variances = _by_level(beside)
    channels = 1 if len(plates[0].shape) == 2 else plates[0].shape[2]
    spread = _Spread.of(beside, lambda: Differences.of_all([one.apart for one in found]), channels, at, variances)
    alone = _line(at, spread.times(at) * variances)
    if lit is None or len(plates) <= 3:
        return alone
    channel = min(1, lit.intensities.shape[1] - 1)
    left = _left_over(beside, lit.directions * lit.intensities[:, channel, None])
    dark_share = float(np.clip(1 - at.min() / max(BRIGHT * at.max(), 1e-9), 0, 1))
    at, variances = _by_level(left)
    return _lesser(alone, at, spread.times(at) * variances, dark_share=dark_share)


def spread_of(plates: Sequence[Samples] | Sequence[Mixture]) -> float:
    """Return how many times as large as neighbours show it the noise of plates is under light, as a variance, in the
    mean of their channels; 1.0 where no dark shows it."""
    found = [noise_samples(plates[n], n, SAMPLES // len(plates), grey=True) for n in range(len(plates))]
    known = [one for one in found if one is not None]
    if sum(one.apart.detail.size for one in known) < LEAST_PIXELS:
        return 1.0
    beside, apart = (Differences.of_all(each) for each in ([one.beside for one in known], [one.apart for one in known]))
    channels = 1 if len(plates[0].shape) == 2 else plates[0].shape[2]
    return _Spread.of(beside, lambda: apart, channels, *_by_level(beside)).in_light


def _left_over(of: Differences, matrix: Doubles) -> Differences:
    """Return the sums of the lights' differences to which a normal and an albedo add nothing: by unit vectors at right
    angles, so that each holds the noise of one measurement, at the mean level by its squares."""
    left = np.linalg.qr(matrix, mode="complete")[0][:, 3:].T
    sums = (np.einsum("sl,lp->sp", shares, some) for shares, some in (
        (left, of.detail), (left**2, of.level), (left**2, of.rounding)
    ))  # fmt: skip
    detail, level, rounding = sums
    return Differences(detail=detail, level=level, rounding=rounding)


def _by_level(of: Differences) -> tuple[Doubles, Doubles]:
    """Return LEVELS levels or fewer, and the variance there that differences show, each as large as noise at its level
    makes it.

    Where all parts but the brightest are dark, what is lit is less than one part, and is shared out by itself.
    """
    level = of.level.ravel()
    at, variances = _of_parts(of, level, rising_parts(level, LEVELS))
    dark = float(np.sqrt(variances[:-1].max()))  # the darkest parts may be cut off at black
    lit = np.flatnonzero(level > max(LIT * dark, LIT_SHARE * float(level.max())))
    count = min(LEVELS - 1, len(lit) // LIT_PIXELS)
    if at[-2] > DARK * dark or len(lit) * LEVELS > len(level) or count == 0:
        return at, variances
    unlit = np.flatnonzero(level <= DARK * dark)
    shared = [*rising_parts(level[unlit], 1), *rising_parts(level[lit], count)]
    return _of_parts(of, level, [some[part] for some, part in zip([unlit, *[lit] * count], shared, strict=True)])


def _of_parts(of: Differences, level: Doubles, parts: Sequence[NDArray[np.intp]]) -> tuple[Doubles, Doubles]:
    """Return the median level of parts whose levels rise, and the variance that differences show there."""
    at = np.array([(level[part[(len(part) - 1) // 2]] + level[part[len(part) // 2]]) / 2 for part in parts])
    return at, np.array([of.variance(part) for part in parts])


@dataclass(frozen=True, kw_only=True)
class _Spread:
    """How many times as large the variance is as neighbours show it: up to the level ``below``, and in light."""

    below: float = -np.inf
    in_dark: float = 1.0
    in_light: float = 1.0

    @classmethod
    def of(
        cls, beside: Differences, look_apart: Callable[[], Differences], channels: int, at: Doubles, variances: Doubles
    ) -> "_Spread":
        """Light shows more of the picture than of its noise: there it is no more than in the dark. ``at`` and
        ``variances`` are those of ``beside`` by level; nobody looks farther apart where there is no dark."""
        below = DARK * float(np.sqrt(variances[np.argmin(at)] / channels))
        near = _in_dark(beside, below, 1)
        if near <= 0:
            return cls()
        apart = look_apart()
        far = _in_dark(apart, below, channels)
        if not LEAST_SPREAD * near < far < MOST_SPREAD * near:
            return cls()
        bright = at > BRIGHT * at.max()
        if not bright.any():
            return cls(below=below, in_dark=far / near, in_light=far / near)
        at_apart, variances_apart = _by_level(apart)
        bright_apart = at_apart > BRIGHT * at_apart.max()
        shown = median(variances_apart[bright_apart]) / max(median(variances[bright]), 1e-12)
        return cls(below=below, in_dark=far / near, in_light=min(max(shown, 1.0), far / near))

    def times(self, levels: Doubles) -> Doubles:
        """Return by what the variance at levels is multiplied."""
        return np.where(levels <= self.below, self.in_dark, self.in_light)


def _in_dark(of: Differences, below: float, channels: int) -> float:
    """Return the variance in what is darker than ``below``, without what may be texture there of the mean of so many
    channels; 0 where nothing is dark, or only what are the darkest places of something lit."""
    dark = np.flatnonzero(of.level.ravel() <= below)
    if len(dark) < LEAST_PIXELS:
        return 0.0
    light = median(of.level.ravel()[dark])
    return 0.0 if light > below / 2 else of.variance(dark) - channels * (TEXTURE * max(light, 0.0)) ** 2


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
