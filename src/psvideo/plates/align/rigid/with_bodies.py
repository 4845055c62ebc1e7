"""Bodies in what was found to move: their motion is taken where it explains the plates of all lights.

Flow's velocities are those of shading in part, and ways were straight so far. A body's motion is fitted to them, and
then to what one surface explains; what joins thereby shows more of the body, whose motion is fitted again.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Codes8, Flags, Floats
from psvideo.plates.align.by_surface import BySurface, SurfaceLeft
from psvideo.plates.align.rigid.flow_fit import motion_of_flow
from psvideo.plates.align.rigid.moving_parts import MovingPart, parts_of
from psvideo.plates.align.rigid.rigid_motion import NUMBERS, BodyPoints, Pixels
from psvideo.plates.align.rigid.seen_depth import depth_of
from psvideo.plates.align.rigid.surface_fit import AroundInstant, InPicture, motion_of_surface
from psvideo.plates.align.velocity.all_lights import WINDOW_PX, AllLights
from psvideo.plates.align.velocity.brightness import EVERY_CODE, light_of
from psvideo.plates.align.velocity.followed import Followed

TURNS = 3
"""So often bodies are fitted; the first time to flow alone."""
SMOOTH_PX = (4.0, 1.5)
"""Pictures are smoothed by these when a body is fitted, in pixels of velocities, one after the other."""
LITTLE = np.float32(0.02)
"""What was found is left as it is where it leaves less: noise does."""
MOST_POINTS, FEWEST_POINTS = 1500, 100
"""A body is fitted to so many points at most, and to flow alone where fewer than the second tell."""
AS_OWN, BEYOND, HOLDS = np.float32(1.05), np.float32(0.01), 0.8
"""A body's motion leaves as little as the velocity that was found, where it leaves less than the first times as much,
and the second: where it does in more than the third of what was found of the body, it is one."""
CLEARLY = np.float32(0.9)
"""Else its motion is taken where it leaves less than this share: two things that pass each other are no body, and a
hand that bends is one only in part."""
STIRS, UNLIKE = np.float32(0.08), np.float32(0.3)
"""Beside the outline of what was found, only what stirs joins: where rest leaves more than the first, or, where some
light does not reach, plates at rest are more unlike than by the second under each light. Noise leaves less, and a bare
wall would go along with anything."""
AS_UNLIKE = np.float32(1.1)
"""What some light does not reach goes along where plates are at most so many times as unlike."""

Levels = list[list[AroundInstant]]


def with_bodies(surface: BySurface, lights: AllLights, found: Followed, still: Flags) -> Followed:
    """Return what was ``found`` with the motion of rigid bodies, and its bend, where that explains the plates of all
    lights. What is ``still`` (row, col) stays."""
    none = np.zeros_like(found.velocity)
    rest = _Rest(left=surface.left(lights, none), unlike=lights.mean(lights.unlike(none), WINDOW_PX))
    levels = Levels()
    for turn in range(TURNS):
        before = surface.left(lights, found.velocity, found.bend)
        parts = list(parts_of(found))
        if turn == 0 and not any(_leaves_much(before, part.found) for part in parts):
            return found
        if turn and not levels:
            levels = [_pictures(surface, lights, smooth_px) for smooth_px in SMOOTH_PX]
        moved = _moved(surface, lights, found, parts, (before.known, levels))
        taken = _explained(surface, lights, (found, before), moved, parts, rest) & ~still
        found = _joined(found, moved, taken)
    return found


@dataclass(frozen=True, kw_only=True)
class _Rest:
    """What no surface explains at rest, and how ``unlike`` plates are there, (row, col)."""

    left: SurfaceLeft
    unlike: Floats


def _explained(
    surface: BySurface,
    lights: AllLights,
    given: tuple[Followed, SurfaceLeft],
    moved: Followed,
    parts: Sequence[MovingPart],
    rest: _Rest,
) -> Flags:
    """Return where bodies that ``moved`` explain the plates, (row, col); ``given`` are what was found before, and what
    it leaves."""
    found, before = given
    one = surface.left(lights, moved.velocity, moved.bend)
    told = one.known & before.known
    fits = told & _holds(one, before, parts) & (one.wide < rest.left.wide + BEYOND)
    along, own = (lights.mean(lights.unlike(each.velocity), WINDOW_PX) for each in (moved, found))
    fits |= ~told & (along < AS_UNLIKE * np.minimum(rest.unlike, own))
    stirs = np.where(told, rest.left.wide > STIRS, rest.unlike > UNLIKE * lights.count)
    about, within = (np.any([getattr(part, where) for part in parts], axis=0) for where in ("about", "within"))
    return np.asarray(fits & about & (stirs | within))


def _leaves_much(left: SurfaceLeft, there: Flags) -> bool:
    """Return whether what was found ``there`` (row, col) leaves enough that a body's motion may leave less."""
    tells = there & left.known
    return not tells.any() or bool(left.wide[tells].mean() > LITTLE)


