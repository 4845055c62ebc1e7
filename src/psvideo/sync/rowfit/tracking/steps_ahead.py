"""How many frames are missing or repeated just ahead: the cheapest course of the next block through places in time.

Brightnesses found so far predict each frame at every place that it may have; a Viterbi search picks the course, in
which a step between frames other than the one that the numbering gives costs something.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.compiled_profiles import brightnesses, predictions, unexplained
from psvideo.sync.rowfit.profiles import Profiles
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, frame_losses, losses_of
from psvideo.sync.rowfit.tracking.misfires import losses_but_for_misfires
from psvideo.sync.rowfit.tracking.missing_instead import rather_missing

BLOCK = 16
"""Frames that are looked for at a time."""
LEAST, MOST = -6, 24
"""Frames that may be repeated (less than none) or missing at one place without a hole in the numbering."""
JUMP_COST = 2.0
"""What an unexpected step costs, in mean losses of a frame (a frame at a wrong time costs 1 to 3)."""
TWIN_COST = 0.2
"""What it costs to take a frame that looks exactly like the one before it for the same moment."""
DUE = 0.2
"""Where it is lit, and this share of another flash was due, it is that moment again: that it looks like it by chance
costs as much as an unexpected step."""
MOST_GAIN = 4.0
"""A camera changes its exposure by no more stops than two at once."""
HOLDS = 1.0
"""A step is believed where it takes away this share of the frames' losses once brightnesses are fitted again."""


class Twins(NamedTuple):
    """Frames that look exactly like the one before them, ``alike`` (frame,), and those of them that are ``lit``."""

    alike: Mask
    lit: Mask

    def of(self, block: slice, sign: int) -> "Twins":
        """Return those of some frames, of which each looks like the one that was followed before it."""
        if sign > 0:
            return Twins(self.alike[block], self.lit[block])
        return Twins(*(np.append(one[block][1:], one[block.stop]) for one in self))

    def but(self, others: Mask) -> "Twins":
        """Return those that are not among ``others`` (frame,)."""
        return Twins(self.alike & ~others, self.lit & ~others)

    def turned(self, sign: int) -> "Twins":
        """Return the same in the order in which frames are followed."""
        return Twins(self.alike[::sign], self.lit[::sign])


