"""What may turn normals beyond noise: surfaces that are not matte, a rig that is wrong, light from around.

Three signs are looked for on a coarse grid, and around every pixel, since they are smooth where noise is not. What the
lights leave unexplained says how far the model is from the surface. Light that shows where a lamp does not reach came
by way of other surfaces, which light everything alike and leave no residual. And normals that belong to no surface are
wrong whatever the lights say of them: along a closed way the slopes of a surface add up to nothing.
"""

import functools
import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.surface import Surface
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.task import Floats, Samples
from psvideo.solve.normals.trust.fewer_lights import widened

TORN, NEAR = 5, 9
"""Slopes are added up along the edges of squares of this many points, averaged over those of the second."""
AROUND, FAR_AROUND, LEAST_AROUND = 0.1, 0.5, 7
"""The rest is looked at around a point, over such shares of the subject's size (the root of its points), whatever the
picture's, and over no less than this many points: their residuals are of noise as well."""
LEAST_FACING, MOST_TORN = np.float32(0.25), np.float32(0.5)
"""Slopes are those of normals that face the camera at least this much; and around four points they count up to this
much, since where one thing is before another they say nothing of either."""
TORN_OF_NOISE, SURELY_TORN = np.float32(0.27), np.float32(0.35)
"""How much of what noise does to a normal shows in slopes added up: on nothing but noise, and with a margin."""
MOST_FIT_DEG = np.float32(24)
"""What residuals predict counts as no more around a point: a line of rows that went wrong is not its surroundings."""
OUTLYING, TURNS, LEAST_LEVEL_DEG = np.float32(1.5), 4, np.float32(0.05)
"""What is around counts up to this many times its typical size, found in this many turns: edges of shadows and creases
are their own, and of no more than a few of the points."""
OUTLYING_OF_ONE, OUTLYING_OF_MORE = 4, 2
"""... and so many times the square of what noise makes of it, of one Gaussian number (which has the longest tail) or of
more: 96 and 95 % of their squares stay. With less, noise took more from a misfit than it added."""
CERTAIN = np.float32(1)
"""... beyond this many standard errors of the mean square that noise makes of so few."""
UNSURE_OF_NOISE = np.float32(1.2)
"""Noise is known to a tenth, and its square to a fifth: what is less beyond it is not surely a misfit, but likely."""
MOST_WIDENED = 5.0
"""Where fewer lights reach, noise and what residuals predict of it spread farther: up to this many times the square."""
MOVING_DEG, OF_MOTION = np.float32(0.5), 5
"""Where motion turns normals by more, over this many points, residuals are its own, and no misfit of rig or surface."""
UNEVEN_PX, SURFACES_UNEVEN = 4, np.float32(0.7)
"""Samples this far apart are compared: a codec's errors are alike in nearer ones. The misfit of surfaces changes by
up to the second share of it, near the noise; only what is beyond that counts as a codec's."""

ENOUGH_LIGHTS = 12
"""What ``hidden`` is measured by: this many lights hide little of what is not matte."""
LEAST_LIGHTS = 0.02
"""Light from around is known where at least this many lights, in the mean, do not reach a point."""


@dataclass(frozen=True, kw_only=True)
class Doubting:
    """How much the signs count.

    misfit_deg, misfit_power, little_deg: the error m that residuals around predict beyond noise counts as
        m^(1 + power) / (m + little) of these degrees: where it is little it is noise.
    own: what a pixel's own residuals predict counts from this many times m on, wholly: a shadow's edge or a highlight.
    few_power: the more so the fewer lights there are: with this power of how much more of what is not matte they hide,
        because a normal and an albedo follow it.
    indirect: how much of the angle counts by which light from around would turn the normal.
    torn, torn_beside, torn_alone_deg: how much more it is for each degree by which normals belong to no surface; these
        count up to a share of the other doubt, and little more: along creases and the outline of a thing before another
        there are more, where normals are as good as elsewhere.

    Fitted on a ball, a bear and a cat (DiLiGenT), a sphere with a wrong rig (Washington),
    another renderer's bunny, and virtual shapes of eight materials and under wrong rigs, under 5 to 96 lights, spread
    or nearly in a plane, and, with less weight, on five photographed objects of which all lights are the truth for some
    of them. Each subject left out and predicted from the others: ``python -m bench predicted``.
    """

    misfit_deg: float = 2.0
    misfit_power: float = 0.5
    little_deg: float = 1.75
    own: float = 2.0
    few_power: float = 0.5
    indirect: float = 1.4
    torn: float = 2.5
    torn_beside: float = 0.5
    torn_alone_deg: float = 0.1


