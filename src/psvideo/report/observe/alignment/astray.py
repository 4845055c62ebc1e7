"""By how far the camera, or the subject, moved between pictures of one scene that were taken under one light each.

What the rig leaves unexplained says where each picture lies, and says so of parts of it (``part_places``), whose words
are put together (``similarity``). Two things more are asked before anybody is accused or acquitted. Pictures that moved
are explained better where they are put back; and where detail lies one over the other, every picture's is foretold by
the others. Of pictures that lie far apart neither fits, so that these are asked again in smaller ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.plates.light_plate import LightPlate
from psvideo.report.observe.alignment.part_places import PartPlaces, places_of_parts
from psvideo.report.observe.alignment.similarity import Similarities, similarities
from psvideo.report.observe.rig_and_curve.rigpoints import RigPoints

LIGHTS_FOR_ASTRAY = 5
"""Of four, one value a pixel is left over, which errors of many kinds explain."""
MOST_LIGHTS = 24
"""Of more pictures this many are compared, spread evenly over the list: they show whether the camera stood."""
LEAST_PARTS = 6
"""How many parts must have something to say."""
REDUCED = (1, 2, 4, 8)
"""How much smaller the pictures are made, one after the other, until their detail fits together."""
LEAST_SHOWN_PX, SURELY = 0.5, 2.5
"""Pictures that lie this far apart, and this many times their standard error, do not belong together. (Where the camera
stood: 0.02 to 0.29 px on six photographed objects, 0.01 to 0.5 on rendered ones, 2.2 times the error at most; 0.24 to
0.5 px on three whose neighbouring pictures show by themselves that the camera was touched.)"""
ONE_SHOWN_PX, ONE_SURELY = 1.0, 4.0
"""The same of a single picture among many: the farthest off of so many is farther by chance."""
LEAST_GAIN = 0.03
"""Pictures that are put back explain this share more of what the rig leaves. (Where smooth shapes or gloss feigned
shifts of 1.8 px: less than nothing; where pictures moved by 0.4 px: 0.1 to 0.3.)"""
AGREED = 0.7
"""Detail fits together where each picture's correlates so with what the others foretell. (Where the camera stood:
0.8 to 1, with little detail 0.3 to 0.7; one picture of twelve 8 px off: 0.2 at most.)"""
SEEN_PX = 0.8
"""Pictures that lie farther apart, in pixels of the smaller ones, lie farther than is seen."""


@dataclass(frozen=True, kw_only=True)
class Astray:
    """How far pictures lie from where they lie on the mean, in pixels, as root mean squares over subject and pictures.

    ``typical_px`` is all of it, by ``error_px`` unsure; ``shift_px``, ``turn_deg`` and ``zoom`` (share of the size)
    make it up, and the subject's parts are ``radius_px`` from their middle. ``light``'s picture is farthest off, by
    ``most_px``. ``shows`` says that they surely are not aligned, ``at_least`` that they may be farther apart, and
    ``agreement`` how well the detail of ``light_that_fits_least`` fits the other pictures' (correlation).
    """

    typical_px: float
    error_px: float
    shift_px: float
    turn_deg: float
    zoom: float
    radius_px: float
    light: str
    most_px: float
    agreement: float
    light_that_fits_least: str
    shows: bool
    at_least: bool = False

    @property
    def within_px(self) -> float:
        """What they may lie apart at most, as far as parts of the picture show."""
        return max(self.typical_px, self.error_px)

    @property
    def fits(self) -> bool:
        """Whether their detail fits together."""
        return self.agreement >= AGREED

    @property
    def turned_px(self) -> float:
        """What the turn moves a typical part by."""
        return float(np.radians(self.turn_deg)) * self.radius_px

    @property
    def zoomed_px(self) -> float:
        """What the scale moves a typical part by."""
        return self.zoom * self.radius_px


def astray(plates: Sequence[LightPlate], points: RigPoints, box: tuple[slice, slice]) -> Astray | None:
    """Return how far a round's plates, of the lights of ``points``, lie apart.

    ``box`` is where the subject is, rows and columns. None where there are too few lights, or too little fine detail
    that all of them reach.
    """
    lights = range(0, len(plates), -(-len(plates) // MOST_LIGHTS))
    if len(lights) < LIGHTS_FOR_ASTRAY:
        return None
    found: Astray | None = None
    for reduced in REDUCED:
        parts = places_of_parts(plates, points, lights, box, reduced=reduced)
        if len(parts) < LEAST_PARTS:
            break
        said = _said(similarities(parts), parts, [plates[light].light for light in lights], reduced)
        if found is None or said.shows:
            found = said
        if said.fits:
            break
    return found


def _said(fitted: Similarities, parts: Sequence[PartPlaces], lights: Sequence[str], reduced: int) -> Astray:
    """Return what similarities say, in pixels of the pictures as they were before they were made smaller."""
    middles = np.array([part.middle for part in parts])
    radius = float(np.sqrt(((middles - middles.mean(axis=0)) ** 2).sum(axis=1).mean()))
    worst = int(fitted.off_px.argmax())
    agreement = np.median([part.agreement for part in parts], axis=0)
    typical = _typical(fitted.off_px)
    return Astray(
        typical_px=typical * reduced,
        error_px=_typical(fitted.off_error_px) * reduced,
        shift_px=_typical(np.hypot(*fitted.shift_px.T)) * reduced,
        turn_deg=float(np.degrees(_typical(fitted.turn))),
        zoom=_typical(fitted.zoom),
        radius_px=radius * reduced,
        light=lights[worst],
        most_px=float(fitted.off_px[worst]) * reduced,
        agreement=float(agreement.min()),
        light_that_fits_least=lights[int(agreement.argmin())],
        shows=fitted.explained > LEAST_GAIN
        and (_surely(fitted.off_px, fitted.off_error_px) or _surely(fitted.uneven_px, fitted.uneven_error_px)),
        at_least=typical > SEEN_PX or float(agreement.min()) < AGREED,
    )


def _typical(each: Doubles) -> float:
    return float(np.sqrt((each**2).mean()))


def _surely(off_px: Doubles, error_px: Doubles) -> bool:
    """Return whether pictures, or one of them, are farther off than parts differ by."""
    one = bool(((off_px > ONE_SHOWN_PX) & (off_px > ONE_SURELY * error_px)).any())
    return one or _typical(off_px) > max(LEAST_SHOWN_PX, SURELY * _typical(error_px))
