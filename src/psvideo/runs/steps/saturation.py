"""Some of a take's frames, looked at for light that the sensor clipped and the plan does not know of."""

from psvideo.clip import Take, read_frames
from psvideo.report.judge.of_saturation import hidden_saturation
from psvideo.report.judgement import Judgement
from psvideo.report.observe.hidden_level import may_hide, numbers_to_look_at


def saturation_of(take: Take) -> Judgement | None:
    """Judge whether a take's sensor saturates at a level that its plan does not name; None where that does not show."""
    if not may_hide(take.clip):
        return None
    numbers = numbers_to_look_at(take.clip, take.numbers)
    frames = [frame.image for frame in read_frames(take.clip, numbers, kept=take.kept)]
    return hidden_saturation(frames, take.clip)