@dataclass(frozen=True, kw_only=True)
class Signs:
    """What is looked for, (row, col) of the points, in degrees: what residuals surely predict beyond noise, by which
    angle light from around would turn the normal, by which normals around surely belong to no surface, and what noise
    makes more where some lights are not used. ``hidden``: how many times more than ENOUGH_LIGHTS these hide of what is
    not matte. ``uneven``: the share of the misfit that changes from sample to sample, as errors of codecs do and
    surfaces do not: of that nothing is hidden. ``likely_misfit_deg``, ``likely_torn_deg``: the first and third without
    a margin for what noise could be instead; ``noise_deg`` is what noise makes of the normals."""

    misfit_deg: Floats
    indirect_deg: Floats
    torn_deg: Floats
    lost_deg: Floats
    hidden: float
    likely_misfit_deg: Floats
    likely_torn_deg: Floats
    noise_deg: Floats
    uneven: Floats | float = 0.0

    def at(self, some: NDArray[np.bool_] | NDArray[np.intp]) -> "Signs":
        """Return the signs of some of the points."""
        shape = self.misfit_deg.shape
        each = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "hidden"}
        here: dict[str, Any] = {name: np.broadcast_to(value, shape)[some] for name, value in each.items()}
        return replace(self, **here)


@dataclass(frozen=True, kw_only=True)
class ThinSurface:
    """Every ``step``-th row and column of a surface, and errors there in degrees: what noise makes, what residuals
    predict, and what they would predict of nothing but noise."""

    step: int
    surface: Surface
    noise_deg: Floats
    fit_deg: Floats
    fit_of_noise_deg: Floats

    @cached_property
    def planes(self) -> Floats:
        """The normals, (3, row, col)."""
        return np.moveaxis(self.surface.normals, -1, 0).astype(np.float32)

    @cached_property
    def brightness(self) -> Floats:
        """Albedo (row, col), of three channels their mean."""
        return brightness(self.surface.albedo)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Where there is a normal."""
        return self.surface.valid


def signs_of(points: ThinSurface, one: Evidence, turned_deg: Floats | None = None) -> Signs:
    """Return what speaks against the points' normals. ``turned_deg`` is by how much motion turns them, which is no
    misfit of rig or surface. Raises ValueError where nobody looked for light from around."""
    if one.indirect is None:
        raise ValueError("`indirect` expected in the evidence: see indirect.py")
    fit = np.minimum(points.fit_deg, MOST_FIT_DEG)
    sums, counts = one.indirect
    lights = len(one.plates)
    strengths = one.lit.intensities.mean(axis=1)[:, None]
    used = (lights - counts).astype(np.intp)
    wider = widened(one.lit.directions * strengths, MOST_WIDENED)[used]
    plain = points.surface.error_deg is None
    checked = plain | (used > 3)  # three measurements leave no residual, and say nothing of the surface
    noise = points.fit_of_noise_deg**2 * (1 if plain else wider)
    squares = np.where(points.known, fit**2 - UNSURE_OF_NOISE * noise, np.float32(0))
    if turned_deg is not None:
        squares *= cv2.blur(turned_deg, (OF_MOTION, OF_MOTION)) < MOVING_DEG
    around, far_around = (width_of(points.known, share) for share in (AROUND, FAR_AROUND))
    far = _mean(sums, far_around) / np.maximum(_mean(counts, far_around), LEAST_LIGHTS)
    near = _mean(sums, around) + np.float32(LEAST_LIGHTS) * far  # where all lights reach what is around, farther off
    indirect = np.maximum(near / (_mean(counts, around) + np.float32(LEAST_LIGHTS)), 0)
    own = np.maximum(sums / np.maximum(counts, 1) - 2 * np.radians(points.noise_deg), 0)
    albedo = points.brightness * points.known
    shown = np.minimum(albedo, albedo.sum() / max(np.count_nonzero(points.known), 1))  # glare is no more than the rest
    bright = albedo * albedo
    common = (noise * bright).sum() / max(bright.sum(), 1e-9)  # black cloth is nothing but noise
    unsure = np.minimum(noise, common) * checked
    outlying = OUTLYING_OF_ONE if lights == 4 else OUTLYING_OF_MORE
    surroundings = [
        _Surroundings.of(noise, shown, width, unsure=unsure, outlying=outlying) for width in (around, far_around)
    ]
    typical = [each.typical(squares) for each in surroundings]
    misfit_deg = np.maximum(*(each.surely(found) for each, found in zip(surroundings, typical, strict=True)))
    likely_deg = np.maximum(*(each.likely(found) for each, found in zip(surroundings, typical, strict=True)))
    uneven: Floats | float = 0.0
    if plain and lights > 3:
        changes = _changes(fit, points, lights - 3) - UNSURE_OF_NOISE * noise
        changing_deg = np.maximum(*(each.surely(each.typical(changes)) for each in surroundings))
        share = (changing_deg / np.maximum(misfit_deg, np.float32(1e-6))) ** 2
        uneven = np.clip((share - SURFACES_UNEVEN) / (1 - SURFACES_UNEVEN), 0, 1)
    of_noise = points.noise_deg**2
    torn_squared = _torn_squared(points) - SURELY_TORN**2 * (of_noise + uneven * misfit_deg**2)
    likely_torn_squared = torn_squared + (SURELY_TORN**2 - TORN_OF_NOISE**2) * of_noise
    return Signs(
        misfit_deg=misfit_deg,
        likely_misfit_deg=likely_deg,
        uneven=uneven,
        indirect_deg=np.degrees(indirect + own) * _turned(points.planes, one),
        torn_deg=np.sqrt(np.maximum(torn_squared, 0)),
        likely_torn_deg=np.sqrt(np.maximum(likely_torn_squared, 0)),
        noise_deg=points.noise_deg,
        lost_deg=points.noise_deg * np.sqrt(wider - 1),
        hidden=hidden_by(len(one.plates)) / hidden_by(ENOUGH_LIGHTS),
    )


def doubt_deg(signs: Signs, *, how: Doubting = Doubting()) -> Floats:
    """Return by how many degrees normals may be off beyond noise, (row, col) of the points.

    Noise hides part of the signs. With it an error is never predicted smaller than without: what signs are likely to be
    counts where that is more than noise and what they surely are.
    """
    sure = _doubt_of(signs.misfit_deg, signs.torn_deg, signs, how)
    likely = _doubt_of(signs.likely_misfit_deg, signs.likely_torn_deg, signs, how)
    lost = signs.lost_deg * signs.lost_deg
    squares = np.maximum(sure * sure + lost, likely * likely - signs.noise_deg * signs.noise_deg)
    return np.asarray(np.sqrt(squares), np.float32)


def _doubt_of(misfit_deg: Floats, torn_deg: Floats, signs: Signs, how: Doubting) -> Floats:
    """Return the doubt that a misfit and torn normals make beside the other signs, without what noise makes more."""
    shows = np.maximum(misfit_deg, np.float32(1e-9)) ** np.float32(1 + how.misfit_power)
    shows = np.where(misfit_deg > 0, shows, np.float32(0))  # powers of 0 are usual, and slow
    misfit = np.float32(how.misfit_deg) * shows
    misfit *= np.float32(signs.hidden**how.few_power) / (misfit_deg + np.float32(how.little_deg))
    misfit -= np.asarray(signs.uneven, np.float32) * np.maximum(misfit - misfit_deg, 0)
    both = np.hypot(misfit, np.float32(how.indirect) * signs.indirect_deg)
    most_torn = np.float32(how.torn_beside) * both + np.float32(how.torn_alone_deg)
    return np.asarray(both + np.float32(how.torn) * np.minimum(torn_deg, most_torn), np.float32)


def width_of(known: NDArray[np.bool_] | Floats, share: float) -> int:
    """Return how many points, an odd number, are a share of the size of a subject of all ``known`` ones."""
    return max(int(share * np.sqrt(np.count_nonzero(known))) // 2 * 2 + 1, LEAST_AROUND)


@dataclass(frozen=True, kw_only=True)
class _Surroundings:
    """What is typical around every point, over squares ``width`` points wide.

    ``shown``, each point's albedo up to the mean, is its weight, and ``weight`` the mean of it around: a little stray
    light, or what is lost in a file's codes, turns the normals of black cloth far, and says nothing of the subject
    before it. ``passed_noise`` is how much of a point's square passes for noise, ``by_chance`` what chance could leave
    of noise over as many points, and ``margin`` what was taken off for noise that is known no better.
    """

    width: int
    shown: Floats
    weight: Floats
    passed_noise: Floats
    by_chance: Floats
    margin: Floats

    @classmethod
    def of(cls, noise: Floats, shown: Floats, width: int, *, unsure: Floats, outlying: int) -> "_Surroundings":
        """Look around; ``noise`` is what noise alone would make of squares, of which UNSURE_OF_NOISE times as much is
        taken off them: of ``unsure`` a margin. ``outlying`` times the noise is none of an outlier's."""
        weight = _mean(shown, width)
        count = _mean((shown > 0).astype(np.float32), width) * np.float32(width**2)
        by_chance = CERTAIN * np.sqrt(2 / np.maximum(count, 1)) * _mean(noise * shown, width) / weight
        margin = (UNSURE_OF_NOISE - 1) * _mean(unsure * shown, width) / weight
        return cls(
            width=width,
            shown=shown,
            weight=weight,
            passed_noise=outlying * noise,
            by_chance=by_chance,
            margin=margin,
        )

    def typical(self, squares: Floats) -> Floats:
        """Return the typical ``squares``, of which the caller has taken off the mean that noise makes. Outliers count
        as OUTLYING times what is typical."""
        typical = _mean(squares * self.shown, self.width) / self.weight
        for _ in range(TURNS):
            most = OUTLYING**2 * np.maximum(typical, LEAST_LEVEL_DEG**2) + self.passed_noise
            typical = _mean(np.minimum(squares, most) * self.shown, self.width) / self.weight
        return typical

    def surely(self, typical: Floats) -> Floats:
        """Return the root of what is typical, without what chance could leave of noise."""
        return np.asarray(np.sqrt(np.maximum(typical - self.by_chance, 0)), np.float32)

    def likely(self, typical: Floats) -> Floats:
        """Return the root of what is typical, with the margin back that was taken off for noise."""
        return np.asarray(np.sqrt(np.maximum(typical + self.margin, 0)), np.float32)


