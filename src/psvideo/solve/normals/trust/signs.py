"""What speaks against normals: residuals, light from around, and normals that belong to no surface.

These signs are looked for on a coarse grid, and around every pixel, since they are smooth where noise is not. What the
lights leave unexplained says how far the model is from the surface. Light that shows where a lamp does not reach came
by way of other surfaces, which light everything alike and leave no residual. And normals that belong to no surface are
wrong whatever the lights say of them (``torn.py``). A pixel whose albedo stands out where its residuals do is off by
itself (``by_length.py``). Where lights can hardly be held against each other, albedo that goes with the slope shows
what turns normals (``by_slope.py``), albedo that pales what is mirrored (``by_colour.py``), and normals that keep one
angle to a lamp its shadow (``lit_shadows.py``).
"""

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.model.arrays import Floats
from psvideo.solve.normals.evidence import Evidence, Indirect
from psvideo.solve.normals.trust.added_light import Added, added_unseen, modelled_deg
from psvideo.solve.normals.trust.by_colour import by_colour_deg
from psvideo.solve.normals.trust.by_length import by_length_deg
from psvideo.solve.normals.trust.by_slope import by_slope_deg
from psvideo.solve.normals.trust.few_checked import turned_by_causes
from psvideo.solve.normals.trust.hidden_share import hidden_of
from psvideo.solve.normals.trust.indirect import not_of_motion
from psvideo.solve.normals.trust.lit_shadows import LitShadows, shadows_of
from psvideo.solve.normals.trust.surroundings import UNSURE_OF_NOISE, Surroundings, roots
from psvideo.solve.normals.trust.thin_surface import ThinSurface, blurred, line
from psvideo.solve.normals.trust.torn import torn_angles_deg
from psvideo.solve.normals.trust.unchecked import (
    ALL_EXPLAINED,
    reached_by_all,
    torn_share,
    unseen_share,
)

MOST_FIT_DEG = np.float32(24)
"""What residuals predict counts as no more around a point: a line of rows that went wrong is not its surroundings."""
MOVING_DEG, OF_MOTION = np.float32(0.5), 5
"""Where motion turns normals by more, over this many points, residuals are its own, and no misfit of rig or surface."""
UNEVEN_PX, SURFACES_UNEVEN = 4, np.float32(0.7)
"""Samples this far apart are compared: a codec's errors are alike in nearer ones. The misfit of surfaces changes by
up to the second share of it, near the noise; only what is beyond that counts as a codec's."""
WHOLE = ("hidden", "plain", "shadows_lit", "unsaid", "explained", "by_rig")
"""What ``Signs`` says of all points at once."""
ONE_LEFT = ALL_EXPLAINED + 1
"""This many lights leave one number over, and albedo says more of how far normals are off. (Under five and six two and
four points more would be trusted, and of Washington's sphere 6 % over 10 degrees instead of 1.)"""
LEAST_UNREACHED = 0.02
"""Light from around is known where at least this many lights, in the mean, do not reach a point."""


