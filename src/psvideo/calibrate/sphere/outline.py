"""A sphere's outline to a fraction of a pixel: found by its roundness, placed by how the picture changes at its rim.

Round things are looked for in pictures that show outlines (``round_things``); the rim of each is fitted in all
pictures together (``rim_fit``): under every light, under the room light, with the lights off.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from psvideo.calibrate.light_pictures import LightPictures
from psvideo.calibrate.sphere.rim_fit import Rim, RoughOutline, fit_rim, follow_rim, seek_rim
from psvideo.calibrate.sphere.rim_model import Surface
from psvideo.calibrate.sphere.round_things import round_things
from psvideo.calibrate.sphere.sphere_view import SphereView
from psvideo.model.arrays import Doubles, Floats
from psvideo.model.channels import mean_of_channels

GIVEN_ERROR_PX = 0.5
"""Standard error in x, y and radius of an outline that a person marked."""
LEAST_COVERAGE, LEAST_EVIDENCE = 0.6, 8.0
"""Share of the spokes that must agree on an outline, and how much likelier than chance they must make it (natural
logarithm); noise and boxes reach 0.58."""
MOST_PICTURES = 4
"""Lights are averaged to this many pictures: what misleads a rim is alike under all of them, so more do not help."""
SAME = 0.02
"""Round things nearer to an outline that was tried than this share of its radius are the same one."""
SURE_COVERAGE, RESTART_SHARE = 0.95, 0.04
"""An outline that fewer spokes agree on is looked for again from beside it, by this share of its radius."""
CANDIDATES = 4
"""This many round things of each picture are tried."""


@dataclass(frozen=True, kw_only=True)
class Outline:
    """A sphere's outline: ``place`` (5,) as in ``sphere_view``, with its ``covariance`` (5, 5).

    ``points`` (point, 2) are the edges it rests on, ``coverage`` the share of its spokes that have one, ``blur_px`` the
    standard deviation of those edges' blur. ``given``: a person marked it."""

    view: SphereView
    place: Doubles
    covariance: Doubles
    points: Doubles
    coverage: float
    blur_px: float
    given: bool = False

    @property
    def radius_px(self) -> float:
        """The radius in the middle of the picture."""
        return float(self.place[2])

    @property
    def error_px(self) -> float:
        """Standard error of the centre and radius, root mean square of the three."""
        return float(np.sqrt(np.trace(self.covariance[:3, :3]) / 3))

    @property
    def ellipticity(self) -> float:
        """By how much the longer axis exceeds the shorter one, as a share; 0 in perspective, which explains it."""
        return 2 * float(np.hypot(*self.place[3:]))


def given_outline(view: SphereView, circle: tuple[float, float, float]) -> Outline:
    """Return the outline that a circle (x, y, radius), marked by hand in the picture, stands for."""
    x, y, radius = circle
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    rim = np.stack([x + radius * np.cos(turn), y + radius * np.sin(turn)], axis=1)
    place = view.through(rim)
    return Outline(
        view=view,
        place=np.array([*circle, 0.0, 0.0]) if place is None else place,
        covariance=np.diag([GIVEN_ERROR_PX**2] * 3 + [0.0, 0.0]),
        points=np.zeros((0, 2)),
        coverage=1.0,
        blur_px=0.0,
        given=True,
    )


def rim_pictures(pictures: LightPictures, room: Floats | None = None) -> list[Floats]:
    """Return the pictures (row, col) in which a rim may show: under lights, ambient and room light."""
    grey = pictures.grey
    groups = np.array_split(np.arange(len(grey)), min(len(grey), MOST_PICTURES))
    shown = [grey[group].mean(axis=0) for group in groups]
    if pictures.ambient is not None:
        shown.append(pictures.ambient if pictures.ambient.ndim == 2 else mean_of_channels(pictures.ambient))
    if room is not None:
        shown.append(room)
    return [np.ascontiguousarray(picture, np.float32) for picture in shown]


