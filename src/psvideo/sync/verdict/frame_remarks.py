"""What people should know of how a clip's frames follow one another: regular patterns, and ends that fit no place."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from psvideo.model.plan import Plan
from psvideo.model.units import show_seconds
from psvideo.sync.rowfit.coarse.retime import regular_step
from psvideo.sync.rowfit.fit import ClipFit

MANY = 4
"""Where this many frames or more are missing in one place, a strobe that started again is as likely."""


def remarks_on_frames(plan: Plan, found: ClipFit, numbered: NDArray[np.int64]) -> Iterator[str]:
    """Yield what is odd about how the frames follow one another."""
    index, rate = found.track.index, float(plan.camera.fps)
    step = regular_step(index, numbered)
    shown = f"{rate / float(step):.6g} frames a second" if step != 1 else ""
    if step.denominator == 1 and step > 1:
        yield (
            f"The clip holds one of every {step} frames that the plan's {rate:.6g} frames a second ask for: it was "
            f"thinned to {shown}, or fps in the plan is {step} times too high."
        )
    elif step > 1:
        yield (
            f"The clip holds {step.denominator} of every {step.numerator} frames, regularly, as a movie that was made "
            f"{shown} from {rate:.6g} by leaving frames out; what fell into the missing ones is lost."
        )
    elif step < 1:
        yield (
            f"Of every {step.denominator} frames the clip repeats {step.denominator - step.numerator}, regularly, as a "
            f"movie that was made {shown} from {rate:.6g}; repeated ones are left out."
        )
    if step == 1:
        yield from _many_missing(found, index, numbered)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], found.unlit.astype(np.int64), [0]])))
    for first, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        yield (
            f"No flash lights {end - first} frames in a row, {numbered[first]} to {numbered[end - 1]}: the strobe had "
            "not begun, had stopped, or was covered. They are left out."
        )
    lit = index[~found.unlit]
    for name, place in (("first", found.trusted[0] - lit[0]), ("last", lit[-1] - found.trusted[1])):
        if place:
            yield (
                f"The {name} frame (or the {name} few) fit no place in time, or more than one, as when frames are "
                f"missing beside them: flashes that they saw are marked as incomplete."
            )


def _many_missing(found: ClipFit, index: NDArray[np.int64], numbered: NDArray[np.int64]) -> Iterator[str]:
    """Say where so many frames are missing that it may be the strobe: both give the same picture."""
    missing = np.diff(index) - np.diff(numbered)
    for n in np.flatnonzero(missing >= MANY).tolist():
        yield (
            f"Behind frame {numbered[n]} the picture goes on as if {missing[n]} frames were missing that the numbers "
            "do not show. A strobe that started again may look the same: then the same flashes lie in the same frames, "
            f"but {show_seconds(float(missing[n]) * found.rows.period_s)} earlier than the times given."
        )
