"""How bright a picture is across a sphere's rim, and how well that shows where the rim is.

At its very rim a smooth sphere mirrors fully (Fresnel: at grazing angles everything does) what is just behind it. So a
mirror's picture is continuous there: it only begins to change, and it does so with the cosine of incidence, which
grows as the root of the distance from the rim. Inside, the model is a cubic in that root; outside, a straight
line; all of it blurred by the lens. A matte sphere may jump at its rim, and inside it is a square in the root. The
steepest place of a mirror's edge lies inside its rim: on a dark ball before a bright wall by several pixels.

Two things break this. Metal mirrors fully only in the last tenths of a pixel of a small ball, so the picture drops
there to its reflectance. And just inside its rim a ball mirrors the room's own edges, a ceiling's or a floor's, which
follow the rim, and stand out more. So a rim may drop to any of ``REFLECTANCES``, with an edge inside.

Everything but the rim's place and the blur is linear, and eliminated by least squares (variable projection). The
residuals, as a likelihood with unknown noise, say how good a place is. Pictures and radii in which nothing stands out
favour no place, so they need no weights.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d  # type: ignore[attr-defined]

from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.model.arrays import Doubles, Floats

Surface = Literal["mirror", "matte"]

STEP_PX = 0.5
SHIFT_PX = 0.25
"""How finely pictures are sampled across the rim, and places of the rim are tried."""
_FINE_PX = 0.05
_LONGEST_PX = 160.0
_SHAPES = {
    "mirror": ("level", "slope outside", "root", "square", "cube"),
    "matte": ("outside", "slope outside", "inside", "root", "square"),
}
REFLECTANCES = (1.0, 0.85, 0.7, 0.5)
"""How much of what is behind it a ball may mirror at its rim: all (large balls), silver, steel, chrome."""
EDGED = 0.6
"""Chance that a ball mirrors an edge of the room just inside its rim, on one spoke: rooms have ceilings and floors."""
TELLING = 12
"""All spokes count as this many where they decide the reflectance: what misleads one misleads its neighbours."""
EDGES = 40
"""An edge within the rim is tried at this many places, or at every half pixel where those are fewer."""
LEAST_NOISE = 0.01
"""Share of a profile's own spread that counts as noise at least: a model is not better than that."""


