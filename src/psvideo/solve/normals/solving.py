"""Which solver a run uses, and what it is asked for: chosen once, carried to every round."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from psvideo.model.arrays import Floats, Mask
from psvideo.model.choices import Solver
from psvideo.model.surface import Metal, Subject, Surface
from psvideo.solve.normals.asked_surface import AskedSurface
from psvideo.solve.normals.evidence import GRID_PX, Evidence
from psvideo.solve.normals.illumination import Illumination
from psvideo.solve.normals.least_squares import woodham1980
from psvideo.solve.normals.lit_plates import LitPlates, Plates
from psvideo.solve.normals.plate_noise import PlateNoise, noise_of
from psvideo.solve.normals.robust import huber1981
from psvideo.solve.normals.robust.reflectance import LIGHTS_FOR_REFLECTANCE
from psvideo.solve.normals.robust.subject_points import SubjectPoints
from psvideo.solve.normals.robust.weighing import EVERYTHING_DEG, Reweighting
from psvideo.solve.normals.task import Looks, Usable
from psvideo.solve.normals.trust.continued import continued, continued_at_rest
from psvideo.solve.normals.trust.doubts import Doubts
from psvideo.solve.normals.trust.indirect import IndirectLook
from psvideo.solve.normals.trust.judging import Judging, emptied, judged, with_unchecked
from psvideo.solve.normals.trust.unchecked import ALL_EXPLAINED

Method = Literal["least-squares", "robust"]
ROBUST_FROM_LIGHTS = 5
"""With five lights a highlight and a shadow can both be seen; with fewer there is nothing to weigh."""
CERTAIN = 5.0
"""A measurement counts as lit from this many standard deviations of a dark one on: of three million dark ones,
one does, and a picture has as many."""
INDIRECT = 0.2
"""Below this share of the pixel's mean, light in shadow may come from neighbouring surfaces: where many measurements
are brighter it is left out. (Of a surface of albedo 0.5 a wide crease sends back as much.)"""
EVERYTHING = Reweighting(most_error_deg=EVERYTHING_DEG)
MATTE = Subject(reflectance=None)
"""What metal's plates show once they are as a matte surface would show them."""