@dataclass(frozen=True, kw_only=True)
class Signs:
    """What is looked for, (row, col) of the points, in degrees: what residuals surely predict beyond noise, by which
    angle light from around would turn the normal, by which normals around surely belong to no surface, and what noise
    makes more where some lights are not used. ``hidden``: how many times more these lights hide of what is not matte
    than enough of them do (of least squares, than others); ``plain``: whether residuals are of least squares.
    ``uneven``: the share of the misfit that changes from
    sample to sample, as errors of codecs do and surfaces do not: of that nothing is hidden. ``likely_misfit_deg``,
    ``likely_torn_deg``: the first and third without a margin for what noise could be instead; ``noise_deg`` is what
    noise makes of the normals. ``unchecked_deg``: what lights that cannot be held against each other leave of real
    surfaces, though nothing shows; it counts in errors, and not in what is trusted. ``torn_share``: by how much
    of themselves torn normals count whatever else shows, under lights that can hardly be held against each other.
    ``by_model_deg``: by how much the model of the subject's reflectance would turn the normals under four and five
    lights (``few_checked.py``); ``explained``: how far the misfit is known to come of such a model or of lights that
    are off (``by_rig``), 0 to 1, and ``by_cause_deg`` by how much that turns normals. ``by_slope_deg``: by how much
    normals are turned as albedo that goes with the slope shows it, under lights that can hardly be held against each
    other (``by_slope.py``); ``by_colour_deg`` as its colour does (``by_colour.py``). ``unsaid``: how far the one
    residual of four such lights does not say it, 0 to 1, where albedo does; ``in_light``: where it does, 0 to 1, since
    all lamps reach or shadows are black. ``shadows_deg``: by how much they may be where a shadow that is lit from
    around passes for light (``lit_shadows.py``), ``shadows_lit`` whether the subject's shadows are so lit, 0 to 1.
    ``by_length_deg``: by how much albedo and residuals stand out together beyond what is usual around a point
    (``by_length.py``)."""

    misfit_deg: Floats
    indirect_deg: Floats
    torn_deg: Floats
    lost_deg: Floats
    hidden: float
    likely_misfit_deg: Floats
    likely_torn_deg: Floats
    noise_deg: Floats
    plain: bool = False
    uneven: Floats | float = 0.0
    unchecked_deg: Floats | float = 0.0
    by_model_deg: Floats | float = 0.0
    by_cause_deg: Floats | float = 0.0
    explained: float = 0.0
    by_rig: bool = False
    torn_share: Floats | float = 0.0
    by_slope_deg: Floats | float = 0.0
    by_colour_deg: Floats | float = 0.0
    unsaid: float = 0.0
    in_light: Floats | float = 1.0
    shadows_deg: Floats | float = 0.0
    shadows_lit: float = 0.0
    by_length_deg: Floats | float = 0.0

    def at(self, some: NDArray[np.bool_] | NDArray[np.intp]) -> "Signs":
        """Return the signs of some of the points."""
        shape = self.misfit_deg.shape
        each = {one.name: getattr(self, one.name) for one in fields(self) if one.name not in WHOLE}
        here: dict[str, Any] = {name: np.broadcast_to(value, shape)[some] for name, value in each.items()}
        return replace(self, **here)


def signs_of(points: ThinSurface, one: Evidence, turned_deg: Floats | None = None, *, by_slope: bool = True) -> Signs:
    """Return what speaks against the points' normals. ``turned_deg`` is by how much motion turns them, which is no
    misfit of rig or surface; without ``by_slope`` nobody looks at what albedo shows. Raises ValueError
    where nobody looked for light from around."""
    if one.indirect is None:
        raise ValueError("`indirect` expected in the evidence: see indirect.py")
    lights, plain = len(one.plates), points.surface.error_deg is None
    wider = one.indirect.wider if points.noisier is None else one.indirect.wider * points.noisier
    squares, noise, shown = _beyond_noise(points, wider)
    still = points.known
    if turned_deg is not None:
        rests = cv2.blur(turned_deg, (OF_MOTION, OF_MOTION)) < MOVING_DEG
        squares *= rests
        still = still & rests
    surroundings = Surroundings.both(points, noise, shown, one)
    misfit_deg, likely_deg = roots(squares, surroundings)
    uneven = np.zeros_like(noise)
    if plain and lights > 3:
        uneven = _uneven(misfit_deg, roots(_changes(points, noise, lights - 3), surroundings)[0])
    torn_deg, likely_torn_deg = torn_angles_deg(points, misfit_deg, uneven, one.lit.view, one.plates[0].shape)
    unseen, added = 0.0, tuple[Added, ...]()
    if by_slope and not one.moved:  # what was not followed goes with it too
        unseen, added = unseen_share(one.lit), added_unseen(one.lit)
    turned_by_it_deg = modelled_deg(points, one, still) if added else 0.0
    shadows = shadows_of(points, one.lit, still) if unseen else LitShadows(np.zeros_like(noise), 0.0)
    causes = turned_by_causes(points.surface, points.step, one, still, of_noise=_of_noise(points))
    slope = None
    if unseen or added:
        slope = by_slope_deg(points, one.lit, still, unseen=unseen, added=added, modelled_deg=turned_by_it_deg)
    unsaid = unseen if plain and lights == ONE_LEFT and slope is not None else 0.0
    return Signs(
        misfit_deg=misfit_deg,
        likely_misfit_deg=likely_deg,
        uneven=uneven,
        indirect_deg=_indirect_deg(points, one, one.indirect),
        torn_deg=torn_deg,
        likely_torn_deg=likely_torn_deg,
        noise_deg=points.noise_deg,
        lost_deg=points.noise_deg * np.sqrt(wider - 1),
        hidden=hidden_of(one.lit, plain=plain, beside_slope=not one.moved),
        plain=plain,
        by_model_deg=0.0 if causes is None else causes.by_model_deg,
        by_cause_deg=0.0 if causes is None else causes.by_cause_deg,
        explained=0.0 if causes is None else causes.explained,
        by_rig=causes is not None and causes.by_rig,
        torn_share=torn_share(points, one.lit),
        by_slope_deg=0.0 if slope is None else slope,
        by_colour_deg=np.float32(unseen) * by_colour_deg(points, one.lit, still) if unseen else 0.0,
        unsaid=unsaid,
        in_light=1 - np.float32(shadows.lit) * (1 - reached_by_all(points, one.lit)) if unsaid else 1.0,
        shadows_deg=np.float32(unseen) * shadows.off_deg,
        shadows_lit=shadows.lit,
        by_length_deg=0.0 if one.moved else by_length_deg(points, squares, noise),
    )


