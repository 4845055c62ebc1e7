"""The strobe that a fit found, with every flash under the name of its light, and how these names are known.

The cycle's marker tells them (``turns``), or the user (``first_light``), or they are a guess.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from psvideo.errors import PsvideoError
from psvideo.model.first_light import TOGETHER, first_lit, is_called
from psvideo.model.plan import HasLights, Plan
from psvideo.model.timing import Order
from psvideo.sync.flashes_seen import flashes_of_fit
from psvideo.sync.marks import marks_of
from psvideo.sync.rowfit.beat import Beat
from psvideo.sync.rowfit.fit import ClipFit
from psvideo.sync.turns import turns


@dataclass(frozen=True, kw_only=True)
class FoundStrobe:
    """The fit of a clip whose beat names every flash, and how these names are known."""

    found: ClipFit
    order: Order


def named_strobe(
    plan: Plan,
    found: ClipFit,
    first_light: str | None,
    indices: NDArray[np.int64],
    breaks: tuple[bool, bool] = (False, False),
) -> FoundStrobe:
    """Return the strobe of a fit of some frames (frame,), which lie at the places ``indices`` by their numbering.

    ``first_light`` is the user's word for the first complete flash's light, None where the picture must tell;
    ``breaks`` says whether the frames begin and end where the strobe did, amid a take. Raises PsvideoError where
    ``first_light`` cannot be right.
    """
    beat, order, apart_s = _order_of_lights(plan, found, first_light, indices, breaks)
    error_s = float(np.hypot(found.fit.shift_error_s, apart_s))
    return FoundStrobe(found=replace(found, fit=replace(found.fit, beat=beat, shift_error_s=error_s)), order=order)


def _order_of_lights(
    plan: Plan, found: ClipFit, first_light: str | None, indices: NDArray[np.int64], breaks: tuple[bool, bool]
) -> tuple[Beat, Order, float]:
    """Return the beat whose names are right, how they are known, and by how much times are wrong if they are not."""
    if len(plan.cycle_slots) == 1:
        return found.fit.beat, "given", 0.0
    candidates = turns(plan, found.rows, found.fit.beat)
    if first_light is not None:
        firsts = [_first_complete(plan, found, beat, indices, breaks) for beat in candidates.beats]
        return _given_order(candidates.beats, firsts, first_light), "given", 0.0
    return candidates.beats[0], "marker" if candidates.sure else "guess", candidates.apart_s


def _given_order(alike: Sequence[Beat], firsts: Sequence[HasLights | None], first_light: str) -> Beat:
    for beat, first in zip(alike, firsts, strict=True):
        if first is not None and is_called(first, first_light):
            return beat
    seen = firsts[0]
    raise PsvideoError(
        f"`first_light` {first_light} does not fit the footage: by the cycle's marker the clip's first complete flash "
        f"is {TOGETHER.join(seen.lit) if seen else 'none'}'s. Leave the option out, or check that plan.toml is the plan"
        " that the strobe played."
    )


def _first_complete(
    plan: Plan, found: ClipFit, beat: Beat, indices: NDArray[np.int64], breaks: tuple[bool, bool]
) -> HasLights | None:
    """Return the first lit flash that the timing will call complete, if the beat's names are right."""
    named = replace(found, fit=replace(found.fit, beat=beat))
    marks = marks_of(plan, named, flashes_of_fit(plan, found, beat), indices, breaks)
    return first_lit(flash for flash in marks.fired if flash.complete)
