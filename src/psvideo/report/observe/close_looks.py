"""What takes longer to look at than every round allows: sharpness, noise, slopes, the rig's lean, shadows."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace

import numpy as np

from psvideo.model.surface import Surface
from psvideo.plates.sequence import Round
from psvideo.report.observe.against_noise import AgainstNoise, against_noise
from psvideo.report.observe.alignment.astray import Astray
from psvideo.report.observe.facts import Seen
from psvideo.report.observe.focus import middle_of, sharpest_blur_px
from psvideo.report.observe.rig_and_curve.outward import Facing, outward
from psvideo.report.observe.rig_and_curve.rigpoints import RigPoints
from psvideo.report.observe.rig_and_curve.slopes import Averaged, coarse_normals, share_away, surface_agreement
from psvideo.report.observe.rig_and_curve.yuille1997 import Lean, Lens, lean
from psvideo.report.observe.shadow import shadow_light
from psvideo.report.observe.thinned import step_of, thin_surface


@dataclass(kw_only=True)
class CloseLooks:
    """What closer looks found, one value a look where there was something to see.

    ``blurs_px`` are of the sharpest edges; ``noises`` how far the subject's light stands out of the plates' noise;
    ``slopes`` how far normals are one surface's, ``away`` which share of them faces away from the camera, ``outward``
    how they face at the outline; ``leans`` how far the rig seems to be turned; ``in_shadow`` which share of a lamp's
    light is left where it cannot reach; ``astray`` by how far photographs lie apart.
    """

    blurs_px: list[float] = field(default_factory=list)
    noises: list[AgainstNoise] = field(default_factory=list)
    slopes: list[float] = field(default_factory=list)
    away: list[float] = field(default_factory=list)
    outward: list[Facing] = field(default_factory=list)
    leans: list[Lean] = field(default_factory=list)
    in_shadow: list[float] = field(default_factory=list)
    astray: list[Astray] = field(default_factory=list)

    def followed_by(self, other: "CloseLooks") -> None:
        """Take in what was seen of later rounds."""
        for one in fields(self):
            getattr(self, one.name).extend(getattr(other, one.name))

    def look_at_plates(self, one: Round, seen: Seen, *, watched: str) -> Iterator[None]:
        """Look how sharp the picture of the light ``watched`` is, and at a round's noise, a step each."""
        yield
        plate = next((plate for plate in one.plates if plate.light == watched), one.plates[0])
        blur_px = sharpest_blur_px(middle_of(plate.picture))
        if blur_px is not None:
            self.blurs_px.append(blur_px)
        yield
        noise = against_noise(one, seen)
        if noise is not None:
            self.noises.append(noise)

    def look_at_surface(
        self, surface: Surface, some: Surface | None, seen: Seen, *, lights: int, lens: Lens | None, moving_share: float
    ) -> Iterator[None]:
        """Look whether normals are one surface's under a rig that is right; ``some`` is the surface, thinned, and
        ``moving_share`` how much of the picture moves."""
        small = self.look_at_slopes(surface, some, lights=lights)
        yield
        found = lean(small, lens=lens)
        if found is not None:
            self.leans.append(replace(found, moving_share=moving_share))
        self.look_at_outline(thin_surface(surface) if some is None else some, seen)

    def look_at_slopes(self, surface: Surface, some: Surface | None = None, *, lights: int) -> Averaged:
        """Look whether normals are those of one surface, which faces the camera; return them coarsely. ``some`` is the
        surface, thinned; ``lights`` is how many lights the take has."""
        small = coarse_normals(surface)
        agreement = surface_agreement(surface, small, lights=lights)
        if agreement is not None:
            self.slopes.append(agreement)
        self.away.append(share_away(surface, some))
        return small

    def look_at_outline(self, some: Surface, seen: Seen) -> None:
        """Look whether normals face outwards where the subject ends; ``some`` is the surface, thinned."""
        faces = outward(some, seen.subject, seen.bright.max(axis=0), np.asarray(seen.shown.all(axis=0)))
        self.outward += [] if faces is None else [faces]

    def look_into_shadow(self, surface: Surface, seen: Seen, points: RigPoints) -> None:
        """Look what is left of a lamp's light where it cannot reach; of a rig that sends light alike everywhere."""
        if points.near:
            return
        step, ways = step_of(*surface.valid.shape), points.vectors[0]
        found = shadow_light(seen.bright, seen.shown, surface, ways, step=step)
        if found is not None:
            self.in_shadow.append(found)
