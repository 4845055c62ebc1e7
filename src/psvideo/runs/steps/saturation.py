"""Some of a take's frames, looked at for light that the plan misreads: clipped unseen, below black, or measured by the
white of other files."""

import numpy as np
from numpy.typing import NDArray

from psvideo.clip import Take, read_frames
from psvideo.report.judge.of_saturation import below_black, brightest, hidden_saturation, unreachable_white
from psvideo.report.judgement import Judgement
from psvideo.report.observe.hidden_level import may_hide, may_lie_below, numbers_to_look_at, rising_samples


def saturation_of(take: Take) -> Judgement | None:
    """Judge whether a take's sensor saturates at a level that its plan does not name, its plan's white is none of its
    codes, or all of its light lies below black; None where none of it shows. One frame in light is held at a time."""
    clip, tops, thin = take.clip, list[float](), list[NDArray[np.float32]]()
    if unreachable := unreachable_white(clip):
        return unreachable
    if not (may_lie_below(clip) or may_hide(clip)):
        return None
    for frame in read_frames(clip, numbers_to_look_at(clip, take.numbers), kept=take.kept):
        image = frame.image
        tops.append(brightest(image) if may_lie_below(clip) else 0.0)
        thin.append(rising_samples(image))
        del frame, image
    below = below_black(max(tops, default=0.0), clip) if may_lie_below(clip) else None
    return below or (hidden_saturation(thin, clip) if may_hide(clip) else None)
