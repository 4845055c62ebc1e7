"""Rounds of plates in, the surface at every instant out."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Masks
from psvideo.model.irradiance.falloff import Falloff
from psvideo.model.irradiance.intensity import lights_as_planned, per_saturation, where_least_arrives
from psvideo.model.plan import Plan
from psvideo.model.rig import Light, Rig
from psvideo.model.surface import Subject, Surface
from psvideo.plates.sequence import Round
from psvideo.solve.at_rest import AtRest
from psvideo.solve.depth import View, view_of
from psvideo.solve.given_round import GivenRound
from psvideo.solve.near_surface import NearSurface, solve_near
from psvideo.solve.normals.illumination import Illumination, illumination
from psvideo.solve.normals.metal.metal_fit import metal_of
from psvideo.solve.normals.robust.reflectance import reflectance_of
from psvideo.solve.normals.robust.subject_points import SubjectPoints
from psvideo.solve.normals.solving import Solving, most_claimed_deg
from psvideo.solve.normals.trust.doubts import Doubts
from psvideo.solve.passes.asked_passes import AskedPasses, Passes, passes_of
from psvideo.solve.steady import Steady, steadied
from psvideo.solve.sweeping import swept


@dataclass(frozen=True, kw_only=True)
class Instant:
    """The surface at one instant, and the round of plates that it was solved from.

    Attributes
    ----------
    round
        Its ``number``, ``time_s`` and ``plates``.
    surface
        Normals, albedo and validity of that instant.
    passes
        What was asked for of its plates beside these; None where nothing was.
    """

    round: Round
    surface: Surface
    passes: Passes | None = None


def surfaces(
    gathered: Iterable[Round],
    plan: Plan,
    rig: Rig,
    *,
    masks: Masks | None = None,
    solving: Solving = Solving(),
    near: NearSurface | None = None,
    falloff: Falloff | None = None,
    asked: AskedPasses = AskedPasses(),
    one_by_one: bool = False,
) -> Iterator[Instant]:
    """Solve every round that has a plate of each of the plan's lights; the clip's start and end cut the others.

    ``masks`` say where to solve, ``near`` where near lights find the surface, ``falloff`` what share of their light
    arrives where, ``asked`` which passes are made as well. ``one_by_one``: rounds do not say what stood still between
    them, and nothing is held from one to the next. Raises PsvideoError where the rig lacks a light, its lights
    give no normals, or a round has no mask.
    """
    solver = _RoundSolver.of(
        plan, rig, masks=masks, solving=solving, near=near, falloff=falloff, asked=asked, one_by_one=one_by_one
    )
    # map and filter hold no round while the next one gathers, as a loop's variable would
    return map(solver.solve, filter(lambda one: one.lights == plan.lights, gathered))


def subject_of(
    gathered: Iterable[Round],
    plan: Plan,
    rig: Rig,
    *,
    masks: Masks | None = None,
    solving: Solving = Solving(),
    near: NearSurface | None = None,
    falloff: Falloff | None = None,
) -> Subject | None:
    """Return what all rounds of a take share of their subject, found from a few of them; None where there are none.
    Arguments are those of ``surfaces``."""
    solver = _RoundSolver.of(plan, rig, masks=masks, solving=solving, near=near, falloff=falloff)
    looks = [*map(solver.look, filter(lambda one: one.lights == plan.lights, gathered))]
    known = [one for one in looks if one is not None]
    return Subject(reflectance=reflectance_of(known), metal=metal_of(known)) if looks else None


@dataclass(kw_only=True)
class _RoundSolver:
    """What all rounds are solved with; and ``steady`` and ``at_rest``, which are known of those before and renewed by
    solving a round."""

    lights: Sequence[Light]
    view: View
    shares: Sequence[NDArray[np.float32]] | None
    masks: Masks | None
    solving: Solving
    near: NearSurface | None
    asked: AskedPasses
    one_by_one: bool
    steady: Steady | None = None
    at_rest: AtRest | None = None

    @classmethod
    def of(
        cls,
        plan: Plan,
        rig: Rig,
        *,
        masks: Masks | None,
        solving: Solving,
        near: NearSurface | None,
        falloff: Falloff | None,
        asked: AskedPasses = AskedPasses(),
        one_by_one: bool = False,
    ) -> "_RoundSolver":
        """Arguments are those of ``surfaces``."""
        lights = lights_as_planned(rig, plan)
        shares = None if falloff is None else [falloff.field(light.name) for light in lights]
        if shares is not None:
            lights = tuple(where_least_arrives(light, share) for light, share in zip(lights, shares, strict=True))
        return cls(
            lights=lights,
            view=view_of(rig),
            shares=shares,
            masks=masks,
            solving=solving,
            near=near,
            asked=asked,
            one_by_one=one_by_one,
        )

    def solve(self, one: Round) -> Instant:
        """Solve one round; where its subject stood still, trust is that of the rounds before."""
        given = self._given(one)
        surface, lit = self._surface(one, given)
        if one.doubtful is not None:
            surface = _without(surface, one.doubtful)
        steady = steadied(
            self.steady, surface, one.number, one.stood, given.shown_by_all,
            moved=one.moved, most_deg=most_claimed_deg(len(one.plates)), spare=self.solving.spare,
        )  # fmt: skip
        self.steady = None if self.one_by_one else steady
        plates, shown, mask = given.plates, given.shown, given.mask
        made = passes_of(self.asked, plates, surface, lit, seen=shown, mask=mask) if self.asked.any else None
        return Instant(round=one, surface=surface, passes=made)

    def look(self, one: Round) -> SubjectPoints | None:
        """Return points of one round's subject, under near lights where its depth puts them."""
        given = self._given(one)
        lit = self._light(one)(ground=None) if self.near is None else self._surface(one, given)[1]
        return self.solving.look(given.under(lit))

    def _given(self, one: Round) -> GivenRound:
        return GivenRound.of(one, masks=self.masks, shares=self.shares)

    def _scaled(self, one: Round) -> list[Light]:
        return [per_saturation(light, plate.saturation) for light, plate in zip(self.lights, one.plates, strict=True)]

    def _light(self, one: Round) -> Callable[..., Illumination]:
        channels = 1 if len(one.plates[0].shape) == 2 else 3
        return partial(illumination, self._scaled(one), channels=channels, view=self.view)

    def _surface(self, one: Round, given: GivenRound) -> tuple[Surface, Illumination]:
        """Return a round's surface, and the light that it was solved with in the end: near lights' changes on the way
        as the surface is found."""
        light, near = self._light(one), None if self.near is None else self.near.at(one.number)
        here = None if near is None else swept(near, self._scaled(one), given.plates, seen=given.shown)
        lit = light(ground=None if here is None else here.ground)

        def solve(found: Illumination) -> Surface:
            nonlocal lit
            lit = found
            return self.solving.solve_again(given.under(found))[0]

        if here is not None:
            return solve_near(here, lambda ground: light(ground=ground), solve), lit
        before = Doubts() if self.at_rest is None else self.at_rest.until(one)
        surface, doubts = self.solving.solve_again(given.under(lit), before=before)
        alone = self.one_by_one or (self.masks is not None and self.masks.still is None)
        self.at_rest = None if alone else AtRest.since(one, doubts)
        return surface, lit


def _without(surface: Surface, doubtful: NDArray[np.bool_]) -> Surface:
    """Return a surface that is not valid where it is doubtful; 0 there, where nothing was to be filled."""
    valid = surface.valid & ~doubtful
    if surface.source is not None:
        return replace(surface, valid=valid)
    empty = surface.valid & doubtful
    surface.normals[empty] = 0
    surface.albedo[empty] = 0
    for plane in (surface.residual, surface.error_deg):
        if plane is not None:
            plane[empty] = 0
    return replace(surface, valid=valid)
