"""Which flash of the cycle is which: every turn of the cycle is held against the picture.

Turns that put flashes of the same length and dark slots on dark slots do not differ in when light comes; where
several flashes hold the same lights at known powers, their brightnesses decide. All other turns are fitted, and one is
believed only where it beats each of them clearly, frame by frame (Vuong 1989).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from psvideo.model.arrays import Doubles
from psvideo.model.marker import alike_turns, turned_slot
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat, train_between
from psvideo.sync.rowfit.compiled_profiles import brightnesses, unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.refine import CAUCHY, refined_beat, row_noise

TURN_ROWS = 48
TURN_FRAMES = 400
SURE = 5.0
"""Standard errors by which the best turn must win over the frames."""
PLAIN = 6.0
"""Or the sum over frames of mean losses by which it must win where hardly any frame speaks against it."""
MOST_AGAINST = 0.1
MIXED_WELL, MIXED_BADLY = 0.1, 4.0
"""Powers decide the turn where one leaves less than this of the brightnesses, and all others that many times more."""
TAKES_AWAY = 0.1
"""A light that seems to take this much light away, as a share of what the strongest gives, bears a wrong name."""


@dataclass(frozen=True, kw_only=True)
class Turns:
    """Beats that fit equally well as far as the picture shows, the likeliest first; ``sure`` where names cannot err.
    ``apart_s`` is by how much their flashes come at other times, as a root mean square over the clip: lengths differ.
    """

    beats: tuple[Beat, ...]
    sure: bool
    apart_s: float


def turns(plan: Plan, rows: Profiles, beat: Beat) -> Turns:
    """Return the turns of the cycle among which the picture does not decide."""
    same = alike_turns(plan)
    part = _part(plan, rows)
    best = _fitted(plan, part, beat, period=same[1] if len(same) > 1 else len(plan.cycle_slots))
    alike = [turned(plan, one, turn) for one in best for turn in _decided_by_power(plan, rows, one, same)]
    alike = [one for one in alike if not _takes_away(plan, part, one)] or alike
    names = {
        tuple(tuple(sorted(plan.flashes[s].lights.items())) for s in _seen_slots(plan, one, beat)) for one in alike
    }
    apart_s = max((_apart_s(plan, rows, alike[0], one) for one in alike[1:]), default=0.0)
    return Turns(beats=tuple(alike), sure=len(names) == 1, apart_s=apart_s)


def _apart_s(plan: Plan, rows: Profiles, one: Beat, other: Beat) -> float:
    """Return how far one beat's flashes begin from the nearest ones of another, as a root mean square."""
    first_s, last_s = rows.ends_s[[0, -1]].tolist()
    own_s, others_s = (train_between(plan, beat.clock, first_s, last_s).start_s for beat in (one, other))
    own_s = own_s[(own_s >= first_s) & (own_s <= last_s)]
    if not len(own_s):
        return 0.0
    behind = np.clip(np.searchsorted(others_s, own_s), 1, len(others_s) - 1)
    gap_s = np.minimum(np.abs(others_s[behind] - own_s), np.abs(own_s - others_s[behind - 1]))
    return float(np.sqrt((gap_s**2).mean()))


def _part(plan: Plan, rows: Profiles) -> Profiles:
    """Return enough of the clip to separate turns, dark slots that are rare included."""
    needed = max(TURN_FRAMES, int(2.5 * plan.marker_s / rows.period_s))
    return rows.take(slice(0, min(needed, len(rows.value)))).binned(TURN_ROWS)


def turned(plan: Plan, beat: Beat, turn: int) -> Beat:
    """Return the beat whose flash ``turn`` of a cycle fires when the given beat's first one does."""
    start_s = float(plan.train(turn, 1).start_s[0])
    clock = beat.clock
    return replace(beat, clock=replace(clock, phase_s=clock.phase_s - start_s * clock.rate))