def steps_ahead(
    plan: Plan, rows: Profiles, beat: Beat, known: slice, block: slice, twins: Twins, sign: int
) -> Integers:
    """Return by how many frames more than the numbering says the frames of the next block are away, shape (frame,).

    Where all is as usual, this is for the whole block; where not, for its nearer half, so that the other half is looked
    at again with more known.
    """
    learnt = rows.take(known)
    nearness = np.linspace(0.1, 1.0, len(learnt.value))[:: 1 if sign > 0 else -1, None]
    light = brightnesses(plan, learnt, beat, np.ascontiguousarray(np.broadcast_to(nearness, learnt.value.shape)))
    usual = float(np.median(losses_of(plan, learnt, learnt, beat, light)))
    ahead = rows.take(block)
    loss = losses_of(plan, learnt, ahead, beat, light)
    same = twins.of(block, sign)
    if not same.alike.any() and (
        _calm(loss, usual) or _calm(_losses_but_for_gain(plan, learnt, ahead, beat, light), usual)
    ):
        return np.zeros(len(loss), np.int64)
    extras = np.arange(LEAST, MOST + 1)
    shifted = [replace(ahead, index=ahead.index + sign * int(extra)) for extra in extras]
    table = np.stack([losses_of(plan, learnt, one, beat, light) for one in shifted], axis=1)
    beyond = block.start > 0, block.stop < len(rows.value)
    table[:, -LEAST] = losses_but_for_misfires(plan, learnt, ahead, beat, light, beyond=beyond)
    if same.lit.any():
        same = same.but(same.lit & _as_planned(rows, block, ahead.value - predictions(plan, ahead, beat, light), sign))
        same = same._replace(lit=same.lit & due(plan, ahead, beat, sign))
    course = _cheapest(table[::sign], same.turned(sign), sign)[::sign]
    course = rather_missing(
        course,
        table,
        LEAST,
        lambda one: _left(plan, rows, beat, _span(rows, known, block, sign), block, one, sign),
        sign,
    )
    again = _repeats_alone(course[::sign], same.turned(sign), sign)
    if course.any() and not again and not _holds(plan, rows, beat, known, block, course, sign):
        course = np.zeros(len(loss), np.int64)
    nearer = max(len(loss) // 2, min(len(loss), 4))
    return course[:nearer] if sign > 0 else course[-nearer:]


def due(plan: Plan, rows: Profiles, beat: Beat, sign: int) -> Mask:
    """Return which frames (frame,) were to show other flashes than the one followed before, by the plan and their
    places in time: brightnesses say little of it where the subject moves."""
    before = replace(rows, index=rows.index - sign)
    change = np.zeros(rows.value.shape)
    for light in np.eye(1 + len(plan.lit_slots))[1:]:
        own = np.tile(np.append(light, np.zeros(2 * len(beat.beat_hz))), (rows.value.shape[1], 1))
        change += np.abs(predictions(plan, rows, beat, own) - predictions(plan, before, beat, own))
    found: Mask = change.mean(axis=1) > DUE
    return found


def _as_planned(rows: Profiles, block: slice, rest: Doubles, sign: int) -> Mask:
    """Return which frames of a block (frame,) are nearer to what the plan's flashes predict, all but ``rest`` (frame,
    row), than to the frame followed before them: lights are nearly alike there, and no moment is shown again."""
    at = np.arange(block.start, block.stop)
    before = rows.value[np.clip(at - sign, 0, len(rows.value) - 1)]
    nearer: Mask = (rest**2).sum(axis=1) < ((rows.value[at] - before) ** 2).sum(axis=1)
    return nearer


def _calm(loss: Doubles, usual: float) -> bool:
    odd = np.convolve(loss, [0.5, 0.5], mode="same") if len(loss) > 1 else loss
    return bool(odd.max() < usual + SUSPICIOUS)


def _losses_but_for_gain(plan: Plan, learnt: Profiles, ahead: Profiles, beat: Beat, light: Doubles) -> Doubles:
    """Return how badly known brightnesses predict frames (frame,) that may all be brighter or darker by a gain of
    their own, as where a camera sets its exposure: missing frames would stand for it otherwise."""
    expected = predictions(plan, ahead, beat, light)
    weight = 1.0 / np.maximum(learnt.spread, 0.03 * learnt.spread.max()) ** 2
    gain = (weight * ahead.value * expected).sum(axis=1) / np.maximum((weight * expected**2).sum(axis=1), 1e-30)
    rest = ahead.value - np.clip(gain, 1 / MOST_GAIN, MOST_GAIN)[:, None] * expected
    return frame_losses(learnt, rest)


def with_steps(index: Integers, block: slice, extra: Integers, sign: int) -> Integers:
    """Return frames' places in time with those of a block ``extra`` (frame of the block,) farther away, and all frames
    beyond it as far as its last."""
    moved = index.copy()
    moved[block] += sign * extra
    if sign > 0:
        moved[block.stop :] += extra[-1]
    else:
        moved[: block.start] -= extra[0]
    return moved


def _holds(plan: Plan, rows: Profiles, beat: Beat, known: slice, block: slice, course: Integers, sign: int) -> bool:
    """Return whether a course still wins when brightnesses are fitted again to all frames from the known ones on.

    Frames that move are predicted badly; fitted along a wrong course they stay bad, along the right one they do not.
    """
    span = _span(rows, known, block, sign)
    stayed = _left(plan, rows, beat, span, block, np.zeros_like(course), sign)
    return stayed - _left(plan, rows, beat, span, block, course, sign) > HOLDS


def _span(rows: Profiles, known: slice, block: slice, sign: int) -> slice:
    """Return the known frames, those of a block and as many beyond it."""
    if sign > 0:
        return slice(known.start, min(block.stop + BLOCK, len(rows.value)))
    return slice(max(block.start - BLOCK, 0), known.stop)


def _left(plan: Plan, rows: Profiles, beat: Beat, span: slice, block: slice, course: Integers, sign: int) -> float:
    """Return how badly frames fit along a course when brightnesses are fitted again to all of them."""
    went = replace(rows, index=with_steps(rows.index, block, course, sign)).take(span)
    return float(frame_losses(went, unexplained(plan, went, beat)).sum())


def _cheapest(table: Doubles, twins: Twins, sign: int) -> Integers:
    """Return the course of least cost through a table (frame, extra); no frame comes before the one before it.

    A frame that stands in for another shows what came before. Followed towards the clip's end, frames that are alike
    take the place of the first, and the one after them goes on from its own; towards the beginning, the first of them
    to be met is as far away as the last.
    """
    extras = np.arange(LEAST, MOST + 1)
    step = extras[None, :] - extras[:, None]  # from the row's state to the column's
    usual = np.where(step == 0, 0.0, np.where(step < -1, np.inf, JUMP_COST + 0.05 * np.abs(step)))
    beside = _stood_in(twins, sign)
    cost = np.where(extras == 0, 0.0, np.inf)
    back = np.zeros(table.shape, np.int64)
    for n in range(len(table)):
        price = usual
        if twins.alike[n]:
            price = np.where(step == -1, 0.0, usual + (JUMP_COST if twins.lit[n] else TWIN_COST))
        elif beside[n]:
            price = np.where((step > 0) & (step <= beside[n]), TWIN_COST, usual)
        whole = cost[:, None] + price
        back[n] = whole.argmin(axis=0)
        cost = whole.min(axis=0) + table[n]
    state = int(cost.argmin())
    course = np.empty(len(table), np.int64)
    for n in range(len(table) - 1, -1, -1):
        course[n] = extras[state]
        state = int(back[n, state])
    return course


def _stood_in(twins: Twins, sign: int) -> Integers:
    """Return for how many frames those just behind each one (ahead of it where ``sign`` is -1) may stand in, (frame,):
    all of a run that are lit, or one in the dark, where several look alike by themselves."""
    count = np.zeros(len(twins.alike), np.int64)
    alike, lit = twins.turned(sign)
    for n in range(1, len(alike)):
        count[n] = max(count[n - 1] + 1 if lit[n - 1] else 0, int(alike[n - 1]))
    return count[::sign]


def _repeats_alone(course: Integers, twins: Twins, sign: int) -> bool:
    """Return whether a course is nothing but lit frames that stand in for others."""
    steps, beside = np.diff(course, prepend=0), _stood_in(twins, sign)
    told = np.where(twins.alike & twins.lit, steps == -1, (steps >= 0) & (steps <= beside))
    return bool(twins.lit.any() and told.all() and course[-1] == 0)
