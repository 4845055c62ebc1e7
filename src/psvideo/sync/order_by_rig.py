"""Which light is which, from the rig's known directions: for plans whose cycle has no marker, or one that a dead light
looks like.

Turning the names by one flash changes nothing in when light comes, but it does in where it comes from. Under the right
names a matte surface explains every pixel; under others it would only if the rig were wrong by so and so many degrees.
That error is what turns are judged by: it is small for the right one, and must be far larger than a measured rig's own
for all others. It is not where the rig looks the same after the turn (a regular ring of distant lights), and with three
lights every picture fits. Then nothing is claimed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles, Image
from psvideo.model.irradiance.light_field import Points, light_vectors
from psvideo.model.marker import NOT_FIRING, turned_slot, turns_in_the_dark
from psvideo.model.plan import Plan
from psvideo.model.rig import Light, Rig
from psvideo.model.rows.clipping import SATURATED, SMALL_PLATE_MARGIN
from psvideo.model.timing import Timing

MEASURED_ERROR_DEG, DISTANT_ERROR_DEG, NEAR_ERROR_DEG = 1.5, 3.0, 5.0
"""What lights are taken to be wrong by at least, directions and strengths (1 degree for 1.7 %) together: where the rig
gives an error, where it does not, and near lights, whose surface is a guess."""
CLEARLY = 3.5
"""By how many standard deviations of itself every other turn's error must be above the best turn's and a rig's own."""
MOST_LEFT = 0.1
"""The share of a pixel's light that may stay unexplained, as its median: gloss, interreflection, movement."""
LIT, CLEAR_OF_CLIPPING = 0.05, SATURATED - SMALL_PLATE_MARGIN
"""Pixels count that every flash lights at least this share of the brightest one, and none brings near saturation."""
LEAST_PIXELS, MOST_PIXELS = 50, 1500
KEPT = 0.8
"""The share of pixels, those that fit best, by which a turn is judged: the others may lie in shadow or be glossy."""
AWAY_DEG = 90.0
"""The error of a turn under which the surface would face away from the camera."""
LEAST_FIRING = 4
UNCLEAR = "the plan's cycle has a marker, and the picture does not show it clearly enough"
FAINT = 0.004
"""How little normals may vary (as their squared length in one direction) until they say nothing of the lights."""


@dataclass(frozen=True, kw_only=True)
class RigTurn:
    """By how many places in the cycle names are to be turned, None where the rig does not say, and a sentence why."""

    turn: int | None
    why: str


@dataclass(frozen=True, kw_only=True)
class _Samples:
    """Pixels under every lit slot, one channel of one pixel each: ``light`` (sample, lit slot), and where they lie."""

    light: Doubles
    points: Points


@dataclass(frozen=True, kw_only=True)
class _Fit:
    """One turn: the lights' error that it would take (RMS, directions and strengths), of how many free numbers that is
    the mean, and the share of light that it leaves unexplained even so (median over pixels)."""

    turn: int
    rig_error_deg: float
    freedom: float
    left: float


def named_by_turn(plan: Plan, timing: Timing, turn: int) -> Timing:
    """Return the timing with every flash named as the one ``turn`` places further on in the cycle."""
    slots = {slot: turned_slot(plan, slot, turn) for slot in plan.cycle_slots}
    flashes = tuple(
        replace(flash, slot=slots[flash.slot], lights=plan.flashes[slots[flash.slot]].lights, plate=None)
        for flash in timing.flashes
    )
    return replace(timing, flashes=flashes)


def why_undecided(plan: Plan, rig: Rig) -> str | None:
    """Return why no picture could give the order by this rig, None where one may.

    Raises PsvideoError where the rig lacks a light of the plan.
    """
    lights = rig.select(plan.lights)
    if len(plan.cycle_slots) != len(plan.flashes):
        return UNCLEAR
    if len(plan.lit_slots) < LEAST_FIRING:
        return (
            f"any picture fits any order of {len(plan.lit_slots)} flashes; a fourth light, or a dark slot, would decide"
        )
    near = [light for light in lights if light.direction is None]
    if near and (rig.focal_px is None or rig.principal_px is None or rig.plane is None):
        return f"the light {near[0].name!r} is near, and the rig file gives no [camera] and [surface] for it"
    return None


def order_by_rig(plan: Plan, rig: Rig, pictures: Mapping[int, Image]) -> RigTurn:
    """Return the turn of the cycle that the rig's directions give, or why they give none.

    ``pictures`` holds a small linear picture of the whole frame, (row, col) or (row, col, channel), ambient light taken
    off, for every lit slot as it is named so far; 0 where nothing was seen. Raises PsvideoError where the rig lacks a
    light of the plan.
    """
    refusal = why_undecided(plan, rig)
    if refusal is not None:
        return RigTurn(turn=None, why=refusal)
    dead = dead_slots(pictures)
    turns, firing = turns_in_the_dark(plan, dead), [slot for slot in plan.lit_slots if slot not in dead]
    if len(turns) == 1:
        return RigTurn(turn=None, why=UNCLEAR)
    if len(firing) < LEAST_FIRING:
        return RigTurn(turn=None, why=f"only {len(firing)} lights fire, and any picture fits any order of these")
    samples = _samples([pictures[slot] for slot in firing])
    if len(samples.light) < LEAST_PIXELS:
        return RigTurn(
            turn=None,
            why=f"only {len(samples.light)} points of the small picture are lit by every flash and not saturated "
            f"(at least {LEAST_PIXELS} are needed)",
        )
    vectors = light_vectors(plan, rig, samples.points)
    fits = [_fit(turn, vectors[:, _named_after(plan, firing, turn)], samples.light) for turn in turns]
    return _verdict(sorted(fits, key=lambda fit: fit.rig_error_deg), _own_error_deg(rig.select(plan.lights)))