def _changes(fit: Floats, points: ThinSurface, free: int) -> Floats:
    """Return the square of what residuals predict, as far as it changes from sample to sample: a root of ``free``
    squares of independent numbers varies so much about its mean."""
    apart = max(UNEVEN_PX // points.step, 1)
    squares, count = np.zeros_like(fit), np.full_like(fit, 1e-9)
    for axis in (0, 1):
        here = [slice(None), slice(None)]
        there = list(here)
        here[axis], there[axis] = slice(None, -apart), slice(apart, None)
        a, b = tuple(here), tuple(there)
        both = points.known[a] & points.known[b]
        squares[a] += np.where(both, (fit[a] - fit[b]) ** 2 / 2, 0)
        count[a] += both
    mean = np.sqrt(2 / free) * math.gamma((free + 1) / 2) / math.gamma(free / 2)
    return np.asarray(squares / count / np.float32(1 - mean * mean), np.float32)


def brightness(albedo: NDArray[np.floating]) -> Floats:
    """Return albedo (row, col), of three channels their mean."""
    if albedo.ndim == 2:
        return np.asarray(albedo, np.float32)
    total = functools.reduce(np.add, np.moveaxis(albedo, -1, 0).astype(np.float32))  # numpy is slow along a short axis
    return np.asarray(total / np.float32(albedo.shape[-1]), np.float32)


def hidden_by(lights: int) -> float:
    """Return all lights over those that a normal and an albedo leave to be held against them.

    >>> hidden_by(5), hidden_by(12)
    (2.5, 1.3333333333333333)
    """
    return lights / max(lights - 3, 1)


def _turned(normals: Floats, one: Evidence) -> Floats:
    """Return by how many radians light turns the normal that every lamp adds alike, for each share of the albedo:
    least squares takes it for a vector, of which what lies across the normal turns it."""
    towards = one.lit.directions
    added = (np.linalg.pinv(towards) @ np.ones(len(towards))).astype(np.float32)
    along = np.tensordot(added, normals, 1)
    return np.asarray(np.sqrt(np.maximum(np.float32(added @ added) - along * along, 0)), np.float32)


def _torn_squared(points: ThinSurface) -> Floats:
    """Return the squared angle by which the normals around every point cannot be one surface's: around any four points
    the slopes of a surface add up to 0, and what these add up to is averaged over a square."""
    across, up, towards = points.planes
    facing = np.maximum(towards, LEAST_FACING)
    right, down = -across / facing, up / facing
    known = points.known
    within = np.zeros(known.shape, np.float32)
    within[:-1, :-1] = known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]
    along = right[:, :-1] + right[:, 1:]
    over = down[:-1] + down[1:]
    seen = (facing[:-1, :-1] + facing[1:, :-1] + facing[:-1, 1:] + facing[1:, 1:]) / 4
    whole = np.zeros(known.shape, np.float32)
    whole[:-1, :-1] = (along[:-1] - along[1:] + over[:, 1:] - over[:, :-1]) / 2 * seen ** np.float32(1.5)
    whole = np.clip(whole, -MOST_TORN, MOST_TORN) * within
    each = np.degrees(_mean(whole, TORN) / _mean(within, TORN)) * np.float32(TORN / 2)
    return _mean(each * each * within, NEAR) / _mean(within, NEAR)


def _mean(plane: Floats, width: int) -> Floats:
    """Return means over squares; of nothing a little, so that it can be divided by."""
    return np.asarray(cv2.blur(plane, (width, width), borderType=cv2.BORDER_CONSTANT) + np.float32(1e-9), np.float32)


def stored(surface: Surface) -> tuple[Samples, Samples]:
    """Return normals (3, row, col) and albedo (channel, row, col) as compiled loops take them, in the same memory."""
    albedo = surface.albedo
    return bits(np.moveaxis(surface.normals, -1, 0)), bits(
        albedo[None] if albedo.ndim == 2 else np.moveaxis(albedo, -1, 0)
    )


def bits(planes: NDArray[np.floating]) -> Samples:
    """Return numbers as compiled loops take them: half floats as their bits."""
    return planes.view(np.uint16) if planes.dtype == np.float16 else planes