def _beyond_noise(points: ThinSurface, wider: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the squares of what residuals predict beyond noise, those of noise, and the albedo where anything is
    known; ``wider`` is by how much noise grows with the lights that reach a point."""
    from psvideo.solve.normals.trust.signs_kernel import fill_squares

    squares, noise, shown = np.empty((3, *points.known.shape), np.float32)
    plain = points.surface.error_deg is None
    fill_squares(
        line(points.fit_deg), line(points.fit_of_noise_deg), points.known_bytes.reshape(-1), line(points.brightness),
        line(wider), plain, float(UNSURE_OF_NOISE), float(MOST_FIT_DEG), line(squares), line(noise),
        line(shown),
    )  # fmt: skip
    return squares, noise, shown


def _of_noise(points: ThinSurface) -> float:
    """Return which share of the squares of what residuals predict noise makes."""
    noise, whole = (float((each[points.known] ** 2).sum()) for each in (points.fit_of_noise_deg, points.fit_deg))
    return noise / max(whole, 1e-30)


def _uneven(misfit_deg: Floats, changing_deg: Floats) -> Floats:
    """Return how far a misfit is a codec's, 0 to 1, by how much of it changes from sample to sample."""
    share = (changing_deg / np.maximum(misfit_deg, np.float32(1e-6))) ** 2
    return np.asarray(np.clip((share - SURFACES_UNEVEN) / (1 - SURFACES_UNEVEN), 0, 1), np.float32)


def _changes(points: ThinSurface, noise: Floats, free: int) -> Floats:
    """Return the square of what residuals predict, as far as it changes from sample to sample beyond noise: a root of
    ``free`` squares of independent numbers varies so much about its mean."""
    from psvideo.solve.normals.trust.signs_kernel import fill_changes

    mean = np.sqrt(2 / free) * math.gamma((free + 1) / 2) / math.gamma(free / 2)
    changes, apart = np.empty_like(noise), max(UNEVEN_PX // points.step, 1)
    most, scale, unsure = float(MOST_FIT_DEG), float(1 / (1 - mean * mean)), float(UNSURE_OF_NOISE)
    fit = np.ascontiguousarray(points.fit_deg)
    fill_changes(fit, points.known_bytes, noise, apart, most, scale, unsure, changes)
    return changes


def _indirect_deg(points: ThinSurface, one: Evidence, seen: Indirect) -> Floats:
    """Return by how many degrees light from around turns the normals. Least squares takes light that every lamp adds
    alike for a vector, of which what lies across the normal turns it."""
    from psvideo.solve.normals.trust.signs_kernel import fill_indirect_deg

    sums = not_of_motion(points, one, seen.sums)
    both = np.stack([sums, seen.counts])
    near, far = (blurred(both, width).reshape(2, -1) for width in points.widths)
    added = (np.linalg.pinv(one.lit.directions) @ np.ones(len(one.plates))).astype(np.float32)
    turned = np.empty(points.known.shape, np.float32)
    fill_indirect_deg(
        points.planes.reshape(3, -1), line(sums), line(seen.counts), near, far, line(points.noise_deg), added,
        LEAST_UNREACHED, line(turned),
    )  # fmt: skip
    return turned