def find_outlines(
    pictures: LightPictures,
    view: SphereView,
    *,
    count: int = 1,
    room: Floats | None = None,
    surface: Surface = "mirror",
) -> list[Outline]:
    """Return up to ``count`` spheres' outlines, those that the rim speaks for most first, none over another.

    ``room`` (row, col) is a picture of the same scene under room light.
    """
    shown = rim_pictures(pictures, room)
    seen = _telling(pictures, shown)
    guesses = sorted(_guesses(seen, view, surface), key=lambda guess: guess.evidence, reverse=True)
    chosen: list[Rim] = []
    tried: list[Doubles] = []
    for guess in guesses:
        taken = len(chosen) == count or not all(apart(guess.place, other.place) for other in chosen)
        if taken or _is_one_of(guess.place, tried):
            continue
        best = _bettered(guess, seen, view, surface)
        if not _is_one_of(best.place, tried):
            tried.append(best.place)
            fit = fit_rim(shown, view, best.place, surface=surface)
            chosen += [fit] if fit is not None and _sure(fit) else []
    return [_outline(view, fit) for fit in chosen]


def outline_near(
    pictures: LightPictures,
    view: SphereView,
    place: Doubles,
    *,
    room: Floats | None = None,
    surface: Surface = "mirror",
) -> Outline | None:
    """Return the outline within about a tenth of its radius of an expected one (5,); None where none is sure.

    ``room`` as for ``find_outlines``.
    """
    shown = rim_pictures(pictures, room)
    guess = seek_rim(_telling(pictures, shown), view, place, surface=surface)
    fit = None if guess is None else fit_rim(shown, view, guess.place, surface=surface)
    return _outline(view, fit) if fit is not None and _sure(fit) else None


def _telling(pictures: LightPictures, shown: list[Floats]) -> list[Floats]:
    """Return the pictures in which an outline is looked for first, of those in which a rim may show."""
    lit = pictures.grey
    return [lit.mean(axis=0), lit.max(axis=0), *shown[min(len(lit), MOST_PICTURES) :]]


def follow_outline(pictures: LightPictures, outline: Outline) -> Doubles:
    """Return an outline's place (5,) in other pictures of the scene; where too little of it shows, the place it had."""
    place = follow_rim(rim_pictures(pictures), outline.view, outline.place)
    return outline.place if place is None else place


def _guesses(seen: Sequence[Floats], view: SphereView, surface: Surface) -> list[RoughOutline]:
    """Return roughly the outlines of round things."""
    guesses: list[RoughOutline] = []
    for picture in seen:
        for thing in round_things(_logarithm(picture), count=CANDIDATES):
            around = given_outline(view, (thing.x, thing.y, thing.radius)).place
            if not _is_one_of(around, [guess.place for guess in guesses]):
                guess = seek_rim(seen, view, around, surface=surface)
                guesses += [guess] if guess is not None else []
    return guesses


def _is_one_of(place: Doubles, tried: Sequence[Doubles]) -> bool:
    """Return whether an outline (5,) is as good as one that was tried."""
    return any(np.abs(one - place)[:3].max() <= SAME * one[2] for one in tried)


def _bettered(guess: RoughOutline, seen: Sequence[Floats], view: SphereView, surface: Surface) -> RoughOutline:
    """Return the best of a guess and of what is found from beside it: part of a rim may have drawn it away."""
    if guess.coverage >= SURE_COVERAGE:
        return guess
    step = RESTART_SHARE * float(guess.place[2])
    ways = [*([x, y, 0] for x, y in product((-1, 1), repeat=2)), [0, 0, -1], [0, 0, 1]]
    starts = [guess.place + step * np.array([*way, 0, 0]) for way in ways]
    tried = [seek_rim(seen, view, start, surface=surface) for start in starts]
    return max([guess, *(one for one in tried if one is not None)], key=lambda one: one.evidence)


def _sure(fit: Rim) -> bool:
    return fit.coverage >= LEAST_COVERAGE and fit.evidence >= LEAST_EVIDENCE


def _logarithm(picture: Floats) -> Floats:
    """Return a picture in which a faint outline before black cloth weighs as much as one before a lit wall."""
    floor = max(0.25 * float(np.percentile(picture, 50)), 2e-4)
    logarithm: Floats = np.log(np.maximum(picture, 0) + np.float32(floor)).astype(np.float32)
    return logarithm


def _outline(view: SphereView, fit: Rim) -> Outline:
    return Outline(
        view=view,
        place=fit.place,
        covariance=fit.covariance,
        points=fit.points,
        coverage=fit.coverage,
        blur_px=fit.blur_px,
    )


def apart(one: Doubles, other: Doubles) -> bool:
    """Return whether two outlines (5,) are those of two things."""
    return float(np.hypot(*(one[:2] - other[:2]))) > 0.8 * float(one[2] + other[2])
