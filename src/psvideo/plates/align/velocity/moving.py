"""How everything moves at an instant, found from all lights together: one velocity for every pixel.

What moves is the same under every light. Flow between the plates of single lights (before and after the instant)
proposes velocities, and so do flow from one light's edges to those of the next, and what the picture's change as a
whole correlates with, where flow does not reach; standing still is always proposed. Taken is what makes the plates of
all lights alike, in small windows, and rest where nothing explains much more than rest does: flow that fits shadows and
shading of one light says nothing of the others.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from psvideo.model.arrays import Flags, Floats
from psvideo.plates.align.velocity.all_lights import FINE_PX, WINDOW_PX, AllLights
from psvideo.plates.align.velocity.between_lights import BetweenLights
from psvideo.plates.align.velocity.followed import Followed, Pair, mean_over, odd_width
from psvideo.plates.align.velocity.plane_fits import fitted_by_planes

EXPLAINED, MARGIN, GAIN = 0.65, 0.05, 0.25
"""A velocity is accepted where what it leaves unexplained is below the first (a share of what rest leaves) less the
second, or below what rest leaves by the third; the second and third count once for every light."""
FINE_EXPLAINED = 0.7
"""Over the smaller window it must leave less than this share, too: otherwise outlines carry along what is beside
them."""
GROWN, GROWN_PX = 2, 27
"""This often, pixels beside moving parts join them where both motion and rest explain them, within this window."""
UNEXPLAINED, MOST = 0.3, 0.1
"""Where plates differ by more than the first per light, neither motion nor rest explains them: a pixel then joins only
if the moving share of its window exceeds the resting share by the second."""
PUZZLING, PUZZLED = 0.5, 0.004
"""Where more of the picture than the second differs by more than the first per light, things move faster than flow can
follow."""
UNCHECKED = 3
"""So many lights explain whatever their plates show: nothing tells later that these were brought together falsely."""
FARTHER_PX, FARTHER, AGREEING, BETTER = 27, 0.65, 0.9, 0.3
"""Of so few, displacements farther than flow reaches are taken where, over the first, they leave less than the second
of what flow leaves; the third is enough where lights disagree by the fourth less. Waves and folds fit the next of their
kind nearly as well as themselves, and a fence's posts do so from round to round alone."""
REFUTED_PX, AGREED, WORSE = 27, 0.35, 0.1
"""Where lights disagree by less than the second at rest, over the first, and by the third more along a motion, it is
not the true one: what repeats itself fits the next of its kind from round to round, but not from flash to flash. A
window holds some 80 details 3 px wide: a correlation of 0.65 between two lights is known to 0.065, the mean of two
pairs to 0.045, the difference of two such means to 0.065, so that chance makes it 0.1 more in one of fifteen."""
LEAST = np.float32(1e-6)


Choosing = Callable[[AllLights, Sequence[Floats], Followed, Flags], Followed]
"""What chooses again, by all lights, between velocities that flow proposes and what was found; what is still stays."""


def followed_at(
    pairs: Sequence[Pair],
    time_s: float,
    *,
    others: int = 0,
    choose: Choosing | None = None,
    rows_s: Floats | None = None,
) -> Followed:
    """Return how everything moves at an instant, which may lie before or after some lights' plates too. ``others`` is
    the number of lights under which nothing moves; ``choose`` has the last word. ``rows_s`` (light, 2, row) are the
    times since and until the rows of the sketches, where these show several instants."""
    lights = AllLights.of(pairs, time_s, rows_s)
    if rows_s is None:
        between = BetweenLights.of(lights.codes, lights.spans_s, lights.shape)
    else:
        between = BetweenLights.of_rows(lights.codes, rows_s, lights.each_row_s, lights.shape)
    none = np.zeros((2, *lights.shape), np.float32)
    wide_rest, fine_rest = lights.unlike_over_windows(none)
    proposals = lights.proposed() + between.proposed()
    chosen = _best(lights, between, proposals, wide_rest)
    velocity, best, fine = chosen.velocity, chosen.wide, lights.mean(chosen.unlike, FINE_PX)
    unchanged = np.asarray(lights.unchanged() + others, np.int16)
    stirs = ~lights.at_rest(unchanged, others)
    moves = _clearly(best, wide_rest, lights.count) & (fine < np.float32(FINE_EXPLAINED) * fine_rest) & stirs
    rested = between.disagree(none, REFUTED_PX)
    refuted = _refuted(rested, between.disagree(velocity, REFUTED_PX))
    moves &= ~refuted
    rests = np.zeros_like(moves)
    for _ in range(GROWN):
        moves, rests = _grown(lights, moves, velocity, (wide_rest, fine_rest), stirs)
    refuted |= _refuted(rested, between.disagree(velocity, REFUTED_PX))
    moves &= ~refuted
    velocity *= moves
    found = Followed(
        time_s=time_s,
        velocity=velocity,
        moves=moves,
        rests=rests & ~moves,
        unchanged=np.where(moves, np.int16(0), unchanged),
        step=lights.step,
    )
    told = found if choose is None else choose(lights, proposals, found, ~stirs)
    sure = np.any(told.velocity != found.velocity, axis=0)
    return fitted_by_planes(lights, told, sure=sure, apart=~stirs | refuted, rest=(wide_rest, fine_rest))