def _seen_slots(plan: Plan, beat: Beat, reference: Beat) -> tuple[int, ...]:
    """Return which slots a beat gives to the flashes of one cycle, counted from the reference's first flash."""
    train = plan.train(0, len(plan.cycle_slots))
    cycle_s = plan.cycle_s * beat.clock.rate
    behind_s = (reference.clock.phase_s - beat.clock.phase_s) % cycle_s
    gap_s = np.abs((train.start_s * beat.clock.rate - behind_s + cycle_s / 2) % cycle_s - cycle_s / 2)
    first = int(np.argmin(gap_s))
    return tuple(int(slot) for slot in np.roll(train.slot, -first))


def _fitted(plan: Plan, rows: Profiles, beat: Beat, *, period: int) -> list[Beat]:
    """Fit every turn that timing can distinguish; return those that the best does not clearly beat, best first."""
    tried = [beat] + [_aligned(plan, rows, turned(plan, beat, turn)) for turn in range(1, period)]
    rests = [unexplained(plan, rows, one) for one in tried]
    noise = np.maximum(row_noise(rests[0]), 0.01 * rows.spread)
    spread = rows.spread
    lit = spread > 0.05 * spread.max()
    losses = np.array([np.log1p((rest[:, lit] / (CAUCHY * noise[lit])) ** 2).mean(axis=1) for rest in rests])
    best = int(losses.sum(axis=1).argmin())
    alike = [turn for turn in range(period) if turn != best and not _beaten(losses[turn] - losses[best])]
    return [tried[best]] + [tried[turn] for turn in alike]


def _aligned(plan: Plan, rows: Profiles, beat: Beat) -> Beat:
    """Let a turned clock fall into place: where flashes differ in length, they do not lie quite on one another."""
    if len({flash.duration_s for flash in plan.flashes}) == 1:
        return beat
    return refined_beat(plan, rows, beat, steps=4)


def _beaten(gain: Doubles) -> bool:
    """Return whether a rival's losses exceed the best's (frame,) clearly."""
    total = float(gain.sum())
    error = float(np.sqrt((gain**2).sum())) + 1e-12
    against = float(-np.minimum(gain, 0.0).sum())
    plainly = total > PLAIN and against < MOST_AGAINST * total
    return plainly or (total / error > SURE and total / len(gain) > 0.02)


def _takes_away(plan: Plan, rows: Profiles, beat: Beat) -> bool:
    """Return whether a light seems to take light away under a beat's names, as none does.

    Where every frame sees one flash, and sees it whole, one light is as good as another for the light of the room: what
    is left for the true dark slot is then less than none.
    """
    level = brightnesses(plan, rows.one_window(), beat)[:, 1 : len(plan.lit_slots) + 1].mean(axis=0)
    return bool(level.min() < -TAKES_AWAY * level.max())


def _decided_by_power(plan: Plan, rows: Profiles, beat: Beat, same: Sequence[int]) -> Sequence[int]:
    """Return the turns that the slots' brightnesses allow: flashes of one light at known powers are proportional."""
    lit = plan.lit_slots
    duration_s = np.array([plan.flashes[slot].duration_s for slot in lit])
    mixing = plan.power * duration_s[:, None]
    if len(same) < 2 or np.linalg.matrix_rank(mixing) == len(lit):
        return same
    light = brightnesses(plan, rows.one_window(), beat)[:, 1 : len(lit) + 1]
    leaving = np.eye(len(lit)) - mixing @ np.linalg.pinv(mixing)
    left = []
    for turn in same:
        slots = [turned_slot(plan, slot, -turn) for slot in lit]
        seen = light[:, [lit.index(slot) for slot in slots]]
        left.append(float(((seen @ leaving) ** 2).sum() / (seen**2).sum()))
    order = np.argsort(left)
    if left[order[0]] < MIXED_WELL**2 and left[order[1]] > MIXED_BADLY**2 * left[order[0]]:
        return [same[order[0]]]
    return same
