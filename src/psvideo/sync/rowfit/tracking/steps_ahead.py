"""How many frames are missing or repeated just ahead: the cheapest course of the next block through places in time.

Brightnesses found so far predict each frame at every place that it may have; a Viterbi search picks the course, in
which a step between frames other than the one that the numbering gives costs something.
"""

from dataclasses import replace

import numpy as np

from psvideo.model.arrays import Doubles, Integers, Mask
from psvideo.model.plan import Plan
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.profiles import Profiles, brightnesses, predictions, unexplained
from psvideo.sync.rowfit.tracking.losses import SUSPICIOUS, frame_losses, losses_of

BLOCK = 16
"""Frames that are looked for at a time."""
LEAST, MOST = -6, 24
"""Frames that may be repeated (less than none) or missing at one place without a hole in the numbering."""
JUMP_COST = 2.0
"""What an unexpected step costs, in mean losses of a frame (a frame at a wrong time costs 1 to 3)."""
TWIN_COST = 0.2
"""What it costs to take a frame that looks exactly like the one before it for the same moment."""
MOST_GAIN = 4.0
"""A camera changes its exposure by no more stops than two at once."""
HOLDS = 1.0
"""A step is believed where it takes away this share of the frames' losses once brightnesses are fitted again."""


def steps_ahead(plan: Plan, rows: Profiles, beat: Beat, known: slice, block: slice, twins: Mask, sign: int) -> Integers:
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
    same = twins[block] if sign > 0 else np.append(twins[block][1:], twins[block.stop])
    if not same.any() and (_calm(loss, usual) or _calm(_losses_but_for_gain(plan, learnt, ahead, beat, light), usual)):
        return np.zeros(len(loss), np.int64)
    extras = np.arange(LEAST, MOST + 1)
    shifted = [replace(ahead, index=ahead.index + sign * int(extra)) for extra in extras]
    table = np.stack([losses_of(plan, learnt, one, beat, light) for one in shifted], axis=1)
    course = _cheapest(table, same) if sign > 0 else _cheapest(table[::-1], same[::-1])[::-1]
    if course.any() and not _holds(plan, rows, beat, known, block, course, sign):
        course = np.zeros(len(loss), np.int64)
    nearer = max(len(loss) // 2, min(len(loss), 4))
    return course[:nearer] if sign > 0 else course[-nearer:]


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
    count = len(rows.value)
    span = (
        slice(known.start, min(block.stop + BLOCK, count))
        if sign > 0
        else slice(max(block.start - BLOCK, 0), known.stop)
    )
    stayed, went = rows.take(span), replace(rows, index=with_steps(rows.index, block, course, sign)).take(span)
    gain = frame_losses(stayed, unexplained(plan, stayed, beat)) - frame_losses(went, unexplained(plan, went, beat))
    return float(gain.sum()) > HOLDS


def _cheapest(table: Doubles, twin: Mask) -> Integers:
    """Return the course of least cost through a table (frame, extra); no frame comes before the one before it."""
    extras = np.arange(LEAST, MOST + 1)
    step = extras[None, :] - extras[:, None]  # from the row's state to the column's
    usual = np.where(step == 0, 0.0, np.where(step < -1, np.inf, JUMP_COST + 0.05 * np.abs(step)))
    after_twin = np.where(step == 1, TWIN_COST, usual)
    to_twin = np.where(step == -1, 0.0, usual + TWIN_COST)
    cost = np.where(extras == 0, 0.0, np.inf)
    back = np.zeros(table.shape, np.int64)
    for n in range(len(table)):
        price = to_twin if twin[n] else after_twin if n and twin[n - 1] else usual
        whole = cost[:, None] + price
        back[n] = whole.argmin(axis=0)
        cost = whole.min(axis=0) + table[n]
    state = int(cost.argmin())
    course = np.empty(len(table), np.int64)
    for n in range(len(table) - 1, -1, -1):
        course[n] = extras[state]
        state = int(back[n, state])
    return course