def across_rim(
    pictures: Sequence[Floats], view: SphereView, place: Doubles, *, reach_px: float, spokes: int
) -> tuple[Doubles, Doubles]:
    """Return brightness across an outline, (picture, spoke, step) from ``reach_px`` inside to outside, averaged along
    the rim between spokes, NaN outside the picture; and where the spokes cross the outline, (spoke, 2)."""
    per = max(int(np.ceil(2 * np.pi * place[2] / spokes)), 1)
    rim = view.curve(place, spokes * per)
    along = np.roll(rim, -1, axis=0) - np.roll(rim, 1, axis=0)
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1, keepdims=True)
    outward *= np.sign(((rim - rim.mean(axis=0)) * outward).sum())
    steps = _steps(reach_px)
    spots = (rim[:, None] + outward[:, None] * steps[None, :, None]).astype(np.float32)
    values = [
        cv2.remap(
            picture,
            spots[..., 0],
            spots[..., 1],
            cv2.INTER_CUBIC,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=(np.nan,) * 4,
        )
        .reshape(spokes, per, len(steps))
        .mean(axis=1)
        for picture in pictures
    ]
    crossed: Doubles = rim[per // 2 :: per][:spokes].astype(np.float64)
    return np.asarray(values, np.float64), crossed


def shifts(most_px: float) -> Doubles:
    """Return the places of the rim that are tried, in pixels outward from the expected one."""
    count = round(most_px / SHIFT_PX)
    return np.arange(-count, count + 1, dtype=np.float64) * SHIFT_PX


def likely_blur(values: Doubles, *, reach_px: float, most_px: float, surface: Surface, blurs: Sequence[float]) -> float:
    """Return which blur (standard deviation in pixels) explains profiles best, each at its own best place."""
    left = {blur: _unexplained(values, blur, reach_px, most_px, surface).min(axis=2) for blur in blurs}
    return min(left, key=lambda blur: float(np.median(np.log(left[blur]), axis=1).sum()))


def log_likelihood(
    values: Doubles, *, blur_px: float, reach_px: float, most_px: float, surface: Surface, mirrored: bool = False
) -> Doubles:
    """Return how likely every place of the rim is on every spoke, over all pictures: (spoke, shift), up to a constant.

    Neighbouring samples share their noise over the blur's width, and count as one. What misleads one picture misleads
    the others in part (a reflection is the same under all lights), so n pictures count as the root of n. ``mirrored``:
    a mirror may be dimmer than what is behind it, and may show an edge within its rim.
    """
    independent = values.shape[2] * STEP_PX / (2 * blur_px + 1)
    worth = independent / np.sqrt(len(values))
    if not (mirrored and surface == "mirror"):
        left = _unexplained(values, blur_px, reach_px, most_px, surface)
        smooth: Doubles = -0.5 * worth * np.log(left).sum(axis=0)
        return smooth
    # every picture's edge has a brightness of its own, which costs as much as a number fitted to that many samples does
    cost = 0.5 * np.log(max(independent, 1.0)) * np.sqrt(len(values))
    by_reflectance: list[Doubles] = []
    for reflectance in REFLECTANCES:
        plain, edged = _with_edge(values, blur_px, reach_px, most_px, reflectance)
        number = np.maximum(np.isfinite(edged).sum(axis=2), 1)
        some_edge = np.logaddexp.reduce(-0.5 * worth * edged - cost, axis=2) - np.log(number)
        by_reflectance.append(np.logaddexp(np.log(1 - EDGED) - 0.5 * worth * plain, np.log(EDGED) + some_edge))
    # one ball has one reflectance, and its spokes together decide it, as this many independent ones
    speaks = np.array([np.logaddexp.reduce(one, axis=1).mean() * TELLING for one in by_reflectance])
    total: Doubles = np.logaddexp.reduce(np.array(by_reflectance) + (speaks - speaks.max())[:, None, None], axis=0)
    return total


def _steps(reach_px: float) -> Doubles:
    count = round(reach_px / STEP_PX)
    return np.arange(-count, count + 1, dtype=np.float64) * STEP_PX


def _unexplained(
    values: Doubles, blur_px: float, reach_px: float, most_px: float, surface: Surface
) -> NDArray[np.float64]:
    """Return the variance that the model leaves, (picture, spoke, shift); 1 where a profile leaves the picture."""
    inside, known, spread = _profiles(values)
    basis = _basis(blur_px, reach_px, most_px, surface)
    left = _left(known, basis) + _noise(known, spread)
    return np.where(inside[..., None], left / (values.shape[2] - basis.shape[2]), 1.0)


def _with_edge(
    values: Doubles, blur_px: float, reach_px: float, most_px: float, reflectance: float
) -> tuple[Doubles, Doubles]:
    """Return the logarithms of the variance that a mirror leaves, over all pictures: without an edge within its rim,
    (spoke, shift), and with one at the same place in every picture, (spoke, shift, edge), infinite outside the rim."""
    inside, known, spread = _profiles(values)
    basis = _basis(blur_px, reach_px, most_px, "mirror", reflectance)
    edges = _edges(blur_px, reach_px, most_px, reflectance)
    noise, free = _noise(known, spread), values.shape[2] - basis.shape[2]
    plain, edged = np.zeros(()), np.zeros(())
    for shown, profiles, least in zip(inside, known, noise, strict=True):
        left = _left(profiles, basis)
        rest = left[..., None] - np.einsum("idn,an->aid", edges, profiles, optimize=True) ** 2
        plain = plain + np.log(np.where(shown[:, None], (left + least) / free, 1.0))
        shown_edge = np.where(shown[:, None, None], (np.maximum(rest, 0) + least[..., None]) / (free - 1), 1.0)
        edged = edged + np.log(shown_edge)
    is_edge = (edges**2).sum(axis=2) > 0
    return plain, np.where(is_edge, edged, np.inf)


def _profiles(values: Doubles) -> tuple[NDArray[np.bool_], Doubles, Doubles]:
    """Return which profiles lie in the picture, the profiles with zeros elsewhere, and their spread."""
    inside: NDArray[np.bool_] = np.asarray(np.all(np.isfinite(values), axis=2), np.bool_)
    known = np.where(inside[..., None], values, 0.0)
    return inside, known, ((known - known.mean(axis=2, keepdims=True)) ** 2).sum(axis=2)


def _left(known: Doubles, basis: Doubles) -> Doubles:
    """Return the sum of squares (..., shift) of profiles (..., step) that orthonormal columns do not explain."""
    explained = np.einsum("ink,...n->...ik", basis, known, optimize=True)
    left: Doubles = np.maximum((known**2).sum(axis=-1)[..., None] - (explained**2).sum(axis=-1), 0)
    return left


def _noise(known: Doubles, spread: Doubles) -> Doubles:
    """Return the sum of squares that is left in any case: a share of the spread, and what float32 rounds off."""
    least: Doubles = (LEAST_NOISE**2 * spread + 1e-14 * (1 + (known**2).sum(axis=-1)))[..., None]
    return least


@lru_cache(maxsize=64)
def _basis(blur_px: float, reach_px: float, most_px: float, surface: Surface, reflectance: float = 1.0) -> Doubles:
    """Return orthonormal columns that span the model at every place of the rim, (shift, step, column)."""
    fine, shapes = _blurred(blur_px)
    away = _steps(reach_px)[None, :] - shifts(most_px)[:, None]
    shapes = {**shapes, "level": 1 - (1 - reflectance) * (1 - shapes["outside"])}
    columns = np.stack([np.interp(away, fine, shapes[name]) for name in _SHAPES[surface]], axis=2)
    columns /= np.maximum(np.linalg.norm(columns, axis=1, keepdims=True), 1e-12)
    basis: Doubles = np.linalg.qr(columns)[0]
    return basis


@lru_cache(maxsize=2 * len(REFLECTANCES))
def _edges(blur_px: float, reach_px: float, most_px: float, reflectance: float) -> Doubles:
    """Return what an edge at every place adds to the model at every place of the rim, (shift, edge, step): unit
    vectors, and zeros where the edge is not within the rim or adds nothing of its own."""
    basis = _basis(blur_px, reach_px, most_px, "mirror", reflectance)
    fine, shapes = _blurred(blur_px)
    places = np.arange(1 - reach_px, reach_px, max(STEP_PX, 0.75 * blur_px, 2 * reach_px / EDGES))
    steps = np.stack([np.interp(_steps(reach_px) - place, fine, shapes["outside"]) for place in places])
    added = steps[None] - np.einsum("ink,imk,dm->idn", basis, basis, steps, optimize=True)
    size = np.linalg.norm(added, axis=2, keepdims=True)
    within = places[None, :] <= shifts(most_px)[:, None] - max(1.0, blur_px)
    edges: Doubles = np.where(within[..., None] & (size > 0.05), added / np.maximum(size, 1e-9), 0.0)
    return edges


@lru_cache(maxsize=16)
def _blurred(blur_px: float) -> tuple[Doubles, dict[str, Doubles]]:
    """Return places across a rim at 0 (positive outside), and the model's parts there."""
    fine = np.arange(-_LONGEST_PX, _LONGEST_PX + _FINE_PX / 2, _FINE_PX)
    outside = np.clip(fine / _FINE_PX + 0.5, 0, 1)
    root = np.sqrt(np.maximum(-fine, 0))
    parts = {
        "level": np.ones_like(fine),
        "outside": outside,
        "slope outside": np.maximum(fine, 0),
        "inside": 1 - outside,
        "root": root,
        "square": root**2,
        "cube": root**3,
    }
    blurred = {
        name: gaussian_filter1d(part, blur_px / _FINE_PX, mode="nearest", truncate=5) for name, part in parts.items()
    }
    return fine, blurred