def _moved(
    surface: BySurface, lights: AllLights, found: Followed, parts: Sequence[MovingPart], told: tuple[Flags, Levels]
) -> Followed:
    """Return what was ``found`` with every part moved as a body, by what is known of the surface, (row, col), and by
    pictures of all levels."""
    (known, levels), normals = told, surface.normals(lights, found.velocity, found.bend)
    round_s = float(lights.spans_s.sum(axis=1).mean())
    velocity, bend = found.velocity, found.bends
    for part in parts:
        points = BodyPoints.of(depth_of(normals, part.about), part.about)
        unit = np.ones(NUMBERS) / round_s
        unit[2:] /= points.at(part.about).radius_px
        rows, cols = _some(part.found)
        motion = motion_of_flow(points.at((rows, cols)), found.velocity[:, rows, cols], unit)
        tells = _some(part.found & known)
        if len(tells[0]) >= FEWEST_POINTS:
            seen = InPicture.of(points, *tells)
            for pictures in levels:
                motion = motion_of_surface(motion, seen, pictures, surface.odd, unit)
        velocity = np.where(part.about, motion.velocity(points), velocity)
        bend = np.where(part.about, motion.bend(points), bend)
    return replace(found, velocity=velocity, bend=bend)


def _holds(one: SurfaceLeft, before: SurfaceLeft, parts: Sequence[MovingPart]) -> Flags:
    """Return where bodies' motion leaves as little as what was found, or clearly less, (row, col)."""
    as_own = one.wide < AS_OWN * before.wide + BEYOND
    holds = one.wide < CLEARLY * before.wide
    for part in parts:
        tells = part.found & one.known & before.known
        if np.count_nonzero(as_own & tells) > HOLDS * np.count_nonzero(tells):
            holds |= as_own & part.about
    return holds


def _some(there: Flags) -> Pixels:
    """Return some of the pixels that are ``there``, evenly spread, by row and column."""
    rows, cols = np.nonzero(there)
    every = max(-(-len(rows) // MOST_POINTS), 1)
    return rows[::every], cols[::every]


def _joined(found: Followed, moved: Followed, taken: Flags) -> Followed:
    """Return what was ``found``, and as it ``moved`` what was ``taken``."""
    moves = found.moves | taken
    return replace(
        found,
        velocity=np.where(taken, moved.velocity, found.velocity),
        bend=np.where(taken, moved.bends, found.bends),
        moves=moves,
        rests=found.rests & ~taken,
        unchanged=np.where(moves, np.int16(0), found.unchanged),
    )


def _pictures(surface: BySurface, lights: AllLights, smooth_px: float) -> list[AroundInstant]:
    """Return what every light's plates show, smoothed, of as many pixels as there are velocities."""
    table = light_of(EVERY_CODE)

    def picture(codes: Codes8) -> Floats:
        small = cv2.resize(codes, lights.shape[::-1], interpolation=cv2.INTER_AREA)
        return AroundInstant.picture(np.asarray(cv2.LUT(small, table), np.float32), smooth_px)

    def around(light: int, _: int) -> AroundInstant:
        plates = surface.plates(lights, light)
        return AroundInstant(
            pictures=tuple(picture(plate.codes) for plate in plates),
            spans_s=tuple(plate.span_s for plate in plates),
            counts=tuple(plate.counts for plate in plates),
        )

    return over_ranges(around, len(surface.places), each=1)