@dataclass(frozen=True, kw_only=True)
class Solving:
    """``solver`` "auto" is robust from ROBUST_FROM_LIGHTS lights on. ``half`` gives half floats; ``residual`` and
    ``error`` ask for what the surface may hold as well. ``fill`` gives every pixel of the subject a normal. ``spare``
    is a folder in whose files large pictures are worked on; without one they lie in memory. ``grid_px``: at most this
    many points along the longer side say how far normals may be off. ``subject`` is what a take's rounds share; without
    it every round finds its own."""

    solver: Solver = "auto"
    half: bool = False
    residual: bool = False
    error: bool = False
    fill: bool = True
    spare: Path | None = None
    grid_px: int = GRID_PX
    subject: Subject | None = None
    metal: bool = True

    def method(self, lights: int) -> Method:
        """Return the solver for this many lights."""
        if self.solver == "auto":
            return "robust" if lights >= ROBUST_FROM_LIGHTS else "least-squares"
        return self.solver

    def looks_at_subject(self, lights: int) -> bool:
        """Return whether so many lights show what a subject reflects beyond n . l, to a solver that uses it."""
        return lights >= LIGHTS_FOR_REFLECTANCE and self.method(lights) == "robust"

    def solve(
        self,
        plates: Plates,
        lit: Illumination,
        *,
        seen: Mask | None = None,
        mask: Mask | None = None,
        unsure: Floats | None = None,
        moves: Mask | None = None,
    ) -> Surface:
        """Return the surface that explains one plate per light; see ``LitPlates`` for the arguments."""
        return self.solve_again(LitPlates(plates=plates, lit=lit, seen=seen, mask=mask, unsure=unsure, moves=moves))[0]

    def solve_again(self, given: LitPlates, *, before: Doubts = Doubts()) -> tuple[Surface, Doubts]:
        """Return the same, and how far it may be off beyond noise, with what was known of that ``before``, of rounds in
        which everything stood as it does."""
        from psvideo.solve.filling.filled import filled
        from psvideo.solve.filling.leaving_out import left_out

        how, metal_deg = self, None
        if (metal := self._metal(given)) is not None:
            given, metal_deg = self._as_matte(given, metal)
            how = replace(self, subject=MATTE)
        solved, one, noise = how.measured(given, noise=before.known_noise)
        one = replace(one, metal_deg=metal_deg)
        known, doubts = judged(solved, one, noise, before=before)
        moves = one.moves if one.moved else None
        known = continued_at_rest(known, moves, limit_deg=Judging().most_error_deg)
        if one.moved and one.moves is not None:
            known = continued(known, one.moves, limit_deg=Judging().most_moving_error_deg)
        without = left_out(known, one, solved=solved.valid) if self.fill else None
        known = replace(
            known,
            residual=known.residual if self.residual else None,
            error_deg=known.error_deg if self.error else None,
        )
        valid = solved.valid
        del solved  # residuals that nobody asked for are gone with it
        whole = filled(known, one, solved=valid, noise=noise.dark, without=without) if self.fill else emptied(known)
        return with_unchecked(whole, one, noise), doubts

    def _metal(self, given: LitPlates) -> Metal | None:
        """Return what the subject shows as metal; None where it is none, or is not asked for it."""
        from psvideo.solve.normals.metal.metal_fit import LIGHTS_FOR_METAL, metal_of

        lights = len(given.plates)
        if not self.metal or lights < LIGHTS_FOR_METAL or not self.looks_at_subject(lights):
            return None
        if self.subject is not None:
            return self.subject.metal
        points = self.look(given)
        return None if points is None else metal_of([points])

    def _as_matte(self, given: LitPlates, metal: Metal) -> tuple[LitPlates, Floats]:
        """Return plates as a matte surface with the same normals would show them, and by how much these may be off for
        what is not known of the metal."""
        from psvideo.solve.normals.metal.matte_plates import matte_plates, metal_doubt_deg

        plates, lit, seen = given.plates, given.lit, given.seen
        solved, one, _ = self.measured(replace(given, moves=None, steadied=False))
        step = one.step_of(solved.valid.shape)
        doubt = metal_doubt_deg(plates, lit, metal, solved, one.usable, seen=seen, step=step)
        made = matte_plates(plates, lit, metal, solved, one.usable, seen=seen, mask=given.mask, spare=self.spare)
        return replace(given, plates=made), doubt

    def look(self, given: LitPlates) -> SubjectPoints | None:
        """Return points from which the subject's reflectance is found, None where it is not looked at or shows none;
        those whose plates are ``unsure`` for motion say nothing of it."""
        if not self.looks_at_subject(len(given.plates)):
            return None
        noise = noise_of(given.plates, given.lit)
        usable = _usable(noise, given.lit, "robust")
        return huber1981.look(given, usable=usable, reweighting=EVERYTHING, plate_noise=noise, spare=self.spare)

    def measured(self, given: LitPlates, *, noise: PlateNoise | None = None) -> tuple[Surface, Evidence, PlateNoise]:
        """Return every pixel that three measurements solve, well or not, and what it is judged by; ``noise`` is that of
        the plates, where it is known."""
        noise = noise_of(given.plates, given.lit) if noise is None else noise
        usable = _usable(noise, given.lit, self.method(len(given.plates)))
        one = Evidence.of(given, usable, spare=self.spare, grid_px=self.grid_px)
        looks = IndirectLook.of(one, noise)
        solved = self._solved(one, noise, looks)
        return solved, replace(one, indirect=looks.found, left=looks.left if looks.left.lights.size else None), noise

    def _solved(self, one: Evidence, noise: PlateNoise, looks: Looks) -> Surface:
        """Return what the solver makes of the plates."""
        asked = AskedSurface(half=self.half, residual=self.residual, spare=self.spare)
        if self.method(len(one.plates)) == "robust":
            return huber1981.solve(
                one,
                usable=one.usable,
                reweighting=EVERYTHING,
                asked=asked,
                subject=self.subject,
                plate_noise=noise,
                looks=looks,
            )
        asked = replace(asked, residual=self.residual or len(one.plates) > 3)  # three measurements leave none
        return woodham1980.solve(one, usable=one.usable, asked=asked, looks=looks)


def _usable(noise: PlateNoise, lit: Illumination, method: Method) -> Usable:
    """Return which measurements count: those that stand out of noise, and what else the method leaves out."""
    dark = CERTAIN * max(noise.dark * np.sqrt(lit.noise_shares[0]), noise.least)
    return Usable(dark_level=float(dark), shadow_ratio=INDIRECT if method == "robust" else 0.0)


def most_claimed_deg(lights: int) -> float:
    """Return the error that a trusted normal claims at most; infinity under three lights, whose errors hold what trust
    does not go by."""
    return Judging().most_error_deg if lights > ALL_EXPLAINED else float("inf")


def trust_note(method: Method, lights: int) -> str:
    """Return in one sentence what a valid normal of this solver and this many lights can be relied on for."""
    how = Judging()
    trusted = (
        f"A normal is valid where it was measured and its predicted error is at most {how.most_error_deg:g} degrees, "
        f"{how.most_moving_error_deg:g} where it moves. "
        "Where rig or surface spoil all pixels alike, the judgement of accuracy says so. "
    )
    if lights == 3:
        return trusted + (
            "Three lights explain any three brightnesses exactly: highlights, soft shadows or light from neighbouring "
            "surfaces cannot be seen, but where normals belong to no surface."
        )
    if method == "least-squares":
        return trusted + (
            "Least squares takes the surface as matte: shadow and saturation are left out, and a highlight turns the "
            "normal towards it. The residual shows where that may be."
        )
    if lights == 4:
        return trusted + (
            "Of four lights that contradict each other the likeliest highlight is left out; where a shadow or a second "
            "highlight spoils another, it is not seen."
        )
    return trusted + "Highlights and shadows weigh little. Where only three measurements are usable nothing is checked."