def _verdict(fits: list[_Fit], own_deg: float) -> RigTurn:
    """Believe the best turn where it fits as well as a measured rig should, and every other needs a far worse rig."""
    best, second = fits[:2]
    if best.left > MOST_LEFT or best.rig_error_deg > 2 * own_deg:
        return RigTurn(
            turn=None,
            why="under no order of the lights does the picture look like that of a matte surface lit by this rig (too "
            "much gloss, shadow, movement or ambient light, or a rig file that does not fit)",
        )
    compared = f"the rig's lights would be off by {best.rig_error_deg:.1f} degrees in the best order"
    doubt_deg = max(best.rig_error_deg, own_deg)
    if any(fit.rig_error_deg < doubt_deg * (1 + CLEARLY / np.sqrt(fit.freedom)) for fit in fits[1:]):
        return RigTurn(
            turn=None,
            why=f"{compared} and by {second.rig_error_deg:.1f} in the next best, which is no clear difference for a "
            f"rig that may be off by {doubt_deg:.0f} by itself: it looks nearly the same when it is turned",
        )
    return RigTurn(turn=best.turn, why=f"{compared}, and by {second.rig_error_deg:.0f} in the next best")


def _own_error_deg(lights: tuple[Light, ...]) -> float:
    """Return by how much the rig may well be wrong: as calibration said, but never less than lights' strengths are."""
    errors_deg = [
        max(MEASURED_ERROR_DEG, light.error_deg)
        if light.error_deg is not None
        else NEAR_ERROR_DEG
        if light.direction is None
        else DISTANT_ERROR_DEG
        for light in lights
    ]
    return max(errors_deg)


def dead_slots(pictures: Mapping[int, Image]) -> frozenset[int]:
    """Return the lit slots whose light did not fire: their pictures hold hardly any of the brightest one's light."""
    levels = {slot: float(picture.mean()) for slot, picture in pictures.items()}
    most = max(levels.values(), default=0.0)
    return frozenset(slot for slot, level in levels.items() if level < NOT_FIRING * most)


def _named_after(plan: Plan, slots: Sequence[int], turn: int) -> list[int]:
    """Return for every one of some lit slots which lit slot's light it shows after a turn."""
    return [plan.lit_slots.index(turned_slot(plan, slot, turn)) for slot in slots]


def _samples(pictures: list[Image]) -> _Samples:
    """Pick the pixels that every flash lights, at most MOST_PIXELS, evenly over the picture."""
    stack = np.stack([picture.reshape(*picture.shape[:2], -1) for picture in pictures]).astype(np.float64)
    least, most = stack.min(axis=0), stack.max(axis=0)
    shown = (least > LIT * most) & (most.max(axis=2, keepdims=True) < CLEAR_OF_CLIPPING) & (most > 0)
    if shown.any():
        shown &= most > 0.1 * np.percentile(most[shown], 99)
    row, col, channel = np.nonzero(shown)
    picked = np.linspace(0, len(row) - 1, min(len(row), MOST_PIXELS)).astype(np.intp)
    row, col, channel = row[picked], col[picked], channel[picked]
    rows, cols, channels = stack.shape[1:]
    points = Points(down=(row + 0.5) / rows, across=(col + 0.5) / cols, channel=channel, channels=channels)
    return _Samples(light=stack[:, row, col, channel].T, points=points)


def _fit(turn: int, vectors: Doubles, light: Doubles) -> _Fit:
    """Find the smallest change of the lights, common to all samples, that explains the picture under a turn.

    ``vectors`` (sample, slot, 3) are the lights, ``light`` (sample, slot) what was seen.
    """
    strength = np.linalg.norm(vectors, axis=2)
    directions, seen = vectors / strength[..., None], light / strength
    seen = seen / np.linalg.norm(seen, axis=1, keepdims=True)
    normals = np.einsum("nik,nk->ni", np.linalg.pinv(directions), seen)
    rest = seen - np.einsum("nki,ni->nk", directions, normals)
    kept = np.ones(len(seen), np.bool_)
    for _ in range(3):
        chosen = normals[kept]
        spread = chosen.T @ chosen / len(chosen)
        solvable = np.linalg.inv(spread + FAINT * np.eye(3))
        change = rest[kept].T @ chosen / len(chosen) @ solvable
        left = np.linalg.norm(rest - normals @ change.T, axis=1)
        kept = left <= np.quantile(left, KEPT)
    freedom = (vectors.shape[1] - 3) * float(np.trace(spread @ solvable))
    error_deg = float(np.degrees(np.linalg.norm(change) / np.sqrt(freedom)))
    away = bool(np.median(normals[:, 2]) <= 0)
    return _Fit(turn=turn, rig_error_deg=AWAY_DEG if away else error_deg, freedom=freedom, left=float(np.median(left)))
