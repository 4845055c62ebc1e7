"""What to think of measured normals: how far each may be off, and which are to be trusted.

Noise and the lights' directions say what a fit can know; residuals, light from around and normals that belong to no
surface (``doubting``) what it cannot.
"""

from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from psvideo.compute.spilled import let_go, lie_in_files
from psvideo.compute.threads import over_ranges
from psvideo.model.arrays import Floats, Mask
from psvideo.model.surface import MEASURED, Surface
from psvideo.solve.normals.bands import BAND_PIXELS
from psvideo.solve.normals.evidence import Evidence
from psvideo.solve.normals.plate_noise import PlateNoise
from psvideo.solve.normals.surface_bits import bits
from psvideo.solve.normals.trust.agreeing import Agreeing, agreeing
from psvideo.solve.normals.trust.doubting import Doubting, doubt_deg
from psvideo.solve.normals.trust.doubts import Doubt, Doubts
from psvideo.solve.normals.trust.moving_doubt import MovingDoubt, at_points, moved_deg, moving_doubt_deg, stirring
from psvideo.solve.normals.trust.near_spread import near_spread
from psvideo.solve.normals.trust.noise_spread import NoiseSpread, Spreading
from psvideo.solve.normals.trust.repeats import Repeat
from psvideo.solve.normals.trust.signs import Signs, signs_of
from psvideo.solve.normals.trust.thin_surface import ThinSurface, every_nth
from psvideo.solve.normals.trust.unchecked import ALL_EXPLAINED, unchecked_deg
from psvideo.solve.normals.trust.usual_errors import UsualErrors, usual
from psvideo.solve.normals.trust.witness import checked


@dataclass(frozen=True, kw_only=True)
class Judging:
    """How errors are predicted and when a normal is trusted.

    most_error_deg: a normal is trusted where its predicted error is at most this: of such normals at most one in forty
        is off by more than 10 degrees, under 5 to 8 lights one in twenty.
    most_moving_error_deg: the same where something was followed: holes cost more there, and of such normals one in
        seventy is off by more than 10 degrees.
    spreading: what noise and residuals say of a normal.
    doubting, moving: what may turn normals beyond that, and where things move.
    """

    most_error_deg: float = 5.0
    most_moving_error_deg: float = 7.0
    spreading: Spreading = field(default_factory=Spreading)
    doubting: Doubting = field(default_factory=Doubting)
    moving: MovingDoubt = field(default_factory=MovingDoubt)


def judged(
    surface: Surface, one: Evidence, noise: PlateNoise, *, how: Judging = Judging(), before: Doubts = Doubts()
) -> tuple[Surface, Doubts]:
    """Return the surface with ``error_deg`` of all that was solved, and ``valid`` where that is small enough; and its
    doubts, with those ``before`` it where nothing changed since then.

    What robust solving predicted is in ``error_deg`` already; of least squares noise and residuals say what is known.
    """
    near = near_spread(one.lit, _thin_shape(surface, one))
    some = every_nth(surface, one.step_of(surface.valid.shape))
    spread = NoiseSpread.of(some, one, noise, how.spreading, near)
    points = spread.points(some)
    latest = None if one.indirect is None else Repeat.of(points, one.indirect)
    doubts, moving = before, None
    if latest is not None:
        doubts, noisier = before.beside(latest)
        points = replace(points, noisier=noisier)
    if doubts.look_again:
        found, moving = _found(points, one, noise, how)
        doubts = doubts.and_of(found, noise)
    doubts = replace(doubts, latest=latest)
    shown = doubts.mean
    errors = spread.judged(points.surface, np.stack([shown.doubt_deg, shown.usual_deg]), 1, limit_deg=0.0)[0]
    misfit = surface.misfit
    likely_deg = None
    if len(one.plates) > ALL_EXPLAINED and points.known.any():
        by_noise_deg = np.hypot(points.noise_deg, shown.lost_deg)
        typical = UsualErrors.of(points, errors, by_noise_deg, near, most_deg=how.most_error_deg)
        likely_deg = typical.likely_deg(one.lit, plain=misfit is None, explained=shown.explained)
        misfit = None if misfit is None else typical.misfit(misfit)
    doubt = shown.doubt_deg if moving is None else moving.beside(shown.doubt_deg)
    turned = None if moving is None or one.arc_deg is None else _at_points(one.arc_deg, points.known.shape)
    for more in (turned, near.doubt_deg if near.doubt_deg.size else None, one.metal_deg):
        doubt = doubt if more is None else np.hypot(doubt, more)
    doubt = np.stack([doubt, shown.usual_deg])
    error, trusted = spread.judged(surface, doubt, points.step, limit_deg=how.most_error_deg, spare=one.spare)
    if one.moved and one.moves is not None and one.moves.any():
        trusted |= _trusted_moving(error, one.moves, how.most_moving_error_deg)
    slope_deg = usual(shown.by_slope_deg, points.brightness * points.known)  # what is bright shows more of the subject
    lit = shown.shadows_lit
    return replace(
        surface,
        valid=trusted,
        error_deg=error,
        misfit=misfit,
        slope_deg=slope_deg,
        likely_deg=likely_deg,
        shadows_lit=lit,
    ), doubts


