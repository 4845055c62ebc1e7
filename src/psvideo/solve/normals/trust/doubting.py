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
from psvideo.solve.normals.evidence import Evidence, Indirect
from psvideo.solve.normals.task import Bytes, Floats, Samples
from psvideo.solve.normals.trust.few_checked import turned_by_model_deg
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
        there are more, where normals are as good as elsewhere. Under three lights, where nothing else speaks,
        they count by as much more as is unchecked.
    by_model: the whole error is at least this share of the angle by which the subject's model would turn the normal.

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
    by_model: float = 0.6


@dataclass(frozen=True, kw_only=True)
class Signs:
    """What is looked for, (row, col) of the points, in degrees: what residuals surely predict beyond noise, by which
    angle light from around would turn the normal, by which normals around surely belong to no surface, and what noise
    makes more where some lights are not used. ``hidden``: how many times more than ENOUGH_LIGHTS these hide of what is
    not matte. ``uneven``: the share of the misfit that changes from sample to sample, as errors of codecs do and
    surfaces do not: of that nothing is hidden. ``likely_misfit_deg``, ``likely_torn_deg``: the first and third without
    a margin for what noise could be instead; ``noise_deg`` is what noise makes of the normals. ``unchecked_deg``: what
    lights that cannot be held against each other leave of real surfaces, though nothing shows; it counts in errors, and
    not in what is trusted. ``by_model_deg``: by how much the model of the subject's reflectance would turn the normals
    under four and five lights (``few_checked.py``)."""

    misfit_deg: Floats
    indirect_deg: Floats
    torn_deg: Floats
    lost_deg: Floats
    hidden: float
    likely_misfit_deg: Floats
    likely_torn_deg: Floats
    noise_deg: Floats
    uneven: Floats | float = 0.0
    unchecked_deg: Floats | float = 0.0
    by_model_deg: Floats | float = 0.0

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
        return np.ascontiguousarray(np.moveaxis(self.surface.normals, -1, 0), np.float32)

    @cached_property
    def brightness(self) -> Floats:
        """Albedo (row, col), of three channels their mean."""
        return brightness(self.surface.albedo)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Where there is a normal."""
        return self.surface.valid

    @cached_property
    def widths(self) -> tuple[int, int]:
        """How many points are around a point, and far around."""
        return width_of(self.known, AROUND), width_of(self.known, FAR_AROUND)

    @cached_property
    def known_bytes(self) -> Bytes:
        """The same, as compiled loops take it."""
        return np.ascontiguousarray(self.surface.valid).view(np.uint8)


def signs_of(points: ThinSurface, one: Evidence, turned_deg: Floats | None = None) -> Signs:
    """Return what speaks against the points' normals. ``turned_deg`` is by how much motion turns them, which is no
    misfit of rig or surface. Raises ValueError where nobody looked for light from around."""
    if one.indirect is None:
        raise ValueError("`indirect` expected in the evidence: see indirect.py")
    from psvideo.solve.normals.trust.doubting_kernel import fill_squares

    lights, plain = len(one.plates), points.surface.error_deg is None
    strengths = one.lit.intensities.mean(axis=1)[:, None]
    wider = widened(one.lit.directions * strengths, MOST_WIDENED)
    squares, noise, shown = np.empty((3, *points.known.shape), np.float32)
    fill_squares(
        line(points.fit_deg), line(points.fit_of_noise_deg), points.known_bytes.reshape(-1), line(points.brightness),
        line(one.indirect.counts), wider, plain, float(UNSURE_OF_NOISE), float(MOST_FIT_DEG), line(squares),
        line(noise), line(shown),
    )  # fmt: skip
    still = points.known
    if turned_deg is not None:
        rests = cv2.blur(turned_deg, (OF_MOTION, OF_MOTION)) < MOVING_DEG
        squares *= rests
        still = still & rests
    surroundings = _Surroundings.both(points, noise, shown, one)
    misfit_deg, likely_deg = _roots(squares, surroundings)
    uneven = np.zeros_like(noise)
    if plain and lights > 3:
        changing_deg, _ = _roots(_changes(points, noise, lights - 3), surroundings)
        share = (changing_deg / np.maximum(misfit_deg, np.float32(1e-6))) ** 2
        uneven = np.clip((share - SURFACES_UNEVEN) / (1 - SURFACES_UNEVEN), 0, 1)
    torn_deg, likely_torn_deg = _torn_deg(points, misfit_deg, uneven)
    used = (lights - one.indirect.counts).astype(np.intp)
    by_model = turned_by_model_deg(points.surface, points.step, one, still)
    return Signs(
        misfit_deg=misfit_deg,
        likely_misfit_deg=likely_deg,
        uneven=uneven,
        indirect_deg=_indirect_deg(points, one, one.indirect),
        torn_deg=torn_deg,
        likely_torn_deg=likely_torn_deg,
        noise_deg=points.noise_deg,
        lost_deg=points.noise_deg * np.sqrt(wider - 1)[used],
        hidden=hidden_by(lights) / hidden_by(ENOUGH_LIGHTS),
        by_model_deg=0.0 if by_model is None else by_model,
    )


def doubt_deg(signs: Signs, *, how: Doubting = Doubting()) -> Floats:
    """Return by how many degrees normals may be off beyond noise, (row, col) of the points.

    Noise hides part of the signs. With it an error is never predicted smaller than without: what signs are likely to be
    counts where that is more than noise and what they surely are.
    """
    from psvideo.solve.normals.trust.doubting_kernel import fill_doubt

    counts = how.misfit_deg * signs.hidden**how.few_power
    factors = (counts, how.misfit_power, how.little_deg, how.indirect, how.torn, how.torn_beside, how.torn_alone_deg)
    planes = np.stack(
        [
            *(signs.misfit_deg, signs.torn_deg, signs.likely_misfit_deg, signs.likely_torn_deg),
            *(signs.indirect_deg, signs.lost_deg, signs.noise_deg),
            *(
                np.broadcast_to(np.float32(one), signs.misfit_deg.shape)
                for one in (signs.uneven, signs.unchecked_deg, np.float32(how.by_model) * signs.by_model_deg)
            ),
        ]
    )
    doubt = np.empty(planes.shape[1:], np.float32)
    fill_doubt(planes.reshape(len(planes), -1), np.array(factors, np.float32), doubt.reshape(-1))
    return doubt


def width_of(known: NDArray[np.bool_] | Floats, share: float) -> int:
    """Return how many points, an odd number, are a share of the size of a subject of all ``known`` ones."""
    return max(int(share * np.sqrt(np.count_nonzero(known))) // 2 * 2 + 1, LEAST_AROUND)


@dataclass(frozen=True, kw_only=True)
class _Surroundings:
    """What is typical around every point, over squares ``width`` points wide.

    ``shown``, each point's albedo up to the mean, is its weight, and ``weight`` the mean of it around: a little stray
    light, or what is lost in a file's codes, turns the normals of black cloth far, and says nothing of the subject
    before it. ``noise`` is what noise alone would make of squares; ``outlying`` times that is none of an outlier's.
    ``by_chance`` is what chance could leave of it over as many points, and ``margin`` what was taken off since it is
    known no better.
    """

    width: int
    shown: Floats
    weight: Floats
    noise: Floats
    outlying: int
    by_chance: Floats
    margin: Floats

    @classmethod
    def both(cls, points: ThinSurface, noise: Floats, albedo: Floats, one: Evidence) -> "list[_Surroundings]":
        """Look around the points, near and far; ``albedo``, zeros where nothing is known, becomes ``shown``."""
        from psvideo.solve.normals.trust.doubting_kernel import fill_levels, fill_weighed

        if one.indirect is None:
            raise ValueError("`indirect` expected in the evidence: see indirect.py")
        lights, plain = len(one.plates), points.surface.error_deg is None
        bright = albedo * albedo
        common = (noise * bright).sum() / max(bright.sum(), 1e-9)  # black cloth is nothing but noise
        most = albedo.sum() / max(np.count_nonzero(points.known), 1)  # glare is no more than the rest
        weighed, counts = np.empty((*noise.shape, 4), np.float32), line(one.indirect.counts)
        fill_weighed(
            line(noise), line(albedo), counts, lights, plain, float(most), float(common), weighed.reshape(-1, 4)
        )
        found = []
        for width in points.widths:
            levels, unsure = np.empty((3, *noise.shape), np.float32), float(UNSURE_OF_NOISE - 1)
            means = _blurred(weighed, width).reshape(-1, 4)
            fill_levels(means, float(width**2), float(CERTAIN), unsure, levels.reshape(3, -1))
            weight, by_chance, margin = levels
            found.append(
                cls(
                    width=width,
                    shown=albedo,
                    weight=weight,
                    noise=noise,
                    outlying=OUTLYING_OF_ONE if lights == 4 else OUTLYING_OF_MORE,
                    by_chance=by_chance,
                    margin=margin,
                )
            )
        return found

    def typical(self, squares: Floats) -> Floats:
        """Return the typical ``squares``, of which the caller has taken off the mean that noise makes, times the
        weight. Outliers count as OUTLYING times what is typical."""
        from psvideo.solve.normals.trust.doubting_kernel import fill_limited

        limited = squares * self.shown
        means = _blurred(limited, self.width)
        given = line(squares), line(self.shown), line(self.noise), line(self.weight)
        limits = float(OUTLYING**2), float(self.outlying), float(LEAST_LEVEL_DEG**2)
        for _ in range(TURNS):
            fill_limited(*given, line(means), *limits, line(limited))
            means = _blurred(limited, self.width, means)
        return means


def _roots(squares: Floats, surroundings: list[_Surroundings]) -> tuple[Floats, Floats]:
    """Return the root of what is typical near or far, whichever is more: what is more than chance, and what is likely,
    with the margin back that was taken off for noise."""
    from psvideo.solve.normals.trust.doubting_kernel import raise_to_roots

    surely, likely = np.zeros((2, *squares.shape), np.float32)
    for each in surroundings:
        means = line(each.typical(squares))
        raise_to_roots(means, line(each.weight), line(each.by_chance), line(each.margin), line(surely), line(likely))
    return surely, likely


def _changes(points: ThinSurface, noise: Floats, free: int) -> Floats:
    """Return the square of what residuals predict, as far as it changes from sample to sample beyond noise: a root of
    ``free`` squares of independent numbers varies so much about its mean."""
    from psvideo.solve.normals.trust.doubting_kernel import fill_changes

    mean = np.sqrt(2 / free) * math.gamma((free + 1) / 2) / math.gamma(free / 2)
    changes, apart = np.empty_like(noise), max(UNEVEN_PX // points.step, 1)
    most, scale, unsure = float(MOST_FIT_DEG), float(1 / (1 - mean * mean)), float(UNSURE_OF_NOISE)
    fit = np.ascontiguousarray(points.fit_deg)
    fill_changes(fit, points.known_bytes, noise, apart, most, scale, unsure, changes)
    return changes


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


def _indirect_deg(points: ThinSurface, one: Evidence, seen: Indirect) -> Floats:
    """Return by how many degrees light from around turns the normals. Least squares takes light that every lamp adds
    alike for a vector, of which what lies across the normal turns it."""
    from psvideo.solve.normals.trust.doubting_kernel import fill_indirect_deg

    near, far = (np.stack([_blurred(plane, width) for plane in seen]).reshape(2, -1) for width in points.widths)
    added = (np.linalg.pinv(one.lit.directions) @ np.ones(len(one.plates))).astype(np.float32)
    turned = np.empty(points.known.shape, np.float32)
    fill_indirect_deg(
        points.planes.reshape(3, -1), line(seen.sums), line(seen.counts), near, far, line(points.noise_deg), added,
        LEAST_LIGHTS, line(turned),
    )  # fmt: skip
    return turned


def _torn_deg(points: ThinSurface, misfit_deg: Floats, uneven: Floats) -> tuple[Floats, Floats]:
    """Return the angle by which the normals around every point surely cannot be one surface's, and likely: around any
    four points the slopes of a surface add up to 0, and what these add up to is averaged over a square."""
    from psvideo.solve.normals.trust.doubting_kernel import fill_torn, fill_torn_deg, square_torn

    torn = np.empty((*points.known.shape, 2), np.float32)
    fill_torn(points.planes, points.known_bytes, float(LEAST_FACING), float(MOST_TORN), torn)
    square_torn(_blurred(torn, TORN).reshape(-1, 2), torn.reshape(-1, 2), math.degrees(TORN / 2))
    angles = np.empty((2, *points.known.shape), np.float32)
    given = line(points.noise_deg), line(misfit_deg), line(uneven)
    shares = float(SURELY_TORN), float(TORN_OF_NOISE)
    fill_torn_deg(_blurred(torn, NEAR).reshape(-1, 2), *given, *shares, angles.reshape(2, -1))
    return angles[0], angles[1]


def line(plane: Floats) -> Floats:
    """Return a plane as one line of float32, in the same memory where it is one."""
    return np.ascontiguousarray(plane, np.float32).reshape(-1)


def _blurred(plane: Floats, width: int, into: Floats | None = None) -> Floats:
    """Return means over squares, beyond whose borders there is nothing."""
    return np.asarray(cv2.blur(plane, (width, width), into, borderType=cv2.BORDER_CONSTANT), np.float32)


def stored(surface: Surface) -> tuple[Samples, Samples]:
    """Return normals (3, row, col) and albedo (channel, row, col) as compiled loops take them, in the same memory."""
    albedo = surface.albedo
    return bits(np.moveaxis(surface.normals, -1, 0)), bits(
        albedo[None] if albedo.ndim == 2 else np.moveaxis(albedo, -1, 0)
    )


def bits(planes: NDArray[np.floating]) -> Samples:
    """Return numbers as compiled loops take them: half floats as their bits."""
    return planes.view(np.uint16) if planes.dtype == np.float16 else planes
