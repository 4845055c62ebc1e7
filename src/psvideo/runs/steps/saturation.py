"""Some of a take's frames, looked at for light that the plan misreads: clipped unseen, or below black."""

from psvideo.clip import Take, read_frames
from psvideo.report.judge.of_saturation import below_black, hidden_saturation
from psvideo.report.judgement import Judgement
from psvideo.report.observe.hidden_level import may_hide, may_lie_below, numbers_to_look_at


def saturation_of(take: Take) -> Judgement | None:
    """Judge whether a take's sensor saturates at a level that its plan does not name, or all of its light lies below
    black; None where neither shows."""
    if not (may_lie_below(take.clip) or may_hide(take.clip)):
        return None
    numbers = numbers_to_look_at(take.clip, take.numbers)
    frames = [frame.image for frame in read_frames(take.clip, numbers, kept=take.kept)]
    below = below_black(frames, take.clip) if may_lie_below(take.clip) else None
    return below or (hidden_saturation(frames, take.clip) if may_hide(take.clip) else None)