def _at_points(plane: Floats, shape: tuple[int, ...]) -> Floats:
    """Return what a plane on a grid of its own is at points of this shape."""
    return np.asarray(cv2.resize(plane, shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32)


def _trusted_moving(error: NDArray[np.floating], moves: Mask, limit_deg: float) -> Mask:
    """Return what was solved within the limit and moves, of ``moves`` on a grid of its own, (row, col)."""
    return np.asarray(at_points(moves, error.shape) & (error > 0) & (error <= error.dtype.type(limit_deg)))


@dataclass(frozen=True, kw_only=True)
class _Moving:
    """By how many degrees motion may turn normals, (row, col), and what the lights say of it, None where they cannot
    be held against each other."""

    deg: Floats
    agree: Agreeing | None

    def beside(self, doubt_deg: Floats) -> Floats:
        """Return what this and another doubt come to."""
        both = np.hypot(doubt_deg, self.deg)
        return both if self.agree is None else self.agree.limited(both)


def _found(points: ThinSurface, one: Evidence, noise: PlateNoise, how: Judging) -> tuple[Doubt, _Moving | None]:
    """Return what signs make of the points, and by how much motion may turn them, None where nothing moved."""
    turned_deg = moved_deg(points, one, noise)
    signs = signs_of(points, one, turned_deg)
    if turned_deg is None:
        return Doubt.of(signs, how.doubting), None
    known, check = points.known.astype(np.float32), checked(points, one, noise)
    deg = moving_doubt_deg(
        turned_deg, signs.torn_deg, known, one.moves, steadied=one.steadied, check=check, how=how.moving
    )
    moves = at_points(one.moves, known.shape)
    stirs = stirring(turned_deg, known, moves, steadied=one.steadied, how=how.moving)
    agree = agreeing(points, one, noise, signs, stirs, how.doubting)
    return Doubt.of(signs, how.doubting), _Moving(deg=deg, agree=agree)


def with_unchecked(surface: Surface, one: Evidence, noise: PlateNoise) -> Surface:
    """Return the surface with errors that count what three lights cannot show, filled pixels included; what is trusted
    stays. Its errors' memory is taken over; under more lights they are as they were."""
    from psvideo.solve.normals.trust.judging_kernel import add_rows

    error = surface.error_deg
    if len(one.plates) > ALL_EXPLAINED or error is None:
        return surface
    measured = surface.valid if surface.source is None else surface.source == MEASURED
    plain, how = replace(surface, valid=measured, error_deg=None, residual=None), Judging()
    points, signs = looked_at(plain, one, noise, how=how, by_slope=False)  # it is in the errors, and adds nothing here
    spread_deg = unchecked_deg(points.planes, one.lit.directions, beside_slope=not one.moved)
    unchecked = replace(signs, unchecked_deg=spread_deg, torn_share=np.ones_like(spread_deg))
    shown, whole = (doubt_deg(each, how=how.doubting) for each in (signs, unchecked))
    more = np.sqrt(np.maximum(whole * whole - shown * shown, np.float32(0)))
    rows, cols = error.shape

    def add(first: int, last: int) -> None:
        add_rows(bits(error), more, points.step, first, last)
        if lie_in_files(error):
            let_go(error[first:last])

    over_ranges(add, rows, each=BAND_PIXELS // cols)
    return surface


def _thin_shape(surface: Surface, one: Evidence) -> tuple[int, int]:
    """Return the shape of the points at which a surface is judged."""
    step = one.step_of(surface.valid.shape)
    rows, cols = surface.valid.shape
    return -(-rows // step), -(-cols // step)


def looked_at(
    surface: Surface, one: Evidence, noise: PlateNoise, *, how: Judging = Judging(), by_slope: bool = True
) -> tuple[ThinSurface, Signs]:
    """Return the points at which a surface is judged, and what speaks against their normals: what constants are fitted
    to."""
    near = near_spread(one.lit, _thin_shape(surface, one))
    some = every_nth(surface, one.step_of(surface.valid.shape))
    points = NoiseSpread.of(some, one, noise, how.spreading, near).points(some)
    return points, signs_of(points, one, by_slope=by_slope)


def emptied(surface: Surface) -> Surface:
    """Return the surface with zeros where it is not valid; its memory is taken over."""
    for plane in (surface.normals, surface.albedo, surface.error_deg, surface.residual):
        if plane is not None:
            plane[~surface.valid] = 0
    return replace(surface, source=np.where(surface.valid, MEASURED, np.uint8(0)).astype(np.uint8))
