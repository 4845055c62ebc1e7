"""Bodies in what was found to move: their motion is taken where it explains the plates of all lights.

Flow's velocities are those of shading in part, and ways were straight so far. A body's motion is fitted to them, and
then to what one surface explains; what joins thereby shows more of the body, whose motion is fitted again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.by_surface import BySurface
from psvideo.plates.align.rigid.bodies import RigidBody
from psvideo.plates.align.rigid.left_along import LeftAlong
from psvideo.plates.align.rigid.moving_parts import MovingPart, parts_of
from psvideo.plates.align.rigid.plates_seen import PlatesSeen
from psvideo.plates.align.velocity.all_lights import WINDOW_PX, AllLights
from psvideo.plates.align.velocity.followed import Followed

TURNS = 3
"""So often bodies are fitted; the first time to flow alone."""
SMOOTH_PX = (4.0, 1.5)
"""Pictures are smoothed by these when a body is fitted, in pixels of velocities, one after the other; what it explains
is asked of the last."""
LITTLE = np.float32(0.02)
"""What was found is left as it is where it leaves less: noise does."""
LITTLE_OF_BOTH = np.float32(0.05)
"""So is it under three lights, where it leaves less of the plates before and after: what slides leaves 0.02 to 0.04."""
AS_OWN, BEYOND, HOLDS = np.float32(1.05), np.float32(0.01), 0.8
"""A body's motion leaves as little as the velocity that was found, where it leaves less than the first times as much,
and the second: where it does in more than the third of what was found of the body, it is one."""
CLEARLY = np.float32(0.9)
"""Else its motion is taken where it leaves less than this share: two things that pass each other are no body, and a
hand that bends is one only in part."""
STIRS, UNLIKE = np.float32(0.08), np.float32(0.3)
"""Beside the outline of what was found, only what stirs joins: where rest leaves more than the first, or, where too
little is lit to tell, plates at rest are more unlike than by the second under each light. Noise leaves less, and a bare
wall would go along with anything."""
AS_UNLIKE = np.float32(1.1)
"""Where too little is lit to tell, what goes along is at most so many times as unlike."""


def with_bodies(surface: BySurface, lights: AllLights, found: Followed, still: Flags) -> Followed:
    """Return what was ``found`` with the motion of rigid bodies, and its bend, where that explains the plates of all
    lights. What is ``still`` (row, col) stays."""
    if not _leaves_much(surface, lights, found):
        return found
    levels = [PlatesSeen.of(surface, lights, smooth_px) for smooth_px in SMOOTH_PX]
    round_s, rest = float(lights.spans_s.sum(axis=1).mean()), _Rest.of(lights, levels[-1], found)
    for turn in range(TURNS):
        normals = surface.normals(lights, found.velocity, found.bend)
        fitted = levels if turn else []
        bodies = [RigidBody.of(part, found, normals, round_s, fitted) for part in parts_of(found)]
        found = _joined(found, bodies, _Before.of(lights, levels[-1], found, rest), still)
    return found


@dataclass(frozen=True, kw_only=True)
class _Rest:
    """What no surface explains at rest, ``left``, and how ``unlike`` plates are there, (row, col)."""

    left: LeftAlong
    unlike: Floats

    @classmethod
    def of(cls, lights: AllLights, plates: PlatesSeen, found: Followed) -> "_Rest":
        none = replace(found, velocity=np.zeros_like(found.velocity), bend=None)
        unlike = lights.mean(lights.unlike(none.velocity), WINDOW_PX)
        return cls(left=LeftAlong.of(lights, plates, plates.at_rest, none), unlike=unlike)


def _leaves_much(surface: BySurface, lights: AllLights, found: Followed) -> bool:
    """Return whether some part of what was ``found`` leaves enough that a body's motion may leave less."""
    if surface.checked:
        at_once = surface.left(lights, found.velocity, found.bend)
        wide, known, little = at_once.wide, at_once.known, LITTLE
    else:
        plates = PlatesSeen.of(surface, lights, SMOOTH_PX[-1])
        along = LeftAlong.of(lights, plates, plates.at_rest, found)
        wide, known, little = along.wide, along.told, LITTLE_OF_BOTH
    told = [wide[part.found & known] for part in parts_of(found)]
    return any(not one.size or bool(one.mean() > little) for one in told)


@dataclass(frozen=True, kw_only=True)
class _Before:
    """What ``plates`` of all ``lights`` were found to show before bodies are tried: at ``rest``, and along what was
    ``found`` (or at rest, where that is less), its ``own`` and how ``unlike`` they are, (row, col)."""

    lights: AllLights
    plates: PlatesSeen
    rest: _Rest
    found: Followed
    own: LeftAlong
    unlike: Floats

    @classmethod
    def of(cls, lights: AllLights, plates: PlatesSeen, found: Followed, rest: _Rest) -> "_Before":
        own = LeftAlong.of(lights, plates, plates.at_rest, found).least(rest.left)
        unlike = np.minimum(lights.mean(lights.unlike(found.velocity), WINDOW_PX), rest.unlike)
        return cls(lights=lights, plates=plates, rest=rest, found=found, own=own, unlike=unlike)

    def explained(self, body: RigidBody, moved: Followed) -> tuple[Flags, Floats]:
        """Return where a body that ``moved`` explains the plates as well as what was found, and what it leaves there,
        (row, col)."""
        part, lamps = body.part, self.plates.turned(body.motion)
        left, turned = (
            LeftAlong.of(self.lights, self.plates, lamps, each, part.about, body.points.near)
            for each in (moved, self.found)
        )
        along = self.lights.mean(self.lights.unlike(moved.velocity), WINDOW_PX)
        fits = np.where(left.told, _holds(left, self.own.least(turned), part), along < AS_UNLIKE * self.unlike)
        stirs = np.where(left.told, self.rest.left.wide > STIRS, self.rest.unlike > UNLIKE * self.lights.count)
        return np.asarray(fits & part.about & (stirs | part.within)), left.wide


def _holds(left: LeftAlong, before: LeftAlong, part: MovingPart) -> Flags:
    """Return where a body's motion leaves as little as what was found ``before``, or clearly less, (row, col)."""
    as_own = left.wide < AS_OWN * before.wide + BEYOND
    tells = part.found & left.told
    if np.count_nonzero(as_own & tells) > HOLDS * np.count_nonzero(tells):
        return np.asarray(as_own)
    return np.asarray(left.wide < CLEARLY * before.wide)


def _joined(found: Followed, bodies: Sequence[RigidBody], before: _Before, still: Flags) -> Followed:
    """Return what was ``found``, but for what is ``still`` (row, col), as the body moves that explains it best."""
    velocity, bend = found.velocity, found.bends
    taken, least = np.zeros(still.shape, np.bool_), np.full(still.shape, np.inf, np.float32)
    for body in bodies:
        moved = body.moved(found)
        fits, left = before.explained(body, moved)
        best = fits & ~still & (left < least)
        velocity, bend = np.where(best, moved.velocity, velocity), np.where(best, moved.bends, bend)
        taken, least = taken | best, np.where(best, left, least)
    moves = found.moves | taken
    return replace(
        found,
        velocity=velocity,
        bend=bend,
        moves=moves,
        rests=found.rests & ~taken,
        unchanged=np.where(moves, np.int16(0), found.unchanged),
    )