@dataclass(frozen=True, kw_only=True)
class _Chosen:
    """The ``velocity`` (2, row, col) of every pixel, how ``unlike`` plates are along it, and so over a ``wide`` window,
    both (row, col)."""

    velocity: Floats
    unlike: Floats
    wide: Floats

    def take(self, other: "_Chosen", where: Flags) -> None:
        """Take another choice in some pixels."""
        np.copyto(self.velocity, other.velocity, where=where)
        np.copyto(self.unlike, other.unlike, where=where)
        np.copyto(self.wide, other.wide, where=where)


def _best(lights: AllLights, between: BetweenLights, proposals: Sequence[Floats], wide_rest: Floats) -> _Chosen:
    """Return, of all proposed velocities, the one for every pixel along which plates are the most alike. Far ones are
    proposed where much of the picture is puzzling; under few lights they must explain clearly more."""
    near = _most_alike(lights, proposals)
    puzzling = np.minimum(near.wide, wide_rest) > PUZZLING * lights.count
    if np.mean(puzzling & lights.stays(near.velocity)) > PUZZLED:
        far = _most_alike(lights, lights.proposed_far())
        better = far.wide < near.wide
        if lights.count <= UNCHECKED:
            gained = between.disagree(near.velocity, FARTHER_PX) - between.disagree(far.velocity, FARTHER_PX)
            share = np.where(gained > np.float32(BETTER), np.float32(AGREEING), np.float32(FARTHER))
            better = lights.mean(far.wide, FARTHER_PX) < share * lights.mean(near.wide, FARTHER_PX)
        near.take(far, better)
    return near


def _most_alike(lights: AllLights, proposals: Sequence[Floats]) -> _Chosen:
    unlike, wide = np.full((2, *lights.shape), np.inf, np.float32)
    chosen = _Chosen(velocity=np.zeros((2, *lights.shape), np.float32), unlike=unlike, wide=wide)
    for velocity in proposals:
        unlike = lights.unlike(velocity)
        one = _Chosen(velocity=velocity, unlike=unlike, wide=lights.mean(unlike, WINDOW_PX))
        chosen.take(one, one.wide < chosen.wide)
    return chosen


def _refuted(rested: Floats, moved: Floats) -> Flags:
    """Return where lights agree at rest, and not along a motion."""
    return np.asarray((rested < np.float32(AGREED)) & (moved > rested + np.float32(WORSE)))


def _clearly(unlike: Floats, other: Floats, count: int) -> Flags:
    """Return where one motion explains clearly more than another."""
    return np.asarray(unlike < np.maximum(EXPLAINED * other - MARGIN * count, other - GAIN * count))


def _grown(
    lights: AllLights, moves: Flags, velocity: Floats, rest: tuple[Floats, Floats], stirs: Flags
) -> tuple[Flags, Flags]:
    """Return ``moves`` with those beside it that move along as well as they rest, and what beside it clearly rests; put
    the ``velocity`` of the former in: what is bare shows no motion of its own, and follows the most of what is around.

    What neither explains may be hidden by what moves: it joins where there is more of that before and behind it.
    """
    size = odd_width(GROWN_PX, lights.step)
    around = mean_over(moves.astype(np.float32), size)
    near = np.empty_like(velocity)
    for plane, own in zip(near, velocity, strict=True):
        plane[:] = mean_over(own * moves, size) / np.maximum(around, LEAST)
    wide, fine = lights.unlike_over_windows(near)
    rests = _clearly(rest[0], wide, lights.count)
    most = around - mean_over(rests.astype(np.float32), size)
    joins = (most > 0) & (fine < rest[1] + np.float32(MARGIN * lights.count)) & stirs & ~moves & ~rests
    joins &= (wide <= np.float32(UNEXPLAINED * lights.count)) | (lights.least_at_ends(most, near) > MOST)
    np.copyto(velocity, near, where=joins)
    return moves | joins, rests
