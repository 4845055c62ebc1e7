"""What may turn normals beyond noise: surfaces that are not matte, a rig that is wrong, light from around.

How much each of the signs (``signs.py``) counts was fitted to objects whose normals are known.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from psvideo.compute.ranks import median
from psvideo.model.arrays import Floats
from psvideo.solve.normals.trust.signs import Signs

if TYPE_CHECKING:
    from psvideo.solve.normals.trust.doubting_kernel import Factors

EVERYTHING = 1e9
LEAST_DEG = 0.3
"""Where normals are doubted by less, nothing needs albedo to say so."""


@dataclass(frozen=True, kw_only=True)
class Doubting:
    """How much the signs count.

    misfit_deg, misfit_power, little_deg: the error m that residuals around predict beyond noise counts as
        m^(1 + power) / (m + little) of these degrees: where it is little it is noise.
    own: what a pixel's own residuals predict counts from this many times m on, wholly: a shadow's edge or a highlight.
    few_power: the more so the fewer lights there are: with this power of how much more of what is not matte they hide,
        because a normal and an albedo follow it.
    plain: so many times instead where m is of least squares, whose mean square for each measurement that is left free
        is as large under few lights as under many (fitted with subjects left out 1.2 to 1.35, on others 0.9 to 1; since
        residuals of weak lamps count for what they are in normals, a little less holds as many).
    indirect: how much of the angle counts by which light from around would turn the normal.
    torn, torn_beside, torn_alone_deg: how much more it is for each degree by which normals belong to no surface; these
        count up to a share of the other doubt, and little more: along creases and the outline of a thing before another
        there are more, where normals are as good as elsewhere. Under lights that can hardly be held against each other
        nothing else speaks, and they count without that limit (``unchecked.py``).
    by_model: the whole error is at least this share of the angle by which the subject's model would turn the normal.
    by_cause: where it is known of what a misfit comes, so much of the angle by which that turns normals counts instead.
    by_rig_of_four: under four lights, which show three numbers of the rig's twelve, up to so many times a misfit.
    length, length_beside, length_from_deg: how much it counts where albedo and residuals stand out together, and up to
        how many times of what all the rest is beyond some degrees: where nothing else speaks against a surface, edges
        of paint and shadows are as good as it is.
    albedo_times, albedo_least: where four lights hardly check each other, residuals and torn normals together
        typically count up to so many times what albedo shows, but for no less than this share; and albedo counts where
        it shows more than all of them: both where all lamps reach, or shadows are black. One number that is left over
        says now a third, now three times what normals are off by; what albedo shows strays half as far.

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
    plain: float = 1.1
    indirect: float = 1.4
    torn: float = 2.5
    torn_beside: float = 0.5
    torn_alone_deg: float = 0.1
    by_model: float = 0.75
    by_cause: float = 1.3
    by_rig_of_four: float = 1.3
    length: float = 2.0
    length_beside: float = 4.0
    length_from_deg: float = 2.0
    albedo_times: float = 2.0
    albedo_least: float = 0.5


def doubt_deg(signs: Signs, *, how: Doubting = Doubting()) -> Floats:
    """Return by how many degrees normals may be off beyond noise, (row, col) of the points.

    Noise hides part of the signs. With it an error is never predicted smaller than without: what signs are likely to be
    counts where that is more than noise and what they surely are.
    """
    from psvideo.solve.normals.trust import doubting_kernel as kernel

    times = how.misfit_deg * (how.plain if signs.plain else 1.0) * signs.hidden**how.few_power
    counts = (times, how.misfit_power, how.little_deg, how.indirect, how.torn, how.torn_beside, how.torn_alone_deg)
    planes = np.empty((kernel.SIGNS, *signs.misfit_deg.shape), np.float32)
    planes[kernel.MISFIT], planes[kernel.LIKELY_MISFIT] = signs.misfit_deg, signs.likely_misfit_deg
    planes[kernel.TORN], planes[kernel.LIKELY_TORN] = signs.torn_deg, signs.likely_torn_deg
    planes[kernel.TORN_SHARE] = signs.torn_share
    planes[kernel.AROUND], planes[kernel.UNCHECKED] = signs.indirect_deg, signs.unchecked_deg
    planes[kernel.LOST], planes[kernel.NOISE] = signs.lost_deg, signs.noise_deg
    planes[kernel.UNEVEN] = signs.uneven
    planes[kernel.BY_CAUSE] = np.float32(how.by_cause) * signs.by_cause_deg
    planes[kernel.AT_LEAST] = np.float32(how.by_model) * signs.by_model_deg
    by_albedo_deg = np.hypot(np.hypot(signs.by_slope_deg, signs.by_colour_deg), signs.shadows_deg)
    planes[kernel.BESIDE_MISFIT] = by_albedo_deg
    factors = kernel.Factors(*np.array((*counts, signs.explained, _most(signs, how)), np.float32))
    doubt = _of_planes(planes, factors, signs, how)
    if not signs.unsaid:
        return doubt
    planes[kernel.BESIDE_MISFIT] = 0
    alone = _of_planes(planes, factors, signs, how)
    either = np.maximum(_beside_albedo(signs, alone, how) * alone, by_albedo_deg)
    return np.asarray(doubt + signs.in_light * (either - doubt), np.float32)


def _most(signs: Signs, how: Doubting) -> float:
    """Return how many times the square of a misfit what explains it may be: a model no more than that; a rig turns
    normals by what residuals need not show."""
    if not signs.by_rig:
        return 1.0
    return how.by_rig_of_four**2 if signs.plain else EVERYTHING


def _of_planes(planes: Floats, factors: "Factors", signs: Signs, how: Doubting) -> Floats:
    """Return what planes of signs make, and pixels that are off by themselves."""
    from psvideo.solve.normals.trust.doubting_kernel import fill_doubt

    doubt = np.empty(planes.shape[1:], np.float32)
    fill_doubt(planes.reshape(len(planes), -1), factors, doubt.reshape(-1))
    own_deg = np.maximum(np.float32(how.length_beside) * (doubt - np.float32(how.length_from_deg)), np.float32(0))
    own_deg = np.minimum(np.float32(how.length) * signs.by_length_deg, own_deg)
    return np.asarray(np.hypot(doubt, own_deg), np.float32)


def _beside_albedo(signs: Signs, doubt: Floats, how: Doubting) -> np.float32:
    """Return how much of itself a doubt counts beside what albedo that goes with the slope typically shows, as far as
    the residual does not say it."""
    known = signs.noise_deg > 0
    if not known.any():
        return np.float32(1)
    shown = how.albedo_times / signs.unsaid * median(np.broadcast_to(signs.by_slope_deg, doubt.shape)[known])
    share = (shown / max(median(doubt[known]), LEAST_DEG)) ** signs.unsaid
    return np.float32(min(max(share, how.albedo_least), 1.0))
